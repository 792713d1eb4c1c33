"""HDF5 and MATLAB files, those of version 7.3 being both, as flat columns."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cdprcal._core import InputError
from cdprcal.extras import need
from cdprcal.io.files import begins_with, reason, shown_path
from cdprcal.mapping.nested import nested_table
from cdprcal.mapping.raw import MOST_NESTED, RawTable

HDF5_MAGIC = b"\x89HDF"
#: Attributes of an array in which people write its unit.
_UNIT = ("unit", "units", "Unit", "Units")
#: More references to other arrays than this in one array are objects of a class, no signals.
_MOST_REFERENCES = 64


def read_hdf5(path: Path, kind: str = "hdf5") -> RawTable:
    """Reads arrays of numbers and tables, those in groups as 'group.array', with the unit that an
    attribute of them names (``nested_table`` says the rest). Raises InputError."""
    name = shown_path(path)
    need("h5py", of=name)
    import h5py

    units: dict[str, str] = {}
    try:
        with h5py.File(path, "r") as file:
            held = {
                key: _held(file, file[key], key, units, 0)
                for key in file
                if not key.startswith("#")  # where MATLAB keeps what others refer to
            }
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        raise InputError(
            f"{name}: is no whole HDF5 file ({type(error).__name__}); save it again"
        ) from None
    table = nested_table(path, kind, held)
    columns = {
        key: replace(column, unit=units.get(key) or units.get(key.rpartition(".")[0], ""))
        for key, column in table.columns.items()
    }
    return replace(table, columns=columns)


def _held(file: Any, at: Any, key: str, units: dict[str, str], depth: int) -> Any:
    """What stands in a place: mappings of groups and tables, lists of references, arrays; words of
    MATLAB; None for what is nothing of it."""
    import h5py

    if depth > MOST_NESTED:
        return None
    if isinstance(at, h5py.Group):
        held = {inner: _held(file, at[inner], f"{key}.{inner}", units, depth + 1) for inner in at}
        return _elements(held) if all(map(_is_of_elements, at.values())) else held
    if not isinstance(at, h5py.Dataset) or at.shape is None:
        return None
    if _refers(at):
        references = np.ravel(at[()])[:_MOST_REFERENCES]
        return [_held(file, file[to], key, units, depth + 1) for to in references if to]
    if at.attrs.get("MATLAB_class") in (b"char", "char"):
        return "".join(map(chr, np.ravel(at[()]).tolist()))
    if at.dtype.names:
        rows = at[()]
        return {field: rows[field] for field in at.dtype.names}
    if at.dtype.kind not in "fiub":
        return None
    for unit in _UNIT:
        if unit in at.attrs:
            text = at.attrs[unit]
            units[key] = text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text)
    return at[()]


def _refers(at: Any) -> bool:
    import h5py

    return h5py.check_ref_dtype(at.dtype) is h5py.Reference


def _is_of_elements(at: Any) -> bool:
    """Whether a field is that of an array of MATLAB's structures: a reference an element, and
    unlike a cell array of no class."""
    return hasattr(at, "dtype") and _refers(at) and "MATLAB_class" not in at.attrs


def _elements(held: dict[str, list[Any]]) -> list[dict[str, Any]]:
    """An array of structures from its fields."""
    return [dict(zip(held, of_one, strict=True)) for of_one in zip(*held.values(), strict=False)]


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
