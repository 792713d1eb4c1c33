"""Sensors that are absent, that drop out, or that are stuck."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from cdprcal import _core
from cdprcal.check.signals import SignalReport
from cdprcal.check.subject import (
    Channel,
    Floats,
    Subject,
    duration_s,
    stretches,
)
from cdprcal.sensors import SENSORS, columns_of

_WITHOUT = {
    "length_m": "the pose rests on swivel angles, attitude and tensions alone",
    "swivel_rad": "the pose rests on lengths, attitude and tensions alone",
    "tension_N": "the pose rests on lengths, swivel angles and attitude alone, without statics",
    "roll_pitch_yaw_rad": "roll, pitch and yaw come from the cables alone",
}
#: A channel is stuck when it repeats one value while the others move by this many sigma.
_MOVED_SIGMA = 5.0
_FEWEST_REPEATS = 10
#: With which a run of a sound load cell has readings that are the same for so long.
_CHANCE = 1e-3


def check_presence(subject: Subject) -> None:
    """Whole groups and single channels without a reading in the run, and dropouts."""
    present = {}
    for group, sensor in SENSORS.items():
        matrix: Floats = getattr(subject.log, group)[subject.run]
        read = np.isfinite(matrix)
        present[group] = bool(read.any())
        if not present[group] and sensor.is_absolute:
            continue
        if not present[group]:
            subject.add(
                "warning",
                "missing_sensor",
                f"no {sensor.in_words} was read in the run",
                _WITHOUT[group],
                begin=0,
                end=subject.time_s.size,
                channel=group,
            )
            continue
        for i, name in enumerate(columns_of(sensor, subject.robot.cable_count)):
            _check_channel(subject, name, read[:, i] if i < read.shape[1] else None)
    absolute = [group for group, sensor in SENSORS.items() if sensor.is_absolute]
    if not any(present[group] for group in ("length_m", "swivel_rad", *absolute)):
        subject.add(
            "error",
            "missing_sensor",
            "neither cable lengths nor swivel angles were read",
            "at least one of them must be logged to calibrate anything",
            begin=0,
            end=subject.time_s.size,
        )


def _check_channel(subject: Subject, name: str, read: np.ndarray | None) -> None:
    if read is None or not read.any():
        subject.add(
            "warning",
            "missing_sensor",
            f"{name} was never read in the run",
            "check the sensor and its cable; the other channels are used",
            begin=0,
            end=subject.time_s.size,
            channel=name,
        )
        return
    dropouts = stretches(~read)
    if dropouts:
        longest = max(dropouts, key=lambda r: r[1] - r[0])
        subject.add(
            "warning",
            "dropout",
            f"{name} drops out {len(dropouts)} times, {duration_s(subject, dropouts):.3g} s in all",
            "poses in these intervals do without this channel",
            begin=longest[0],
            end=longest[1],
            channel=name,
        )


def check_stuck(subject: Subject, signals: Iterable[SignalReport]) -> None:
    """A reading that repeats one value while the others say that the platform moves.

    A length stands still with its winch, however the platform swings: other lengths must move. A
    tension may be held meanwhile: its readings are stuck when their own noise would have shown.
    """
    tension = next((s for s in signals if s.channel.name == "balance"), None)
    for channel in subject.channels:
        for begin, end in _constant_stretches(subject, channel):
            held = tension if channel.group == "tension_N" else None
            if held and held.repeats(end - begin) * subject.time_s.size > _CHANCE:
                continue
            if (
                _movement(subject, channel, begin, end) > _MOVED_SIGMA
                and _winches(subject, channel, begin, end) > _MOVED_SIGMA
            ):
                subject.add(
                    "error",
                    "stuck_sensor",
                    f"{channel.name} repeats {channel.values[begin]:g} from "
                    f"{subject.time_s[begin]:g} s to {subject.time_s[end - 1]:g} s while the "
                    "platform moves",
                    "check the sensor; leave its cells empty to calibrate without it",
                    begin=begin,
                    end=end,
                    channel=channel.name,
                )


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
