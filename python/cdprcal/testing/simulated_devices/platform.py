"""The platform that hangs on simulated drives, and when its time runs."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import PlantTruth
from cdprcal.hardware.drives.cia402 import State
from cdprcal.hardware.session import Session
from cdprcal.hardware.simulated import require_hanging
from cdprcal.testing.simulated_devices.drive import SimulatedDrive
from cdprcal.testing.simulated_devices.sensors import sensor_nodes

_STEP_S = 1e-3  # in which drives follow their ramps


class AttitudeSink(Protocol):
    """What takes the platform's attitude: a simulated AHRS."""

    def show(
        self,
        R_world_platform: NDArray[np.float64],
        time_s: float,
        specific_force_m_s2: NDArray[np.float64] | None = None,
        angular_velocity_rad_s: NDArray[np.float64] | None = None,
    ) -> None:
        """The attitude from now on, and what an inertial unit reads."""


class SimulatedPlatform:
    """Simulated drives and what hangs on them, for any bus.

    tension_N [n]: true tensions at power-on. The platform hangs on the brakes, and its time begins
    once the drives hold it: with the cycle after the one in which they say so; in a dry run, in
    which they never do, with the first. While one drive is not in torque mode all winches stand or
    follow velocities; that is what mixes for two cycles when torques are stopped.
    """

    def __init__(
        self,
        session: Session,
        robot: _core.Robot,
        tension_N: NDArray[np.float64],
        options: _core.SimulatorOptions,
        ahrs: AttitudeSink | None = None,
    ) -> None:
        set_plant(options, session)
        self._period_s = session.period_s
        self._ahrs = ahrs
        self._convention = robot.euler_convention
        self.simulator = _core.Simulator(robot, options)
        require_hanging(robot, self.simulator.reset(tension_N))
        winches = sorted(session.winches, key=lambda winch: winch.cable)
        self.drives = [SimulatedDrive(winch) for winch in winches]
        self.sensors = sensor_nodes(session)
        self._runs = False
        self._held = self._said = False  # whether the drives are all enabled, and say so
        self._moved_s = 0.0  # up to when the platform has moved
        self._cycle_s = 0.0  # when the last cycle was
        self._sense(0.0)

    def truth(self) -> PlantTruth:
        """What the sensors do not say."""
        return self.simulator.truth()

    def cycle(self, now_s: float) -> None:
        """A cycle of the bus: time goes on by one, sensors are read."""
        # Who moves as nobody told it does not wait for the others.
        self._runs = self._runs or any(drive.wanders for drive in self.drives)
        if self._runs:
            since_s = now_s - self._moved_s
            regular = abs(since_s - self._period_s) < 0.5 * _STEP_S
            self._move(self._period_s if regular else since_s)
        self._moved_s = self._cycle_s = now_s
        self._sense(now_s)
        self._said = all(drive.state is State.enabled for drive in self.drives)

    def cycle_ended(self, *, commanded: bool) -> None:
        """The drives have said what they are. commanded: they take commands."""
        self._runs = self._runs or self._held or not commanded
        self._held = self._said

    def advance(self, now_s: float) -> None:
        """The clock on the wall. Without cycles the platform moves on by it."""
        if self._runs and now_s - self._cycle_s > 1.5 * self._period_s:
            self._move(now_s - self._moved_s)
            self._moved_s = now_s
            self._sense(now_s)

    def _move(self, duration_s: float) -> None:
        left_s = duration_s
        drives = self.drives
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

    def _sense(self, now_s: float) -> None:
        sample = self.simulator.read()
        held_N = self.simulator.truth().tension_N
        for i, drive in enumerate(self.drives):
            swivel = sample.swivel_rad[i] if len(sample.swivel_rad) else None
            drive.sense(sample.length_m[i], swivel, sample.tension_N[i], held_N[i])
            if self.simulator.crashed:
                drive.fail(0x8612)  # position limit: the platform is where it cannot be
        for sensors in self.sensors:
            sensors.sense(sample.swivel_rad.tolist(), sample.tension_N.tolist())
        if self._ahrs is not None:
            angles = sample.roll_pitch_yaw_rad
            if np.isfinite(angles).all():
                rotation = _core.rotation_from_euler(angles, self._convention)
                read = (sample.specific_force_m_s2, sample.angular_velocity_rad_s)
                force, rate = (v if np.isfinite(v).all() else None for v in read)
                self._ahrs.show(rotation, now_s, force, rate)


def set_plant(options: _core.SimulatorOptions, session: Session) -> None:
    """Cables and winches as this session has them."""
    winch, strand = options.winch, options.strand
    torque = session.mode == "torque"
    winch.mode = _core.WinchMode.torque if torque else _core.WinchMode.velocity
    if session.simulated is not None:
        strand.axial_stiffness_N = session.simulated.axial_stiffness_N
    options.winch, options.strand = winch, strand
