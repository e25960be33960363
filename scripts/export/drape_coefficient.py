#!/usr/bin/env python3
"""Drape coefficient of simulated Cusick drapes, from their rims: the part of the overhang that is seen from above.

    scan2params simulate --cusick --params FABRIC.params.json --out drape.obj --boundary rim.csv
    python scripts/export/drape_coefficient.py rim.csv ...
"""

import csv
import math
import sys

PLATE_MM, SPECIMEN_MM, PIXEL_MM = 90.0, 150.0, 1.0


def winding(rim, x, z):
    """How often the rim goes round a point."""
    turns = 0
    for (ax, az), (bx, bz) in zip(rim, rim[1:] + rim[:1]):
        if (az <= z) != (bz <= z):
            left = (bx - ax) * (z - az) - (x - ax) * (bz - az)
            turns += (az <= z and left > 0) - (az > z and left < 0)
    return turns


def coefficient(path):
    """In per cent: silhouette of rim and plate, less the plate, over the flat specimen, less the plate."""
    with open(path, newline="") as file:
        rim = [(float(row["x_mm"]), float(row["z_mm"])) for row in csv.DictReader(file)]
    steps = [PIXEL_MM * k for k in range(-155, 156)]
    seen = sum(math.hypot(x, z) <= PLATE_MM or winding(rim, x, z) != 0 for x in steps for z in steps)
    plate, specimen = (math.pi * radius**2 for radius in (PLATE_MM, SPECIMEN_MM))
    return 100 * (seen * PIXEL_MM**2 - plate) / (specimen - plate)


for path in sys.argv[1:]:
    print(f"{path}: drape coefficient {coefficient(path):.1f} %")
