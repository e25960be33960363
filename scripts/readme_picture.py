#!/usr/bin/env python3
"""The picture at the top of README.md, from what the program writes: `bash scripts/pictures.sh` calls it.

    readme_picture.py SCAN.ply TRUTH.json PARAMS.json BOUNDARY.csv DRAPE.obj OUT.png

Four panels: the scan, the rim that was found on it, the six stiffnesses with their 90 % intervals over the range that
the model was trained on, and the drape that was simulated with them. The scan is turned into the simulation frame by its
truth, so that all four are seen from one place; the program does not read that file. Needs Pillow and numpy."""

import csv
import json
import pathlib
import sys

import numpy as np
from PIL import Image, ImageDraw, ImageFont

SCALE = 2  # drawn larger, and made smaller for smooth edges
SIZE, HEAD, GAP = 400, 54, 34
INK, FAINT, RIM, BAR = (34, 40, 49), (150, 158, 168), (206, 32, 41), (38, 98, 200)
CLOTH = np.array([196, 178, 148])
FONTS = ["/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "DejaVuSans.ttf"]


def font(size):
    for name in FONTS:
        try:
            return ImageFont.truetype(name, size * SCALE)
        except OSError:
            continue
    return ImageFont.load_default(size * SCALE)


def read_ply(path):
    data = pathlib.Path(path).read_bytes()
    head, body = data.split(b"end_header\n", 1)
    count = int(head.split(b"element vertex ")[1].split()[0])
    row = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "u1", 3)])
    rows = np.frombuffer(body, row, count)
    return np.stack([rows["x"], rows["y"], rows["z"]], axis=1).astype(float)


def to_simulation_mm(points, truth):
    i, j, k, w = truth["simulation_from_scanner_rotation_ijkw"]
    turn = np.array([
        [1 - 2 * (j * j + k * k), 2 * (i * j - k * w), 2 * (i * k + j * w)],
        [2 * (i * j + k * w), 1 - 2 * (i * i + k * k), 2 * (j * k - i * w)],
        [2 * (i * k - j * w), 2 * (j * k + i * w), 1 - 2 * (i * i + j * j)],
    ])
    return (points * truth["unit_m"] @ turn.T + truth["simulation_from_scanner_translation_m"]) * 1e3


class View:
    """A view from obliquely above: simulation frame, y up."""

    def __init__(self, azimuth_deg=32, elevation_deg=24, mm=225):
        a, e = np.radians([azimuth_deg, elevation_deg])
        self.right = np.array([np.cos(a), 0, -np.sin(a)])
        self.toward = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
        self.up = np.cross(self.toward, self.right)
        self.scale = SIZE * SCALE / mm

    def __call__(self, points):
        x = points @ self.right * self.scale + SIZE * SCALE / 2
        y = -(points + [0, 52, 0]) @ self.up * self.scale + SIZE * SCALE * 0.47
        return np.stack([x, y], axis=1), points @ self.toward


def cloth_of(scan):
    """What is no floor and lies about the plate, which is all that the picture shows."""
    return scan[(np.hypot(scan[:, 0], scan[:, 2]) < 170) & (scan[:, 1] > -170)]


def draw_points(image, view, points, colours):
    flat, depth = view(points)
    order = np.argsort(depth)
    draw = ImageDraw.Draw(image)
    for (x, y), colour in zip(flat[order], colours[order]):
        draw.ellipse([x - 2.6, y - 2.6, x + 2.6, y + 2.6], fill=tuple(int(c) for c in colour))


def shade_points(view, points):
    """Brighter where the cloth is nearer."""
    depth = view(points)[1]
    near = (depth - depth.min()) / (depth.max() - depth.min())
    return CLOTH * 0.35 + (CLOTH * 0.85) * near[:, None] ** 1.4


def mesh_of(path):
    vertices, faces = [], []
    for line in pathlib.Path(path).read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            faces.append([int(w.split("/")[0]) - 1 for w in words[1:]])
    triangles = [[face[0], face[k], face[k + 1]] for face in faces for k in range(1, len(face) - 1)]
    return np.array(vertices), np.array(triangles)


def draw_mesh(image, view, vertices, triangles):
    corners = vertices[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # A normal for each vertex, or the triangles of an even mesh look like scales.
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, triangles[:, k], faces)
    normals = normals[triangles].mean(axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals *= np.sign(normals @ view.toward)[:, None]
    light = view.toward * 0.6 + view.up * 0.6 - view.right * 0.6
    light /= np.linalg.norm(light)
    bright = 0.30 + 0.70 * np.clip(normals @ light, 0, 1)
    flat, depth = view(vertices)
    draw = ImageDraw.Draw(image)
    for k in np.argsort(depth[triangles].mean(axis=1)):
        colour = tuple(int(c) for c in np.clip(CLOTH * 1.2 * bright[k], 0, 255))
        draw.polygon([tuple(flat[v]) for v in triangles[k]], fill=colour, outline=colour)


def draw_rim(image, view, rim):
    flat, _ = view(np.vstack([rim, rim[:1]]))
    ImageDraw.Draw(image).line([tuple(p) for p in flat], fill=RIM, width=3 * SCALE, joint="curve")


def draw_numbers(image, params):
    draw = ImageDraw.Draw(image)
    names = [
        ("stretch_weft", "stretch, weft"), ("stretch_warp", "stretch, warp"), ("shear", "shear"),
        ("bending_weft", "bending, weft"), ("bending_warp", "bending, warp"), ("bending_bias", "bending, bias"),
    ]
    left, right = 140 * SCALE, 386 * SCALE
    for k, (key, name) in enumerate(names):
        found = params["parameters"][key]
        low, high = (1e3, 1e6) if found["unit"] == "g/s^2" else (1e2, 1e5)
        y = (52 + 54 * k + (14 if k > 2 else 0)) * SCALE
        at = lambda value: left + (right - left) * np.log(value / low) / np.log(high / low)
        draw.line([left, y, right, y], fill=(222, 226, 231), width=2 * SCALE)
        a, b = (at(end) for end in found["interval90"])
        draw.rounded_rectangle([a, y - 6 * SCALE, b, y + 6 * SCALE], 5 * SCALE, fill=(160, 190, 240))
        x = at(found["value"])
        draw.ellipse([x - 6 * SCALE, y - 6 * SCALE, x + 6 * SCALE, y + 6 * SCALE], fill=BAR)
        draw.text((left - 12 * SCALE, y), name, INK, font(14), anchor="rm")
        unit = "g/s²" if found["unit"] == "g/s^2" else "g mm²/s²/rad"
        value = f"{float(format(found['value'], '.2g')):,.0f}".replace(",", " ")
        draw.text((x, y - 11 * SCALE), f"{value} {unit}", INK, font(12), anchor="mb")


def main(scan_file, truth_file, params_file, boundary_file, drape_file, out):
    view = View()
    truth = json.loads(pathlib.Path(truth_file).read_text())
    scan = cloth_of(to_simulation_mm(read_ply(scan_file), truth))
    params = json.loads(pathlib.Path(params_file).read_text())
    with open(boundary_file, newline="") as file:
        rim = np.array([[float(row[k]) for k in ("x_mm", "y_mm", "z_mm")] for row in csv.DictReader(file)])
    vertices, triangles = mesh_of(drape_file)
    panels = []
    for _ in range(4):
        panels.append(Image.new("RGB", (SIZE * SCALE, SIZE * SCALE), "white"))
    colours = shade_points(view, scan)
    draw_points(panels[0], view, scan, colours)
    draw_points(panels[1], view, scan, 0.35 * colours + 0.65 * 255 * 0.93)
    draw_rim(panels[1], view, rim)
    draw_numbers(panels[2], params)
    draw_mesh(panels[3], view, vertices, triangles)
    titles = ["a depth-sensor scan", "its rim, found", "six stiffnesses, each with its interval", "the fabric, simulated"]
    width = 4 * SIZE + 3 * GAP
    whole = Image.new("RGB", (width * SCALE, (SIZE + HEAD) * SCALE), "white")
    draw = ImageDraw.Draw(whole)
    for k, (panel, title) in enumerate(zip(panels, titles)):
        x = k * (SIZE + GAP) * SCALE
        whole.paste(panel, (x, HEAD * SCALE))
        draw.text((x + SIZE * SCALE / 2, HEAD * SCALE / 2), title, INK, font(19), anchor="mm")
        if k:
            y, tip = (HEAD + SIZE * 0.48) * SCALE, x - 4 * SCALE
            draw.line([tip - 24 * SCALE, y, tip - 6 * SCALE, y], fill=FAINT, width=4 * SCALE)
            draw.polygon([(tip, y), (tip - 12 * SCALE, y - 8 * SCALE), (tip - 12 * SCALE, y + 8 * SCALE)], fill=FAINT)
    small = whole.resize((width, SIZE + HEAD), Image.Resampling.LANCZOS)
    small.quantize(224, dither=Image.Dither.NONE).save(out, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
