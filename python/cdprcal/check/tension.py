"""Tensions: slack cables, saturated load cells, tensions outside the robot's limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdprcal.check.plausibility import report_marks
from cdprcal.check.subject import Channel, Flags, Subject, duration_s, longest_of, stretches
from cdprcal.io.marks import marks_in, without
from cdprcal.sensors import LOG_GROUPS
from cdprcal.terminal import counted

#: A cable counts as slack below this share of the least tension that the robot allows, …
_SLACK_SHARE = 0.5
#: … or of its weight, where no least tension is given; and always within the noise around zero.
_SLACK_WEIGHT_SHARE = 0.01
_NOISE_FACTOR = 3.0
#: A load cell is saturated when it repeats its largest reading this often …
_FEWEST_CLIPPED = 5
#: … although it repeats readings otherwise no more often than this.
_USUAL_REPEATS = 0.05


def check_tensions(subject: Subject) -> None:
    """Each load cell against the robot's limits and its own noise."""
    for channel in subject.channels:
        if channel.group == "tension_N" and np.isfinite(channel.values).any():
            if marks := marks_in(channel.values):
                report_marks(subject, channel, marks)
                channel = replace(channel, values=without(channel.values, marks))
            no_tension = _check_placeholder(subject, channel)
            channel = replace(channel, values=np.where(no_tension, np.nan, channel.values))
            slack = _check_slack(subject, channel)
            saturated = _check_saturated(subject, channel)
            _check_limits(subject, channel, ~(slack | saturated))
    _check_setpoints(subject)


def _lasting(subject: Subject, places: list[tuple[int, int]]) -> str:
    """How long, or of a list of rests at how many."""
    if subject.is_list:
        return f"at {counted(sum(end - begin for begin, end in places), 'rest')}"
    return f"for {duration_s(subject, places):.3g} s in {counted(len(places), 'interval')}"


def _slack_level_N(subject: Subject, channel: Channel) -> float:
    robot = subject.robot
    return max(
        _SLACK_SHARE * robot.tension_min_N,
        _SLACK_WEIGHT_SHARE * robot.weight_N,
        0.0 if subject.is_list else _NOISE_FACTOR * channel.noise,  # of a whole rest it is small
    )


def _check_placeholder(subject: Subject, channel: Channel) -> Flags:
    """One negative number again and again, where others never repeat: it stands for no reading."""
    flags = _repeated(-channel.values) & (channel.values < -_slack_level_N(subject, channel))
    places = stretches(flags)
    if np.count_nonzero(flags) < _FEWEST_CLIPPED:
        return np.zeros_like(flags)
    longest = longest_of(places)
    subject.add(
        "error",
        "impossible_value",
        f"{channel.name} is {channel.values[longest[0]]:g} N in "
        f"{counted(int(np.count_nonzero(flags)), 'sample')}: "
        "a cable cannot push",
        "does it stand for no reading? leave such cells empty",
        at=longest,
        channel=channel.name,
    )
    return flags


def _check_slack(subject: Subject, channel: Channel) -> Flags:
    level = _slack_level_N(subject, channel)
    with np.errstate(invalid="ignore"):
        flags = channel.values < level
    places = stretches(flags)
    if places:
        longest = longest_of(places)
        lasting = longest[1] - longest[0] > 1
        if np.nanmedian(channel.values) < -level:
            subject.add(
                "error",
                "impossible_value",
                f"{channel.name} is negative, {np.nanmedian(channel.values):.3g} N in the middle: "
                "a cable cannot push",
                "is the load cell's sign reversed, or its zero far off? in the canonical log "
                "the tension of a taut cable is positive",
                at=longest,
                channel=channel.name,
            )
            return flags
        subject.add(
            "error" if lasting else "warning",
            "slack",
            f"cable {_cable(channel)} is slack: {channel.name} is below {level:.3g} N "
            f"{_lasting(subject, places)}, down to {np.nanmin(channel.values):.3g} N",
            "a slack cable's length and swivel angle say nothing; raise its least tension and log "
            "again",
            at=longest,
            channel=channel.name,
        )
    return flags


def _check_saturated(subject: Subject, channel: Channel) -> Flags:
    values = channel.values
    with np.errstate(invalid="ignore"):
        flags = values >= subject.robot.tension_max_N
    for begin, end in stretches(_repeated(values), _FEWEST_CLIPPED):
        flags[begin:end] = True
    places = stretches(flags)
    if places:
        longest = longest_of(places)
        lasting = longest[1] - longest[0] > 1
        subject.add(
            "error" if lasting else "warning",
            "saturated_tension",
            f"{channel.name} is saturated at {np.nanmax(values):.4g} N "
            f"{_lasting(subject, places)} (limit {subject.robot.tension_max_N:g} N)",
            "the true tension is unknown there; lower the tensions or check the load cell's range",
            at=longest,
            channel=channel.name,
        )
    return flags


def _repeated(values: np.ndarray) -> Flags:
    """Samples that sit exactly on the channel's largest reading, where others seldom repeat."""
    top: Flags = values == np.nanmax(values)
    repeats = float(np.mean(np.diff(values[~top]) == 0)) if (~top).sum() > 1 else 1.0
    return top & (repeats <= _USUAL_REPEATS)


def _check_limits(subject: Subject, channel: Channel, rest: Flags) -> None:
    robot = subject.robot
    margin = _NOISE_FACTOR * channel.noise
    with np.errstate(invalid="ignore"):
        flags = rest & (channel.values < robot.tension_min_N - margin)
    places = stretches(flags)
    if places:
        subject.add(
            "warning",
            "tension_outside_limits",
            f"{channel.name} is below the robot's {robot.tension_min_N:g} N "
            f"{_lasting(subject, places)}, down to {np.min(channel.values[flags]):.3g} N",
            "check the set-points and the tension control",
            at=longest_of(places),
            channel=channel.name,
        )


def _check_setpoints(subject: Subject) -> None:
    robot = subject.robot
    setpoints = subject.log.tension_setpoint_N[subject.run]
    for i in range(setpoints.shape[1]):
        with np.errstate(invalid="ignore"):
            flags = (setpoints[:, i] < robot.tension_min_N) | (
                setpoints[:, i] > robot.tension_max_N
            )
        if places := stretches(flags):
            name = LOG_GROUPS["tension_setpoint_N"].column(i)
            subject.add(
                "warning",
                "setpoint_outside_limits",
                f"{name} is outside the robot's [{robot.tension_min_N:g}, "
                f"{robot.tension_max_N:g}] N for {duration_s(subject, places):.3g} s",
                "correct the set-points, or the limits in the robot file",
                at=places[0],
                channel=name,
            )


def _cable(channel: Channel) -> str:
    return channel.name.split("_")[1]
