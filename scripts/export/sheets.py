"""What a drape is compared by: drape coefficient, folds and heights of the rim.

Positions are in metres, z up, the origin at the centre of the plate's top.
"""

import csv
import math

import numpy as np

PIXEL_M = 0.5e-3
RIM_POINTS = 244


class Sheet:
    """A sheet at rest: vertices (n x 3), triangles (m x 3), and points along its rim (k x 3).

    The rim is that of the mesh where it is not given.
    """

    def __init__(self, vertices_m, triangles, rim_m=None):
        self.vertices_m = np.asarray(vertices_m, float)
        self.triangles = np.asarray(triangles, int)
        self.rim_m = self.vertices_m[self.border()] if rim_m is None else rim_m

    @classmethod
    def read(cls, obj, boundary):
        """A sheet and its rim as `simulate` writes them: millimetres, y up. z up is x, -z, y.

        A disc is cut out of square cells, so that the mesh has steps where the disc has its rim. Of the
        mesh only what lies within the outermost vertices is kept.
        """
        lines = [line.split() for line in obj.read_text().splitlines()]
        at = np.array([[float(x) for x in words[1:4]] for words in lines if words[:1] == ["v"]])
        faces = [[int(w.split("/")[0]) - 1 for w in words[1:]] for words in lines if words[:1] == ["f"]]
        with boundary.open() as file:
            rim = [[float(point[f"{axis}_mm"]) for axis in "xyz"] for point in csv.DictReader(file)]
        at, rim = (1e-3 * np.asarray(points)[:, [0, 2, 1]] * [1, -1, 1] for points in (at, rim))
        whole = cls(at, triangles_of(faces), rim)
        outermost = np.isin(whole.triangles, whole.border()).any(axis=1)
        return cls(at, whole.triangles[~outermost], rim)

    def border(self):
        """Vertices along the border of the mesh, in sequence."""
        count = {}
        for a, b, c in self.triangles:
            for p, q in ((a, b), (b, c), (c, a)):
                key = (min(p, q), max(p, q))
                count[key] = None if key in count else (p, q)
        after = dict(edge for edge in count.values() if edge is not None)
        start = here = next(iter(after))
        rim = [start]
        while (here := after[here]) != start:
            rim.append(here)
        if len(rim) != len(after):
            raise SystemExit("the sheet has more than one rim")
        return rim

    def rim_points_m(self):
        """The rim at even steps of its length."""
        closed = np.vstack([self.rim_m, self.rim_m[:1]])
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
        at = np.arange(RIM_POINTS) * length[-1] / RIM_POINTS
        return np.stack([np.interp(at, length, closed[:, k]) for k in range(3)], axis=1)

    def folds(self):
        """Maxima of the rim's distance from the axis, smoothed over 9 points, as `simulate` counts."""
        rim = self.rim_points_m()
        rho = np.hypot(rim[:, 0], rim[:, 1])
        smooth = sum(np.roll(rho, k) for k in range(-4, 5)) / 9
        top = smooth > smooth.min() + 1e-3
        for k in range(1, 7):
            top &= (smooth > np.roll(smooth, -k)) & (smooth >= np.roll(smooth, k))
        return int(top.sum())

    def heights_mm(self):
        """Mean and largest height of the rim."""
        height = 1e3 * self.rim_points_m()[:, 2]
        return float(height.mean()), float(height.max())

    def coefficient(self, plate_radius_m, flat_area_m2):
        """Area seen from above beyond the plate over the flat cloth's area there [%]."""
        half = math.ceil(0.22 / PIXEL_M)
        seen = np.zeros((2 * half + 1, 2 * half + 1), bool)
        axis = np.arange(-half, half + 1) * PIXEL_M
        seen |= axis[:, None] ** 2 + axis[None, :] ** 2 <= plate_radius_m**2
        seen |= within(axis, self.rim_m[:, :2])
        for triangle in self.vertices_m[self.triangles][:, :, :2]:
            cover(seen, half, triangle / PIXEL_M)
        plate_m2 = math.pi * plate_radius_m**2
        return 100 * (seen.sum() * PIXEL_M**2 - plate_m2) / (flat_area_m2 - plate_m2)


def within(axis_m, outline_m):
    """Whether the points of a square grid lie within a closed outline: its winding number is not 0."""
    x, y = axis_m[:, None], axis_m[None, :]
    winding = np.zeros((len(axis_m), len(axis_m)), int)
    for (ax, ay), (bx, by) in zip(outline_m, np.roll(outline_m, -1, axis=0)):
        left = (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0
        winding += ((ay <= y) & (by > y) & left).astype(int)
        winding -= ((ay > y) & (by <= y) & ~left).astype(int)
    return winding != 0


def cover(seen, half, corners):
    """Marks the pixels whose middle lies in a triangle; corners in pixels from the middle."""
    low = np.maximum(np.ceil(corners.min(axis=0)), -half).astype(int)
    high = np.minimum(np.floor(corners.max(axis=0)), half).astype(int)
    if (low > high).any():
        return
    x = np.arange(low[0], high[0] + 1)[:, None]
    y = np.arange(low[1], high[1] + 1)[None, :]
    sides = []
    for k in range(3):
        (ax, ay), (bx, by) = corners[k], corners[(k + 1) % 3]
        sides.append((bx - ax) * (y - ay) - (by - ay) * (x - ax))
    inside = np.logical_and.reduce([s >= 0 for s in sides]) | np.logical_and.reduce([s <= 0 for s in sides])
    seen[low[0] + half : high[0] + half + 1, low[1] + half : high[1] + half + 1] |= inside


def triangles_of(faces):
    """Faces as triangles about their first corner."""
    return [(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)]
