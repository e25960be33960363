#!/usr/bin/env python3
"""Train a network on folders of drapes, calibrate its intervals, export it for the estimator.

    python scripts/train.py --data DIR --out src/estimate/model/shipped.onnx

writes shipped.onnx and shipped.json beside it. Everything that is reported or calibrated is computed by
onnxruntime from the exported file, so that it holds for what is shipped. Deterministic by --seed
on one machine (XLA may order sums differently on another).

Flow: read rows at rest -> split by fabric (or walk) 80/10/10 -> train on the eight symmetric copies with
scan noise -> export -> calibrate 90 % intervals on the calibration fabrics (split conformal) ->
report on the test fabrics. Further networks of --nets are trained on the same rows and reported beside the first.

A drape at rest depends on stiffness over density alone, so that the network learns that: its targets are the stiffnesses of a cloth of
one density, whatever the specimen's, and the answer for another is in proportion.
"""

import argparse
import hashlib
import json
import pathlib
import shlex
import sys
import time
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import onnxruntime

import drape_data
import intervals
import ring
import snn

MODEL_SCHEMA = "scan2params/model/1"
# Smallest scale of an input, so that a coordinate that hardly moves is not blown up [mm, g/m^2].
LEAST_RANGE = 5.0


def parse_args():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--data", required=True, nargs="+", type=pathlib.Path, help="folders of `scan2params generate`, of one prior and seed, of any cells")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="the .onnx file; .json goes beside it")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--nets", nargs="+", choices=NETS, default=["ring"], help="the first is exported, others are trained to compare")
    parser.add_argument("--channels", type=int, nargs=2, default=[48, 96], help="ring: of the first layer, of those after it")
    parser.add_argument("--hidden", type=int, default=256, help="ring: width of each stream's layer")
    parser.add_argument("--dilations", type=int, nargs="+", default=[1, 2, 4], help="ring: of its blocks")
    parser.add_argument("--members", type=int, default=1, help="networks that differ in their seed; the answer is the mixture of theirs")
    parser.add_argument("--divide-widths", type=int, default=8, help="snn: of 4096-3072-8192: 1, 2, 4, 8, ...")
    parser.add_argument("--epochs", type=int, default=200)
    parser.add_argument("--batch", type=int, default=64)
    parser.add_argument("--learning-rate", type=float, default=1e-3)
    parser.add_argument("--weight-decay", type=float, default=1e-2)
    parser.add_argument("--dropout", type=float, default=0.05)
    parser.add_argument("--mse-share", type=float, default=0.4, help="share of the epochs before the sigmas are trained")
    parser.add_argument("--repeat-finer", type=int, default=1, help="how often an epoch has the rows on cells finer than the coarsest ones")
    parser.add_argument("--rows", type=int, help="read only so many rows")
    parser.add_argument("--shares", type=float, nargs=3, default=[0.8, 0.1, 0.1], help="of the groups to train, to calibrate, to test")
    parser.add_argument("--test", type=pathlib.Path, help="also score on all rows of this folder, of another seed")
    parser.add_argument("--clean", action="store_true", help="train on rims without scan noise, as the paper does")
    parser.add_argument("--cases", type=pathlib.Path, help="also write a few inputs and outputs, for tests")
    return parser.parse_args()


# Principal directions of the training rims kept for the novelty figure.
SUBSPACE = 64
# Rims that a network is asked for at once, for the memory's sake.
ROWS_AT_ONCE = 256


class Scaling:
    """Inputs less their mean, and outputs to [0, 1] over the training's fabrics, of the density that the network is asked for."""

    def __init__(self, drapes, rows, symmetries):
        copies = [drape_data.transformed(drapes.boundary[rows], s).reshape(len(rows), -1) for s in symmetries]
        density = drapes.density[rows]
        self.asked_density = round(float(np.median(density)), 1)
        self.input_min = np.append(np.min([c.min(0) for c in copies], 0), density.min())
        self.input_max = np.append(np.max([c.max(0) for c in copies], 0), density.max())
        self.centre = np.append(np.mean([c.mean(0) for c in copies], 0), self.asked_density)
        self.scale = 1.0 / np.maximum(self.input_max - self.input_min, LEAST_RANGE)
        squared = sum((c - self.centre[:-1]).T @ (c - self.centre[:-1]) for c in copies)
        _, directions = np.linalg.eigh(squared)
        self.subspace = directions[:, ::-1][:, :SUBSPACE]
        ln = np.log(drapes.stiffness[rows]) + np.log(self.asked_density / density)[:, None]
        # Weft and warp share their ends, since a quarter turn makes one the other.
        self.ln_min = np.minimum(ln.min(0), ln.min(0)[drape_data.SWAPPED])
        self.ln_max = np.maximum(ln.max(0), ln.max(0)[drape_data.SWAPPED])
        self.width = self.ln_max - self.ln_min
        lo, hi = drape_data.ln_box(drapes.manifest)
        self.paper_range = hi - lo

    def normalised(self, stiffness):
        return (np.log(stiffness) - self.ln_min) / self.width

    def of_asked_density(self, stiffness, density):
        """The outputs that the network should have: of the cloth that drapes alike at the density that it is asked for."""
        return self.normalised(stiffness * (self.asked_density / density)[:, None])


@dataclass
class Snn:
    """The paper's network, for `train`: (rows, 733) inputs less their mean to means and log-sigmas."""

    scaling: Scaling
    args: argparse.Namespace

    def init(self, key):
        return snn.init(key, [w // self.args.divide_widths for w in snn.PAPER_WIDTHS])

    def apply(self, params, offset, key=None, dropout=0.0):
        return snn.apply(params, offset * jnp.asarray(self.scaling.scale, jnp.float32), key, dropout)

    def to_onnx(self, members):
        return snn.to_onnx(members, self.scaling.centre, self.scaling.scale, self.scaling.subspace)

    def record(self):
        return {"kind": f"snn{self.args.divide_widths}", "widths": [w // self.args.divide_widths for w in snn.PAPER_WIDTHS]}


@dataclass
class Ring:
    """The ring network, likewise."""

    scaling: Scaling
    args: argparse.Namespace

    def init(self, key):
        return ring.init(key, self.args.channels, self.args.hidden, self.args.dilations)

    def apply(self, params, offset, key=None, dropout=0.0):
        return ring.apply(params, offset[:, :-1], key, dropout)

    def to_onnx(self, members):
        return ring.to_onnx(members, self.scaling.centre, self.scaling.subspace)

    def record(self):
        return {"kind": "ring", "channels": self.args.channels, "hidden": self.args.hidden, "dilations": self.args.dilations}


NETS = {"ring": Ring, "snn": Snn}


def symmetry_tables(symmetries):
    perm = jnp.array([s[0] for s in symmetries])
    matrix = jnp.array(np.array([s[1] for s in symmetries]), jnp.float32)
    target = jnp.array([drape_data.SWAPPED if s[2] else list(range(6)) for s in symmetries])
    return perm, matrix, target


def noisy(key, boundary, density, noise, basis, size_mm=None):
    """Scan noise on (rows, 244, 3) boundaries [mm] and on densities; the smooth part is of `size_mm` in all rows where it is given, else
    drawn."""
    keys = jax.random.split(key, 7)
    rows = boundary.shape[0]
    normal = lambda k, *shape: jax.random.normal(keys[k], shape)
    drawn = noise.smooth_mm * jax.random.uniform(keys[0], (rows, 1, 1))
    size = drawn if size_mm is None else size_mm
    smooth = jnp.einsum("pm,rmc->rpc", basis, normal(1, rows, basis.shape[1], 3))
    white = noise.white_mm * normal(2, *boundary.shape)
    shift = noise.shift_mm * normal(3, rows, 1, 3)
    angles = jnp.deg2rad(jnp.array([noise.tilt_deg, noise.yaw_deg, noise.tilt_deg])) * normal(4, rows, 3)
    turn = jnp.cross(angles[:, None, :], boundary)
    density = density * (1.0 + noise.density_relative * normal(5, rows))
    return boundary + size * smooth + white + shift + turn, density


def loss(params, net, x, y, use_sigma, key, dropout):
    """MSE, then the Gaussian likelihood weighted by sigma (beta-NLL with beta = 0.5, Seitzer et al.
    2022), which keeps the means from starving where the sigma is large."""
    mean, log_sigma = net.apply(params, x, key, dropout)
    squared = (mean - y) ** 2
    mse = squared.mean()
    nll = log_sigma + 0.5 * squared * jnp.exp(-2.0 * log_sigma)
    weighted = (jax.lax.stop_gradient(jnp.exp(log_sigma)) * nll).mean()
    return jnp.where(use_sigma, weighted, mse)


def adam(m, v, grad, t):
    """Adam's moments after step t, counted from 1, and its direction."""
    m = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * g, m, grad)
    v = jax.tree.map(lambda v, g: 0.999 * v + 0.001 * g * g, v, grad)
    direction = lambda m, v: (m / (1 - 0.9**t)) / (jnp.sqrt(v / (1 - 0.999**t)) + 1e-8)
    return m, v, jax.tree.map(direction, m, v)


def train(net, drapes, rows, scaling, symmetries, noise, args):
    """Adam with decoupled weight decay, linear warm-up, cosine decay, and averaged weights."""
    boundary = jnp.asarray(drapes.boundary[rows])
    target = jnp.asarray(scaling.of_asked_density(drapes.stiffness[rows], drapes.density[rows]), jnp.float32)
    centre, width = jnp.asarray(scaling.centre[:-1], jnp.float32), jnp.asarray(scaling.width, jnp.float32)
    perm, matrix, target_perm = symmetry_tables(symmetries)
    basis = jnp.asarray(noise.basis())
    batch = min(args.batch, len(rows))
    steps = len(rows) // batch
    total = steps * args.epochs
    params = net.init(jax.random.key(args.seed))
    zeros = jax.tree.map(jnp.zeros_like, params)

    def step(state, pick, key):
        params, m, v, average, t = state
        key_sym, key_noise, key_drop = jax.random.split(key, 3)
        which = jax.random.randint(key_sym, pick.shape, 0, len(symmetries))
        b = jnp.take_along_axis(boundary[pick], perm[which][:, :, None], axis=1)
        b = jnp.einsum("rpc,rdc->rpd", b, matrix[which])
        y = jnp.take_along_axis(target[pick], target_perm[which], axis=1)
        b, heavier = noisy(key_noise, b, jnp.ones(len(pick)), noise, basis)
        # who says that a cloth is heavier than it is gets an answer that is stiffer by as much
        y = y - jnp.log(heavier)[:, None] / width
        offset = b.reshape(len(pick), -1) - centre
        x = jnp.concatenate([offset, jnp.zeros((len(pick), 1))], axis=1)
        use_sigma = t > args.mse_share * total
        value, grad = jax.value_and_grad(loss)(params, net, x, y, use_sigma, key_drop, args.dropout)
        t = t + 1
        rate = args.learning_rate * jnp.minimum(t / 200.0, 0.5 + 0.5 * jnp.cos(jnp.pi * t / total))
        m, v, down = adam(m, v, grad, t)

        def updated(p, direction):
            decay = args.weight_decay * p if p.ndim == 2 else 0.0
            return p - rate * (direction + decay)

        params = jax.tree.map(updated, params, down)
        share = jnp.minimum(0.998, t / (t + 10.0))
        average = jax.tree.map(lambda a, p: share * a + (1 - share) * p, average, params)
        return (params, m, v, average, t), value

    @jax.jit
    def epoch(state, number):
        key = jax.random.fold_in(jax.random.key(args.seed + 1), number)
        picks = jax.random.permutation(key, len(rows))[: steps * batch].reshape(steps, batch)
        keys = jax.random.split(jax.random.fold_in(key, 1), steps)
        state, values = jax.lax.scan(lambda s, pk: step(s, *pk), state, (picks, keys))
        return state, values.mean()

    state = (params, zeros, zeros, params, jnp.float32(0.0))
    start = time.time()
    for number in range(args.epochs):
        state, value = epoch(state, number)
        if number in (0, 9) or (number + 1) % 50 == 0:
            print(f"epoch {number + 1:5d}  loss {float(value):9.5f}  {time.time() - start:6.1f} s", flush=True)
    return state[3]


class Network:
    """The exported file, averaged over symmetries of the experiment.

    Asked for one density, whatever the specimen's: a drape depends on stiffness over weight alone,
    so that the answer for another density is that one in proportion.
    """

    def __init__(self, model, symmetries, asked_density, ln_width):
        self.asked_density, self.ln_width = asked_density, ln_width
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        self.symmetries = symmetries

    def said(self, output, boundary, density):
        x = np.concatenate([boundary.reshape(len(boundary), -1), density[:, None]], axis=1).astype(np.float32)
        some = [self.session.run([output], {"boundary": x[k : k + ROWS_AT_ONCE]})[0] for k in range(0, len(x), ROWS_AT_ONCE)]
        return np.concatenate(some).astype(np.float64)

    def raw(self, boundary, density):
        return self.said("normalised", boundary, density)

    def novelty_mm(self, boundary, density):
        return self.said("novelty", boundary, density)[:, 0]

    def __call__(self, boundary, density):
        """Mean and sigma of the mixture over the symmetric views."""
        means, variances = [], []
        heavier = np.log(density / self.asked_density)[:, None] / self.ln_width
        density = np.full_like(density, self.asked_density)
        for symmetry in self.symmetries:
            out = self.raw(drape_data.transformed(boundary, symmetry), density)
            order = drape_data.SWAPPED if symmetry[2] else list(range(6))
            means.append(out[:, :6][:, order])
            variances.append(np.exp(2 * out[:, 6:])[:, order])
        mean = np.mean(means, 0) + heavier
        return mean, np.sqrt(np.mean(variances, 0) + np.var(means, 0))


def linear_regression(drapes, rows, scaling, symmetries):
    """The paper's baseline, on the same inputs, as a function of (boundary, density)."""

    def features(boundary, density):
        x = np.concatenate([boundary.reshape(len(boundary), -1), density[:, None]], axis=1)
        return np.concatenate([(x - scaling.centre) * scaling.scale, np.ones((len(x), 1))], axis=1)

    xs, ys = [], []
    y = scaling.normalised(drapes.stiffness[rows])
    for s in symmetries:
        xs.append(features(drape_data.transformed(drapes.boundary[rows], s), drapes.density[rows]))
        ys.append(y[:, drape_data.SWAPPED] if s[2] else y)
    x, y = np.concatenate(xs), np.concatenate(ys)
    # The doubled corners make the plain normal equations singular.
    solution = np.linalg.solve(x.T @ x + 1e-3 * np.eye(x.shape[1]), x.T @ y)
    return lambda boundary, density: features(boundary, density) @ solution


def scores(prediction, truth, scaling):
    """RMSE and R2 on outputs normalised by the prior's limits, as in the paper's Table 3."""
    ratio = scaling.width / scaling.paper_range
    error = (prediction - truth) * ratio
    rmse = np.sqrt(np.mean(error**2, axis=0))
    r2 = 1.0 - np.sum(error**2, axis=0) / np.sum(((truth - truth.mean(0)) * ratio) ** 2, axis=0)
    return {"rmse": float(rmse.mean()), "r2": float(r2.mean()), "rmse_each": rmse.tolist(), "r2_each": r2.tolist()}


def coverage_by_quarter(covered, truth, density, scaling):
    """Share of the intervals that hold the truth in each quarter of the true bending length, softest first."""
    stiffness = np.exp(scaling.ln_min + truth * (scaling.ln_max - scaling.ln_min))
    length = drape_data.bending_length_mm(stiffness, density.astype(np.float64))
    quarter = intervals.quarters(length)
    return [float(covered[quarter == k].mean()) for k in range(intervals.QUARTERS)]


def evaluate(network, inputs, truth, quantile, scaling):
    mean, sigma = network(*inputs)
    half = sigma * quantile
    covered = np.abs(mean - truth) <= half
    result = scores(mean, truth, scaling)
    # Half width of the interval as a factor on the stiffness: value / f to value * f.
    factor = np.exp(np.median(half, axis=0) * (scaling.ln_max - scaling.ln_min))
    result |= {
        "coverage": float(covered.mean()),
        "coverage_each": covered.mean(0).tolist(),
        "coverage_quarters": coverage_by_quarter(covered, truth, inputs[1], scaling),
        "median_interval_factor_each": factor.tolist(),
    }
    return result


def report(name, metrics):
    print(f"{name:24s} RMSE {metrics['rmse']:.5f}  R2 {metrics['r2']:.5f}", end="")
    print(f"  coverage {metrics['coverage']:.3f}" if "coverage" in metrics else "")


def repeated(drapes, rows, times):
    """Rows of an epoch: those on cells finer than the coarsest ones so many times, since they are dear and few and most like cloth."""
    finer = rows[drapes.vertices[rows] > drapes.vertices.min()]
    return np.concatenate([rows, *[finer] * (times - 1)])


def exported(name, drapes, rows, scaling, symmetries, noise, args):
    """A trained network, or several that differ in their seed: as ONNX bytes, what the record says of the layers, and how long it
    took [s]."""
    net = NETS[name](scaling, args)
    start = time.time()
    of_seed = lambda k: argparse.Namespace(**{**vars(args), "seed": args.seed + k})
    members = [train(net, drapes, rows, scaling, symmetries, noise, of_seed(k)) for k in range(args.members)]
    return net.to_onnx(members), {**net.record(), "members": args.members}, time.time() - start


def main():
    args = parse_args()
    drapes = drape_data.read_folders(args.data, args.rows)
    train_rows, calibration_rows, test_rows = drape_data.split_by_group(drapes.group, args.seed, args.shares)
    symmetries = drape_data.symmetries()
    scaling = Scaling(drapes, train_rows, symmetries)
    noise = drape_data.Noise.none() if args.clean else drape_data.Noise()
    print(f"{drapes.rows_read} rows, {len(drapes.density)} at rest (left out: {drapes.left_out}), "
          f"{len(train_rows)} / {len(calibration_rows)} / {len(test_rows)} to train / calibrate / test")

    epoch = repeated(drapes, train_rows, args.repeat_finer)
    nets = {name: exported(name, drapes, epoch, scaling, symmetries, noise, args) for name in args.nets}
    model, layers, seconds = nets[args.nets[0]]
    asks = partial(Network, asked_density=scaling.asked_density, ln_width=scaling.width)
    network = asks(model, symmetries=symmetries)

    add_noise = jax.jit(partial(noisy, noise=noise, basis=jnp.asarray(noise.basis())))

    def of(drapes, rows, noise_seed=None):
        inputs = drapes.boundary[rows], drapes.density[rows].astype(np.float32)
        if noise_seed is not None:
            inputs = tuple(np.asarray(a) for a in add_noise(jax.random.key(noise_seed), *inputs))
        return inputs, scaling.normalised(drapes.stiffness[rows])

    # Calibrated on rims with scan noise, since that is what the estimator meets.
    inputs, truth = of(drapes, calibration_rows, noise_seed=args.seed + 100)
    mean, sigma = network(*inputs)
    quantile = intervals.conformal_quantiles(mean - truth, sigma)
    novelty_limit = float(np.quantile(network.novelty_mm(*inputs), 0.99))

    clean, noised = of(drapes, test_rows), of(drapes, test_rows, noise_seed=args.seed + 200)
    tests = {"test": clean, "test_noisy": noised}
    if args.test:
        other = drape_data.read_folder(args.test)
        every = np.arange(len(other.density))
        tests |= {"other_test": of(other, every), "other_test_noisy": of(other, every, noise_seed=args.seed + 300)}
    linear = linear_regression(drapes, train_rows, scaling, symmetries)
    metrics = {name: evaluate(network, *rows, quantile, scaling) for name, rows in tests.items()}
    metrics |= {
        "test_four_views": evaluate(asks(model, symmetries=symmetries[:4]), *clean, quantile, scaling),
        "test_single_view": evaluate(asks(model, symmetries=symmetries[:1]), *clean, quantile, scaling),
        "train": evaluate(network, *of(drapes, train_rows), quantile, scaling),
        "linear_regression": scores(linear(*clean[0]), clean[1], scaling),
        "linear_regression_noisy": scores(linear(*noised[0]), noised[1], scaling),
    }
    beside = {}
    for name in args.nets[1:]:
        rival = asks(nets[name][0], symmetries=symmetries)
        beside[nets[name][1]["kind"]] = {key: scores(rival(*inputs)[0], truth, scaling) for key, (inputs, truth) in tests.items()}
    for name, value in metrics.items():
        report(name, value)
    for name, own in beside.items():
        for key, value in own.items():
            report(f"{name}, {key}", value)

    sha256 = hashlib.sha256(model).hexdigest()
    fake = drapes.manifest["simulator"] == "fake"
    sidecar = {
        "schema": MODEL_SCHEMA,
        "id": f"{'fake-' if fake else ''}{layers['kind']}-{drapes.manifest['prior']}-{sha256[:8]}",
        "trained_on": "fake" if fake else "drapes",
        "onnx_sha256": sha256,
        "simulator_numerics": drapes.manifest["simulator_numerics"],
        "simulator": drapes.manifest["simulator"],
        "prior": drapes.manifest["prior"],
        "prior_sha256": drapes.manifest["prior_sha256"],
        "data_seed": drapes.manifest["seed"],
        "rows": {
            "read": drapes.rows_read, "left_out": drapes.left_out, "train": len(train_rows),
            "calibration": len(calibration_rows), "test": len(test_rows),
            "by_vertices": {str(v): int((drapes.vertices == v).sum()) for v in np.unique(drapes.vertices)},
            **({"other_test": len(other.density)} if args.test else {}),
        },
        "fabrics": int(len(np.unique(drapes.fabric))),
        "train_seed": args.seed,
        "train_seconds": round(seconds, 1),
        "network": layers,
        "weights": "f16",
        "noise": vars(noise),
        "input": {"min": np.round(scaling.input_min, 3).tolist(), "max": np.round(scaling.input_max, 3).tolist(), "novelty_limit_mm": novelty_limit,
            "asked_density_g_m2": scaling.asked_density},
        "output": {
            "keys": drape_data.STIFFNESSES,
            "ln_min": scaling.ln_min.tolist(),
            "ln_max": scaling.ln_max.tolist(),
        },
        "interval": {"level": intervals.LEVEL, "quantile": quantile.tolist()},
        "metrics": metrics,
        "beside": beside,
        "command": shlex.join(["python", *sys.argv]),
    }
    args.out.parent.mkdir(parents=True, exist_ok=True)
    args.out.write_bytes(model)
    args.out.with_suffix(".json").write_text(json.dumps(sidecar, indent=1) + "\n")
    print(f"{args.out}: {len(model) / 2**20:.2f} MiB, sha256 {sha256}, trained in {seconds:.0f} s")
    if args.cases:
        (boundary, density), truth = clean
        mean, sigma = network(boundary[:4], density[:4])
        cases = {
            "boundary_mm": np.round(boundary[:4].astype(float), 4).reshape(4, -1).tolist(),
            "density_g_m2": density[:4].astype(float).tolist(),
            "stiffness": drapes.stiffness[test_rows[:4]].tolist(),
            "raw": network.raw(boundary[:4], density[:4]).tolist(),
            "novelty_mm": network.novelty_mm(boundary[:4], density[:4]).tolist(),
            "mean": mean.tolist(),
            "sigma": sigma.tolist(),
        }
        args.cases.write_text(json.dumps(cases) + "\n")


if __name__ == "__main__":
    main()
