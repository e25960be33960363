"""A strip of cloth: its mesh, and the heavy elastica, which says where its end hangs.

Lengths in metres. The strip leaves its clamp along x, level, and hangs in the plane of x and z. Two
rows of vertices are clamped; the free length begins in the middle between them.
"""

import math

import numpy as np

GRAVITY_M_S2 = 9.80665
LENGTH_M, WIDTH_M = 0.150, 0.020


class Strip:
    """A strip with square cells of edge_m, cut in two triangles each; as many rows as give LENGTH_M.

    mirrored: diagonals alternate, so that the mesh prefers no side; else they all run one way, as the
    grids of Newton and MuJoCo have it.
    """

    def __init__(self, edge_m, mirrored=True):
        self.edge_m, self.mirrored = edge_m, mirrored
        self.rows = round(LENGTH_M / edge_m) + 2
        self.across = round(WIDTH_M / edge_m) + 1
        self.points = np.array(
            [[i * edge_m, j * edge_m, 0.0] for i in range(self.rows) for j in range(self.across)]
        )
        self.clamped = list(range(2 * self.across))
        self.length_m = (self.rows - 1.5) * edge_m
        self.area_m2 = (self.rows - 1) * (self.across - 1) * edge_m**2

    def quads(self):
        m = self.across
        return [
            (i * m + j, (i + 1) * m + j, (i + 1) * m + j + 1, i * m + j + 1)
            for i in range(self.rows - 1)
            for j in range(m - 1)
        ]

    def triangles(self):
        out = []
        for k, (a, b, c, d) in enumerate(self.quads()):
            i, j = divmod(k, self.across - 1)
            alternate = self.mirrored and (i + j) % 2 == 1
            out += [a, b, d, b, c, d] if alternate else [a, b, c, a, c, d]
        return out

    def end(self, points):
        """How far the free end reaches, droops and went sideways, in mm from the clamp's middle."""
        row = np.asarray(points, float).reshape(self.rows, self.across, 3).mean(axis=1)
        end = row[-1] - 0.5 * (row[0] + row[1])
        return 1e3 * np.array([end[0], -end[2], end[1]])


def _integrate(gamma, upright, steps=1500):
    """As src/sim/elastica.rs: from the free end, the angle from the vertical there given."""

    def slope(t, s):
        return s[1], gamma * t * math.sin(s[0]), math.sin(s[0]), math.cos(s[0])

    s, h = (upright, 0.0, 0.0, 0.0), 1.0 / steps
    for k in range(steps):
        t = k * h
        a = slope(t, s)
        b = slope(t + h / 2, [p + h / 2 * q for p, q in zip(s, a)])
        c = slope(t + h / 2, [p + h / 2 * q for p, q in zip(s, b)])
        d = slope(t + h, [p + h * q for p, q in zip(s, c)])
        s = [p + h / 6 * (w + 2 * x + 2 * y + z) for p, w, x, y, z in zip(s, a, b, c, d)]
        if abs(s[0]) > math.pi:
            return None
    return s


def elastica_mm(bending_length_m, length_m):
    """Reach and droop of the free end [mm] of a strip with B = rho g bending_length^3."""
    gamma = (length_m / bending_length_m) ** 3
    low, high = -150.0, math.log(math.pi / 2)
    for _ in range(60):
        middle = 0.5 * (low + high)
        s = _integrate(gamma, math.exp(middle))
        if s is None or s[0] >= math.pi / 2:
            high = middle
        else:
            low = middle
    s = _integrate(gamma, math.exp(low))
    return 1e3 * length_m * s[2], 1e3 * length_m * s[3]


def stiffness_ratio(reach_mm, bending_length_m, length_m):
    """B of the elastica that reaches as far, over rho g bending_length^3."""
    low, high = 0.2 * bending_length_m, 5.0 * bending_length_m
    for _ in range(25):
        middle = math.sqrt(low * high)
        if elastica_mm(middle, length_m)[0] < reach_mm:
            low = middle
        else:
            high = middle
    return (low / bending_length_m) ** 3
