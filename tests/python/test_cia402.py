"""The state machine of CiA-402, and how process data is packed."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.cia402 import Goal, State
from cdprcal.hardware.drives.process_data import (
    DRIVE_INPUTS,
    DRIVE_OUTPUTS,
    Entry,
    pack,
    split_into_pdos,
    unpack,
)
from cdprcal.hardware.drives.winch import Counter

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


@given(st.lists(st.integers(-(2**14), 2**14), max_size=50), st.integers(-(2**15), 2**15 - 1))
def test_a_counter_goes_on_where_its_encoder_wraps(steps: list[int], start: int) -> None:
    counter = Counter(16)
    true = start
    assert counter.follow(start) == start
    for step in steps:
        true += step
        assert counter.follow((true + 2**15) % 2**16 - 2**15) == true
