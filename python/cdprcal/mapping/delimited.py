"""Text in columns: which separator, decimal mark, encoding and header, found or told."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import numpy as np

from cdprcal._core import InputError
from cdprcal.io.files import read_bytes, refuse_many_lines, shown_path
from cdprcal.mapping.raw import Column, DelimitedForm, Floats, RawTable

SEPARATORS = (";", "\t", ",", "|", " ")
_MARKS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))
_SAMPLED = 200  # lines are enough to tell a form by
_COMMENT = "#%"
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?(nan|inf)", re.IGNORECASE)
_CLOCK = re.compile(r"(\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T])?\d{1,2}:\d{2}:\d{2}([.,]\d+)?Z?")
_DAYS = ("%Y-%m-%d", "%d.%m.%Y", "%Y/%m/%d", "%m/%d/%Y", "%d-%m-%Y")
_UNIT = re.compile(r"[\[(]?\s*[^\s\d\[\]();,]{0,6}(/[^\s\d\[\]();,]{1,4})?\s*[\])]?")


def read_delimited(path: Path, form: DelimitedForm | None = None) -> RawTable:
    """Reads text in columns; ``form`` None: found. Raises InputError naming file and line."""
    name = shown_path(path)
    refuse_many_lines(path)
    data = read_bytes(path)
    encoding = form.encoding if form else _encoding(data)
    try:
        lines = data.decode(encoding).replace("\0", "").splitlines()
    except (UnicodeDecodeError, LookupError):
        raise InputError(f"{name}: is not {encoding} text; correct text.encoding") from None
    found = form or _form_of(lines, encoding)
    if found is None:
        raise InputError(
            f"{name}: is no table of numbers; give columns separated by ; , | tabs or blanks"
        )
    return _table(path, name, lines, found)


def _encoding(data: bytes) -> str:
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return encoding
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252" if not set(data) & {0x81, 0x8D, 0x8F, 0x90, 0x9D} else "latin-1"
    return "utf-8"


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    if '"' in line:
        return [cell.strip() for cell in next(csv.reader(io.StringIO(line), delimiter=separator))]
    return [cell.strip() for cell in line.split(separator)]


def _is_number(cell: str, decimal: str) -> bool:
    if decimal == ",":
        if "." in cell and not _CLOCK.fullmatch(cell):
            return False
        cell = cell.replace(",", ".")
    return bool(_NUMBER.fullmatch(cell) or _CLOCK.fullmatch(cell))


def _form_of(lines: list[str], encoding: str) -> DelimitedForm | None:
    """The separator and decimal mark with which most lines are rows of as many numbers."""
    tail = [line for line in lines[-_SAMPLED:] if line.strip() and line.lstrip()[0] not in _COMMENT]
    best: tuple[float, int, str, str] | None = None
    for separator in SEPARATORS:
        rows = [_cells(line, separator) for line in tail]
        count = Counter(map(len, rows)).most_common(1)[0][0] if rows else 0
        if count < 2:
            continue
        for decimal in (".", ",") if separator != "," else (".",):
            of_rows = [
                sum(_is_number(cell, decimal) or not cell for cell in row) / count
                for row in rows
                if len(row) == count
            ]
            share = sum(of_rows) / len(rows)
            if share > 0.5 and (best is None or share > best[0] + 1e-9):
                best = (share, count, separator, decimal)
    if best is None:
        return None
    _, count, separator, decimal = best
    return DelimitedForm(
        separator, decimal, _header_line(lines, count, separator, decimal), encoding
    )


def _header_line(lines: list[str], count: int, separator: str, decimal: str) -> int:
    """The line of names above the first row of numbers, from 1; 0: there is none."""
    names = 0
    for number, line in enumerate(lines, start=1):
        cells = _cells(line.lstrip().lstrip(_COMMENT).strip(), separator)
        if len(cells) != count:
            continue
        if sum(_is_number(cell, decimal) for cell in cells) > count / 2:
            break
        # Below the names there may be units: those are no names.
        if not names or not all(_UNIT.fullmatch(cell) for cell in cells):
            names = number
    return names


def _table(path: Path, name: str, lines: list[str], form: DelimitedForm) -> RawTable:
    names, units = _names(lines, form)
    if form.header_line and not names:
        raise InputError(f"{name}:{form.header_line}: names no columns; correct text.header_line")
    rows: list[list[str]] = []
    at: list[int] = []
    for number, line in enumerate(lines[form.header_line :], start=form.header_line + 1):
        if not line.strip() or line.lstrip()[0] in _COMMENT:
            continue
        cells = _cells(line, form.separator)
        if not names:
            if not sum(_is_number(cell, form.decimal) for cell in cells) > len(cells) / 2:
                continue
            names = [f"column_{i + 1}" for i in range(len(cells))]
        if not rows and not any(_is_number(cell, form.decimal) for cell in cells):
            continue  # units, or more words above the first row
        if len(cells) == len(names) + 1 and not cells[-1]:
            cells.pop()  # a separator at the end
        if len(cells) != len(names):
            if number == len(lines):
                continue  # the last line was cut off
            raise InputError(
                f"{name}:{number}: has {len(cells)} columns, the header {len(names)}; delete the "
                "line, or correct text.separator"
            )
        rows.append(cells)
        at.append(number)
    if not rows:
        raise InputError(f"{name}: has no row of numbers; correct text.header_line")
    columns = {}
    for i, column in enumerate(names):
        values, is_clock = _numbers([row[i] for row in rows], form.decimal)
        columns[column] = Column(values, unit=units[i] if units else "", is_clock=is_clock)
    return RawTable(path, "csv", columns, form, np.array(at, dtype=np.int64))


def _names(lines: list[str], form: DelimitedForm) -> tuple[list[str], list[str]]:
    """Names of the columns, and their units when the next line holds those."""
    if not form.header_line:
        return [], []
    if form.header_line > len(lines):
        return [], []
    cells = _cells(lines[form.header_line - 1].lstrip().lstrip(_COMMENT).strip(), form.separator)
    while cells and not cells[-1]:
        cells.pop()
    names: list[str] = []
    for i, cell in enumerate(cells):
        cell = cell.strip('"') or f"column_{i + 1}"
        names.append(cell if cell not in names else f"{cell} (column {i + 1})")
    units: list[str] = []
    if form.header_line < len(lines):
        below = lines[form.header_line].lstrip().lstrip(_COMMENT).strip("\n")
        cells = _cells(below, form.separator)[: len(names)]
        wordy = not any(_is_number(cell, form.decimal) for cell in cells)
        if len(cells) == len(names) and wordy and all(_UNIT.fullmatch(cell) for cell in cells):
            units = [cell.strip("[]() ") for cell in cells]
    return names, units


def _numbers(cells: Sequence[str], decimal: str) -> tuple[Floats, bool]:
    """Numbers, NaN for what is none; or seconds of dates and times of day."""
    plain = [cell.replace(",", ".") if decimal == "," else cell for cell in cells]
    try:
        return np.array(plain, dtype=np.float64), False
    except ValueError:
        pass
    if sum(bool(_CLOCK.fullmatch(cell)) for cell in cells) > len(cells) / 2:
        return np.array([_seconds(cell) for cell in cells]), True
    return np.array([float(c) if _NUMBER.fullmatch(c) else np.nan for c in plain]), False


def _seconds(cell: str) -> float:
    """Of '2026-03-01 12:00:00.25', '01.03.2026 12:00:00,25' or '12:00:00.25'; NaN for others."""
    if not _CLOCK.fullmatch(cell):
        return np.nan
    day, _, clock = cell.rstrip("Z").replace("T", " ").rpartition(" ")
    hours, minutes, seconds = clock.replace(",", ".").split(":")
    since = 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)
    if not day:
        return since
    for pattern in _DAYS:
        try:
            return 86400.0 * datetime.strptime(day, pattern).toordinal() + since
        except ValueError:
            continue
    return np.nan
