"""A whole simulated robot on a CAN bus: nodes, drives, platform dynamics and AHRS."""

from __future__ import annotations

import can
import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import PlantTruth
from cdprcal.hardware.session import Session
from cdprcal.testing.simulated_devices.canopen_node import CanopenNode, DriveNode
from cdprcal.testing.simulated_devices.faults import Can, Fault
from cdprcal.testing.simulated_devices.platform import AttitudeSink, SimulatedPlatform

_SYNC = 0x80


class SimulatedRobotOnCan:
    """Simulated drives on a bus, and the platform that hangs on them.

    Time is the master's: a SYNC is a cycle later than the one before. Where none comes it goes on
    by ``advance``. tension_N [n]: true tensions at power-on.
    """

    def __init__(
        self,
        session: Session,
        robot: _core.Robot,
        tension_N: NDArray[np.float64],
        options: _core.SimulatorOptions,
        bus: Can,
        ahrs: AttitudeSink | None = None,
        fault: Fault | None = None,
    ) -> None:
        self._bus = bus
        self._fault = fault
        self._platform = SimulatedPlatform(session, robot, tension_N, options, ahrs)
        self.nodes = [DriveNode(drive, self._send) for drive in self._platform.drives]
        sensors = [CanopenNode(sensors, self._send) for sensors in self._platform.sensors]
        self._all = [*self.nodes, *sensors]
        self._by_id = {node.id: node for node in self._all}
        self._closed = False
        self._now_s = 0.0
        if fault is not None and fault.build is not None:
            fault.build(self.nodes)
        self._let_happen()  # what is wrong from power-on
        for node in self._all:
            node.boot()

    @property
    def time_s(self) -> float:
        """Since power-on."""
        return self._now_s

    def process(self) -> None:
        """Answers whatever is on the bus."""
        if self._closed:
            return
        while (message := self._bus.recv(0.0)) is not None:
            self.take(message)

    def take(self, message: can.Message) -> None:
        """Answers one message."""
        can_id, data = message.arbitration_id, bytes(message.data)
        if can_id == _SYNC:
            self._cycle()
        elif can_id & 0x780 in (0x200, 0x300, 0x400, 0x500, 0x600):
            node = self._by_id.get(can_id & 0x7F)
            if node is not None:
                node.receive(can_id, data)
        else:
            for node in self._all:
                node.receive(can_id, data)

    def advance(self, now_s: float) -> None:
        """The clock on the wall. Without SYNC the platform moves on by it."""
        if self._closed:
            return
        self._now_s = max(self._now_s, now_s)
        self._let_happen()
        self._platform.advance(now_s)
        for node in self._all:
            node.advance(now_s)

    def truth(self) -> PlantTruth:
        """What the sensors do not say."""
        return self._platform.truth()

    def _let_happen(self) -> None:
        fault = self._fault
        if fault is not None and not fault.began and self._now_s >= fault.begin_s:
            fault.began = True
            if fault.happen is not None:
                fault.happen(self.nodes)

    def close(self) -> None:
        """Leaves the bus. May be repeated."""
        if not self._closed:
            self._closed = True
            self._bus.shutdown()

    def _cycle(self) -> None:
        self._platform.cycle(self._now_s)
        for node in self._all:
            node.sync()
        self._platform.cycle_ended(commanded=any(node.listens for node in self.nodes))

    def _send(self, can_id: int, data: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))
