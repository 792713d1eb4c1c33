"""Text that holds records among other words, ``{bl:1675.15, br:2757.73}``, as flat columns."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cdprcal._core import InputError
from cdprcal.io.files import read_bytes, shown_path, shown_text
from cdprcal.io.marks import says_nothing
from cdprcal.mapping.raw import Column, RawTable

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
#: In quotes a value may hold commas.
_VALUE = r"\s*\"[^\"\n]*\"\s*|\s*'[^'\n]*'\s*|[^,{}\"']*"
_FIELD = rf"\s*[\"']?([A-Za-z_]\w*)[\"']?\s*[:=]({_VALUE})"
_RECORD = re.compile(rf"\{{{_FIELD}(?:,{_FIELD})*,?\s*\}}")
_FIELDS = re.compile(rf"{_FIELD}(?=,|\}})")
_BRACES = re.compile(r"\{[^{}]*\}")
_ASSIGNED = re.compile(r"[:=]\s*[-+]?\.?\d")
#: What is looked at to tell such a file.
_LOOKED_AT = 1 << 16
_LEAST_RECORDS = 2


def holds_records(head: bytes) -> bool:
    """Whether the beginning of a file holds two records or more of the same names."""
    found = _RECORD.finditer(head[:_LOOKED_AT].decode("latin-1"))
    return sum(_holds_numbers(record[0]) for record in found) >= _LEAST_RECORDS


def _holds_numbers(record: str) -> bool:
    """Whether braces hold a number, or say that there is none; else they are words."""
    values = [value.strip() for _, value in _FIELDS.findall(record)]
    return any(_NUMBER.fullmatch(value) or says_nothing(value) for value in values)


def read_records(path: Path) -> RawTable:
    """Reads every record of a text; what stands between them is passed over.

    Columns are the names of the first record whose values are no text in quotes; ``null`` is no
    reading. ``run`` counts the stretches of records that nothing but blanks and punctuation parts,
    from 1: a file may hold several. Raises InputError for a record of other names, or a value that
    is no number, by line.
    """
    name = shown_path(path)
    text = read_bytes(path).decode("utf-8", "replace")
    rows: list[list[float]] = []
    lines: list[int] = []
    runs: list[int] = []
    names: list[str] = []
    left_out: dict[str, None] = {}
    end, line = 0, 1
    for record in filter(lambda found: _holds_numbers(found[0]), _RECORD.finditer(text)):
        between = text[end : record.start()]
        _refuse_unread(between, name, line)
        line += between.count("\n")
        values, texts = _values(record[0], f"{name}:{line}")
        if not names:
            names = list(values)
        if sorted(values) != sorted(names):
            raise InputError(
                f"{name}:{line}: the record has {', '.join(values)}, and the "
                f"first one {', '.join(names)}; give each kind a file of its own"
            )
        left_out |= dict.fromkeys(texts)
        rows.append([values[field] for field in names])
        lines.append(line)
        parted = not runs or re.search(r"\w", between) is not None
        runs.append((runs[-1] if runs else 0) + int(parted))
        line += record[0].count("\n")
        end = record.end()
    _refuse_unread(text[end:], name, line)
    if not rows:
        raise InputError(f"{name}: holds no records like {{a: 1.5, b: 2.5}}; check the file")
    table = np.array(rows)
    columns = {key: Column(table[:, i]) for i, key in enumerate(names)}
    cut_at = _cut_at(text, end)
    columns["run"] = Column(np.array(runs, dtype=np.float64))
    at = np.array(lines, dtype=np.int64)
    cut_line = None if cut_at < 0 else text.count("\n", 0, cut_at) + 1
    whole = text[:end].split("\n") if "\0" in text else []
    return RawTable(
        path,
        "records",
        columns,
        line=at,
        left_out=tuple(left_out),
        cut_line=cut_line,
        lost_lines=tuple(number for number, line in enumerate(whole, start=1) if "\0" in line),
    )


def _cut_at(text: str, end: int) -> int:
    """Where a record begins behind the last whole one, and does not end; -1: none does."""
    begin = text.rfind("{", end)
    return begin if begin >= 0 and _ASSIGNED.search(text, begin) else -1


def _refuse_unread(between: str, name: str, line: int) -> None:
    """Raises InputError for braces between two records that hold numbers and are none."""
    for braces in _BRACES.finditer(between):
        if _ASSIGNED.search(braces[0]):
            line += between[: braces.start()].count("\n")
            raise InputError(
                f"{name}:{line}: {shown_text(braces[0], 40)!r} is no record like "
                "{a: 1.5, b: null}; correct or delete it"
            )


def _values(record: str, where: str) -> tuple[dict[str, float], list[str]]:
    """The numbers of a record, NaN where nothing was read, and the names of its texts."""
    values: dict[str, float] = {}
    texts: list[str] = []
    for field, text in _FIELDS.findall(record):
        value = text.strip()
        if _NUMBER.fullmatch(value):
            values[field] = float(value)
        elif says_nothing(value):
            values[field] = np.nan
        elif value.startswith(('"', "'")):
            texts.append(field)
        else:
            raise InputError(
                f"{where}: {field} is {shown_text(value, 40)!r}, which is not a number; write null "
                "where nothing was read, or delete the record"
            )
    return values, texts
