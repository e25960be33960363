#!/usr/bin/env python3
"""Drape coefficient of simulated Cusick drapes, from their rims: the part of the overhang that is seen from above.

    scan2params simulate --cusick --params FABRIC.params.json --out drape.obj --boundary rim.csv
    python scripts/export/drape_coefficient.py rim.csv ...
"""

import csv
import sys

import numpy as np

from sheets import Sheet

PLATE_M, SPECIMEN_M = 0.090, 0.150

for path in sys.argv[1:]:
    with open(path, newline="") as file:
        rim_mm = [(float(row["x_mm"]), float(row["z_mm"]), 0.0) for row in csv.DictReader(file)]
    rim = Sheet(np.zeros((0, 3)), np.zeros((0, 3)), 1e-3 * np.array(rim_mm))
    print(f"{path}: drape coefficient {rim.coefficient(PLATE_M, np.pi * SPECIMEN_M**2):.1f} %")
