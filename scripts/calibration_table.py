#!/usr/bin/env python3
"""One table over many calibrations: `python3 scripts/calibration_table.py DIR...`.

Each DIR has a `calibration.json` of `scan2params calibrate`. Prints a Markdown row for each
fabric: verdict, effects, error of the drapes held out before and after, and the shift of the
drape coefficient from face up to face down, measured, before and after.

Standard library alone.
"""

import json
import pathlib
import sys


def number(value, digits=2):
    return "-" if value is None else f"{value:.{digits}f}"


def shift(groups, key):
    """Mean coefficient of the drapes held out with the face down less that with the face up."""
    of_face = {g["face"]: g[key] for g in groups if g["role"] == "holdout" and g.get("observation") is None}
    both = {"up", "down"} <= of_face.keys()
    return of_face["down"] - of_face["up"] if both else None


def effects(fabric):
    names = {}
    for entry in fabric["effects"]:
        low, high = entry["interval90"]
        said = f"{entry['value']:.2f} ({low:.2f} to {high:.2f}) {entry['unit']}".rstrip()
        names.setdefault(entry["name"], []).append(f"{entry['part']} {said}")
    parts = [f"{name.replace('_', ' ')}: {', '.join(values)}" for name, values in names.items()]
    group = sorted({other for entry in fabric["effects"] for other in entry["group"]})
    if group:
        parts.append("or " + ", ".join(name.replace("_", " ") for name in group))
    return "; ".join(parts) or "-"


def scale(fabric):
    declared = [e for e in fabric["fit"].get("effects", []) if e.get("name") == "scale"]
    return f"{declared[0]['value']:.1f}" if declared else "-"


def row(name, fabric):
    held = fabric["holdout"]
    after = fabric.get("after")
    before_groups, after_groups = fabric["groups"], after["groups"] if after else []
    shifts = [
        shift(before_groups, "dc_measured"),
        shift(before_groups, "dc_simulated"),
        shift(after_groups, "dc_simulated"),
    ]
    errors = [held.get("before_mm"), held.get("after_mm"), held.get("se_mm")]
    cells = [name, fabric["verdict"], scale(fabric), effects(fabric)]
    cells += [number(errors[0]), number(errors[1]), number(errors[2])]
    cells += [number(value, 1) for value in shifts]
    return "| " + " | ".join(cells) + " |"


def main():
    print("| fabric | verdict | scale [%] | effects | before [mm] | after | se | shift measured | before | after |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for folder in sys.argv[1:]:
        with open(pathlib.Path(folder) / "calibration.json") as file:
            found = json.load(file)
        for name, fabric in found["fabrics"].items():
            if "failed" in fabric["fit"]:
                print(f"| {name} | not fitted: {fabric['fit']['failed']} |" + " |" * 8)
            else:
                print(row(name, fabric))


if __name__ == "__main__":
    main()
