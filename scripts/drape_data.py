"""Drapes for training: reading a folder made by `scan2params generate`, the symmetries of the
experiment, and the noise of a scan.

A boundary is an array (..., 244, 3) in mm, simulation frame (weft along z, warp along x, y up),
in the order of src/base/boundary.rs. Parameters are in the paper's order and units.
"""

import json
import pathlib
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

STIFFNESSES = ["stretch_weft", "stretch_warp", "shear", "bending_weft", "bending_warp", "bending_bias"]
POINTS_PER_SIDE = 61
POINTS = 4 * POINTS_PER_SIDE
# Weft and warp exchanged.
SWAPPED = [1, 0, 2, 4, 3, 5]


@dataclass
class Drapes:
    """Rows that converged, and what their folder says of them."""

    boundary: np.ndarray  # (rows, 244, 3) f32 mm
    stiffness: np.ndarray  # (rows, 6) paper units
    density: np.ndarray  # (rows,) g/m^2
    fabric: np.ndarray  # (rows,) fabric index
    group: np.ndarray  # (rows,) what must not be split: the drops of a fabric, the drapes of a walk
    node_count: np.ndarray  # (rows,)
    vertices: np.ndarray  # (rows,) on a side of the sheet; 0 of made-up drapes
    manifest: dict
    rows_read: int
    left_out: dict  # why: rows


def read_folder(folder, rows_limit=None):
    """All rows of a folder that converged, in the order of their index; files of either schema."""
    folder = pathlib.Path(folder)
    files = sorted(folder.glob("drapes-*.parquet"))
    if not files:
        raise SystemExit(f"{folder}: no drapes-*.parquet; make them with `scan2params generate`")
    manifest = json.loads((folder / "manifest.json").read_text())
    tables = [pq.read_table(file) for file in files]
    # Schema 1 calls `at_rest` what schema 2 calls `converged`.
    converged = "converged" if "converged" in tables[0].column_names else "at_rest"
    plain = [*STIFFNESSES, "density", converged, "stop", "fabric_index", "index", "node_count"]
    column = {key: np.concatenate([t[key].to_numpy() for t in tables]) for key in plain}
    boundary = np.concatenate([rims_mm(t["boundary_mm"]) for t in tables])
    if rows_limit:
        column, boundary = {key: values[:rows_limit] for key, values in column.items()}, boundary[:rows_limit]
    stiffness = np.stack([np.asarray(column[key]) for key in STIFFNESSES], axis=1)
    density = np.asarray(column["density"])
    keep = np.asarray(column[converged]) & np.isfinite(boundary).all(axis=(1, 2))
    left_out = {}
    for stop, kept in zip(column["stop"], keep):
        if not kept:
            left_out[stop] = left_out.get(stop, 0) + 1
    fabric = np.asarray(column["fabric_index"])
    walks = manifest.get("walks")
    group = np.asarray(column["index"]) // walks["rows"] if walks else fabric
    return Drapes(
        boundary[keep],
        stiffness[keep],
        density[keep],
        fabric[keep],
        group[keep],
        np.asarray(column["node_count"])[keep],
        np.full(int(keep.sum()), vertices(manifest) or 0),
        manifest,
        len(keep),
        left_out,
    )


def rims_mm(column):
    """(rows, 244, 3) f32 of a column `boundary_mm`: lists of points, or bytes in schema 1."""
    if pa.types.is_fixed_size_binary(column.type):
        return np.stack([np.frombuffer(rim, "<f4") for rim in column.to_pylist()]).reshape(-1, POINTS, 3)
    return column.combine_chunks().flatten().flatten().to_numpy().reshape(-1, POINTS, 3)


def vertices(manifest):
    """Vertices on a side of a folder's drapes; made-up drapes have none."""
    simulator = manifest["simulator"]
    return None if simulator == "fake" else simulator["vertices"]


def read_folders(folders, rows_limit=None):
    """All rows of several folders that converged."""
    return joined(folders, [read_folder(folder, rows_limit) for folder in folders])


def joined(folders, parts):
    """Several folders as one, of any cells. A fabric that is in two of them brings their groups together."""
    manifest = dict(parts[0].manifest)
    differing = {"schema", "walks", "count", "program", "simulator"}
    for folder, part in zip(folders[1:], parts[1:]):
        other = [k for k in manifest.keys() | part.manifest.keys() if k not in differing and part.manifest.get(k) != manifest.get(k)]
        if other:
            raise SystemExit(f"{folder}: {', '.join(other)} differ from {folders[0]}")
    leader = {}  # of a group: another one of its cluster, or itself

    def find(group):
        while leader.setdefault(group, group) != group:
            group = leader[group]
        return group

    first_group_of = {}
    for number, part in enumerate(parts):
        for fabric, group in zip(part.fabric.tolist(), part.group.tolist()):
            mine = find((number, group))
            leader[find(first_group_of.setdefault(fabric, mine))] = mine
    label = {}
    groups = [
        np.array([label.setdefault(find((number, g)), len(label)) for g in part.group.tolist()])
        for number, part in enumerate(parts)
    ]
    left_out = {k: sum(p.left_out.get(k, 0) for p in parts) for part in parts for k in part.left_out}
    each = lambda key: np.concatenate([getattr(part, key) for part in parts])
    return Drapes(
        each("boundary"), each("stiffness"), each("density"), each("fabric"), np.concatenate(groups),
        each("node_count"), each("vertices"), manifest, sum(part.rows_read for part in parts), left_out,
    )


def ln_box(manifest):
    """Logarithms of the least and of the most that the prior of a folder has of each stiffness, by whose distance errors are normalised."""
    return tuple(np.log(np.array(limit)[:6]) for limit in manifest["prior_limits"])


GRAVITY_M_S2 = 9.80665


def bending_length_mm(stiffness, density):
    """The shortest of the three, as `sim::experiment::bending_length_m`; paper's units."""
    return 1e3 * (1e-9 * stiffness[:, 3:6].min(1) / (1e-3 * density * GRAVITY_M_S2)) ** (1 / 3)


def flat_xz_mm():
    """The flat specimen's (x, z) at each index: the walk of src/base/boundary.rs."""
    t = np.arange(POINTS_PER_SIDE) * 5.0 - 150.0
    c = np.full_like(t, 150.0)
    sides = [(c, t), (-t, c), (-c, -t), (t, -c)]
    return np.concatenate([np.stack(side, axis=1) for side in sides])


def symmetries():
    """The eight symmetries of the square specimen on the disc: (index permutation, 3x3 matrix,
    whether weft and warp change places). The transformed boundary is `b[perm] @ matrix.T`.
    The first four keep weft and warp."""
    index = np.arange(POINTS)
    identity = (index, np.eye(3), False)
    mirror_x = ((182 - index) % POINTS, np.diag([-1.0, 1.0, 1.0]), False)
    half_turn = ((index + 2 * POINTS_PER_SIDE) % POINTS, np.diag([-1.0, 1.0, -1.0]), False)
    # (x, y, z) -> (z, y, -x), as Boundary::rotated(1).
    quarter = ((index + POINTS_PER_SIDE) % POINTS, np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]]), True)

    def then(first, second):
        return first[0][second[0]], second[1] @ first[1], first[2] != second[2]

    keeping = [identity, half_turn, mirror_x, then(half_turn, mirror_x)]
    return keeping + [then(s, quarter) for s in keeping]


def transformed(boundary, symmetry):
    perm, matrix, _ = symmetry
    return boundary[..., perm, :] @ matrix.T.astype(boundary.dtype)


def split_by_group(group, seed, shares=(0.8, 0.1, 0.1)):
    """Row numbers of training, calibration and test; all drops of a fabric go together, and so do all
    drapes of a walk: neighbouring fabrics on one branch tell too much of each other."""
    unique = np.unique(group)
    order = np.random.default_rng([seed, 1]).permutation(len(unique))
    ends = np.round(np.cumsum(shares) * len(unique)).astype(int)
    parts = np.split(unique[order], ends[:-1])
    return [np.flatnonzero(np.isin(group, part)) for part in parts]


@dataclass
class Noise:
    """What a scan adds to a rim, one standard deviation each. The smooth part has the given
    correlation length along the rim and its own size in every scan, uniform up to `smooth_mm`."""

    smooth_mm: float = 1.0
    correlation_mm: float = 40.0
    white_mm: float = 0.15
    shift_mm: float = 0.5
    yaw_deg: float = 0.5
    tilt_deg: float = 0.3
    density_relative: float = 0.01

    @classmethod
    def none(cls):
        """Rims as they are, as the paper trains on them."""
        return cls(smooth_mm=0.0, white_mm=0.0, shift_mm=0.0, yaw_deg=0.0, tilt_deg=0.0, density_relative=0.0)

    def basis(self):
        """(244, modes) basis of the smooth part: a closed random curve of unit variance. Both
        counts of a corner are one place on the rim."""
        along = np.concatenate([side * 300.0 + np.arange(POINTS_PER_SIDE) * 5.0 for side in range(4)])
        angle = 2 * np.pi * along / 1200.0
        mode = np.arange(0, 25)
        weight = np.exp(-0.25 * (2 * np.pi * mode * self.correlation_mm / 1200.0) ** 2)
        waves = np.concatenate([np.cos(np.outer(angle, mode)) * weight, np.sin(np.outer(angle, mode[1:])) * weight[1:]], axis=1)
        return (waves / np.sqrt(np.mean(np.sum(waves**2, axis=1)))).astype(np.float32)
