"""One winch in physical units: counts to metres, newtons and radians, and commands to counts."""

from __future__ import annotations

import math
from collections import deque

from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.cia402 import Goal, State
from cdprcal.hardware.drives.process_data import Image, Key, Values
from cdprcal.hardware.session import Session, Swivel, Torque, Winch
from cdprcal.hardware.session.objects import object_type, parse_object

SPEED_CYCLES = 5  # so that an encoder's last digit is no speed
_TORQUE_UNIT = 1000.0  # 0x6071 is in thousandths of the rated torque


def torque_counts(torque: Torque, sign: int, tension_N: float) -> float:
    """0x6071 of a tension: positive torque turns the drum the way that counts grow."""
    motor_Nm = tension_N * torque.drum_radius_m / torque.gear_ratio
    return -sign * _TORQUE_UNIT * motor_Nm / torque.rated_torque_Nm


def tension_of_torque_N(torque: Torque, sign: int, counts: float) -> float:
    """The tension that a torque in counts of 0x6071 or 0x6077 holds without friction."""
    return counts / torque_counts(torque, sign, 1.0)


class Counter:
    """An integer that wraps around, made continuous."""

    def __init__(self, bits: int) -> None:
        self._span = 1 << bits
        self._sum: int | None = None

    def follow(self, counts: int) -> int:
        """The continuous count: each step is the shorter way round."""
        if self._sum is None:
            self._sum = counts
        half = self._span // 2
        self._sum += (counts - self._sum + half) % self._span - half
        return self._sum


class WinchState:
    """Readings and drive state of one winch, from the process data of the latest cycle."""

    def __init__(self, winch: Winch, session: Session) -> None:
        self.winch = winch
        self.mode = cia402.CSV
        self.state = State.not_ready
        self.statusword = 0
        self.error_code = 0
        self.length_m = math.nan
        self.swivel_rad = math.nan
        self.tension_N = math.nan
        self.position_counts: int | None = None
        self.missed = 0  #: cycles in a row without the drive's data
        self.load_cell_missed = 0  #: … without a load-cell reading that can be true
        self.load_cell_counts: int | None = None
        self.torque_counts: int | None = None  #: actual, where there is a torque section
        self.swivel_missed = 0
        self.swivel_counts: int | None = None
        self._limits = session.limits
        self._holds = not session.safety.brakes
        self._period_s = session.period_s
        self._lengths_m: deque[float] = deque(maxlen=SPEED_CYCLES + 1)
        self._position = Counter(32)
        self._load_cell_key = parse_object(winch.load_cell.object)
        self._swivel: tuple[Swivel, Key, Counter] | None = None
        if (swivel := winch.swivel) is not None:
            counter = Counter(object_type(swivel.type).bits)
            self._swivel = swivel, parse_object(swivel.object), counter

    def take(self, image: Image) -> None:
        """A cycle's inputs; what did not come keeps nothing of the past but the drive's state."""
        own = image.get(self.winch.node)
        self.missed = 0 if own is not None else self.missed + 1
        self.length_m = math.nan
        if own is not None:
            self.statusword = own[cia402.STATUSWORD]
            self.state = cia402.state_of(self.statusword)
            self.mode = own[cia402.MODE_DISPLAY]
            self.error_code = own[cia402.ERROR_CODE]
            self.position_counts = own[cia402.POSITION]
            self.torque_counts = own.get(cia402.TORQUE)
            counts = self._position.follow(self.position_counts)
            self.length_m = self.winch.sign * counts / self.winch.counts_per_m
        self._lengths_m.append(self.length_m)
        self._take_load_cell(image)
        self._take_swivel(image)

    @property
    def speed_m_s(self) -> float:
        """Of pay-out, over the last few cycles; NaN when the encoder was silent at an end."""
        if len(self._lengths_m) <= SPEED_CYCLES:
            return math.nan
        return (self._lengths_m[-1] - self._lengths_m[0]) / (SPEED_CYCLES * self._period_s)

    @property
    def torque_tension_N(self) -> float:
        """Tension by the motor's torque; NaN where that is not known."""
        torque = self.winch.torque
        if torque is None or self.torque_counts is None:
            return math.nan
        return tension_of_torque_N(torque, self.winch.sign, self.torque_counts)

    def _take_load_cell(self, image: Image) -> None:
        cell = self.winch.load_cell
        values = image.get(cell.node or self.winch.node)
        self.load_cell_counts = None if values is None else values[self._load_cell_key]
        low, high = self.winch.load_cell_range
        self.tension_N = math.nan
        if self.load_cell_counts is None or not low <= self.load_cell_counts <= high:
            self.load_cell_missed += 1
            return
        self.load_cell_missed = 0
        self.tension_N = cell.sign * (self.load_cell_counts - cell.zero_counts) / cell.counts_per_N

    def _take_swivel(self, image: Image) -> None:
        self.swivel_rad, self.swivel_counts = math.nan, None
        if self._swivel is None:
            return
        swivel, key, counter = self._swivel
        values = image.get(swivel.node or self.winch.node)
        if values is None:
            self.swivel_missed += 1
            return
        self.swivel_missed = 0
        self.swivel_counts = counts = counter.follow(values[key])
        self.swivel_rad = swivel.sign * 2.0 * math.pi * counts / swivel.counts_per_turn

    def output(self, goal: Goal, mode: int, velocity_m_s: float, tension_N: float) -> Values:
        """Process data of a command; numbers that are not finite become standstill."""
        winch = self.winch
        if not math.isfinite(velocity_m_s):
            velocity_m_s = 0.0
        values = {
            cia402.CONTROLWORD: cia402.controlword(goal, self.state, holds=self._holds),
            cia402.MODE: mode,
            cia402.TARGET_VELOCITY: round(winch.sign * winch.velocity_scale * velocity_m_s),
            cia402.TARGET_TORQUE: 0,
        }
        if winch.torque is not None:
            if mode != cia402.CST or not math.isfinite(tension_N):
                # What holds it now, so that torque mode begins without a jerk.
                tension_N = self.torque_tension_N
            if not math.isfinite(tension_N):
                tension_N = self._limits.tension_N[0]
            torque = round(torque_counts(winch.torque, winch.sign, tension_N))
            values[cia402.TARGET_TORQUE] = torque
        return values
