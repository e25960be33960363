"""The exceptions of scan2params. Their texts say what was measured, the limit and the remedy."""


class Scan2ParamsError(Exception):
    """Any failure of scan2params."""


class InvalidInput(Scan2ParamsError, ValueError):
    """An array, an option or a number that cannot be meant."""


class FileError(Scan2ParamsError, OSError):
    """A file that cannot be read or written."""


class ScanRefused(Scan2ParamsError):
    """A scan or a rim that cannot be trusted."""


class NotAtRest(Scan2ParamsError):
    """A drape that is not at a stable rest, where that is needed."""


class InternalError(Scan2ParamsError, RuntimeError):
    """A fault of scan2params itself."""
