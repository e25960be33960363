"""What the ONNX files of all networks share: the input, the novelty, the two outputs, weights as f16.

Input `boundary` [N, 733]: coordinates [mm] and density [g/m^2]. Outputs `normalised` [N, 12], six means of the normalised
logarithms and six logarithms of their sigmas, and `novelty` [N, 1], the rms distance [mm] per point of a rim from the space
of the training rims. A file may hold several networks that were trained alike but for their seed: then the answer is the mixture of theirs.
"""

from contextlib import contextmanager

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

INPUTS = 733
LOG_SIGMA = (-7.0, 1.0)  # limits of a log-sigma; both far from any that training reaches


class Graph:
    def __init__(self, name):
        self.name, self.nodes, self.constants, self.members, self.prefix = name, [], [], [], ""

    @contextmanager
    def member(self):
        """What is added within is of one more network: its names are its own, and it has its own heads."""
        self.prefix = f"{len(self.members)}/"
        self.members.append(([], []))
        yield
        self.prefix = ""

    def constant(self, name, array):
        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(array), self.prefix + name))
        return self.prefix + name

    def node(self, kind, inputs, output, **attributes):
        output = self.prefix + output
        self.nodes.append(helper.make_node(kind, inputs, [output], name=output, **attributes))
        return output

    def weight(self, name, array):
        """Weights stored as f16 and cast to f32 in the graph."""
        half = self.constant(f"{name}_w16", np.asarray(array).astype(np.float16))
        return self.node("Cast", [half], f"{name}_w", to=TensorProto.FLOAT)

    def centred(self, centre, subspace):
        """The input less the training's mean `centre` (733,), and beside it the output `novelty`, from `subspace` (732, k), the orthonormal
        principal directions of the training rims."""
        x = self.node("Sub", ["boundary", self.constant("centre", np.float32(centre))], "centred")
        # Distance from the training rims: what is left of the coordinates outside the subspace.
        directions = self.constant("subspace", np.float32(np.pad(subspace, ((0, 1), (0, 0)))))
        along = self.node("MatMul", [x, directions], "along")
        inside = self.node("MatMul", [along, self.node("Transpose", [directions], "subspace_t")], "inside")
        mask = self.constant("coordinates", np.float32(np.append(np.ones(INPUTS - 1), 0.0)))
        left = self.node("Sub", [self.node("Mul", [x, mask], "offset"), inside], "left")
        per_point = self.constant("per_point", np.full((INPUTS, 1), 3.0 / (INPUTS - 1), np.float32))
        squared = self.node("MatMul", [self.node("Mul", [left, left], "left_sq"), per_point], "novelty_sq")
        self.node("Sqrt", [squared], "novelty")
        return x

    def dense(self, x, layer, name):
        """A fully connected layer (weight, bias)."""
        weight, bias = layer
        return self.node("Gemm", [x, self.weight(name, weight), self.constant(f"{name}_b", np.float32(bias))], name)

    def heads(self, x, layer, stream):
        """The last layer of one of the two streams: three means and three log-sigmas."""
        weight, bias = (np.asarray(part) for part in layer)
        for of, part, columns in zip(self.members[-1], ("mean", "log_sigma"), (slice(0, 3), slice(3, 6))):
            of.append(self.dense(x, (weight[:, columns], bias[columns]), f"{stream}_{part}"))

    def mixed(self, means, log_sigmas):
        """Mean and log-sigma of the mixture of Gaussians, all as likely as each other."""
        share = self.constant("share", np.float32(1.0 / len(means)))

        def average(values, name):
            for k, value in enumerate(values):
                total = value if k == 0 else self.node("Add", [total, value], f"{name}_to_{k}")
            return self.node("Mul", [total, share], name)

        mean = average(means, "mean")
        squares = []
        for k, (own, log_sigma) in enumerate(zip(means, log_sigmas)):
            off = self.node("Sub", [own, mean], f"off_{k}")
            variance = self.node("Exp", [self.node("Add", [log_sigma, log_sigma], f"log_variance_{k}")], f"variance_{k}")
            squares.append(self.node("Add", [variance, self.node("Mul", [off, off], f"off_sq_{k}")], f"square_{k}"))
        half = self.constant("half", np.float32(0.5))
        return mean, self.node("Mul", [self.node("Log", [average(squares, "variance")], "log_variance"), half], "log_sigma")

    def finished(self):
        """The file's bytes, once both streams of all networks have their heads."""
        limits = [self.constant(f"log_sigma_{k}", np.float32(v)) for k, v in zip(("min", "max"), LOG_SIGMA)]
        each = []
        for k, (means, log_sigmas) in enumerate(self.members):
            raw = self.node("Concat", log_sigmas, f"log_sigma_raw_{k}", axis=1)
            each.append((self.node("Concat", means, f"mean_{k}", axis=1), self.node("Clip", [raw, *limits], f"log_sigma_{k}")))
        answer = each[0] if len(each) == 1 else self.mixed(*zip(*each))
        self.node("Concat", answer, "normalised", axis=1)
        value = lambda name, width: helper.make_tensor_value_info(name, TensorProto.FLOAT, ["N", width])
        outputs = [value("normalised", 12), value("novelty", 1)]
        graph = helper.make_graph(self.nodes, self.name, [value("boundary", INPUTS)], outputs, self.constants)
        model = helper.make_model(graph, producer_name="scan2params", opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
        onnx.checker.check_model(model)
        return model.SerializeToString()
