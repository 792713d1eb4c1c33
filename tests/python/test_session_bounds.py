"""No value of a session switches a net off: each is bounded by the robot file."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cdprcal
from cdprcal import InputError
from cdprcal.hardware.drives.bounds import (
    LONGEST_STOP_S,
    Bound,
    bounds,
    check_session,
    robot_size_m,
    stop_of,
)
from cdprcal.hardware.session import Session, parse_session
from cdprcal.testing.simulated_devices.connect import SimulatedSession
from robots import small_plan
from winch_bus import EXAMPLE, example_session

_CELL = "counts_per_N: 1000, valid_counts: [-50000, 600000]"
#: What is written instead of what, and which field is named.
WRONG = {
    "tension low": ("[10, 420]", "[-1e9, 420]", r"limits\.tension_N\[#1\]: -1e\+09 N must be 0 to"),
    "tension high": ("[10, 420]", "[10, 1e9]", r"limits\.tension_N\[#2\]: 1e\+09 N must be 400 to"),
    "tension a little high": ("[10, 420]", "[10, 441]", r"441 N must be 400 to 440"),
    "narrower than the robot's": ("[10, 420]", "[10, 399]", r"399 N must be 400 to 440"),
    "velocity": ("velocity_m_s: 0.4", "velocity_m_s: 1e9", r"limits\.velocity_m_s: 1e\+09 m/s"),
    "velocity and ramp": (
        "velocity_m_s: 0.4, quick_stop_m_s2: 4", "velocity_m_s: 0.6, quick_stop_m_s2: 1e10",
        r"limits\.quick_stop_m_s2: 1e\+10 m/s² must be 0 to 9\.81",
    ),
    "no ramp": ("quick_stop_m_s2: 4", "quick_stop_m_s2: 1e-12", r"the time to stop: 5e\+11 s must"),
    "a slow ramp": ("quick_stop_m_s2: 4", "quick_stop_m_s2: 1", r"the time to stop: 0\.75 s must"),
    "late": ("brakes: true", "brakes: true, late_s: 1e9", r"safety\.late_s: 1e\+09 s must be 0 to"),
    "a little late": ("brakes: true", "brakes: true, late_s: 0.021", r"0\.021 s must be 0 to 0"),
    "heartbeats off": ("brakes: true", "brakes: true, heartbeat_s: 1e-4", r"safety\.heartbeat_s: "),
    "heartbeats rare": ("brakes: true", "brakes: true, heartbeat_s: 60", r"the time to stop: 150"),
    "AHRS": ("frame: ENU", "frame: ENU, stale_s: 100", r"the time to stop: 100\.1 s must be 0 to"),
    "coarse encoder": ("counts_per_m: 1e7", "counts_per_m: 100", r"\[#1\]\.counts_per_m: 100 "),
    "fine encoder": ("counts_per_m: 1e7", "counts_per_m: 1e13", r"winches\[#1\]\.counts_per_m: "),
    "velocity units": (
        "counts_per_m: 1e7", "counts_per_m: 1e7\n    velocity_units_per_m_s: 1",
        r"winches\[#1\]: limits\.velocity_m_s in units of 0x60FF: 0\.4 units must",
    ),
    "deceleration units": (
        "counts_per_m: 1e7", "counts_per_m: 1e7\n    deceleration_units_per_m_s2: 1e-3",
        r"winches\[#1\]: limits\.quick_stop_m_s2 in units of 0x6085: 0\.004 units must",
    ),
    "load cell": (_CELL, _CELL.replace("600", "450"), r"load_cell at the upper"),
    "load cell below": (_CELL, "counts_per_N: 1000, valid_counts: [9500, 600000]", r"at the lower"),
    "load cell saturates": (_CELL.split(",")[0] + ",", "counts_per_N: 1e7,", r"load_cell at the "),
    "torque": ("rated_torque_Nm: 2.4", "rated_torque_Nm: 0.01", r"\[#1\]\.torque at the upper"),
    "a giant's motor": ("rated_torque_Nm: 2.4", "rated_torque_Nm: 1000", r"torque at the upper"),
}  # fmt: skip


def changed(old: str, new: str) -> Session:
    text = EXAMPLE.read_text()
    assert old in text
    return parse_session(text.replace(old, new), "session")


@pytest.mark.parametrize("what", WRONG)
def test_a_value_that_switches_a_net_off_is_refused(what: str, robot: cdprcal.Robot) -> None:
    old, new, words = WRONG[what]
    with pytest.raises(InputError, match=r"^session: ") as error:
        check_session(changed(old, new), robot)
    assert re.search(words, str(error.value)), error.value


def test_it_is_refused_before_any_device_is_opened(robot: cdprcal.Robot) -> None:
    session = example_session(**{"velocity_m_s: 0.4": "velocity_m_s: 1e9"})
    with pytest.raises(InputError, match=r"limits\.velocity_m_s"):
        SimulatedSession.connect(session, robot, small_plan(robot), armed=True)


def test_the_example_is_within_all_bounds(robot: cdprcal.Robot) -> None:
    check_session(example_session(), robot)
    fields = [bound.field for bound in bounds(example_session(), robot)]
    assert len(fields) == len(set(fields)) == 7 + 4 * 6


#: Of the example: the value, the least and the most. The robot is 1.5714 m in size; a cable may run
#: a quarter above its limit for a cycle of 10 ms, or creep for as long as that takes 10 ms.
_SIZE_M = 1.5714055444283699
OF_THE_EXAMPLE = {
    "limits.tension_N[#1]": (10.0, 0.0, 20.0),
    "limits.tension_N[#2]": (420.0, 400.0, 440.0),
    "limits.velocity_m_s": (0.4, 0.0, 0.4 * _SIZE_M),
    "limits.quick_stop_m_s2": (4.0, 0.0, 9.81),
    "limits.travel_m": (2.0, 0.0, 4.0 * _SIZE_M),
    "safety.late_s": (0.01, 0.0, 0.02),
    "safety.heartbeat_s": (0.1, 0.01, math.inf),
    "limits and safety: the time to stop": (0.375, 0.0, 0.5),
    "winches[#1].counts_per_m": (1e7, 250.0, 2147483648.0 / 0.005),
    "winches[#1]: limits.velocity_m_s in units of 0x60FF": (4e6, 100.0, 0x7FFFFFFF),
    "winches[#1]: limits.quick_stop_m_s2 in units of 0x6085": (4e7, 10.0, 0xFFFFFFFF),
    "winches[#1].load_cell at the lower tension limit and a tenth": (9e3, -5e4, 6e5),
    "winches[#1].load_cell at the upper tension limit and a tenth": (4.62e5, -5e4, 6e5),
    "winches[#1].torque at the upper tension limit": (875.0, 100.0, 0x7FFF),
}


def test_every_bound_of_the_example(robot: cdprcal.Robot) -> None:
    found = bounds(changed("velocity_m_s: 0.4", "velocity_m_s: 0.4, travel_m: 2"), robot)
    first = {b.field: b[1:4] for b in found if not re.match(r"winches\[#[2-4]", b.field)}
    assert list(first) == list(OF_THE_EXAMPLE)
    for field, row in OF_THE_EXAMPLE.items():
        assert first[field] == pytest.approx(row, rel=1e-11), field


def test_the_object_bounds_a_cell_that_says_nothing_of_its_counts(robot: cdprcal.Robot) -> None:
    session = changed(_CELL, "counts_per_N: 1000")
    (cell,) = {
        (bound.least, bound.most)
        for bound in bounds(session, robot)
        if re.fullmatch(r"winches\[#1\]\.load_cell at the .*", bound.field)
    }
    assert cell == (1 - 2**31, 2**31 - 2)  # its ends are what a cell says that is broken


def test_a_session_of_another_robot_is_refused(robot: cdprcal.Robot) -> None:
    with pytest.raises(InputError, match="is of robot other, not of irma4; give the session of"):
        check_session(example_session().model_copy(update={"robot": "other"}), robot)
    session = example_session()
    fewer = session.model_copy(update={"winches": session.winches[:3]})
    with pytest.raises(InputError, match="has 3 winches, robot irma4 has 4 cables; give one winch"):
        check_session(fewer, robot)


def test_motors_that_only_pull_do_not_lead_a_pose_by_lengths() -> None:
    eight = cdprcal.load_robot("posts8")
    session = example_session()
    winches = [session.winches[0]] * 8
    with pytest.raises(
        InputError, match=r"mode: torque: .*hold the pose of posts8, which 8 cables"
    ):
        check_session(
            session.model_copy(update={"robot": "posts8", "winches": winches, "mode": "torque"}),
            eight,
        )
    # In mode velocity something else is in the way: this robot's tensions are others.
    with pytest.raises(InputError) as other:
        check_session(session.model_copy(update={"robot": "posts8", "winches": winches}), eight)
    assert "mode" not in str(other.value)
    # And a robot whose pose hangs on its tensions may be led by them.
    check_session(session.model_copy(update={"mode": "torque"}), cdprcal.load_robot("irma4"))


def test_the_size_of_a_robot_whose_pulleys_are_in_one_place() -> None:
    robot = cdprcal.load_robot("irma4")
    assert robot_size_m(robot) == pytest.approx(_SIZE_M, rel=1e-9)

    def at(*places_m: float) -> Any:
        pulleys = [SimpleNamespace(position_m=np.array([x, 1.0, 2.0])) for x in places_m]
        return SimpleNamespace(cables=[SimpleNamespace(pulley=pulley) for pulley in pulleys])

    assert robot_size_m(at(3.0, 3.0)) == 1.0
    assert robot_size_m(at(3.0, 3.0024)) == pytest.approx(0.0012)


def test_sums_of_decimal_fractions_may_miss_a_bound_by_their_rounding(robot: cdprcal.Robot) -> None:
    def passes(value: float) -> bool:
        session = example_session()
        limits = session.limits.model_copy(update={"tension_N": (10.0, value)})
        try:
            check_session(session.model_copy(update={"limits": limits}), robot)
        except InputError:
            return False
        return True

    assert passes(440.0 * (1.0 + 0.5e-9))
    assert not passes(440.0 * (1.0 + 2e-9))
    assert passes(400.0 * (1.0 - 0.5e-9))
    assert not passes(400.0 * (1.0 - 2e-9))


def test_what_lies_on_a_bound_is_within(robot: cdprcal.Robot) -> None:
    check_session(changed("[10, 420]", "[0, 440]"), robot)
    check_session(changed("[10, 420]", "[20, 400]"), robot)
    check_session(changed("brakes: true", "brakes: true, late_s: 0.02"), robot)


def test_time_and_distance_to_stop() -> None:
    """0.1 s of heartbeats, two and a half of them; a quarter above 0.4 m/s; 4 m/s²."""
    stop = stop_of(example_session())
    assert stop.reaction_s == pytest.approx(0.25)
    assert stop.time_s == pytest.approx(0.25 + 0.5 / 4.0)
    assert stop.distance_m == pytest.approx(0.5 * 0.25 + 0.5**2 / (2.0 * 4.0))
    faster = stop_of(changed("brakes: true", "brakes: true, heartbeat_s: 0.01"))
    assert faster.reaction_s == pytest.approx(0.025)
    silent = stop_of(changed("frame: ENU", "frame: ENU, stale_s: 0.3"))
    assert silent.reaction_s == pytest.approx(0.3)
    missed = stop_of(changed("brakes: true", "brakes: true, missed_cycles: 10, heartbeat_s: 0.01"))
    assert missed.reaction_s == pytest.approx(0.11)  # the AHRS may be silent for 0.105
    late = stop_of(changed("brakes: true", "brakes: true, late_s: 0.03, heartbeat_s: 0.01"))
    assert late.reaction_s == pytest.approx(0.03)


def test_without_an_ahrs_nobody_waits_for_it() -> None:
    session = changed("frame: ENU", "frame: ENU, stale_s: 0.3")
    assert stop_of(session).reaction_s == pytest.approx(0.3)
    assert stop_of(session.model_copy(update={"ahrs": None})).reaction_s == pytest.approx(0.25)


def test_heartbeats_are_no_more_often_than_a_millisecond(robot: cdprcal.Robot) -> None:
    session = changed("\nrate_Hz: 100", "\nrate_Hz: 1000")
    (least,) = (b.least for b in bounds(session, robot) if b.field == "safety.heartbeat_s")
    assert least == 0.001


def test_the_size_is_that_of_the_start_up(robot: cdprcal.Robot) -> None:
    """Whose velocity limit is a fifth of it per second."""
    tensions = cdprcal.parse_plan(cdprcal.format_plan(small_plan(robot)), "plan").start_tension_N
    startup = cdprcal.StartUp(robot, cdprcal.StartUpPlan([tensions]))
    assert robot_size_m(robot) == pytest.approx(5.0 * startup.velocity_limit_m_s)


@settings(max_examples=300, deadline=None)
@given(
    velocity=st.floats(1e-9, 1e12),
    ramp=st.floats(1e-12, 1e12),
    late=st.floats(1e-9, 1e12),
    heartbeat=st.floats(1e-9, 1e12),
    missed=st.integers(0, 10),
)
def test_whatever_passes_stops_in_time(
    velocity: float, ramp: float, late: float, heartbeat: float, missed: int
) -> None:
    robot = cdprcal.load_robot("irma4")
    session = example_session()
    limits = session.limits.model_copy(update={"velocity_m_s": velocity, "quick_stop_m_s2": ramp})
    safety = session.safety.model_copy(
        update={"late_s": late, "heartbeat_s": heartbeat, "missed_cycles": missed}
    )
    session = session.model_copy(update={"limits": limits, "safety": safety})
    try:
        check_session(session, robot)
    except InputError:
        return
    assert 1.25 * velocity / ramp + late <= LONGEST_STOP_S + 1e-6
    assert round(1e3 * heartbeat) in range(1, 200)
    assert round(1e7 * ramp) > 0


def test_bounds_are_ordered(robot: cdprcal.Robot) -> None:
    for bound in bounds(example_session(), robot):
        assert isinstance(bound, Bound)
        assert bound.least < bound.most
        assert math.isfinite(bound.value)
