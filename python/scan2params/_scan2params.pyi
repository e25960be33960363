"""Types of the extension; what each does is said in the docstrings."""

import os
import pathlib
from collections.abc import Callable, Sequence
from typing import Any, Final, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "PARAMETERS",
    "PROFILES",
    "Boundary",
    "Drape",
    "Estimate",
    "Fabric",
    "Scan",
    "Sensitivities",
    "__version__",
    "augment",
    "boundary",
    "calibrate",
    "estimate",
    "sensitivities",
    "simulate",
]

_Path: TypeAlias = str | os.PathLike[str]
_Progress: TypeAlias = Callable[[str], object]
_Unit: TypeAlias = Literal["m", "mm", "cm", "in", "guess"]
_Face: TypeAlias = Literal["up", "down"]
_Input: TypeAlias = ArrayLike | _Path | Scan | Boundary

__version__: Final[str]
PROFILES: Final[tuple[str, ...]]
PARAMETERS: Final[tuple[str, ...]]

@final
class Fabric:
    def __new__(
        cls,
        *,
        stretch_weft_n_m: float,
        stretch_warp_n_m: float,
        shear_n_m: float,
        bending_weft_n_m: float,
        bending_warp_n_m: float,
        bending_bias_n_m: float,
        density_kg_m2: float,
    ) -> Fabric: ...
    @staticmethod
    def from_paper_units(
        *,
        stretch_weft: float,
        stretch_warp: float,
        shear: float,
        bending_weft: float,
        bending_warp: float,
        bending_bias: float,
        density: float,
    ) -> Fabric: ...
    @staticmethod
    def read(path: _Path) -> Fabric: ...
    @staticmethod
    def mean_knit() -> Fabric: ...
    @property
    def stretch_weft_n_m(self) -> float: ...
    @property
    def stretch_warp_n_m(self) -> float: ...
    @property
    def shear_n_m(self) -> float: ...
    @property
    def bending_weft_n_m(self) -> float: ...
    @property
    def bending_warp_n_m(self) -> float: ...
    @property
    def bending_bias_n_m(self) -> float: ...
    @property
    def density_kg_m2(self) -> float: ...
    def si_units(self) -> dict[str, float]: ...
    def paper_units(self) -> dict[str, float]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Boundary:
    @staticmethod
    def from_points(
        points_m: ArrayLike,
        sigma_m: ArrayLike | None = None,
        observed: ArrayLike | None = None,
        *,
        warp_known: bool = False,
        warp_toward: str | ArrayLike | None = None,
        name: _Path | None = None,
    ) -> Boundary: ...
    @property
    def points_m(self) -> NDArray[np.float64]: ...
    @property
    def sigma_m(self) -> NDArray[np.float64]: ...
    @property
    def observed(self) -> NDArray[np.bool_]: ...
    @property
    def warp_known(self) -> bool: ...
    @property
    def warp_off_rad(self) -> float | None: ...
    @property
    def folds(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str | None: ...
    @property
    def sim_from_scan(self) -> NDArray[np.float64] | None: ...
    @property
    def sheet_m(self) -> NDArray[np.float64] | None: ...
    @property
    def cloth_points_m(self) -> NDArray[np.float64] | None: ...
    @property
    def quality(self) -> dict[str, Any] | None: ...
    @property
    def verdict(self) -> dict[str, Any]: ...
    def write(self, path: _Path) -> None: ...

@final
class Estimate:
    @property
    def fabric(self) -> Fabric: ...
    @property
    def interval90(self) -> tuple[Fabric, Fabric]: ...
    @property
    def candidates(self) -> list[Fabric]: ...
    @property
    def in_range(self) -> dict[str, bool]: ...
    @property
    def verdict(self) -> Literal["reliable", "doubtful", "do_not_use"]: ...
    @property
    def not_the_experiment(self) -> bool: ...
    @property
    def grounds(self) -> list[dict[str, Any]]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def boundary(self) -> Boundary: ...
    @property
    def tied_drape(self) -> Drape | None: ...
    @property
    def tied_rim_mean_m(self) -> float | None: ...
    @property
    def tied_rim_largest_m(self) -> float | None: ...
    @property
    def misfit(self) -> float | None: ...
    @property
    def released_drape(self) -> Drape | None: ...
    @property
    def released_rim_mean_m(self) -> float | None: ...
    @property
    def released_rim_largest_m(self) -> float | None: ...
    @property
    def is_refined(self) -> bool: ...
    @property
    def params(self) -> dict[str, Any]: ...
    def to_json(self) -> str: ...
    def write(self, folder: _Path) -> list[pathlib.Path]: ...

@final
class Drape:
    @property
    def vertices_m(self) -> NDArray[np.float64]: ...
    @property
    def triangles(self) -> NDArray[np.uint32]: ...
    @property
    def rim_m(self) -> NDArray[np.float64]: ...
    @property
    def rim_harmonics_m(self) -> NDArray[np.float64]: ...
    @property
    def folds(self) -> int: ...
    @property
    def at_rest(self) -> bool: ...
    @property
    def stop(self) -> Literal["at_rest", "unstable", "slow", "iterations"]: ...
    @property
    def residual_n(self) -> float: ...
    @property
    def energy_j(self) -> float: ...
    @property
    def intersections(self) -> int: ...
    @property
    def plate_clearance_m(self) -> float: ...
    @property
    def fabric(self) -> Fabric: ...
    @property
    def warnings(self) -> list[str]: ...
    def write(self, path: _Path) -> None: ...

@final
class Sensitivities:
    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def units(self) -> tuple[str, ...]: ...
    @property
    def rim(self) -> NDArray[np.float64]: ...

@final
class Scan:
    @property
    def points_m(self) -> NDArray[np.float64]: ...
    @property
    def colors(self) -> NDArray[np.uint8]: ...
    @property
    def sim_from_scan(self) -> NDArray[np.float64]: ...
    @property
    def profile(self) -> str: ...
    def write(self, path: _Path) -> None: ...
    def __len__(self) -> int: ...

def boundary(
    scan: _Input,
    *,
    triangles: ArrayLike | None = None,
    colors: ArrayLike | None = None,
    unit: _Unit | None = None,
    warp_toward: str | ArrayLike | None = None,
    mark: str | None = None,
    crop_radius_m: float | None = None,
    crop_box: ArrayLike | None = None,
    up: str | ArrayLike | None = None,
    plate_near: ArrayLike | None = None,
    specimen_side_m: float | None = None,
    plate_radius_m: float | None = None,
    seed: int | None = None,
    intrinsics: _Path | None = None,
    depth_scale: float | None = None,
    name: _Path | None = None,
    progress: _Progress | None = None,
) -> Boundary: ...
def estimate(
    scan: _Input,
    density_kg_m2: float,
    *,
    triangles: ArrayLike | None = None,
    colors: ArrayLike | None = None,
    unit: _Unit | None = None,
    warp_toward: str | ArrayLike | None = None,
    mark: str | None = None,
    crop_radius_m: float | None = None,
    crop_box: ArrayLike | None = None,
    up: str | ArrayLike | None = None,
    plate_near: ArrayLike | None = None,
    specimen_side_m: float | None = None,
    plate_radius_m: float | None = None,
    seed: int | None = None,
    intrinsics: _Path | None = None,
    depth_scale: float | None = None,
    name: _Path | None = None,
    with_scans: Sequence[_Input] | None = None,
    quick: bool = False,
    release: bool = False,
    effects: _Path | None = None,
    face: _Face = "up",
    progress: _Progress | None = None,
) -> Estimate: ...
def simulate(
    fabric: Fabric | _Path,
    *,
    seed: int | None = None,
    vertices: int = 61,
    experiment: dict[str, Any] | None = None,
    face: _Face = "up",
    start: ArrayLike | Boundary | _Path | None = None,
    numerics: Literal[3, 4] = 4,
    iterations: int | None = None,
    progress: _Progress | None = None,
) -> Drape: ...
def sensitivities(
    drape: Drape,
    parameters: Sequence[str] | None = None,
    *,
    progress: _Progress | None = None,
) -> Sensitivities: ...
def augment(
    drape: Drape | _Path,
    profile: str = "structured-light",
    *,
    seed: int = 1,
    mark: str | None = None,
    progress: _Progress | None = None,
) -> Scan: ...
def calibrate(
    manifest: _Path,
    *,
    out: _Path | None = None,
    prior: Literal["measured", "knit-2020", "union"] = "measured",
    vertices: int = 61,
    scale_sigma: float | None = None,
    hold_per_m: float | None = None,
    without: Sequence[str] | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
