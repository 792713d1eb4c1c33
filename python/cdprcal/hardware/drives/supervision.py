"""What is judged in every cycle, from the first one of arming to the last one of a run.

Drives come before sensors: a winch that runs away moves the platform, and with it the tensions of
cables that obey.
"""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Mapping, Sequence
from enum import Enum

from cdprcal.hardware.drives.cia402 import CST, CSV, State
from cdprcal.hardware.drives.winch import SPEED_CYCLES, WinchState, tension_of_torque_N
from cdprcal.hardware.session import Session

OVERSPEED = 1.25  #: of the velocity limit; drives overshoot a little
OVERLOAD = 0.1  #: of a tension limit: that far beyond is a quick stop
#: What a cable may creep at standstill, in time at the velocity limit: servos take up the load.
CREEP_S = 0.01
#: Drives follow a velocity within this: five times the 10 ms that the tension loop is made for.
FOLLOW_S = 0.05
#: Over which travel is compared: a rate that is off by a little shall not add up for ever.
TRAVEL_S = 1.0
_STILL_TIMES = 10.0  # so much longer than ever before is no chance
_STILL_KNOWN = 20  # changes after which it is known how long readings stand
MODE_CYCLES = 20  #: a drive may take these to change its mode of operation


class Phase(Enum):
    """How far the drives are."""

    reading = "reading"  #: dry run: nobody is told anything
    preparing = "preparing"  #: standing on brakes or in quick stop, on the way to switched on
    enabling = "enabling"  #: in the right mode, told to enable operation
    running = "running"


#: States in which a drive may be found, by phase.
_ALLOWED = {
    Phase.preparing: {
        State.not_ready, State.switch_on_disabled, State.ready, State.switched_on,
        State.quick_stop, State.fault,
    },
    Phase.enabling: {State.switched_on, State.enabled},
    Phase.running: {State.enabled},
}  # fmt: skip


def name_of(winch: WinchState) -> str:
    """As every message names it."""
    return f"node {winch.winch.node} (cable {winch.winch.cable})"


def creep_m(session: Session, jitter_m: float) -> float:
    """What a cable may creep at standstill, or what two of its readings are apart by chance."""
    return max(CREEP_S * session.limits.velocity_m_s, chance_m(jitter_m))


def chance_m(jitter_m: float) -> float:
    """How far two readings of one length are apart by chance, six standard deviations: of runs of
    an hour with eight cables at 100 Hz less than one in a hundred has more. jitter_m: of one, 1 σ.
    """
    return 6.0 * math.sqrt(2.0) * jitter_m


class Travel:
    """What a cable was told to move against what its encoder shows, over the last second."""

    def __init__(self, winch: WinchState, session: Session, jitter_m: float = 0.0) -> None:
        self._period_s = session.period_s
        self._follow = math.ceil(FOLLOW_S / session.period_s)
        count = round(TRAVEL_S / session.period_s)
        # Of the encoder two counts: each reading is rounded.
        self._creep_m = creep_m(session, jitter_m) + 2.0 / winch.winch.counts_per_m
        self._length_m: deque[float] = deque(maxlen=count)
        self._told_m: deque[float] = deque(maxlen=count)
        # From some cycles before the window on, for what was still being followed when it began.
        self._velocity_m_s: deque[float] = deque(maxlen=count + self._follow)

    def clear(self) -> None:
        """What was before does not count: the winch was not told how fast to run."""
        self._length_m.clear()
        self._told_m.clear()
        self._velocity_m_s.clear()

    def push(self, length_m: float, velocity_m_s: float) -> None:
        """A cycle's encoder reading [m], NaN: none; and the velocity it was told before [m/s]."""
        told_m = self._told_m[-1] if self._told_m else 0.0
        if self._length_m:
            told_m += velocity_m_s * self._period_s
        self._velocity_m_s.append(velocity_m_s)
        self._length_m.append(length_m)
        self._told_m.append(told_m)

    @property
    def told_m(self) -> float:
        """Cable that it was told to pay out over the window."""
        return self._told_m[-1] - self._told_m[0] if self._told_m else 0.0

    @property
    def moved_m(self) -> float:
        """Cable that it paid out over the window; NaN when the encoder was silent at an end."""
        return self._length_m[-1] - self._length_m[0] if self._length_m else math.nan

    @property
    def astray(self) -> bool:
        """Whether the difference is more than lag and creep explain.

        A delay of at most FOLLOW_S shifts what was told at both ends of the window: that changes
        the travel by no more than that time at the difference of velocities there.
        """
        difference_m = self.moved_m - self.told_m
        if not abs(difference_m) > self._creep_m:
            return False
        velocities = self._velocity_m_s
        ends = [*itertools.islice(velocities, 2 * self._follow)]
        ends += itertools.islice(reversed(velocities), self._follow + 1)
        lag_m = self._follow * self._period_s * (max(ends) - min(ends))
        return abs(difference_m) > self._creep_m + lag_m


class Pull:
    """The torque that a drive was told against what it shows, while it is in torque mode."""

    def __init__(self, winch: WinchState, session: Session) -> None:
        self._winch = winch.winch
        self._most_N = OVERLOAD * session.limits.tension_N[1]
        self._follow = math.ceil(FOLLOW_S / session.period_s)
        self._off_counts: deque[tuple[int, int]] = deque(maxlen=self._follow)

    def clear(self) -> None:
        """It was in another mode."""
        self._off_counts.clear()

    def push(self, shown: int | None, told: int) -> None:
        """A cycle's torques, in counts; None: it does not show any."""
        if shown is not None:
            self._off_counts.append((shown, told))

    @property
    def shown_N(self) -> float:
        """Tension by the torque that it shows, over FOLLOW_S."""
        return self._mean_N(0)

    @property
    def told_N(self) -> float:
        """Tension that it was told."""
        return self._mean_N(1)

    @property
    def astray(self) -> bool:
        """Whether they are apart by more than what is allowed beyond a limit."""
        if len(self._off_counts) < self._follow:
            return False
        return abs(self.shown_N - self.told_N) > self._most_N

    def _mean_N(self, which: int) -> float:
        assert self._winch.torque is not None  # else torque mode is refused
        counts = sum(pair[which] for pair in self._off_counts) / len(self._off_counts)
        return tension_of_torque_N(self._winch.torque, self._winch.sign, counts)


class Still:
    """Readings that stand still while the platform moves: of one kind of sensor, all cables.

    Time is the path that the cables have gone, so that a rest is none. A reading that stays within
    one count to either side stands: a broken encoder may flicker by its last digit. It is stuck
    when it stands for ten times as long as any of its kind ever did before it moved on.
    """

    def __init__(self, step_m: float, count: int) -> None:
        self._least_m = _STILL_TIMES * step_m
        self._longest_m = 0.0
        self._moves = 0
        self._path_m: float  # since the first cycle
        #: Each cable's reading, and from where on the path it stands.
        self._stands: list[tuple[int, float] | None] = [None] * count

    def push(self, path_m: float, counts: Sequence[int | None]) -> None:
        """A cycle: how far cables have gone since the first one, and the readings."""
        self._path_m = path_m
        for at, value in enumerate(counts):
            before = self._stands[at]
            if value is None or (before is not None and abs(value - before[0]) <= 1):
                continue
            if before is not None:
                self._moves += 1
                self._longest_m = max(self._longest_m, path_m - before[1])
            self._stands[at] = value, path_m

    def stuck(self, at: int) -> bool:
        """Whether a cable's reading stands, and for too long."""
        stands = self._stands[at]
        if stands is None or self._moves < _STILL_KNOWN:
            return False
        still_m = self._path_m - stands[1]
        return still_m > max(self._least_m, _STILL_TIMES * self._longest_m)


class Path:
    """How far all cables have gone together, to and fro, in steps larger than any flicker."""

    def __init__(self, step_m: float, count: int) -> None:
        self._step_m = step_m
        self._from_m = [math.nan] * count
        self.path_m = 0.0

    def push(self, length_m: Sequence[float]) -> float:
        """A cycle's lengths, NaN: none; the path so far."""
        for at, value in enumerate(length_m):
            if math.isnan(self._from_m[at]):
                self._from_m[at] = value
            elif abs(value - self._from_m[at]) >= self._step_m:
                self.path_m += abs(value - self._from_m[at])
                self._from_m[at] = value
        return self.path_m


class Supervisor:
    """Looks at all winches after every cycle; the first thing wrong is the reason to stop.

    jitter_m: 1 σ by which encoders read another length each time; those of a drive do not.
    """

    def __init__(
        self, session: Session, winches: Sequence[WinchState], jitter_m: float = 0.0
    ) -> None:
        self._session = session
        self._winches = winches
        self._jitter_m = jitter_m
        self._travel = [Travel(winch, session, jitter_m) for winch in winches]
        self._pull = [Pull(winch, session) for winch in winches]
        step_m, count = creep_m(session, jitter_m), len(winches)
        self._path = Path(step_m, count)
        self._still_cells, self._still_swivels = Still(step_m, count), Still(step_m, count)
        self._before = self._wanted = CSV
        self._since_mode = 0
        self._was_enabled = [False] * len(winches)
        self._from_m = [math.nan] * len(winches)  # where cables were first seen
        self.phase = Phase.reading

    def enter(self, phase: Phase) -> None:
        """The drives are told to go further."""
        self.phase = phase

    def want_mode(self, mode: int) -> None:
        """The mode of operation that is commanded from now on."""
        if mode != self._wanted:
            self._before, self._wanted, self._since_mode = self._wanted, mode, 0

    def look(self, told_m_s: Mapping[int, float], told_torque: Mapping[int, int]) -> str:
        """Why the winches must stop; empty: they need not.

        told_m_s, told_torque: velocity of pay-out [m/s] and torque [counts of 0x6071] that each
        node had been sent when the cycle began.
        """
        self._since_mode += 1
        if self._since_mode > MODE_CYCLES or all(w.mode == self._wanted for w in self._winches):
            self._before = self._wanted
        for winch, travel in zip(self._winches, self._travel, strict=True):
            follows = winch.mode == self._wanted == CSV or self.phase is not Phase.running
            if self.phase is Phase.reading or not follows:
                travel.clear()
            else:
                travel.push(winch.length_m, told_m_s.get(winch.winch.node, 0.0))
        for winch, pull in zip(self._winches, self._pull, strict=True):
            if winch.mode == self._wanted == CST:
                pull.push(winch.torque_counts, told_torque.get(winch.winch.node, 0))
            else:
                pull.clear()
        if self.phase is Phase.running:
            path_m = self._path.push([winch.length_m for winch in self._winches])
            self._still_cells.push(path_m, [winch.load_cell_counts for winch in self._winches])
            self._still_swivels.push(path_m, [winch.swivel_counts for winch in self._winches])
        judges = (self._silent, self._not_as_told, self._astray, self._stuck, self._beyond)
        for judge in judges:
            for at, winch in enumerate(self._winches):
                if wrong := judge(at, winch):
                    return f"{name_of(winch)}: {wrong}"
        return ""

    def _silent(self, at: int, winch: WinchState) -> str:
        allowed = self._session.safety.missed_cycles
        if winch.missed > allowed:
            return "does not answer"
        if winch.load_cell_missed > allowed:
            counts = winch.load_cell_counts
            said = "does not answer" if counts is None else f"reads {counts} counts, not valid"
            return f"the load cell {said}"
        if winch.swivel_missed > allowed:
            return "the swivel encoder does not answer"
        return ""

    def _not_as_told(self, at: int, winch: WinchState) -> str:
        if self.phase is Phase.reading or winch.missed:
            return ""
        state = winch.state
        left = self._was_enabled[at] and state is not State.enabled
        self._was_enabled[at] = state is State.enabled
        code = (
            f", error 0x{winch.error_code:04X}; look it up in its manual"
            if winch.error_code
            else ""
        )
        if left or (self.phase is Phase.running and state is not State.enabled):
            return f"left operation enabled, is {state.value}{code}"
        holds = state is State.quick_stop and not self._session.safety.brakes
        if state not in _ALLOWED[self.phase] and not holds:
            return f"is {state.value} while the drives are being armed{code}"
        if self.phase is not Phase.preparing and winch.mode not in (self._wanted, self._before):
            return f"is in mode of operation {winch.mode}, not {self._wanted}"
        return ""

    def _astray(self, at: int, winch: WinchState) -> str:
        travel = self._travel[at]
        if travel.astray:
            return (
                f"moved by {1e3 * travel.moved_m:+.1f} mm where {1e3 * travel.told_m:+.1f} mm were "
                "commanded"
            )
        pull = self._pull[at]
        if pull.astray:
            return (
                f"pulls with {pull.shown_N:.0f} N where {pull.told_N:.0f} N were commanded; check "
                "the drive's own torque limits"
            )
        limit_m_s = self._session.limits.velocity_m_s
        by_chance_m_s = chance_m(self._jitter_m) / (SPEED_CYCLES * self._session.period_s)
        if abs(winch.speed_m_s) > max(OVERSPEED * limit_m_s, limit_m_s + by_chance_m_s):
            return f"runs at {winch.speed_m_s:.2f} m/s, beyond the limit"
        return ""

    def _stuck(self, at: int, winch: WinchState) -> str:
        if self._still_cells.stuck(at):
            return "the load cell stands still while the platform moves"
        if self._still_swivels.stuck(at):
            return "the swivel encoder stands still while the platform moves"
        return ""

    def _beyond(self, at: int, winch: WinchState) -> str:
        if math.isnan(self._from_m[at]):
            self._from_m[at] = winch.length_m
        most_m = self._session.limits.travel_m
        gone_m = winch.length_m - self._from_m[at]
        if most_m is not None and abs(gone_m) > most_m:
            return f"is {gone_m:+.3f} m from where it was at power-on, beyond limits.travel_m"
        low, high = self._session.limits.tension_N
        tension_N = winch.tension_N  # NaN is within: it is counted as missed
        if tension_N < low * (1.0 - OVERLOAD) or tension_N > high * (1.0 + OVERLOAD):
            return f"tension {tension_N:.1f} N is beyond the limits"
        return ""


__all__ = ["Phase", "Supervisor", "Travel", "name_of"]
