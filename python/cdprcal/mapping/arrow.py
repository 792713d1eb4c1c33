"""Parquet and Feather files, as flat columns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdprcal._core import InputError
from cdprcal.extras import need
from cdprcal.io.files import begins_with, shown_path
from cdprcal.mapping.raw import Column, RawTable

PARQUET_MAGIC, FEATHER_MAGICS = b"PAR1", (b"ARROW1", b"FEA1")


def read_arrow(path: Path) -> RawTable:
    """Reads a Parquet or Feather file; lists of a fixed size as 'name.1 …'. Raises InputError."""
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
    for key in table.column_names:
        _add(columns, key, table.column(key), pa, table.schema.field(key))
    if not columns:
        raise InputError(f"{name}: holds no columns of numbers; give another file")
    return RawTable(path, "arrow", columns)


def _add(columns: dict[str, Column], key: str, values: Any, pa: Any, field: Any) -> None:
    kind = field.type
    unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
    if pa.types.is_timestamp(kind):
        nanoseconds = values.cast(pa.timestamp("ns", kind.tz)).to_numpy(zero_copy_only=False)
        since = nanoseconds - nanoseconds[0]  # a float has no room for a date's nanoseconds
        columns[key] = Column(
            since.astype("timedelta64[ns]").astype(np.float64) / 1e9, is_clock=True
        )
    elif pa.types.is_integer(kind) or pa.types.is_floating(kind):
        columns[key] = Column(_floats(values), unit=unit)
    elif pa.types.is_list(kind) or pa.types.is_fixed_size_list(kind):
        rows = values.to_pylist()
        width = len(rows[0] or []) if rows else 0
        if width and all(row is not None and len(row) == width for row in rows):
            table = np.array(rows, dtype=np.float64)
            for i in range(width):
                columns[f"{key}.{i + 1}"] = Column(table[:, i], unit=unit)


def _floats(values: Any) -> Any:
    return values.to_numpy(zero_copy_only=False).astype(np.float64)
