"""From a depth-sensor scan of a draped cloth to the stiffnesses with which a simulator reproduces the drape.

Units
-----
SI everywhere: metres, kilograms, N/m for stretch and shear, N m for bending, radians; a name carries its unit
(``points_m``, ``density_kg_m2``). Two exceptions carry their units beside each number: the dictionaries of
``params.json`` and ``calibration.json``, and `Fabric.paper_units`.

Frames
------
The *simulation frame* has its origin in the middle of the plate's face, y up, the warp along x, the weft along z. Scans
are in any frame; a ``sim_from_scan`` of shape (4, 4) takes their points to the simulation frame.

Threads
-------
Long functions release the interpreter's lock. They use one thread per core, or as many as the environment variable
``RAYON_NUM_THREADS`` says at the first call; no result depends on it. Control-C ends a call at once, and the work behind
it after the drape at hand.
"""

from ._errors import FileError, InternalError, InvalidInput, NotAtRest, Scan2ParamsError, ScanRefused

# the exceptions come first: the extension takes them from there
from ._scan2params import (  # isort: skip
    PARAMETERS,
    PROFILES,
    Boundary,
    Drape,
    Estimate,
    Fabric,
    Scan,
    Sensitivities,
    __version__,
    augment,
    boundary,
    calibrate,
    estimate,
    sensitivities,
    simulate,
)

__all__ = [
    "PARAMETERS",
    "PROFILES",
    "Boundary",
    "Drape",
    "Estimate",
    "Fabric",
    "FileError",
    "InternalError",
    "InvalidInput",
    "NotAtRest",
    "Scan",
    "Scan2ParamsError",
    "ScanRefused",
    "Sensitivities",
    "__version__",
    "augment",
    "boundary",
    "calibrate",
    "estimate",
    "sensitivities",
    "simulate",
]
