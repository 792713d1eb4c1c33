"""The rules that watch winches, one by one, at their limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

import cdprcal
from cdprcal import Robot
from cdprcal.hardware import BackendError
from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.cia402 import State
from cdprcal.hardware.drives.guard import Guard, torque_range
from cdprcal.hardware.drives.plausibility import Plausibility, efficiency_of
from cdprcal.hardware.drives.process_data import Values, layouts, split_into_pdos
from cdprcal.hardware.drives.supervision import (
    Path,
    Phase,
    Pull,
    Still,
    Supervisor,
    Travel,
    creep_m,
)
from cdprcal.hardware.drives.wiggle import Responses, _of_mean
from cdprcal.hardware.drives.winch import WinchState, torque_counts
from cdprcal.hardware.session import Session
from cdprcal.testing.simulated_devices.canopen_node import DriveNode
from cdprcal.testing.simulated_devices.connect import SimulatedSession
from cdprcal.testing.simulated_devices.faults import Fault, forgetting, without
from winch_bus import example_session, torque_session

CREEP_M = 0.004 + 2e-7  # 10 ms at 0.4 m/s, two counts


def winches(session: Session) -> list[WinchState]:
    return [WinchState(winch, session) for winch in session.winches]


def image(session: Session, **changes: object) -> dict[int, Values]:
    """Inputs of all nodes: enabled, mode 9, 100 N, position 0; changes as ``n2={key: value}``."""
    values: dict[int, Values] = {}
    for winch in session.winches:
        assert winch.torque is not None
        values[winch.node] = {
            cia402.STATUSWORD: cia402.statusword_of(State.enabled),
            cia402.MODE_DISPLAY: cia402.CSV,
            cia402.ERROR_CODE: 0,
            cia402.POSITION: 0,
            cia402.TORQUE: round(torque_counts(winch.torque, winch.sign, 100.0)),
            (0x2401, 1): 100_000,
            (0x60E4, 2): 0,
        }
    for name, change in changes.items():
        assert isinstance(change, dict)
        values[int(name[1:])] |= change
    return values


def all_in_torque() -> dict[str, Any]:
    """Changes for ``image``: all drives show torque mode."""
    return {f"n{n}": {cia402.MODE_DISPLAY: cia402.CST} for n in range(1, 5)}


class Watched:
    """A supervisor that is shown cycles."""

    def __init__(self, session: Session | None = None, phase: Phase = Phase.running) -> None:
        self.session = session or example_session()
        self.states = winches(self.session)
        self.supervisor = Supervisor(self.session, self.states)
        self.supervisor.enter(phase)

    def cycle(
        self,
        told_m_s: dict[int, float] | None = None,
        told: dict[int, int] | None = None,
        lost: Iterable[int] = (),
        **changes: object,
    ) -> str:
        inputs = image(self.session, **changes)
        for node in lost:
            del inputs[node]
        for state in self.states:
            state.take(inputs)
        return self.supervisor.look(told_m_s or {}, told or {})


# --- travel --------------------------------------------------------------------------------------


def travel(session: Session | None = None) -> Travel:
    session = session or example_session()
    return Travel(WinchState(session.winches[0], session), session)


def test_standstill_may_creep_so_far_and_no_further() -> None:
    for sign in (1, -1):
        one = travel()
        one.push(0.0, 0.0)
        one.push(sign * 0.999 * CREEP_M, 0.0)
        assert not one.astray
        one.push(sign * 1.001 * CREEP_M, 0.0)
        assert one.astray


def test_simulated_encoders_may_jitter_and_a_drives_own_may_not() -> None:
    """0.4 mm, 1 σ, at a velocity limit of 0.02 m/s: nothing moves, and nothing is said. What moves
    further than that is found, and at a usual limit nothing is another's."""
    slow = example_session(**{"velocity_m_s: 0.4": "velocity_m_s: 0.02"})
    random = np.random.default_rng(3)
    counts = np.rint(random.normal(scale=0.4e-3 * 1e7, size=3000)).astype(int)
    for jitter_m, fine in ((0.4e-3, True), (0.0, False)):
        watched = Watched(slow)
        watched.supervisor = Supervisor(slow, watched.states, jitter_m)
        watched.supervisor.enter(Phase.running)
        said = [watched.cycle(n1={cia402.POSITION: int(at)}) for at in counts]
        assert (set(said) == {""}) == fine
    watched = Watched(slow)
    watched.supervisor = Supervisor(slow, watched.states, 0.4e-3)
    watched.supervisor.enter(Phase.running)
    assert watched.cycle() == ""
    assert "node 1 (cable 1): moved by" in watched.cycle(n1={cia402.POSITION: 40_000})
    assert creep_m(example_session(), 0.4e-3) == creep_m(example_session(), 0.0) == 0.004


@pytest.mark.parametrize("delay_s", [0.0, 0.01, 0.05])
def test_a_drive_that_lags_by_fifty_milliseconds_follows(delay_s: float) -> None:
    """Full speed to and fro: whatever the window begins and ends with."""
    one, shift, position = travel(), round(delay_s / 0.01), 0.0
    told = [0.4 * math.sin(0.02 * k) * (1 if k // 170 % 2 else -1) for k in range(1000)]
    for k, velocity in enumerate(told):
        position += 0.01 * (told[k - shift] if k >= shift else 0.0)
        one.push(position, velocity)
        assert not one.astray, k


@pytest.mark.parametrize("gain", [0.0, 0.5, 1.5, 3.0, -1.0])
def test_a_drive_at_another_rate_is_found(gain: float) -> None:
    """At 0.1 m/s: within what makes 4 mm of difference, and one cycle."""
    one, position = travel(), 0.0
    k = 0
    while not one.astray and k < 200:
        k += 1
        position += 0.01 * 0.1 * gain
        one.push(position, 0.1)
    k -= 1  # the first reading is where it began
    assert (k - 1) * 0.01 * 0.1 * abs(gain - 1.0) <= CREEP_M
    assert one.moved_m == pytest.approx(k * 0.01 * 0.1 * gain)
    assert one.told_m == pytest.approx(k * 0.01 * 0.1)


def test_a_rate_that_is_a_little_off_does_not_add_up() -> None:
    """3 % of 0.1 m/s for a minute: 3 mm a second."""
    one, position = travel(), 0.0
    for _ in range(6000):
        position += 0.01 * 0.1 * 1.03
        one.push(position, 0.1)
        assert not one.astray


def test_a_slow_run_away_is_found_within_a_second() -> None:
    one = travel()
    cycles = 0
    while not one.astray:
        one.push(0.01 * 0.005 * cycles, 0.0)  # 5 mm/s
        cycles += 1
        assert cycles < 100


def test_a_cycle_without_encoder_is_no_motion() -> None:
    one = travel()
    one.push(0.0, 0.0)
    one.push(math.nan, 0.0)
    assert not one.astray
    one.push(0.005, 0.0)
    assert one.astray


def test_what_was_before_a_change_of_mode_does_not_count() -> None:
    one = travel()
    one.push(0.0, 0.0)
    one.clear()
    assert math.isnan(one.moved_m)
    assert one.told_m == 0.0
    one.push(1.0, 0.0)
    assert not one.astray


def test_a_change_of_speed_does_not_excuse_for_long() -> None:
    """From 0.4 m/s to a stop that a drive does not make: lag explains 20 mm, a window's range."""
    one, position = travel(), 0.0
    for _ in range(100):
        position += 0.004
        one.push(position, 0.4)
    cycles = 0
    while not one.astray:
        position += 0.004
        one.push(position, 0.0)
        cycles += 1
        assert cycles <= 7  # 4 mm and 20 mm at 4 mm a cycle, and the first is still told


@pytest.mark.parametrize(
    ("before", "ago", "excused"),
    [(50, 4, True), (50, 5, False), (110, 93, False), (110, 94, True)],
)
def test_lag_is_excused_at_both_ends_of_the_window_and_no_further(
    before: int, ago: int, excused: bool
) -> None:
    """A jump of 10 mm: while 0.4 m/s was told within 50 ms it may be lag, else not.

    So it may when that cycle is on its way out of the window, as late.
    """
    one = travel()
    for _ in range(before):
        one.push(0.0, 0.0)
    one.push(0.0, 0.4)
    for _ in range(ago):
        one.push(0.004, 0.0)
    assert not one.astray
    one.push(0.014, 0.0)
    assert one.astray != excused


def test_at_a_slow_rate_lag_is_three_cycles() -> None:
    """Of 20 ms each: at 0.4 m/s 24 mm and the creep of 4 mm, so 3 cycles of 8 mm and no fourth."""
    one = travel(example_session(**{"\nrate_Hz: 100": "\nrate_Hz: 50"}))
    one.push(0.0, 0.0)
    for k in range(1, 5):
        one.push(0.0, 0.4)
        assert one.astray == (k == 4)


def test_at_any_rate_standstill_is_the_same() -> None:
    for rate_Hz in (50, 1000):
        session = example_session(**{"\nrate_Hz: 100": f"\nrate_Hz: {rate_Hz}"})
        one = travel(session)
        one.push(0.0, 0.0)
        one.push(0.0039, 0.0)
        assert not one.astray
        one.push(0.0041, 0.0)
        assert one.astray


def test_a_coarse_encoder_may_be_off_by_two_counts() -> None:
    session = example_session(**{"counts_per_m: 1e7": "counts_per_m: 1000"})
    one = travel(session)
    one.push(0.0, 0.0)
    for length_m, fine in ((0.0059, True), (0.0061, False)):
        one.push(length_m, 0.0)
        assert one.astray != fine


def test_after_a_change_of_mode_all_begins_again() -> None:
    one = travel()
    for _ in range(20):
        one.push(0.0, 0.4)
    one.clear()
    one.push(0.0, 0.0)
    assert one.told_m == 0.0
    one.push(0.0041, 0.0)
    assert one.astray  # nothing that was told before excuses it


# --- still readings ------------------------------------------------------------------------------


def moving(still: Still) -> float:
    """Readings of two cables change as these run; the path so far."""
    for k in range(30):
        still.push(0.01 * k, [10 * k, -10 * k])
        assert not still.stuck(0)
        assert not still.stuck(1)
    return 0.01 * 29


@pytest.mark.parametrize("flicker", [0, 1, -1])
def test_a_reading_that_stands_ten_times_longer_than_ever_is_stuck(flicker: int) -> None:
    still = Still(0.004, 2)
    path_m = moving(still)
    for k in range(1, 21):
        still.push(path_m + 0.01 * k, [290 + flicker * (k % 2), -290 - 10 * k])
        assert still.stuck(0) == (0.01 * k > 0.1 + 1e-9)
        assert not still.stuck(1)
    # By two counts it has moved.
    still.push(path_m + 0.21, [292, -600])
    assert not still.stuck(0)


def test_a_rest_is_no_standstill() -> None:
    still = Still(0.004, 2)
    path_m = moving(still)
    for _ in range(10_000):
        still.push(path_m, [290, -290])
    assert not still.stuck(0)


def test_a_reading_that_never_moved_is_judged_by_its_kind() -> None:
    still = Still(0.004, 2)
    for k in range(40):
        still.push(0.01 * k, [7, 10 * k])
        # Not before 20 changes are known; by then the path is more than ten times 10 mm.
        assert still.stuck(0) == (k >= 20)


def test_steps_of_a_fine_sensor_are_not_counted_against_a_coarse_one() -> None:
    """The longest pause of any is the measure: 0.1 m of the second."""
    still = Still(0.004, 2)
    for k in range(100):
        still.push(0.01 * k, [10 * k, 10 * (k // 10)])
    for k in range(100, 205):
        still.push(0.01 * k, [990, 10 * (k // 10)])
        assert still.stuck(0) == (k - 99 > 100)


def test_the_least_standstill_is_ten_steps() -> None:
    """However short the pauses were: 40 mm."""
    still = Still(0.004, 1)
    for k in range(30):
        still.push(0.0001 * k, [10 * k])
    still.push(0.0029 + 0.0399, [290])
    assert not still.stuck(0)
    still.push(0.0029 + 0.0401, [290])
    assert still.stuck(0)


def test_a_sensor_that_is_not_there_is_never_stuck() -> None:
    still = Still(0.004, 2)
    for k in range(100):
        still.push(0.1 * k, [10 * k, None])
    assert not still.stuck(1)


def test_a_path_adds_up_what_all_cables_run_and_no_flicker() -> None:
    path = Path(0.004, 2)
    assert path.push([5.0, -5.0]) == 0.0
    for k in range(1000):
        assert path.push([5.0 + 0.0039 * (k % 2), -5.0]) == 0.0
    assert path.push([5.01, math.nan]) == pytest.approx(0.01)
    assert path.push([5.0, -5.02]) == pytest.approx(0.04)
    assert path.push([5.0, -5.02]) == pytest.approx(0.04)
    assert path.push([4.995, -5.02]) == pytest.approx(0.045)
    assert Path(0.5, 1).push([1.0]) == 0.0
    halves = Path(0.5, 1)
    assert [halves.push([x]) for x in (1.0, 1.5, 1.25, 1.0)] == [0.0, 0.5, 0.5, 1.0]


@pytest.mark.parametrize(
    ("key", "words"), [((0x2401, 1), "load cell"), ((0x60E4, 2), "swivel encoder")]
)
def test_the_supervisor_names_the_sensor_that_stands(key: tuple[int, int], words: str) -> None:
    watched = Watched()
    told = {1: 0.1, 2: 0.1, 3: 0.1, 4: 0.1}
    said, cycles = "", 0
    while not said and cycles < 400:
        values = {(0x2401, 1): 100_000 + 7 * cycles, (0x60E4, 2): 7 * cycles}
        changes: dict[str, Any] = {}
        for winch in watched.session.winches:
            position = round(winch.sign * 1e7 * 0.001 * cycles)
            changes[f"n{winch.node}"] = values | {cia402.POSITION: position}
        if cycles > 100:
            changes["n2"][key] = {(0x2401, 1): 100_700, (0x60E4, 2): 700}[key]
        said = watched.cycle(told, **changes)
        cycles += 1
    assert said == f"node 2 (cable 2): the {words} stands still while the platform moves"
    # Ten times the longest pause, of a step of 4 mm: a cable runs it in 4 or, rounded, 5 cycles.
    assert 102 < cycles <= 101 + 10 * 5


# --- the supervisor ------------------------------------------------------------------------------


def test_nothing_is_wrong_with_what_is_right() -> None:
    watched = Watched()
    assert not any(watched.cycle() for _ in range(150))


@pytest.mark.parametrize("lost", range(1, 5))
def test_a_node_may_miss_a_cycle_and_no_more(lost: int) -> None:
    watched = Watched()
    assert watched.cycle() == ""
    assert watched.cycle(lost=[lost]) == ""
    assert watched.cycle() == ""
    assert watched.cycle(lost=[lost]) == ""
    assert watched.cycle(lost=[lost]) == f"node {lost} (cable {lost}): does not answer"


def test_a_dead_load_cell() -> None:
    watched = Watched()
    dead = {(0x2401, 1): -(2**31)}
    assert watched.cycle(n3=dead) == ""
    assert "node 3 (cable 3): the load cell reads -2147483648 counts" in watched.cycle(n3=dead)


@pytest.mark.parametrize(
    ("phase", "state", "words"),
    [
        (Phase.running, State.fault, "left operation enabled, is fault"),
        (Phase.running, State.quick_stop, "left operation enabled, is quick stop active"),
        (Phase.enabling, State.fault, "is fault while"),
        (Phase.enabling, State.switched_on, ""),
        (Phase.enabling, State.ready, "is ready to switch on while"),
        (Phase.enabling, State.quick_stop, "is quick stop active while"),
        (Phase.preparing, State.enabled, "is operation enabled while"),
        (Phase.preparing, State.fault, ""),
        (Phase.preparing, State.fault_reaction, "is fault reaction active while"),
        (Phase.reading, State.enabled, ""),
        (Phase.reading, State.fault, ""),
    ],
)
def test_states_by_phase(phase: Phase, state: State, words: str) -> None:
    watched = Watched(phase=phase)
    found: dict[str, Any] = {
        f"n{n}": {cia402.STATUSWORD: cia402.statusword_of(State.switched_on)} for n in (1, 3)
    }
    found["n4"] = {}
    if phase is Phase.running:
        found = {}
    found |= {f"n{n}": {cia402.STATUSWORD: cia402.statusword_of(state)} for n in (2,)}
    if phase is Phase.preparing:
        found["n4"] = {cia402.STATUSWORD: cia402.statusword_of(State.switched_on)}
    said = watched.cycle(**found)
    assert said.startswith("node 2 (cable 2): " + words) if words else said == ""


@pytest.mark.parametrize(
    ("state", "words"), [(State.quick_stop, ""), (State.fault, "is fault while"),
                         (State.ready, "is ready to switch on while")],
)  # fmt: skip
def test_without_brakes_a_drive_may_hold_in_quick_stop(state: State, words: str) -> None:
    watched = Watched(example_session(**{"brakes: true": "brakes: false"}), Phase.enabling)
    said = watched.cycle(n2={cia402.STATUSWORD: cia402.statusword_of(state)})
    assert said.startswith("node 2 (cable 2): " + words) if words else said == ""


def test_a_drive_that_falls_back_while_others_are_enabled() -> None:
    watched = Watched(phase=Phase.enabling)
    assert watched.cycle() == ""
    back = {cia402.STATUSWORD: cia402.statusword_of(State.switched_on), cia402.ERROR_CODE: 0x2310}
    assert "node 2 (cable 2): left operation enabled, is switched on, error 0x2310" in (
        watched.cycle(n2=back)
    )


def test_a_mode_that_changes_is_wrong_at_once() -> None:
    for mode in (1, 10):
        watched = Watched()
        assert watched.cycle() == ""
        said = watched.cycle(n4={cia402.MODE_DISPLAY: mode})
        assert said == f"node 4 (cable 4): is in mode of operation {mode}, not 9"


def test_a_mode_may_take_some_cycles_to_change_when_it_was_told_to() -> None:
    watched = Watched(torque_session())
    watched.cycle()
    watched.supervisor.want_mode(cia402.CST)
    assert not any(watched.cycle() for _ in range(20))
    assert watched.cycle() == "node 1 (cable 1): is in mode of operation 9, not 10"
    watched = Watched(torque_session())
    watched.cycle()
    watched.supervisor.want_mode(cia402.CST)
    # A third mode is wrong at any time, and so is the old one once all had the new one.
    assert "is in mode of operation 1, not 10" in watched.cycle(n1={cia402.MODE_DISPLAY: 1})
    watched = Watched(torque_session())
    watched.supervisor.want_mode(cia402.CST)
    new = all_in_torque()
    # One has it before the others.
    assert not any(watched.cycle(n3=new["n3"]) for _ in range(3))
    assert watched.cycle(**new) == ""
    assert "is in mode of operation 9, not 10" in watched.cycle(**new | {"n3": {}})


@pytest.mark.parametrize(
    ("tension_N", "fine"),
    [(461.9, True), (462.1, False), (9.1, True), (8.9, False), (-5.0, False)],
)
def test_a_tension_a_tenth_beyond_a_limit(tension_N: float, fine: bool) -> None:
    said = Watched().cycle(n2={(0x2401, 1): round(1000 * tension_N)})
    assert (said == "") == fine
    if not fine:
        assert said == f"node 2 (cable 2): tension {tension_N:.1f} N is beyond the limits"


@pytest.mark.parametrize("sign", [1, -1])
def test_a_cable_that_runs_faster_than_the_limit(sign: int) -> None:
    """In torque mode nobody tells how fast; a quarter above 0.4 m/s over five cycles."""
    for velocity_m_s, fine in ((0.49, True), (0.51, False)):
        watched = Watched(torque_session())
        watched.supervisor.want_mode(cia402.CST)
        said = ""
        told = {w.node: round(torque_counts(w.torque, w.sign, 100.0)) for w in  # type: ignore[arg-type]
                watched.session.winches}  # fmt: skip
        for k in range(10):
            modes = all_in_torque()
            modes["n1"] |= {cia402.POSITION: round(sign * 1e7 * velocity_m_s * 0.01 * k)}
            said = said or watched.cycle(told=told, **modes)
        assert (said == "") == fine
        if not fine:
            assert said.startswith(f"node 1 (cable 1): runs at {sign * 0.51:.2f} m/s")


@pytest.mark.parametrize("phase", [Phase.preparing, Phase.enabling])
def test_nothing_may_move_while_it_is_armed_in_whatever_mode(phase: Phase) -> None:
    watched = Watched(phase=phase)
    state = State.switched_on if phase is Phase.preparing else State.enabled
    word = {cia402.STATUSWORD: cia402.statusword_of(state)}
    changes: dict[str, Any] = {f"n{n}": dict(word) for n in range(1, 5)}
    if phase is Phase.preparing:
        changes["n3"][cia402.MODE_DISPLAY] = 0  # it was not told any before
    assert watched.cycle(**changes) == ""
    changes["n3"] |= {cia402.POSITION: 50_000}
    assert "node 3 (cable 3): moved by +5.0 mm" in watched.cycle(**changes)


def test_a_dry_run_may_be_moved_by_hand() -> None:
    watched = Watched(phase=Phase.reading)
    assert watched.cycle() == ""
    assert watched.cycle(n3={cia402.POSITION: 50_000, cia402.MODE_DISPLAY: 0}) == ""


def test_what_moved_in_torque_mode_does_not_count_in_velocity_mode() -> None:
    watched = Watched(torque_session())
    watched.cycle()
    watched.supervisor.want_mode(cia402.CST)
    modes = all_in_torque()
    told = {1: -208, 2: 208, 3: -208, 4: 208}
    for k in range(10):
        modes["n1"][cia402.POSITION] = 10_000 * k
        assert watched.cycle(told=told, **modes) == ""
    watched.supervisor.want_mode(cia402.CSV)
    assert watched.cycle(n1={cia402.POSITION: 90_000}) == ""
    assert watched.cycle(n1={cia402.POSITION: 90_000}) == ""
    assert "moved by +5.0 mm" in watched.cycle(n1={cia402.POSITION: 140_000})


def test_who_does_not_answer_is_not_judged_by_what_it_said_last() -> None:
    """A node may miss a cycle: its old statusword is nobody's fault."""
    watched = Watched(phase=Phase.enabling)
    back: dict[str, Any] = {"n2": {cia402.STATUSWORD: cia402.statusword_of(State.switched_on)}}
    assert watched.cycle(**back) == ""
    watched.supervisor.enter(Phase.running)
    assert watched.cycle(lost=[2]) == ""


def test_who_runs_away_is_blamed_before_who_is_pulled() -> None:
    """Cable 4 moves untold; cable 1 feels it first."""
    watched = Watched()
    watched.cycle()
    said = watched.cycle(n1={(0x2401, 1): 0}, n4={cia402.POSITION: 50_000})
    assert said == "node 4 (cable 4): moved by -5.0 mm where +0.0 mm were commanded"


# --- torque --------------------------------------------------------------------------------------


def test_a_drive_that_does_not_pull_as_told() -> None:
    session = torque_session()
    for off_N, fine in ((41.0, True), (43.0, False), (-43.0, False)):
        state = WinchState(session.winches[1], session)
        pull = Pull(state, session)
        assert state.winch.torque is not None
        for _ in range(4):
            pull.push(round(torque_counts(state.winch.torque, -1, 100.0 + off_N)), 208)
            assert not pull.astray  # not before FOLLOW_S
        pull.push(round(torque_counts(state.winch.torque, -1, 100.0 + off_N)), 208)
        assert pull.astray != fine
        assert pull.told_N == pytest.approx(100.0, abs=0.3)
        assert pull.shown_N == pytest.approx(100.0 + off_N, abs=0.3)
        pull.clear()
        assert not pull.astray
        pull.push(None, 0)
        assert not pull.astray


def test_torque_mode_is_supervised() -> None:
    watched = Watched(torque_session())
    watched.supervisor.want_mode(cia402.CST)
    modes = all_in_torque()
    told = {1: -208, 2: 208, 3: -300, 4: 208}
    said = [watched.cycle(told=told, **modes) for _ in range(5)]
    assert said[:4] == [""] * 4
    assert said[4].startswith("node 3 (cable 3): pulls with 100 N where 144 N were commanded")


def test_torques_of_before_a_change_of_mode_do_not_count() -> None:
    watched = Watched(torque_session())
    modes = all_in_torque()
    told = {1: -208, 2: 208, 3: -300, 4: 208}
    for _ in range(3):
        watched.supervisor.want_mode(cia402.CST)
        assert not any(watched.cycle(told=told, **modes) for _ in range(4))
        watched.supervisor.want_mode(cia402.CSV)
        assert watched.cycle(told=told) == ""


@pytest.mark.parametrize(("rate_Hz", "cycles"), [(50, 3), (100, 5), (1000, 50)])
def test_torques_are_judged_over_fifty_milliseconds(rate_Hz: int, cycles: int) -> None:
    session = torque_session(**{"\nrate_Hz: 100": f"\nrate_Hz: {rate_Hz}"})
    pull = Pull(WinchState(session.winches[1], session), session)
    for k in range(1, cycles + 1):
        pull.push(300, 208)
        assert pull.astray == (k == cycles)


class Recorded:
    """A bus that keeps what is sent."""

    def __init__(self) -> None:
        self.sent: list[dict[int, Values]] = []
        self.fails = ""

    def send(self, outputs: dict[int, Values]) -> None:
        if self.fails:
            raise BackendError(self.fails)
        self.sent.append({node: dict(values) for node, values in outputs.items()})


def command(mode: int, torque: int, velocity: int = 0) -> Values:
    return {
        cia402.CONTROLWORD: cia402.ENABLE_OPERATION,
        cia402.MODE: mode,
        cia402.TARGET_VELOCITY: velocity,
        cia402.TARGET_TORQUE: torque,
    }


def test_torques_ramp() -> None:
    """From one limit to the other in half a second: two commands a cycle, 50 cycles."""
    bus = Recorded()
    guard = Guard(bus, torque_session(), armed=True)  # type: ignore[arg-type]
    guard.measured({1: 100.0})
    guard.send({1: command(cia402.CSV, -208)})
    for _ in range(100):
        guard.send({1: command(cia402.CST, -875)})
    torques = [sent[1][cia402.TARGET_TORQUE] for sent in bus.sent]
    steps = -np.diff(torques)
    assert torques[0] == -208
    assert torques[-1] == -875
    assert 0 <= steps.min() <= steps.max() == math.ceil(0.01 * (875 - 21))
    guard.send({1: command(cia402.CST, -21)})
    assert bus.sent[-1][1][cia402.TARGET_TORQUE] == -875 + 9
    assert guard.told_torque() == {1: -866}


def test_what_was_told_is_what_went_out() -> None:
    guard = Guard(Recorded(), example_session(), armed=True)  # type: ignore[arg-type]
    assert guard.told_m_s() == {}
    guard.measured({1: 100.0, 2: 100.0})
    guard.send({1: command(9, 0, 10**9), 2: command(9, 0, 10**6)})
    assert guard.told_m_s() == {1: 0.4, 2: -0.1}
    guard.trip("so")
    assert guard.told_m_s() == {1: 0.0, 2: 0.0}


def test_the_first_torque_and_those_of_mode_velocity_do_not_ramp() -> None:
    """Nothing holds the platform by them yet: what they begin with is what the motors show."""
    bus = Recorded()
    guard = Guard(bus, torque_session(), armed=True)  # type: ignore[arg-type]
    guard.measured({1: 100.0})
    for torque, mode in ((-208, cia402.CST), (-300, cia402.CSV), (-800, cia402.CSV)):
        guard.send({1: command(mode, torque)})
        assert bus.sent[-1][1][cia402.TARGET_TORQUE] == torque
    # And the limits hold in any mode.
    guard.send({1: command(cia402.CSV, -900)})
    assert guard.told_torque() == {1: -875}
    guard.send({1: command(cia402.CSV, 0)})
    assert guard.told_torque() == {1: -21}


def test_velocities_are_cut_to_whole_units_within_the_limit() -> None:
    text = "counts_per_m: 1e7"
    session = example_session(**{text: f"{text}\n    velocity_units_per_m_s: 1001.3"})
    bus = Recorded()
    guard = Guard(bus, session, armed=True)  # type: ignore[arg-type]
    guard.measured({2: 100.0})
    for velocity in (10**6, -(10**6)):
        guard.send({2: command(cia402.CSV, 0, velocity)})
        assert abs(bus.sent[-1][2][cia402.TARGET_VELOCITY]) == 400  # of 400.52


def test_a_winch_without_a_drum_is_given_no_torque() -> None:
    session = example_session()
    bare = session.winches[1].model_copy(update={"torque": None})
    session = session.model_copy(update={"winches": [session.winches[0], bare]})
    assert torque_range(bare, session) == (0, 0)
    bus = Recorded()
    guard = Guard(bus, session, armed=True)  # type: ignore[arg-type]
    guard.send({2: command(cia402.CSV, 500)})
    assert guard.told_torque() == {2: 0}


def test_only_who_was_told_something_is_told_to_stop() -> None:
    for armed in (False, True):
        bus = Recorded()
        guard = Guard(bus, example_session(), armed=armed)  # type: ignore[arg-type]
        if not armed:
            guard.send({1: command(cia402.CSV, 0)})
        guard.trip("so")
        assert bus.sent == []
        assert guard.reason == "so"


def test_a_stop_that_cannot_be_sent_is_said() -> None:
    bus = Recorded()
    guard = Guard(bus, example_session(), armed=True)  # type: ignore[arg-type]
    guard.send({1: command(cia402.CSV, 0)})
    bus.fails = "the bus is gone"
    guard.trip("so")
    guard.trip("and so")
    assert guard.reason == "so; and the bus is gone"


def test_torque_mode_begins_with_what_holds_the_platform() -> None:
    session = torque_session()
    state = WinchState(session.winches[1], session)
    state.take(image(session, n2={cia402.TORQUE: 250}))
    assert state.torque_tension_N == pytest.approx(120.0)
    out = state.output(cia402.Goal.enabled, cia402.CSV, 0.0, 50.0)
    assert out[cia402.TARGET_TORQUE] == 250
    out = state.output(cia402.Goal.enabled, cia402.CST, 0.0, 48.0)
    assert out[cia402.TARGET_TORQUE] == 100


# --- plausibility --------------------------------------------------------------------------------


def judged(robot: Robot, read_N: list[float], torque_N: list[float] | None, count: int = 1) -> str:
    session = example_session()
    states = winches(session)
    plausibility = Plausibility(robot, states)
    for _ in range(count):
        for state, tension, held in zip(states, read_N, torque_N or [math.nan] * 4, strict=True):
            assert state.winch.torque is not None
            state.tension_N = tension
            state.torque_counts = (
                None
                if math.isnan(held)
                else round(torque_counts(state.winch.torque, state.winch.sign, held))
            )
        plausibility.collect()
    return plausibility.wrong()


@pytest.mark.parametrize(
    ("read_N", "torque_N", "cable"),
    [
        ([100.0] * 4, [100.0] * 4, 0),
        ([100.0] * 4, [72.0] * 4, 0),  # friction
        ([100.0] * 4, [140.0] * 4, 0),
        ([100.0] * 4, [100.0, 100.0, 50.0, 100.0], 3),
        ([100.0] * 4, [100.0, 175.0, 100.0, 100.0], 2),
        ([100.0] * 4, [100.0, 100.0, 100.0, -100.0], 4),
        ([100.0, 100.0, 30.0, 100.0], [100.0, 100.0, 6.0, 100.0], 3),  # below 0.7 · 10 N
        ([100.0, 100.0, 30.0, 100.0], [100.0, 100.0, 8.0, 100.0], 0),
    ],
)
def test_torque_and_load_cell(
    robot: Robot, read_N: list[float], torque_N: list[float], cable: int
) -> None:
    said = judged(robot, read_N, torque_N)
    assert said.startswith(f"node {cable} (cable {cable}): the motor's") if cable else said == ""


def test_what_one_cable_does_not_show_all_do(robot: Robot) -> None:
    """40 N each: half of it is within one load cell's 2 σ = 20 N, but not all four are."""
    assert judged(robot, [40.0] * 4, [18.0] * 4).startswith("all winches together: the motor's")
    assert judged(robot, [40.0] * 4, [40.0] * 4) == ""


def test_load_cells_that_cannot_carry_the_platform(robot: Robot) -> None:
    """127 N, and 2 σ of four cells are 40 N."""
    assert "together read 80 N, and the platform weighs 127 N" in judged(robot, [20.0] * 4, None)
    assert judged(robot, [22.0] * 4, None) == ""


def test_a_reading_that_is_missed_does_not_hide_the_others(robot: Robot) -> None:
    states = winches(example_session())
    plausibility = Plausibility(robot, states)
    for missed in (False, True):
        for state in states:
            assert state.winch.torque is not None
            state.tension_N = 100.0
            state.torque_counts = round(torque_counts(state.winch.torque, state.winch.sign, 50.0))
        states[0].tension_N = math.nan if missed else 100.0
        plausibility.collect()
    assert plausibility.wrong().startswith("node 1 (cable 1): the motor's torque would hold 50 N")


def test_all_together_are_judged_by_the_least_efficient(robot: Robot) -> None:
    whole = "gear_ratio: 10, rated_torque_Nm: 2.4}\n  - cable: 2"
    worn = whole.replace("2.4", "2.4, efficiency: 0.51")
    states = winches(example_session(**{whole: worn}))
    plausibility = Plausibility(robot, states)
    for state in states:
        assert state.winch.torque is not None
        state.tension_N = 40.0
        state.torque_counts = round(torque_counts(state.winch.torque, state.winch.sign, 18.0))
    plausibility.collect()
    assert plausibility.wrong() == ""  # 72 N are more than 0.51 of 160 - 40 N


@pytest.mark.parametrize(
    ("own_mNm", "fine"), [(2400, True), (2423, True), (2377, True), (2426, False), (2374, False)]
)
def test_the_rated_torque_is_the_drives_own_to_a_hundredth(
    own_mNm: int, fine: bool, robot: Robot, plan: cdprcal.Plan
) -> None:
    def build(nodes: list[DriveNode]) -> None:
        nodes[2].drive.dictionary.set(cia402.RATED_TORQUE, own_mNm)

    try:
        backend = armed(robot, plan, build)
    except BackendError as error:
        said = str(error)
    else:
        said = ""
        backend.stop()
    assert ("node 3 (cable 3): its rated torque (0x6076) is" in said) != fine


def test_a_drive_whose_limit_cannot_be_written_is_refused(robot: Robot, plan: cdprcal.Plan) -> None:
    def build(nodes: list[DriveNode]) -> None:
        nodes[1].drive.dictionary.objects[cia402.MAX_MOTOR_SPEED].writable = False

    with pytest.raises(BackendError, match="does not keep the limit that 0x6080 is told"):
        armed(robot, plan, build)
    # One that is limited further already need not be.

    def limited(nodes: list[DriveNode]) -> None:
        build(nodes)
        nodes[1].drive.dictionary.set(cia402.MAX_MOTOR_SPEED, 900)

    armed(robot, plan, limited).stop()


def test_a_winch_without_a_drum_loses_nothing_to_friction() -> None:
    session = example_session()
    bare = session.winches[0].model_copy(update={"torque": None})
    assert efficiency_of(WinchState(bare, session)) == 1.0
    assert efficiency_of(WinchState(session.winches[0], session)) == 0.7


def test_nothing_read_says_nothing(robot: Robot) -> None:
    assert judged(robot, [math.nan] * 4, None) == ""
    assert judged(robot, [100.0] * 4, [100.0] * 4, count=0) == ""


# --- limits of the drives ------------------------------------------------------------------------


def test_drives_are_given_the_limits_of_the_session(robot: Robot, plan: cdprcal.Plan) -> None:
    backend = armed(robot, plan)
    assert backend.simulated is not None
    for node in backend.simulated.nodes:
        # 462 N at 0.05 m, 10:1, of 2.4 Nm; 0.5 m/s.
        assert node.drive.dictionary.get(cia402.MAX_TORQUE) == 963
        assert node.drive.dictionary.get(cia402.MAX_MOTOR_SPEED) == 955
    for effective in backend.limits["drives"]:
        assert effective["tension_N"] == pytest.approx(462.0, abs=0.5)
        assert effective["velocity_m_s"] == pytest.approx(0.5, abs=1e-3)
    assert backend.settings["limits"]["stop_time_s"] == pytest.approx(0.375)
    backend.stop()


def armed(
    robot: Robot,
    plan: cdprcal.Plan,
    build: Callable[[list[DriveNode]], None] | None = None,
    **texts: str,
) -> SimulatedSession:
    """The winches of the example, armed, their drives built so."""
    fault = Fault("built so", math.inf, build=build)
    return SimulatedSession.connect(example_session(**texts), robot, plan, armed=True, fault=fault)


TRAVEL = {"velocity_m_s: 0.4": "velocity_m_s: 0.4, travel_m: 0.5"}


def positions(node: Any) -> tuple[int, int, int]:
    """Lower limit, where it is, upper limit; in counts."""
    least, here, most = (
        node.drive.dictionary.get(key, signed=True)
        for key in (cia402.POSITION_LEAST, cia402.POSITION, cia402.POSITION_MOST)
    )
    return least, here, most


def test_position_limits_are_set_about_where_the_drive_is_and_put_back(
    robot: Robot, plan: cdprcal.Plan
) -> None:
    session = example_session(**TRAVEL)

    def build(nodes: list[Any]) -> None:
        nodes[0].drive.dictionary.set(cia402.POSITION_MOST, nodes[0].drive.dictionary.get(
            cia402.POSITION, signed=True) + 300_000)  # fmt: skip
        nodes[0].drive.dictionary.set(cia402.POSITION_LEAST, -(1 << 31))

    backend = armed(robot, plan, build, **TRAVEL)
    assert backend.simulated is not None
    beyond_m = 0.5 + backend.limits["stop_distance_m"]
    nodes = backend.simulated.nodes
    for node, winch in zip(nodes[1:], session.winches[1:], strict=True):
        least, here, most = positions(node)
        assert most - here == here - least == math.ceil(beyond_m * winch.counts_per_m)
    least, here, most = positions(nodes[0])
    assert most < here + 400_000  # its own, which is narrower
    assert here - least == math.ceil(beyond_m * session.winches[0].counts_per_m)
    effective = [drive["travel_m"] for drive in backend.limits["drives"]]
    assert effective[1:] == pytest.approx([beyond_m] * 3, abs=1e-4)
    assert effective[0] < 0.1
    backend.read()
    backend.stop()
    assert [positions(node)[::2] for node in nodes[1:]] == [(0, 0)] * 3
    assert positions(nodes[0])[0] == -(1 << 31)


def test_a_drive_beyond_its_own_position_limits_is_refused(
    robot: Robot, plan: cdprcal.Plan
) -> None:
    def build(nodes: list[Any]) -> None:
        here = positions(nodes[2])[1]
        nodes[2].drive.dictionary.set(cia402.POSITION_LEAST, here + 100_000_000)
        nodes[2].drive.dictionary.set(cia402.POSITION_MOST, here + 200_000_000)

    with pytest.raises(BackendError, match=r"node 3 \(cable 3\): stands at .* \(0x607D: 1"):
        armed(robot, plan, build, **TRAVEL)


def test_position_limits_that_are_not_kept_are_refused_and_missing_ones_noted(
    robot: Robot, plan: cdprcal.Plan
) -> None:
    def fixed(nodes: list[Any]) -> None:
        nodes[1].drive.dictionary.objects[cia402.POSITION_MOST].writable = False

    def missing(nodes: list[Any]) -> None:
        del nodes[1].drive.dictionary.objects[cia402.POSITION_MOST]

    with pytest.raises(BackendError, match="does not keep the limit that 0x607D is told"):
        armed(robot, plan, fixed, **TRAVEL)
    backend = armed(robot, plan, missing, **TRAVEL)
    assert [note for note in backend.notes if "no object 0x607D" in note]
    assert "travel_m" not in backend.limits["drives"][1]
    backend.stop()


def test_a_cable_that_goes_too_far_stops_the_robot() -> None:
    session = example_session(**TRAVEL)
    states = winches(session)
    supervisor = Supervisor(session, states)
    for gone_m in (0.0, 0.5, -0.5, 0.501, -0.501):
        for state in states:
            state.length_m, state.tension_N, state.missed = 2.0, 100.0, 0
        states[2].length_m = 2.0 + gone_m
        said = supervisor.look({}, {})
        beyond = f"cable 3): is {gone_m:+.3f} m from where it was at power-on" in said
        assert beyond == (abs(gone_m) > 0.5)


def test_a_drive_that_is_limited_further_stays_so(robot: Robot, plan: cdprcal.Plan) -> None:
    def build(nodes: list[DriveNode]) -> None:
        nodes[0].drive.dictionary.set(cia402.MAX_TORQUE, 500)

    backend = armed(robot, plan, build)
    assert backend.limits["drives"][0]["tension_N"] == pytest.approx(240.0)
    assert backend.limits["drives"][1]["tension_N"] == pytest.approx(462.0, abs=0.5)
    backend.stop()


def test_a_drive_that_does_not_keep_a_limit_is_refused(robot: Robot, plan: cdprcal.Plan) -> None:
    words = r"node 2 \(cable 2\): does not keep the limit that 0x6072 is told"
    with pytest.raises(BackendError, match=words):
        armed(robot, plan, forgetting(cia402.MAX_TORQUE, 2))


def test_a_drive_without_limits_is_noted(robot: Robot, plan: cdprcal.Plan) -> None:
    backend = armed(robot, plan, without(cia402.MAX_TORQUE, node=2))
    assert backend.notes == [
        "node 2 (cable 2): has no object 0x6072; limit tension_N by its own set-up"
    ]
    backend.stop()


def test_the_torque_needs_no_message_of_its_own() -> None:
    """It goes where the first PDO has room."""
    for layout in layouts(example_session()):
        assert [len(pdo) for pdo in split_into_pdos(layout.inputs)] == [4, 2, 1]


# --- wiggles -------------------------------------------------------------------------------------


def responses(slope_N_m: Any, noise_N: float = 0.5, efficiency: float = 0.8) -> Responses:
    """What cables answer that are paid out by 0.5 mm in turn; [reads, moved]."""
    random = np.random.default_rng(3)
    count = len(slope_N_m)
    found = Responses([efficiency] * count)
    for moved in range(count):
        before = 80.0 + noise_N * random.normal(size=(50, count))
        after = 80.0 + 5e-4 * np.array(slope_N_m)[:, moved]
        found.add(moved, 5e-4, before, after + noise_N * random.normal(size=(50, count)))
    return found


def elastic(*pattern: float) -> Any:
    """Slopes of an elastic structure: how much of a load each cable takes, and in which sense."""
    return -2e4 * np.outer(pattern, pattern)


def symmetric(count: int = 4) -> Any:
    """Pairs of cables that share a load."""
    return elastic(*[1.0, -1.1, 0.9, -1.0, 0.8, -0.7][:count])


def test_an_elastic_robot_answers_alike() -> None:
    assert responses(symmetric()).wrong() is None
    assert responses(symmetric(2)).wrong() is None


@pytest.mark.parametrize("at", range(4))
@pytest.mark.parametrize("factor", [-1.0, 0.2, 5.0])
def test_one_cable_with_another_scale_or_sign_is_named(at: int, factor: float) -> None:
    of_lengths, of_tensions = symmetric(), symmetric()
    of_lengths[:, at] *= factor
    of_tensions[at, :] *= factor
    for slope in (of_lengths, of_tensions):
        wrong = responses(slope).wrong()
        assert wrong is not None
        assert wrong[0] == at
        assert "answer it; check sign, counts_per_m, counts_per_N" in wrong[1]
        assert "swapped" not in wrong[1]


# Two that pull alike answer alike: exchanged, they do not show.
@pytest.mark.parametrize("pair", [(0, 1), (0, 3), (1, 2), (2, 3)])
def test_swapped_load_cells_are_named(pair: tuple[int, int]) -> None:
    order = np.arange(4)
    order[list(pair)] = pair[::-1]
    wrong = responses(symmetric()[order]).wrong()
    assert wrong is not None
    assert wrong[0] == pair[0]
    assert f"as with the load cells of cables {pair[0] + 1} and {pair[1] + 1} swapped;" in wrong[1]
    assert wrong[1].endswith(
        "check sign, counts_per_m, counts_per_N, and that the load cell is on this cable"
    )


def test_friction_of_drums_and_pulleys_is_none() -> None:
    slope = symmetric()
    slope[2, :] *= 0.8  # as its session says
    assert responses(slope).wrong() is None
    assert responses(slope * [1.0, 1.0, 1.0, 2.0]).wrong() is not None


def test_what_noise_hides_is_not_said() -> None:
    slope = symmetric()
    slope[:, 1] *= 3.0
    assert responses(slope, noise_N=0.2).wrong() is not None
    assert responses(slope, noise_N=200.0).wrong() is None


#: 100 readings of unit scatter, of which none is like its neighbour: their mean is sure to a tenth.
THERE_AND_BACK = np.tile([1.0, -1.0], 50)[:, None]


def told(slope_N_m: Any, noise_N: Any, efficiency: float = 0.8, by_m: float = 5e-4) -> Responses:
    """Exactly these slopes [reads, moved], and this noise of the mean of what each moved showed."""
    slope, noise = np.array(slope_N_m), np.broadcast_to(noise_N, np.shape(slope_N_m))
    count = len(slope)
    found = Responses([efficiency] * count)
    for moved in range(count):
        before = np.full((100, count), 80.0)
        after = before + by_m * slope[:, moved]
        found.add(moved, by_m, before, after + THERE_AND_BACK * 10.0 * noise[:, moved])
    return found


@pytest.mark.parametrize("by_m", [5e-4, -5e-4])
def test_slopes_are_what_was_answered(by_m: float) -> None:
    slope = [[-9.0, 2.0], [3.0, -7.0]]
    found = told(slope, 1e-3, by_m=by_m)
    assert found.slope_N_m == pytest.approx(np.array(slope))
    assert found._sigma_N_m == pytest.approx(np.full((2, 2), 1e-3 / 5e-4))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("ratio", "fine"), [(0.63, False), (0.65, True), (1.0, True), (1.55, True), (1.58, False)]
)
def test_friction_explains_what_both_efficiencies_allow(
    ratio: float, fine: bool, sign: float
) -> None:
    """0.8 of each: between 0.64 and 1 / 0.64."""
    for here, there in ((ratio, 1.0), (1.0, ratio)):
        slope = 1e4 * np.array([[-1.0, sign * here], [sign * there, -1.0]])
        assert (told(slope, 1e-9).wrong() is None) == fine


@pytest.mark.parametrize("noise", [(1.0, 0.0), (0.0, 1.0), (3.0, 4.0)])
def test_noise_explains_three_sigma_of_both_answers(noise: tuple[float, float]) -> None:
    """Of what lies beyond friction, looked at both ways: the more certain of the two decides."""
    here, there = noise
    beyond = 3.0 * min(math.hypot(here, there / 0.64), math.hypot(there, here / 0.64) / 0.64)
    for share, fine in ((0.98, True), (1.02, False)):
        slope = [[-1e3, 1000.0 / 0.64 + share * beyond], [1000.0, -1e3]]
        found = told(slope, 5e-4 * np.array([[0.0, here], [there, 0.0]]))
        assert (found.wrong() is None) == fine, share


def test_two_wrong_scales_are_not_taken_for_an_exchange() -> None:
    slope = symmetric()
    slope[[0, 1], :] *= 5.0
    wrong = responses(slope).wrong()
    assert wrong is not None
    assert "swapped" not in wrong[1]


def test_an_exchange_that_leaves_cables_pulling_the_more_for_being_paid_out_is_none() -> None:
    """All load cells reversed, and two exchanged: exchanged back, they are reversed still."""
    slope = -elastic(1.0, -2.0, 0.9, -0.8)
    assert responses(slope).wrong() is None
    wrong = responses(slope[[1, 0, 2, 3]]).wrong()
    assert wrong is not None
    assert "swapped" not in wrong[1]


def test_swapped_load_cells_of_unequal_cables_are_named() -> None:
    slope = elastic(1.0, -2.0, 0.9, -0.8)
    wrong = responses(slope[[1, 0, 2, 3]]).wrong()
    assert wrong is not None
    assert wrong[0] == 0
    assert "as with the load cells of cables 1 and 2 swapped;" in wrong[1]


def test_of_several_the_oddest_is_named() -> None:
    """Scales of 1, 25 and 4: every pair is apart, the second from both others the furthest."""
    slope = elastic(3.0, -0.1, 0.5)
    slope[1, :] *= 25.0
    slope[2, :] *= 4.0
    wrong = told(slope, 1e-9).wrong()
    assert wrong is not None
    assert wrong[0] == 1


def test_the_noise_of_a_mean_counts_what_neighbours_have_in_common() -> None:
    random = np.random.default_rng(8)
    white = random.normal(size=(4000, 6))
    assert _of_mean(white) == pytest.approx(np.full(6, 4000**-0.5), rel=0.08)
    wandering = lfilter([0.6], [1.0, -0.8], white, axis=0)  # of unit variance
    expected = math.sqrt(1.8 / 0.2 / 4000)
    assert _of_mean(wandering) == pytest.approx(np.full(6, expected), rel=0.2)
    assert _of_mean(THERE_AND_BACK) == pytest.approx([0.1])
    assert _of_mean(np.full((50, 2), 80.0)) == pytest.approx([0.0, 0.0], abs=1e-100)
    # As alike as can be told from so many: (2 - 1/50) 50 times the variance of white noise.
    ramp = np.linspace(-1.0, 1.0, 50)[:, None]
    off = float((ramp**2).sum())
    alike = min(float((ramp[1:] * ramp[:-1]).sum()) / off, 0.98)
    assert _of_mean(ramp) == pytest.approx([math.sqrt(off * (1 + alike) / (1 - alike)) / 50])
    step = np.repeat([-1.0, 1.0], 50)[:, None]
    assert _of_mean(step) == pytest.approx([math.sqrt(100 * 1.97 / 0.03) / 100], rel=0.03)


def test_cables_are_wiggled_no_further_than_told_and_come_back(
    robot: Robot, plan: cdprcal.Plan
) -> None:
    for most_m in (0.0, 0.0005, 0.002):
        changes = {"brakes: true": f"brakes: true, wiggle_m: {most_m}"}
        session = example_session(**changes)
        backend = SimulatedSession.connect(session, robot, plan, armed=True)
        assert backend.simulated is not None
        at_m = [node.drive.dictionary.get(cia402.POSITION, signed=True) for node in
                backend.simulated.nodes]  # fmt: skip
        backend.read()
        now_m = [node.drive.dictionary.get(cia402.POSITION, signed=True) for node in
                 backend.simulated.nodes]  # fmt: skip
        moved_m = np.abs(np.subtract(now_m, at_m)) / session.winches[0].counts_per_m
        assert (moved_m < 0.004).all()  # the encoders of the simulator have noise
        assert backend.tripped == ""
        backend.stop()
