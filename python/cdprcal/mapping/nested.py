"""Arrays in structures, as MATLAB and HDF5 have them, as flat columns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cdprcal._core import InputError
from cdprcal.io.files import shown_path
from cdprcal.mapping.common_time import on_common_time
from cdprcal.mapping.raw import MOST_NESTED, MOST_WIDE, Column, Floats, RawTable
from cdprcal.mapping.recognise import taken_apart


def nested_table(path: Path, kind: str, held: Mapping[str, Any]) -> RawTable:
    """Arrays, and structures (mappings) and lists of them, as 'out.signals.values.1'. Where arrays
    of other rows than most have times of their own, all stand on the union of times; else they are
    left out, and named.

    The signals of a Simulink structure are named by their labels. Raises InputError where there is
    no column.
    """
    columns: dict[str, Column] = {}
    for key, value in held.items():
        _flatten(key, value, columns, 0)
    # Rows are what most columns have, long ones rather: vectors of a geometry are no columns.
    lengths = [len(c.values) for c in columns.values()]
    rows = max(set(lengths), key=lambda n: (lengths.count(n) * math.log(max(n, 1)), n), default=0)
    kept = {key: c for key, c in columns.items() if len(c.values) == rows > 1}
    if joined := _at_other_rates(columns, kept):
        columns = kept = joined
        rows = len(next(iter(kept.values())).values)
    left_out = tuple(
        f"{key} ({len(c.values)} rows)" for key, c in columns.items() if rows != len(c.values) > 1
    )
    if not kept:
        raise InputError(
            f"{shown_path(path)}: holds no columns of numbers; save arrays, or structures of them, "
            "no objects of a class (MATLAB's timeseries)"
        )
    return RawTable(path, kind, kept, left_out=left_out)


def _at_other_rates(
    columns: dict[str, Column], most: dict[str, Column]
) -> dict[str, Column] | None:
    """Every column on the times of all, the first of the clocks beside; None where one clock is all
    there is, or they do not say the same."""
    clock = _clock_of(most)
    if clock is None:
        return None
    by_rows: dict[int, dict[str, Column]] = {}
    for key, column in columns.items():
        by_rows.setdefault(len(column.values), {})[key] = column
    groups = []
    for group in by_rows.values():
        its = _clock_of(group)
        if its is None or len(group) < 2 or not _alike(most[clock].values, group[its].values):
            continue
        groups.append((group[its].values, {k: c for k, c in group.items() if k != its}))
    if len(groups) < 2:
        return None
    time, joined = on_common_time(groups)
    return {clock: Column(time), **joined}


def _clock_of(columns: dict[str, Column]) -> str | None:
    """The first column whose name says that it is the time, if it increases."""
    for key, column in columns.items():
        words = taken_apart(key.rpartition(".")[2])
        if words.kind == "time" and len(column.values) > 2 and (np.diff(column.values) >= 0).all():
            return key
    return None


def _alike(a: Floats, b: Floats) -> bool:
    """Whether two clocks may be one: they go over much of the same span."""
    shared = min(a[-1], b[-1]) - max(a[0], b[0])
    return bool(shared > 0.5 * max(a[-1] - a[0], b[-1] - b[0]))


def _flatten(name: str, value: Any, columns: dict[str, Column], depth: int) -> None:
    if depth > MOST_NESTED:
        return
    if isinstance(value, Mapping):
        if isinstance(value.get("label"), str) and "values" in value:
            label = value["label"].strip()
            stem = name.rpartition(".")[0] or name
            _flatten(f"{stem}.{label}" if label else name, value["values"], columns, depth + 1)
            return
        for key, inner in value.items():
            _flatten(f"{name}.{key}", inner, columns, depth + 1)
        return
    if isinstance(value, list):
        for i, inner in enumerate(value):
            _flatten(f"{name}.{i + 1}", inner, columns, depth + 1)
        return
    if not isinstance(value, np.ndarray):
        return
    if value.dtype == object:
        for i, inner in enumerate(value.ravel()):
            _flatten(f"{name}.{i + 1}", inner, columns, depth + 1)
        return
    if value.dtype.kind not in "fiub":
        return
    table = np.squeeze(value)
    if table.ndim == 1:
        columns[name] = Column(table.astype(np.float64))
    elif table.ndim == 2:
        if table.shape[0] < table.shape[1]:
            table = table.T
        if table.shape[1] <= MOST_WIDE:
            for i in range(table.shape[1]):
                columns[f"{name}.{i + 1}"] = Column(table[:, i].astype(np.float64))
