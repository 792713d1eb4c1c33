"""Excel workbooks: the sheet that holds the readings, as columns."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

from cdprcal._core import InputError
from cdprcal.extras import need
from cdprcal.io.files import shown_path
from cdprcal.mapping.delimited import table_of_lines
from cdprcal.mapping.one_a_row import one_a_row
from cdprcal.mapping.raw import RawTable

_SEPARATOR = "\t"


def read_workbook(path: Path) -> RawTable:
    """Reads the sheet with the most numbers as delimited text is read, names and units found; the
    other sheets are left out, and named. Raises InputError naming file and row."""
    name = shown_path(path)
    need("openpyxl", of=name)
    from openpyxl import load_workbook

    try:
        book = load_workbook(path, read_only=True, data_only=True)
        sheets = [
            (sheet.title, list(sheet.iter_rows(values_only=True))) for sheet in book.worksheets
        ]
        book.close()
    except (OSError, BadZipFile, KeyError, ValueError, TypeError, AttributeError) as error:
        raise InputError(
            f"{name}: is no whole Excel workbook ({type(error).__name__}); save it again"
        ) from None
    counts = [
        sum(isinstance(cell, float | int) for row in rows for cell in row) for _, rows in sheets
    ]
    if not any(counts):
        raise InputError(
            f"{name}: holds no numbers; save the workbook in Excel, so that formulas have values"
        )
    chosen = counts.index(max(counts))
    others = tuple(f"sheet {title!r}" for i, (title, _) in enumerate(sheets) if i != chosen)
    cells = [[_cell(c) for c in row] for row in sheets[chosen][1]]
    filled = [i for i, row in enumerate(cells) if any(row)]
    table = one_a_row(path, [cells[i] for i in filled], [i + 1 for i in filled])
    if table is not None:
        return replace(table, left_out=others)
    lines = [_line(row) for row in cells]
    return table_of_lines(path, lines, _SEPARATOR, kind="workbook", left_out=others)


def _line(row: list[str]) -> str:
    """A row as text between tabs, as delimited text has it."""
    text = io.StringIO()
    csv.writer(text, delimiter=_SEPARATOR, lineterminator="").writerow(row)
    return text.getvalue()


def _cell(value: Any) -> str:
    """A cell as text: numbers to the last digit, dates as ISO has them, words on one line."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    return " ".join(str(value).split())
