"""The frame of an eight-cable robot, from pulleys that a tape measured to 50 mm."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import cdprcal
from robots import by_tape

Array = NDArray[np.float64]
NOISE_M = 2e-4


@pytest.fixture(scope="module")
def robot() -> cdprcal.Robot:
    return cdprcal.load_robot("posts8")


def pulleys(robot: cdprcal.Robot) -> Array:
    return np.array([cable.pulley.position_m for cable in robot.cables])


def whole_lengths(robot: cdprcal.Robot, count: int, rng: np.random.Generator) -> cdprcal.Log:
    """At poses all over the workspace, tilted by up to a quarter of a radian about each axis."""
    box, level = cdprcal.workspace_box(robot), cdprcal.held_orientation(robot)
    lengths: list[Array] = []
    while len(lengths) < count:
        at = box.lower_m + rng.uniform(0.1, 0.9, 3) * (box.upper_m - box.lower_m)
        turn = Rotation.from_rotvec(rng.uniform(-0.25, 0.25, 3)).as_matrix()
        rotation = turn @ cdprcal.Pose(at, level).rotation
        found = cdprcal.inverse(robot, at, rotation=rotation)
        if found.status == cdprcal.EquilibriumStatus.found:
            lengths.append(found.length_m + rng.normal(0.0, NOISE_M, 8))
    return cdprcal.Log(time_s=10.0 * np.arange(count), direct_length_m=np.array(lengths))


def distance_m(found: Array, truth: Array) -> float:
    """rms, turned and shifted to agree best: where the frame is in the world nobody knows."""
    a, b = found - found.mean(0), truth - truth.mean(0)
    turn, _ = Rotation.align_vectors(b, a)
    return float(np.sqrt(((turn.apply(a) - b) ** 2).sum(1).mean()))


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5, 6])
def test_few_poses_end_in_the_best_minimum(robot: cdprcal.Robot, seed: int) -> None:
    """Some poses begin in minima of their own, and bend the frame towards them."""
    rng = np.random.default_rng(seed)
    found = cdprcal.find_frame(by_tape(robot, rng), [whole_lengths(robot, 30, rng)])
    assert found.status == cdprcal.FrameStatus.converged, found.reason
    assert found.rms_m < NOISE_M
    sigma_m = float(np.sqrt((found.anchors_sigma_m**2).sum(1).mean()))
    assert distance_m(found.anchors_m, pulleys(robot)) < 2.5 * sigma_m < 0.01


def test_a_hundred_poses_tell_the_frame_to_a_millimetre(robot: cdprcal.Robot) -> None:
    rng = np.random.default_rng(11)
    off_m = []
    for _ in range(3):
        found = cdprcal.find_frame(by_tape(robot, rng), [whole_lengths(robot, 100, rng)])
        off_m.append(distance_m(found.anchors_m, pulleys(robot)))
    assert np.median(off_m) < 1e-3
