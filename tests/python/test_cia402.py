"""The state machine of CiA-402, how process data is packed, and what a winch makes of it."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.cia402 import Goal, State
from cdprcal.hardware.drives.process_data import (
    DRIVE_INPUTS,
    DRIVE_OUTPUTS,
    Entry,
    Values,
    pack,
    split_into_pdos,
    unpack,
)
from cdprcal.hardware.drives.winch import (
    Counter,
    WinchState,
    tension_of_torque_N,
    torque_counts,
)
from cdprcal.hardware.session import Session
from winch_bus import example_session

#: Statuswords as drives send them, other bits set too: voltage enabled, remote, target reached.
WORDS = {
    0x0000: State.not_ready,
    0x0250: State.switch_on_disabled,
    0x0231: State.ready,
    0x0233: State.switched_on,
    0x1637: State.enabled,
    0x0217: State.quick_stop,
    0x021F: State.fault_reaction,
    0x0218: State.fault,
}


#: Object dictionary and values of IEC 61800-7-201 (CiA 402-2) and CiA 301, written off once more.
STANDARD = {
    "CONTROLWORD": (0x6040, 0),
    "STATUSWORD": (0x6041, 0),
    "ERROR_CODE": (0x603F, 0),
    "ERROR_HISTORY": 0x1003,
    "ABORT_CONNECTION_OPTION": (0x6007, 0),
    "QUICK_STOP_OPTION": (0x605A, 0),
    "MODE": (0x6060, 0),
    "MODE_DISPLAY": (0x6061, 0),
    "POSITION": (0x6064, 0),
    "TARGET_TORQUE": (0x6071, 0),
    "MAX_TORQUE": (0x6072, 0),
    "RATED_TORQUE": (0x6076, 0),
    "TORQUE": (0x6077, 0),
    "POSITION_LEAST": (0x607D, 1),
    "POSITION_MOST": (0x607D, 2),
    "MAX_MOTOR_SPEED": (0x6080, 0),
    "QUICK_STOP_DECELERATION": (0x6085, 0),
    "TARGET_VELOCITY": (0x60FF, 0),
    "INTERPOLATION_PERIOD": (0x60C2, 1),
    "INTERPOLATION_EXPONENT": (0x60C2, 2),
    "CSV": 9,
    "CST": 10,
    "QUICK_STOP_THEN_OFF": 2,
    "QUICK_STOP_AND_STAY": 6,
    "ABORT_CONNECTION_QUICK_STOP": 3,
    "DISABLE_VOLTAGE": 0b0000,
    "QUICK_STOP": 0b0010,
    "SHUTDOWN": 0b0110,
    "SWITCH_ON": 0b0111,
    "ENABLE_OPERATION": 0b1111,
    "FAULT_RESET": 0b1000_0000,
}


def test_objects_and_values_are_those_of_the_standard() -> None:
    """The simulated drives know them by the same names: a wrong one would be so on both sides."""
    named = {name: value for name, value in vars(cia402).items() if name.isupper()}
    assert {name: value for name, value in named.items() if not name.startswith("_")} == STANDARD


def test_which_states_carry_torque() -> None:
    powered = {state for state in State if state.powered}
    assert powered == {State.enabled, State.quick_stop, State.fault_reaction}


#: The word for each goal, from each state: transitions 2 to 4, 7 to 12 of the standard.
SENT = {
    Goal.off: dict.fromkeys(State, 0),
    Goal.quick_stop: dict.fromkeys(State, 2),
    Goal.switched_on: dict.fromkeys(State, 0)
    | {State.switch_on_disabled: 0b0110, State.ready: 0b0111}
    | {State.switched_on: 0b0111, State.enabled: 0b0111},
    Goal.enabled: dict.fromkeys(State, 0)
    | {State.switch_on_disabled: 0b0110, State.ready: 0b0111}
    | {State.switched_on: 0b1111, State.enabled: 0b1111},
}


@pytest.mark.parametrize("goal", list(Goal))
@pytest.mark.parametrize("state", list(State))
def test_which_word_is_sent(goal: Goal, state: State) -> None:
    assert cia402.controlword(goal, state) == SENT[goal][state]


@pytest.mark.parametrize("stays", [False, True])
@pytest.mark.parametrize("state", [s for s in State if s is not State.fault])
@pytest.mark.parametrize("word", range(16))
def test_what_a_drive_makes_of_a_word(word: int, state: State, stays: bool) -> None:
    """Table 28 of the standard: bits that do not matter there are set and clear here."""
    made = cia402.next_state(state, word, 0, stays=stays)
    assert made is expected(word, state, stays)


def expected(word: int, state: State, stays: bool) -> State:
    if state in (State.not_ready, State.fault_reaction):
        return state  # it leaves these by itself
    if not word & 0b0010:
        return State.switch_on_disabled
    if not word & 0b0100:
        powered = state in (State.enabled, State.quick_stop)
        return State.quick_stop if powered else State.switch_on_disabled
    if state is State.quick_stop:
        return State.enabled if stays and word == 0b1111 else state
    if not word & 0b0001:
        return State.ready
    if word == 0b0111:
        return state if state is State.switch_on_disabled else State.switched_on
    further = {State.ready: State.switched_on, State.switched_on: State.enabled}
    return further.get(state, state)


@pytest.mark.parametrize("word", WORDS)
def test_states_by_statusword(word: int) -> None:
    assert cia402.state_of(word) is WORDS[word]


def test_every_state_has_its_word() -> None:
    for state in State:
        assert cia402.state_of(cia402.statusword_of(state)) is state


@given(st.integers(0, 0xFFFF))
def test_any_word_is_some_state(word: int) -> None:
    assert cia402.state_of(word) in State


def run(state: State, goal: Goal, steps: int = 6) -> list[State]:
    path, before = [state], 0
    for _ in range(steps):
        word = cia402.controlword(goal, path[-1])
        path.append(cia402.next_state(path[-1], word, before))
        before = word
    return path


@pytest.mark.parametrize("state", [s for s in State if s not in (
    State.not_ready, State.fault, State.fault_reaction)])  # fmt: skip
def test_a_drive_is_enabled_step_by_step(state: State) -> None:
    path = run(state, Goal.enabled)
    assert path[-1] is State.enabled
    # Never out of quick stop straight back into operation.
    assert (State.quick_stop, State.enabled) not in list(itertools.pairwise(path))


@pytest.mark.parametrize("state", list(State))
@pytest.mark.parametrize("goal", [Goal.off, Goal.quick_stop])
def test_no_drive_stays_or_gets_enabled_otherwise(state: State, goal: Goal) -> None:
    assert State.enabled not in run(state, goal)[1:]


@pytest.mark.parametrize("goal", list(Goal))
def test_without_brakes_a_drive_in_quick_stop_is_never_switched_off(goal: Goal) -> None:
    word = cia402.controlword(goal, State.quick_stop, holds=True)
    state = cia402.next_state(State.quick_stop, word, 0, stays=True)
    assert state is (State.enabled if goal is Goal.enabled else State.quick_stop)
    # Where quick stop ends in switched off, nothing leads straight back.
    assert cia402.next_state(State.quick_stop, word, 0) is State.quick_stop
    # Any other state is as with brakes.
    for other in set(State) - {State.quick_stop}:
        assert cia402.controlword(goal, other, holds=True) == cia402.controlword(goal, other)


@pytest.mark.parametrize("state", [s for s in State if s not in (
    State.not_ready, State.fault, State.fault_reaction)])  # fmt: skip
def test_no_power_before_it_is_wanted(state: State) -> None:
    """Switched on is the last stop before operation enabled."""
    path = run(state, Goal.switched_on)
    assert path[-1] is State.switched_on
    assert State.enabled not in path[1:]


def test_a_fault_is_left_by_a_rising_reset_alone() -> None:
    for word in (*range(0x80), 0x06, 0x0F):
        assert cia402.next_state(State.fault, word, 0) is State.fault
    reset = cia402.FAULT_RESET
    assert cia402.next_state(State.fault, reset, reset) is State.fault
    assert cia402.next_state(State.fault, reset, 0) is State.switch_on_disabled


def test_pdos_hold_eight_bytes() -> None:
    outputs = split_into_pdos(DRIVE_OUTPUTS)
    assert [[entry.key[0] for entry in pdo] for pdo in outputs] == [
        [0x6040, 0x6060, 0x60FF],
        [0x6071],
    ]
    assert all(sum(e.bits for e in pdo) <= 64 for pdo in split_into_pdos(DRIVE_INPUTS * 3))
    assert Entry((0x60FF, 0), 32, True).mapping == 0x60FF0020


@given(st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**16 - 1))
def test_packing_is_undone_by_unpacking(velocity: int, word: int) -> None:
    entries = split_into_pdos(DRIVE_OUTPUTS)[0]
    values = {cia402.CONTROLWORD: word, cia402.MODE: 9, cia402.TARGET_VELOCITY: velocity}
    data = pack(entries, values)
    assert len(data) == 7
    assert unpack(entries, data) == values
    assert unpack(entries, data[:-1]) is None
    assert unpack(entries, data + b"\0") is None


def test_values_beyond_their_type_are_cut() -> None:
    entry = Entry((0x6071, 0), 16, True)
    assert pack([entry], {entry.key: 40000}) == b"\xff\x7f"
    assert pack([entry], {entry.key: -40000}) == b"\x00\x80"


@given(st.lists(st.integers(1 - 2**15, 2**15 - 1), max_size=50), st.integers(-(2**15), 2**15 - 1))
def test_a_counter_goes_on_where_its_encoder_wraps(steps: list[int], start: int) -> None:
    counter = Counter(16)
    true = start
    assert counter.follow(start) == start
    for step in steps:
        true += step
        assert counter.follow((true + 2**15) % 2**16 - 2**15) == true


# --- a winch in physical units -------------------------------------------------------------------

#: Its load cell counts backwards from 200; valid from -3000 to 5000 counts.
_CELL = {
    "counts_per_N: 1000, valid_counts: [-50000, 600000]": "sign: -1, zero_counts: 200, "
    "counts_per_N: 4, valid_counts: [-3000, 5000]"
}


def winch(session: Session, cable: int = 2) -> WinchState:
    return WinchState(session.winches[cable - 1], session)


def said(
    *, counts: int = 0, cell: int = -200, swivel: int = 0, torque: int = 250,
    state: State = State.enabled,
) -> Values:  # fmt: skip
    """Inputs of one winch of the example."""
    return {
        cia402.STATUSWORD: cia402.statusword_of(state),
        cia402.MODE_DISPLAY: cia402.CST,
        cia402.ERROR_CODE: 0x7305,
        cia402.POSITION: counts,
        cia402.TORQUE: torque,
        (0x2401, 1): cell,
        (0x60E4, 2): swivel,
    }


@pytest.mark.parametrize("sign", [1, -1])
def test_torque_pulls_against_the_growing_count(sign: int) -> None:
    """240 N on a drum of 50 mm are 12 Nm, at 10:1 1.2 Nm: half of the rated 2.4."""
    torque = example_session().winches[0].torque
    assert torque is not None
    assert torque_counts(torque, sign, 240.0) == pytest.approx(-500.0 * sign)
    assert tension_of_torque_N(torque, sign, -500.0 * sign) == pytest.approx(240.0)


@pytest.mark.parametrize("cable", [1, 2])
def test_readings_in_physical_units(cable: int) -> None:
    """The second winch and its swivel encoder count the other way round."""
    sign = 1 if cable == 1 else -1
    one = winch(example_session(**_CELL), cable)
    one.take({cable: said(counts=25_000_000, cell=-200, swivel=131_072)})
    assert one.length_m == pytest.approx(2.5 * sign)
    assert one.tension_N == pytest.approx(100.0)
    assert one.swivel_rad == pytest.approx(sign * math.pi / 4.0)
    assert one.torque_tension_N == pytest.approx(-120.0 * sign)
    assert (one.state, one.mode, one.error_code) == (State.enabled, cia402.CST, 0x7305)
    assert (one.position_counts, one.load_cell_counts, one.swivel_counts) == (
        25_000_000, -200, 131_072)  # fmt: skip
    assert one.statusword == cia402.statusword_of(State.enabled)


def test_a_winch_that_never_spoke_is_known_for_nothing() -> None:
    one = winch(example_session())
    assert (one.missed, one.load_cell_missed, one.swivel_missed) == (0, 0, 0)
    for times in (0, 1, 2):
        if times:
            one.take({1: said()})  # another one speaks
        assert (one.missed, one.load_cell_missed, one.swivel_missed) == (times,) * 3
        assert (one.state, one.statusword, one.error_code) == (State.not_ready, 0, 0)
        assert one.mode == cia402.CSV  # what it is going to be told
        assert one.position_counts is one.load_cell_counts is one.swivel_counts is None
        for value in (one.length_m, one.tension_N, one.swivel_rad, one.torque_tension_N):
            assert math.isnan(value)


def test_what_did_not_come_keeps_nothing_but_the_drives_state() -> None:
    one = winch(example_session())
    one.take({2: said()})
    one.take({})
    assert (one.state, one.mode, one.error_code) == (State.enabled, cia402.CST, 0x7305)
    assert (one.missed, one.load_cell_missed, one.swivel_missed) == (1, 1, 1)
    for value in (one.length_m, one.tension_N, one.swivel_rad, one.speed_m_s):
        assert math.isnan(value)
    assert one.load_cell_counts is one.swivel_counts is None
    one.take({2: said()})
    assert (one.missed, one.load_cell_missed, one.swivel_missed) == (0, 0, 0)


@pytest.mark.parametrize(
    ("cell", "tension_N"),
    [(-3001, math.nan), (-3000, 800.0), (0, 50.0), (5000, -1200.0), (5001, math.nan)],
)
def test_valid_counts_are_those_that_a_whole_wire_can_give(cell: int, tension_N: float) -> None:
    one = winch(example_session(**_CELL))
    one.take({2: said()})
    one.take({2: said(cell=cell)})
    assert one.tension_N == pytest.approx(tension_N, nan_ok=True)
    assert one.load_cell_missed == math.isnan(tension_N)
    assert one.load_cell_counts == cell


def test_speed_is_that_of_the_last_five_cycles() -> None:
    one = winch(example_session())
    for k in range(8):
        assert math.isnan(one.speed_m_s) == (k <= 5)
        if k > 5:  # of 1000 k² counts: k = 1 and 6, then 2 and 7
            assert one.speed_m_s == pytest.approx(-1e-4 * ((k - 1) ** 2 - (k - 6) ** 2) / 0.05)
        one.take({2: said(counts=1000 * k * k)})
    for k in range(7):
        one.take({2: said()} if k else {})  # a cycle is missed
        assert math.isnan(one.speed_m_s) == (k in (0, 5))


def test_lengths_and_angles_go_on_where_their_encoders_wrap() -> None:
    ends = (2**31 - 1, -(2**31))
    one = winch(example_session(), 1)
    for count in ends:
        one.take({1: said(counts=count, swivel=count)})
    assert one.length_m == pytest.approx(2.0**31 / 1e7, abs=1e-9)
    assert one.swivel_counts == 2**31
    short = winch(
        example_session(**{"type: int32, counts_per_turn": "type: uint16, counts_per_turn"}), 1
    )
    for count in (0xFFFF, 0):
        short.take({1: said(swivel=count)})
    assert short.swivel_counts == 0x10000


def test_sensors_may_be_on_nodes_of_their_own() -> None:
    session = example_session(**{"load_cell: {": "load_cell: {node: 20, ",
                                 "swivel: {": "swivel: {node: 21, "})  # fmt: skip
    one = winch(session)
    drive = said()
    sensors = {20: {(0x2401, 1): drive.pop((0x2401, 1))}, 21: {(0x60E4, 2): drive.pop((0x60E4, 2))}}
    one.take({2: drive, **sensors})
    assert (one.load_cell_counts, one.swivel_counts) == (-200, 0)
    one.take({2: drive, 21: sensors[21]})
    assert (one.missed, one.load_cell_missed, one.swivel_missed) == (0, 1, 0)
    one.take({2: drive, 20: sensors[20]})
    assert (one.missed, one.load_cell_missed, one.swivel_missed) == (0, 0, 1)


def test_a_winch_without_swivel_encoder_misses_none() -> None:
    session = example_session()
    one = WinchState(session.winches[1].model_copy(update={"swivel": None}), session)
    one.take({2: said()})
    one.take({})
    assert one.swivel_missed == 0
    assert one.swivel_counts is None


@pytest.mark.parametrize(
    ("mode", "tension_N", "torque"),
    [
        (cia402.CST, 48.0, 100),
        (cia402.CST, math.nan, 250),
        (cia402.CSV, 48.0, 250),
        (cia402.CSV, math.nan, 250),
    ],
)
def test_torque_is_what_is_wanted_in_torque_mode_and_else_what_holds(
    mode: int, tension_N: float, torque: int
) -> None:
    one = winch(example_session())
    one.take({2: said(torque=250)})
    out = one.output(Goal.enabled, mode, -0.25, tension_N)
    assert out == {
        cia402.CONTROLWORD: cia402.ENABLE_OPERATION,
        cia402.MODE: mode,
        cia402.TARGET_VELOCITY: 2_500_000,
        cia402.TARGET_TORQUE: torque,
    }


def test_commands_that_are_no_number_are_standstill_and_the_least_tension() -> None:
    """Nobody knows yet what holds the platform."""
    one = winch(example_session())
    for velocity_m_s in (math.nan, math.inf, -math.inf):
        out = one.output(Goal.enabled, cia402.CST, velocity_m_s, math.nan)
        assert out[cia402.TARGET_VELOCITY] == 0
        assert out[cia402.TARGET_TORQUE] == 21  # 10 N


def test_units_of_velocity_are_the_drives_own() -> None:
    unit = "counts_per_m: 1e7"
    one = winch(example_session(**{unit: f"{unit}\n    velocity_units_per_m_s: 1000"}))
    out = one.output(Goal.enabled, cia402.CSV, 0.1236, math.nan)
    assert out[cia402.TARGET_VELOCITY] == -124


def test_a_winch_without_a_drum_is_told_no_torque() -> None:
    session = example_session()
    one = WinchState(session.winches[1].model_copy(update={"torque": None}), session)
    one.take({2: said()})
    assert math.isnan(one.torque_tension_N)
    assert one.output(Goal.enabled, cia402.CSV, 0.0, 50.0)[cia402.TARGET_TORQUE] == 0


@pytest.mark.parametrize(
    ("brakes", "word"), [("true", cia402.DISABLE_VOLTAGE), ("false", cia402.ENABLE_OPERATION)]
)
def test_without_brakes_a_drive_that_holds_is_enabled_from_there(brakes: str, word: int) -> None:
    one = winch(example_session(**{"brakes: true": f"brakes: {brakes}"}))
    one.take({2: said(state=State.quick_stop)})
    assert one.output(Goal.enabled, cia402.CSV, 0.0, 50.0)[cia402.CONTROLWORD] == word
