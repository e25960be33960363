#!/usr/bin/env python3
"""Drapes fabrics in the programs that `export --scene` writes for, and in `scan2params simulate`.

    python3.11 -m venv .venv && .venv/bin/pip install -r scripts/export/requirements.txt
    .venv/bin/python scripts/export/drape.py [--scan2params PROGRAM] [--only NAMES] [--edge-mm MM]

Prints a table for docs/export.md: drape coefficient, folds, mean and largest height of the rim, simulated
time and CPU time to rest. A cloth rests where its vertices move by less than 0.1 mm in 0.2 s, root mean
square, twice in sequence; `simulate` rests by its own, stricter rule. `simulate` falls from --seeds seeds,
whose least and largest value stand in its row. A package that is missing is a line that says so.
"""

import argparse
import contextlib
import importlib.metadata
import importlib.util
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree

import numpy as np

from sheets import Sheet, triangles_of

SIDE_M = 0.300
PLATES_M = {"drape": 0.050, "cusick": 0.090}
FLAT_M2 = {"drape": SIDE_M**2, "cusick": math.pi * (SIDE_M / 2) ** 2}
WINDOW_S, STILL_M, MOST_S = 0.2, 1e-4, 10.0
PACKAGES = {"mujoco": "mujoco", "newton": "newton", "blender": "bpy"}
ENDINGS = {"mujoco": ".xml", "newton": ".py", "blender": ".py"}


class InMujoco:
    """The exported MJCF in MuJoCo."""

    def __init__(self, path):
        import mujoco

        self.step, model = mujoco.mj_step, mujoco.MjModel.from_xml_path(str(path))
        self.model, self.data = model, mujoco.MjData(model)
        mujoco.mj_forward(model, self.data)
        cloth = xml.etree.ElementTree.parse(path).find(".//flexcomp")
        self.triangles = np.array(cloth.get("element").split(), int).reshape(-1, 3)

    def advance(self, seconds):
        for _ in range(round(seconds / self.model.opt.timestep)):
            self.step(self.model, self.data)

    def positions_m(self):
        return np.array(self.data.flexvert_xpos).reshape(-1, 3)


def in_script(path):
    """The exported script, which has the cloth as the class Drape."""
    spec = importlib.util.spec_from_file_location(f"exported_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    drape = module.Drape()
    faces = getattr(module, "FACES", None) or module.TRIANGLES
    drape.triangles = triangles_of(faces)
    return drape


def settle(drape):
    """Lets the cloth come to rest. Gives the simulated seconds, and whether it rests."""
    before, still, time_s = drape.positions_m(), 0, 0.0
    while still < 2 and time_s < MOST_S:
        drape.advance(WINDOW_S)
        time_s += WINDOW_S
        now = drape.positions_m()
        moved_m = float(((now - before) ** 2).sum(axis=1).mean() ** 0.5)
        still = still + 1 if moved_m < STILL_M else 0
        before = now
    return time_s, still == 2


def run(words):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True)


def line(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def spread(values, digits):
    """Mean, and least to largest where there are several."""
    mean = f"{np.mean(values):.{digits}f}"
    return mean if len(values) == 1 else f"{mean} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def row(lead, scene, sheets, seconds, cpu_s):
    heights = np.array([sheet.heights_mm() for sheet in sheets])
    coefficients = [sheet.coefficient(PLATES_M[scene], FLAT_M2[scene]) for sheet in sheets]
    folds = [sheet.folds() for sheet in sheets]
    folds = f"{min(folds)} to {max(folds)}" if min(folds) < max(folds) else str(folds[0])
    cells = [spread(coefficients, 1), folds, spread(heights[:, 0], 0), spread(heights[:, 1], 0)]
    line([*lead, *cells, seconds, spread(cpu_s, 1)])


def ours(given, folder, params, scene, edge_mm):
    """Rows of `simulate` with cells of this size, from several seeds."""
    sheets, cpu_s, rests = [], [], True
    for seed in range(1, given.seeds + 1):
        out, boundary = folder / "ours.obj", folder / "ours.csv"
        words = [given.scan2params, "simulate", "--params", params, "--seed", seed, "--json"]
        words += ["--out", out, "--boundary", boundary, "--vertices", round(1e3 * SIDE_M / edge_mm) + 1]
        report = json.loads(run(words + (["--cusick"] if scene == "cusick" else [])).stdout)
        rests &= report["stop"] == "at_rest"
        cpu_s.append(report["cpu_s"])
        sheets.append(Sheet.read(out, boundary))
        keep(given, sheets[-1], f"{name_of(params)}_{scene}_ours_{edge_mm:g}_{seed}")
    lead = [name_of(params), scene, "scan2params", f"{edge_mm:g}"]
    row(lead, scene, sheets, "at rest" if rests else "not at rest", cpu_s)


def theirs(given, folder, params, scene, name, edge_mm):
    """The row of a program that is exported to."""
    out = folder / f"{name_of(params)}_{scene}_{name}{ENDINGS[name]}"
    words = [given.scan2params, "export", params, "--to", name, "--scene", scene, "--out", out]
    run([*words, "--edge-mm", edge_mm, *given.flags])
    with quiet():
        drape = InMujoco(out) if name == "mujoco" else in_script(out)
        drape.advance(0.002)
        start = time.process_time()
        time_s, rests = settle(drape)
        cpu_s = time.process_time() - start
    sheet = Sheet(drape.positions_m(), drape.triangles)
    keep(given, sheet, f"{name_of(params)}_{scene}_{name}_{edge_mm:g}")
    package = PACKAGES[name]
    lead = [name_of(params), scene, f"{package} {importlib.metadata.version(package)}", f"{edge_mm:g}"]
    row(lead, scene, [sheet], f"{time_s:.1f}" if rests else f"not at rest at {time_s:.1f}", [cpu_s])


def name_of(params):
    return params.name.split(".")[0]


def keep(given, sheet, name):
    if given.keep:
        given.keep.mkdir(parents=True, exist_ok=True)
        np.savez(given.keep / f"{name}.npz", vertices_m=sheet.vertices_m, triangles=sheet.triangles, rim_m=sheet.rim_m)


@contextlib.contextmanager
def quiet():
    """Without what the packages print."""
    sys.stdout.flush()
    kept, null = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(null)


def arguments():
    root = pathlib.Path(__file__).resolve().parents[2]
    fabrics = [root / "fixtures" / "drapes" / f"{name}.params.json" for name in ("woven", "stiff")]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scan2params", default=root / "target/release/scan2params", type=pathlib.Path)
    parser.add_argument("--params", nargs="+", type=pathlib.Path, default=fabrics)
    parser.add_argument("--scenes", nargs="+", choices=[*PLATES_M], default=[*PLATES_M])
    parser.add_argument("--only", nargs="*", choices=[*PACKAGES], default=[*PACKAGES])
    parser.add_argument("--edge-mm", nargs="+", type=float, default=[10.0])
    parser.add_argument("--seeds", type=int, default=5, help="falls of `simulate`, 0 for none")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the sheets at rest, npz")
    parser.add_argument("--flags", nargs="*", default=[], help="more flags for `export`, as --friction=0.5")
    return parser.parse_args()


def main():
    given = arguments()
    for name in list(given.only):
        if importlib.util.find_spec(PACKAGES[name]) is None:
            print(f"{name}: skipped, the package {PACKAGES[name]} is not installed", file=sys.stderr)
            given.only.remove(name)
    line(
        ["fabric", "scene", "program", "edge, mm", "drape coefficient, %", "folds"]
        + ["rim height: mean, mm", "largest, mm", "time to rest, s", "CPU to rest, s"]
    )
    print("|---" * 10 + "|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for params in given.params:
            for scene in given.scenes:
                for edge_mm in given.edge_mm:
                    if given.seeds:
                        ours(given, folder, params, scene, edge_mm)
                    for name in given.only:
                        theirs(given, folder, params, scene, name, edge_mm)


if __name__ == "__main__":
    main()
