#!/usr/bin/env python3
"""A folder of made-up drapes in the format of `scan2params generate`, to try the training and the
estimator without a simulator. Not physics: a smooth map from parameters to a folded rim that
respects the symmetries. A model trained on it is marked, and the estimator will not ship it.

    python scripts/fake_drapes.py --out data/fake --count 2000
"""

import argparse
import json
import pathlib
import re

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import drape_data

KEYS = [*drape_data.STIFFNESSES, "density"]


def numerics_version():
    """The version of this checkout's simulator: a model of another one is refused."""
    source = pathlib.Path(__file__).parent.parent / "src/sim/mod.rs"
    return int(re.search(r"NUMERICS_VERSION: u32 = (\d+);", source.read_text()).group(1))


def sample_fabrics(prior, count, rng):
    """Fabrics of a prior file, by the method of src/fabric/mixture.rs (not its stream)."""
    lo, hi = np.array(prior["min"]), np.array(prior["max"])
    rows = []
    for k in range(count):
        component = prior["components"][k % len(prior["components"])]
        while True:
            v = np.exp(rng.multivariate_normal(component["mean_ln"], component["cov_ln"], method="cholesky"))
            if np.all((v >= lo) & (v <= hi)) and v[5] >= 0.25 * (v[3] ** 0.5 - v[4] ** 0.5) ** 2:
                rows.append(v)
                break
    return np.array(rows)


def fake_boundary(v, phase):
    """(244, 3) mm. Sag and folds follow bending over weight in each direction; stretch and shear
    lengthen the overhang a little."""
    su, sv, h, bu, bv, bh, d = v
    flat = drape_data.flat_xz_mm()
    radius = np.hypot(*flat.T)
    angle = np.arctan2(flat[:, 0], flat[:, 1])  # 0 along weft (z)
    length = lambda b: 60.0 * (b / d) ** (1 / 3)  # mm, as a cantilever scales
    along = length(bu) * np.cos(angle) ** 4 + length(bv) * np.sin(angle) ** 4 + 2 * length(bh) * (np.cos(angle) * np.sin(angle)) ** 2
    overhang = radius - 50.0
    sag = overhang / np.sqrt(1.0 + (along / overhang) ** 2)
    out = np.sqrt(np.maximum(overhang**2 - sag**2, 0.0))
    fold = 0.35 * sag * np.exp(-along / 150.0) * np.cos((4 + 2 * (phase > 0.5)) * angle + 0.3 * phase)
    stretch = 3e4 * d / 200.0 * (np.cos(angle) ** 2 / su + np.sin(angle) ** 2 / sv + np.sin(2 * angle) ** 2 / h)
    r = 50.0 + out + fold
    return np.stack([r * np.sin(angle), -(sag + stretch), r * np.cos(angle)], axis=1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--prior", type=pathlib.Path, default=pathlib.Path(__file__).parent.parent / "src/fabric/knit-2020.json")
    args = parser.parse_args()
    prior = json.loads(args.prior.read_text())
    rng = np.random.default_rng(args.seed)
    fabrics = sample_fabrics(prior, args.count, rng)
    boundaries = np.stack([fake_boundary(v, rng.random()) for v in fabrics]).astype("<f4")
    columns = {"index": np.arange(args.count), "fabric_index": np.arange(args.count)}
    columns |= {key: fabrics[:, i] for i, key in enumerate(KEYS)}
    points = pa.FixedSizeListArray.from_arrays(boundaries.ravel(), 3)
    columns["boundary_mm"] = pa.FixedSizeListArray.from_arrays(points, drape_data.POINTS)
    rest = np.arange(args.count) % 50 != 7
    columns["stop"] = ["at_rest" if rest else "iterations" for rest in rest]
    columns["converged"] = columns["at_rest"] = rest
    columns["stable"] = pa.array([True if rest else None for rest in rest])
    columns["node_count"] = np.zeros(args.count, np.int32)
    columns["energy_j"] = columns["residual_n"] = np.zeros(args.count)
    args.out.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.table(columns), args.out / "drapes-000000.parquet")
    manifest = {
        "schema": "scan2params/dataset/2", "program": "fake_drapes.py", "simulator_numerics": numerics_version(),
        "simulator": "fake", "prior": prior["name"], "prior_sha256": "",
        "prior_limits": [prior["min"], prior["max"]], "seed": args.seed, "drops_per_fabric": 1,
        "chunk_rows": args.count, "count": args.count,
    }
    (args.out / "manifest.json").write_text(json.dumps(manifest, indent=1))


if __name__ == "__main__":
    main()
