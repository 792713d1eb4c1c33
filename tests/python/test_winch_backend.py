"""How winches are set up, armed, read, commanded and stopped: on a bench, call by call."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal import StartUpState
from cdprcal.hardware import BackendError
from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.backend import FieldbusBackend
from cdprcal.hardware.drives.cia402 import State
from cdprcal.hardware.drives.fieldbus import SimulatedClock
from cdprcal.hardware.session import Session
from winch_bench import Bench, Command, Level, OnBench, four
from winch_bus import AT_ONCE, example_session, torque_session

OFF, STOP, SHUTDOWN, SWITCH_ON, ENABLE, RESET = 0x00, 0x02, 0x06, 0x07, 0x0F, 0x80


def at_once(**changes: str) -> Session:
    """The example without wiggles."""
    return example_session(**AT_ONCE, **changes)


def without_brakes(**changes: str) -> Session:
    return example_session(**{"brakes: true": "brakes: false, wiggle_m: 0"}, **changes)


def held(bench: Bench, state: State) -> None:
    """Drives that were left in a state by whoever was there before."""
    for drive in bench.drives.values():
        drive.dictionary.set(cia402.QUICK_STOP_OPTION, cia402.QUICK_STOP_AND_STAY)
        drive.set_state(state)


# --- set-up --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rate_Hz", "brakes", "period", "exponent"),
    [
        (100, True, 10, -3),
        (50, True, 20, -3),
        (1000, False, 1, -3),
        (62.5, True, 16, -3),
        (400, False, 25, -4),
        (300, True, 33, -4),
    ],
)
def test_what_a_drive_is_told_before_it_may_move(
    rate_Hz: float, brakes: bool, period: int, exponent: int, robot: cdprcal.Robot
) -> None:
    """How to stop, what to do in silence, its limits, and the time from one command to the next."""
    session = (at_once if brakes else without_brakes)(**{"\nrate_Hz: 100": f"\nrate_Hz: {rate_Hz}"})
    on = OnBench(session, robot)
    for node in range(1, 5):
        assert on.bench.written[node] == [
            (cia402.QUICK_STOP_DECELERATION, 40_000_000, 4),  # 4 m/s², in counts
            (cia402.QUICK_STOP_OPTION, 2 if brakes else 6, 2),
            (cia402.ABORT_CONNECTION_OPTION, 3, 2),
            (cia402.MAX_TORQUE, 963, 2),
            (cia402.MAX_MOTOR_SPEED, 955, 4),
            (cia402.INTERPOLATION_PERIOD, period, 1),
            (cia402.INTERPOLATION_EXPONENT, exponent & 0xFF, 1),
        ]
    assert on.bench.outputs is True
    assert on.bench.watched is None  # not before it is armed
    assert on.bench.cycles  # it was waited for process data, and nobody was enabled
    assert set(on.bench.words()) == {OFF if brakes else STOP}


def test_a_dry_run_tells_nobody_anything(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot, armed=False)
    on.read(5)
    on.command(Command(velocity_m_s=four(0.1)))
    assert on.read().drive_error == ""
    cycles = len(on.bench.cycles)
    on.backend.stop()
    assert len(on.bench.cycles) == cycles
    assert on.bench.ends == [True]
    assert on.bench.outputs is False
    assert on.bench.watched is None
    assert not any(on.bench.cycles)
    assert not any(on.bench.sent)
    assert not any(on.bench.written.values())
    assert on.bench.abandoned == 0
    assert on.backend.settings["armed"] is False


def test_drives_are_what_the_log_says_they_are(robot: cdprcal.Robot) -> None:
    bench = Bench(at_once())
    del bench.drives[2].dictionary.objects[0x1018, 3]
    settings = OnBench(bench, robot).backend.settings
    every = {"vendor": 0x0CDB, "product": 402, "revision": 1}
    assert settings["drives"][0] == {"cable": 1, "node": 1, "serial": 1001} | every
    assert settings["drives"][1] == {"cable": 2, "node": 2, "serial": 1002, "vendor": 0x0CDB,
                                     "product": 402}  # fmt: skip
    assert settings["ahrs"] == {"device_id": "level"}
    assert settings["backend"] == "canopen"
    assert settings["notes"] == []
    assert settings["limits"]["tension_N"] == [10, 420]


def test_winches_are_in_the_order_of_their_cables(robot: cdprcal.Robot) -> None:
    session = at_once()
    session = session.model_copy(update={"winches": session.winches[::-1]})
    on = OnBench(session, robot)
    assert [winch.winch.cable for winch in on.backend.winches] == [1, 2, 3, 4]
    on.bench.drives[1].winch = on.bench.drives[1].winch.model_copy(update={"counts_per_m": 2e7})
    sample = on.read()
    assert sample.length_m.tolist() == [4.0, 2.0, 2.0, 2.0]


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ((0x1000, 0), 0x00020191, r"is no CiA-402 drive \(0x1000: 131473\)"),
        ((0x1000, 0), 0x00040192, ""),  # a stepper is one, too
    ],
)
def test_who_is_no_drive_is_refused(
    key: tuple[int, int], value: int, words: str, robot: cdprcal.Robot
) -> None:
    bench = Bench(at_once())
    bench.drives[3].dictionary.set(key, value)
    if words:
        with pytest.raises(BackendError, match=r"node 3 \(cable 3\): " + words):
            OnBench(bench, robot)
        assert bench.ends == [True]
    else:
        OnBench(bench, robot)


@pytest.mark.parametrize(
    ("wanted", "words"), [(1002, ""), (7, "has the serial number 1002, the session says 7")]
)
def test_a_serial_number_that_is_given_must_be_there(
    wanted: int, words: str, robot: cdprcal.Robot
) -> None:
    session = at_once(**{"node: 2\n": f"node: 2\n    serial_number: {wanted}\n"})
    if words:
        with pytest.raises(BackendError, match=words):
            OnBench(session, robot)
    else:
        OnBench(session, robot)
    bench = Bench(session)
    del bench.drives[2].dictionary.objects[0x1018, 4]
    with pytest.raises(BackendError, match="has the serial number None"):
        OnBench(bench, robot)


def test_a_drive_that_somebody_else_moves_may_be_read(robot: cdprcal.Robot) -> None:
    for armed in (False, True):
        bench = Bench(at_once())
        bench.drives[4].set_state(State.enabled)
        if armed:
            with pytest.raises(BackendError, match=r"node 4 .* is in operation enabled already"):
                OnBench(bench, robot)
            assert not any(bench.written.values())
        else:
            OnBench(bench, robot, armed=armed)


@pytest.mark.parametrize("count", [0, 1, 3, 200])
def test_errors_of_the_past_are_noted_the_newest_eight(count: int, robot: cdprcal.Robot) -> None:
    bench = Bench(at_once())
    dictionary = bench.drives[2].dictionary
    for at in range(1, 21):
        dictionary.add((0x1003, at), 0xAB7300 + at, 4)  # the upper half is the maker's own
    dictionary.set((0x1003, 0), count)
    notes = OnBench(bench, robot).backend.notes
    codes = ", ".join(f"0x{0x7300 + at:04X}" for at in range(1, min(count, 8) + 1))
    said = f"node 2 (cable 2): remembers the errors {codes}, newest first"
    assert notes == ([said] if count else [])


def test_a_drive_that_remembers_nothing_need_not(robot: cdprcal.Robot) -> None:
    bench = Bench(at_once())
    del bench.drives[2].dictionary.objects[0x1003, 0]
    del bench.drives[2].dictionary.objects[0x60C2, 1]
    assert OnBench(bench, robot).backend.notes == []
    assert len(bench.written[2]) == len(bench.written[1]) - 1


@pytest.mark.parametrize("mode", ["velocity", "torque"])
@pytest.mark.parametrize("abort", [True, False])
@pytest.mark.parametrize("timer", [True, False])
def test_a_drive_that_would_go_on_with_its_last_command_is_refused(
    mode: str, abort: bool, timer: bool, robot: cdprcal.Robot
) -> None:
    """Without an event timer it must notice silence by 0x6007, and motion must show the rest."""
    bench = Bench(at_once(**{"mode: velocity": f"mode: {mode}"}))
    if not abort:
        del bench.drives[3].dictionary.objects[0x6007, 0]
    if not timer:
        bench.without_timer = [3]
    on = OnBench(bench, robot)
    if not timer and (mode == "torque" or not abort):
        with pytest.raises(BackendError, match=r"node 3 .* has no event timer .* would go on with"):
            on.read()
        assert SWITCH_ON not in bench.words()
        return
    on.read()
    assert bench.watched is True
    about = {"no object 0x6007": not abort, "no event timer": not timer}
    expected = [words for words, missing in about.items() if missing]
    assert len(on.backend.notes) == len(expected)
    for note, words in zip(on.backend.notes, expected, strict=True):
        assert note.startswith(f"node 3 (cable 3): has {words}")


def test_a_rated_torque_that_is_another_one_is_refused(robot: cdprcal.Robot) -> None:
    bench = Bench(at_once())
    bench.drives[1].dictionary.set(cia402.RATED_TORQUE, 1200)
    with pytest.raises(BackendError, match=r"node 1 \(cable 1\): its rated torque"):
        OnBench(bench, robot)
    assert bench.ends == [True]


def test_position_limits_are_those_of_the_session_and_a_stop(robot: cdprcal.Robot) -> None:
    bench = Bench(at_once(**{"velocity_m_s: 0.4": "velocity_m_s: 0.4, travel_m: 0.5"}))
    del bench.drives[2].dictionary.objects[cia402.POSITION_LEAST]
    bench.drives[3].dictionary.set(cia402.POSITION_LEAST, -7)
    bench.drives[3].dictionary.set(cia402.POSITION_MOST, 9)
    on = OnBench(bench, robot)
    beyond_m = 0.5 + on.backend.limits["stop_distance_m"]
    assert [drive.get("travel_m") for drive in on.backend.limits["drives"]] == [
        pytest.approx(beyond_m), None, pytest.approx(7e-7), pytest.approx(beyond_m),
    ]  # fmt: skip
    bench.drives[3].dictionary.set(cia402.POSITION_LEAST, -8)
    on.backend.stop()
    for node, least in ((1, 0), (3, -7), (4, 0)):  # its own are back
        assert bench.drives[node].dictionary.get(cia402.POSITION_LEAST, signed=True) == least


# --- until it can be armed -----------------------------------------------------------------------


@pytest.mark.parametrize(("comes_s", "fine"), [(2.9, True), (3.2, False)])
def test_process_data_is_waited_for_and_no_longer_than_three_seconds(
    comes_s: float, fine: bool, robot: cdprcal.Robot
) -> None:
    session, clock, ahrs = at_once(), SimulatedClock(), Level()
    bench = Bench(session)
    bench.silent = {2}

    def come() -> None:
        if clock.now_s() >= comes_s:
            bench.silent.clear()

    bench.each_cycle = come
    if fine:
        OnBench(bench, robot, clock=clock)
        return
    with pytest.raises(BackendError, match=r"node 2 \(cable 2\): does not send its process data"):
        OnBench(bench, robot, clock=clock, ahrs=ahrs)
    # What was opened is closed.
    assert bench.ends == [True]
    assert ahrs.closed == 1


def test_what_nodes_complain_of_while_it_is_waited_for_is_said(robot: cdprcal.Robot) -> None:
    bench = Bench(at_once())
    bench.silent = {2}
    bench.complaints = ["one", "two"]
    with pytest.raises(BackendError, match="one; two"):
        OnBench(bench, robot)


def test_an_attitude_is_waited_for_and_no_longer_than_two_seconds(robot: cdprcal.Robot) -> None:
    OnBench(at_once(), robot, ahrs=Level(begins_s=1.9))
    with pytest.raises(BackendError, match="the AHRS sends no attitude"):
        OnBench(at_once(), robot, ahrs=Level(begins_s=2.2))


def test_a_robot_need_not_have_an_ahrs(robot: cdprcal.Robot) -> None:
    session = at_once()
    bench = Bench(session)
    backend = FieldbusBackend(session, robot, bench, None, SimulatedClock(), armed=True)
    sample = backend.read()
    assert sample.drive_error == ""
    assert np.isnan(sample.roll_pitch_yaw_rad).all()
    assert math.isnan(sample.attitude_time_s)
    assert backend.settings["ahrs"] is None
    backend.stop()
    assert bench.ends == [True]


# --- arming --------------------------------------------------------------------------------------


def test_all_are_switched_on_before_the_first_is_enabled(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)
    waited = len(on.bench.cycles)
    on.bench.drives[3].quirks.stays_in_mode = 0  # it takes its time

    def later() -> None:
        if len(on.bench.cycles) == waited + 30:
            on.bench.drives[3].quirks.stays_in_mode = None

    on.bench.each_cycle = later
    on.read()
    words = on.bench.words()[waited:]
    # The first of arming goes by what the drives said before.
    assert words[:3] == [SHUTDOWN, SWITCH_ON, SWITCH_ON]
    assert set(words[3:30]) == {SWITCH_ON}
    assert words[-2:] == [ENABLE, ENABLE]
    assert ENABLE not in words[:30]
    assert {drive.state for drive in on.bench.drives.values()} == {State.enabled}
    for outputs in on.bench.cycles[waited:]:
        for values in outputs.values():
            assert values[cia402.MODE] == cia402.CSV
            assert values[cia402.TARGET_VELOCITY] == 0
    on.read()
    assert on.bench.words()[-1] == ENABLE


@pytest.mark.parametrize(
    ("state", "words"),
    [(State.quick_stop, [STOP, ENABLE, ENABLE]), (State.switch_on_disabled, [SHUTDOWN, SWITCH_ON])],
)
def test_drives_that_hold_are_enabled_from_where_they_are(
    state: State, words: list[int], robot: cdprcal.Robot
) -> None:
    bench = Bench(without_brakes())
    held(bench, state)
    on = OnBench(bench, robot)
    waited = len(bench.cycles)
    seen: set[State] = set()
    bench.each_cycle = lambda: seen.update(drive.state for drive in bench.drives.values())
    on.read()
    said = bench.words()[waited:]
    if state is State.quick_stop:
        assert set(said) == {STOP, ENABLE}
        assert seen == {State.quick_stop, State.enabled}
    else:
        assert said[:2] == words


def test_with_brakes_a_drive_that_holds_is_switched_off_first(robot: cdprcal.Robot) -> None:
    bench = Bench(at_once())
    held(bench, State.quick_stop)
    on = OnBench(bench, robot)
    on.read()
    words = bench.words()
    assert words[0] == OFF
    assert SWITCH_ON in words[: words.index(ENABLE)]


@pytest.mark.parametrize(
    ("brakes", "words"),
    [(True, "does not become switched on"), (False, "does not become operation enabled")],
)
def test_a_drive_that_stays_in_quick_stop_is_given_up(
    brakes: bool, words: str, robot: cdprcal.Robot
) -> None:
    """Without brakes that is where it waits for its turn, and no longer."""
    bench = Bench((at_once if brakes else without_brakes)())
    held(bench, State.quick_stop)
    on = OnBench(bench, robot)
    stays = bench.drives[3]
    stays.quirks.deaf = True
    stays.dictionary.objects[cia402.QUICK_STOP_OPTION].data = b"\6\0"
    stays.set_state(State.quick_stop)
    with pytest.raises(BackendError, match=rf"{words}; it says: quick stop active"):
        on.read()
    assert (ENABLE in bench.words()) != brakes


@pytest.mark.parametrize(
    ("quirk", "words"),
    [
        ({"deaf": True}, "does not become switched on; it says: switch on disabled, error 0x0000"),
        ({"stays_in_mode": 0}, r"stays in mode of operation 0, not cyclic synchronous velocity"),
        ({"stays_in_mode": 8}, r"stays in mode of operation 8, not cyclic synchronous velocity"),
    ],
)
def test_a_drive_has_three_seconds_to_get_ready(
    quirk: dict[str, Any], words: str, robot: cdprcal.Robot
) -> None:
    on = OnBench(at_once(), robot)
    for key, value in quirk.items():
        setattr(on.bench.drives[3].quirks, key, value)
    began_s = on.clock.now_s()
    with pytest.raises(BackendError, match=rf"node 3 \(cable 3\): {words}"):
        on.read()
    assert 3.0 <= on.clock.now_s() - began_s <= 3.1
    assert ENABLE not in on.bench.words()
    # The others are told to stop, and nobody is armed a second time.
    assert on.bench.sent[-1][1][cia402.CONTROLWORD] == STOP
    with pytest.raises(BackendError, match=words):
        on.read()
    assert "node 3" in on.backend.tripped


def test_a_drive_that_does_not_enable_is_given_up_after_three_seconds(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)

    def deaf() -> None:
        if ENABLE in on.bench.words():
            on.bench.drives[3].set_state(State.switched_on)

    on.bench.each_cycle = deaf
    with pytest.raises(
        BackendError, match=r"node 3 \(cable 3\): does not become operation enabled"
    ):
        on.read()
    assert 3.0 <= on.clock.now_s() <= 3.2


def test_faults_of_the_past_are_reset_once_and_noted(robot: cdprcal.Robot) -> None:
    bench = Bench(at_once())
    bench.drives[2].fail(0x7305)
    del bench.drives[2].dictionary.objects[0x1003, 0]
    on = OnBench(bench, robot)
    waited = len(bench.cycles)

    def complain() -> None:
        if len(bench.cycles) == waited + 1:  # what has been waiting on the bus
            bench.complaints = ["node 4: EMCY"]

    bench.each_cycle = complain
    on.read()
    assert bench.words(2).count(RESET) == 1
    assert RESET not in bench.words(1)
    assert on.backend.notes == [
        "said before arming: node 4: EMCY",
        "node 2 (cable 2): fault 0x7305 was reset",
    ]


def test_nobody_is_told_to_reset_what_is_no_fault(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)
    on.read()
    assert not [word for node in range(1, 5) for word in on.bench.words(node) if word == RESET]


def test_what_goes_wrong_while_it_is_armed_stops_it(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)

    def complain() -> None:
        if ENABLE in on.bench.words():
            on.bench.complaints = ["this", "that"]

    on.bench.each_cycle = complain
    with pytest.raises(BackendError, match="while the drives were armed: this; that; see what"):
        on.read()
    assert on.bench.sent[-1][1][cia402.CONTROLWORD] == STOP


@pytest.mark.parametrize(
    ("state", "before", "words"),
    [
        (State.enabled, SWITCH_ON, "is operation enabled while the drives are being armed"),
        (State.ready, ENABLE, "is ready to switch on while the drives are being armed"),
    ],
)
def test_a_drive_that_does_not_wait_for_its_turn_stops_all(
    state: State, before: int, words: str, robot: cdprcal.Robot
) -> None:
    on = OnBench(at_once(), robot)

    def hurry() -> None:
        if on.bench.words()[-1] == before:
            on.bench.drives[3].set_state(state)

    on.bench.each_cycle = hurry
    with pytest.raises(BackendError, match=rf"node 3 \(cable 3\): {words}"):
        on.read()
    assert on.clock.now_s() < 0.2


def test_whoever_thinks_about_it_for_a_minute_is_not_late(robot: cdprcal.Robot) -> None:
    """Before arming and before a dry run nobody keeps the cycle."""
    for armed in (True, False):
        on = OnBench(at_once(), robot, armed=armed)
        on.clock.sleep_until(on.clock.now_s() + 60.0)
        began_s = on.clock.now_s()
        sample = on.read()
        assert sample.drive_error == ""
        assert sample.time_s == 0.0
        assert on.read().time_s == pytest.approx(0.01)
        assert on.clock.now_s() - began_s < 1.0


def test_nobody_is_late_while_drives_are_set_up(robot: cdprcal.Robot) -> None:
    """What they are told between two cycles takes its time, and nobody has power yet."""
    on = OnBench(at_once(), robot)
    waited = len(on.bench.cycles)

    def dawdle() -> None:
        if len(on.bench.cycles) in (waited + 1, waited + 2):
            on.clock.sleep_until(on.clock.now_s() + 0.05)

    on.bench.each_cycle = dawdle
    assert on.read().drive_error == ""


# --- wiggles -------------------------------------------------------------------------------------

#: How cables of an elastic platform answer: newtons of one a metre of another.
STIFF_N_M = -2e4 * np.outer([1.0, -1.1, 0.9, -0.3], [1.0, -1.1, 0.9, -0.3])


class Elastic:
    """Tensions of an elastic platform, with noise of 0.2 N; swapped: the first two load cells."""

    def __init__(self, *, swapped: bool = False, slack: float = 1.0, swings_N: float = 0.0) -> None:
        self.order = [1, 0, 2, 3] if swapped else [0, 1, 2, 3]
        self.random = np.random.default_rng(5)
        self.slack = slack
        self.swings_N = swings_N  # for 0.4 s after any motion
        self.went_m: list[list[float]] = []

    def __call__(self, out_m: list[float]) -> list[float]:
        self.went_m.append(out_m)
        tension_N = 100.0 + self.slack * STIFF_N_M @ out_m + self.random.normal(scale=0.2, size=4)
        if np.ptp(self.went_m[-40:], axis=0).any():
            tension_N += self.swings_N * (-1) ** len(self.went_m)
        return tension_N[self.order].tolist()  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    ("wiggle_m", "slack", "most_m"),
    [
        (0.002, 1.0, [0.0001, 0.0001, 0.0001, 0.0003]),  # the fourth pulls less than the others
        (0.002, 0.001, 0.002),
        (0.0007, 0.001, 0.00068),
        (0.00005, 1.0, 0.00004),
        (0.00003, 1.0, 0.0),
    ],
)
def test_each_cable_is_paid_out_until_it_is_answered_and_reeled_in_again(
    wiggle_m: float, slack: float, most_m: float | list[float], robot: cdprcal.Robot
) -> None:
    """By 40 µm a cycle; one at a time, each from where it stood."""
    bench = Bench(example_session(**{"brakes: true": f"brakes: true, wiggle_m: {wiggle_m}"}))
    bench.pulls = elastic = Elastic(slack=slack)
    on = OnBench(bench, robot)
    assert on.read().drive_error == ""
    went_m = np.array(elastic.went_m)
    assert went_m.max(axis=0) == pytest.approx(np.broadcast_to(most_m, 4), abs=6e-5)
    assert (went_m.max(axis=0) <= wiggle_m + 1e-12).all()
    assert went_m.min() == pytest.approx(0.0, abs=1e-12)
    assert went_m[-1] == pytest.approx(four(0.0), abs=1e-12)
    assert ((np.abs(went_m) > 1e-9).sum(axis=1) <= 1).all()
    if most_m:
        # One after the other, with a rest of a second before each of them and after the last.
        moved = [np.flatnonzero(went_m[:, at] > 1e-9) for at in range(4)]
        assert [int(found[0]) for found in moved] == sorted(int(found[0]) for found in moved)
        for found, following in itertools.pairwise(moved):
            assert following[0] - found[-1] >= 100
        rests = [np.flatnonzero(np.diff(went_m[:, at]) == 0.0) for at in range(4)]
        for found, still in zip(moved, rests, strict=True):
            assert len(np.intersect1d(found, still)) == 100  # at its furthest


def test_the_operator_is_heard_while_cables_are_wiggled(robot: cdprcal.Robot) -> None:
    """Within a cycle, at whatever cycle: no cable is moved any more."""
    session = example_session()
    for at in (3, 60, 110, 115, 200):
        bench = Bench(session)
        bench.pulls = Elastic()
        on = OnBench(bench, robot)
        on.backend.stop_if(lambda bench=bench, at=at: len(bench.cycles) >= at)  # type: ignore[misc]
        with pytest.raises(BackendError, match="stopped by the operator while the drives were"):
            on.read()
        assert len(bench.cycles) == at
        assert bench.sent[-1][1][cia402.CONTROLWORD] == STOP
        with pytest.raises(BackendError, match="stopped by the operator"):
            on.read()
        on.backend.stop()
        assert set(bench.words()[at:]) == {STOP}


def test_load_cells_that_are_swapped_are_found_before_anything_moves(robot: cdprcal.Robot) -> None:
    bench = Bench(example_session())
    bench.pulls = Elastic(swapped=True)
    on = OnBench(bench, robot)
    words = r"before anything moved: node 1 \(cable 1\): .* cables 1 and 2 swapped;.*; correct the"
    with pytest.raises(BackendError, match=words):
        on.read()
    assert on.bench.sent[-1][1][cia402.CONTROLWORD] == STOP


@pytest.mark.parametrize("swapped", [False, True])
def test_a_cycle_that_is_missed_hides_nothing(swapped: bool, robot: cdprcal.Robot) -> None:
    bench = Bench(example_session())
    bench.pulls = elastic = Elastic(swapped=swapped)
    on = OnBench(bench, robot)

    def miss() -> None:
        bench.silent = {2} if len(bench.cycles) % 7 == 0 else set()

    bench.each_cycle = miss
    if swapped:
        with pytest.raises(BackendError, match="cables 1 and 2 swapped"):
            on.read()
    else:
        assert on.read().drive_error == ""
    assert np.max(elastic.went_m) < 0.0005


def test_what_still_swings_is_not_taken_for_noise(robot: cdprcal.Robot) -> None:
    """Cables would be paid out until they answer louder than that."""
    bench = Bench(example_session())
    bench.pulls = elastic = Elastic(swings_N=3.0)
    assert OnBench(bench, robot).read().drive_error == ""
    assert np.max(elastic.went_m) < 0.0005


@pytest.mark.parametrize(
    ("late_s", "said", "words"),
    [
        (0.009, "", ""),
        (0.011, "", "the control cycle began 11 ms late"),
        (0.011, "EMCY", "EMCY"),  # which may be why
    ],
)
def test_the_cycle_is_kept_while_cables_are_wiggled(
    late_s: float, said: str, words: str, robot: cdprcal.Robot
) -> None:
    bench = Bench(example_session())
    bench.pulls = Elastic()
    on = OnBench(bench, robot)

    def dawdle() -> None:
        if len(bench.cycles) == 60:
            on.clock.sleep_until(on.clock.now_s() + 0.01 + late_s)
        elif len(bench.cycles) == 61 and said:
            bench.complaints = [said]

    bench.each_cycle = dawdle
    if words:
        with pytest.raises(BackendError, match=f"armed: {words}; see"):
            on.read()
    else:
        on.read()


# --- samples -------------------------------------------------------------------------------------


def test_a_sample_is_what_was_read_and_when(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot, ahrs=Level(ends_s=0.2))
    on.bench.pulls = lambda out_m: [101.0, 102.0, 103.0, 104.0]
    for cycle in range(3):
        sample = on.read()
        assert sample.time_s == sample.drives_time_s == sample.attitude_time_s == 0.01 * cycle
        assert sample.length_m.tolist() == [2.0] * 4
        assert sample.tension_N.tolist() == [101.0, 102.0, 103.0, 104.0]
        assert sample.swivel_rad.tolist() == [0.0] * 4
        assert sample.roll_pitch_yaw_rad.tolist() == [0.0] * 3
        assert sample.drive_error == ""
    on.bench.silent = {3}
    sample = on.read()
    assert (sample.time_s, sample.drives_time_s, sample.drive_error) == (0.03, 0.02, "")
    assert [math.isnan(value) for value in sample.length_m] == [False, False, True, False]
    assert [math.isnan(value) for value in sample.tension_N] == [False, False, True, False]
    on.bench.silent = set()
    assert on.read().drives_time_s == 0.04


def test_who_is_missed_in_the_first_sample_was_heard_before(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot, armed=False)
    on.bench.silent = {3}
    assert on.read().drives_time_s == 0.0


def test_a_robot_without_swivel_encoders_reads_none(robot: cdprcal.Robot) -> None:
    session = at_once()
    bare = [winch.model_copy(update={"swivel": None}) for winch in session.winches]
    on = OnBench(session.model_copy(update={"winches": bare}), robot)
    sample = on.read(5)
    assert sample.drive_error == ""
    assert np.isnan(sample.swivel_rad).all()


@pytest.mark.parametrize(("silent_s", "fine"), [(0.014, True), (0.016, False)])
def test_an_attitude_may_be_a_cycle_and_a_half_old(
    silent_s: float, fine: bool, robot: cdprcal.Robot
) -> None:
    on = OnBench(at_once(), robot)
    on.read()
    last_s = on.clock.now_s()
    on.ahrs._ends_s = last_s + 1e-4
    on.clock.sleep_until(last_s + silent_s)
    sample = on.read()
    assert (sample.drive_error == "") == fine
    assert sample.attitude_time_s == 0.0
    assert sample.roll_pitch_yaw_rad.tolist() == [0.0] * 3
    if not fine:
        assert sample.drive_error == "quick stop: the AHRS has been silent for 16 ms"


@pytest.mark.parametrize(("late_s", "fine"), [(0.009, True), (0.011, False)])
def test_a_cycle_may_begin_late_by_a_cycle(late_s: float, fine: bool, robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)
    began_s = on.read(3).time_s
    on.clock.sleep_until(on.clock.now_s() + 0.01 + late_s)
    sample = on.read()
    assert sample.time_s == pytest.approx(began_s + 0.01 + late_s)
    if fine:
        # The next one is when it would have been.
        assert sample.drive_error == ""
        assert on.read().time_s == pytest.approx(began_s + 0.02)
    else:
        assert sample.drive_error == "quick stop: the control cycle began 11 ms late"
        assert set(on.bench.words()[-1:]) == {STOP}
        assert on.read().time_s == pytest.approx(began_s + 0.03 + late_s - 0.01)
        assert on.read().drive_error == "quick stop: the control cycle began 11 ms late"


def test_what_nodes_complain_of_stops_the_winches(robot: cdprcal.Robot) -> None:
    """The first three, which is enough for a log."""
    on = OnBench(at_once(), robot)
    on.read()
    on.bench.complaints = ["a", "b", "c", "d"]
    assert on.read().drive_error == "quick stop: a; b; c"
    assert on.bench.sent[-1][4][cia402.CONTROLWORD] == STOP
    on.bench.complaints = ["e"]
    assert on.read().drive_error == "quick stop: a; b; c"
    assert on.backend.tripped == "a; b; c"


def test_a_bus_that_breaks_is_the_reason(robot: cdprcal.Robot) -> None:
    for way in ("read", "command"):
        on = OnBench(at_once(), robot)
        on.read()
        on.bench.broken = "the bus is gone"
        if way == "command":
            on.command()
            assert on.backend.tripped.startswith("the bus is gone")
        assert on.read().drive_error.startswith("quick stop: the bus is gone")


# --- commands ------------------------------------------------------------------------------------


def sent(on: OnBench) -> tuple[int, int, int]:
    """Mode, velocity and torque that the first winch was sent last."""
    values = on.bench.sent[-1][1]
    return values[cia402.MODE], values[cia402.TARGET_VELOCITY], values[cia402.TARGET_TORQUE]


def test_velocities_go_out_at_once_and_with_every_cycle(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)
    on.read()
    on.command(Command(velocity_m_s=np.array([0.1, 0.2, 0.3, -0.1])))
    velocities = [values[cia402.TARGET_VELOCITY] for values in on.bench.sent[-1].values()]
    assert velocities == [1_000_000, -2_000_000, 3_000_000, 1_000_000]
    on.read()
    assert on.bench.cycles[-1] == on.bench.sent[-1]
    on.command(Command(locked=True, velocity_m_s=four(0.1)))
    assert sent(on)[1] == 0


def test_what_a_winch_was_told_is_what_it_is_compared_with(robot: cdprcal.Robot) -> None:
    """At 0.2 m/s for a second nothing is wrong, and a drive that stands meanwhile is found."""
    on = OnBench(at_once(), robot)
    on.read()
    on.command(Command(velocity_m_s=four(0.2)))
    assert on.read(100).drive_error == ""
    on.bench.drives[2].quirks.gain = 0.0
    while not (said := on.read().drive_error):
        assert on.bench.paid_out_m[1] < 0.3
    assert said.startswith("quick stop: node 2 (cable 2): moved by")


@pytest.mark.parametrize(
    ("locked", "state", "by_tension", "mode"),
    [
        (False, StartUpState.moving, True, cia402.CST),
        (True, StartUpState.moving, True, cia402.CSV),
        (False, StartUpState.holding, True, cia402.CST),
        (False, StartUpState.holding, False, cia402.CSV),
        (False, StartUpState.done, False, cia402.CSV),
    ],
)
def test_torques_pull_while_tensions_lead(
    locked: bool, state: StartUpState, by_tension: bool, mode: int, robot: cdprcal.Robot
) -> None:
    for session, wanted in ((torque_session(**AT_ONCE), mode), (at_once(), cia402.CSV)):
        on = OnBench(session, robot)
        on.read()
        told = Command(
            locked=locked,
            state=state,
            tension_setpoint_N=four(102.0),
            by_tension=[by_tension] * 4,
        )
        on.command(told)
        assert sent(on)[0] == wanted
        assert sent(on)[2] == (-212 if wanted == cia402.CST else -208)
        assert on.read(30).drive_error == ""  # the new mode is what was wanted


def test_torques_that_a_drive_does_not_show_are_found(robot: cdprcal.Robot) -> None:
    on = OnBench(torque_session(**AT_ONCE), robot)
    on.read()
    on.command()
    assert on.read(20).drive_error == ""
    on.bench.drives[3].quirks.torque_factor = 0.5
    samples = [on.read().drive_error for _ in range(6)]
    assert samples[-1].startswith("quick stop: node 3 (cable 3): pulls with")


@pytest.mark.parametrize("locked", [True, False])
def test_load_cells_and_torques_are_compared_before_anything_moves(
    locked: bool, robot: cdprcal.Robot
) -> None:
    on = OnBench(at_once(), robot)
    on.bench.holds_N = {2: 300.0}
    on.read(3)
    on.command(Command(locked=locked, velocity_m_s=four(0.1)))
    if locked:
        assert on.backend.tripped == ""
        return
    words = "before anything moved: node 2 (cable 2): the motor's torque would hold 300 N"
    assert on.backend.tripped.startswith(words)
    assert on.bench.sent[-1][2][cia402.CONTROLWORD] == STOP
    assert not any(sent[2][cia402.TARGET_VELOCITY] for sent in on.bench.sent)


def test_they_are_compared_once(robot: cdprcal.Robot) -> None:
    """What is pulled later on is no longer what held the platform at rest."""
    on = OnBench(at_once(), robot)
    on.read(3)
    on.command()
    on.bench.holds_N = {2: 300.0}
    on.read(3)
    on.command()
    assert on.backend.tripped == ""


def test_the_first_sample_counts(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)
    on.bench.holds_N = {2: 300.0}
    on.read()
    on.bench.holds_N = {}
    on.command()
    assert "node 2" in on.backend.tripped


# --- the end -------------------------------------------------------------------------------------


def test_who_obeys_is_not_left_alone(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)
    on.read()
    on.bench.complaints = ["so"]
    for _ in range(10):
        on.backend.read()
    assert on.bench.abandoned == 0


@pytest.mark.parametrize("way", ["deaf", "silent", "silent once it stood"])
def test_who_does_not_obey_within_three_cycles_is_left_alone(
    way: str, robot: cdprcal.Robot
) -> None:
    on = OnBench(at_once(), robot)
    on.read()
    if way == "deaf":
        on.bench.drives[2].quirks.deaf = True
    on.bench.complaints = ["so"]
    on.backend.read()
    if way == "silent once it stood":
        on.backend.read()
    on.bench.silent = set() if way == "deaf" else {2}
    for cycle in range(1, 6):
        on.backend.read()
        assert (on.bench.abandoned > 0) == (cycle >= 3)


def test_in_a_dry_run_nobody_is_left_alone(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot, armed=False)
    on.read()
    on.bench.silent = {2}
    for _ in range(9):
        on.backend.read()
    assert on.backend.tripped == "node 2 (cable 2): does not answer"
    assert on.bench.abandoned == 0


def test_the_end_of_a_run(robot: cdprcal.Robot) -> None:
    """Quick stop until all stand, three times at least; brakes hold then."""
    on = OnBench(at_once(), robot)
    on.read()
    on.command(Command(velocity_m_s=four(0.2)))
    on.read(20)
    cycles, began_s = len(on.bench.cycles), on.clock.now_s()
    on.backend.stop()
    assert set(on.bench.words()[cycles:]) == {STOP}
    assert {drive.state for drive in on.bench.drives.values()} == {State.switch_on_disabled}
    assert 0.05 <= on.clock.now_s() - began_s <= 0.08  # 0.2 m/s at 4 m/s²
    assert on.bench.ends == [True]
    assert on.ahrs.closed == 1
    # That is all: nothing more is sent, and nothing has gone wrong.
    said = len(on.bench.sent)
    on.backend.stop()
    on.command(Command(velocity_m_s=four(0.2)))
    assert len(on.bench.sent) == said
    assert on.bench.ends == [True]
    assert on.backend.tripped == ""
    with pytest.raises(BackendError, match="the robot is stopped"):
        on.backend.read()
    assert set(on.bench.words()[cycles:]) == {STOP}


def test_three_quick_stops_are_said_to_who_stands_already(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)
    on.read()
    cycles = len(on.bench.cycles)
    on.backend.stop()
    assert len(on.bench.cycles) == cycles + 3


def test_a_drive_that_does_not_stand_is_given_a_second(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(**{"velocity_m_s: 0.4": "velocity_m_s: 0.4, travel_m: 0.5"}), robot)
    on.read()
    on.bench.drives[2].quirks.deaf = True
    began_s = on.clock.now_s()
    dictionary = on.bench.drives[2].dictionary
    least = dictionary.get(cia402.POSITION_LEAST)
    on.backend.stop()
    assert 0.98 <= on.clock.now_s() - began_s <= 1.02
    assert on.bench.ends == [True]
    # Its limits stay as they are: it may be running.
    assert dictionary.get(cia402.POSITION_LEAST) == least


def test_who_is_not_heard_is_not_waited_for(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)
    on.read()
    on.bench.silent = {2}
    began_s = on.clock.now_s()
    on.backend.stop()
    assert on.clock.now_s() - began_s <= 0.05


@pytest.mark.parametrize("broken", [False, True])
def test_without_brakes_drives_go_on_holding(broken: bool, robot: cdprcal.Robot) -> None:
    """Unless the bus is gone: then nothing may keep them from stopping by themselves."""
    on = OnBench(without_brakes(), robot)
    on.read()
    on.bench.broken = "gone" if broken else ""
    began_s = on.clock.now_s()
    on.backend.stop()
    assert on.bench.ends == [broken]
    assert on.ahrs.closed == 1
    assert on.clock.now_s() - began_s <= 0.05
    if not broken:
        assert {drive.state for drive in on.bench.drives.values()} == {State.quick_stop}


@pytest.mark.parametrize("state", list(State))
@pytest.mark.parametrize("brakes", [True, False])
def test_which_states_stand(brakes: bool, state: State, robot: cdprcal.Robot) -> None:
    """Any without power; in quick stop only who is to hold. Who reacts to a fault still moves."""
    standing = {State.switch_on_disabled, State.fault}
    standing |= {State.ready, State.not_ready} if brakes else {State.quick_stop}
    on = OnBench((at_once if brakes else without_brakes)(), robot)
    on.read()
    stays = on.bench.drives[2]
    stays.quirks.deaf = True
    stays.step = lambda duration_s: None  # type: ignore[method-assign]
    on.bench.each_cycle = lambda: stays.set_state(state)
    began_s = on.clock.now_s()
    on.backend.stop()
    assert (on.clock.now_s() - began_s < 0.1) == (state in standing)


def test_the_reason_of_a_stop_is_kept(robot: cdprcal.Robot) -> None:
    on = OnBench(at_once(), robot)
    on.read()
    on.bench.complaints = ["so"]
    on.backend.read()
    on.backend.stop()
    assert on.backend.tripped == "so"
    with pytest.raises(BackendError, match="so"):
        on.backend.read()


def test_a_session_that_does_not_fit_opens_nothing(robot: cdprcal.Robot) -> None:
    bench = Bench(at_once(**{"robot: irma4": "robot: irma8"}))
    with pytest.raises(cdprcal.InputError, match="is of robot irma8"):
        OnBench(bench, robot)
    assert bench.ends == []
    assert bench.outputs is None
