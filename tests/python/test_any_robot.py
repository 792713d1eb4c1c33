"""Two to eight cables, eyelets or pulleys: the initial pose of any robot, by the same call."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

import cdprcal
from cdprcal import CalibrateOptions, CalibrationStatus, Method
from cdprcal.cli.generate import with_sensors
from cdprcal.sensors import OPTIONS as SENSORS
from cdprcal.studies.monte_carlo import start_up_options
from robots import polygon_robot

#: No honest error is this large (Mahalanobis², six degrees of freedom).
UNLIKELY = chi2.ppf(1.0 - 1e-5, 6)


def start_up(robot: cdprcal.Robot, seed: int) -> cdprcal.SyntheticLog:
    """Six random tension set-points at which the platform hangs, in noise of a tenth of sigma."""
    random = np.random.default_rng(seed)
    share_N = robot.platform.mass_kg * robot.gravity_m_s2 / robot.cable_count
    quick = cdprcal.SyntheticLogOptions(dwell_s=0.5, move_s=0.5, rate_Hz=4.0)
    setpoints: list[np.ndarray] = []
    for _ in range(300):
        mean_N = share_N * random.uniform(1.1, 1.6)
        tension_N = mean_N * random.uniform(0.8, 1.25, size=robot.cable_count)
        try:
            cdprcal.synthetic_log(robot, [*setpoints[-1:], tension_N], quick)
        except cdprcal.InputError:
            continue  # nothing hangs there, or not on the way
        setpoints.append(tension_N)
        if len(setpoints) == 6:
            break
    options = start_up_options(robot, seed, 0.1, dwell_s=3.0, move_s=3.0)
    return cdprcal.synthetic_log(robot, setpoints, options)


@pytest.mark.parametrize("radius_m", [0.0, 0.03])
@pytest.mark.parametrize("cables", range(2, 9))
def test_by_statics_and_unified(cables: int, radius_m: float) -> None:
    robot = polygon_robot(cables, radius_m)
    made = start_up(robot, cables)
    for method in (Method.unified, Method.statics):
        options = CalibrateOptions(method=method)
        result = cdprcal.calibrate(robot, made.log, options).result
        assert result.status == CalibrationStatus.converged, (method, result.reason)
        assert result.covariance is not None
        error = cdprcal.minus(result.poses[0], made.poses[0])
        assert error @ np.linalg.solve(result.covariance, error) < UNLIKELY, method
        assert np.all(result.standard_deviation[:3] < 0.01)
    # Geometry alone says it, or says that it cannot.
    options = CalibrateOptions(method=Method.kinematic)
    result = cdprcal.calibrate(robot, made.log, options).result
    assert result.reason
    if result.covariance is not None:
        error = cdprcal.minus(result.poses[0], made.poses[0])
        assert error @ np.linalg.solve(result.covariance, error) < UNLIKELY


@pytest.mark.parametrize("radius_m", [0.0, 0.03])
@pytest.mark.parametrize("cables", [3, 4, 5])
def test_a_curved_valley_is_no_minimum(cables: int, radius_m: float) -> None:
    """Swivels and attitude alone hardly know the scale: a pose is right, or is not claimed."""
    robot = polygon_robot(cables, radius_m)
    made = start_up(robot, cables)
    log = with_sensors(made.log, {SENSORS["swivels"], SENSORS["attitude"]})
    result = cdprcal.calibrate(robot, log).result
    assert (result.covariance is not None) == (result.status == CalibrationStatus.converged)
    if result.covariance is None:
        assert "measure at more" in result.reason
        return
    error = cdprcal.minus(result.poses[0], made.poses[0])
    assert error @ np.linalg.solve(result.covariance, error) < UNLIKELY


@pytest.mark.parametrize("cables", [6, 7, 8])
def test_by_lengths_of_a_fully_held_platform(cables: int) -> None:
    """Six cables and more hold every direction: lengths along a path are enough by themselves."""
    robot = polygon_robot(cables, 0.03)
    random = np.random.default_rng(cables)
    home = cdprcal.Pose.from_euler([0.05, -0.03, 1.0], [0.02, -0.03, 0.05])
    poses = [home]
    for _ in range(24):
        twist = np.r_[random.uniform(-0.35, 0.35, 3), random.uniform(-0.25, 0.25, 3)]
        poses.append(cdprcal.plus(home, twist))
    noise = cdprcal.reading_noise(robot.sigma, 0.1)
    generator = cdprcal.RandomNormal(cables)
    offsets = cdprcal.random_offsets(cables, generator)
    slack = np.zeros(cables)
    measurements = [
        cdprcal.synthetic_measurement(
            robot, pose, slack, cdprcal.PoseKind.kinematic_pose, offsets, noise, generator
        )
        for pose in poses
    ]
    problem = cdprcal.CalibrationProblem(
        robot=robot,
        measurements=measurements,
        statics=cdprcal.StaticsModel.none,
        noise=cdprcal.NoiseModel(
            {
                "length": cdprcal.ChannelNoise(noise.length_m),
                "swivel": cdprcal.ChannelNoise(noise.swivel_rad),
                "roll_pitch": cdprcal.ChannelNoise(noise.roll_pitch_rad),
                "yaw": cdprcal.ChannelNoise(noise.yaw_rad),
                "balance": cdprcal.ChannelNoise(1.0),
            },
            1.0,
            1.0,
        ),
    )
    off = cdprcal.plus(home, np.array([0.1, -0.1, 0.1, 0.1, 0.05, -0.1]))
    guess = [cdprcal.plus(off, cdprcal.minus(pose, home)) for pose in poses]
    result = cdprcal.solve(problem, guess)
    assert result.status == CalibrationStatus.converged, result.reason
    assert result.covariance is not None
    error = cdprcal.minus(result.poses[0], home)
    assert error @ np.linalg.solve(result.covariance, error) < UNLIKELY
    assert np.all(result.standard_deviation[:3] < 5e-3)


def test_the_example_of_eight_cables() -> None:
    robot = cdprcal.load_robot("posts8")
    made = start_up(robot, 3)
    result = cdprcal.calibrate(robot, made.log).result
    assert result.status == CalibrationStatus.converged, result.reason
    assert result.covariance is not None
    error = cdprcal.minus(result.poses[0], made.poses[0])
    assert error @ np.linalg.solve(result.covariance, error) < UNLIKELY


def test_a_planar_like_robot() -> None:
    """Two cables in one vertical plane: the platform swings out of it, and that is seen."""
    robot = polygon_robot(2, 0.02)
    made = start_up(robot, 5)
    calibration = cdprcal.calibrate(robot, made.log)
    assert calibration.result.status == CalibrationStatus.converged
    error = cdprcal.minus(calibration.result.poses[0], made.poses[0])
    assert np.linalg.norm(error[:3]) < 5e-3
