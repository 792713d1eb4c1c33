"""Floor, keep-out boxes and limits of length: workspaces and plans keep clear, runs stop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import cdprcal
from cdprcal.testing.altered import altered
from conftest import Cli

BOX = cdprcal.Box([0.35, -0.25, 0.0], [0.7, 0.25, 1.25])


@pytest.fixture(scope="module")
def crowded(robot: cdprcal.Robot) -> cdprcal.Robot:
    around = cdprcal.Surroundings(floor_m=0.3, keep_out=[BOX], length_limits_m=(0.6, 2.6))
    return altered(robot, surroundings=around)


def in_the_way(robot: cdprcal.Robot, pose: cdprcal.Pose) -> bool:
    """By sampling the platform's box and its cables densely, as somebody with a ruler would."""
    around = robot.surroundings
    state = cdprcal.platform_state(robot, pose)
    arms = np.array([*state.anchor_arm_m, np.zeros(3)])
    low, high = arms.min(0) + pose.position_m, arms.max(0) + pose.position_m
    if low[2] < around.floor_m:
        return True
    lengths = np.array(state.length_m)
    if lengths.min() < around.length_limits_m[0] or lengths.max() > around.length_limits_m[1]:
        return True
    for box in around.keep_out:
        if np.all(low < box.upper_m) and np.all(box.lower_m < high):
            return True
        for arm, cable in zip(state.anchor_arm_m, state.cable, strict=True):
            anchor = pose.position_m + arm
            along = np.linspace(0.0, cable.free_length_m, 4000)[:, None]
            line = anchor - along * cable.direction
            if np.any(np.all((line > box.lower_m) & (line < box.upper_m), axis=1)):
                return True
    return False


def test_words_agree_with_a_ruler(crowded: cdprcal.Robot) -> None:
    rng = np.random.default_rng(5)
    agreed = blocked = 0
    for _ in range(300):
        position = rng.uniform([-0.9, -0.9, 0.1], [0.9, 0.9, 1.7])
        turn = cdprcal.exp_so3(rng.normal(0.0, 0.1, 3))
        pose = cdprcal.Pose(position, turn)
        said = cdprcal.obstruction(crowded, pose) != ""
        agreed += said == in_the_way(crowded, pose)
        blocked += said
    assert agreed >= 298  # a ruler of 4000 marks misses grazes
    assert 30 < blocked < 270


def test_the_workspace_is_cut_out(robot: cdprcal.Robot, crowded: cdprcal.Robot) -> None:
    free = cdprcal.compute_workspace(robot, step_m=0.12)
    cut = cdprcal.compute_workspace(crowded, step_m=0.12)
    assert 0 < cut.points_inside < free.points_inside
    for i in range(0, cut.points_inside, 7):
        w, x, y, z = cut.quaternion_wxyz[i]
        turn = Rotation.from_quat([x, y, z, w]).as_matrix()
        pose = cdprcal.Pose(cut.inside_m[i], turn)
        assert cdprcal.obstruction(crowded, pose) == ""
    inside = cdprcal.inverse(crowded, [0.5, 0.0, 0.8])
    assert inside.status == cdprcal.EquilibriumStatus.obstructed
    assert "keep_out[#1]" in inside.reason


def test_a_plan_keeps_clear_all_the_way(crowded: cdprcal.Robot) -> None:
    result = cdprcal.make_plan(crowded)
    assert result.status == cdprcal.PlanStatus.planned, result.reason
    assert cdprcal.verify_plan(crowded, result.plan) == ""
    for stop in result.plan.poses:
        assert cdprcal.obstruction(crowded, stop.pose) == ""


def test_a_plan_of_before_is_refused(robot: cdprcal.Robot) -> None:
    plan = cdprcal.make_plan(robot).plan
    through = plan.poses[3].pose.position_m
    box = cdprcal.Box(through - 0.02, through + 0.02)
    blocked = altered(robot, surroundings=cdprcal.Surroundings(keep_out=[box]))
    assert cdprcal.verify_plan(robot, plan) == ""
    assert "in the way" in cdprcal.verify_plan(blocked, plan)


def test_a_plan_that_did_not_know_the_floor_is_not_run(
    robot: cdprcal.Robot, cli: Cli, tmp_path: Path
) -> None:
    plan = cdprcal.make_plan(robot).plan
    cdprcal.write_plan(plan, str(tmp_path / "plan.csv"))
    height_m = min(stop.pose.position_m[2] for stop in plan.poses)
    text = cdprcal.builtin_robot_yaml("irma4") + f"floor_m: {height_m + 0.1:.3f}\n"
    (tmp_path / "robot.yaml").write_text(text)
    ran = cli("acquire", tmp_path / "robot.yaml", tmp_path / "plan.csv", "--seed", "1", "-o",
              tmp_path / "run.csv")  # fmt: skip
    ran.refused("cannot be run with irma4")
    assert not (tmp_path / "run.csv").exists()
