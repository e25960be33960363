"""The SNN: two streams of fully connected ReLU layers, one for (S^u, S^v, H), one for
(B^u, B^v, B^h), after Ju and Choi 2020; with a log-sigma beside each mean, which the paper lacks.

Input: 733 numbers, coordinates [mm] and density [g/m^2], min-max to [0, 1] and centred on the
training mean (the centring is not in the paper: without it f16 weights lose digits to cancellation).
Output: 12 numbers, six means of the min-max logarithms, six logarithms of their sigmas.
"""

import jax
import jax.numpy as jnp
import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

INPUTS = 733
PAPER_WIDTHS = (4096, 3072, 8192)
LOG_SIGMA = (-7.0, 1.0)  # limits of a log-sigma; both far from any that training reaches


def init(key, widths):
    """Parameters of both streams: a list of (weight, bias) per stream."""

    def stream(key):
        sizes = [INPUTS, *widths, 6]
        layers = []
        for key, fan_in, fan_out in zip(jax.random.split(key, len(sizes)), sizes, sizes[1:]):
            gain = 2.0 if fan_out != 6 else 0.01
            weight = jax.random.normal(key, (fan_in, fan_out)) * jnp.sqrt(gain / fan_in)
            layers.append((weight, jnp.zeros(fan_out)))
        # Inputs lie within about 0.2 of their mean, so that the first layer needs more gain.
        layers[0] = (layers[0][0] * 3.0, layers[0][1])
        # Means start in the middle of [0, 1], sigmas at 0.2.
        layers[-1] = (layers[-1][0], jnp.array([0.5] * 3 + [float(np.log(0.2))] * 3))
        return layers

    return [stream(k) for k in jax.random.split(key, 2)]


def apply(params, x, dropout_key=None, dropout=0.0):
    """(rows, 733) normalised inputs to means (rows, 6) and log-sigmas (rows, 6)."""
    outputs = []
    for s, layers in enumerate(params):
        h = x
        for i, (weight, bias) in enumerate(layers[:-1]):
            h = jax.nn.relu(h @ weight + bias)
            if dropout_key is not None and dropout > 0.0:
                keep = jax.random.bernoulli(jax.random.fold_in(dropout_key, 10 * s + i), 1.0 - dropout, h.shape)
                h = jnp.where(keep, h / (1.0 - dropout), 0.0)
        outputs.append(h @ layers[-1][0] + layers[-1][1])
    mean = jnp.concatenate([o[:, :3] for o in outputs], axis=1)
    log_sigma = jnp.concatenate([o[:, 3:] for o in outputs], axis=1)
    return mean, jnp.clip(log_sigma, *LOG_SIGMA)


def to_onnx(params, centre, scale, subspace):
    """The network as ONNX bytes: input `boundary` [N, 733] raw, outputs `normalised` [N, 12] and
    `novelty` [N, 1], the rms distance [mm] per point of a rim from `subspace` (732, k), the
    orthonormal principal directions of the training rims.
    Weights are stored as f16 and cast to f32 in the graph."""
    nodes, constants = [], []

    def constant(name, array):
        constants.append(numpy_helper.from_array(np.ascontiguousarray(array), name))
        return name

    def node(kind, inputs, output, **attributes):
        nodes.append(helper.make_node(kind, inputs, [output], name=output, **attributes))
        return output

    x = node("Sub", ["boundary", constant("centre", np.float32(centre))], "centred")
    # Distance from the training rims: what is left of the coordinates outside the subspace.
    directions = constant("subspace", np.float32(np.pad(subspace, ((0, 1), (0, 0)))))
    inside = node("MatMul", [node("MatMul", [x, directions], "along"), node("Transpose", [directions], "subspace_t")], "inside")
    mask = constant("coordinates", np.float32(np.append(np.ones(INPUTS - 1), 0.0)))
    left = node("Sub", [node("Mul", [x, mask], "offset"), inside], "left")
    per_point = constant("per_point", np.full((INPUTS, 1), 3.0 / (INPUTS - 1), np.float32))
    node("Sqrt", [node("MatMul", [node("Mul", [left, left], "left_sq"), per_point], "novelty_sq")], "novelty")

    x = node("Mul", [x, constant("scale", np.float32(scale))], "scaled")
    means, log_sigmas = [], []
    for stream, layers in zip(("stretch", "bending"), params):
        h = x
        for i, (weight, bias) in enumerate(layers):
            weight, bias = np.asarray(weight), np.asarray(bias)
            last = i == len(layers) - 1
            parts = [("mean", slice(0, 3)), ("log_sigma", slice(3, 6))] if last else [("", slice(None))]
            for part, columns in parts:
                name = f"{stream}_{part or i}"
                half = constant(f"{name}_w16", weight[:, columns].astype(np.float16))
                full = node("Cast", [half], f"{name}_w", to=TensorProto.FLOAT)
                out = node("Gemm", [h, full, constant(f"{name}_b", np.float32(bias[columns]))], name)
                if part == "mean":
                    means.append(out)
                elif part == "log_sigma":
                    log_sigmas.append(out)
            if not last:
                h = node("Relu", [out], f"{name}_relu")
    mean = node("Concat", means, "mean", axis=1)
    limits = [constant("log_sigma_min", np.float32(LOG_SIGMA[0])), constant("log_sigma_max", np.float32(LOG_SIGMA[1]))]
    log_sigma = node("Clip", [node("Concat", log_sigmas, "log_sigma_raw", axis=1), *limits], "log_sigma")
    node("Concat", [mean, log_sigma], "normalised", axis=1)
    value = lambda name, width: helper.make_tensor_value_info(name, TensorProto.FLOAT, ["N", width])
    graph = helper.make_graph(nodes, "snn", [value("boundary", INPUTS)], [value("normalised", 12), value("novelty", 1)], constants)
    model = helper.make_model(graph, producer_name="scan2params", opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.checker.check_model(model)
    return model.SerializeToString()
