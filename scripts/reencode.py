"""Writes one scan as exporters do, draws the ways by seed, and holds each answer against the scan's own.

    python scripts/reencode.py PROGRAM SCAN.ply --seed 1 --count 200 --out FOLDER [--jobs 2]

Each file is either to be read, so that its rim is that of SCAN, or to be refused with a message that names the
cause. Prints a line for each that is neither, and the share of those that are right.
"""

import argparse
import csv
import re
import struct
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

# A mirrored rim, or one with exchanged sides, is centimetres off. The step of the file's coordinates is added.
ALIKE_MM = 0.6

SPELLINGS = [
    ["x", "y", "z"],
    ["X", "Y", "Z"],
    ["X[m]", "Y[m]", "Z[m]"],
    ["x (mm)", "y (mm)", "z (mm)"],
    ["pos_x", "pos_y", "pos_z"],
    ["PositionX", "PositionY", "PositionZ"],
    ["X coordinate", "Y coordinate", "Z coordinate"],
    ["East", "North", "Height"],
    ["Easting", "Northing", "Elevation"],
    ["E", "N", "H"],
    ["Points:0", "Points:1", "Points:2"],
    ["Rechtswert", "Hochwert", "Höhe"],
]
COLORS = [["r", "g", "b"], ["Red", "Green", "Blue"], ["R", "G", "B"], ["diffuse_red", "diffuse_green", "diffuse_blue"]]
NORMALS = [["nx", "ny", "nz"], ["Nx", "Ny", "Nz"], ["normal_x", "normal_y", "normal_z"]]
NOT_UNDERSTOOD = [["a", "b", "c"], ["lon", "lat", "height"], ["u", "v", "w"], ["col1", "col2", "col3"]]


def read_ply(path):
    """Points [m] and colours of a binary little-endian PLY with x y z as floats and colours as bytes."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    count = int(re.search(rb"element vertex (\d+)", data[:end])[1])
    rows = np.frombuffer(data, np.dtype([("p", "<f4", 3), ("c", "u1", 3)]), count, end)
    return rows["p"].astype(float), rows["c"]


def normals(points, rng):
    directions = rng.normal(size=points.shape)
    return directions / np.linalg.norm(directions, axis=1)[:, None]


class Draw:
    """One way to write the scan: the file's ending and bytes, and what is right."""

    def __init__(self, points, colors, rng):
        self.points, self.colors, self.rng = points, colors, rng
        self.said = []
        # The step in which the file stores its coordinates [mm].
        self.step_mm = 0.0

    def one(self, choices):
        return choices[self.rng.integers(len(choices))]

    def yes(self, share=0.5):
        return self.rng.random() < share

    def text(self):
        titled = self.yes(0.7)
        scale = self.one([1.0, 1e3, 1e3, 100.0, 1 / 0.0254])
        points = self.points * scale
        if self.yes(0.2):
            points = points + np.round(self.rng.uniform(-1e6, 1e6, 3))
            self.said.append("offset")
        digits = 2 + {1.0: 3, 100.0: 1}.get(scale, 0)
        columns = [("x", points[:, 0]), ("y", points[:, 1]), ("z", points[:, 2])]
        spelling = self.one(SPELLINGS)
        names = dict(zip("xyz", spelling))
        if titled:
            self.rng.shuffle(columns)
        before, after = [], []
        count = len(points)
        if self.yes(0.3):
            before.append([("id", np.arange(count))])
        if self.yes(0.2):
            start = self.one([0.0, 1.7e9])
            before.append([("time", start + np.arange(count) * self.one([1e-2, 3.3e-4]))])
        if self.yes(0.3):
            after.append([("intensity", self.rng.integers(-2048, 2047, count))])
        if self.yes(0.3):
            after.append(list(zip(self.one(NORMALS), normals(points, self.rng).T)))
        if self.yes(0.4):
            (before if self.yes(0.3) else after).append(list(zip(self.one(COLORS), self.colors.T)))
        if not titled and len(before) > 1:
            before = before[:1]
        columns = [c for part in before for c in part] + columns + [c for part in after for c in part]
        separator, decimal = self.one([(" ", "."), (",", "."), (";", "."), ("\t", "."), (", ", "."), (";", ","),
                                       ("\t", ","), (" ", ","), ("quoted", ",")])
        wrong = titled and self.yes(0.1)
        if wrong:
            names = dict(zip("xyz", self.one(NOT_UNDERSTOOD)))
        blank = separator in " \t" and separator != "\t"
        titles = [names.get(n, n) for n, _ in columns]
        if blank:
            titles = [t if "(" in t else t.replace(" ", "_") for t in titles]
        self.said.append(f"text {'titles ' + ' '.join(titles) if titled else 'plain ' + ' '.join(n for n, _ in columns)}"
                         f" separator {separator!r} decimal {decimal!r} scale {scale:g}")
        cells = []
        for _, values in columns:
            whole = np.issubdtype(values.dtype, np.integer)
            form = (lambda v: str(v)) if whole else (lambda v: f"{v:.{max(digits, 4)}f}".replace(".", decimal))
            cells.append([form(v) for v in values])
        joined = '","' if separator == "quoted" else separator
        quote = '"' if separator == "quoted" else ""
        rows = [quote + joined.join(row) + quote for row in zip(*cells)]
        head = []
        if self.yes(0.2):
            head.append("# exported by a scanner, 2026")
        if self.yes(0.1):
            head.append(str(count))
        if titled:
            head.append(self.one(["", "", "//", "# "] if not wrong else [""]) + quote + joined.join(titles) + quote)
        end = self.one(["\n", "\n", "\r\n", "\r"])
        body = end.join(head + rows) + end
        encoding = self.one(["utf-8"] * 4 + ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
        self.said.append(encoding)
        ending = self.one([".xyz", ".asc", ".txt", ".csv"])
        return ending, body.encode(encoding), r"do not say which" if wrong else None

    def ply(self):
        form = self.one(["ascii", "binary_little_endian", "binary_big_endian"])
        kind, code = self.one([("float", "f4"), ("double", "f8")])
        order = list(self.rng.permutation(3))
        end = self.one(["\n", "\r\n", "\n\r"]) if form != "ascii" else self.one(["\n", "\r\n"])
        scale = self.one([1.0, 1e3])
        extra = self.yes()
        lines = ["ply", f"format {form} 1.0", "comment drawn", f"element vertex {len(self.points)}"]
        lines += ["property uchar quality"] if extra else []
        lines += [f"property {kind} {'xyz'[k]}" for k in order]
        lines += ["end_header"]
        self.said.append(f"ply {form} {kind} order {order} end {end!r} scale {scale:g}")
        head = end.join(lines) + end
        points = self.points[:, order] * scale
        if form == "ascii":
            rows = [("7 " if extra else "") + " ".join(f"{v:.6f}" for v in row) for row in points]
            return ".ply", (head + end.join(rows) + end).encode(), None
        code = ("<" if "little" in form else ">") + code
        fields = ([("q", "u1")] if extra else []) + [("p", code, 3)]
        rows = np.zeros(len(points), np.dtype(fields))
        rows["p"] = points
        return ".ply", head.encode() + rows.tobytes(), None

    def obj(self):
        end = self.one(["\n", "\r\n"])
        broken = self.one([" ", f" \\{end} "])
        scale = self.one([1.0, 1e3])
        self.said.append(f"obj {broken!r} scale {scale:g}")
        rows = [f"v {x:.6f} {y:.6f}{broken}{z:.6f}" for x, y, z in self.points * scale]
        return ".obj", (end.join(["# drawn", "o cloth"] + rows) + end).encode(), None

    def pcd(self):
        binary = self.yes()
        self.said.append(f"pcd binary {binary}")
        head = (f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(self.points)}\n"
                f"HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(self.points)}\nDATA {'binary' if binary else 'ascii'}\n")
        if binary:
            return ".pcd", head.encode() + self.points.astype("<f4").tobytes(), None
        return ".pcd", (head + "".join(f"{x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in self.points)).encode(), None

    def las(self):
        step = self.one([1e-4, 1e-5, 1e-3, 1e-2, 2e-2])
        self.step_mm = 1e3 * step
        offset = self.rng.uniform(-5e5, 5e5, 3) * self.one([0, 1])
        whole = np.round(self.points / step).astype("<i4")
        lost = self.yes(0.3)
        if lost:
            whole[self.rng.integers(len(whole), size=20)] = -2147483648
        head = bytearray(227)
        head[0:4] = b"LASF"
        head[24:26] = bytes([1, 2])
        struct.pack_into("<HII", head, 94, 227, 227, 0)
        head[104] = 0
        struct.pack_into("<HI", head, 105, 20, len(whole))
        struct.pack_into("<6d", head, 131, step, step, step, *offset)
        rows = np.zeros(len(whole), np.dtype([("p", "<i4", 3), ("rest", "u1", 8)]))
        rows["p"] = whole
        self.said.append(f"las step {step:g} lost {lost}")
        return ".las", bytes(head) + rows.tobytes(), r"steps of (10|20)" if step >= 1e-2 else None

    def coarse(self):
        """float32 with the offsets of a map, or too few digits."""
        if self.yes():
            offset = self.one([3e5, 5e6])
            self.step_mm = 1e3 * float(np.spacing(np.float32(offset)))
            points = (self.points + offset).astype("<f4")
            self.said.append(f"ply float32 offset {offset:g}")
            head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n" + "".join(
                f"property float {a}\n" for a in "xyz") + "end_header\n"
            return ".ply", head.encode() + points.tobytes(), r"steps of"
        digits = self.one([2, 3, 4])
        self.step_mm = 10.0 ** (3 - digits)
        self.said.append(f"text of {digits} digits in m")
        rows = "".join(" ".join(f"{v:.{digits}f}" for v in row) + "\n" for row in self.points)
        return ".xyz", rows.encode(), r"steps of 10" if digits == 2 else None

    def units(self):
        name, scale = self.one([("0.1 mm", 1e4), ("ft", 1 / 0.3048), ("cm", 100.0), ("in", 1 / 0.0254), ("um", 1e6)])
        self.said.append(f"unit {name}")
        points = (self.points * scale).astype("<f4")
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n" + "".join(
            f"property float {a}\n" for a in "xyz") + "end_header\n"
        return ".ply", head.encode() + points.tobytes(), None

    def file(self):
        kind = self.rng.choice(["text", "ply", "obj", "pcd", "las", "coarse", "units"], p=[0.5, 0.15, 0.05, 0.05, 0.1, 0.08, 0.07])
        return getattr(self, kind)()


def rim(path):
    with open(path, newline="") as file:
        return np.array([[float(row[k]) for k in ("x_mm", "y_mm", "z_mm")] for row in csv.DictReader(file)])


def boundary(program, path, out, warp):
    """The rim of a file, or what was said; the seconds it took."""
    start = time.monotonic()
    command = [program, "boundary", str(path), "--warp-toward", warp, "-o", str(out), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=900)
    seconds = time.monotonic() - start
    return (rim(out) if out.exists() else None), done.stderr + done.stdout, done.returncode, seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program")
    parser.add_argument("scan", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--warp-toward", default="1,0.2,0.1")
    parser.add_argument("--only", help="numbers of the draws, with commas between")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    points, colors = read_ply(given.scan)
    want, said, _, _ = boundary(given.program, given.scan, given.out / "own.csv", given.warp_toward)
    if want is None:
        sys.exit(f"the scan itself is refused: {said}")

    def tried(number):
        draw = Draw(points, colors, np.random.default_rng([given.seed, number]))
        ending, content, named = draw.file()
        path = given.out / f"{number:04}{ending}"
        path.write_bytes(content)
        out = given.out / f"{number:04}.rim.csv"
        out.unlink(missing_ok=True)
        got, said, code, seconds = boundary(given.program, path, out, given.warp_toward)
        off = np.inf if got is None else np.linalg.norm(got - want, axis=1).max()
        # A coarse file may be read well too.
        right = off < ALIKE_MM + draw.step_mm and (named is None or draw.step_mm > 0)
        right |= named is not None and code in (1, 4) and re.search(named, said) is not None
        right &= "panicked" not in said
        if right:
            path.unlink()
        outcome = f"{off:.2f} mm off" if got is not None else f"code {code}: {said.strip()[-220:]}"
        return number, right, off, seconds, code, "; ".join(draw.said), outcome

    numbers = [int(n) for n in given.only.split(",")] if given.only else range(given.count)
    with ThreadPoolExecutor(given.jobs) as pool:
        rows = list(pool.map(tried, numbers))
    for number, right, off, _, _, said, outcome in rows:
        if not right:
            print(f"{number:4} WRONG {said}\n          {outcome}")
    silent = [row for row in rows if np.isfinite(row[2]) and row[2] > 5]
    panics = [row for row in rows if row[4] not in (0, 1, 3, 4)]
    slow = max(row[3] for row in rows)
    print(f"{sum(row[1] for row in rows)} of {len(rows)} right; {len(silent)} exchanged or mirrored; {len(panics)} ended "
          f"otherwise than by an answer or a refusal; slowest {slow:.1f} s")


if __name__ == "__main__":
    main()
