#!/usr/bin/env python3
"""Manifests of the published silhouettes for `scan2params calibrate`.

    python3 scripts/silhouettes.py INDEX.csv --out DIR [--observations 1,2,5]

INDEX.csv stands beside the pictures' folders and has the columns file, fabric,
density_gsm_from_experiment_script, sample, capture, face, obs (docs/closing_the_loop.md names
the source). Writes `fabric_N.csv` for each fabric: the first capture of every specimen and
face, or, with --captures all, every capture; specimens in the first half of their numbers
are `fit`, the others `holdout`; and `all.csv`, every capture of every fabric, all of them
`holdout`, for the floor alone. Repeat observations of one drape, which have a number in
`obs`, are left out; with --observations these, of those numbers, are taken in place of the
captures, and the column observation says which look at the drape it is.

Standard library alone.
"""

import argparse
import csv
import os
import pathlib
import sys

COLUMNS = (
    "file,kind,fabric,specimen,face,capture,density_g_m2,experiment,mm_per_pixel,role,"
    "observation,camera_height_mm".split(",")
)


def rows_of(index, observations):
    """The index's rows: captures, or the observations of some numbers."""
    with open(index, newline="") as file:
        rows = list(csv.DictReader(file))
    if not observations:
        return [row for row in rows if not row["obs"]]
    return [row for row in rows if row["obs"] in observations.split(",")]


def fitted_specimens(rows):
    """The first half of a fabric's specimens, rounded up."""
    numbers = sorted({int(row["sample"]) for row in rows})
    return set(numbers[: (len(numbers) + 1) // 2])


def first_captures(rows):
    """The first capture of every specimen, face and observation."""
    first = {}
    for row in sorted(rows, key=lambda row: int(row["capture"] or 0)):
        first.setdefault((row["sample"], row["face"], row["obs"]), row)
    return list(first.values())


def entry(row, role, given, folder, out):
    """A line of the manifest."""
    return {
        "file": os.path.relpath(folder / row["file"], out),
        "kind": "silhouette",
        "fabric": row["fabric"],
        "specimen": row["sample"],
        "face": row["face"],
        "capture": row["capture"],
        "density_g_m2": row["density_gsm_from_experiment_script"],
        "experiment": "cusick",
        "mm_per_pixel": given.mm_per_pixel,
        "role": role,
        "observation": row["obs"],
        "camera_height_mm": given.camera_height_mm,
    }


def write(path, entries):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(entries)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("index", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--mm-per-pixel", type=float, default=1.39)
    parser.add_argument("--camera-height-mm", type=float)
    parser.add_argument("--captures", choices=["first", "all"], default="first")
    parser.add_argument("--observations", metavar="K,...")
    given = parser.parse_args()
    rows = rows_of(given.index, given.observations)
    if not rows:
        sys.exit(f"{given.index}: no such rows")
    given.out.mkdir(parents=True, exist_ok=True)
    out, folder = given.out.resolve(), given.index.resolve().parent
    every = []
    for fabric in sorted({row["fabric"] for row in rows}, key=int):
        own = [row for row in rows if row["fabric"] == fabric]
        fit = fitted_specimens(own)
        taken = first_captures(own) if given.captures == "first" else own
        role = {True: "fit", False: "holdout"}
        entries = [
            entry(row, role[int(row["sample"]) in fit], given, folder, out)
            for row in sorted(taken, key=lambda row: (int(row["sample"]), row["face"] == "down", row["obs"], row["capture"]))
        ]
        write(out / f"fabric_{fabric}.csv", entries)
        every += [entry(row, "holdout", given, folder, out) for row in own]
    write(out / "all.csv", every)


if __name__ == "__main__":
    main()
