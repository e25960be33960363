"""Splits one scan into passes that miss each other, for `scan2params merge` to bring together.

    python scripts/split_passes.py SCAN.ply --count 6 --seed 1 --out FOLDER

SCAN.ply is a binary little-endian PLY of x, y and z as floats in metres, as `augment --even` writes it. Each pass has its
part of the points, drawn evenly. All but the first are moved by up to 20 mm and turned by up to 5 degrees about the middle.
"""

import argparse
from pathlib import Path

import numpy as np

HEADER = (
    "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
    "property float x\nproperty float y\nproperty float z\nend_header\n"
)


def rotation(turn_rad):
    """The matrix that turns about a vector by its length."""
    angle = np.linalg.norm(turn_rad)
    x, y, z = turn_rad / max(angle, 1e-300)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def passes(points, count, rng):
    """The points of each pass."""
    order, middle = rng.permutation(len(points)), points.mean(axis=0)

    def along(most):
        direction = rng.normal(size=3)
        return direction / np.linalg.norm(direction) * most * rng.uniform()

    for k in range(count):
        shift, turn = along(0.02) * (k > 0), along(np.radians(5)) * (k > 0)
        yield (points[order[k::count]] - middle) @ rotation(turn).T + middle + shift


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scan", type=Path)
    parser.add_argument("--count", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    data = given.scan.read_bytes()
    begin = data.index(b"end_header\n") + len(b"end_header\n")
    points = np.frombuffer(data, "<f4", offset=begin).reshape(-1, 3).astype(float)
    given.out.mkdir(parents=True, exist_ok=True)
    for k, of in enumerate(passes(points, given.count, np.random.default_rng(given.seed))):
        header = HEADER.format(len(of)).encode()
        (given.out / f"pass{k}.ply").write_bytes(header + of.astype("<f4").tobytes())


if __name__ == "__main__":
    main()
