"""Platforms on guides, and points: which tensions hold them, and logs of them end to end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import cdprcal
from conftest import Cli

GUIDED = ["belts4", "hang4"]


def basis(robot: cdprcal.Robot) -> np.ndarray:
    """Directions in which a point may move, from the words of the robot file."""
    axes = np.eye(3)
    normal = robot.platform.motion_plane_normal
    if normal is not None:
        axes = np.array([axis for axis in axes if abs(axis @ normal) < 0.5])
    return axes


def feasible(robot: cdprcal.Robot, position_m: np.ndarray) -> bool:
    """By linear programming over the forces that count."""
    pulls = np.array([cable.pulley.position_m - position_m for cable in robot.cables])
    pulls /= np.linalg.norm(pulls, axis=1)[:, None]
    free = basis(robot)
    found = linprog(
        np.zeros(robot.cable_count),
        A_eq=free @ pulls.T,
        b_eq=free @ [0.0, 0.0, robot.weight_N],
        bounds=[tuple(robot.tension_limits_N)] * robot.cable_count,
    )
    return bool(found.status == 0)


@pytest.mark.parametrize("name", GUIDED)
@settings(max_examples=60, deadline=None)
@given(share=st.tuples(*[st.floats(-0.95, 0.95)] * 3))
def test_tensions_are_found_where_linear_programming_finds_some(
    name: str, share: tuple[float, float, float]
) -> None:
    robot = cdprcal.load_robot(name)
    pulleys = np.array([cable.pulley.position_m for cable in robot.cables])
    middle, half = (pulleys.max(0) + pulleys.min(0)) / 2, (pulleys.max(0) - pulleys.min(0)) / 2
    position_m = middle + np.array(share) * half
    found = cdprcal.inverse(robot, position_m)
    inside = feasible(robot, position_m)
    assert (found.status == cdprcal.EquilibriumStatus.found) == inside, found.reason
    if inside:
        assert found.pose is not None
        low, high = robot.tension_limits_N
        assert low - 1e-6 <= found.tension_N.min() <= found.tension_N.max() <= high + 1e-6
        assert found.residual_N < 1e-6
        assert len(found.lambda_N) == robot.cable_count - len(basis(robot))
        np.testing.assert_array_equal(found.pose.rotation, np.eye(3))


def test_off_its_plane_a_platform_is_not_held() -> None:
    robot = cdprcal.load_robot("belts4")
    found = cdprcal.inverse(robot, [0.0, 0.01, 1.0])
    assert found.status == cdprcal.EquilibriumStatus.not_found
    assert "motion does not take it there" in found.reason


@pytest.mark.parametrize("name", GUIDED)
def test_a_generated_log_is_calibrated(name: str, cli: Cli, tmp_path: Path) -> None:
    run, truth = tmp_path / "run.csv", tmp_path / "truth.json"
    made = cli("generate", name, "-o", run, "--noise", "0.1", "--seed", "3")
    assert made.code == 0, made.stderr
    robot = cdprcal.load_robot(name)
    setpoints, poses = cdprcal.default_stops(robot, 2, 2, 2)
    options = cdprcal.SyntheticLogOptions(noise=cdprcal.reading_noise(robot.sigma, 0.1), seed=4)
    synthetic = cdprcal.synthetic_log(robot, setpoints, options, poses)
    log = synthetic.log
    free = basis(robot)
    spread = np.ptp([pose.position_m for pose in poses], axis=0)
    assert np.all(spread[~np.any(free.astype(bool), axis=0)] == 0.0)  # in their plane
    result = cdprcal.calibrate(robot, log).result
    assert result.status == cdprcal.CalibrationStatus.converged, result.reason
    error = result.poses[0].position_m - synthetic.poses[0].position_m
    assert np.linalg.norm(error) < 5e-3
    assert not truth.exists()


def test_cables_are_counted_against_the_freedoms() -> None:
    robot = cdprcal.load_robot("belts4")
    yaml = cdprcal.to_yaml(robot)
    one = cdprcal.parse_robot(
        yaml[: yaml.index("  - pulley", yaml.index("  - pulley") + 1)]
        + yaml[yaml.index("tension_limits_N") :],
        "one.yaml",
    )
    with pytest.raises(cdprcal.InputError, match="2T needs 2 to 4 cables, not 1"):
        cdprcal.inverse(one, [0.0, 0.0, 1.0])
