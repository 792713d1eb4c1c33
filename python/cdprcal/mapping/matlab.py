"""MATLAB files: vectors, matrices and structures, as flat columns."""

from __future__ import annotations

from pathlib import Path

from cdprcal._core import InputError
from cdprcal.extras import need
from cdprcal.io.files import begins_with, reason, shown_path
from cdprcal.mapping.hdf5 import read_hdf5
from cdprcal.mapping.nested import nested_table
from cdprcal.mapping.raw import RawTable

_OF_HDF5 = b"MATLAB 7.3"


def read_mat(path: Path) -> RawTable:
    """Reads a MAT-file (``nested_table`` says how). Raises InputError."""
    name = shown_path(path)
    if begins_with(path, len(_OF_HDF5)) == _OF_HDF5:
        return read_hdf5(path, "mat")
    need("scipy", of=name)
    from scipy.io import loadmat

    try:
        held = loadmat(str(path), simplify_cells=True)
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {reason(error)}") from None
    except Exception as error:  # damaged bytes make the library fail in any way
        raise InputError(
            f"{name}: is no whole MAT-file ({type(error).__name__}); save it again"
        ) from None
    return nested_table(path, "mat", {key: at for key, at in held.items() if key[:2] != "__"})
