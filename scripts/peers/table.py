"""The tables of compare_peers.sh: CPU-s of each stage, the least of three runs.

In: the folder with pcl-all.N.csv, open3d-all.N.csv, ours.N.csv and so on. Out: Markdown.
"""

import csv
import pathlib
import sys

# What does the same job; ours does more in some (a plate, a sheet) and needs no normals
# or boundary of single points.
OURS = {
    "read": ["read", "points and unit"],
    "voxel": ["cut to the cloth", "clusters"],
    "plane": ["plate", "floor"],
    "outliers": ["strays"],
    "normals": ["smooth and normals"],
    "boundary": [
        "parameterisation", "relaxation", "square", "sheet", "registration", "edge and rim", "uncertainty",
    ],
}


def least(folder: pathlib.Path, name: str) -> dict[str, float]:
    """The stages of the run with the least sum."""
    runs = []
    for path in sorted(folder.glob(f"{name}.[0-9].csv")):
        with path.open() as file:
            rows = [row for row in csv.reader(file) if row[0] not in ("stage", "total")]
        runs.append({row[0]: float(row[1]) for row in rows})
    return min(runs, key=lambda run: sum(run.values()))


folder = pathlib.Path(sys.argv[1])
stages = least(folder, "ours")
known = {name for names in OURS.values() for name in names}
if known != set(stages):
    sys.exit(f"stages changed: {sorted(known ^ set(stages))}; correct OURS in table.py")
ours = {stage: sum(stages[name] for name in names) for stage, names in OURS.items()}
for floor, title in (("all", "Floor kept by the peers"), ("above", "Floor cut away")):
    pcl, open3d = (least(folder, f"{name}-{floor}") for name in ("pcl", "open3d"))
    print(f"\n{title}:\n\n| stage | PCL | Open3D | ours | PCL / ours | Open3D / ours |")
    print("|---|---|---|---|---|---|")
    for stage in [*OURS, "total"]:
        tables = (pcl, open3d, ours)
        a, b, c = (sum(t.values()) if stage == "total" else t[stage] for t in tables)
        print(f"| {stage} | {a:.2f} | {b:.2f} | {c:.2f} | {a / c:.1f} | {b / c:.1f} |")
