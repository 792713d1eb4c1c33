"""Monte Carlo: many simulated start-ups of a robot, each calibrated and held against its truth."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from cdprcal import _core
from cdprcal._core import CalibrateOptions, Robot
from cdprcal.studies.workers import Workers, spread


@dataclass(frozen=True)
class StartUpRow:
    """One calibration against truth; NaN where it did not converge."""

    seed: int
    status: str
    position_error_m: float
    rotation_error_rad: float  #: geodesic
    mahalanobis: float  #: error' covariance^-1 error: chi-square of 6 when the claims are honest
    twist_error: tuple[float, ...]  #: [6] m, rad (world axes)
    standard_deviation: tuple[float, ...]  #: [6] claimed


def start_ups(
    robot: Robot,
    seeds: Sequence[int],
    *,
    setpoints_N: Sequence[Sequence[float]] | None = None,
    sensors: Collection[str] | None = None,
    noise: float = 1.0,
    dwell_s: float = 4.0,
    move_s: float = 4.0,
    workers: Workers | None = None,
) -> list[StartUpRow]:
    """A row a seed: a quasi-static run through the set-points, calibrated.

    ``noise`` scales the robot file's sigma, which is white noise on every reading; the balance is
    as exact as the robot file says. ``setpoints_N`` [k][n]: default an eight-pose grid, which six
    cables and more reach by their lengths. ``sensors``: groups of a Log that are read (default: the
    robot's own four). Raises InputError where there is no stable equilibrium.
    """
    poses: list[_core.Pose] = []
    if setpoints_N is None:
        stops_N, places = _core.default_stops(robot, 2, 2, 2)
        setpoints_N = [list(s) for s in stops_N]
        poses = places if _core.holds_orientation(robot) else []
    work = partial(
        one_start_up,
        robot=robot,
        setpoints_N=[list(map(float, s)) for s in setpoints_N],
        poses=poses,
        sensors=None if sensors is None else tuple(sensors),
        noise=noise,
        dwell_s=dwell_s,
        move_s=move_s,
    )
    return spread(work, list(seeds), workers)


def start_up_options(
    robot: Robot, seed: int, noise: float, dwell_s: float, move_s: float
) -> _core.SyntheticLogOptions:
    """A start-up with `noise` times the robot's σ and a balance as exact as its file says."""
    return _core.SyntheticLogOptions(
        dwell_s=dwell_s,
        move_s=move_s,
        noise=_core.reading_noise(robot.sigma, noise),
        wrench_force_N=robot.sigma.wrench_force_N,
        wrench_moment_Nm=_core.characteristic_length_m(robot) * robot.sigma.wrench_force_N,
        seed=seed,
    )


def one_start_up(
    seed: int,
    robot: Robot,
    setpoints_N: Sequence[Sequence[float]],
    noise: float,
    dwell_s: float,
    move_s: float,
    poses: Sequence[_core.Pose] = (),
    sensors: Collection[str] | None = None,
) -> StartUpRow:
    """The row of one seed."""
    options = start_up_options(robot, seed, noise, dwell_s, move_s)
    setpoints = [np.asarray(s) for s in setpoints_N]
    made = _core.synthetic_log(robot, setpoints, options, list(poses))
    log = made.log if sensors is None else with_sensors(made.log, sensors)
    result = _core.calibrate(robot, log, CalibrateOptions()).result
    if result.covariance is None or not result.poses:
        lost = (np.nan,) * 6
        return StartUpRow(seed, result.status.name, np.nan, np.nan, np.nan, lost, lost)
    pose, truth = result.poses[0], made.poses[0]
    error = _core.minus(pose, truth)
    return StartUpRow(
        seed,
        result.status.name,
        float(np.linalg.norm(error[:3])),
        _core.rotation_distance_rad(pose, truth),
        float(error @ np.linalg.solve(result.covariance, error)),
        tuple(error.tolist()),
        tuple(result.standard_deviation.tolist()),
    )


def with_sensors(log: _core.Log, groups: Collection[str]) -> _core.Log:
    """The log of a robot that has these sensors only (groups of a Log).

    What load cells were told to show is kept with them.
    """
    kept = {group: getattr(log, group) for group in groups}
    if "tension_N" in groups:
        kept["tension_setpoint_N"] = log.tension_setpoint_N
    return _core.Log(time_s=log.time_s, source=log.source, **kept)


def coverage(rows: Sequence[StartUpRow]) -> float:
    """Share of the converged start-ups whose truth is inside the claimed 95 % region."""
    limit = 12.591587243743977  # 95 % of chi-square with 6 degrees of freedom
    good = [row.mahalanobis for row in rows if row.status == "converged"]
    return float(np.mean(np.array(good) < limit)) if good else float("nan")
