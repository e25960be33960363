"""The SNN: two streams of fully connected ReLU layers, one for (S^u, S^v, H), one for
(B^u, B^v, B^h), after Ju and Choi 2020; with a log-sigma beside each mean, which the paper lacks.

Input: 733 numbers, coordinates [mm] and density [g/m^2], min-max to [0, 1] and centred on the
training mean (the centring is not in the paper: without it f16 weights lose digits to cancellation).
Output: 12 numbers, six means of the min-max logarithms, six logarithms of their sigmas.
"""

import jax
import jax.numpy as jnp
import numpy as np

from graph import INPUTS, LOG_SIGMA, Graph

PAPER_WIDTHS = (4096, 3072, 8192)


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


def to_onnx(members, centre, scale, subspace):
    """The networks with these parameters as ONNX bytes (scripts/graph.py): raw inputs less `centre` (733,) times `scale` (733,)."""
    graph = Graph("snn")
    x = graph.centred(centre, subspace)
    x = graph.node("Mul", [x, graph.constant("scale", np.float32(scale))], "scaled")
    for params in members:
        with graph.member():
            for stream, layers in zip(("stretch", "bending"), params):
                h = x
                for i, layer in enumerate(layers[:-1]):
                    h = graph.node("Relu", [graph.dense(h, layer, f"{stream}_{i}")], f"{stream}_{i}_relu")
                graph.heads(h, layers[-1], stream)
    return graph.finished()
