"""The small interface between the winches and a bus, and the clocks that buses run on."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Protocol

import can

from cdprcal.hardware.drives.process_data import Image, Layout
from cdprcal.hardware.session import Session

#: CiA 301: there is no such object, or no such subindex.
NO_SUCH_OBJECT = (0x06020000, 0x06090011)


def node_name(session: Session, node: int) -> str:
    """'node 3 (cable 1)'."""
    cables = [winch.cable for winch in session.winches if winch.node == node]
    return f"node {node} (cable {cables[0]})" if cables else f"node {node}"


def in_a_line(error: Exception) -> str:
    """What a library says, or its kind of error where it says nothing."""
    return " ".join(str(error).split()) or type(error).__name__


class Fieldbus(Protocol):
    """CANopen, EtherCAT: nodes with an object dictionary, and process data every cycle.

    Everything raises BackendError naming the node when it does not answer or obey.
    """

    def sdo_read(self, node: int, index: int, subindex: int) -> bytes:
        """An object, little-endian."""

    def sdo_write(self, node: int, index: int, subindex: int, data: bytes) -> None:
        """Writes an object."""

    def configure(self, layouts: Sequence[Layout], *, outputs: bool) -> None:
        """Maps the process data and starts the nodes. Not ``outputs``: none can ever be sent."""

    def watch_us(self, *, on: bool) -> list[int]:
        """Tells the nodes to stop by themselves when this computer falls silent, or not to.

        Only from then on need commands be obeyed. What was written is read back. Returns the nodes
        that notice silence, but not that commands alone stay away.
        """

    def exchange(self, outputs: Image) -> Image:
        """One cycle: outputs out, inputs in. Waits for them, but not beyond the cycle."""

    def send(self, outputs: Image) -> None:
        """Outputs out now, without waiting for the next cycle."""

    def abandon(self) -> None:
        """For nodes that do not obey: takes all out of operation and falls silent, for good.

        They stop by what they were told to do then. ``exchange`` brings nothing any more.
        """

    def faults(self) -> list[str]:
        """What nodes have complained of since the last call: EMCY, lost heartbeats, restarts."""

    def close(self, *, stop: bool = True) -> None:
        """Ends it, not ``stop``: leaving the nodes as they are. May be repeated; never raises."""


class Clock(Protocol):
    """The time of the control loop."""

    def now_s(self) -> float:
        """Never runs backwards."""

    def sleep_until(self, time_s: float) -> None:
        """Returns at time_s, or at once if that has passed."""

    def receive(self, bus: can.BusABC, until_s: float) -> can.Message | None:
        """The next message, or None when there is none by ``until_s``."""


class RealClock:
    """Of real devices."""

    def now_s(self) -> float:
        return time.monotonic()

    def sleep_until(self, time_s: float) -> None:
        time.sleep(max(0.0, time_s - time.monotonic()))

    def receive(self, bus: can.BusABC, until_s: float) -> can.Message | None:
        message = bus.recv(0.0)
        while message is None and (left_s := until_s - time.monotonic()) > 0.0:
            message = bus.recv(left_s)
        return message


class SimulatedClock:
    """Time that passes when nobody has anything left to do: the same on any machine.

    idle: called when a message is waited for, so that simulated nodes may answer; advance: called
    with the time whenever that has moved on. patience_s: how long, in real time, a message from
    another process may take before it counts as one that never comes. speed: seconds per second; 0:
    as fast as it goes.
    """

    def __init__(self, *, patience_s: float = 0.0, speed: float = 0.0) -> None:
        self._now_s = 0.0
        self._patience_s = patience_s
        self._speed = speed
        self._began = time.monotonic()
        self.idle: list[Callable[[], None]] = []
        self.advance: list[Callable[[float], None]] = []

    def now_s(self) -> float:
        return self._now_s

    def sleep_until(self, time_s: float) -> None:
        self._pump()
        if time_s <= self._now_s:
            return
        if self._speed:
            time.sleep(max(0.0, self._began + time_s / self._speed - time.monotonic()))
        self._now_s = time_s
        for call in self.advance:
            call(time_s)
        self._pump()

    def receive(self, bus: can.BusABC, until_s: float) -> can.Message | None:
        message = bus.recv(0.0)
        if message is not None:
            return message
        self._pump()
        message = bus.recv(self._patience_s)
        if message is None:
            self.sleep_until(until_s)
            message = bus.recv(0.0)
        return message

    def _pump(self) -> None:
        for call in self.idle:
            call()
