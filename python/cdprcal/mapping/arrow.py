"""Parquet and Feather files, as flat columns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdprcal._core import InputError
from cdprcal.extras import need
from cdprcal.io.files import begins_with, shown_path, shown_text
from cdprcal.mapping.raw import Column, Floats, RawTable

PARQUET_MAGIC, FEATHER_MAGICS = b"PAR1", (b"ARROW1", b"FEA1")


def read_arrow(path: Path) -> RawTable:
    """Reads a Parquet or Feather file; lists as 'name.1 …', structures as 'name.field'.

    Raises InputError.
    """
    name = shown_path(path)
    need("pyarrow", of=name)
    import pyarrow as pa
    from pyarrow import feather, parquet

    is_parquet = begins_with(path, 4) == PARQUET_MAGIC
    try:
        table = (parquet if is_parquet else feather).read_table(str(path))
    except (OSError, pa.ArrowException) as error:
        raise InputError(
            f"{name}: is no whole file of its kind ({str(error)[:100]}); save it again"
        ) from None
    columns: dict[str, Column] = {}
    left_out: list[str] = []
    for key in table.column_names:
        unit = (table.schema.field(key).metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
        left_out += _add(columns, key, table.column(key), pa, unit)
    if not columns:
        raise InputError(
            f"{name}: holds no columns of numbers; write readings as numbers. It holds "
            f"{shown_text(', '.join(left_out), 100) or 'nothing'}"
        )
    return RawTable(path, "arrow", columns, left_out=tuple(left_out))


def _add(columns: dict[str, Column], key: str, values: Any, pa: Any, unit: str) -> list[str]:
    """Adds what a column holds; the names of what is no number and left out."""
    kind, types = values.type, pa.types
    if types.is_timestamp(kind) or types.is_duration(kind):
        of_ns = pa.timestamp("ns", kind.tz) if types.is_timestamp(kind) else pa.duration("ns")
        columns[key] = Column(_seconds(values.cast(of_ns)), is_clock=True)
    elif types.is_integer(kind) or types.is_floating(kind):
        columns[key] = Column(_floats(values), unit=unit)
    elif types.is_decimal(kind):
        columns[key] = Column(_floats(values.cast(pa.float64())), unit=unit)
    elif types.is_struct(kind):
        parts = values.combine_chunks().flatten()  # none where the whole is none
        names = [f"{key}.{kind.field(i).name}" for i in range(kind.num_fields)]
        pairs = zip(names, parts, strict=True)
        return [gone for name, part in pairs for gone in _add(columns, name, part, pa, unit)]
    elif types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
        return _add_list(columns, key, values, pa, unit)
    else:
        return [key]
    return []


def _add_list(columns: dict[str, Column], key: str, values: Any, pa: Any, unit: str) -> list[str]:
    """Adds lists of one size as 'name.1 …'; a row without a list is no reading."""
    of_numbers = pa.types.is_integer(values.type.value_type) or pa.types.is_floating(
        values.type.value_type
    )
    rows = values.to_pylist()
    widths = {len(row) for row in rows if row is not None}
    if not of_numbers or len(widths) != 1 or widths == {0}:
        return [key]
    (width,) = widths
    table = np.array([[None] * width if row is None else row for row in rows], dtype=np.float64)
    for i in range(width):
        columns[f"{key}.{i + 1}"] = Column(table[:, i], unit=unit)
    return []


def _seconds(stamps: Any) -> Floats:
    """Seconds since the first stamp that is there; a float has no room for a date's nanoseconds."""
    nanoseconds = stamps.to_numpy(zero_copy_only=False)
    there = ~np.isnat(nanoseconds)
    since = nanoseconds - nanoseconds[np.argmax(there)] if len(there) else nanoseconds
    return np.where(there, since.astype("timedelta64[ns]").astype(np.float64) / 1e9, np.nan)


def _floats(values: Any) -> Floats:
    floats: Floats = values.to_numpy(zero_copy_only=False).astype(np.float64)
    return floats
