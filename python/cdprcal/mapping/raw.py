"""What any raw file holds once it is read: named columns of numbers, with times."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cdprcal._core import InputError
from cdprcal.io.files import shown_path, shown_text
from cdprcal.io.sample_order import and_more

Floats = NDArray[np.float64]

#: Of arrays: what has more columns, or is nested deeper, holds no readings.
MOST_WIDE, MOST_NESTED = 64, 12


@dataclass(frozen=True)
class Column:
    """One named column; NaN where the file has no number.

    ``time_s`` [N]: when each value was taken, where the file has times of its own for it (topics of
    a bag); None: row by row with all others. ``unit``: as the file writes it, else empty.
    ``is_clock``: the values were dates or times of day; they are seconds. ``unread``: the row of
    the first cell that is neither a number nor says that there is none, the cell, and what to do.
    ``repeats``: an earlier column of the same name, if the file has one.
    """

    values: Floats
    time_s: Floats | None = None
    unit: str = ""
    is_clock: bool = False
    unread: tuple[int, str, str] | None = None
    repeats: str = ""


@dataclass(frozen=True)
class DelimitedForm:
    """How a text file is to be cut into columns; ``source``: the mapping file that says so."""

    separator: str  #: one character; a blank: any run of blanks
    decimal: str  #: '.' or ','
    header_line: int  #: that names the columns, from 1; 0: none does
    encoding: str
    source: str = ""


@dataclass(frozen=True)
class RawTable:
    """A raw file: its kind (csv, one a row, records, json, mat, arrow, bag) and its columns in the
    order of the file; ``left_out``: what it holds beside them that is no column of numbers;
    ``cut_line``: its last line, from 1, where that is cut off and left out; ``lost_lines``: those
    with NUL bytes in them, where something was to be written."""

    path: Path
    kind: str
    columns: dict[str, Column] = field(default_factory=dict)
    form: DelimitedForm | None = None
    line: NDArray[np.int64] | None = None  #: of each row, from 1
    left_out: tuple[str, ...] = ()
    cut_line: int | None = None
    lost_lines: tuple[int, ...] = ()

    @property
    def lost(self) -> str:
        """Where the NUL bytes are, for people; empty: there are none."""
        return f"line {and_more(self.lost_lines)}" if self.lost_lines else ""

    def readings(self, name: str) -> Column:
        """A column whose every cell could be read. Raises InputError naming line and cell."""
        column = self.columns[name]
        if column.unread is not None:
            row, cell, remedy = column.unread
            line = "" if self.line is None else f":{self.line[row]}"
            raise InputError(
                f"{shown_path(self.path)}{line}: column {shown_text(name, 60)!r}: "
                f"{shown_text(cell, 40)!r} is not a number; {remedy}"
            )
        return column


_BITS = (16, 24, 31, 32)
#: So many usual steps around a full counter it may begin again.
_NEAR = 4.0


def unwrapped(values: Floats) -> Floats:
    """Values that go on rising where a counter of whole numbers was full; others as they are."""
    there = np.flatnonzero(np.isfinite(values))
    if len(there) < 3 or np.any(values[there] != np.round(values[there])):
        return values
    steps = np.diff(values[there])
    usual = float(np.median(steps))
    back = steps < 0.0
    if usual <= 0.0 or not back.any():
        return values
    for bits in _BITS:
        passed = steps[back] + 2.0**bits
        if np.all((passed > 0.0) & (passed < _NEAR * usual)) and values[there].max() < 2.0**bits:
            out = values.copy()
            out[there[1:]] += 2.0**bits * np.cumsum(back)
            return out
    return values
