"""The last layer before the bus: what passes here is within the limits, whatever came before.

- Nothing at all is sent unless the winches are armed (dry run).
- Speeds and torques are cut to the session's limits, in the very integers that go out.
- Torques change no faster than by the whole range of tensions within half a second.
- A cable whose tension is at a limit is only moved back; so is one whose tension is not known.
- Once tripped, every drive is told to stop quickly, and nothing else any more.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from cdprcal.hardware.backend import BackendError
from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.fieldbus import Fieldbus
from cdprcal.hardware.drives.process_data import Image, Values
from cdprcal.hardware.drives.winch import torque_counts
from cdprcal.hardware.session import Session, Winch

RAMP_S = 0.5  #: in which torques may change from one tension limit to the other


class Guard:
    """Stands between the backend and a bus; nobody else sends process data."""

    def __init__(self, bus: Fieldbus, session: Session, *, armed: bool) -> None:
        self._bus = bus
        self._session = session
        self._armed = armed
        self._winches = {winch.node: winch for winch in session.winches}
        self._tension_N: dict[int, float] = {}
        self._sent: dict[int, Values] = {}
        self._reason = ""

    @property
    def reason(self) -> str:
        """Why the winches were stopped; empty: they were not."""
        return self._reason

    def measured(self, tension_N: Mapping[int, float]) -> None:
        """Tells the latest tension of each node's cable [N]; NaN: not known."""
        self._tension_N = dict(tension_N)

    def told_m_s(self) -> dict[int, float]:
        """Velocity of pay-out that each node was last sent [m/s]."""
        return {
            node: winch.sign * values[cia402.TARGET_VELOCITY] / winch.velocity_scale
            for node, values in self._sent.items()
            if (winch := self._winches.get(node)) is not None
        }

    def told_torque(self) -> dict[int, int]:
        """Torque that each node was last sent, in counts of 0x6071."""
        return {node: values[cia402.TARGET_TORQUE] for node, values in self._sent.items()}

    def exchange(self, outputs: Image) -> Image:
        """A cycle of the bus with these outputs, or what is left of them."""
        if not self._armed:
            return self._bus.exchange({})
        return self._bus.exchange(self._passed(outputs))

    def send(self, outputs: Image) -> None:
        """Sends these outputs, or what is left of them."""
        if self._armed:
            self._bus.send(self._passed(outputs))

    def trip(self, reason: str) -> None:
        """Quick stop of all winches, now and for good. The first reason is kept."""
        first = not self._reason
        self._reason = self._reason or reason
        if first and self._sent:
            try:
                self._bus.send(self._passed({}))
            except BackendError as error:
                # The drives miss the heartbeat and stop by themselves.
                self._reason += f"; and {error}"

    def _passed(self, outputs: Image) -> dict[int, Values]:
        if self._reason:
            passed = {node: _stopped(values) for node, values in self._sent.items()}
        else:
            passed = {
                node: self._limited(self._winches[node], values) for node, values in outputs.items()
            }
        self._sent |= passed
        return passed

    def _limited(self, winch: Winch, values: Values) -> Values:
        limits = self._session.limits
        most = math.floor(winch.velocity_scale * limits.velocity_m_s)
        reel_in, pay_out = -most, most
        tension_N = self._tension_N.get(winch.node, math.nan)
        if not tension_N < limits.tension_N[1]:
            reel_in = 0
        if not tension_N > limits.tension_N[0]:
            pay_out = 0
        velocity = winch.sign * values[cia402.TARGET_VELOCITY]
        limited = dict(values)
        limited[cia402.TARGET_VELOCITY] = winch.sign * min(max(velocity, reel_in), pay_out)
        limited[cia402.TARGET_TORQUE] = self._limited_torque(winch, values)
        return limited

    def _limited_torque(self, winch: Winch, values: Values) -> int:
        low, high = torque_range(winch, self._session)
        before = self._sent.get(winch.node)
        if before is not None and values[cia402.MODE] == cia402.CST:
            # A command goes out twice a cycle, so each may take half of what a cycle may.
            share = 0.5 * self._session.period_s / RAMP_S
            step = math.ceil(share * (high - low))
            low = max(low, before[cia402.TARGET_TORQUE] - step)
            high = min(high, before[cia402.TARGET_TORQUE] + step)
        return min(max(values[cia402.TARGET_TORQUE], low), high)


def torque_range(winch: Winch, session: Session) -> tuple[int, int]:
    """Least and greatest 0x6071 that pulls within the tension limits; (0, 0) without a drum."""
    if winch.torque is None:
        return 0, 0
    ends = [torque_counts(winch.torque, winch.sign, t) for t in session.limits.tension_N]
    return math.ceil(min(ends)), math.floor(max(ends))


def _stopped(values: Values) -> Values:
    # The torque stays: should a drive not obey, its cable stays as taut as it was.
    return values | {cia402.CONTROLWORD: cia402.QUICK_STOP, cia402.TARGET_VELOCITY: 0}
