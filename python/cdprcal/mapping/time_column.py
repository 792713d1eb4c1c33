"""Which column of a raw file is its time, and in what unit."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace

import numpy as np

from cdprcal.mapping.common_time import shared_stamps
from cdprcal.mapping.proposal import PLUS, Line
from cdprcal.mapping.raw import Floats, RawTable, unwrapped
from cdprcal.mapping.recognise import Name
from cdprcal.mapping.units import UNITS, unit_named

#: Periods of samples that logs have [s].
_PERIODS_S = (5e-4, 2.0)
#: Of rows that differ from the last one, where most stand still.
_LEAST_STEPS = 0.05
#: Columns of no kind, or that are times, hold no readings.
_NONE = ("", "time")


def time_of(raw: RawTable, names: dict[str, Name]) -> tuple[Line, float | None]:
    """Where the time of each row is, or the rate where no column has it."""
    if raw.kind == "bag":
        return Line("time", ("",), "s", (1,), "sure", "stamps"), None
    rising = [key for key in names if _rises(unwrapped(raw.columns[key].values))]
    of_time = [key for key, name in names.items() if name.kind == "time"]
    held = [key for key in of_time if key not in rising and _never_falls(raw.columns[key].values)]
    if (parts := _parts_of_time(raw, names)) and raw.columns[parts.columns[0]].is_clock:
        return parts, None
    for key in (*rising, *held):
        if raw.columns[key].is_clock:
            line = Line("time", (key,), "s", (1,), "sure", "dates or times of day")
            return _held(raw, names, line) if key in held else (line, None)
    if parts:
        return parts, None
    named = [key for key in rising if key in of_time]
    for key in (*named, *held):
        why = "its name; no unit makes its steps a logger's"
        by_name = Line("time", (key,), "s", (1,), "guess", why)
        by_name = _of_column(raw, names[key], "its name; ") or by_name
        return _held(raw, names, by_name) if key in held else (by_name, None)
    if raw.kind == "records":
        return Line("time", (), "s", (1,), "likely", "one rest a record"), 0.1
    plain = [key for key in rising if not names[key].kind]
    for key in sorted(plain, key=lambda key: _counts(raw.columns[key].values)):
        by_steps = _of_column(raw, names[key], "")
        if by_steps is not None and _counts(raw.columns[key].values):
            why = "it counts the rows: correct unit to the seconds of one"
            by_steps = replace(by_steps, sure="guess", why=why)
        if by_steps is not None:
            return by_steps, None
    why = "no column rises as time does: correct the rate"
    for key in of_time:
        steps = np.diff(raw.columns[key].values)
        if (back := int((steps < 0.0).sum())) and (steps != 0.0).mean() > _LEAST_STEPS:
            why = f"{key!r} goes back at {back} of {len(steps) + 1} rows: sort the rows by it"
            break
    return Line("time", (), "s", (1,), "guess", why), 100.0


def _of_column(raw: RawTable, name: Name, by: str) -> Line | None:
    """A column as the time, in its unit or one in which its steps are a logger's."""
    if name.unit in UNITS["s"]:
        return Line("time", (name.text,), name.unit, (1,), "sure", "name and unit")
    values = unwrapped(raw.columns[name.text].values)
    steps = np.diff(values[np.isfinite(values)])
    step = float(np.median(steps)) if (steps > 0.0).mean() > 0.9 else float(np.mean(steps))
    for unit in ("s", "ms", "us", "ns", "d"):
        period_s = step * UNITS["s"][unit]
        if _PERIODS_S[0] <= period_s <= _PERIODS_S[1]:
            why = f"{by}it rises, by {period_s:g} s a row"
            return Line("time", (name.text,), unit, (1,), "likely", why)
    return None


def _held(raw: RawTable, names: dict[str, Name], line: Line) -> tuple[Line, float | None]:
    """A time that stands still over some rows; the rate of all, where it does over most, and these
    are no rows written again."""
    (column,) = line.columns
    time_s = UNITS["s"][str(line.unit)] * unwrapped(raw.columns[column].values)
    readings = [raw.columns[key].values for key, name in names.items() if name.kind not in _NONE]
    if (shared := shared_stamps(time_s)) is not None and _differ(time_s, readings):
        lasts_s, rate_Hz = shared
        why = f"{column!r} goes on by {lasts_s:.3g} s at a time: correct the rate of its rows"
        return Line("time", (), "s", (1,), "guess", why), float(f"{rate_Hz:.3g}")
    sure = "likely" if line.sure == "sure" else line.sure
    return replace(line, sure=sure, why=f"{line.why}; rows of the same time are left out"), None


def _differ(time_s: Floats, readings: list[Floats]) -> bool:
    """Whether rows of the time of the one before hold other readings, and not the same again."""
    same = np.diff(time_s) == 0.0
    other = np.any([np.diff(values)[same] != 0.0 for values in readings], axis=0)
    return bool(readings) and bool(np.mean(other) > _LEAST_STEPS)


def _parts_of_time(raw: RawTable, names: dict[str, Name]) -> Line | None:
    """Whole seconds and what passed since each began, as ROS writes its stamps."""
    last = {key: re.split(r"[\W_]", key.rstrip(")] "))[-1] for key in names}
    units = {key: unit_named(last[key]) for key, name in names.items() if name.kind in ("", "time")}
    for whole, part in itertools.permutations(units, 2):
        unit = units[part]
        if unit not in ("ms", "us", "ns"):
            continue
        seconds, since_s = raw.columns[whole].values, UNITS["s"][unit] * raw.columns[part].values
        in_one = np.all((since_s >= 0.0) & (since_s < 1.0) & (seconds == np.round(seconds)))
        # Of other names only those that give every row its time: a latency [ms] does not.
        alike = whole.removesuffix(last[whole]) == part.removesuffix(last[part])
        if in_one and (alike or not _rises(seconds)) and _rises(seconds - seconds[0] + since_s):
            why = f"whole seconds, and {unit} since each began"
            return Line("time", (whole, part), f"s{PLUS}{unit}", (1,) * 2, "sure", why)
    return None


def _rises(values: Floats) -> bool:
    steps = np.diff(values[np.isfinite(values)])
    return len(steps) > 1 and bool((steps > 0.0).mean() > 0.99) and float(steps.sum()) > 0.0


def _never_falls(values: Floats) -> bool:
    """Whether a column rises now and then and never falls, as a clock that is read too often."""
    steps = np.diff(values[np.isfinite(values)])
    return len(steps) > 1 and bool((steps >= 0.0).all() and (steps > 0.0).mean() > _LEAST_STEPS)


def _counts(values: Floats) -> bool:
    """Whether a column is but the number of the row."""
    return bool((np.diff(values[np.isfinite(values)]) == 1.0).all())
