"""The ring network: convolutions along the closed rim, then two streams as in the SNN.

A fold looks alike wherever on the rim it lies, and where it lies is chance; a fully connected layer has to learn every fold at every
place. Here each point is seen in its own frame (radial, up, along the flat rim's circle), the first layers share
their weights along the rim, and only where in the weave a point lies (harmonics of its angle in the flat specimen) tells places
apart. The 240 different points of the rim lie evenly, and strides divide a side, so that a quarter turn of the specimen is a shift of the network.

Input: 732 coordinates less the training's mean [mm]; the density is not looked at, since the network is asked for one density.
Output: as the SNN's.
"""

import jax
import jax.numpy as jnp
import numpy as np

import drape_data
from graph import LOG_SIGMA, Graph

# Of the 244 points those that are not a corner a second time.
POINTS = np.array([k for k in range(drape_data.POINTS) if (k + 1) % drape_data.POINTS_PER_SIDE])
LENGTH_MM = 20.0  # by which coordinates are divided
STREAMS = ("stretch", "bending")
# Points to a side of the window, stride; two layers take 240 places to 60.
ENTRY = ((9, 2), (5, 2))
WINDOW = 5


def places():
    """Angle [rad] of each of the 240 points in the flat specimen, and harmonics (240, 5): where in the weave it lies."""
    x, z = drape_data.flat_xz_mm()[POINTS].T
    angle, radius = np.arctan2(z, x), np.hypot(x, z)
    waves = [f(k * angle) for k in (2, 4) for f in (np.cos, np.sin)]
    return angle, np.stack([*waves, 4.0 * (radius / 150.0 - 1.15)], axis=1)


ANGLE, PLACES = places()
# (x, y, z) to (radial, up, along): b * OWN + b[..., ::-1] * OTHER
OWN = np.stack([np.cos(ANGLE), np.ones_like(ANGLE), np.cos(ANGLE)], axis=1)
OTHER = np.stack([np.sin(ANGLE), np.zeros_like(ANGLE), -np.sin(ANGLE)], axis=1)
# What the mean over the places is weighted with: nothing, and the harmonics that tell weft from warp and both from the bias.
POOLED = np.stack([np.ones(60), PLACES[::4, 0], PLACES[::4, 2]])


def window(count, width, stride=1, dilation=1):
    """(count / stride, width) the places that each of a layer's outputs looks at, round the ring."""
    return (np.arange(0, count, stride)[:, None] + dilation * (np.arange(width) - width // 2)) % count


def init(key, channels, hidden, dilations):
    """Parameters: dict of (weight, bias). `channels` (after the first layer, after the second and on), `hidden` of each stream."""
    keys = iter(jax.random.split(key, 4 + 2 * len(dilations) + 4))

    def layer(fan_in, fan_out, gain=2.0):
        return jax.random.normal(next(keys), (fan_in, fan_out)) * jnp.sqrt(gain / fan_in), jnp.zeros(fan_out)

    first, more = channels
    params = {
        "place": layer(ENTRY[0][0] * PLACES.shape[1], first)[:1],
        "entry_0": layer(ENTRY[0][0] * 3, first),
        "entry_1": layer(ENTRY[1][0] * first, more),
    }
    for dilation in dilations:
        params[f"block_{dilation}_in"] = layer(WINDOW * more, more)
        params[f"block_{dilation}_out"] = layer(more, more, 0.1)
    for stream in STREAMS:
        params[f"{stream}_hidden"] = layer(len(POOLED) * more, hidden)
        # Means start in the middle of [0, 1], sigmas at 0.2.
        weight, _ = layer(hidden, 6, 0.01)
        params[f"{stream}_heads"] = weight, jnp.array([0.5] * 3 + [float(np.log(0.2))] * 3)
    return params


def dilations_of(params):
    return sorted(int(name.split("_")[1]) for name in params if name.endswith("_in"))


def apply(params, offset, dropout_key=None, dropout=0.0):
    """(rows, 732) coordinates less the training's mean [mm] to means (rows, 6) and log-sigmas (rows, 6)."""
    rows = offset.shape[0]

    def seen(x, at):
        return x[:, at].reshape(rows, len(at), -1)

    def linear(x, name):
        weight, bias = params[name]
        return x @ weight + bias

    b = offset.reshape(rows, drape_data.POINTS, 3)[:, POINTS]
    x = (b * np.float32(OWN) + b[..., ::-1] * np.float32(OTHER)) / LENGTH_MM
    at = window(len(POINTS), *ENTRY[0])
    by_place = jnp.asarray(PLACES, jnp.float32)[at].reshape(len(at), -1) @ params["place"][0]
    x = jax.nn.relu(linear(seen(x, at), "entry_0") + by_place)
    x = jax.nn.relu(linear(seen(x, window(x.shape[1], *ENTRY[1])), "entry_1"))
    for dilation in dilations_of(params):
        inner = jax.nn.relu(linear(seen(x, window(x.shape[1], WINDOW, 1, dilation)), f"block_{dilation}_in"))
        x = x + linear(inner, f"block_{dilation}_out")
    x = jax.nn.relu(x)
    pooled = jnp.einsum("hp,rpc->rhc", np.float32(POOLED / POOLED.shape[1]), x).reshape(rows, -1)
    outputs = []
    for k, stream in enumerate(STREAMS):
        h = pooled
        if dropout_key is not None and dropout > 0.0:
            keep = jax.random.bernoulli(jax.random.fold_in(dropout_key, k), 1.0 - dropout, h.shape)
            h = jnp.where(keep, h / (1.0 - dropout), 0.0)
        outputs.append(linear(jax.nn.relu(linear(h, f"{stream}_hidden")), f"{stream}_heads"))
    mean = jnp.concatenate([o[:, :3] for o in outputs], axis=1)
    log_sigma = jnp.concatenate([o[:, 3:] for o in outputs], axis=1)
    return mean, jnp.clip(log_sigma, *LOG_SIGMA)


def to_onnx(members, centre, subspace):
    """The networks with these parameters as ONNX bytes (scripts/graph.py)."""
    graph = Graph("ring")
    node, constant = graph.node, graph.constant
    x = graph.centred(centre, subspace)
    # the last column is the density
    ends = [constant(f"coordinates_{k}", np.array([v])) for k, v in (("from", 0), ("to", 3 * drape_data.POINTS), ("axis", 1))]
    x = node("Reshape", [node("Slice", [x, *ends], "offset_only"), constant("points_shape", np.array([-1, drape_data.POINTS, 3]))], "all_points")
    x = node("Gather", [x, constant("points", POINTS.astype(np.int64))], "points_once", axis=1)
    turned = node("Gather", [x, constant("reversed", np.array([2, 1, 0]))], "points_reversed", axis=2)
    parts = [
        node("Mul", [b, constant(f"{name}_frame", np.float32(frame / LENGTH_MM))], f"{name}_part")
        for b, name, frame in ((x, "own", OWN), (turned, "other", OTHER))
    ]
    x = node("Add", parts, "in_own_frame")
    for params in members:
        with graph.member():
            add_member(graph, x, {name: [np.asarray(part) for part in layer] for name, layer in params.items()})
    return graph.finished()


def add_member(graph, x, params):
    """Adds one network to the graph; `x` (rows, 240, 3) are the points in their own frames."""
    node, constant = graph.node, graph.constant

    def seen(x, at, name):
        shown = node("Gather", [x, constant(f"{name}_at", at.astype(np.int64))], f"{name}_seen", axis=1)
        channels = params[name][0].shape[0]
        return node("Reshape", [shown, constant(f"{name}_shape", np.array([-1, len(at), channels]))], f"{name}_rows")

    def linear(x, name, bias=None):
        product = node("MatMul", [x, graph.weight(name, params[name][0])], f"{name}_product")
        bias = params[name][1] if bias is None else bias
        return node("Add", [product, constant(f"{name}_b", np.float32(bias))], name)

    at = window(len(POINTS), *ENTRY[0])
    # what the places alone add is the same for every rim
    by_place = PLACES[at].reshape(len(at), -1) @ params["place"][0].astype(np.float64) + params["entry_0"][1]
    x = node("Relu", [linear(seen(x, at, "entry_0"), "entry_0", by_place)], "entry_0_relu")
    at = window(len(at), *ENTRY[1])
    x = node("Relu", [linear(seen(x, at, "entry_1"), "entry_1")], "entry_1_relu")
    for dilation in dilations_of(params):
        name = f"block_{dilation}"
        inner = linear(seen(x, window(len(at), WINDOW, 1, dilation), f"{name}_in"), f"{name}_in")
        x = node("Add", [x, linear(node("Relu", [inner], f"{name}_relu"), f"{name}_out")], name)
    x = node("Relu", [x], "ring")
    x = node("MatMul", [constant("pooling", np.float32(POOLED / POOLED.shape[1])), x], "means_along")
    channels = params["entry_1"][0].shape[1]
    pooled = node("Reshape", [x, constant("pooled_shape", np.array([-1, len(POOLED) * channels]))], "pooled")
    for stream in STREAMS:
        hidden = node("Relu", [graph.dense(pooled, params[f"{stream}_hidden"], f"{stream}_hidden")], f"{stream}_relu")
        graph.heads(hidden, params[f"{stream}_heads"], stream)
