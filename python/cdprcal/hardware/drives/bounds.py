"""What a session file may say about a robot: no value may switch a net off, alone or with others.

Every bound is one row of ``bounds``; so is the time in which the robot must be able to stop.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.hardware.drives.canopen_bus import HEARTBEATS_MISSED
from cdprcal.hardware.drives.supervision import CREEP_S, OVERLOAD, OVERSPEED
from cdprcal.hardware.drives.winch import torque_counts
from cdprcal.hardware.session import Session, Winch
from cdprcal.hardware.session.objects import object_type

#: Within this every fault must end at standstill.
LONGEST_STOP_S = 0.5
#: The procedure never wants more than a fifth of the robot's size per second (StartUp).
_SIZE_SHARE_1_S = 0.2
_SLACK = 1e-9  # of a bound: what sums of decimal fractions leave


class Bound(NamedTuple):
    """One value of a session and what it may be."""

    field: str
    value: float
    least: float
    most: float
    unit: str
    why: str


class Stop(NamedTuple):
    """How long after a fault a cable may still run, at worst."""

    reaction_s: float  #: until the slowest net notices
    time_s: float  #: until standstill
    distance_m: float  #: cable that runs until then


def stop_of(session: Session) -> Stop:
    """From the velocity limit, beyond it by what is not noticed, on the quick stop ramp."""
    reaction_s = max(
        (session.safety.missed_cycles + 1) * session.period_s,
        session.late_s,
        HEARTBEATS_MISSED * session.safety.heartbeat_s,
        session.ahrs_stale_s if session.ahrs is not None else 0.0,
    )
    velocity_m_s = OVERSPEED * session.limits.velocity_m_s
    ramp_s = velocity_m_s / session.limits.quick_stop_m_s2
    distance_m = velocity_m_s * (reaction_s + 0.5 * ramp_s)
    return Stop(reaction_s, reaction_s + ramp_s, distance_m)


#: A cable spans at most the frame, twice what robot_size_m is from the middle, and its height.
_MOST_TRAVEL_SIZES = 4.0


def robot_size_m(robot: _core.Robot) -> float:
    """Mean distance of the pulleys from their middle, as StartUp has it; 1 m with one cable."""
    pulleys_m = np.array([cable.pulley.position_m for cable in robot.cables])
    size_m = float(np.linalg.norm(pulleys_m - pulleys_m.mean(axis=0), axis=1).mean())
    return size_m if size_m > 1e-3 else 1.0


def bounds(session: Session, robot: _core.Robot) -> Iterator[Bound]:
    """What the values of a session may be with this robot."""
    limits, safety, period_s = session.limits, session.safety, session.period_s
    wanted_N = robot.tension_limits_N
    yield Bound(
        "limits.tension_N[#1]", limits.tension_N[0], 0.0, wanted_N[0], "N",
        "it may be less than the robot file's, but no cable pushes",
    )  # fmt: skip
    yield Bound(
        "limits.tension_N[#2]", limits.tension_N[1], wanted_N[1], (1.0 + OVERLOAD) * wanted_N[1],
        "N", "it may be a tenth above the robot file's",
    )  # fmt: skip
    yield Bound(
        "limits.velocity_m_s", limits.velocity_m_s, 0.0,
        2.0 * _SIZE_SHARE_1_S * robot_size_m(robot), "m/s",
        "twice what the start-up of a robot of this size ever needs",
    )  # fmt: skip
    yield Bound(
        "limits.quick_stop_m_s2", limits.quick_stop_m_s2, 0.0, robot.gravity_m_s2, "m/s²",
        "cables that stop faster than the platform falls go slack",
    )  # fmt: skip
    if limits.travel_m is not None:
        yield Bound(
            "limits.travel_m", limits.travel_m, 0.0, _MOST_TRAVEL_SIZES * robot_size_m(robot), "m",
            "no cable of a robot of this size goes further",
        )  # fmt: skip
    yield Bound(
        "safety.late_s", session.late_s, 0.0, (safety.missed_cycles + 1) * period_s, "s",
        "after missed_cycles + 1 cycles the drives stop by themselves",
    )  # fmt: skip
    yield Bound(
        "safety.heartbeat_s", safety.heartbeat_s, max(1e-3, period_s), math.inf, "s",
        "no more often than a cycle, nor than a millisecond",
    )  # fmt: skip
    stop = stop_of(session)
    yield Bound(
        "limits and safety: the time to stop", stop.time_s, 0.0, LONGEST_STOP_S, "s",
        f"{stop.reaction_s:.3g} s until the slowest of missed_cycles, late_s, heartbeat_s × "
        f"{HEARTBEATS_MISSED:g} and ahrs.stale_s notices, then the ramp of quick_stop_m_s2",
    )  # fmt: skip
    for at, winch in enumerate(session.winches):
        yield from _winch_bounds(f"winches[#{at + 1}]", winch, session)


def _winch_bounds(name: str, winch: Winch, session: Session) -> Iterator[Bound]:
    limits = session.limits
    fastest_m_s = OVERSPEED * limits.velocity_m_s
    yield Bound(
        f"{name}.counts_per_m", winch.counts_per_m, 1.0 / (CREEP_S * limits.velocity_m_s),
        2.0**31 / (fastest_m_s * session.period_s), "counts/m",
        "a count must be less than what a cable may creep at standstill, and a cycle less than "
        "half the range of 0x6064",
    )  # fmt: skip
    yield Bound(
        f"{name}: limits.velocity_m_s in units of 0x60FF", winch.velocity_scale *
        limits.velocity_m_s, 100.0, 2.0**31 - 1.0, "units",
        "it must fit the object, in steps of a hundredth or less",
    )  # fmt: skip
    yield Bound(
        f"{name}: limits.quick_stop_m_s2 in units of 0x6085", winch.deceleration_scale *
        limits.quick_stop_m_s2, 10.0, 2.0**32 - 1.0, "units",
        "it must fit the object, in steps of a tenth or less",
    )  # fmt: skip
    cell, kind = winch.load_cell, object_type(winch.load_cell.type)
    low, high = winch.load_cell_range
    for end, tension_N in zip(
        ("lower", "upper"),
        (limits.tension_N[0] * (1.0 - OVERLOAD), limits.tension_N[1] * (1.0 + OVERLOAD)),
        strict=True,
    ):
        counts = cell.zero_counts + cell.sign * cell.counts_per_N * tension_N
        yield Bound(
            f"{name}.load_cell at the {end} tension limit and a tenth", counts,
            max(low, kind.range[0]), min(high, kind.range[1]), "counts",
            "else the cell cannot show that it is passed",
        )  # fmt: skip
    if winch.torque is not None:
        most = abs(torque_counts(winch.torque, winch.sign, limits.tension_N[1]))
        yield Bound(
            f"{name}.torque at the upper tension limit", most, 100.0, 2.0**15 - 1.0, "‰ of rated",
            "it must fit 0x6071, in steps of a hundredth or less",
        )  # fmt: skip


def check_session(session: Session, robot: _core.Robot) -> None:
    """Raises InputError when a session is not of this robot, or says what it must not."""
    if session.robot != robot.name:
        raise InputError(
            f"session: is of robot {session.robot}, not of {robot.name}; "
            "give the session of this robot"
        )
    if len(session.winches) != robot.cable_count:
        raise InputError(
            f"session: has {len(session.winches)} winches, robot {robot.name} has "
            f"{robot.cable_count} cables; give one winch a cable"
        )
    if session.mode == "torque" and _core.holds_orientation(robot):
        raise InputError(
            f"session: mode: torque: motors that only pull do not hold the pose of {robot.name}, "
            f"which {robot.cable_count} cables lead by their lengths; use velocity"
        )
    for bound in bounds(session, robot):
        slack = _SLACK * max(abs(bound.value), 1.0)
        if not bound.least - slack <= bound.value <= bound.most + slack:
            most = f" to {bound.most:.4g}" if math.isfinite(bound.most) else " or more"
            raise InputError(
                f"session: {bound.field}: {bound.value:.4g} {bound.unit} must be "
                f"{bound.least:.4g}{most}: {bound.why}"
            )


__all__ = ["LONGEST_STOP_S", "Bound", "Stop", "bounds", "check_session", "stop_of"]
