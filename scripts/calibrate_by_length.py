#!/usr/bin/env python3
"""Would conformal quantiles that depend on the predicted bending length mend the coverage of the intervals?

    python scripts/calibrate_by_length.py --calibrate DIR --test DIR [DIR ...]

Takes the shipped quantiles, finds on the drapes of --calibrate (with scan noise) one factor on them for each quarter of
the predicted bending length (Mondrian conformal, the six outputs together), and prints the coverage by quarter of the
true bending length on the drapes of --test with both. Folders are of `scan2params generate`, of seeds that the model
has not seen. Writes nothing: the model is not changed.
"""

import argparse
import json
import pathlib
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

import drape_data
import train

NOISE_SEEDS = (1, 2, 3)
QUARTERS = 4


class Shipped:
    """The model as it ships, asked as the program asks it."""

    def __init__(self, path):
        record = json.loads(path.with_suffix(".json").read_text())
        self.data_seed = record["data_seed"]
        self.ln_min, self.ln_max = (np.array(record["output"][key]) for key in ("ln_min", "ln_max"))
        self.quantile = np.array(record["interval"]["quantile"])
        asked = record["input"]["asked_density_g_m2"]
        self.network = train.Network(path.read_bytes(), drape_data.symmetries(), asked, self.ln_max - self.ln_min)
        noise = drape_data.Noise(**record["noise"])
        self.noisy = jax.jit(partial(train.noisy, noise=noise, basis=jnp.asarray(noise.basis())))

    def scores(self, drapes, noise_seed):
        """Errors over the half widths of the shipped intervals (rows, 6), and predicted bending lengths [mm]."""
        inputs = drapes.boundary, drapes.density.astype(np.float32)
        if noise_seed is not None:
            inputs = tuple(np.asarray(a) for a in self.noisy(jax.random.key(noise_seed), *inputs))
        mean, sigma = self.network(*inputs)
        truth = (np.log(drapes.stiffness) - self.ln_min) / (self.ln_max - self.ln_min)
        said = np.exp(self.ln_min + np.clip(mean, 0.0, 1.0) * (self.ln_max - self.ln_min))
        return np.abs(mean - truth) / (sigma * self.quantile), drape_data.bending_length_mm(said, inputs[1].astype(float))


def quarter_factors(scores, lengths):
    """Edges of the quarters, and the factor of each: its conformal quantile over all six outputs."""
    edges = np.quantile(lengths, np.arange(1, QUARTERS) / QUARTERS)
    which = np.searchsorted(edges, lengths)
    rank = lambda n: min(int(np.ceil((n + 1) * train.LEVEL)), n) - 1
    own = [np.sort(scores[which == k], axis=None) for k in range(QUARTERS)]
    return edges, np.array([s[rank(len(s))] for s in own])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--calibrate", required=True, type=pathlib.Path)
    parser.add_argument("--test", required=True, nargs="+", type=pathlib.Path)
    default = pathlib.Path(__file__).resolve().parent.parent / "src/estimate/model/snn.onnx"
    parser.add_argument("--model", type=pathlib.Path, default=default)
    args = parser.parse_args()
    shipped = Shipped(args.model)

    def read(folder):
        drapes = drape_data.read_folder(folder)
        if drapes.manifest["seed"] == shipped.data_seed:
            raise SystemExit(f"{folder}: of the training's seed {shipped.data_seed}")
        return drapes

    calibration = read(args.calibrate)
    drawn = [shipped.scores(calibration, seed + 100) for seed in NOISE_SEEDS]
    edges, factors = quarter_factors(*(np.concatenate(parts) for parts in zip(*drawn)))
    groups = len(np.unique(calibration.group))
    print(f"{args.calibrate}: {len(calibration.density)} drapes in {groups} groups; edges {np.round(edges, 1)} mm, factors {np.round(factors, 3)}")
    for folder in args.test:
        drapes = read(folder)
        true_mm = drape_data.bending_length_mm(drapes.stiffness, drapes.density)
        quarter = np.searchsorted(np.quantile(true_mm, np.arange(1, QUARTERS) / QUARTERS), true_mm)
        for name, seeds in (("clean", [None]), ("scan noise", NOISE_SEEDS)):
            drawn = [shipped.scores(drapes, seed) for seed in seeds]
            scores, lengths = (np.concatenate(parts) for parts in zip(*drawn))
            own = np.tile(quarter, len(seeds))
            for way, limit in (("shipped", np.ones(QUARTERS)), ("by length", factors)):
                held = scores <= limit[np.searchsorted(edges, lengths)][:, None]
                each = " ".join(f"{held[own == k].mean():.3f}" for k in range(QUARTERS))
                print(f"{folder}, {len(drapes.density)} drapes, {name}, {way}: all {held.mean():.3f}, quarters {each}")


if __name__ == "__main__":
    main()
