"""Text with a JSON object a line, as flat columns."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cdprcal._core import InputError
from cdprcal.io.files import read_bytes, refuse_many_lines, shown_path, shown_text
from cdprcal.mapping.delimited import clock_column
from cdprcal.mapping.one_a_row import one_a_row
from cdprcal.mapping.raw import MOST_NESTED, MOST_WIDE, Column, RawTable

Row = dict[str, float | str | None]

_LEAST_LINES = 2


def holds_json_lines(head: bytes) -> bool:
    """Whether the beginning of a file is two lines or more with an object each."""
    lines = [line for line in head.splitlines() if line.strip()]
    whole = lines[:-1] if len(lines) > _LEAST_LINES else lines  # the last may be cut off
    return len(whole) >= _LEAST_LINES and all(_object(line) is not None for line in whole)


def read_json_lines(path: Path) -> RawTable:
    """Reads an object a line: numbers, arrays as 'name.1 …', objects as 'name.field'.

    ``null`` and fields that a line lacks are no readings; dates and times of day are seconds; other
    text is left out, and said so. Raises InputError naming the line that is no object.
    """
    name = shown_path(path)
    refuse_many_lines(path)
    lines = read_bytes(path).decode("utf-8-sig", "replace").split("\n")
    rows: list[Row] = []
    at: list[int] = []
    cut_line: int | None = None
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        held = _object(line.encode())
        if held is None:
            if number == len(lines):
                cut_line = number
                continue
            raise InputError(
                f"{name}:{number}: {shown_text(line, 40)!r} is no JSON object as the lines before "
                "it; correct or delete the line"
            )
        rows.append(flat_row(held))
        at.append(number)
    return replace(table_of_rows(path, "records", rows, at), cut_line=cut_line)


def flat_row(held: dict[str, Any]) -> Row:
    """Arrays of an object as 'name.1 …', objects in it as 'name.field'."""
    flat: Row = {}
    _flatten("", held, flat, 0)
    return flat


def table_of_rows(path: Path, kind: str, rows: list[Row], at: Sequence[int] = ()) -> RawTable:
    """Rows as columns, or as a column a signal where they hold a reading each; ``at``: the line of
    each. Raises InputError as ``one_a_row``."""
    keys = dict.fromkeys(key for row in rows for key in row)
    if any(isinstance(cell, str) for row in rows for cell in row.values()):
        cells = [["" if row.get(key) is None else str(row[key]) for key in keys] for row in rows]
        if (table := one_a_row(path, [[*keys], *cells], [0, *at] if at else ())) is not None:
            return table
    columns = {key: _column([row.get(key) for row in rows]) for key in keys}
    kept = {key: column for key, column in columns.items() if column is not None}
    left_out = tuple(key for key in keys if key not in kept)
    if kind == "records":
        kept["run"] = Column(np.ones(len(rows)))  # as of records among words
    line = np.array(at, dtype=np.int64) if at else None
    return RawTable(path, kind, kept, line=line, left_out=left_out)


def _object(line: bytes) -> dict[str, Any] | None:
    """The object that a line is; None: it is none."""
    if not line.lstrip(b"\xef\xbb\xbf \t").startswith(b"{"):
        return None
    held = parsed(line.decode("utf-8-sig", "replace"))
    return held if isinstance(held, dict) else None


def parsed(text: str | bytes) -> Any:
    """What a text of JSON holds, its whole numbers as readings; None for one of something else."""
    try:
        return json.loads(text, parse_int=float)
    except (ValueError, RecursionError):
        return None


def _flatten(name: str, value: Any, flat: Row, depth: int) -> None:
    if depth > MOST_NESTED:
        return
    if isinstance(value, dict):
        for key, inner in value.items():
            _flatten(f"{name}.{key}" if name else key, inner, flat, depth + 1)
    elif isinstance(value, list):
        for i, inner in enumerate(value[:MOST_WIDE], start=1):
            _flatten(f"{name}.{i}", inner, flat, depth + 1)
    elif value is None or isinstance(value, str):
        flat[name] = value
    else:
        flat[name] = float(value)


def _column(cells: list[float | str | None]) -> Column | None:
    """Numbers, or seconds of dates and times of day; None for other text."""
    if any(isinstance(cell, str) for cell in cells):
        return clock_column([cell if isinstance(cell, str) else "" for cell in cells])
    values = np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)
    return Column(np.where(np.isfinite(values), values, np.nan))
