"""A whole simulated robot on a CAN bus: nodes, drives, platform dynamics and AHRS."""

from __future__ import annotations

from typing import Protocol

import can
import numpy as np

from cdprcal import _core
from cdprcal._core import InputError, PlantTruth
from cdprcal.hardware.drives.cia402 import State
from cdprcal.hardware.session import Session
from cdprcal.hardware.simulated_devices.canopen_node import CanopenNode
from cdprcal.hardware.simulated_devices.drive import SimulatedDrive
from cdprcal.hardware.simulated_devices.faults import Can, Fault

_STEP_S = 1e-3  # in which drives follow their ramps
_SYNC = 0x80


class AttitudeSink(Protocol):
    """What takes the platform's attitude: a simulated AHRS."""

    def show(self, R_world_platform: np.ndarray, time_s: float) -> None:
        """The attitude from now on."""


class SimulatedRobotOnCan:
    """Simulated drives on a bus, and the platform that hangs on them.

    Time is the master's: a SYNC is a cycle later than the one before. Where none comes it goes on
    by ``advance``. tension_N [n]: true tensions at power-on. While one drive is not in torque mode
    all winches of the plant stand or follow velocities; that is what mixes for two cycles when
    torques are stopped.
    """

    def __init__(
        self,
        session: Session,
        robot: _core.Robot,
        tension_N: np.ndarray,
        options: _core.SimulatorOptions,
        bus: Can,
        ahrs: AttitudeSink | None = None,
        fault: Fault | None = None,
    ) -> None:
        set_plant(options, session)
        self._session = session
        self._bus = bus
        self._ahrs = ahrs
        self._fault = fault
        self._convention = robot.euler_convention
        self.simulator = _core.Simulator(robot, options)
        placed = self.simulator.reset(tension_N)
        if not placed.found:
            raise InputError(f"{robot.name}: cannot hang at its initial tensions: {placed.reason}")
        winches = sorted(session.winches, key=lambda winch: winch.cable)
        self.nodes = [CanopenNode(SimulatedDrive(winch, session), self._send) for winch in winches]
        self._by_id = {node.id: node for node in self.nodes}
        self._closed = False
        self._runs = False  # whether the platform's time does
        self._held = False
        self._now_s = 0.0
        self._sync_s = 0.0  # of the last SYNC
        self._world_s = 0.0  # up to when the platform has moved
        self._sense()
        for node in self.nodes:
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
            for node in self.nodes:
                node.receive(can_id, data)

    def advance(self, now_s: float) -> None:
        """The clock on the wall. Without SYNC the platform moves on by it."""
        if self._closed:
            return
        self._now_s = max(self._now_s, now_s)
        self._let_happen()
        if self._runs and now_s - self._sync_s > 1.5 * self._session.period_s:
            self._move(now_s - self._world_s)
            self._world_s = now_s
            self._sense()
        for node in self.nodes:
            node.advance(now_s)

    def truth(self) -> PlantTruth:
        """What the sensors do not say."""
        return self.simulator.truth()

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
        if self._runs:
            period_s = self._session.period_s
            since_s = self._now_s - self._world_s
            self._move(period_s if abs(since_s - period_s) < 0.5 * _STEP_S else since_s)
        self._world_s = self._sync_s = self._now_s
        self._sense()
        for node in self.nodes:
            node.sync()
        # The platform hangs on the brakes, and its time begins once the drives hold it: with the
        # cycle after the one in which they say so. In a dry run they never do.
        self._runs = self._runs or self._held or not any(node.listens for node in self.nodes)
        self._held = all(node.drive.state is State.enabled for node in self.nodes)

    def _move(self, duration_s: float) -> None:
        left_s = duration_s
        drives = [node.drive for node in self.nodes]
        while left_s > 0.5 * _STEP_S:
            step_s = min(_STEP_S, left_s) if any(drive.ramping for drive in drives) else left_s
            for drive in drives:
                drive.step(step_s)
            if all(drive.in_torque for drive in drives):
                self.simulator.command_tension(np.array([drive.tension_N for drive in drives]))
            else:
                velocities = np.array([drive.velocity_m_s for drive in drives])
                self.simulator.command_velocity(velocities)
            self.simulator.advance(step_s)
            left_s -= step_s

    def _sense(self) -> None:
        sample = self.simulator.read()
        for i, node in enumerate(self.nodes):
            swivel = sample.swivel_rad[i] if len(sample.swivel_rad) else None
            node.drive.sense(sample.length_m[i], swivel, sample.tension_N[i])
            if self.simulator.crashed:
                node.drive.fail(0x8612)  # position limit: the platform is where it cannot be
        if self._ahrs is not None:
            angles = sample.roll_pitch_yaw_rad
            if np.isfinite(angles).all():
                rotation = _core.rotation_from_euler(angles, self._convention)
                self._ahrs.show(rotation, self._now_s)

    def _send(self, can_id: int, data: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))


def set_plant(options: _core.SimulatorOptions, session: Session) -> None:
    """Cables and winches as this session has them."""
    winch, strand = options.winch, options.strand
    torque = session.mode == "torque"
    winch.mode = _core.WinchMode.torque if torque else _core.WinchMode.velocity
    if session.simulated is not None:
        strand.axial_stiffness_N = session.simulated.axial_stiffness_N
    options.winch, options.strand = winch, strand
