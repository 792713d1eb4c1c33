"""A raw file through a mapping file: a canonical log."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError, Log
from cdprcal.findings import Finding
from cdprcal.hardware.xsens.measurement import rotation_from_quaternion
from cdprcal.io.files import shown_path, shown_text
from cdprcal.io.loaded import LogFile
from cdprcal.io.log_file import cut_off
from cdprcal.io.marks import marks_in, without
from cdprcal.io.sample_order import later_than_all_before
from cdprcal.mapping.common_time import nearest, shared_stamps
from cdprcal.mapping.delimited import is_number
from cdprcal.mapping.document import GROUPS, QUATERNIONS, Group, Map, Time, load_map
from cdprcal.mapping.raw import Column, DelimitedForm, Floats, RawTable, unwrapped
from cdprcal.mapping.read import read_raw
from cdprcal.mapping.units import factor

#: Of a run; a clock that is set back for fewer is no new one.
_LEAST_ROWS = 20
#: By how much quaternions may be off their norm.
_SAME_NORM = 0.01


def load_mapped(path: str | Path, map_path: str | Path, robot: _core.Robot | None) -> LogFile:
    """Reads any raw file by a mapping file.

    ``robot`` is needed for orientations: its Euler convention says how angles are written. Raises
    InputError naming file, column and what to correct.
    """
    the_map = load_map(map_path)
    form = None
    if the_map.text is not None:
        text = the_map.text
        form = DelimitedForm(
            text.separator, text.decimal, text.header_line, text.encoding, shown_path(map_path)
        )
    return apply_map(read_raw(path, form), the_map, shown_path(map_path), robot)


def apply_map(raw: RawTable, the_map: Map, source: str, robot: _core.Robot | None) -> LogFile:
    """The log that a map makes of columns; ``source`` is the map's name in messages."""
    rows = _Rows(raw, the_map, source)
    arrays: dict[str, Floats] = {}
    for name, group in the_map.channels.items():
        sensor = GROUPS[name]
        if group.unit in QUATERNIONS:
            values = _angles(rows, group, robot, source)
        else:
            scale = factor(sensor.unit, group.unit)
            assert scale is not None  # the model saw to that
            parts = zip(group.columns, group.signs, strict=True)
            values = np.stack([scale * sign * rows.of(column) for column, sign in parts], axis=1)
        if group.delay_s:
            values = _before(values, rows.time_s, group.delay_s, is_angle=sensor.unit == "rad")
        if np.isfinite(values).any():
            arrays[sensor.field] = values
    log = Log(time_s=rows.time_s, source=shown_path(raw.path), **arrays)
    line = None if raw.line is None else raw.line[rows.kept]
    cut = () if raw.cut_line is None else (cut_off(raw.cut_line),)
    findings = (*rows.findings, *_lost(raw), *cut, *rows.marks())
    return LogFile(raw.path, "mapped", log, findings, line=line)


def _lost(raw: RawTable) -> Iterator[Finding]:
    """That the file holds NUL bytes."""
    if raw.lost:
        yield Finding(
            severity="warning",
            code="nul_padding",
            message=f"NUL bytes in {raw.lost}: what was to be written there is lost",
            remedy="the rest is used; close the log properly before power-off",
            line=raw.lost_lines[0],
        )


class _Rows:
    """The rows of the log: their times, and each column's values at them."""

    def __init__(self, raw: RawTable, the_map: Map, source: str) -> None:
        self._raw = raw
        self._source = source
        self._missing = the_map.missing
        self._marked: dict[int, dict[str, int]] = {}  #: mark → column → how often
        self.findings: list[Finding] = []
        time_s = self._times(the_map)
        begin = _last_begin(time_s)
        if begin:
            time_s = np.where(np.arange(len(time_s)) < begin, np.nan, time_s - time_s[begin])
            self.findings.append(self._begins_again(begin))
        # Each time once, and in order: a clock that went back says so below.
        self.kept = np.flatnonzero(later_than_all_before(time_s))
        rows = len(time_s) - begin
        if len(self.kept) < rows:
            left_out = f"{rows - len(self.kept)} of {rows} rows"
            self.findings.append(_same_time(left_out, time_s[begin:], the_map.time))
        if the_map.run is not None:
            self._take_run(the_map.run)
        self.time_s = time_s[self.kept]

    def _begins_again(self, begin: int) -> Finding:
        line = self._raw.line
        where = f"row {begin + 1}" if line is None else f"line {line[begin]}"
        return Finding(
            severity="warning",
            code="clock_restarted",
            message=f"the time begins again at {where}: what stands before is left out",
            remedy="cut the file there if the run before is meant",
        )

    def _take_run(self, run: int) -> None:
        """Leaves the rows of one stretch of records."""
        if self._raw.kind != "records":
            raise InputError(
                f"{self._source}: run: {shown_path(self._raw.path)} holds no records in braces, of "
                "which there are runs; delete it"
            )
        runs = self._raw.columns["run"].values
        self.kept = self.kept[runs[self.kept] == run]
        if not len(self.kept):
            raise InputError(
                f"{self._source}: run: {shown_path(self._raw.path)} has {runs[-1]:.0f} runs, and "
                f"none is {run}; give one of 1 to {runs[-1]:.0f}"
            )

    def of(self, name: str) -> Floats:
        """A column at the times of the rows; NaN where it has no value close enough in time."""
        if not name:
            return np.full(len(self.time_s), np.nan)
        column = self._column(name, "channels")
        column = replace(column, values=without(column.values, self._missing))
        for mark, count in marks_in(column.values).items():
            self._marked.setdefault(mark, {})[name] = count
        if column.time_s is None:
            return column.values[self.kept]
        return nearest(column, self.time_s)

    def marks(self) -> list[Finding]:
        """What stands in columns that were read and seems to be no reading."""
        return [
            Finding(
                severity="warning",
                code="missing_mark",
                message=f"{mark} stands {sum(counts.values())} times in "
                f"{shown_text(', '.join(counts), 100)}, far from all that is read beside it: it "
                "seems to say that nothing was read",
                remedy=f"write missing: [{mark}] into the mapping file",
            )
            for mark, counts in self._marked.items()
        ]

    def _column(self, name: str, where: str) -> Column:
        columns = self._raw.columns
        if name not in columns:
            near = difflib.get_close_matches(name, columns, n=len(columns), cutoff=0.5)
            there = [*near, *(key for key in columns if key not in near)]
            shown = ", ".join(repr(shown_text(key, 60)) for key in there[:30])
            more = f" and {len(there) - 30} more" if len(there) > 30 else ""
            form = self._raw.form
            if form is not None and 2 * sum(is_number(k, form.decimal) for k in there) > len(there):
                more += f"; or correct text.header_line: line {form.header_line} holds numbers"
            raise InputError(
                f"{self._source}: {where}: {shown_path(self._raw.path)} has no column {name!r}; "
                f"give one of those it has: {shown}{more}"
            )
        return self._raw.readings(name)

    def _times(self, the_map: Map) -> Floats:
        time = the_map.time
        if time.rate_Hz is not None:
            first = next(n for g in the_map.channels.values() for n in g.columns if n)
            count = len(self._column(first, "channels").values)
            return np.arange(count) / time.rate_Hz
        if self._raw.kind == "bag":
            return self._stamps(time.column)
        time_s = self._since_first(time.column, time.unit)
        if time.plus is not None:
            time_s = time_s + self._since_first(time.plus.column, time.plus.unit)
        return time_s

    def _since_first(self, name: str, unit: str | float) -> Floats:
        """How much later than at its first reading a column is [s]."""
        column = self._column(name, "time")
        scale = 1.0 if column.is_clock else factor("s", unit)
        assert scale is not None  # the model saw to that
        values = column.values if column.is_clock else unwrapped(column.values)
        there = np.flatnonzero(np.isfinite(values))
        first = values[there[0]] if len(there) else 0.0
        return np.asarray(scale * (values - first))

    def _stamps(self, topic: str) -> Floats:
        """When the messages of a topic were taken."""
        columns = self._raw.columns
        for name, column in columns.items():
            if name.startswith(f"{topic}.") and column.time_s is not None:
                return column.time_s
        topics = dict.fromkeys(name.partition(".")[0] for name in columns)
        raise InputError(
            f"{self._source}: time: {shown_path(self._raw.path)} has no topic {topic!r} with "
            f"numbers; give one of those it has: {', '.join(topics)}"
        )


def _same_time(left_out: str, time_s: Floats, time: Time) -> Finding:
    """That rows, ``left_out`` of how many, have no time of their own."""
    if (shared := shared_stamps(time_s)) is None:
        message = "have no time, or not a later one than the row before, and are left out"
        remedy = "see that one logger writes the file, and no one sets its clock"
    else:
        lasts_s, rate_Hz = shared
        finer = "" if time.plus else " or add what passed since to it with plus,"
        message = (
            f"have the time of the row before and are left out: {shown_text(time.column, 60)!r} "
            f"goes on by {lasts_s:.3g} s at a time"
        )
        remedy = (
            f"give a finer column as time,{finer} or write time: {{rate_Hz: {rate_Hz:.3g}}} into "
            "the mapping file if the rows come as evenly"
        )
    return Finding(
        severity="warning", code="same_time", message=f"{left_out} {message}", remedy=remedy
    )


def _last_begin(time_s: Floats) -> int:
    """The row at which a clock last went back to its beginning, and a run follows; else 0."""
    finite = np.flatnonzero(np.isfinite(time_s))
    there = time_s[finite]
    back = np.flatnonzero((np.diff(there) < 0.0) & (there[1:] <= there[0])) + 1
    runs = back[len(there) - back >= _LEAST_ROWS]
    return int(finite[runs[-1]]) if len(runs) else 0


def _before(values: Floats, time_s: Floats, delay_s: float, *, is_angle: bool) -> Floats:
    """Readings [N, c] that are stamped ``delay_s`` late, at the rows nearest to when they were so:
    what lies between two of them on a straight line."""
    out = np.full_like(values, np.nan)
    for column, earlier in zip(values.T, out.T, strict=True):
        there = np.isfinite(column)
        if there.sum() < 2:
            continue
        times = time_s[there] - delay_s
        read = np.unwrap(column[there]) if is_angle else column[there]
        after = np.clip(np.searchsorted(time_s, times), 1, len(time_s) - 1)
        nearer = times - time_s[after - 1] < time_s[after] - times
        at = np.unique(after - nearer)
        earlier[at] = np.interp(time_s[at], times, read, left=np.nan, right=np.nan)
    return out


def _angles(rows: _Rows, group: Group, robot: _core.Robot | None, source: str) -> Floats:
    """Orientations as the angles of the robot's convention; a sign turns the axis' component.

    Whole numbers such as 32767 for 1 are fine: a norm that is the same in all rows is a scale.
    """
    if robot is None:
        raise InputError(
            "the map's attitude is a quaternion: give --robot, whose Euler convention says how "
            "roll, pitch and yaw are to be written"
        )
    pairs = zip(group.columns, group.signs, strict=True)
    parts = [sign * rows.of(column) for column, sign in pairs]
    wxyz = np.stack([parts[i] for i in QUATERNIONS[str(group.unit)]], axis=1)
    norm = np.linalg.norm(wxyz, axis=1)
    there = np.isfinite(norm)
    size = float(np.median(norm[there])) if there.any() else 1.0
    one = size if size > 0.0 and (np.abs(norm[there] / size - 1.0) < _SAME_NORM).all() else 1.0
    good = np.abs(norm / one - 1.0) < _SAME_NORM
    if left_out := int((there & ~good).sum()):
        said = f"{left_out} of {int(there.sum())} quaternions are not of norm 1"
        if not good.any():
            raise InputError(
                f"{source}: channels.attitude: {said}, but of {size:.3g} (median); give the four "
                "columns of one orientation"
            )
        rows.findings.append(
            Finding(
                severity="warning",
                code="no_quaternion",
                message=f"{said} and are left out",
                remedy="see that the columns are those of one orientation, and what the sensor "
                "writes where it has none",
            )
        )
    angles = np.full((len(wxyz), 3), np.nan)
    for i in np.flatnonzero(good):
        w, x, y, z = (wxyz[i] / norm[i]).tolist()
        rotation = rotation_from_quaternion((w, x, y, z))
        angles[i] = _core.euler_from_rotation(rotation, robot.euler_convention)
    return angles
