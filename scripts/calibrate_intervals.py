#!/usr/bin/env python3
"""Calibrate the intervals of a trained model on falls of fabrics that it has not seen, and measure them on others.

    python scripts/calibrate_intervals.py --calibrate DIR --finer DIR --test DIR [DIR ...]

Drapes of one walk err together, so that the calibration rows of a training on walks settle its intervals badly. Takes folders
of `scan2params generate` without --walk, of seeds that the model has not seen. With scan noise the drapes of
--calibrate give the quantile of each output, a factor on all six by the predicted bending length and one by the rim's noise, which a scan
states (scripts/intervals.py). Where an output holds less than
85 % of the drapes of --finer, which lie on finer cells as real cloth does, its quantile is raised until it does. The drapes of --test give
the coverage, all in all, of each output, and by quarter of the true bending length, before and after. The distance from which a rim is novel is set on them likewise:
99 of 100 falls with scan noise lie below it, where of the drapes of walks, which are like those of the training, it would be too near. Writes `interval`,
`intervals_measured` and `input.novelty_limit_mm` of the model's json, and takes from its `metrics` what was said of the intervals before; the network stays what it is.
"""

import argparse
import dataclasses
import json
import pathlib
import shlex
import sys
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import drape_data
import intervals
import train

NOISE_SEEDS = (101, 102, 103)
# Sizes of the smooth noise at which intervals are calibrated, and coverage printed [mm]; the training draws them from 0 to 1.
SIZES_MM = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0)
# Share of rims with a scan's noise that are not called novel.
NOT_NOVEL = 0.99
# Metrics of the training's own split that are of its intervals.
OF_INTERVALS = ("coverage", "coverage_each", "coverage_quarters", "median_interval_factor_each")


class Model:
    """A model asked as the program asks it."""

    def __init__(self, path):
        self.sidecar = path.with_suffix(".json")
        self.record = json.loads(self.sidecar.read_text())
        output = self.record["output"]
        self.ln_min, self.ln_max = (np.array(output[key]) for key in ("ln_min", "ln_max"))
        asked = self.record["input"]["asked_density_g_m2"]
        self.network = train.Network(path.read_bytes(), drape_data.symmetries(), asked, self.ln_max - self.ln_min)
        self.noise = drape_data.Noise(**self.record["noise"])
        self.noisy = jax.jit(partial(train.noisy, noise=self.noise, basis=jnp.asarray(self.noise.basis())))

    def read(self, folder):
        drapes = drape_data.read_folder(folder)
        if drapes.manifest["seed"] == self.record["data_seed"]:
            raise SystemExit(f"{folder}: of the training's seed {self.record['data_seed']}")
        if len(np.unique(drapes.group)) < len(drapes.density):
            raise SystemExit(f"{folder}: has several drapes of a fabric or walk, which err together: wanted is one fall a fabric")
        return drapes

    def inputs(self, drapes, noise_seed=None, size_mm=None):
        """Rims [mm] and densities [g/m^2], and how far off the rims are, per coordinate [mm]: as scans give them where a seed is given, with
        smooth noise of `size_mm` where that is, else of sizes as the training draws them."""
        inputs = drapes.boundary, drapes.density.astype(np.float32)
        if noise_seed is None:
            return *inputs, np.zeros(len(drapes.density))
        if size_mm is None:
            size_mm = np.random.default_rng(noise_seed).uniform(0.0, self.noise.smooth_mm, len(drapes.density))
        size_mm = np.broadcast_to(size_mm, len(drapes.density)).astype(np.float32)
        rims, density = self.noisy(jax.random.key(noise_seed), *inputs, size_mm=size_mm[:, None, None])
        # as `RimNoise` in lab/src/evaluate/rim_noise.rs has it: a motion of the whole moves no answer
        return np.asarray(rims), np.asarray(density), np.hypot(size_mm, self.noise.white_mm)

    def novelty_mm(self, drapes, noise_seeds):
        """Distance from the space of the training's rims [mm], of each rim of each draw."""
        asked = np.full(len(drapes.density), self.network.asked_density)
        return np.concatenate([self.network.novelty_mm(self.inputs(drapes, seed)[0], asked) for seed in noise_seeds])

    def said(self, drapes, noise_seed=None, size_mm=None):
        rims, density, noise_mm = self.inputs(drapes, noise_seed, size_mm)
        mean, sigma = self.network(rims, density)
        width = self.ln_max - self.ln_min
        heavier = np.log(density / self.network.asked_density)[:, None]
        truth = (np.log(drapes.stiffness) - self.ln_min) / width
        # cut to the trained range, as the program does, which lies where it does for the density that is asked
        said = np.exp(heavier + self.ln_min + np.clip(mean - heavier / width, 0.0, 1.0) * width)
        length_mm = drape_data.bending_length_mm(said, density.astype(np.float64))
        return Said(mean - truth, sigma, length_mm, noise_mm)

    def said_of_draws(self, drapes, seeds, size_mm=None):
        """The same of several draws, each a copy of the drapes."""
        return together(self.said(drapes, seed, size_mm) for seed in seeds)


class Said(NamedTuple):
    """What a network says of rims."""

    error: np.ndarray  # of the normalised outputs (rows, 6)
    sigma: np.ndarray  # likewise
    length_mm: np.ndarray  # predicted bending length (rows)
    noise_mm: np.ndarray  # what the rims say of their error (rows)

    def half_widths(self, interval):
        return intervals.half_widths(interval, self.sigma, self.length_mm, self.noise_mm)

    def scores(self, interval):
        """Errors in half widths of the intervals (rows, 6)."""
        return np.abs(self.error) / self.half_widths(interval)


def together(all_said):
    return Said(*(np.concatenate(parts) for parts in zip(*all_said)))


def calibrated(model, drapes):
    """The `interval` of the model's json: with scan noise of each size, since that is what the estimator meets, and of none."""
    said = together([model.said(drapes), *(model.said_of_draws(drapes, NOISE_SEEDS, size_mm) for size_mm in SIZES_MM)])
    trained = said.noise_mm <= np.hypot(model.noise.smooth_mm, model.noise.white_mm)
    return intervals.calibrated(np.abs(said.error) / said.sigma, said.length_mm, said.noise_mm, trained)


def widened(model, interval, finer):
    """The same where each output holds on drapes of `finer` cells as well, whose cloth is less stiff than the training's cells make it; and
    the factor of each output."""
    factor = intervals.raised(model.said_of_draws(finer, NOISE_SEEDS).scores(interval))
    return interval | {"quantile": (interval["quantile"] * factor).tolist()}, np.round(factor, 3).tolist()


def measured(model, drapes, interval, noise_seeds):
    """Error, as the paper's Table 3 has it, and coverage on drapes, each noise seed a copy of them."""
    said = model.said_of_draws(drapes, noise_seeds)
    held = said.scores(interval) <= 1
    true_mm = drape_data.bending_length_mm(drapes.stiffness, drapes.density.astype(np.float64))
    quarter = np.tile(intervals.quarters(true_mm), len(noise_seeds))
    factor = np.exp(np.median(said.half_widths(interval), axis=0) * (model.ln_max - model.ln_min))
    low, high = drape_data.ln_box(drapes.manifest)
    normalised = said.error * (model.ln_max - model.ln_min) / (high - low)
    return {
        "rmse": float(np.sqrt(np.mean(normalised**2, axis=0)).mean()),
        "coverage": float(held.mean()),
        "coverage_each": held.mean(0).tolist(),
        "coverage_quarters": [float(held[quarter == k].mean()) for k in range(intervals.QUARTERS)],
        "median_interval_factor_each": factor.tolist(),
    }


def by_noise(model, drapes, interval, size_mm):
    """Share of the intervals that hold where the smooth noise is of that size in all rims, and the factor on them with which LEVEL would."""
    scores = np.sort(model.said_of_draws(drapes, NOISE_SEEDS, size_mm).scores(interval), axis=None)
    return float((scores <= 1).mean()), float(scores[intervals.rank(len(scores))])


def mean_errors(model, drapes):
    """Mean error of the logarithms on clean rims, of all drapes and of each quarter of the true bending length, softest first."""
    error = model.said(drapes).error * (model.ln_max - model.ln_min)
    quarter = intervals.quarters(drape_data.bending_length_mm(drapes.stiffness, drapes.density.astype(np.float64)))
    return [error.mean(0), *(error[quarter == k].mean(0) for k in range(intervals.QUARTERS))]


def moved(model, drapes, interval, by_mm):
    """Mean change of the answers in half widths of their intervals where all rims are moved so [mm], in each quarter of the true bending length."""
    before = model.said(drapes)
    after = model.said(dataclasses.replace(drapes, boundary=(drapes.boundary + np.array(by_mm)).astype(np.float32)))
    change = (after.error - before.error) / before.half_widths(interval)
    quarter = intervals.quarters(drape_data.bending_length_mm(drapes.stiffness, drapes.density.astype(np.float64)))
    return [change[quarter == k].mean(0) for k in range(intervals.QUARTERS)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--calibrate", required=True, type=pathlib.Path)
    parser.add_argument("--finer", type=pathlib.Path, help="drapes on finer cells, of yet another seed, that the intervals are to hold as well")
    parser.add_argument("--test", required=True, nargs="+", type=pathlib.Path)
    default = pathlib.Path(__file__).resolve().parent.parent / "src/estimate/model/shipped.onnx"
    parser.add_argument("--model", type=pathlib.Path, default=default)
    parser.add_argument("--dry-run", action="store_true", help="print, and write nothing")
    args = parser.parse_args()
    model = Model(args.model)
    drapes = model.read(args.calibrate)
    finer = model.read(args.finer) if args.finer else None
    before, after, factor = model.record["interval"], calibrated(model, drapes), None
    if finer:
        after, factor = widened(model, after, finer)
        print(f"{args.finer}, {len(finer.density)} drapes: wider by {factor}")
    seen = [of.manifest["seed"] for of in (drapes, finer) if of]
    print(f"{args.calibrate}, {len(drapes.density)} drapes: {json.dumps(after)}")
    near, far = model.record["input"]["novelty_limit_mm"], float(np.quantile(model.novelty_mm(drapes, NOISE_SEEDS), NOT_NOVEL))
    print(f"a rim is novel from {far:.3f} mm (before {near:.3f})")
    tests = []
    for folder in args.test:
        other = model.read(folder)
        if other.manifest["seed"] in seen:
            raise SystemExit(f"{folder}: of the seed of --calibrate or --finer")
        for name, errors in zip(("all", *range(1, intervals.QUARTERS + 1)), mean_errors(model, other)):
            print(f"{folder}, mean error of the logarithms, {name}: " + " ".join(f"{v:+.3f}" for v in errors))
        said = {"drapes": len(other.density), "seed": other.manifest["seed"], "vertices": drape_data.vertices(other.manifest)}
        for name, seeds in (("clean", [None]), ("noisy", NOISE_SEEDS)):
            said[name] = measured(model, other, after, seeds)
            novelty_mm = model.novelty_mm(other, seeds)
            said[name]["novel"] = float((novelty_mm > far).mean())
            print(f"{folder}, {name}: novel {(novelty_mm > near).mean():.4f} before, {said[name]['novel']:.4f} after")
            for way, own in (("before", measured(model, other, before, seeds)), ("after", said[name])):
                each, quarters = (" ".join(f"{v:.3f}" for v in own[key]) for key in ("coverage_each", "coverage_quarters"))
                print(f"{folder}, {said['drapes']} drapes, {name}, {way}: RMSE {own['rmse']:.4f}; all {own['coverage']:.3f}; quarters {quarters}; each {each}")
        for size_mm in SIZES_MM:
            held, factor_for_level = by_noise(model, other, after, size_mm)
            print(f"{folder}, smooth noise of {size_mm} mm: all {held:.3f}, {intervals.LEVEL} with {factor_for_level:.2f} times the width")
            said.setdefault("coverage_by_noise", {})[str(size_mm)] = round(held, 4)
        for name, by_mm in (("down", (0.0, -0.5, 0.0)), ("sideways", (0.5, 0.0, 0.0))):
            for k, change in enumerate(moved(model, other, after, by_mm), 1):
                print(f"{folder}, rims 0.5 mm {name}, quarter {k}, answers move by half widths: " + " ".join(f"{v:+.2f}" for v in change))
        tests.append(said)
    if args.dry_run:
        return
    model.record["interval"] = after
    model.record["input"]["novelty_limit_mm"] = far
    for metrics in model.record["metrics"].values():
        for key in OF_INTERVALS:
            metrics.pop(key, None)
    model.record["intervals_measured"] = {
        "calibrated_on": {"drapes": len(drapes.density), "seed": drapes.manifest["seed"]},
        **({"widened_on": {"drapes": len(finer.density), "seed": finer.manifest["seed"], "vertices": drape_data.vertices(finer.manifest), "factor": factor}} if finer else {}),
        "tests": tests,
        "command": shlex.join(["python", *sys.argv]),
    }
    model.sidecar.write_text(json.dumps(model.record, indent=1) + "\n")


if __name__ == "__main__":
    main()
