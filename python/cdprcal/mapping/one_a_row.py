"""Text with one reading a row, beside its time and the name of its signal, as columns by signal."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cdprcal._core import InputError
from cdprcal.io.files import shown_path, shown_text
from cdprcal.io.marks import says_nothing
from cdprcal.mapping.common_time import nearest, on_common_time
from cdprcal.mapping.delimited import (
    Text,
    cells_of,
    clock_column,
    is_number,
    numbers_in,
    text_lines,
)
from cdprcal.mapping.raw import Column, Floats, RawTable
from cdprcal.mapping.recognise import taken_apart
from cdprcal.mapping.units import unit_named

_SEPARATORS = ";\t,|"
_SAMPLED = 2000  # rows
_MOST_SIGNALS = 256
_LEAST_ROWS = 5  # a signal
#: Times of all signals together, to those of one: beyond, each has times of its own.
_FEW_MORE = 1.2
#: Numbers that tell signals apart, by the name of their column.
_OF_A_CABLE = re.compile(r"_*(cable|seil|axis|channel|winch|motor|node|sensor|index|id|nr|number)")
_VALUE = re.compile(r"_*(value|val|wert|valeur|valore|valor|reading|data|y)", re.IGNORECASE)


@dataclass(frozen=True)
class _Form:
    """Which column is what, by number; ``names``: that tell signals apart."""

    decimal: str
    time: int
    value: int
    names: tuple[int, ...]
    unit: int | None


def one_a_row_in_text(path: Path, head: bytes) -> RawTable | None:
    """As ``one_a_row``, of a text between separators; ``head``: its beginning."""
    found = _form_in_text(path, head)
    if found is None:
        return None
    text, kept, separator, form = found
    cells = [cells_of(text.lines[number - 1], separator) for number in kept]
    return replace(_table(path, cells, kept, form), lost_lines=text.lost)


def one_a_row(path: Path, cells: Sequence[list[str]], at: Sequence[int]) -> RawTable | None:
    """Each signal as a column, of rows that have a time, a name and a reading; None for others.

    ``cells``: of each row, of which the first may be a header; ``at``: the line of each, if it has
    one. All signals stand on the union of their times, or at the times of the longest where each
    has its own. A name is what tells signals apart: one column of the table ('length_1'), or
    several ('length', '1': 'length.1'). Raises InputError naming the line whose reading is no
    number.
    """
    form = _form_of([cells[i] for i in _sample(len(cells))], ".")
    return None if form is None else _table(path, cells, at, form)


def _form_in_text(path: Path, head: bytes) -> tuple[Text, list[int], str, _Form] | None:
    """A text, which of its lines, from 1, are neither empty nor comments, their separator and
    form."""
    some = head.decode("latin-1").splitlines()
    if not any(map(_has_words, some[len(some) // 2 :][:3])):
        return None  # rows of numbers alone: there is no need to look at all of the file
    text = text_lines(path)
    kept = [
        number
        for number, line in enumerate(text.lines, start=1)
        if line.strip() and not line.startswith("#")
    ]
    sample = [text.lines[kept[i] - 1] for i in _sample(len(kept))]
    for separator in _SEPARATORS:
        try:
            cut = [cells_of(line, separator) for line in sample]
        except csv.Error:  # a line longer than any cell may be
            return None
        for decimal in (".",) if separator == "," else (".", ","):
            form = _form_of(cut, decimal)
            if form is not None:
                return text, kept, separator, form
    return None


def _table(path: Path, cells: Sequence[list[str]], at: Sequence[int], form: _Form) -> RawTable:
    """As ``one_a_row``, of rows of a form."""
    decimal = form.decimal
    width, name = len(cells[0]), shown_path(path)
    lines = [
        i for i, row in enumerate(cells) if len(row) == width and is_number(row[form.time], decimal)
    ]
    rows = [cells[i] for i in lines]
    clock = clock_column([row[form.time] for row in rows])
    time = clock or Column(numbers_in([row[form.time] for row in rows], decimal))
    value = numbers_in([row[form.value] for row in rows], decimal)
    for i in np.flatnonzero(~np.isfinite(value)).tolist():
        if not says_nothing(rows[i][form.value]):
            where = f"{name}:{at[lines[i]]}" if at else f"{name}: row {lines[i]}"
            raise InputError(
                f"{where}: {shown_text(rows[i][form.value], 40)!r} is not a number; "
                "leave the cell empty where nothing was read, or delete the line"
            )
    signals: dict[str, list[int]] = {}
    for i, row in enumerate(rows):
        signals.setdefault(_signal(row, form.names), []).append(i)
    columns = {
        signal: Column(
            value[of_signal],
            time_s=time.values[of_signal],
            unit="" if form.unit is None else rows[of_signal[0]][form.unit],
        )
        for signal, of_signal in signals.items()
    }
    common, columns = _as_rows(columns)
    key = "time" if lines[0] == 0 else cells[0][form.time]
    columns = {key: Column(common, is_clock=clock is not None), **columns}
    cut_line = at[-1] if at and len(cells[-1]) < width else None
    return RawTable(path, "one a row", columns, cut_line=cut_line)


def _sample(count: int) -> list[int]:
    """The first row and some of the others, in their order but at no regular step: signals may come
    in turn, or one after another."""
    chosen = np.random.default_rng(0).choice(count, min(count, _SAMPLED), replace=False)
    return sorted({0, *chosen.tolist()}) if count else []


def _as_rows(signals: dict[str, Column]) -> tuple[Floats, dict[str, Column]]:
    """Signals on the union of their times; where each has its own, at those of the longest."""
    times = {name: column.time_s for name, column in signals.items() if column.time_s is not None}
    groups = [(times[name], {name: replace(c, time_s=None)}) for name, c in signals.items()]
    common, columns = on_common_time(groups)
    longest = max(times.values(), key=len)
    if len(common) <= _FEW_MORE * len(longest):
        return common, columns
    rows = np.unique(longest[np.isfinite(longest)])
    return rows, {
        name: replace(column, values=nearest(_in_order(column), rows), time_s=None)
        for name, column in signals.items()
    }


def _in_order(column: Column) -> Column:
    assert column.time_s is not None
    order = np.argsort(column.time_s, kind="stable")
    return replace(column, values=column.values[order], time_s=column.time_s[order])


def _has_words(line: str) -> bool:
    """Whether a cell of a line is a word, however the line is cut."""
    cells = re.split(f"[{_SEPARATORS}]", line)
    return len(cells) > 2 and any(
        re.search(r"[^\W\d]", cell) and not is_number(cell.strip(' "'), ".") for cell in cells
    )


def _form_of(rows: list[list[str]], decimal: str) -> _Form | None:
    """The form of rows, of which the first may be a header, and some more it again."""
    width = len(rows[0]) if rows else 0
    if width < 3 or sum(len(row) == width for row in rows) < 0.8 * len(rows):
        return None
    rows = [row for row in rows if len(row) == width]
    columns = range(width)
    read = [[is_number(cell, decimal) for cell in row] for row in rows]
    numeric = [c for c in columns if 10 * _count(rows, read, c) > 9 * sum(bool(r[c]) for r in rows)]
    header = rows[0] if not any(read[0]) else [""] * width
    rows = [row for row in rows if any(row[c] for c in numeric) and row != header]
    read = [[is_number(cell, decimal) for cell in row] for row in rows]
    words = [c for c in columns if all(r[c] for r in rows) and not _count(rows, read, c)]
    unit = next((c for c in words if all(unit_named(row[c]) for row in rows)), None)
    names = [c for c in words if c != unit]
    names += [c for c in numeric if _OF_A_CABLE.fullmatch(header[c])]
    names = [c for c in sorted(names) if len({row[c] for row in rows}) > 1]
    signals: dict[str, list[list[str]]] = {}
    for row in rows:
        signals.setdefault(_signal(row, names), []).append(row)
    if not 1 < len(signals) <= _MOST_SIGNALS or len(rows) < _LEAST_ROWS * len(signals):
        return None
    if not any(c in words for c in names):
        return None  # numbers alone: a cable's number may be a reading
    moving = [
        c
        for c in numeric
        if c not in names and any(len({row[c] for row in of}) > 1 for of in signals.values())
    ]
    time = _time_of(moving, header, signals, decimal)
    others = [c for c in moving if c != time]
    values = [c for c in others if _VALUE.fullmatch(header[c])] or others
    if time is None or len(values) != 1:
        return None
    return _Form(decimal, time, values[0], tuple(names), unit)


def _time_of(
    moving: list[int], header: list[str], signals: dict[str, list[list[str]]], decimal: str
) -> int | None:
    """Which column is the time: by its name, as dates and times of day, or as it never falls."""

    def is_clock(c: int) -> bool:
        return clock_column([row[c] for rows in signals.values() for row in rows[:2]]) is not None

    def never_falls(c: int) -> bool:
        return all(
            (np.diff(numbers_in([row[c] for row in rows], decimal)) >= 0.0).all()
            for rows in signals.values()
        )

    by_name = (c for c in moving if taken_apart(header[c]).kind == "time")
    return next(
        itertools.chain(by_name, filter(is_clock, moving), filter(never_falls, moving)), None
    )


def _count(rows: list[list[str]], read: list[list[bool]], column: int) -> int:
    """How many cells of a column are numbers."""
    return sum(is_number[column] for row, is_number in zip(rows, read, strict=True) if row[column])


def _signal(row: list[str], names: Sequence[int]) -> str:
    return ".".join(row[c] for c in names)
