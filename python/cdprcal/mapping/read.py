"""A raw file of any kind as columns, told apart by content."""

from __future__ import annotations

from pathlib import Path

from cdprcal._core import InputError
from cdprcal.io.files import begins_with, shown_path
from cdprcal.mapping.arrow import FEATHER_MAGICS, PARQUET_MAGIC, read_arrow
from cdprcal.mapping.bag import read_bag
from cdprcal.mapping.delimited import read_delimited
from cdprcal.mapping.json_lines import holds_json_lines, read_json_lines
from cdprcal.mapping.matlab import read_mat
from cdprcal.mapping.raw import DelimitedForm, RawTable
from cdprcal.mapping.records import holds_records, read_records
from cdprcal.mapping.scope import holds_scope, read_scope
from cdprcal.ros2 import is_bag

_HDF5 = b"\x89HDF"


def read_raw(path: str | Path, form: DelimitedForm | None = None) -> RawTable:
    """Reads CSV and its like, exports of TwinCAT Scope, JSON lines, records in braces, MAT,
    Parquet, Feather or a ROS 2 bag.

    ``form``: how text is to be cut; None: found. Raises InputError naming file and place.
    """
    path = Path(path)
    if is_bag(path):
        return read_bag(path)
    head = begins_with(path, 8)
    if head.startswith(_HDF5):
        raise InputError(
            f"{shown_path(path)}: is an HDF5 file, which is not read; export it as CSV or Parquet, "
            "or save it from MATLAB with save(…, '-v7')"
        )
    if head.startswith(b"MATLAB") or path.suffix.lower() == ".mat":
        return read_mat(path)
    if head.startswith((PARQUET_MAGIC, *FEATHER_MAGICS)):
        return read_arrow(path)
    if form is None:
        head = begins_with(path, 1 << 16, unpacked=True)
        if holds_json_lines(head):
            return read_json_lines(path)
        if holds_records(head):
            return read_records(path)
        if holds_scope(head):
            return read_scope(path)
    return read_delimited(path, form)
