"""Exports of TwinCAT Scope: text in which every signal has a column of times before it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from cdprcal._core import InputError
from cdprcal.io.files import shown_path, shown_text
from cdprcal.mapping.common_time import on_common_time
from cdprcal.mapping.delimited import number_in, text_lines
from cdprcal.mapping.raw import Column, RawTable

_SAMPLE_TIME = "SampleTime[ms]"
_NAMES = ("Name", "SymbolName")
_TIME = "time [ms]"


def holds_scope(head: bytes) -> bool:
    """Whether the beginning of a file is that of such an export, in any encoding."""
    lines = head.replace(b"\0", b"").splitlines()
    return any(line.startswith(_SAMPLE_TIME.encode()) for line in lines)


def read_scope(path: Path) -> RawTable:
    """Reads the signals by their names, on the union of their times; empty where a signal has no
    sample. Raises InputError naming the line."""
    name = shown_path(path)
    lines, _, lost = text_lines(path)
    header = next(i for i, line in enumerate(lines) if line.startswith(_SAMPLE_TIME))
    separator = next((s for s in "\t;," if s in lines[header]), "\t")
    rows = [[cell.strip() for cell in line.split(separator)] for line in lines]
    wide = 2 * rows[header].count(_SAMPLE_TIME)
    names = _signal_names(rows, wide)
    first = next((i for i in range(header, len(rows)) if _is_sample(rows[i][:wide])), len(rows))
    decimal = "," if separator != "," and any("," in c for r in rows[first:] for c in r) else "."
    cut_line: int | None = None
    table = np.full((len(rows) - first, wide), np.nan)
    for i, row in enumerate(rows[first:]):
        if len(row) < wide and first + i + 1 == len(rows):
            cut_line = len(rows)
            break
        for k, cell in enumerate(row[:wide]):
            value = _value(cell, decimal)
            if value is None:
                raise InputError(
                    f"{name}:{first + i + 1}: {shown_text(cell, 40)!r} is not a number; export "
                    "again, or delete the line"
                )
            table[i, k] = value
    time_ms, columns = on_common_time(
        [(table[:, 2 * k], {names[k]: Column(table[:, 2 * k + 1])}) for k in range(wide // 2)]
    )
    if not len(time_ms):
        raise InputError(f"{name}: has no row of numbers; give an export with the samples too")
    columns = {_TIME: Column(time_ms, unit="ms"), **columns}
    return RawTable(path, "scope", columns, cut_line=cut_line, lost_lines=lost)


def _signal_names(rows: list[list[str]], wide: int) -> list[str]:
    """What the header calls the signals; no two are the same."""
    for label in _NAMES:
        # The name of the project stands above those of the signals.
        for row in reversed(rows):
            if len(row) >= wide and set(row[:wide:2]) == {label}:
                names = row[1:wide:2]
                if all(names) and len(set(names)) == len(names):
                    return names
    return [f"signal_{k + 1}" for k in range(wide // 2)]


def _is_sample(cells: list[str]) -> bool:
    """Whether a row holds numbers, at least one, and nothing else."""
    return any(cells) and any(
        all(_value(cell, decimal) is not None for cell in cells) for decimal in ".,"
    )


def _value(cell: str, decimal: str) -> float | None:
    """The number in a cell, NaN in an empty one; None: other text."""
    return number_in(cell, decimal) if cell else math.nan
