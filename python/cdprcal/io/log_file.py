"""A log file of any kind as a canonical Log, with what reading it brought to light."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.extras import need
from cdprcal.findings import Finding
from cdprcal.io.files import begins_with, read_bytes, refuse_many_lines, refuse_utf_16, shown_path
from cdprcal.io.loaded import LogFile, LogFormat
from cdprcal.io.mcap_records import MCAP_MAGIC
from cdprcal.io.sample_order import Disorder, in_order

#: How a CSV log begins that ``cdprcal acquire`` wrote.
ACQUIRED = b"# cdprcal acquisition"
_COMMENT = re.compile(rb"\n[ \t]*#")
_END = re.compile(rb'"state": "(done|holding)"')
_RAW_LINE = re.compile(rb"\s*\d+,[-+.\deE]+,")


def sniff_format(data: bytes) -> LogFormat:
    """The kind of log, by content alone: MCAP's magic, a raw robot line, else canonical CSV."""
    if data.startswith(MCAP_MAGIC):
        return "mcap"
    start = data[: 1 << 16].lstrip(b"\0\r\n\t ") or data.lstrip(b"\0\r\n\t ")[: 1 << 16]
    return "raw" if _RAW_LINE.match(start) else "csv"


def readable_format(data: bytes, path: str | Path) -> LogFormat:
    """As sniff_format. Raises InputError where what reads it is not installed."""
    kind = sniff_format(data)
    if kind == "mcap":
        need("mcap", of=str(path))
    return kind


#: What a CSV log's name may end in without promising anything else.
_ENDINGS_OF_TEXT = (".csv", ".log", ".txt", ".dat", "")


def is_mcap_name(path: Path) -> bool:
    """Whether a log of this name is written as MCAP; else as CSV. Raises InputError for a name that
    promises another form, and for MCAP where what writes it is not installed."""
    ending = path.suffix.lower()
    is_number = ending[1:2].isdigit()  # run_0.5mm
    if ending not in (*_ENDINGS_OF_TEXT, ".mcap") and not is_number:
        raise InputError(
            f"{shown_path(path)}: its ending is that of no log; give .mcap, or for CSV .csv or one "
            "of plain text"
        )
    if ending == ".mcap":
        need("mcap", of=str(path))
    return ending == ".mcap"


def load_log(path: str | Path) -> LogFile:
    """Reads a canonical CSV, MCAP or raw robot log, told apart by content.

    Raises InputError naming the file and, where there is one, the line.
    """
    path = Path(path)
    return parse_log_bytes(read_log_bytes(path), path)


def parse_log_bytes(data: bytes, path: Path) -> LogFile:
    """A log's content as load_log reads it. Raises InputError."""
    kind = readable_format(data, path)
    if kind == "mcap":
        from cdprcal.io.mcap_log import parse_mcap_log

        return parse_mcap_log(data, path)
    if kind == "raw":
        from cdprcal.io.raw_log import parse_raw_log

        return parse_raw_log(data, path)
    return parse_csv_log(data, path)


def read_log_bytes(path: Path) -> bytes:
    """A log's content. Raises InputError for more lines than any reader could make sense of,
    and for UTF-16."""
    if (path / "metadata.yaml").is_file():
        raise InputError(f"{path}: is a ROS 2 bag: turn it into a log first, with cdprcal import")
    if begins_with(path, len(MCAP_MAGIC)) != MCAP_MAGIC:
        refuse_many_lines(path)
    data = read_bytes(path)
    refuse_utf_16(data, path)
    return data


def parse_csv_log(data: bytes, path: Path) -> LogFile:
    """A canonical CSV log by the C++ reader, which is the one authority on it."""
    findings: list[Finding] = []
    if data.startswith(ACQUIRED):
        data = _whole_lines(data, findings)
        findings += _unfinished(data)
    name = shown_path(path)
    try:
        log = _core.parse_log(data, name)
    except InputError as error:
        ordered = in_order(data)
        if ordered is None:
            raise
        if isinstance(ordered, Disorder):
            where = f"{name}:{ordered.line}: "
            if not str(error).startswith(where):
                raise  # it is of something else
            raise InputError(f"{where}column time_s: {ordered.problem}; {ordered.remedy}") from None
        try:
            log = _core.parse_log(ordered.text, name)
        except InputError:
            raise error from None  # it has the right line
        return LogFile(path, "csv", log, (*findings, *ordered.findings), line=ordered.line)
    return LogFile(path, "csv", log, tuple(findings), line=_sample_lines(data, len(log)))


def load_run(path: str | Path, robot: _core.Robot) -> LogFile:
    """As load_log, for a robot: raises InputError when the cables do not match."""
    file = load_log(path)
    require_cable_count(file, robot)
    return file


def refuse_repeated(files: Sequence[LogFile]) -> None:
    """Raises InputError when two logs are the same run: its readings would count twice, and
    everything would seem better known than it is."""
    for i, file in enumerate(files):
        for other in files[:i]:
            if _same_run(file.log, other.log):
                raise InputError(
                    f"{shown_path(file.path)}: holds the same run as {shown_path(other.path)}; "
                    "give each run once"
                )


def _same_run(a: _core.Log, b: _core.Log) -> bool:
    """Whether the last segments have the same readings at the same times."""
    runs = [slice(s.begin, s.end) for s in (_core.segments(a)[-1], _core.segments(b)[-1])]
    groups = ("time_s", "length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
    return all(
        np.array_equal(getattr(a, name)[runs[0]], getattr(b, name)[runs[1]], equal_nan=True)
        for name in groups
    )


def require_cable_count(file: LogFile, robot: _core.Robot) -> None:
    """Raises InputError when the log is of a robot with another number of cables."""
    refuse_cable_count(file.path, file.log.cable_count, robot)


def refuse_cable_count(path: Path, count: int, robot: _core.Robot) -> None:
    """Raises InputError when a log of so many cables (0: it says nothing of them) is no log of the
    robot's."""
    if count not in (0, robot.cable_count):
        cables = "1 cable" if count == 1 else f"{count} cables"
        raise InputError(
            f"{shown_path(path)}: has {cables}, robot {robot.name} has {robot.cable_count}; use "
            "the robot file of the robot that wrote this log"
        )


def _sample_lines(data: bytes, count: int) -> NDArray[np.int64]:
    """The line of each sample, counted from 1; blank lines and comments hold none."""
    number = 1
    for line in data.split(b"\n", 1000):
        if line.strip() and not line.lstrip().startswith(b"#"):
            break  # the header
        number += 1
    if _COMMENT.search(data, data.find(b"\n", data.find(b"time_s"))) is None:
        return np.arange(number + 1, number + 1 + count, dtype=np.int64)
    rows = (
        at
        for at, line in enumerate(data.split(b"\n"), start=1)
        if at > number and line.strip() and not line.lstrip().startswith(b"#")
    )
    return np.fromiter(rows, dtype=np.int64, count=count)


def _whole_lines(data: bytes, findings: list[Finding]) -> bytes:
    """Without a last line that was cut: even its last number may be half a number."""
    whole = data[: data.rfind(b"\n") + 1]
    if len(whole) < len(data):
        findings.append(cut_off(whole.count(b"\n") + 1))
    return whole


def cut_off(line: int) -> Finding:
    """That the last line of a file, counted from 1, is not whole."""
    return Finding(
        severity="warning",
        code="truncated",
        message=f"the last line, {line}, is cut off and left out",
        remedy="what was read before is used",
        line=line,
    )


def _unfinished(data: bytes) -> Iterator[Finding]:
    """Whether an acquired log ends before its run did: the logger was killed, or lost power."""
    last = data.rfind(b"\n# event| ")
    if last < 0 or not _END.search(data, last):
        yield Finding(
            severity="warning",
            code="unfinished",
            message="the log ends in the middle of its run: the program was killed, or lost power",
            remedy="what is there can be used; acquire again for the rest",
        )
