#!/usr/bin/env python3
"""Exports fabrics and lets a clamped strip of each droop in the programs that are exported to.

    python3.11 -m venv .venv && .venv/bin/pip install -r scripts/export/requirements.txt
    .venv/bin/python scripts/export/cantilever.py [--scan2params PROGRAM] [--only NAMES]

Prints a table for docs/export.md: how far the end of the strip reaches and the angle of the line to it
below the horizontal, by the heavy elastica and there, with the stiffness entered as it is (before) and as
`export` writes it (after), and the stiffness over the true one that the reach stands for. Each exported
file is loaded by the package itself. A package that is missing is a line that says so.
"""

import argparse
import importlib.metadata
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree

import programs
from strips import GRAVITY_M_S2, LENGTH_M, WIDTH_M, Strip, elastica_mm, stiffness_ratio

DENSITY, STRETCH, SHEAR = 0.2, 100.0, 50.0
BENDING_LENGTHS_M = (0.020, 0.010)


def fabric(folder, bending_nm):
    """A params.json of a fabric that is alike in all directions."""
    units = {"stretch_weft": STRETCH, "stretch_warp": STRETCH, "shear": SHEAR}
    parameters = {key: {"value": value * 1e3, "unit": "g/s^2"} for key, value in units.items()}
    for key in ("bending_weft", "bending_warp", "bending_bias"):
        parameters[key] = {"value": bending_nm * 1e9, "unit": "g mm^2 s^-2 rad^-1"}
    path = folder / "strip.params.json"
    density = {"value": DENSITY * 1e3, "unit": "g/m^2"}
    path.write_text(json.dumps({"schema_version": 1, "parameters": parameters, "density": density}))
    return path


def export(program, params, target, out, *flags):
    command = [program, "export", params, "--to", target, "--out", out, *flags]
    subprocess.run([str(word) for word in command], check=True, capture_output=True)
    return out


def in_mujoco(program, folder, params, strip, bending):
    import mujoco

    out = export(program, params, "mujoco", folder / "strip.xml", "--edge-mm", 1e3 * strip.edge_m)
    mujoco.MjModel.from_xml_path(str(out))
    flex = dict(xml.etree.ElementTree.parse(out).find(".//elasticity").attrib)
    flex = {key: flex[key] for key in ("young", "poisson", "thickness")}
    # the formula that is often quoted
    t = math.sqrt(48 * bending / STRETCH)
    yield "before", lambda: programs.mujoco(
        strip, DENSITY, {"young": STRETCH / t, "poisson": 0, "thickness": t}
    )
    yield "after", lambda: programs.mujoco(strip, DENSITY, flex)


def in_newton(program, folder, params, strip):
    flags = ("--edge-mm", 1e3 * strip.edge_m, "--mesh", "grid")
    return json.loads(export(program, params, "newton", folder / "newton.json", *flags).read_text())


def in_style3d(program, folder, params, strip, bending):
    file = in_newton(program, folder, params, strip)["style3d"]
    before = dict(file, edge_aniso_ke=[bending] * 3)
    yield "before", lambda: programs.newton_style3d(strip, before)
    yield "after", lambda: programs.newton_style3d(strip, file)


def in_vbd(program, folder, params, strip, bending):
    file = in_newton(program, folder, params, strip)["vbd"]
    yield "before", lambda: programs.newton_vbd(strip, dict(file, edge_ke=bending))
    yield "after", lambda: programs.newton_vbd(strip, file)


def in_blender(program, folder, params, strip, bending):
    edge_mm = 1e3 * strip.edge_m
    out = export(program, params, "blender", folder / "strip.py", "--edge-mm", edge_mm)
    mass = DENSITY * strip.area_m2
    # a preset made for another mesh
    other = export(program, params, "blender", folder / "other.py", "--edge-mm", 2 * edge_mm)
    yield "before", lambda: programs.blender(strip, other, mass)
    yield "after", lambda: programs.blender(strip, out, mass)


def load_usd(program, folder):
    """The exported USD in OpenUSD: what it says of the fabric."""
    from pxr import Usd, UsdGeom, UsdShade

    params = fabric(folder, 2e-6)
    out = export(program, params, "usd", folder / "strip.usda", "--thickness-mm", 0.4)
    stage = Usd.Stage.Open(str(out))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Fabric/Specimen"))
    pattern = stage.GetPrimAtPath("/Fabric/Specimen/Pattern")
    expected = {"stretchWarp": 1e5, "bendingBiasLeft": 2000, "density": 2e-4, "thickness": 0.4}
    for name, value in expected.items():
        found = UsdGeom.PrimvarsAPI(pattern).GetPrimvar("clo:" + name).Get()[0]
        assert math.isclose(found, value, rel_tol=1e-6), (name, found)
    material = UsdShade.MaterialBindingAPI(mesh.GetPrim()).ComputeBoundMaterial("physics")[0]
    stiffness = material.GetPrim().GetAttribute("physics:surfaceBendStiffness").Get()
    assert math.isclose(stiffness, 2e-6, rel_tol=1e-6), stiffness
    points = len(mesh.GetPointsAttr().Get())
    ok = UsdGeom.Mesh.ValidateTopology(
        mesh.GetFaceVertexIndicesAttr().Get(), mesh.GetFaceVertexCountsAttr().Get(), points
    )
    assert ok, "topology"
    print(f"usd-core {version('usd-core')}: opens, {points} points, primvars and material as written")


def version(package):
    return importlib.metadata.version(package)


TARGETS = {
    "mujoco": (in_mujoco, "mujoco", "MuJoCo flex", (0.005, 0.0025)),
    "style3d": (in_style3d, "newton", "Newton Style3D", (0.005,)),
    "vbd": (in_vbd, "newton", "Newton VBD", (0.005,)),
    "blender": (in_blender, "bpy", "Blender cloth", (0.005, 0.0025)),
}


def rows(program, folder, name, edges_mm):
    of, package, words, edges_m = TARGETS[name]
    edges_m = [1e-3 * mm for mm in edges_mm] if edges_mm else edges_m
    try:
        words = f"{words} {version(package)}"
    except importlib.metadata.PackageNotFoundError:
        print(f"{words}: skipped, the package {package} is not installed", flush=True)
        return
    for edge_m in edges_m:
        for bending_length_m in BENDING_LENGTHS_M:
            strip = Strip(edge_m)
            bending = DENSITY * GRAVITY_M_S2 * bending_length_m**3
            truth = elastica_mm(bending_length_m, strip.length_m)
            params = fabric(folder, bending)
            cells = []
            for _, run in of(program, folder, params, strip, bending):
                reach, droop, _ = strip.end(run())
                angle = math.degrees(math.atan2(droop, reach))
                ratio = stiffness_ratio(reach, bending_length_m, strip.length_m)
                cells += [f"{reach:.2f}", f"{angle:.1f}", f"{ratio:.2f}"]
            true_angle = math.degrees(math.atan2(truth[1], truth[0]))
            lead = [words, f"{1e3 * bending_length_m:.0f}", f"{1e3 * edge_m:g}"]
            print("| " + " | ".join(lead + [f"{truth[0]:.2f}", f"{true_angle:.1f}"] + cells) + " |", flush=True)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--scan2params", default="target/release/scan2params", type=pathlib.Path)
    # VBD takes tens of minutes to come to rest: by name only
    usual = ["usd", "mujoco", "blender", "style3d"]
    arguments.add_argument("--only", nargs="+", choices=[*TARGETS, "usd"], default=usual)
    arguments.add_argument("--edge-mm", nargs="+", type=float, help="other meshes than the usual ones")
    given = arguments.parse_args()
    print(f"strip of {1e3 * LENGTH_M:.0f} mm x {1e3 * WIDTH_M:.0f} mm, {1e3 * DENSITY:.0f} g/m^2")
    print(
        "| program | bending length, mm | edge, mm | elastica: reach, mm | angle, deg "
        "| before: reach, mm | angle, deg | stiffness over true "
        "| after: reach, mm | angle, deg | stiffness over true |"
    )
    print("|---" * 11 + "|", flush=True)
    start = time.time()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name in given.only:
            if name != "usd":
                rows(given.scan2params, folder, name, given.edge_mm)
        if "usd" in given.only:
            try:
                load_usd(given.scan2params, folder)
            except ImportError:
                print("usd-core: skipped, not installed")
    print("CLO, Browzwear, ARCSim: skipped, no package registry has them", file=sys.stderr)
    print(f"{time.time() - start:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
