"""The robot's own log: ASCII lines ``type,time_s,…``, one block of lines a sample.

Type 3 is one cable, type 5 the attitude in degrees, type 6 something else. Nothing is corrected
here: signs, scales and offsets stay as the robot wrote them, since finding out what is wrong with
them is the diagnosis' job. Only the attitude is turned into radians.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import InputError, Log
from cdprcal.findings import Finding
from cdprcal.io.files import shown_path
from cdprcal.io.loaded import LogFile
from cdprcal.io.sample_order import and_more, later_than_all_before
from cdprcal.sensors import MOST_CABLES

_NEWLINE, _COMMA, _RETURN = 10, 44, 13
_CABLE, _ATTITUDE, _OTHER, _UNKNOWN, _BLANK = 3, 5, 6, -1, -2
_FIELDS = {_CABLE: 14, _ATTITUDE: 5}
#: Columns of a cable line: time, cable id, length, tension, set-point, swivel angle.
_CABLE_COLUMNS = {
    "time_s": 1,
    "cable id": 2,
    "cable length": 7,
    "tension": 9,
    "tension set-point": 10,
    "swivel angle": 13,
}
_ATTITUDE_COLUMNS = {"time_s": 1, "roll": 2, "pitch": 3, "yaw": 4}
#: Findings of one kind; more are counted.
_MOST_ALIKE = 20

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class _Lines:
    """The file cut into lines; NUL bytes are gone, line numbers are those of the file."""

    text: NDArray[np.uint8]
    begin: Integers  # first byte
    kind: Integers  # leading digit when a comma follows, else _UNKNOWN or _BLANK
    commas: NDArray[np.int32]
    damaged: Flags  # NUL bytes were inside
    cut: bool  # the last line has no line end


def parse_raw_log(data: bytes, path: Path) -> LogFile:
    """Reads a raw robot log. Raises InputError 'file:line: …' when it is not one.

    Lines that the logger did not finish are left out, each with a finding.
    """
    name = shown_path(path)
    findings: list[Finding] = []
    lines = _split(data, findings)
    usable = _usable(lines, findings)
    cable_lines = np.flatnonzero(usable & (lines.kind == _CABLE))
    attitude_lines = np.flatnonzero(usable & (lines.kind == _ATTITUDE))
    if len(cable_lines) + len(attitude_lines) == 0:
        raise InputError(
            f"{name}: has no header line, as CSV logs begin with ('time_s,…'), and no complete "
            "cable (type 3) or attitude (type 5) line, as raw robot logs have; write a header line "
            "(docs/your-log.md)"
        )
    cables = _numbers(lines, cable_lines, _CABLE_COLUMNS, name)
    attitude = _numbers(lines, attitude_lines, _ATTITUDE_COLUMNS, name)
    cable_id = _cable_ids(cables[:, 1], cable_lines, name)

    samples = _Samples(cables[:, 0], cable_lines, attitude[:, 0], attitude_lines, findings)
    columns = _per_cable(cables[:, 2:], cable_id, cable_lines, samples, findings)
    angles = np.full((0, 0), np.nan)
    if len(attitude_lines):
        angles = np.full((samples.count, 3), np.nan)
        angles[samples.of_attitude[samples.attitude_kept]] = np.deg2rad(
            attitude[samples.attitude_kept, 1:]
        )
    log = Log(
        time_s=samples.time_s,
        length_m=columns[0] if columns else None,
        tension_N=columns[1] if columns else None,
        tension_setpoint_N=columns[2] if columns else None,
        swivel_rad=columns[3] if columns else None,
        roll_pitch_yaw_rad=angles if angles.size else None,
        source=name,
    )
    return LogFile(path, "raw", log, tuple(findings), samples.line)


def _split(data: bytes, findings: list[Finding]) -> _Lines:
    text = np.frombuffer(data, dtype=np.uint8)
    line_of_nul: Integers = np.empty(0, dtype=np.int64)
    if b"\0" in data:
        nul = text == 0
        edges = np.flatnonzero(nul[1:] != nul[:-1]) + 1
        edges = np.r_[[0] * int(nul[0]), edges, [nul.size] * int(nul[-1])].astype(np.int64)
        begins, ends = edges[::2], edges[1::2]  # of runs: far fewer than bytes
        line_of_nul = np.searchsorted(np.flatnonzero(text == _NEWLINE), begins)
        _report_nul(ends - begins, line_of_nul, findings)
        text = text[~nul]
    if b"\r" in data:
        text = text[text != _RETURN]
    begin, commas = _core.text_lines(text)
    starts = begin[:-1]
    cut = bool(text.size) and text[-1] != _NEWLINE
    first = text[starts]
    second = text[np.minimum(starts + 1, text.size - 1)]
    digit = (first >= ord("0")) & (first <= ord("9")) & (second == _COMMA)
    kind = np.where(digit, first.astype(np.int64) - ord("0"), _UNKNOWN)
    kind[first == _NEWLINE] = _BLANK
    damaged = np.zeros(starts.size, dtype=np.bool_)
    damaged[line_of_nul[line_of_nul < starts.size]] = True
    return _Lines(text, starts, kind, commas, damaged, cut)


def _report_nul(counts: Integers, line_of_nul: Integers, findings: list[Finding]) -> None:
    """One finding a run of NUL bytes, as long as there are few."""
    if counts.size > _MOST_ALIKE:
        what = f"{counts.sum()} NUL bytes in {counts.size} places, the first at line "
        findings.append(_nul_padding(what, int(line_of_nul[0]) + 1))
        return
    for count, line in zip(counts.tolist(), line_of_nul.tolist(), strict=True):
        findings.append(_nul_padding(f"{count} NUL bytes at line ", line + 1))


def _nul_padding(what: str, line: int) -> Finding:
    return Finding(
        severity="warning",
        code="nul_padding",
        message=f"{what}{line}: space that the logger reserved and never filled",
        remedy="readings may be missing there; close the log properly before power-off",
        line=line,
    )


def _usable(lines: _Lines, findings: list[Finding]) -> Flags:
    """Which lines can be read; says why the others cannot."""
    complete = np.zeros(lines.kind.size, dtype=np.bool_)
    for kind, fields in _FIELDS.items():
        complete |= (lines.kind == kind) & (lines.commas == fields - 1)
    known = np.isin(lines.kind, [_CABLE, _ATTITUDE])
    unknown = ~known & ~np.isin(lines.kind, [_OTHER, _BLANK])
    last = lines.kind.size - 1
    if lines.cut:
        complete[last] = known[last] = unknown[last] = False
        findings.append(
            Finding(
                severity="warning",
                code="truncated",
                message=f"the last line, {last + 1}, has no end: the file was cut there; "
                "the line is left out",
                remedy="close the log properly before power-off or copying",
                line=last + 1,
            )
        )
    _report_lines(
        known & ~complete & lines.damaged,
        "damaged_line",
        "NUL bytes have swallowed part of the line; left out",
        findings,
    )
    ragged = known & ~complete & ~lines.damaged
    for kind, fields in _FIELDS.items():
        _report_lines(
            ragged & (lines.kind == kind),
            "ragged_line",
            f"a line of type {kind} has {fields} fields, this one has not; left out",
            findings,
        )
    _report_lines(unknown, "unknown_line", "not a line of type 3, 5 or 6; left out", findings)
    return complete


def _report_lines(chosen: Flags, code: str, what: str, findings: list[Finding]) -> None:
    numbers = (np.flatnonzero(chosen) + 1).tolist()
    if not numbers:
        return
    findings.append(
        Finding(
            severity="warning",
            code=code,
            message=f"line {and_more(numbers)}: {what}",
            remedy="readings are missing there; look at these lines",
            line=numbers[0],
        )
    )


def _numbers(lines: _Lines, chosen: Integers, columns: dict[str, int], name: str) -> Floats:
    """Some columns of some lines. Raises InputError 'file:line: column …' for text in a number."""
    values, wrong = _core.number_table(
        lines.text, lines.begin[chosen], np.array(list(columns.values()))
    )
    if wrong is not None:
        row, place, cell = wrong
        raise InputError(
            f"{name}:{chosen[row] + 1}: {list(columns)[place]}: "
            f"{cell.decode('latin-1')[:40]!r} is not a number; leave it empty if there was no "
            "reading"
        )
    infinite = np.argwhere(np.isinf(values))
    if infinite.size:
        row, place = infinite[0]
        raise InputError(
            f"{name}:{chosen[row] + 1}: {list(columns)[place]}: is infinite; leave it "
            "empty if there was no reading"
        )
    return values


def _cable_ids(values: Floats, lines: Integers, name: str) -> Integers:
    wrong = np.flatnonzero(~((values >= 0) & (values < MOST_CABLES) & (values % 1 == 0)))
    if wrong.size:
        raise InputError(
            f"{name}:{lines[wrong[0]] + 1}: cable id: must be a whole number from 0 to "
            f"{MOST_CABLES - 1}, not {values[wrong[0]]:g}"
        )
    return values.astype(np.int64)


class _Samples:
    """Lines of one time stamp are one sample; a sample must be later than all before it."""

    def __init__(
        self,
        cable_time: Floats,
        cable_lines: Integers,
        attitude_time: Floats,
        attitude_lines: Integers,
        findings: list[Finding],
    ) -> None:
        lines = np.concatenate([cable_lines, attitude_lines])
        order = np.argsort(lines, kind="stable")
        time = np.concatenate([cable_time, attitude_time])[order]
        first = np.flatnonzero(np.diff(time, prepend=np.nan) != 0)
        group = np.empty(lines.size, dtype=np.int64)
        group[order] = np.cumsum(np.isin(np.arange(lines.size), first)) - 1
        sample_time = time[first]
        sample_line = lines[order][first] + 1
        kept = later_than_all_before(sample_time)
        _report_time(sample_time, sample_line, kept, findings)
        number = np.cumsum(kept) - 1

        self.time_s: Floats = sample_time[kept]
        self.line: Integers = sample_line[kept]
        self.count = int(kept.sum())
        self.cable_kept: Flags = kept[group[: cable_lines.size]]
        self.attitude_kept: Flags = kept[group[cable_lines.size :]]
        self.of_cable: Integers = number[group[: cable_lines.size]]
        self.of_attitude: Integers = number[group[cable_lines.size :]]


def _report_time(time: Floats, line: Integers, kept: Flags, findings: list[Finding]) -> None:
    begins = np.flatnonzero(~kept & np.concatenate([[True], kept[:-1]]))
    for number, begin in enumerate(begins):
        if number == _MOST_ALIKE:
            findings.append(
                Finding(
                    severity="error",
                    code="time_not_increasing",
                    message=f"time goes back {begins.size - number} times more",
                    remedy="split the file where the clock was set, or log again",
                    line=int(line[begin]),
                )
            )
            return
        later = np.flatnonzero(kept[begin:])
        count = int(later[0]) if later.size else kept.size - int(begin)
        latest = float(np.max(time[:begin][kept[:begin]], initial=-np.inf))
        findings.append(
            Finding(
                severity="error",
                code="time_not_increasing",
                message=f"time goes back from {latest:g} s to {time[begin]:g} s at line "
                f"{line[begin]}; {count} samples are left out",
                remedy="split the file where the clock was set, or log again",
                line=int(line[begin]),
                time_s=float(time[begin]) if np.isfinite(time[begin]) else None,
            )
        )


def _per_cable(
    values: Floats,
    cable_id: Integers,
    lines: Integers,
    samples: _Samples,
    findings: list[Finding],
) -> list[Floats]:
    """One [N, n] array a value column; NaN where a cable has no line in a sample."""
    kept = samples.cable_kept
    if not kept.any():
        return []
    count = int(cable_id.max()) + 1
    cell = samples.of_cable * count + cable_id
    seen = np.bincount(cell[kept], minlength=samples.count * count)
    _report_lines(
        _nth_time(cell, kept, seen, lines),
        "repeated_line",
        "a second line of this cable with the same time; the last one is taken",
        findings,
    )
    columns = []
    for column in values.T:
        flat = np.full(samples.count * count, np.nan)
        flat[cell[kept]] = column[kept]
        columns.append(flat.reshape(samples.count, count))
    return columns


def _nth_time(cell: Integers, kept: Flags, seen: Integers, lines: Integers) -> Flags:
    """Flags, by line number, of lines whose cable was already read in that sample."""
    flags = np.zeros(int(lines[-1]) + 1, dtype=np.bool_)
    twice = kept & (seen[np.where(kept, cell, 0)] > 1)
    candidates = np.flatnonzero(twice)
    if candidates.size:
        _, first = np.unique(cell[candidates], return_index=True)
        repeated = np.delete(candidates, first)
        flags[lines[repeated]] = True
    return flags
