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
