"""CiA-402 (IEC 61800-7-201): the drive's state machine, its words and its objects.

Pure functions of statusword and controlword, for any bus.
"""

from __future__ import annotations

from enum import Enum

# Objects, by (index, subindex).
CONTROLWORD = (0x6040, 0)
STATUSWORD = (0x6041, 0)
ERROR_CODE = (0x603F, 0)
ERROR_HISTORY = 0x1003  #: subindex 0: how many errors, then the newest first
ABORT_CONNECTION_OPTION = (0x6007, 0)
QUICK_STOP_OPTION = (0x605A, 0)
MODE = (0x6060, 0)
MODE_DISPLAY = (0x6061, 0)
POSITION = (0x6064, 0)
TARGET_TORQUE = (0x6071, 0)
MAX_TORQUE = (0x6072, 0)  #: ‰ of rated
RATED_TORQUE = (0x6076, 0)  #: mNm
TORQUE = (0x6077, 0)  #: actual, ‰ of rated
POSITION_LEAST, POSITION_MOST = (0x607D, 1), (0x607D, 2)  #: software limits; equal: none
MAX_MOTOR_SPEED = (0x6080, 0)  #: turns per minute
QUICK_STOP_DECELERATION = (0x6085, 0)
TARGET_VELOCITY = (0x60FF, 0)
INTERPOLATION_PERIOD = (0x60C2, 1)
INTERPOLATION_EXPONENT = (0x60C2, 2)

# Modes of operation.
CSV = 9  #: cyclic synchronous velocity
CST = 10  #: cyclic synchronous torque

# Quick stop option codes: slow down on the quick stop ramp, then …
QUICK_STOP_THEN_OFF = 2  #: … switch on disabled: brakes hold
QUICK_STOP_AND_STAY = 6  #: … stay in quick stop active: the drive holds

ABORT_CONNECTION_QUICK_STOP = 3  #: the bus is lost: quick stop

# Controlwords.
DISABLE_VOLTAGE = 0x0000
QUICK_STOP = 0x0002
SHUTDOWN = 0x0006
SWITCH_ON = 0x0007
ENABLE_OPERATION = 0x000F
FAULT_RESET = 0x0080


class State(Enum):
    """States of the drive's state machine."""

    not_ready = "not ready to switch on"
    switch_on_disabled = "switch on disabled"
    ready = "ready to switch on"
    switched_on = "switched on"
    enabled = "operation enabled"
    quick_stop = "quick stop active"
    fault_reaction = "fault reaction active"
    fault = "fault"

    @property
    def powered(self) -> bool:
        """Whether the motor carries torque."""
        return self in (State.enabled, State.quick_stop, State.fault_reaction)


class Goal(Enum):
    """What a drive is wanted to do."""

    off = "off"
    switched_on = "switched on"  #: ready, without power at the motor: the last stop before it
    enabled = "enabled"
    quick_stop = "quick stop"


#: Statusword bits of each state: (mask, value), table 29 of IEC 61800-7-201.
_BITS = {
    State.not_ready: (0x4F, 0x00),
    State.switch_on_disabled: (0x4F, 0x40),
    State.ready: (0x6F, 0x21),
    State.switched_on: (0x6F, 0x23),
    State.enabled: (0x6F, 0x27),
    State.quick_stop: (0x6F, 0x07),
    State.fault_reaction: (0x4F, 0x0F),
    State.fault: (0x4F, 0x08),
}


def state_of(statusword: int) -> State:
    """The state that a statusword tells; a word of no state counts as not ready."""
    for state, (mask, value) in _BITS.items():
        if statusword & mask == value:
            return state
    return State.not_ready


def statusword_of(state: State) -> int:
    """The bits of a state, as a drive sets them."""
    return _BITS[state][1]


#: The next controlword on the way to operation enabled.
_ENABLE = {
    State.not_ready: DISABLE_VOLTAGE,
    State.switch_on_disabled: SHUTDOWN,
    State.ready: SWITCH_ON,
    State.switched_on: ENABLE_OPERATION,
    State.enabled: ENABLE_OPERATION,
    # Operation may be enabled again from there; whoever stopped it must want that: through off.
    State.quick_stop: DISABLE_VOLTAGE,
    State.fault_reaction: DISABLE_VOLTAGE,
    State.fault: DISABLE_VOLTAGE,
}


def controlword(goal: Goal, state: State, *, holds: bool = False) -> int:
    """The word to send now, from what the drive said last, towards a goal. Faults stay.

    holds: there are no brakes; a drive that holds the platform in quick stop is never switched off
    on its way, but enabled from there (transition 16).
    """
    if holds and state is State.quick_stop:
        return ENABLE_OPERATION if goal is Goal.enabled else QUICK_STOP
    if goal is Goal.enabled:
        return _ENABLE[state]
    if goal is Goal.switched_on:
        return SWITCH_ON if state in (State.switched_on, State.enabled) else _ENABLE[state]
    return QUICK_STOP if goal is Goal.quick_stop else DISABLE_VOLTAGE


def next_state(state: State, word: int, before: int, *, stays: bool = False) -> State:
    """What a drive makes of a controlword (``before``: the one before), as figure 12 says.

    stays: its quick stop option is one of those that stay there, and may be left for operation.
    Quick stop and fault reaction end by themselves and are not taken further here.
    """
    if state is State.fault:
        rising = word & FAULT_RESET and not before & FAULT_RESET
        return State.switch_on_disabled if rising else state
    if state in (State.not_ready, State.fault_reaction):
        return state
    if not word & 0x02:  # disable voltage
        return State.switch_on_disabled
    if not word & 0x04:  # quick stop
        if state in (State.enabled, State.quick_stop):
            return State.quick_stop
        return State.switch_on_disabled
    wanted = word & 0x0F
    if state is State.quick_stop:
        return State.enabled if stays and wanted == ENABLE_OPERATION else state
    if not word & 0x01:  # shutdown, whatever bit 3 says
        return State.ready
    if wanted == SWITCH_ON:
        return State.switched_on if state is not State.switch_on_disabled else state
    # Enable operation. From ready: to switched on, as drives may.
    further = {State.ready: State.switched_on, State.switched_on: State.enabled}
    return further.get(state, state)
