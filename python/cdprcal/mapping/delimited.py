"""Text in columns: which separator, decimal mark, encoding and header, found or told."""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cdprcal._core import InputError
from cdprcal.io.files import read_bytes, refuse_many_lines, shown_path
from cdprcal.io.marks import says_nothing
from cdprcal.mapping.raw import Column, DelimitedForm, Floats, RawTable
from cdprcal.mapping.units import unit_named

SEPARATORS = (";", "\t", ",", "|", " ")
_MARKS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))
_SAMPLED = 200  # lines are enough to tell a form by
_PREAMBLE = 30  # lines
_LOOKED_AT = 4096  # bytes
_COMMENT = "#%"
_MARK = re.compile(rf"^\s*[{_COMMENT}]+\s*")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?(nan|inf)", re.IGNORECASE)
_CLOCK = re.compile(
    r"(?=\d{8}T|.*:)"  # of digits alone it may be any number
    r"((?P<day>\d{1,4}[-./]\d{1,2}[-./]\d{1,4}|\d{8}|\d{1,2}-[A-Za-z]{3}-\d{4})[ T])?"
    r"(?P<h>\d{1,2}):?(?P<min>\d{2}):?(?P<s>\d{2}([.,]\d+)?)"
    r" ?(?P<half>[AaPp][Mm])? ?(Z|UTC|GMT|(?P<zone>[-+]\d{2}(:?\d{2})?))?"
)
#: As Excel shows a time with fractions: the hours are not there.
_OF_HOUR = re.compile(r"(?P<min>\d{1,2}):(?P<s>\d{2}[.,]\d+)")
_MINUS = str.maketrans("\N{MINUS SIGN}", "-")
#: By decimal mark: separators of thousands, and a number with its unit.
_THOUSANDS = {
    ".": re.compile(r"[-+]?\d{1,3}([,'\u2019 \u00a0\u202f]\d{3})+\.\d+"),
    ",": re.compile(r"[-+]?\d{1,3}([.'\u2019 \u00a0\u202f]\d{3})+,\d+"),
}
_OF_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}[.,]\d{3}")
_LEAST_MARKED = 20  # cells, so that it is no chance
_NO_THOUSANDS = "write numbers without separators of thousands"
_WITH_UNIT = re.compile(r"([-+]?[\d.,]+)\s*([^\W\d]+)")
_DAYS: tuple[str, ...] = ("%Y-%m-%d", "%d.%m.%Y", "%Y/%m/%d", "%m/%d/%Y", "%d/%m/%Y", "%d-%m-%Y")
_DAYS += ("%Y%m%d", "%d-%b-%Y")  # ISO without separators; MATLAB
_DAYS += ("%d.%m.%y", "%m/%d/%y", "%d/%m/%y", "%d-%m-%y")  # Excel
_HOUR_S = 3600.0
_DAY_S = 86400.0
_UNIT = re.compile(r"[\[(]?\s*[^\s\d\[\]();,]{0,6}(/[^\s\d\[\]();,]{1,4})?\s*[\])]?")


def read_delimited(path: Path, form: DelimitedForm | None = None) -> RawTable:
    """Reads text in columns; ``form`` None: found. Raises InputError naming file and line."""
    name = shown_path(path)
    lines, encoding, lost = text_lines(path, form)
    try:
        if form is not None:
            _refuse_other_separator(name, lines, form)
        found = form or _form_of(lines, encoding)
        if found is not None:
            return replace(_table(path, lines, found), lost_lines=lost)
    except csv.Error:  # a quote that nothing ends, most likely
        most = csv.field_size_limit()
        number = next((i for i, line in enumerate(lines, start=1) if len(line) > most), 1)
        raise InputError(
            f"{name}:{number}: has a cell of more than {most} characters, which no reading has; "
            "correct or delete the line"
        ) from None
    raise _no_table(name, lines)


def _no_table(name: str, lines: list[str]) -> InputError:
    """That lines are none, why, and what to do."""
    held = [line for line in lines if line.strip() and line.lstrip()[0] not in _COMMENT]
    if not held:
        return InputError(f"{name}: is empty; a log must start with a header 'time_s,…'")
    for separator in SEPARATORS[:-1]:  # between blanks any words would be a header
        header, *rows = (_without_empty_end(cells_of(line, separator)) for line in held)
        if len(header) < 2 or any(is_number(c, d) for c in header for d in ".,"):
            continue
        samples = [row for row in rows if any(is_number(c, d) for c in row for d in ".,")]
        if not samples:
            return InputError(f"{name}: no samples follow the header; log again")
        if len(samples) == 1:
            return InputError(f"{name}: a single sample follows the header; log for longer")
    return InputError(
        f"{name}: is no table of numbers; give columns separated by ; , | tabs or blanks"
    )


def _refuse_other_separator(name: str, lines: list[str], form: DelimitedForm) -> None:
    """Raises InputError where the separator of a form parts no names, and another one parts the
    columns."""
    names, _ = _names(lines, form)
    if len(names) > 1 or (not form.header_line and any(form.separator in line for line in lines)):
        return
    found = _form_of(lines, form.encoding)
    if found is not None and found.separator != form.separator:
        wrong, right = (f'"{s}"'.replace("\t", "\\t") for s in (form.separator, found.separator))
        raise InputError(
            f"{form.source}: text.separator: {name} has no columns between {wrong}; give {right}, "
            "which parts its columns"
        )


def table_of_lines(
    path: Path, lines: list[str], separator: str, *, kind: str, left_out: tuple[str, ...]
) -> RawTable:
    """Lines whose separator is known and whose decimal mark is the point: the lines of names and
    units are found. Raises InputError naming file and line."""
    cells = [cells_of(line, separator) for line in lines]
    count = max((i for row in cells for i, cell in enumerate(row, 1) if cell), default=0)
    used = Counter(len(_without_empty_end(row)) for row in cells if any(row)).most_common(1)[0][0]
    form = DelimitedForm(separator, ".", _header_line(lines, used, count, separator, "."), "utf-8")
    table = _table(path, lines, form)
    return replace(table, kind=kind, form=None, left_out=left_out)


class Text(NamedTuple):
    """The lines of a text, and its encoding. ``lost``: lines, from 1, that hold NUL bytes, which is
    space that was reserved and not filled; they are left empty, but for the last one: it is a NUL
    alone, for a row that is cut off."""

    lines: list[str]
    encoding: str
    lost: tuple[int, ...] = ()


def text_lines(path: Path, form: DelimitedForm | None = None) -> Text:
    """The text of a file in the encoding of a form, or in the one that is found. Raises
    InputError."""
    refuse_many_lines(path)
    data = read_bytes(path)
    encoding = form.encoding if form is not None else _encoding(data)
    try:
        text = data.decode(encoding)
    except (UnicodeError, LookupError):
        name = shown_path(path)
        if form is None:
            raise InputError(f"{name}: is not whole {encoding} text; save it as UTF-8") from None
        raise InputError(
            f"{form.source}: text.encoding: {name} is not {encoding} text; give {_encoding(data)}"
        ) from None
    lines = text.splitlines()
    if "\0" not in text:
        return Text(lines, encoding)
    *above, last = lines
    lost = tuple(number for number, line in enumerate(above, start=1) if "\0" in line)
    lines = ["" if "\0" in line else line for line in above]
    return Text([*lines, "\0" if "\0" in last else last], encoding, lost)


def _encoding(data: bytes) -> str:
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return encoding
    even, odd = (data[start:_LOOKED_AT:2].count(0) for start in (0, 1))
    if 4 * max(even, odd) > min(len(data), _LOOKED_AT) and not min(even, odd):
        return "utf-16-be" if even else "utf-16-le"  # of letters of English, without a mark
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252" if not set(data) & {0x81, 0x8D, 0x8F, 0x90, 0x9D} else "latin-1"
    return "utf-8"


def cells_of(line: str, separator: str) -> list[str]:
    """A line of text cut at its separators; of blanks any run is one."""
    if separator == " ":
        return line.split()
    if '"' in line:
        return [cell.strip() for cell in next(csv.reader(io.StringIO(line), delimiter=separator))]
    return [cell.strip() for cell in line.split(separator)]


def _named(line: str, separator: str) -> list[str]:
    """The cells of a line of names or units, be it a comment."""
    return cells_of(_MARK.sub("", line), separator)


def _without_empty_end(cells: list[str]) -> list[str]:
    """A separator at the end of a line makes no column."""
    return cells[: max((i for i, cell in enumerate(cells, 1) if cell), default=0)]


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell tells rows from names, even if it cannot be read as it is."""
    return bool(number_in(cell, decimal) is not None or _clock(cell) or _almost(cell, decimal))


def _almost(cell: str, decimal: str) -> str:
    """What to do about a cell that is a number for people only; empty for any other."""
    if _THOUSANDS[decimal].fullmatch(cell):
        return _NO_THOUSANDS
    parts = _WITH_UNIT.fullmatch(cell)
    if parts and unit_named(parts[2]) and number_in(parts[1], decimal) is not None:
        return "write the unit into the name of the column, not into the cells"
    return ""


def number_in(cell: str, decimal: str) -> float | None:
    """The number that a cell is; None for any other text."""
    if decimal == ",":
        if "." in cell:
            return None
        cell = cell.replace(",", ".")
    cell = cell.translate(_MINUS)
    return float(cell) if _NUMBER.fullmatch(cell) else None


def _form_of(lines: list[str], encoding: str) -> DelimitedForm | None:
    """The separator and decimal mark with which most lines are rows of as many numbers."""
    tail = [line for line in lines[-_SAMPLED:] if line.strip() and line.lstrip()[0] not in _COMMENT]
    # Between commas only quotes keep a decimal comma in its cell.
    quoted = any('"' in line for line in tail)
    best: tuple[float, int, int, str, str] | None = None
    for separator in SEPARATORS:
        rows = [cells_of(line, separator) for line in tail]
        count = Counter(map(len, rows)).most_common(1)[0][0] if rows else 0
        used = max((len(_without_empty_end(row)) for row in rows if len(row) == count), default=0)
        if used < 2:
            continue
        for decimal in (".", ",") if separator != "," or quoted else (".",):
            of_rows = [
                sum(is_number(cell, decimal) or not cell for cell in row) / count
                for row in rows
                if len(row) == count
            ]
            share = sum(of_rows) / len(rows)
            if share > 0.5 and (best is None or share > best[0] + 1e-9):
                best = (share, used, count, separator, decimal)
    if best is None:
        return None
    _, used, count, separator, decimal = best
    header_line = _header_line(lines, used, count, separator, decimal)
    return DelimitedForm(separator, decimal, header_line, encoding)


def _header_line(lines: list[str], used: int, count: int, separator: str, decimal: str) -> int:
    """The line of names above the first row of numbers, from 1; 0: there is none. Rows have
    ``count`` cells, of which the first ``used`` hold something."""
    names = words = 0
    for number, line in enumerate(lines, start=1):
        cells = _named(line, separator)
        if not any(cells):
            continue
        if len(cells) < used or len(_without_empty_end(cells)) > count:
            # A name more than there are readings: of a comment that nobody wrote.
            words = 0 if any(is_number(cell, decimal) for cell in cells) else number
            continue
        if names == number - 1 > 0 and _under_merged(lines[names - 1], cells, separator, decimal):
            names = number
            continue
        numbers = sum(is_number(cell, decimal) for cell in cells)
        # Where sensors begin one after another the first rows are sparse.
        sparse = names and numbers >= 2 and numbers == sum(map(bool, cells))
        if sparse or numbers > count / 2:
            if words > names and len(_named(lines[words - 1], separator)) >= used:
                names = words
            return _below_preamble(lines, names, number, used, separator, decimal) or names
        # Below the names there may be units: those are no names.
        if not names or not _are_units(cells):
            names = number
    return names


def _below_preamble(
    lines: list[str], names: int, row: int, used: int, separator: str, decimal: str
) -> int:
    """A line of words alone, at least one a reading, soon after what looks like the first row and
    is of a preamble as wide as the table ('Samples', 751, 751 …); 0: there is none, or the names
    come again."""
    for number in range(row + 1, min(row + _PREAMBLE, len(lines) + 1)):
        cells = _named(lines[number - 1], separator)
        wordy = all(cell and not is_number(cell, decimal) for cell in cells)
        if len(cells) >= used and wordy and not _are_units(cells):
            return 0 if names and lines[number - 1] == lines[names - 1] else number
        if all(is_number(cell, decimal) for cell in cells[:used]):
            return 0  # a row of readings
    return 0


def _under_merged(above: str, cells: list[str], separator: str, decimal: str) -> list[str]:
    """Names that stand in two lines, written together: the upper one is over several columns each,
    in merged cells or again and again ('Length', 'Force' over 1 2 3 4 1 2 3 4). Empty where the
    lower line holds no more of names, or one of both is enough by itself."""
    cells = _without_empty_end(cells)
    upper, over = [], ""
    for word in (_named(above, separator) + [""] * len(cells))[: len(cells)]:
        over = word or over
        upper.append(over)
    numbers = [over for over, cell in zip(upper, cells, strict=True) if is_number(cell, decimal)]
    indices = [cell for cell in cells if re.fullmatch(r"\d{1,2}", cell)]
    if len(numbers) == len(cells) or len(numbers) != len(indices) or 1 in map(upper.count, numbers):
        return []  # a row of readings
    words = [cell for cell in cells if cell]
    names = [f"{over} {cell}".strip() for over, cell in zip(upper, cells, strict=True)]
    enough = len(set(upper)) == len(upper) or (not numbers and len(set(words)) == len(words))
    return [] if enough or len(set(names)) < len(names) else names


def _table(path: Path, lines: list[str], form: DelimitedForm) -> RawTable:
    name = shown_path(path)
    names, units = _names(lines, form)
    if form.header_line and not names:
        raise InputError(f"{name}:{form.header_line}: names no columns; correct text.header_line")
    rows: list[list[str]] = []
    at: list[int] = []
    cut_line: int | None = None
    least = _least_cells(lines, form, len(names))
    for number, line in enumerate(lines[form.header_line :], start=form.header_line + 1):
        if not line.strip() or line.lstrip()[0] in _COMMENT:
            continue
        if form.header_line and line == lines[form.header_line - 1]:
            continue  # the names again, where a logger went on
        cells = cells_of(line, form.separator)
        if not names:
            if not sum(is_number(cell, form.decimal) for cell in cells) > len(cells) / 2:
                continue
            names = [f"column_{i + 1}" for i in range(len(cells))]
        if not rows and not any(is_number(cell, form.decimal) for cell in cells):
            continue  # units, or more words above the first row
        if len(cells) > len(names):
            cells[len(names) :] = _without_empty_end(cells[len(names) :])
        if least <= len(cells) < len(names):
            cells += [""] * (len(names) - len(cells))
        if len(cells) != len(names):
            if number == len(lines):
                cut_line = number
                continue
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
        cells = [row[i] for row in rows]
        first = column.removesuffix(_again(i))
        columns[column] = replace(
            _column(cells, form.decimal, units[i] if units else ""),
            repeats=first if first != column and first in columns else "",
        )
    return RawTable(path, "csv", columns, form, np.array(at, dtype=np.int64), cut_line=cut_line)


def _least_cells(lines: list[str], form: DelimitedForm, names: int) -> int:
    """Of a row: as many as there are names, but where most rows have fewer."""
    below = itertools.islice(filter(str.strip, lines[form.header_line :]), _SAMPLED)
    widths = Counter(len(cells_of(line, form.separator)) for line in below)
    usual = widths.most_common(1)[0][0] if widths else names
    return usual if 2 * usual > names else names


def _names(lines: list[str], form: DelimitedForm) -> tuple[list[str], list[str]]:
    """Names of the columns, and their units when the next line holds those."""
    if not form.header_line:
        return [], []
    if form.header_line > len(lines):
        return [], []
    cells = _without_empty_end(_named(lines[form.header_line - 1], form.separator))
    if form.header_line > 1:
        above = lines[form.header_line - 2]
        cells = _under_merged(above, cells, form.separator, form.decimal) or cells
    names: list[str] = []
    for i, cell in enumerate(cells):
        cell = cell.strip('"') or f"column_{i + 1}"
        names.append(cell if cell not in names else cell + _again(i))
    units: list[str] = []
    if form.header_line < len(lines):
        cells = _named(lines[form.header_line], form.separator)[: len(names)]
        wordy = not any(is_number(cell, form.decimal) for cell in cells)
        if len(cells) == len(names) and wordy and _are_units(cells):
            units = [cell.strip("[]() ") for cell in cells]
    return names, units


def _are_units(cells: Sequence[str]) -> bool:
    """Whether cells below the names hold units: all short as such, or most of them known."""
    known = sum(unit_named(cell) is not None for cell in cells)
    return 2 * known > len(cells) or all(_UNIT.fullmatch(cell) for cell in cells)


def _again(i: int) -> str:
    """What tells a column from an earlier one of the same name."""
    return f" (column {i + 1})"


def _first_of_thousands(cells: Sequence[str], decimal: str) -> int | None:
    """The first cell in which the decimal mark seems to part thousands: in all that have it three
    digits follow, and those that do not are too many, and too large, for decimals left out."""
    marked = [row for row, cell in enumerate(cells) if decimal in cell]
    if not _LEAST_MARKED <= len(marked) < len(cells):
        return None
    if not all(_OF_THOUSANDS.fullmatch(cells[row]) for row in marked):
        return None
    whole = [number_in(cell, decimal) for cell in cells if cell and decimal not in cell]
    sizes = [abs(value) for value in whole if value is not None and math.isfinite(value)]
    return marked[0] if sizes and 100.0 <= max(sizes) < 1000.0 else None


def _column(cells: Sequence[str], decimal: str, unit: str) -> Column:
    """Numbers, NaN where nothing was read; or seconds of dates and times of day."""
    if (row := _first_of_thousands(cells, decimal)) is not None:
        values = numbers_in(cells, decimal)
        return Column(values, unit=unit, unread=(row, cells[row], _NO_THOUSANDS))
    with suppress(ValueError):  # the slow way below tells what is in which cell
        if decimal == "." or not any("." in cell for cell in cells):
            values = np.array([cell.replace(decimal, ".") for cell in cells], dtype=np.float64)
            if not np.isinf(values).any():
                return Column(values, unit=unit)
    is_clock = sum(bool(_clock(cell)) for cell in cells) > len(cells) / 2
    values = _seconds(cells) if is_clock else numbers_in(cells, decimal)
    for row, (cell, value) in enumerate(zip(cells, values.tolist(), strict=True)):
        if not math.isfinite(value) and not says_nothing(cell):
            remedy = _remedy(cell, decimal)
            if row == 0 and re.search(r"\d", cell) is None:
                remedy += ", or write all of a name into one line if it is a part of one"
            unread = (row, cell, remedy)
            return Column(values, unit=unit, is_clock=is_clock, unread=unread)
    return Column(values, unit=unit, is_clock=is_clock)


def clock_column(cells: Sequence[str]) -> Column | None:
    """Dates or times of day as seconds; None when a cell that is not empty is none."""
    if not any(cells) or not all(_clock(cell) for cell in cells if cell):
        return None
    return _column(cells, ".", "")


def _remedy(cell: str, decimal: str) -> str:
    """What to do about a cell that is neither a number nor says that nothing was read."""
    remedy = _almost(cell, decimal)
    if not remedy:
        remedy = "leave the cell empty where nothing was read, or delete the line if it is no row"
        if re.search(r"\d[.,]\d", cell):
            remedy += ", or correct text.decimal"
    return remedy


def numbers_in(cells: Sequence[str], decimal: str) -> Floats:
    """The number in each cell, NaN for any other text."""
    read = (number_in(cell, decimal) for cell in cells)
    return np.array([np.nan if value is None else value for value in read])


def _clock(cell: str) -> re.Match[str] | None:
    return _CLOCK.fullmatch(cell) or _OF_HOUR.fullmatch(cell)


def _seconds(cells: Sequence[str]) -> Floats:
    """Seconds of '2026-03-01T12:00:00.25+02:00', '01.03.2026 12:00:00,25' or '12:00:00.25 PM', NaN
    for other text; a time of day without a day goes on after midnight, and '59:59.9' of an hour
    after its end."""
    found = [_clock(cell) for cell in cells]
    parts = [clock.groupdict() if clock else {} for clock in found]
    days = _days({part["day"] for part in parts if part.get("day")})
    values = np.array([_of_clock(part, days) if part else np.nan for part in parts])
    if not days:
        there = np.isfinite(values)
        around_s = _DAY_S if any("h" in part for part in parts) else _HOUR_S
        # Back by more than half of it is the next one; by less, somebody set the clock.
        passed = np.diff(values[there], prepend=values[there][:1]) < -around_s / 2.0
        values[there] += around_s * np.cumsum(passed)
    return values


def _of_clock(part: dict[str, str], days: dict[str, int]) -> float:
    """Seconds of the named parts of a date or time."""
    hours = int(part.get("h") or 0)
    if part.get("half"):
        hours = hours % 12 + 12 * (part["half"].lower() == "pm")
    since = _HOUR_S * hours + 60.0 * int(part["min"]) + float(part["s"].replace(",", "."))
    if part.get("zone"):
        since -= _ahead_s(part["zone"])
    return since + (_DAY_S * days.get(part["day"], np.nan) if part.get("day") else 0.0)


@cache
def _ahead_s(zone: str) -> float:
    """Of '+02:00', '+0200' or '+02': by how much its clocks are ahead."""
    ahead = datetime.strptime(zone.ljust(len("+0200"), "0"), "%z").utcoffset()
    return ahead.total_seconds() if ahead else 0.0


def _days(texts: set[str]) -> dict[str, int]:
    """The number of each day; days and months stand where they are all days, and few apart."""
    best: dict[str, int] = {}
    for pattern in _DAYS:
        days = {}
        for text in texts:
            with suppress(ValueError):
                days[text] = datetime.strptime(text, pattern).toordinal()
        if (len(days), -_span(days)) > (len(best), -_span(best)):
            best = days
    return best


def _span(days: dict[str, int]) -> int:
    return max(days.values(), default=0) - min(days.values(), default=0)
