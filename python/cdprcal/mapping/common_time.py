"""Groups of columns, each with times of its own, as rows of one time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cdprcal.mapping.raw import Column, Floats

#: Times that differ by less than this share of the whole are one time, written twice.
_SAME = 1e-9


def on_common_time(
    groups: Sequence[tuple[Floats, dict[str, Column]]],
) -> tuple[Floats, dict[str, Column]]:
    """All times of ``groups`` (times [n], columns [n]), in increasing order, and each column with
    its value where its group has that time, NaN elsewhere. Rows without a time are left out; of
    several at one time the last stays."""
    times = [np.where(np.isfinite(time), time, np.nan) for time, _ in groups]
    there = np.concatenate([time[np.isfinite(time)] for time in times])
    if not len(there):
        return there, {}
    step = _SAME * max(float(np.ptp(there)), 1e-300)
    begin = float(there.min())
    ticks = [np.round((time - begin) / step) for time in times]
    common, first = np.unique(np.concatenate([t[np.isfinite(t)] for t in ticks]), return_index=True)
    columns: dict[str, Column] = {}
    for tick, (_, group) in zip(ticks, groups, strict=True):
        rows = np.flatnonzero(np.isfinite(tick))
        at = np.searchsorted(common, tick[rows])
        for name, column in group.items():
            values = np.full(len(common), np.nan)
            values[at] = column.values[rows]
            columns[name] = replace(column, values=values)
    return there[first], columns


def shared_stamps(time_s: Floats) -> tuple[float, float] | None:
    """Of times that most rows share with the one before, as those of whole seconds: how long one
    lasts [s], and how many rows a second there are [Hz]; None for others."""
    there = time_s[np.isfinite(time_s)]
    first = np.flatnonzero(np.diff(there, prepend=np.nan) != 0.0)[1:]  # that before may be cut
    steps, rows = np.diff(there[first]), np.diff(first)
    if not len(steps) or 2 * len(first) > len(there) or steps.min() < 0.0:
        return None
    lasts_s = float(np.median(steps))
    usual = np.isclose(steps, lasts_s)
    return (lasts_s, float(rows[usual].mean()) / lasts_s) if usual.any() else None


def nearest(column: Column, time_s: Floats) -> Floats:
    """Values of a column with times of its own at others, nearest in time, no further than half the
    longer of both periods; NaN where none is."""
    times = column.time_s
    assert times is not None
    there = np.isfinite(column.values)
    values, times = column.values[there], times[there]
    if not len(times):
        return np.full(len(time_s), np.nan)
    after = np.clip(np.searchsorted(times, time_s), 0, len(times) - 1)
    before = np.maximum(after - 1, 0)
    at = np.where(np.abs(times[before] - time_s) <= np.abs(times[after] - time_s), before, after)
    periods = [float(np.median(np.diff(t))) for t in (times, time_s) if len(t) > 1]
    close = np.abs(times[at] - time_s) <= 0.5 * max(periods, default=0.0) + 1e-9
    return np.where(close, values[at], np.nan)
