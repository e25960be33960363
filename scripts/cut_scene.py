"""Cuts a scan of `augment` to a fixture: points within 390 mm of the plate's axis, evenly thinned, without colours.

    python scripts/cut_scene.py SCAN.ply OUT.ply

The pose is read from SCAN.truth.json, whose truth belongs to OUT.ply too. Standard library alone.
"""

import array
import json
import math
import pathlib
import sys

REACH_M = 0.39
MOST_POINTS = 130_000
ROW_BYTES = 15  # three floats and three colours


def cut(scan, out):
    truth = json.loads(scan.with_suffix(".truth.json").read_text())
    i, j, k, w = truth["simulation_from_scanner_rotation_ijkw"]
    rotation = [
        [1 - 2 * (j * j + k * k), 2 * (i * j - k * w), 2 * (i * k + j * w)],
        [2 * (i * k - j * w), 2 * (j * k + i * w), 1 - 2 * (i * i + j * j)],
    ]
    shift = [truth["simulation_from_scanner_translation_m"][axis] for axis in (0, 2)]
    head, rows = scan.read_bytes().split(b"end_header\n", 1)
    near = bytearray()
    for at in range(0, len(rows), ROW_BYTES):
        point = [truth["unit_m"] * c for c in array.array("f", rows[at : at + 12])]
        level = [sum(r * c for r, c in zip(row, point)) + t for row, t in zip(rotation, shift)]
        if math.hypot(*level) < REACH_M:
            near += rows[at : at + 12]
    points = len(near) // 12
    step = -(-points // MOST_POINTS)
    kept = b"".join(bytes(near[12 * k : 12 * k + 12]) for k in range(0, points, step))
    lines = [line for line in head.decode().splitlines() if "uchar" not in line and not line.startswith("element")]
    lines.insert(2, f"element vertex {len(kept) // 12}")
    out.write_bytes("\n".join([*lines, "end_header\n"]).encode() + kept)


if __name__ == "__main__":
    cut(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
