"""A case made into a log by the dynamic simulator, and the truth that goes with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal.testing.blind_bench.cases import EVENTS, Case, Hidden, NoiseKind, Setting

#: Grid of the set-points by number of poses.
_GRIDS = {8: (2, 2, 2), 27: (3, 3, 3)}

_RESOLUTION = {"length": 1e-6, "angle": 1e-5, "tension": 0.01}


@dataclass(frozen=True)
class Simulated:
    """What the diagnosis gets (`robot`, `log`), and the sealed truth."""

    robot: _core.Robot  #: nominal, with the stated σ
    log: _core.Log
    initial_pose: _core.Pose
    duration_s: float
    event_time_s: float | None  #: of a fault that happens at one time


class SimulationError(RuntimeError):
    """The start-up ended early: there is no whole log."""


@cache
def setpoints(robot_name: str, poses: int) -> list[NDArray[np.float64]]:
    """The tension set-points that every case of a setting visits."""
    grid = _GRIDS[poses]
    return list(_core.default_setpoints(_core.load_robot(robot_name), *grid))


def simulate(case: Case, setting: Setting, robot_name: str = "irma4") -> Simulated:
    """Runs the start-up with the case's effects hidden in the plant and its readings.

    Raises SimulationError when the start-up procedure stopped before the last pose.
    """
    robot = _core.load_robot(robot_name)
    visited = list(setpoints(robot_name, setting.poses))
    rng = np.random.default_rng([case.seed, 1])
    if case.shuffled:
        shuffled = [visited[i] for i in rng.permutation(len(visited))]
        # Constant tension control does not reach every set-point from every other.
        visited = shuffled if _reachable(robot, shuffled) else visited
    duration_s = float(_core.StartUp(robot, _core.StartUpPlan(visited)).planned_duration_s)
    effects = [_injected(hidden, duration_s) for hidden in case.hidden if _in_plant(hidden)]
    noise = setting.noise if setting.noise_kind == NoiseKind.reading else 0.02
    options = _core.SimulatorOptions(
        seed=case.seed, effects=effects, sensors=_sensors(robot.sigma, noise)
    )
    try:
        run = _core.simulate_startup(
            robot,
            _core.StartUpPlan(visited),
            simulator=options,
            # The procedure's own limits are not what is tested here: a load cell that is off must
            # not end the run.
            startup=_core.StartUpOptions(watchdog=_patient_watchdog()),
        )
    except _core.InputError as error:
        raise SimulationError(str(error)) from error
    if run.state != _core.StartUpState.done:
        raise SimulationError(f"{run.state.name}: {run.reason}")
    log = _altered(run, case, setting, robot, rng)
    return Simulated(
        robot=_stated(robot, setting.noise * case.stated),
        log=log,
        initial_pose=run.poses[0],
        duration_s=float(log.time_s[-1]),
        event_time_s=next((e.values[0] for e in effects if e.name in EVENTS), None),
    )


def _patient_watchdog() -> _core.WatchdogOptions:
    return _core.WatchdogOptions(
        follow_s=60.0, tension_s=60.0, stuck_s=60.0, runaway_m=5.0, follow_share=5.0
    )


def _reachable(robot: _core.Robot, visited: list[NDArray[np.float64]]) -> bool:
    try:
        _core.StartUp(robot, _core.StartUpPlan(visited))
    except _core.InputError:
        return False
    return True


def _sensors(sigma: _core.SensorSigma, noise: float) -> _core.SensorOptions:
    def channel(sigma: float, resolution: float) -> _core.SensorChannel:
        return _core.SensorChannel(noise=noise * sigma, resolution=resolution)

    return _core.SensorOptions(
        length_m=channel(sigma.length_m, _RESOLUTION["length"]),
        swivel_rad=channel(sigma.swivel_rad, _RESOLUTION["angle"]),
        tension_N=channel(sigma.tension_N, _RESOLUTION["tension"]),
        roll_pitch_rad=channel(sigma.attitude_rad, _RESOLUTION["angle"]),
        yaw_rad=channel(sigma.attitude_rad, _RESOLUTION["angle"]),
    )


def _stated(robot: _core.Robot, factor: float) -> _core.Robot:
    """The nominal robot, its file stating `factor` times the σ of eq. 18."""
    sigma = robot.sigma
    return _core.Robot(
        name=robot.name,
        platform=robot.platform,
        cables=robot.cables,
        tension_limits_N=robot.tension_limits_N,
        gravity_m_s2=robot.gravity_m_s2,
        euler_convention=robot.euler_convention,
        sigma=_core.SensorSigma(
            length_m=factor * sigma.length_m,
            swivel_rad=factor * sigma.swivel_rad,
            attitude_rad=factor * sigma.attitude_rad,
            tension_N=factor * sigma.tension_N,
        ),
    )


Readings = dict[str, Any]


def _swivel_eccentricity(readings: Readings, amount: float) -> None:
    readings["swivel_rad"] += amount * np.sin(readings["swivel_rad"])


def _roll_pitch_scale(readings: Readings, amount: float) -> None:
    readings["roll_pitch_yaw_rad"][:, :2] *= 1.0 + amount


def _load_cell_curvature(readings: Readings, amount: float) -> None:
    readings["tension_N"] *= 1.0 + amount * readings["tension_N"]


#: What is outside the catalogue and not in the plant either: done to the readings of the log.
_IN_READINGS: dict[str, Callable[[Readings, float], None]] = {
    "swivel_eccentricity": _swivel_eccentricity,
    "roll_pitch_scale": _roll_pitch_scale,
    "load_cell_curvature": _load_cell_curvature,
}
#: Effects of the plant that begin at a time, their first value.
_TIMED = {e["name"] for e in _core.injectable_effects() if e["parameters"][0][0] == "time_s"}


def _in_plant(hidden: Hidden) -> bool:
    return hidden.name not in _IN_READINGS


def _injected(hidden: Hidden, duration_s: float) -> _core.InjectedEffect:
    values = list(hidden.values)
    if hidden.name in _TIMED:
        values[0] *= duration_s  # drawn as a share of the run
    return _core.InjectedEffect(hidden.name, values)


def _altered(
    run: _core.StartUpRun,
    case: Case,
    setting: Setting,
    robot: _core.Robot,
    rng: np.random.Generator,
) -> _core.Log:
    """The log with what is wrong in its readings alone: outside effects, errors of whole poses."""
    readings: Readings = {
        "length_m": np.array(run.log.length_m),
        "swivel_rad": np.array(run.log.swivel_rad),
        "tension_N": np.array(run.log.tension_N),
        "roll_pitch_yaw_rad": np.array(run.log.roll_pitch_yaw_rad),
    }
    for hidden in case.hidden:
        if hidden.name in _IN_READINGS:
            _IN_READINGS[hidden.name](readings, hidden.values[0])
    if setting.noise_kind == NoiseKind.pose:
        sigma = robot.sigma
        scales = {
            "length_m": sigma.length_m,
            "swivel_rad": sigma.swivel_rad,
            "tension_N": sigma.tension_N,
            "roll_pitch_yaw_rad": sigma.attitude_rad,
        }
        knots = np.array([[rest.begin_s, rest.end_s] for rest in run.rests]).ravel()
        for name, scale in scales.items():
            for column in range(readings[name].shape[1]):
                errors = setting.noise * scale * rng.standard_normal(len(run.rests))
                # Constant over each rest, on its way to the next one's in between.
                readings[name][:, column] += np.interp(run.log.time_s, knots, np.repeat(errors, 2))
    return _core.Log(
        time_s=run.log.time_s,
        tension_setpoint_N=run.log.tension_setpoint_N,
        source=f"case-{case.number}",
        **readings,
    )
