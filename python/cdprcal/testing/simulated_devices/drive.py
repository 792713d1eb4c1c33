"""A simulated CiA-402 drive: its state machine, quick stop ramp and motion, without any bus."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.cia402 import State
from cdprcal.hardware.drives.winch import tension_of_torque_N, torque_counts
from cdprcal.hardware.session import LoadCell, Swivel, Winch
from cdprcal.hardware.session.objects import object_type, parse_object
from cdprcal.testing.simulated_devices.object_dictionary import Key, ObjectDictionary

_VENDOR, _PRODUCT = 0x0CDB, 402
_REMEMBERED = 4  # errors in the history
_MAX_TORQUE, _MAX_SPEED_1_MIN = 3000, 3000
#: Errors of CiA 301 table 26 that a drive stops for.
HEARTBEAT_ERROR = 0x8130


def load_cell_counts(cell: LoadCell, tension_N: float) -> int:
    """What an amplifier gives; its lowest count when the wire is broken (NaN)."""
    low, high = object_type(cell.type).range
    if not math.isfinite(tension_N):
        return low
    counts = round(cell.zero_counts + cell.sign * cell.counts_per_N * tension_N)
    return min(max(counts, low), high)


def swivel_counts(swivel: Swivel, angle_rad: float) -> int:
    """What a swivel encoder gives."""
    return round(swivel.sign * angle_rad / (2.0 * math.pi) * swivel.counts_per_turn)


@dataclass
class Quirks:
    """What a drive does that no drive should."""

    stays_in_mode: int | None = None  #: whatever mode of operation it is told
    shows_mode: int | None = None  #: whatever mode it is in
    own_velocity_m_s: float = 0.0  #: of pay-out, when it is in a mode that nobody told it
    gain: float = 1.0  #: of the velocity that it is told
    deaf: bool = False  #: to controlwords
    swivel_flickers: bool = False  #: by its last digit, around where it stood
    load_cell_flickers: bool = False  #: by its last digit, around where it stood
    torque_factor: float = 1.0  #: of the torque that it shows, by what it pulls with


class SimulatedDrive:
    """One drive with its brake, load-cell input and secondary encoder.

    At power-on it is switch on disabled with the brake set. It moves in cyclic synchronous velocity
    and torque, and on the quick stop ramp; without that the winch stands.
    """

    def __init__(self, winch: Winch) -> None:
        self.winch = winch
        self.state = State.switch_on_disabled
        self.velocity_m_s = 0.0  #: of pay-out, commanded to the plant
        self.quirks = Quirks()
        self._fault = 0
        self._broken = False
        self._before = 0
        self.dictionary = dictionary = ObjectDictionary()
        dictionary.add((0x1000, 0), 0x00020192, 4)  # servo drive, CiA 402
        dictionary.add((0x1001, 0), 0, 1)
        for subindex, value in enumerate((4, _VENDOR, _PRODUCT, 1, 1000 + winch.node)):
            dictionary.add((0x1018, subindex), value, 4 if subindex else 1)
        name = b"cdprcal simulated CiA-402 drive"
        dictionary.add((0x1008, 0), int.from_bytes(name, "little"), len(name))
        for key, size in (
            (cia402.ERROR_CODE, 2), (cia402.STATUSWORD, 2), (cia402.MODE_DISPLAY, 1),
            (cia402.POSITION, 4), (cia402.TORQUE, 2),
        ):  # fmt: skip
            dictionary.add(key, 0, size)
        for key, value, size in (
            (cia402.CONTROLWORD, 0, 2), (cia402.MODE, 0, 1), (cia402.TARGET_VELOCITY, 0, 4),
            (cia402.TARGET_TORQUE, 0, 2), (cia402.QUICK_STOP_OPTION, 2, 2),
            (cia402.QUICK_STOP_DECELERATION, round(winch.deceleration_scale), 4),
            (cia402.ABORT_CONNECTION_OPTION, 1, 2), (cia402.INTERPOLATION_PERIOD, 1, 1),
            (cia402.INTERPOLATION_EXPONENT, -3, 1),
        ):  # fmt: skip
            dictionary.add(key, value, size, writable=True)
        if winch.torque is not None:
            rated_mNm = round(1e3 * winch.torque.rated_torque_Nm)
            dictionary.add(cia402.RATED_TORQUE, rated_mNm, 4)
        dictionary.add(cia402.MAX_TORQUE, _MAX_TORQUE, 2, writable=True)
        dictionary.add(cia402.POSITION_LEAST, 0, 4, writable=True)
        dictionary.add(cia402.POSITION_MOST, 0, 4, writable=True)
        dictionary.add(cia402.MAX_MOTOR_SPEED, _MAX_SPEED_1_MIN, 4, writable=True)
        dictionary.add((cia402.ERROR_HISTORY, 0), 0, 1)
        for at in range(1, _REMEMBERED + 1):
            dictionary.add((cia402.ERROR_HISTORY, at), 0, 4)
        dictionary.objects[cia402.CONTROLWORD].on_write = self._controlled
        for sensor in (winch.load_cell, winch.swivel):
            if sensor is not None and sensor.node in (None, winch.node):
                size = object_type(sensor.type).bits // 8
                dictionary.add(parse_object(sensor.object), 0, size)
        self._tell()

    @property
    def node(self) -> int:
        """Where it is on the bus."""
        return self.winch.node

    @property
    def in_torque(self) -> bool:
        """Whether the motor pulls with the target torque."""
        return self.state is State.enabled and self._mode == cia402.CST

    @property
    def tension_N(self) -> float:
        """What the target torque pulls with."""
        torque = self.winch.torque
        if torque is None:
            return 0.0
        return tension_of_torque_N(torque, self.winch.sign, self._torque_counts)

    @property
    def _torque_counts(self) -> int:
        """The target torque, within what the motor may."""
        most = self.dictionary.get(cia402.MAX_TORQUE)
        return min(max(self.dictionary.get(cia402.TARGET_TORQUE, signed=True), -most), most)

    @property
    def _mode(self) -> int:
        told = self.dictionary.get(cia402.MODE, signed=True)
        return told if self.quirks.stays_in_mode is None else self.quirks.stays_in_mode

    @property
    def wanders(self) -> bool:
        """Whether it moves as nobody told it."""
        own = self._mode not in (cia402.CSV, cia402.CST) and self.quirks.own_velocity_m_s != 0.0
        return own and self.state is State.enabled

    @property
    def ramping(self) -> bool:
        """Whether its speed changes by itself."""
        return self.state in (State.quick_stop, State.fault_reaction) and self.velocity_m_s != 0.0

    def fail(self, code: int) -> None:
        """An error: fault reaction, which is the quick stop ramp, then fault."""
        if self.state in (State.fault, State.fault_reaction):
            return
        self._fault = code
        self._remember(code)
        self.state = State.fault_reaction if self.state.powered else State.fault
        self._tell()

    def _remember(self, code: int) -> None:
        dictionary, history = self.dictionary, cia402.ERROR_HISTORY
        for at in range(_REMEMBERED, 1, -1):
            dictionary.set((history, at), dictionary.get((history, at - 1)))
        dictionary.set((history, 1), code)
        count = dictionary.get((history, 0))
        dictionary.set((history, 0), min(count + 1, _REMEMBERED))

    def set_state(self, state: State) -> None:
        """Puts it into a state, as another master may have done before."""
        self.state = state
        self._tell()

    def break_load_cell(self) -> None:
        """The wire of the load cell breaks: its amplifier goes to the lowest count."""
        self._broken = True

    def connection_lost(self) -> None:
        """The heartbeat of the master is missing: what the abort connection option says."""
        option = self.dictionary.get(cia402.ABORT_CONNECTION_OPTION, signed=True)
        if option == cia402.ABORT_CONNECTION_QUICK_STOP:
            if self.state is State.enabled:
                self.state = State.quick_stop
                self._tell()
        elif option != 0:
            self.fail(HEARTBEAT_ERROR)

    def step(self, duration_s: float) -> None:
        """Lets the drive's own time pass: sets velocity_m_s for it."""
        target = 0.0
        if self.state is State.enabled and self._mode == cia402.CSV:
            counts = self.dictionary.get(cia402.TARGET_VELOCITY, signed=True)
            target = self.quirks.gain * self.winch.sign * counts / self.winch.velocity_scale
        elif self.wanders:
            target = self.quirks.own_velocity_m_s
        elif self.state in (State.quick_stop, State.fault_reaction):
            units = self.dictionary.get(cia402.QUICK_STOP_DECELERATION)
            most = units / self.winch.deceleration_scale * duration_s
            slower = max(0.0, abs(self.velocity_m_s) - most)
            target = math.copysign(slower, self.velocity_m_s)
            if target == 0.0:
                self._stopped()
        if self.winch.torque is not None:
            turns_1_s = self.dictionary.get(cia402.MAX_MOTOR_SPEED) / 60.0
            turn_m = 2.0 * math.pi * self.winch.torque.drum_radius_m / self.winch.torque.gear_ratio
            target = min(max(target, -turns_1_s * turn_m), turns_1_s * turn_m)
        self.velocity_m_s = 0.0 if self._at_its_end(target) else target

    def _at_its_end(self, velocity_m_s: float) -> bool:
        """Whether it would go on beyond its software position limits."""
        least, most, here = (
            self.dictionary.get(key, signed=True)
            for key in (cia402.POSITION_LEAST, cia402.POSITION_MOST, cia402.POSITION)
        )
        counts = self.winch.sign * velocity_m_s
        return least < most and (
            (here <= least and counts < 0.0) or (here >= most and counts > 0.0)
        )

    def sense(
        self, length_m: float, swivel_rad: float | None, tension_N: float, held_N: float
    ) -> None:
        """The readings of its sensors, in counts; NaN: the sensor gives its lowest count.

        tension_N: at the load cell; held_N: what the motor holds, or the brake.
        """
        winch = self.winch
        if winch.torque is not None:
            shown = 0.0
            if self.in_torque:
                shown = self._torque_counts
            elif self.state.powered:
                shown = torque_counts(winch.torque, winch.sign, held_N)
            self.dictionary.set(cia402.TORQUE, round(self.quirks.torque_factor * shown))
        self.dictionary.set(cia402.POSITION, round(winch.sign * winch.counts_per_m * length_m))
        cell, swivel = winch.load_cell, winch.swivel
        if cell.node in (None, winch.node):
            broken = math.nan if self._broken else tension_N
            key, counts = parse_object(cell.object), load_cell_counts(cell, broken)
            if self.quirks.load_cell_flickers:
                counts = self._flicker(key)
            self.dictionary.set(key, counts)
        if swivel is not None and swivel_rad is not None and swivel.node in (None, winch.node):
            key, counts = parse_object(swivel.object), swivel_counts(swivel, swivel_rad)
            if self.quirks.swivel_flickers:
                counts = self._flicker(key)
            self.dictionary.set(key, counts)
        self._tell()

    def _flicker(self, key: Key) -> int:
        """The reading before, its last digit the other one."""
        return self.dictionary.get(key, signed=True) ^ 1

    def _stopped(self) -> None:
        if self.state is State.fault_reaction:
            self.state = State.fault
        elif self.dictionary.get(cia402.QUICK_STOP_OPTION) == cia402.QUICK_STOP_THEN_OFF:
            self.state = State.switch_on_disabled
        self._tell()

    def _controlled(self) -> None:
        if self.quirks.deaf:
            return
        word = self.dictionary.get(cia402.CONTROLWORD)
        before, self._before = self._before, word
        option = self.dictionary.get(cia402.QUICK_STOP_OPTION)
        stays = option == cia402.QUICK_STOP_AND_STAY and self.velocity_m_s == 0.0
        state = cia402.next_state(self.state, word, before, stays=stays)
        if self.state is State.fault and state is not State.fault:
            self._fault = 0
        self.state = state
        self._tell()

    def _tell(self) -> None:
        self.dictionary.set(cia402.STATUSWORD, cia402.statusword_of(self.state))
        shown = self.quirks.shows_mode
        self.dictionary.set(cia402.MODE_DISPLAY, self._mode if shown is None else shown)
        self.dictionary.set(cia402.ERROR_CODE, self._fault)
        self.dictionary.set((0x1001, 0), 1 if self._fault else 0)
