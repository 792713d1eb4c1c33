"""Readings that no robot of this kind can produce: out of range, or faster than physics."""

from __future__ import annotations

import math

import numpy as np

from cdprcal import _core
from cdprcal.check.subject import Channel, Flags, Floats, Subject, stretches
from cdprcal.io.marks import marks_in
from cdprcal.sensors import SENSORS, feels_gravity

#: A cable cannot change its length by more than this many times the pulleys' largest distance.
_MOST_FRAME_SIZES = 3.0
#: Second differences beyond this many times the channel's own noise are no noise.
_NOISE_FACTOR = 15.0
#: … and beyond this many times what the same channel does otherwise stand out.
_USUAL_FACTOR = 5.0
_USUAL_QUANTILE = 0.99
_REGULAR_PERIODS = 1.5
#: A step bends its channel at two samples, a single wrong reading at three; what bends it at more
#: of the samples around is a vibration, of a loose cable or of the pulley on it.
_BENDS_OF_A_FAULT = 3
#: The median of so many steps is the motion that a single wrong reading stands out of.
_TREND_STEPS = 7
_AROUND = 8


def check_ranges(subject: Subject) -> None:
    """Angles and lengths beyond what the geometry allows."""
    frame = _core.robot_size_m(subject.robot)
    for channel in subject.channels:
        values = channel.values
        if not np.isfinite(values).any():
            continue
        if channel.name in ("roll_rad", "pitch_rad"):
            # Some sensors count from 0 to 360°, which is harmless. Degrees go beyond that, or pass
            # through what no platform reaches.
            turned = np.nanmax(np.abs(values)) <= 2.0 * math.pi
            angle = _wrapped(values) if turned else values
            angle = np.abs(angle)
            if turned and np.nanmin(angle) > math.pi / 2.0:
                _report_upside_down(subject, channel)
                angle = math.pi - angle
            _check_limit(subject, channel, angle, math.pi / 2, "the platform would lie on its side")
        elif channel.is_angle:
            limit = math.pi if channel.name == "yaw_rad" else 2 * math.pi
            change = np.abs(channel.unwrapped - _first(values))
            _check_limit(subject, channel, change, limit, "relative to its first reading")
        elif channel.group == "length_m" and frame > 0:
            change = np.abs(values - _first(values))
            _check_limit(
                subject, channel, change, _MOST_FRAME_SIZES * frame, "relative to its first reading"
            )


def check_gravity(subject: Subject) -> None:
    """What an accelerometer reads: gravity, most of the time."""
    read = subject.log.specific_force_m_s2[subject.run]
    gravity = subject.robot.gravity_m_s2
    if feels_gravity(read, gravity):
        return
    middle = float(np.nanmedian(np.linalg.norm(read, axis=1)))
    subject.add(
        "error",
        "impossible_value",
        f"the specific force is {middle:.3g} m/s2 in the middle, where gravity alone is "
        f"{gravity:.3g}",
        "log what the accelerometer reads, gravity included, in m/s2 (a mapping file turns units)",
        at=(0, 1),
        channel="specific_force_x_m_s2",
    )


def _report_upside_down(subject: Subject, channel: Channel) -> None:
    subject.add(
        "warning",
        "upside_down",
        f"{channel.name} is around half a turn all along: the platform's frame and the attitude "
        "sensor have opposite z axes",
        "fine where the robot file has its anchors in a frame whose z points down; otherwise turn "
        "the readings over",
        at=(0, 1),
        channel=channel.name,
    )


def _check_limit(
    subject: Subject, channel: Channel, values: Floats, limit: float, why: str
) -> None:
    with np.errstate(invalid="ignore"):
        beyond = stretches(values > limit)
    if not beyond:
        return
    if marks := marks_in(channel.values):
        report_marks(subject, channel, marks)
        return
    unit = "rad" if channel.is_angle else "m"
    worst = float(np.nanmax(values))
    remedy = (
        f"is it in degrees? the canonical log has radians ({channel.name})"
        if channel.is_angle
        else f"is it in millimetres? the canonical log has metres ({channel.name})"
    )
    subject.add(
        "error",
        "impossible_value",
        f"{channel.name} reaches {worst:.4g} {unit}, beyond {limit:.3g} {unit} ({why})",
        remedy,
        at=beyond[0],
        channel=channel.name,
    )


def report_marks(subject: Subject, channel: Channel, marks: dict[int, int]) -> None:
    """That numbers of a channel (how often each stands in it) are no readings."""
    said = ", ".join(f"{mark} ({count} times)" for mark, count in marks.items())
    subject.add(
        "error",
        "missing_mark",
        f"{channel.name} holds {said}, far from all that is read beside it: it seems to say that "
        "nothing was read",
        f"leave these cells empty, or give a mapping file with missing: {list(marks)}",
        at=stretches(np.isin(channel.values, list(marks)))[0],
        channel=channel.name,
    )


def check_jumps(subject: Subject) -> None:
    """Changes faster than gravity can move the platform, and changes unlike all others.

    A platform that hangs on cables cannot fall faster than g, nor turn faster than g on the
    lever of its own size. What stays below that but far above the rest of the run is a warning.
    """
    lever_m = _core.characteristic_length_m(subject.robot)
    gravity = subject.robot.gravity_m_s2
    for channel in subject.channels:
        if channel.group == "tension_N" or SENSORS[channel.group].is_inertial:
            continue
        # A sensor that is held stands still, then jumps: from one fresh reading to the next.
        index = channel.fresh[np.isfinite(channel.values[channel.fresh])]
        if index.size < 5:
            continue
        time = subject.time_s[index]
        values = channel.values[index]
        limit = gravity / lever_m if channel.is_angle else gravity
        impossible, unusual, second = _second_differences(time, values, limit, channel)
        spikes = _stand_alone(values, impossible, channel.is_angle)
        if spikes.any():
            _report_spikes(subject, channel, index, spikes)
            beside = np.convolve(spikes, np.ones(3), "same") > 0
            impossible &= ~beside
            unusual &= ~beside
        rings = _rings(impossible, second)
        if rings.any():
            _report_vibration(subject, channel, index, rings)
            impossible &= ~rings
            unusual &= ~rings
        _report_jumps(subject, channel, index, impossible, error=True)
        if not impossible.any():
            _report_jumps(subject, channel, index, unusual, error=False)


def _second_differences(
    time: Floats, values: Floats, acceleration_limit: float, channel: Channel
) -> tuple[Flags, Flags, Floats]:
    """Where the channel bends impossibly, where unusually, and how much, a value a sample."""
    steps = np.diff(time)
    change = np.diff(values)
    if channel.is_angle:
        change = _wrapped(change)
    rate = change / steps
    span = np.maximum(steps[1:], steps[:-1])
    second = np.abs(np.diff(rate)) * span
    # Time stamps that jitter make a steady motion look jerky by rate × jitter.
    jitter = float(np.median(np.abs(steps - np.median(steps))))
    uneven = span / np.minimum(steps[1:], steps[:-1])  # noise over a short step is a high rate
    usual_rate = np.lib.stride_tricks.sliding_window_view(
        np.pad(np.abs(rate), _TREND_STEPS // 2, mode="edge"), _TREND_STEPS
    )
    usual_rate = np.median(usual_rate, axis=1)
    around = np.maximum(usual_rate[1:], usual_rate[:-1])
    moving = np.maximum(np.minimum(np.abs(rate[1:]), np.abs(rate[:-1])), around)
    slack = (_NOISE_FACTOR * channel.noise + 10.0 * jitter * moving) * uneven
    # A continuous acceleration a shows as a·Δt²; one that sets in shows as no more.
    impossible = second > acceleration_limit * span**2 + slack
    usual = float(np.quantile(second, _USUAL_QUANTILE))
    regular = span <= _REGULAR_PERIODS * np.median(steps)  # across a dropout anything may happen
    unusual = regular & (second > np.maximum(_USUAL_FACTOR * usual, slack))
    pad = [False]
    return (
        np.concatenate([pad, impossible, pad]),
        np.concatenate([pad, unusual, pad]),
        np.concatenate([[0.0], second, [0.0]]),
    )


def _stand_alone(values: Floats, impossible: Flags, angles: bool) -> Flags:
    """Single readings far from where those around them lead: no motion, and nothing lasts."""
    steps = np.diff(values)
    if angles:
        steps = _wrapped(steps)
    around = np.pad(steps, _TREND_STEPS // 2, mode="edge")
    steps -= np.median(np.lib.stride_tricks.sliding_window_view(around, _TREND_STEPS), axis=1)
    there, back = steps[:-1], steps[1:]
    alone = (there * back < 0) & (np.abs(there + back) < 0.3 * np.minimum(abs(there), abs(back)))
    return np.logical_and(impossible, np.pad(alone, 1))


def _report_spikes(subject: Subject, channel: Channel, index: np.ndarray, spikes: Flags) -> None:
    samples = index[spikes]
    subject.add(
        "warning",
        "spike",
        f"{samples.size} single {'reading' if samples.size == 1 else 'readings'} of {channel.name} "
        f"stand{'s' if samples.size == 1 else ''} out of those before and after, first at "
        f"{subject.time_s[samples[0]]:g} s",
        "look for a loose plug or interference; calibrate and diagnose leave such readings out",
        at=(int(samples[0]), int(samples[0]) + 1),
        channel=channel.name,
    )


def _rings(impossible: Flags, second: Floats) -> Flags:
    """Which of the impossible bends are part of a vibration: many as strong ones are around."""
    rings = np.zeros_like(impossible)
    for i in np.flatnonzero(impossible):
        around = second[max(0, i - _AROUND) : i + _AROUND + 1]
        rings[i] = np.count_nonzero(around > 0.4 * second[i]) > _BENDS_OF_A_FAULT
    return rings


def _report_vibration(subject: Subject, channel: Channel, index: np.ndarray, rings: Flags) -> None:
    places = stretches(rings)
    first = int(index[places[0][0]])
    subject.add(
        "warning",
        "vibration",
        f"{channel.name} vibrates, faster than the platform can move, {len(places)} times, first "
        f"at {subject.time_s[first]:g} s",
        "look for a slack cable or a loose pulley; samples at rest do not mind",
        at=(first, first + 1),
        channel=channel.name,
    )


def _report_jumps(
    subject: Subject, channel: Channel, index: np.ndarray, flags: Flags, *, error: bool
) -> None:
    places = stretches(flags)
    if not places:
        return
    samples = [int(index[_steepest(channel.values[index], begin, end)]) for begin, end in places]
    times = ", ".join(f"{subject.time_s[i]:g} s" for i in samples[:5])
    more = "" if len(samples) <= 5 else f" and {len(samples) - 5} more"
    message = (
        f"{channel.name} jumps faster than the platform can fall at {times}{more}"
        if error
        else f"{channel.name} changes more suddenly than anywhere else at {times}{more}"
    )
    subject.add(
        "error" if error else "warning",
        "jump" if error else "sudden_change",
        message,
        "look for a slipping cable, a lost encoder count or a loose plug; poses before and after "
        "do not share one offset",
        at=(samples[0], samples[0] + 1),
        channel=channel.name,
    )


def _steepest(values: Floats, begin: int, end: int) -> int:
    """The sample after the largest step among those around [begin, end)."""
    low = max(begin, 1)
    steps = np.abs(np.diff(values[low - 1 : end + 1]))
    return low + int(np.argmax(steps))


def _wrapped(angles: Floats) -> Floats:
    return (angles + math.pi) % (2.0 * math.pi) - math.pi


def _first(values: Floats) -> float:
    return float(values[np.isfinite(values)][0])
