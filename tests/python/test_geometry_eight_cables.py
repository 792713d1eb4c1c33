"""The frame of an eight-cable robot, from pulleys that a tape measured to 50 mm."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares
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


def places(
    robot: cdprcal.Robot, count: int, rng: np.random.Generator, tilt_rad: float = 0.25
) -> list[cdprcal.InverseResult]:
    """All over the workspace, tilted by up to so much about each axis."""
    box, level = cdprcal.workspace_box(robot), cdprcal.held_orientation(robot)
    out: list[cdprcal.InverseResult] = []
    while len(out) < count:
        at = box.lower_m + rng.uniform(0.1, 0.9, 3) * (box.upper_m - box.lower_m)
        turn = Rotation.from_rotvec(rng.uniform(-tilt_rad, tilt_rad, 3)).as_matrix()
        rotation = turn @ cdprcal.Pose(at, level).rotation
        found = cdprcal.inverse(robot, at, rotation=rotation)
        if found.status == cdprcal.EquilibriumStatus.found:
            out.append(found)
    return out


def whole_lengths(robot: cdprcal.Robot, count: int, rng: np.random.Generator) -> cdprcal.Log:
    lengths = [at.length_m + rng.normal(0.0, NOISE_M, 8) for at in places(robot, count, rng)]
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


def moved_to(file: Array, frame: Array, turns: int) -> Array:
    """A frame shifted, and turned about so many axes from z on, to agree best with a file's."""
    middle = frame.mean(0)

    def moved(motion: Array) -> Array:
        turn = np.zeros(3)
        turn[::-1][:turns] = motion[3:]
        turned: Array = Rotation.from_rotvec(turn).apply(frame - middle) + middle + motion[:3]
        return turned

    best = least_squares(lambda m: (moved(m) - file).ravel(), np.zeros(3 + turns))
    return moved(best.x)


def test_a_frame_whose_north_shows_in_part_is_where_the_gauge_says(robot: cdprcal.Robot) -> None:
    """Angles about the world's axes show a little of where north is: pulleys were up to 8 σ from
    where they were said to be, their distances right."""
    count, off = 15, []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        north_rad = np.array([0.0, 0.0, rng.uniform(-3.0, 3.0)])
        poses = places(robot, count, rng, tilt_rad=0.15)
        angles = [at.pose.euler_rad(robot.euler_convention) for at in poses if at.pose is not None]
        log = cdprcal.Log(
            time_s=10.0 * np.arange(count),
            direct_length_m=[at.length_m + rng.normal(0.0, 1e-3, 8) for at in poses],
            roll_pitch_yaw_rad=np.array(angles) + north_rad + rng.normal(0.0, 9e-3, (count, 3)),
        )
        file = by_tape(robot, rng, 0.1, said=False)
        found = cdprcal.find_frame(file, [log], offset="none")
        assert found.status == cdprcal.FrameStatus.converged, found.reason
        motions = int(found.gauge.split(" rigid motions")[0].split()[-1])
        truth = moved_to(pulleys(file), pulleys(robot), motions - 3)
        off.append((found.anchors_m - truth) / found.anchors_sigma_m)
    assert np.abs(off).max() < 4.0
    assert np.sqrt(np.mean(np.square(off))) < 1.5


def test_one_start_that_is_tried_twice_is_no_second_opinion(robot: cdprcal.Robot) -> None:
    """Changes of length alone: the first start ends metres away, and signs were blamed."""
    rng = np.random.default_rng(1)
    count = int(rng.integers(6, 14))
    lengths = np.array([at.length_m for at in places(robot, count, rng)])
    lengths += rng.normal(0.0, 1e-3, lengths.shape)
    log = cdprcal.Log(time_s=10.0 * np.arange(count), length_m=lengths - lengths[0])
    found = cdprcal.calibrate(robot, log).result
    assert found.status == cdprcal.CalibrationStatus.unobservable  # few poses, hardly tilted
    assert "signs" not in found.reason
