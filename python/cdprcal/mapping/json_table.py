"""JSON that is one table, as pandas and others write it, as flat columns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdprcal._core import InputError
from cdprcal.io.files import read_bytes, refuse_many_lines, shown_path, shown_text
from cdprcal.mapping.delimited import clock_column, is_number, number_in
from cdprcal.mapping.json_lines import flat_row, parsed, table_of_rows
from cdprcal.mapping.nested import nested_table
from cdprcal.mapping.raw import Column, RawTable
from cdprcal.mapping.records import holds_records

_KIND = "json"
#: Of the labels of rows, where they are more than 0, 1, 2 …
_INDEX = "index"
_LEAST_ROWS = 2


def read_json_table(path: Path, head: bytes) -> RawTable | None:
    """Reads a list of objects or of lists, columns as lists, and what ``DataFrame.to_json`` writes,
    in any ``orient``; None for what is no JSON as a whole, or is read as records in braces.

    ``head``: the beginning of the file. Raises InputError for JSON that is no table, or of which
    rows and columns cannot be told apart.
    """
    if not head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith((b"{", b"[")):
        return None
    refuse_many_lines(path)
    held = parsed(read_bytes(path))
    if held is None:
        return None
    table = _table(path, held)
    if table is None and not holds_records(head):
        raise InputError(
            f"{shown_path(path)}: is JSON, but no table whose rows and columns can be told apart; "
            "write it as a list of objects (pandas: to_json(orient='records'))"
        )
    return table


def _table(path: Path, held: Any) -> RawTable | None:
    if isinstance(held, dict):
        if isinstance(held.get("columns"), list) and isinstance(held.get("data"), list):
            names = [_name(name) for name in held["columns"]]
            rows = _rows_of_lists(path, names, held["data"])
            return None if rows is None else _of_rows(path, rows, held.get("index"))
        tables = [inner for inner in held.values() if _are(dict, inner)]
        if len(tables) == 1:
            return _of_rows(path, tables[0])
        return _labelled(path, held) or _of_columns(path, held)
    if _are(dict, held):
        return _of_rows(path, held)
    if _are(list, held):
        names = [f"column_{i + 1}" for i in range(len(held[0]))]
        rows = _rows_of_lists(path, names, held)
        return None if rows is None else _of_rows(path, rows)
    return None


def _are(kind: type, held: Any) -> bool:
    """Whether something is a list of several of a kind."""
    is_list = isinstance(held, list) and len(held) >= _LEAST_ROWS
    return is_list and all(isinstance(inner, kind) for inner in held)


def _name(held: Any) -> str:
    """The name of a column; one of several levels is a list."""
    return ".".join(map(str, held)) if isinstance(held, list) else str(held)


def _rows_of_lists(path: Path, names: list[str], held: list[Any]) -> list[dict[str, Any]] | None:
    """Rows by the names of their cells; None where a row has others. Raises InputError for a name
    that comes twice."""
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise InputError(
            f"{shown_path(path)}: has two columns {shown_text(twice, 60)!r}; rename one of them"
        )
    if not _are(list, held) or any(len(row) != len(names) for row in held):
        return None
    return [dict(zip(names, row, strict=True)) for row in held]


def _labelled(path: Path, held: dict[str, Any]) -> RawTable | None:
    """Objects in an object: columns of labelled rows, or labelled rows of columns. Labels are
    numbers, dates or times of day, and names are not."""
    if not _are(dict, list(held.values())):
        return None
    inner = next(iter(held.values())).keys()
    if any(row.keys() != inner for row in held.values()) or len(inner) == 0:
        return None
    rows: list[dict[str, Any]]
    if _are_labels(inner) and not _are_labels(held):
        rows = [{name: held[name][label] for name in held} for label in inner]
        labels = list(inner)
    elif _are_labels(held) and not _are_labels(inner):
        rows, labels = list(held.values()), list(held)
    else:
        return None
    return _of_rows(path, rows, labels) if len(rows) >= _LEAST_ROWS else None


def _are_labels(keys: Any) -> bool:
    return all(is_number(key, ".") for key in keys)


def _of_rows(path: Path, rows: list[dict[str, Any]], labels: Any = None) -> RawTable:
    """Rows by name; ``labels``: of each row, one more column where they are no count."""
    if isinstance(labels, list) and len(labels) == len(rows):
        texts = [str(label) for label in labels]
        numbers = [number_in(text, ".") for text in texts]
        if numbers != list(range(len(rows))) and _are_labels(texts):
            index = texts if None in numbers else numbers
            rows = [{_INDEX: label, **row} for label, row in zip(index, rows, strict=True)]
    return table_of_rows(path, _KIND, [flat_row(row) for row in rows])


def _of_columns(path: Path, held: dict[str, Any]) -> RawTable | None:
    """Lists by name, some of them of lists; what is no list stands beside them."""
    clocks: dict[str, Column] = {}
    for name, cells in held.items():
        if _are(str, cells) and (clock := clock_column(cells)) is not None:
            clocks[name] = clock
    arrays = {name: _as_arrays(inner) for name, inner in held.items()}
    arrays |= {name: clock.values for name, clock in clocks.items()}
    if not _holds_rows(arrays):
        return None
    table = nested_table(path, _KIND, arrays)
    table.columns.update((name, clock) for name, clock in clocks.items() if name in table.columns)
    return table


def _holds_rows(held: Any) -> bool:
    """Whether something is an array of several rows, or holds one."""
    if isinstance(held, np.ndarray):
        return held.ndim > 0 and len(held) >= _LEAST_ROWS
    inner = held.values() if isinstance(held, dict) else held if isinstance(held, list) else ()
    return any(map(_holds_rows, inner))


def _as_arrays(held: Any) -> Any:
    """As ``nested_table`` takes it: lists of numbers, or of as many of them each, as arrays."""
    if isinstance(held, dict):
        return {key: _as_arrays(inner) for key, inner in held.items()}
    if isinstance(held, list):
        try:
            return np.array(held, dtype=np.float64)  # None is NaN
        except (TypeError, ValueError):
            return [_as_arrays(inner) for inner in held]
    return held
