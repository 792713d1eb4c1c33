"""A raw file of any kind as columns, told apart by content."""

from __future__ import annotations

from pathlib import Path

from cdprcal.extras import need
from cdprcal.io.files import begins_with, is_workbook
from cdprcal.io.mcap_records import MCAP_MAGIC
from cdprcal.mapping.arrow import FEATHER_MAGICS, PARQUET_MAGIC, read_arrow
from cdprcal.mapping.bag import read_bag
from cdprcal.mapping.delimited import read_delimited
from cdprcal.mapping.hdf5 import HDF5_MAGIC, read_hdf5, read_mat
from cdprcal.mapping.json_lines import holds_json_lines, read_json_lines
from cdprcal.mapping.json_table import read_json_table
from cdprcal.mapping.mcap_json import read_mcap_json
from cdprcal.mapping.one_a_row import one_a_row_in_text
from cdprcal.mapping.raw import DelimitedForm, RawTable
from cdprcal.mapping.records import holds_records, read_records
from cdprcal.mapping.scope import holds_scope, read_scope
from cdprcal.mapping.workbook import read_workbook
from cdprcal.ros2 import is_bag


def read_raw(path: str | Path, form: DelimitedForm | None = None) -> RawTable:
    """Reads CSV and its like, with a signal a column or a reading a row, exports of TwinCAT Scope,
    JSON of one table or an object a line, records in braces, Excel workbooks, MAT, HDF5, Parquet,
    Feather, a ROS 2 bag or MCAP with JSON messages.

    ``form``: how text is to be cut; None: found. Raises InputError naming file and place.
    """
    path = Path(path)
    if is_bag(path):
        return read_bag(path)
    if begins_with(path, len(MCAP_MAGIC), unpacked=True) == MCAP_MAGIC:
        need("mcap", of=str(path))
        return read_mcap_json(path)
    head = begins_with(path, 8)
    if is_workbook(path):
        return read_workbook(path)
    if head.startswith(HDF5_MAGIC):
        return read_hdf5(path)
    if head.startswith(b"MATLAB") or path.suffix.lower() == ".mat":
        return read_mat(path)
    if head.startswith((PARQUET_MAGIC, *FEATHER_MAGICS)):
        return read_arrow(path)
    if form is None:
        head = begins_with(path, 1 << 16, unpacked=True)
        if holds_json_lines(head):
            return read_json_lines(path)
        if (table := read_json_table(path, head)) is not None:
            return table
        if holds_records(head):
            return read_records(path)
        if holds_scope(head):
            return read_scope(path)
        if (table := one_a_row_in_text(path, head)) is not None:
            return table
    return read_delimited(path, form)
