"""Text that holds records among other words, ``{bl:1675.15, br:2757.73}``, as flat columns."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from cdprcal._core import InputError
from cdprcal.io.files import read_bytes, shown_path
from cdprcal.mapping.raw import Column, RawTable

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_FIELD = rf"\s*[\"']?([A-Za-z_]\w*)[\"']?\s*[:=]\s*({_NUMBER})\s*"
_RECORD = re.compile(rf"\{{{_FIELD}(?:,{_FIELD})*,?\s*\}}")
_FIELDS = re.compile(_FIELD)
#: What is looked at to tell such a file.
_LOOKED_AT = 1 << 16
_LEAST_RECORDS = 2


def holds_records(head: bytes) -> bool:
    """Whether the beginning of a file holds two records or more of the same names."""
    found = _RECORD.findall(head[:_LOOKED_AT].decode("latin-1"))
    return len(found) >= _LEAST_RECORDS


def read_records(path: Path) -> RawTable:
    """Reads every record of a text; what stands between them is passed over.

    Columns are the names of the first record. ``run`` counts the stretches of records that nothing
    but blanks and punctuation parts, from 1: a file may hold several. Raises InputError for a
    record of other names, by line.
    """
    name = shown_path(path)
    text = read_bytes(path).decode("utf-8", "replace")
    rows: list[list[float]] = []
    lines: list[int] = []
    runs: list[int] = []
    names: list[str] = []
    end, line = 0, 1
    for record in _RECORD.finditer(text):
        between = text[end : record.start()]
        line += between.count("\n")
        fields = _FIELDS.findall(record[0])
        if not names:
            names = [field for field, _ in fields]
        if sorted(field for field, _ in fields) != sorted(names):
            raise InputError(
                f"{name}:{line}: the record has {', '.join(field for field, _ in fields)}, and the "
                f"first one {', '.join(names)}; give each kind a file of its own"
            )
        values = {field: float(number) for field, number in fields}
        rows.append([values[field] for field in names])
        lines.append(line)
        parted = not runs or re.search(r"\w", between) is not None
        runs.append((runs[-1] if runs else 0) + int(parted))
        line += record[0].count("\n")
        end = record.end()
    if not rows:
        raise InputError(f"{name}: holds no records like {{a: 1.5, b: 2.5}}; check the file")
    table = np.array(rows)
    columns = {key: Column(table[:, i]) for i, key in enumerate(names)}
    columns["run"] = Column(np.array(runs, dtype=np.float64))
    return RawTable(path, "records", columns, line=np.array(lines, dtype=np.int64))
