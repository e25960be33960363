"""What the tests share: the fixtures, and the program that the functions must agree with."""

import os
import pathlib
import subprocess

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FIXTURES = ROOT / "fixtures"


@pytest.fixture(scope="session")
def program():
    """Runs the program and returns what it prints; its path is in the environment."""
    path = os.environ.get("SCAN2PARAMS")
    if not path:
        pytest.fail("the variable SCAN2PARAMS must name the program; scripts/check_wheel.sh sets it")

    def run(*arguments):
        done = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True, cwd=ROOT)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def read_ply(path):
    """Points and colours of a binary PLY with floats and bytes, read without scan2params."""
    with open(path, "rb") as file:
        lines = []
        while not lines or lines[-1] != "end_header":
            lines.append(file.readline().decode().strip())
        count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
        kinds = {"float": "<f4", "uchar": "u1"}
        fields = [(line.split()[2], kinds[line.split()[1]]) for line in lines if line.startswith("property")]
        table = np.fromfile(file, dtype=fields, count=count)
    points = np.stack([table[axis] for axis in "xyz"], axis=1)
    return points, np.stack([table[name] for name in ("red", "green", "blue")], axis=1)


def true_rim_m(name):
    """The true rim of a fixture, in metres."""
    table = np.loadtxt(FIXTURES / "drapes" / f"{name}.boundary.csv", delimiter=",", skiprows=1)
    return table[:, 2:5] * 1e-3


def distances_m(one, other):
    """Distances of corresponding points."""
    return np.linalg.norm(np.asarray(one) - np.asarray(other), axis=1)
