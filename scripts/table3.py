#!/usr/bin/env python3
"""The paper's networks at the paper's protocol on a folder of canonical drops: its Table 3, with learning curves.

    scan2params generate --prior knit-2020 --canonical --count 1280 --seed 1 --out data/canonical
    python scripts/table3.py --data data/canonical --out table3.json

Protocol (Ju and Choi 2020, section V): clean rims and the density min-max to [0, 1], logarithms of the stiffnesses likewise, nine tenths
of the fabrics to train and a tenth to test, Adam, mean squared error, batches of 32, 100 epochs. The learning rate is ours (the paper
has none). SNN is two streams of 4096-3072-8192, NN one, /k has widths divided by k, B has every other point of the rim, LR is linear
regression (-D without density). Beside them `ring`, the shipped network's layers as `train.py --clean --epochs 500 --learning-rate 2e-3 --dropout 0` trains
them: eight symmetric copies, no density; `ring x3` is the mean of three. Clean rims of canonical drops are one to one with the fabric, so that long training pays, which it does not on perturbed ones.

Each is trained on the first 1/8, 1/4, 1/2 and all of the training rows and tested on the same rows; RMSE and R2 as `train.scores` has them. The
extrapolation is a power of the number of rows through the last three sizes: what a curve that goes on as it is would give.
"""

import argparse
import json
import pathlib
import re
import time
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np

import drape_data
import train
from snn import PAPER_WIDTHS

SHARES = (0.125, 0.25, 0.5, 1.0)
PAPER_ROWS = 90_000
LEARNING_RATE = 1e-4
BATCH, EPOCHS = 32, 100
# Every other point of a side: 10 mm.
COARSE = np.arange(drape_data.POINTS).reshape(4, drape_data.POINTS_PER_SIDE)[:, ::2].ravel()
RIDGE = 1e-3


def parse_args():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--data", required=True, type=pathlib.Path, help="folder of `scan2params generate --canonical`")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="JSON; what is there is kept, so that a broken run goes on")
    parser.add_argument("--nets", nargs="+", default=["LR", "LR-D", "SNN/8", "SNN/4", "NN/4", "SNN/B/4", "SNN/2", "ring"])
    parser.add_argument("--sizes", nargs="+", type=float, default=SHARES, metavar="SHARE",
        help="of the training rows; all four take the SNN twelve minutes on two cores")
    parser.add_argument("--test-share", type=float, default=0.1)
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


class Rows:
    """Inputs and targets of the paper's protocol, scaled by the training rows."""

    def __init__(self, drapes, rows, points=slice(None), density=True):
        self.drapes, self.points, self.density = drapes, points, density
        lo, hi = drape_data.ln_box(drapes.manifest)
        self.ln_min, self.width = lo, hi - lo
        x = self.raw(rows)
        self.least, self.range = x.min(0), np.maximum(x.max(0) - x.min(0), train.LEAST_RANGE)

    def raw(self, rows):
        x = self.drapes.boundary[rows][:, self.points].reshape(len(rows), -1)
        return np.concatenate([x, self.drapes.density[rows, None]], axis=1) if self.density else x

    def inputs(self, rows):
        return ((self.raw(rows) - self.least) / self.range).astype(np.float32)

    def targets(self, rows):
        return ((np.log(self.drapes.stiffness[rows]) - self.ln_min) / self.width).astype(np.float32)


def streams_init(key, inputs, widths, outputs):
    def stream(key, count):
        sizes = [inputs, *widths, count]
        keys = jax.random.split(key, len(sizes))
        return [(jax.random.normal(k, (a, b)) * jnp.sqrt(2.0 / a), jnp.zeros(b)) for k, a, b in zip(keys, sizes, sizes[1:])]

    return [stream(k, count) for k, count in zip(jax.random.split(key, len(outputs)), outputs)]


def streams_apply(params, x):
    outputs = []
    for layers in params:
        h = x
        for weight, bias in layers[:-1]:
            h = jax.nn.relu(h @ weight + bias)
        outputs.append(h @ layers[-1][0] + layers[-1][1])
    return jnp.concatenate(outputs, axis=1)


def trained(x, y, widths, outputs, seed):
    """The network as a function of scaled inputs; Adam, mean squared error."""
    steps = max(len(x) // BATCH, 1)
    x, y = jnp.asarray(x), jnp.asarray(y)
    params = streams_init(jax.random.key(seed), x.shape[1], widths, outputs)
    zeros = jax.tree.map(jnp.zeros_like, params)

    def step(state, pick):
        params, m, v, t = state
        grad = jax.grad(lambda p: ((streams_apply(p, x[pick]) - y[pick]) ** 2).mean())(params)
        t = t + 1
        m, v, down = train.adam(m, v, grad, t)
        return (jax.tree.map(lambda p, d: p - LEARNING_RATE * d, params, down), m, v, t), None

    @jax.jit
    def epoch(state, number):
        picks = jax.random.permutation(jax.random.fold_in(jax.random.key(seed + 1), number), len(x))
        return jax.lax.scan(step, state, picks[: steps * BATCH].reshape(steps, -1))[0]

    state = (params, zeros, zeros, jnp.float32(0.0))
    for number in range(EPOCHS):
        state = epoch(state, number)
    return lambda inputs: np.asarray(streams_apply(state[0], jnp.asarray(inputs)))


def linear(x, y):
    """Least squares with the ridge that the doubled corners need."""
    one = lambda x: np.concatenate([x.astype(np.float64), np.ones((len(x), 1))], axis=1)
    a = one(x)
    solution = np.linalg.solve(a.T @ a + RIDGE * np.eye(a.shape[1]), a.T @ y)
    return lambda inputs: one(inputs) @ solution


def streams_of(name):
    """Widths, outputs of each stream, and points of `SNN/4`, `NN`, `SNN/B/4` and the like."""
    kind, coarse, divide = re.fullmatch(r"(SNN|NN)(/B)?(?:/(\d+))?", name).groups()
    widths = [w // int(divide or 1) for w in PAPER_WIDTHS]
    return widths, (3, 3) if kind == "SNN" else (6,), COARSE if coarse else slice(None)


def scores_of(name, drapes, rows, tests, seed):
    """RMSE and R2 of a network trained on `rows`, on `tests`."""
    if rings := re.fullmatch(r"ring(?: x(\d+))?", name):
        return ring_scores(drapes, rows, tests, seed, int(rings[1] or 1))
    return paper_scores(name, drapes, rows, tests, seed)


def ring_scores(drapes, rows, tests, seed, members):
    """`train.py --nets ring --clean`, tested on the same rows."""
    args = SimpleNamespace(
        seed=seed, members=members, channels=[48, 96], hidden=256, dilations=[1, 2, 4], epochs=500, batch=64, learning_rate=2e-3,
        weight_decay=1e-2, dropout=0.0, mse_share=0.4,
    )
    symmetries = drape_data.symmetries()
    scaling = train.Scaling(drapes, rows, symmetries)
    model, _, _ = train.exported("ring", drapes, rows, scaling, symmetries, drape_data.Noise.none(), args)
    network = train.Network(model, symmetries, scaling.asked_density, scaling.width)
    mean, _ = network(drapes.boundary[tests], drapes.density[tests].astype(np.float32))
    return train.scores(mean, scaling.normalised(drapes.stiffness[tests]), scaling)


def paper_scores(name, drapes, rows, tests, seed):
    box = SimpleNamespace(width=1.0, paper_range=1.0)  # targets are over the prior's box already
    if name.startswith("LR"):
        data = Rows(drapes, rows, density=name == "LR")
        answer = linear(data.inputs(rows), data.targets(rows))
    else:
        widths, outputs, points = streams_of(name)
        data = Rows(drapes, rows, points)
        answer = trained(data.inputs(rows), data.targets(rows), widths, outputs, seed)
    return train.scores(answer(data.inputs(tests)), data.targets(tests), box)


def extrapolated(sizes, errors):
    """RMSE at the paper's rows by a power law through the last three sizes, and its exponent; none from fewer sizes."""
    if len(sizes) < 3:
        return None, None
    last = np.argsort(sizes)[-3:]
    power, constant = np.polyfit(np.log(np.take(sizes, last)), np.log(np.take(errors, last)), 1)
    return float(np.exp(constant + power * np.log(PAPER_ROWS))), float(power)


def main():
    args = parse_args()
    drapes = drape_data.read_folder(args.data)
    rows, _, tests = drape_data.split_by_group(drapes.group, args.seed, [1.0 - args.test_share, 0.0, args.test_share])
    sizes = [round(len(rows) * share) for share in args.sizes]
    named = {"data": str(args.data), "rows": len(drapes.density), "left_out": drapes.left_out, "tests": len(tests), "seed": args.seed}
    found = json.loads(args.out.read_text()) if args.out.exists() else {**named, "nets": {}}
    if {k: found[k] for k in named} != named:
        raise SystemExit(f"{args.out}: of other data or another seed; give another file")
    for name in args.nets:
        own = found["nets"].setdefault(name, {"sizes": [], "rmse": [], "r2": [], "rmse_each": [], "seconds": []})
        for size in [size for size in sizes if size not in own["sizes"]]:
            start = time.time()
            scores = scores_of(name, drapes, rows[:size], tests, args.seed)
            own["sizes"].append(size)
            for key in ("rmse", "r2", "rmse_each"):
                own[key].append(scores[key])
            own["seconds"].append(round(time.time() - start, 1))
            args.out.write_text(json.dumps(found, indent=1) + "\n")
        own["at_90000"], own["power"] = extrapolated(own["sizes"], own["rmse"])
        args.out.write_text(json.dumps(found, indent=1) + "\n")
    print("net      " + "".join(f"{size:>9d}" for size in sizes) + f"{'R2':>9s}{'power':>9s}{PAPER_ROWS:>9d}")
    for name in args.nets:
        own = found["nets"][name]
        errors = dict(zip(own["sizes"], own["rmse"]))
        line = [*(errors.get(size) for size in sizes), own["r2"][int(np.argmax(own["sizes"]))], own["power"], own["at_90000"]]
        print(f"{name:9s}" + "".join("        -" if value is None else f"{value:9.4f}" for value in line))


if __name__ == "__main__":
    main()
