"""The simulated robot behind the protocol of the real ones."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import InputError, PlantTruth, RobotSample, StartUpCommand


class SimulatedBackend:
    """A ``cdprcal.Simulator`` on its own clock.

    robot: as its file describes it; what the file lists under effects acts in the plant, and so do
    ``options.effects``. tension_N [n]: true tensions at power-on; the platform hangs where they
    hold it; with ``pose``, of six cables and more, there, under the tensions in balance closest to
    these. speed: simulated seconds per second; 0: as fast as it goes.

    Raises InputError when the robot cannot hang at these tensions.
    """

    def __init__(
        self,
        robot: _core.Robot,
        tension_N: NDArray[np.float64],
        options: _core.SimulatorOptions | None = None,
        *,
        pose: _core.Pose | None = None,
        velocity_limit_m_s: float = 0.0,
        control_rate_Hz: float = 100.0,
        speed: float = 0.0,
    ) -> None:
        if not control_rate_Hz >= 50.0 or not speed >= 0.0:
            raise InputError("simulated robot: control_rate_Hz must be 50 or more, speed 0 or more")
        self._options = options or _core.SimulatorOptions()
        self._speed = speed
        self._rate_Hz = control_rate_Hz
        self._inertial_unit = robot.platform.inertial_unit_m is not None
        winch = self._options.winch
        if winch.mode == _core.WinchMode.tension and velocity_limit_m_s > 0.0:
            # A drive with a tension loop of its own is given a limit that no plan reaches.
            winch.max_velocity_m_s = min(winch.max_velocity_m_s, 1.5 * velocity_limit_m_s)
            self._options.winch = winch
        self._has_tension_loop = winch.mode != _core.WinchMode.velocity
        self._simulator = _core.Simulator(robot, self._options)
        if pose is None:
            placed = self._simulator.reset(tension_N)
        else:
            placed = self._simulator.reset_held(pose, tension_N)
        require_hanging(robot, placed)
        self._tick = 0
        self._began = time.monotonic()

    @classmethod
    def somewhere(
        cls,
        robot: _core.Robot,
        plan: _core.Plan,
        options: _core.SimulatorOptions | None = None,
        *,
        velocity_limit_m_s: float = 0.0,
        control_rate_Hz: float = 100.0,
        speed: float = 0.0,
    ) -> SimulatedBackend:
        """A robot that hangs somewhere in the box that a plan spans; the seed says where.

        One of six cables and more: near where the plan begins, as people park it by eye. Raises
        InputError when it hangs nowhere there.
        """
        options = options or _core.SimulatorOptions()
        start = start_at(robot, plan, options.seed)
        return cls(
            robot,
            start.tension_N,
            options,
            pose=start.pose if _core.holds_orientation(robot) else None,
            velocity_limit_m_s=velocity_limit_m_s,
            control_rate_Hz=control_rate_Hz,
            speed=speed,
        )

    @property
    def settings(self) -> dict[str, Any]:
        return {
            "backend": "simulated",
            "seed": self._options.seed,
            "effects": [str(effect) for effect in self._options.effects],
            "winches": self._options.winch.mode.name,
            "inertial_unit": self._inertial_unit,
            "control_rate_Hz": self._rate_Hz,
        }

    def read(self) -> RobotSample:
        simulator = self._simulator
        if self._tick:
            due_s = self._tick / self._rate_Hz
            if self._speed:
                time.sleep(max(0.0, self._began + due_s / self._speed - time.monotonic()))
            simulator.advance(max(0.0, due_s - simulator.time_s))
        self._tick += 1
        sample = simulator.read()
        if simulator.crashed:
            sample.drive_error = simulator.crashed
        return sample

    def command(self, command: StartUpCommand) -> None:
        if command.locked:
            self._simulator.hold()
        elif self._has_tension_loop:
            self._simulator.command_each(
                command.velocity_m_s, command.tension_setpoint_N, command.by_tension
            )
        else:
            self._simulator.command_velocity(command.velocity_m_s)

    def stop(self) -> None:
        self._simulator.hold()

    def truth(self) -> PlantTruth:
        """What the sensors do not say, at the time of the latest sample."""
        return self._simulator.truth()


def require_hanging(robot: _core.Robot, placed: _core.RestResult) -> None:
    """Raises InputError when a simulator found no rest to begin from."""
    if not placed.found:
        raise InputError(
            f"{robot.name}: cannot hang at its initial tensions: {placed.reason}; make a plan "
            "of this robot"
        )


def start_of(robot: _core.Robot, plan: _core.Plan, seed: int) -> NDArray[np.float64]:
    """True tensions [n] at power-on of ``start_at``."""
    return start_at(robot, plan, seed).tension_N


def start_at(robot: _core.Robot, plan: _core.Plan, seed: int) -> _core.SetPoint:
    """Where a robot hangs at power-on: somewhere in the box of a plan.

    From six cables on where it was parked, near the plan's start. Raises InputError when it hangs
    nowhere there.
    """
    if _core.holds_orientation(robot):
        parked = _core.parked_start(robot, plan.start_pose, seed)
        if parked is None:
            raise InputError(
                f"{robot.name}: is held nowhere near the plan's start; make a plan of this robot"
            )
        return parked
    positions = np.array([plan.start_pose.position_m, *(s.pose.position_m for s in plan.poses)])
    box = _core.Box(positions.min(axis=0), positions.max(axis=0))
    start = _core.random_start(robot, box, seed)
    if start is None:
        raise InputError(
            f"{robot.name}: hangs nowhere in the box that the plan spans; make a plan of this robot"
        )
    return start
