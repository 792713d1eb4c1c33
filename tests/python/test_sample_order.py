"""Rows that do not stand in the order of their times: set right where nothing is lost by it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal import InputError
from cdprcal.io import load_log
from conftest import Cli

Rows = list[str]


def exchanged(rows: Rows, at: int, places: int) -> Rows:
    """With one row that many places later than it was read."""
    out = [*rows]
    out.insert(at + places, out.pop(at))
    return out


def timed(rows: Rows, new: Callable[[int, float], float]) -> Rows:
    """With other times: of the number of the row, and its own."""
    cells = (row.split(",", 1) for row in rows)
    return [f"{new(i, float(time)):.12g},{rest}" for i, (time, rest) in enumerate(cells)]


def write(path: Path, edit: Callable[[Rows], Rows]) -> Path:
    header, *rows = path.read_text().splitlines()
    path.write_text("\n".join(["# by hand", header, *edit(rows), ""]))
    return path


SET_RIGHT: dict[str, tuple[Callable[[Rows], Rows], list[tuple[str, int]]]] = {
    "each row twice": (lambda rows: [row for row in rows for _ in "12"], [("repeated_rows", 4)]),
    "a buffer again": (lambda rows: [*rows[:50], *rows[20:]], [("repeated_rows", 53)]),
    "neighbours exchanged": (lambda rows: exchanged(rows, 40, 1), [("unsorted_rows", 44)]),
    "the first row late": (lambda rows: exchanged(rows, 0, 1), [("unsorted_rows", 4)]),
    "four places late": (lambda rows: exchanged(rows, 40, 4), [("unsorted_rows", 47)]),
    "both": (
        lambda rows: [*rows[:9], rows[8], *exchanged(rows, 40, 1)[9:]],
        [("repeated_rows", 12), ("unsorted_rows", 45)],
    ),
}


@pytest.mark.parametrize("what", SET_RIGHT)
def test_rows_twice_or_a_few_places_off_are_set_right_and_said(
    log: cdprcal.Log, log_path: Path, what: str
) -> None:
    edit, said = SET_RIGHT[what]
    file = load_log(write(log_path, edit))
    assert [(finding.code, finding.line) for finding in file.findings] == said
    assert {finding.severity for finding in file.findings} == {"warning"}
    np.testing.assert_array_equal(file.log.time_s, log.time_s)
    np.testing.assert_array_equal(file.log.length_m, log.length_m)
    lines = log_path.read_text().splitlines()
    for sample in range(60):
        line = file.line_of(sample)
        assert line is not None
        assert float(lines[line - 1].split(",")[0]) == file.log.time_s[sample]


def test_commands_tell_of_it(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    write(log_path, lambda rows: exchanged(rows, 40, 1))
    said = "rows that stand after later ones are sorted by their time: line 44"
    for command in (["check", "irma4", log_path], ["import", log_path, "-o", tmp_path / "o.csv"]):
        ran = cli(*command)
        assert ran.code == 0
        assert said in " ".join((ran.stdout + ran.stderr).split())


REFUSED: dict[str, tuple[Callable[[Rows], Rows], str]] = {
    "begins again": (
        lambda rows: timed(rows, lambda i, t: t if i < 100 else t - 10.0),
        r":103: column time_s: time must increase from row to row, but 0 follows 9\.9; split the "
        "file there, or give a mapping file with --map: then the last run counts$",
    ),
    "set back": (
        lambda rows: timed(rows, lambda i, t: t if i < 100 else t - 5.03),
        r":103: column time_s: .* 4\.97 follows 9\.9; split the file where the clock was set, or",
    ),
    "set back by two rows": (
        lambda rows: timed(rows, lambda i, t: t if i < 100 else t - 0.23),
        r":103: column time_s: .* 9\.77 follows 9\.9; split the file where the clock was set, or",
    ),
    "whole seconds": (
        lambda rows: timed(rows, lambda _, t: int(t)),
        ":4: column time_s: .* rows have the time of the row before; write finer times, or give a "
        r"mapping file with time: {rate_Hz: …}, with --map$",
    ),
    "a digit too few": (
        lambda rows: timed(rows, lambda i, _: round(0.06 * i, 1)),
        "rows have the time of the row before; write finer times",
    ),
    "another line is wrong": (
        lambda rows: [*rows[:9], "x" + rows[9], *exchanged(rows, 40, 1)[10:]],
        ":12: column time_s: 'x.*' is not a number",
    ),
    "a later line is wrong": (
        lambda rows: [*exchanged(rows, 40, 1)[:60], rows[60].replace(",", ",x", 1), *rows[61:]],
        ":44: column time_s: time must increase",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_no_order_explains_is_refused_by_its_cause(log_path: Path, what: str) -> None:
    edit, words = REFUSED[what]
    with pytest.raises(InputError, match=words):
        load_log(write(log_path, edit))
