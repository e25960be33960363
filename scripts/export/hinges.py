#!/usr/bin/env python3
"""What bending costs on the meshes of `export --scene` in MuJoCo, about several axes.

    .venv/bin/python scripts/export/hinges.py [--scan2params PROGRAM] [--edge-mm MM]

The flat cloth is bent to a shallow cylinder. The work of the flex's forces over that of a plate, B / 2 times
curvature squared times area, should be 1. For comparison: square cells whose diagonals alternate.
"""

import argparse
import pathlib
import subprocess
import tempfile
import xml.etree.ElementTree as ElementTree

import numpy as np

from drape import FLAT_M2, SIDE_M

CURVATURE_PER_M = 0.02
AXES_DEG = (0, 22.5, 45, 67.5, 90, 135)


def squares(edge_m):
    """Points and triangles of square cells with alternating diagonals."""
    n = round(SIDE_M / edge_m)
    points = [[SIDE_M * (i / n - 0.5), SIDE_M * (j / n - 0.5), 0.0] for i in range(n + 1) for j in range(n + 1)]
    triangles = []
    for i in range(n):
        for j in range(n):
            a, b, c, d = i * (n + 1) + j, (i + 1) * (n + 1) + j, (i + 1) * (n + 1) + j + 1, i * (n + 1) + j + 1
            triangles += [(a, b, d), (b, c, d)] if (i + j) % 2 else [(a, b, c), (a, c, d)]
    return np.array(points), np.array(triangles)


def costs(points, triangles, elasticity, area_m2):
    """Work over that of a plate, for each axis."""
    import mujoco

    young, poisson, thickness = (float(elasticity[key]) for key in ("young", "poisson", "thickness"))
    bending = young * thickness**3 / (12 * (1 - poisson**2))
    words = [" ".join(f"{x:.9g}" for x in np.ravel(numbers)) for numbers in (points, triangles)]
    constants = " ".join(f'{key}="{value}"' for key, value in elasticity.items())
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option gravity="0 0 0"/><worldbody>
        <flexcomp name="s" type="direct" dim="2" mass="0.02" radius="0.0005" point="{words[0]}" element="{words[1]}">
        <contact selfcollide="none"/><elasticity {constants}/></flexcomp></worldbody></mujoco>"""
    )
    data, found = mujoco.MjData(model), []
    for axis in np.radians(AXES_DEG):
        along = np.array([np.cos(axis), np.sin(axis)])
        way = points[:, :2] @ along
        moved = data.qpos.reshape(-1, 3)
        moved[:, :2] = np.outer(-(CURVATURE_PER_M**2) * way**3 / 6, along)
        moved[:, 2] = 0.5 * CURVATURE_PER_M * way**2
        mujoco.mj_forward(model, data)
        work = -0.5 * float((data.qfrc_passive.reshape(-1, 3) * moved).sum())
        found.append(work / (0.5 * bending * CURVATURE_PER_M**2 * area_m2))
    return found


def main():
    root = pathlib.Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scan2params", default=root / "target/release/scan2params", type=pathlib.Path)
    parser.add_argument("--edge-mm", type=float, default=10.0)
    given = parser.parse_args()
    print("| mesh | " + " | ".join(f"{axis:g} degrees" for axis in AXES_DEG) + " |")
    print("|---" * (1 + len(AXES_DEG)) + "|")
    with tempfile.TemporaryDirectory() as folder:
        for scene, area_m2 in FLAT_M2.items():
            out = pathlib.Path(folder) / f"{scene}.xml"
            words = [given.scan2params, "export", root / "fixtures/drapes/woven.params.json", "--to", "mujoco"]
            words += ["--scene", scene, "--edge-mm", given.edge_mm, "--out", out]
            subprocess.run([str(word) for word in words], check=True, capture_output=True)
            cloth = ElementTree.parse(out).find(".//flexcomp")
            points = np.array(cloth.get("point").split(), float).reshape(-1, 3)
            points[:, 2] = 0.0
            triangles = np.array(cloth.get("element").split(), int).reshape(-1, 3)
            elasticity = dict(cloth.find("elasticity").attrib, damping="0")
            rows = [(scene, points, triangles)]
            if scene == "drape":
                rows.append(("square cells", *squares(1e-3 * given.edge_mm)))
            for name, at, faces in rows:
                numbers = " | ".join(f"{cost:.2f}" for cost in costs(at, faces, elasticity, area_m2))
                print(f"| {name} | {numbers} |", flush=True)


if __name__ == "__main__":
    main()
