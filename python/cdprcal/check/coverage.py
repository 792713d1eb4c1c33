"""Whether the run visits enough different places for a calibration."""

from __future__ import annotations

import math

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.check.subject import Floats, Subject

#: Two places are different when a reading differs by more than this many sigma.
_DIFFERENT_SIGMA = 5.0
#: A platform swings where several readings go to and fro by so many times their noise; one drifts.
_SWINGS_NOISE = 20.0


def find_equilibria(subject: Subject) -> list[_core.Equilibrium]:
    """Equilibria of the run; none when no channel can tell."""
    run = _core.SampleRange(subject.run.start, subject.run.stop)
    try:
        return _core.detect_equilibria(subject.log, run, subject.robot.sigma)
    except InputError:
        return []


def check_coverage(subject: Subject, equilibria: list[_core.Equilibrium]) -> None:
    """Counts different places at rest and in motion against the unknowns."""
    readings = _readings_in_sigma(subject)
    start = subject.run.start
    resting = _count_different(
        [_mean(readings[e.samples.begin - start : e.samples.end - start]) for e in equilibria]
    )
    if not _moves(readings):
        subject.add(
            "error",
            "too_few_poses",
            "the platform does not move in the run: a single pose says nothing about offsets",
            "visit more poses, or choose the right segment with --segment",
            whole=True,
        )
        return
    needed = _poses_needed(subject)
    if resting < needed:
        subject.add(
            "warning",
            "too_few_equilibria",
            f"the platform rests at {resting} different places; statics need at least {needed}",
            "dwell longer at each pose; --method kinematic needs no rest",
            whole=True,
        )


def _poses_needed(subject: Subject) -> int:
    """The fewest poses with as many equations as unknowns: after the reference each brings one
    equation a channel for its own six unknowns, and what is left pays for the six of ζ0."""
    channels = sum(bool(np.isfinite(channel.values).any()) for channel in subject.channels)
    surplus = channels - 6
    return 1 + math.ceil(6 / surplus) if surplus > 0 else 2


def _readings_in_sigma(subject: Subject) -> Floats:
    """Geometry channels [N, channels], in sigma; absent channels left out."""
    columns = [
        channel.values / channel.sigma
        for channel in subject.channels
        if channel.group != "tension_N" and np.isfinite(channel.values).any()
    ]
    return np.column_stack(columns) if columns else np.empty((subject.time_s.size, 0))


def _moves(readings: Floats) -> bool:
    """Whether some channel has two values, each for a hundredth of the run: no spike is a place."""
    seen = readings[:, np.isfinite(readings).any(axis=0)]
    if seen.size == 0:
        return False
    low, high = np.nanpercentile(seen, [1, 99], axis=0)
    noise = [_core.channel_noise(column) for column in seen.T]
    swings = high - low > _SWINGS_NOISE * np.array(noise)
    return bool((high - low > _DIFFERENT_SIGMA).any() or swings.sum() > 1)


def _mean(rows: Floats) -> Floats:
    """Mean of the finite entries of each column; NaN where there is none."""
    count = np.isfinite(rows).sum(axis=0)
    total = np.nansum(rows, axis=0)
    mean: Floats = np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)
    return mean


def _count_different(places: list[Floats]) -> int:
    kept: list[Floats] = []
    for place in places:
        if all(_differs(place, other) for other in kept):
            kept.append(place)
    return len(kept)


def _differs(a: Floats, b: Floats) -> bool:
    return bool(np.any(np.abs(a - b) > _DIFFERENT_SIGMA))
