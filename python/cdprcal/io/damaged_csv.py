"""A canonical CSV log with the damage that a power cut leaves: read what is good, say what is not.

Only ``check`` reads logs this way. Whatever calculates refuses a damaged CSV.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.findings import Finding
from cdprcal.io.files import shown_path
from cdprcal.io.loaded import LogFile
from cdprcal.io.log_file import parse_log_bytes, read_log_bytes, sniff_format
from cdprcal.io.sample_order import and_more, clock_remedy, finite_number, header_of


def load_log_leniently(path: str | Path) -> LogFile:
    """As load_log; NUL padding, a cut last line and time that goes back become findings."""
    path = Path(path)
    data = read_log_bytes(path)
    try:
        return parse_log_bytes(data, path)
    except InputError as error:
        if sniff_format(data) != "csv":
            raise
        repaired = _repair(data)
        if not repaired.findings:
            raise
        try:
            log = _core.parse_log(repaired.text, shown_path(path))
        except InputError:
            raise error from None  # damaged beyond this: the first message has the right line
        line = np.array(repaired.line, dtype=np.int64)
        return LogFile(path, "csv", log, tuple(repaired.findings), line)


class _Repaired:
    def __init__(self) -> None:
        self.text = b""
        self.line: list[int] = []  # of each row that was kept
        self.findings: list[Finding] = []


def _repair(data: bytes) -> _Repaired:
    """Drops NUL bytes, a cut last line and rows that are not later than all before them."""
    out = _Repaired()
    lines = data.split(b"\n")
    header, names = header_of(lines)
    if not names:
        return out
    time_column = names.index(b"time_s")
    kept = [lines[header]]
    first_s, latest_s = np.inf, -np.inf
    backwards: list[int] = []
    same = 0
    begins_again = False
    nul: dict[int, int] = {}
    for number, raw in enumerate(lines[header + 1 :], start=header + 2):
        line = raw.replace(b"\0", b"")
        last = number == len(lines)
        if line != raw:
            nul[number] = len(raw) - len(line)
            if line.count(b",") != len(names) - 1:
                continue  # the rest of the row was swallowed
        if not line.strip() or line.lstrip().startswith(b"#"):
            continue
        if last and line.count(b",") < len(names) - 1:
            _report_cut(out, number)
            continue
        cells = line.split(b",")
        time_s = finite_number(cells[time_column]) if len(cells) == len(names) else None
        if time_s is not None and time_s <= latest_s:
            backwards.append(number)
            same += time_s == latest_s
            begins_again = begins_again or time_s <= first_s
            continue
        if time_s is not None:
            first_s, latest_s = min(first_s, time_s), time_s
        kept.append(line)
        out.line.append(number)
    _report_nul(out, nul)
    back = len(backwards) - same
    remedy = clock_remedy(same=same, back=back, begins_again=begins_again)
    _report_backwards(out, backwards, remedy)
    out.text = b"\n".join([*kept, b""])
    return out


def _report_nul(out: _Repaired, counts: dict[int, int]) -> None:
    if not counts:
        return
    line = min(counts)
    more = "" if len(counts) == 1 else f" (and in {len(counts) - 1} more, the last {max(counts)})"
    out.findings.append(
        Finding(
            severity="error",
            code="nul_padding",
            message=f"{counts[line]} NUL bytes at line {line}{more}: space that the logger "
            "reserved and never filled",
            remedy="delete them; calibrate refuses the file as it is",
            line=line,
        )
    )


def _report_cut(out: _Repaired, line: int) -> None:
    out.findings.append(
        Finding(
            severity="error",
            code="truncated",
            message=f"the last line, {line}, is cut off",
            remedy="delete that line; calibrate refuses the file as it is",
            line=line,
        )
    )


def _report_backwards(out: _Repaired, lines: list[int], remedy: str) -> None:
    if lines:
        out.findings.append(
            Finding(
                severity="error",
                code="time_not_increasing",
                message=f"time does not increase at line {and_more(lines)}",
                remedy=remedy,
                line=lines[0],
            )
        )
