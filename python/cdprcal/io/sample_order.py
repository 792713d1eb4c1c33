"""Rows of a canonical CSV log that do not stand in the order of their times: set right where
nothing is lost by it, else why not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cdprcal.findings import Finding

#: As far as threads and networks bring a row out of its place.
_FEW_ROWS = 10
#: Of the usual step: rows that were exchanged are that far apart, on the mean, once they are
#: sorted; of a clock that was set back at most two thirds, since rows fall between others.
_LEAST_STEP = 5.0 / 6.0


@dataclass(frozen=True)
class Ordered:
    """The log's text with rows in order, the line of each in the file, and what was done."""

    text: bytes
    line: NDArray[np.int64]
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class Disorder:
    """Rows that no order of theirs explains: the first line, what is wrong, what to do."""

    line: int
    problem: str
    remedy: str


def header_of(lines: Sequence[bytes]) -> tuple[int, list[bytes]]:
    """Where the header of a CSV log is, from 0, and its names; none where it names no time_s."""
    at = next(
        (i for i, line in enumerate(lines) if line.strip(b"\0 \t\r") and line.strip()[:1] != b"#"),
        len(lines),
    )
    header = lines[at].removeprefix(b"\xef\xbb\xbf") if at < len(lines) else b""
    names = [name.strip() for name in header.split(b",")]
    return at, names if b"time_s" in names else []


def finite_number(cell: bytes) -> float | None:
    """The number that a cell is, if it is one."""
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def in_order(data: bytes) -> Ordered | Disorder | None:
    """A CSV log without rows that are there twice, sorted by time where rows are a few places off;
    what is wrong where that does not do; None where times increase, or are none."""
    lines = data.split(b"\n")
    header, names = header_of(lines)
    kept: list[tuple[int, float]] = []
    repeated: list[int] = []
    seen: set[bytes] = set()
    for number, line in enumerate(lines[header + 1 :] if names else [], start=header + 2):
        row = line.strip()
        if not row or row.startswith(b"#"):
            continue
        if row.count(b",") != len(names) - 1:
            return None
        time_s = finite_number(row.split(b",")[names.index(b"time_s")])
        if time_s is None:
            return None
        if row in seen:
            repeated.append(number)
        else:
            seen.add(row)
            kept.append((number, time_s))
    line_of, times_s = np.array([k[0] for k in kept]), np.array([k[1] for k in kept])
    late = np.flatnonzero(~later_than_all_before(times_s))
    if not len(late) and not repeated:
        return None
    order = np.argsort(times_s, kind="stable")
    if len(late) and not _were_exchanged(times_s[order], order):
        return _disorder(times_s, line_of)
    findings = []
    if repeated:
        what = "rows that stand in the file already are left out"
        remedy = "see that the logger writes each sample once"
        findings.append(_put_right("repeated_rows", what, repeated, remedy))
    if len(late):
        what = "rows that stand after later ones are sorted by their time"
        remedy = "see that samples are written in the order in which they were read"
        findings.append(_put_right("unsorted_rows", what, line_of[late].tolist(), remedy))
    line_of = line_of[order]
    rows = [lines[number - 1] for number in line_of.tolist()]
    return Ordered(b"\n".join([lines[header], *rows, b""]), line_of, tuple(findings))


def later_than_all_before(times_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which rows have a time, and that a later one than all rows before."""
    finite = np.isfinite(times_s)
    latest = np.maximum.accumulate(np.where(finite, times_s, -np.inf))
    return finite & (times_s > np.concatenate([[-np.inf], latest[:-1]]))


def and_more(lines: Sequence[int]) -> str:
    """The first of some lines, how many more there are, and the last."""
    first, *more = lines
    return f"{first} (and {len(more)} more, the last {more[-1]})" if more else f"{first}"


def clock_remedy(*, same: int, back: int, begins_again: bool) -> str:
    """What to do about so many rows of the time of the one before, and that go back."""
    if same > back:
        return "write finer times, or give a mapping file with time: {rate_Hz: …}, with --map"
    if begins_again:
        return "split the file there, or give a mapping file with --map: then the last run counts"
    return "split the file where the clock was set, or log again"


def _were_exchanged(times_s: NDArray[np.float64], order: NDArray[np.int64]) -> bool:
    """Whether sorted times are those of rows that were a few places off, and of no clock that was
    set back."""
    steps = np.diff(times_s)
    places = np.abs(order - np.arange(len(order)))
    if not (steps > 0.0).all() or places.max() > _FEW_ROWS:
        return False
    edges = np.flatnonzero(np.diff(np.r_[0, places > 0, 0]))
    return all(
        np.mean(steps[max(begin - 1, 0) : end]) > _LEAST_STEP * np.median(steps)
        for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    )


def _disorder(times_s: NDArray[np.float64], line_of: NDArray[np.int64]) -> Disorder:
    steps = np.diff(times_s)
    same, back = int((steps == 0.0).sum()), int((steps < 0.0).sum())
    first = int(np.argmin(later_than_all_before(times_s)))
    if same > back:
        problem = f"{same} of {len(times_s)} rows have the time of the row before"
    else:
        before, after = times_s[first - 1], times_s[first]
        problem = f"time must increase from row to row, but {after:.12g} follows {before:.12g}"
    begins_again = bool((times_s[1:] <= times_s[0]).any())
    remedy = clock_remedy(same=same, back=back, begins_again=begins_again)
    return Disorder(int(line_of[first]), problem, remedy)


def _put_right(code: str, what: str, lines: Sequence[int], remedy: str) -> Finding:
    more = "" if len(lines) == 1 else f" and {len(lines) - 1} more, the last {lines[-1]}"
    return Finding(
        severity="warning",
        code=code,
        message=f"{what}: line {lines[0]}{more}",
        remedy=remedy,
        line=lines[0],
    )
