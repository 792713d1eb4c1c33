"""Sensors that are absent, that drop out, or that are stuck."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from cdprcal import _core
from cdprcal.check.signals import SignalReport
from cdprcal.check.subject import Channel, Floats, Subject, duration_s, longest_of, stretches
from cdprcal.sensors import SENSORS, columns_of
from cdprcal.terminal import counted, listed

#: Of readings that a pose rests on; how fast it moves is no part of it.
_UNITS_OF_POSES = ("m", "rad", "N")
#: A channel is stuck when it repeats one value while the others move by this many sigma.
_MOVED_SIGMA = 5.0
_FEWEST_REPEATS = 10
#: With which a run of a sound sensor has readings that are the same for so long.
_CHANCE = 1e-3
#: A pose has so many numbers, of which all readings are functions.
_OF_A_POSE = 6
#: More samples than these say no more about how a channel goes with the others.
_MOST_ROWS = 2000


def _told_otherwise(subject: Subject) -> set[str]:
    """Groups that nothing is lost without: whole lengths are read, or nothing turns."""
    out = set()
    for group, sensor in SENSORS.items():
        whole = sensor.is_absolute and sensor.is_per_cable and sensor.unit == "m"
        if whole and np.isfinite(getattr(subject.log, group)[subject.run]).any():
            out.add("length_m")
    if "R" not in subject.robot.platform.motion:
        out.add("roll_pitch_yaw_rad")
    return out


def check_presence(subject: Subject) -> None:
    """Whole groups and single channels without a reading in the run, and dropouts."""
    told_otherwise = _told_otherwise(subject)
    present, absent = [], []
    for group, sensor in SENSORS.items():
        matrix: Floats = getattr(subject.log, group)[subject.run]
        read = np.isfinite(matrix)
        if read.any():
            present.append(group)
            for i, name in enumerate(columns_of(sensor, subject.robot.cable_count)):
                _check_channel(subject, name, read[:, i] if i < read.shape[1] else None)
        elif not sensor.is_absolute and group not in told_otherwise:
            absent.append(group)
    held = [group for group in present if SENSORS[group].unit in _UNITS_OF_POSES]
    if absent and held:
        _report_absent(subject, absent, held)
    absolute = [group for group, sensor in SENSORS.items() if sensor.is_absolute]
    if not {"length_m", "swivel_rad", *absolute} & set(present):
        subject.add(
            "error",
            "missing_sensor",
            "neither cable lengths nor swivel angles were read",
            "at least one of them must be logged to calibrate anything",
            whole=True,
        )


def _report_absent(subject: Subject, absent: list[str], held: list[str]) -> None:
    """Which groups have no reading, in one finding: what the pose rests on then."""
    sensors = [SENSORS[group] for group in held]
    words = [sensor.in_words + "s" * sensor.is_per_cable for sensor in sensors]
    subject.add(
        "warning",
        "missing_sensor",
        f"no {' and no '.join(SENSORS[group].in_words for group in absent)} was read in the run",
        f"the pose rests on {listed(words)} alone"
        + (", without statics" if "tension_N" in absent else ""),
        whole=True,
        channel=absent[0] if len(absent) == 1 else None,
    )


def _check_channel(subject: Subject, name: str, read: np.ndarray | None) -> None:
    if read is None or not read.any():
        subject.add(
            "warning",
            "missing_sensor",
            f"{name} was never read in the run",
            "check the sensor and its cable; the other channels are used",
            whole=True,
            channel=name,
        )
        return
    dropouts = stretches(~read)
    if dropouts:
        subject.add(
            "warning",
            "dropout",
            f"{name} drops out {counted(len(dropouts), 'time')}, "
            f"{duration_s(subject, dropouts):.3g} s in all",
            "poses in these intervals do without this channel",
            at=longest_of(dropouts),
            channel=name,
        )


def check_stuck(subject: Subject, signals: Sequence[SignalReport]) -> None:
    """A reading that repeats one value while the others say that the platform moves.

    A length stands still with its winch, however the platform swings: other lengths must move.
    What reads in steps beside which its noise does not show may well repeat: it is stuck when the
    others say that it should have left its step.
    """
    for channel in subject.channels:
        coarse = []
        for begin, end in _constant_stretches(subject, channel):
            if not (
                _movement(subject, channel, begin, end) > _MOVED_SIGMA
                and _winches(subject, channel, begin, end) > _MOVED_SIGMA
            ):
                continue
            step = _step_that_repeats(subject, channel, begin, end)
            if step and not _left_its_step(subject, channel, begin, end, step):
                coarse.append((begin, end, step))
                continue
            subject.add(
                "error",
                "stuck_sensor",
                f"{channel.name} repeats {channel.values[begin]:g} from "
                f"{subject.time_s[begin]:g} s to {subject.time_s[end - 1]:g} s while the "
                "platform moves",
                "check the sensor; leave its cells empty to calibrate without it",
                at=(begin, end),
                channel=channel.name,
            )
        if not coarse:
            continue
        begin, end, step = max(coarse, key=lambda stretch: stretch[1] - stretch[0])
        told = (s.signal.resolution for s in signals if s.channel.sensor.field == channel.group)
        if not any(math.isclose(step, resolution, rel_tol=0.1) for resolution in told):
            unit = SENSORS[channel.group].unit
            subject.add(
                "info",
                "coarse_sensor",
                f"{channel.name} reads in steps of {step:.3g} {unit}, coarser than its noise",
                "look for a finer range or format of the sensor; a mean of its readings may be "
                f"off by {step / 2.0:.3g} {unit}",
                at=(begin, end),
                channel=channel.name,
            )


def _step_that_repeats(subject: Subject, channel: Channel, begin: int, end: int) -> float:
    """The step of the channel's readings where a steady one may repeat for as long as this; else 0.

    Step and noise are those of all other samples, where the sensor works.
    """
    rows = channel.fresh
    within = (rows >= begin) & (rows < end)
    values = channel.values[rows[~within]]
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    if not steps.size:
        return 0.0
    step = float(np.median(steps))
    square = _core.channel_noise(values, channel.is_angle) ** 2 - step**2 / 12.0
    once = math.erf(step / math.sqrt(8.0 * square)) if square > 0.0 else 1.0
    return step if once ** int(within.sum()) * subject.time_s.size > _CHANCE else 0.0


def _left_its_step(subject: Subject, channel: Channel, begin: int, end: int, step: float) -> bool:
    """Whether the other channels say that this one should not have repeated its reading there.

    By how they went together in the rest of the run: linear in all others, and again with what six
    principal components of them, as a pose has numbers, add when they are squared. Both must say
    so: what one of them makes up where the run has not been before, the other does not.
    """
    usual = [
        other.unwrapped / other.sigma
        for other in subject.channels
        if other is not channel and np.isfinite(other.values).mean() > 0.5
    ]
    if not usual:
        return False
    others, values = np.column_stack(usual), channel.unwrapped / channel.sigma
    known = np.flatnonzero(np.isfinite(others).all(axis=1) & np.isfinite(values))
    within = (known >= begin) & (known < end)
    here, elsewhere = known[within], known[~within]
    if not (here.size and elsewhere.size):
        return False
    here, elsewhere = (rows[:: 1 + rows.size // _MOST_ROWS] for rows in (here, elsewhere))
    rows = np.concatenate([elsewhere, here])
    others, values = others[rows] - others[elsewhere].mean(axis=0), values[rows]
    _, size, axes = np.linalg.svd(others - others.mean(axis=0), full_matrices=False)
    spread = np.maximum(size / math.sqrt(rows.size), 1.0)[:_OF_A_POSE]
    pose = others @ axes[:_OF_A_POSE].T / spread
    i, j = np.triu_indices(pose.shape[1])
    linear = np.column_stack([np.ones(rows.size), others])
    quadratic = np.column_stack([linear, pose[:, i] * pose[:, j]])
    return all(
        _left(terms, values, elsewhere.size, step / channel.sigma) for terms in (linear, quadratic)
    )


def _left(terms: Floats, values: Floats, fitted: int, step: float) -> bool:
    """Whether a value after the first so many, by a fit of these, should be off by more than half a
    step; the uncertainty of the fit counts. All in sigma."""
    known, new = terms[:fitted], terms[fitted:]
    # Each coefficient is taken for 0 as firmly as one reading would say so.
    normal = known.T @ known + np.eye(terms.shape[1])
    found = np.linalg.solve(normal, known.T @ values[:fitted])
    left = values[:fitted] - known @ found
    leverage = np.sum(new * np.linalg.solve(normal, new.T).T, axis=1)
    square = left @ left / max(fitted - found.size, 1) + step**2 / 12.0
    off = np.abs(new @ found - values[fitted:]) - 0.5 * step
    return bool((off > _MOVED_SIGMA * np.sqrt(square * (1.0 + leverage))).any())


def _constant_stretches(subject: Subject, channel: Channel) -> list[tuple[int, int]]:
    same = np.concatenate([channel.values[1:] == channel.values[:-1], [False]])
    window = _core.DetectionOptions().window_s
    found = []
    for begin, end in stretches(same, _FEWEST_REPEATS - 1):
        if subject.time_s[end] - subject.time_s[begin] >= window:
            found.append((begin, end + 1))
    return found


def _winches(subject: Subject, stuck: Channel, begin: int, end: int) -> float:
    """Largest span of the other lengths, in sigma; infinite for what is no length, or the only."""
    own = [channel for channel in subject.channels if channel.group == stuck.group]
    if SENSORS[stuck.group].unit != "m" or len(own) != subject.robot.cable_count:
        return math.inf
    return max(_spans(own, stuck, begin, end), default=math.inf)


def _movement(subject: Subject, stuck: Channel, begin: int, end: int) -> float:
    """Median span of the other channels, in sigma."""
    spans = _spans(subject.channels, stuck, begin, end)
    return float(np.median(spans)) if spans else 0.0


def _spans(channels: Iterable[Channel], stuck: Channel, begin: int, end: int) -> list[float]:
    """How far all but one were apart over these samples, in sigma, where they were read."""
    return [
        float(np.ptp(values)) / channel.sigma
        for channel in channels
        if channel is not stuck
        and (values := channel.values[begin:end][np.isfinite(channel.values[begin:end])]).size
    ]
