"""Platforms on guides, and points: which tensions hold them, and logs of them end to end; from the
workspace to the diagnosis: planned, simulated, run, calibrated."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import cdprcal
from cdprcal.planning.start_up import start_up_plan
from conftest import Cli

#: A plate in the x, z plane that may turn in it, and whose centre of mass is beside its middle.
PLATE = """
name: plate
platform:
  mass_kg: 2.5
  motion: 1R2T
  motion_plane_normal: [0, 1, 0]
  centre_of_mass_m: [0.01, 0, -0.02]
  inertia_kg_m2: [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]]
cables:
  - {pulley: {radius_m: 0, position_m: [-0.44, 0, 0.7]}, platform_anchor_m: [-0.06, 0, -0.04]}
  - {pulley: {radius_m: 0, position_m: [0.44, 0, 0.7]}, platform_anchor_m: [0.06, 0, -0.04]}
  - {pulley: {radius_m: 0, position_m: [0.44, 0, 0]}, platform_anchor_m: [0.06, 0, 0.04]}
  - {pulley: {radius_m: 0, position_m: [-0.44, 0, 0]}, platform_anchor_m: [-0.06, 0, 0.04]}
tension_limits_N: [3, 80]
sensors:
  sigma: {length_m: 0.001, tension_N: 1}
"""
NAMES = ["belts4", "hang4", "plate"]


def robot_of(name: str) -> cdprcal.Robot:
    return cdprcal.parse_robot(PLATE, "plate") if name == "plate" else cdprcal.load_robot(name)


def may_move(robot: cdprcal.Robot) -> np.ndarray:
    """Rows: the twists that the words of the robot file leave it."""
    motion = robot.platform.motion
    shifts = np.eye(6)[:3] if motion == "3T" else np.eye(6)[[0, 2]]
    return np.vstack([shifts, np.eye(6)[[4]]]) if motion == "1R2T" else shifts


def unbalanced(robot: cdprcal.Robot, pose: cdprcal.Pose, tension_N: np.ndarray) -> float:
    state = cdprcal.platform_state(robot, pose)
    wrench = cdprcal.wrench_residual(robot, state, tension_N)
    return float(np.abs(may_move(robot) @ wrench).max())


@pytest.mark.parametrize("name", ["belts4", "plate"])
@pytest.mark.parametrize(
    "effect", ["frame_scale=0.01,0,0.01", "frame_shear=0,0.01,0", "frame_warp=0.01"]
)
def test_a_flat_frame_may_be_deformed(name: str, effect: str) -> None:
    """It has no corners across its plane, and nothing of it is lost for that."""
    robot = robot_of(name)
    injected = cdprcal.parse_injected_effect(effect)
    simulator = cdprcal.Simulator(robot, cdprcal.SimulatorOptions(effects=[injected]))
    rest = simulator.reset(np.full(4, 0.5 * sum(robot.tension_limits_N)))
    assert rest.found, rest.reason
    assert np.all(np.isfinite(rest.pose.position_m))


@pytest.mark.parametrize("name", NAMES)
def test_lengths_and_tensions_lead_back_to_the_pose(name: str) -> None:
    """The direct problem, of the tensions that the inverse one finds."""
    robot = robot_of(name)
    box = cdprcal.workspace_box(robot)
    rng = np.random.default_rng(5)
    seen = 0
    for share in rng.uniform(0.2, 0.8, (40, 3)):
        there = cdprcal.inverse(robot, box.lower_m + share * (box.upper_m - box.lower_m))
        if there.status != cdprcal.EquilibriumStatus.found or there.pose is None:
            continue
        assert unbalanced(robot, there.pose, there.tension_N) < 1e-6
        if not there.stability.constant_tensions_N_m > 0.0:
            continue  # tensions do not hold it there
        seen += 1
        back = cdprcal.direct_from_tensions(robot, there.tension_N)
        assert back.status == cdprcal.EquilibriumStatus.found, back.reason
        assert back.pose is not None
        np.testing.assert_allclose(back.pose.position_m, there.pose.position_m, atol=1e-6)
        assert cdprcal.rotation_distance_rad(back.pose, there.pose) < 1e-6
    assert seen > 3


def test_two_belts_hold_a_carriage_in_its_plane_by_their_lengths() -> None:
    """As many cables as freedoms: where both circles around the pulleys meet, below."""
    text = cdprcal.builtin_robot_yaml("belts4")
    upper = text[: text.index("  - pulley: {radius_m: 0, position_m: [1.6, 0, 0]}")]
    robot = cdprcal.parse_robot(upper + text[text.index("tension_limits_N") :], "belts2")
    assert robot.cable_count == 2
    found = cdprcal.direct_from_lengths(robot, [2.0, 1.8])
    assert found.status == cdprcal.EquilibriumStatus.found, found.reason
    assert found.pose is not None
    x = (2.0**2 - 1.8**2) / (2 * 3.2)
    np.testing.assert_allclose(
        found.pose.position_m, [x, 0.0, 2.2 - np.sqrt(2.0**2 - (x + 1.6) ** 2)], atol=1e-9
    )
    assert unbalanced(robot, found.pose, found.tension_N) < 1e-9
    with pytest.raises(cdprcal.InputError, match="at most 2"):
        cdprcal.direct_from_lengths(cdprcal.load_robot("belts4"), [2.0, 1.8, 2.0, 2.0])


def test_the_workspace_of_a_plane_is_where_linear_programming_finds_tensions() -> None:
    robot = robot_of("plate")
    workspace = cdprcal.compute_workspace(robot, step_m=0.05)
    grid = workspace.grid
    assert list(grid.count) == [18, 1, 15]
    free = may_move(robot)
    differ = 0
    for index in np.ndindex(18, 15):
        position = grid.origin_m + grid.step_m * np.array([index[0], 0, index[1]])
        state = cdprcal.platform_state(robot, cdprcal.Pose(position, np.eye(3)))
        solved = state.valid and linprog(
            np.zeros(4),
            A_eq=free @ cdprcal.structure_matrix(state),
            b_eq=free @ cdprcal.gravity_wrench(robot, state),
            bounds=[tuple(robot.tension_limits_N)] * 4,
        )
        feasible = bool(solved and solved.status == 0)
        inside = workspace.status[index[1], 0, index[0]] == int(cdprcal.PointStatus.inside)
        differ += feasible != inside
    assert workspace.points_inside > 50
    assert differ <= 1  # one on the boundary
    shape = cdprcal.workspace_shape(workspace)
    assert shape.watertight
    assert np.ptp(shape.mesh.vertices_m[:, 1]) == pytest.approx(grid.step_m)
    assert shape.volume_m3 / grid.step_m == pytest.approx(
        workspace.points_inside * grid.step_m**2, rel=0.1
    )
    box = cdprcal.largest_inscribed_box(workspace)
    assert box is not None
    assert box.lower_m[1] == box.upper_m[1] == 0.0
    assert (box.upper_m - box.lower_m)[[0, 2]].min() > 0.3


def test_a_plane_along_no_axis_is_refused_where_boxes_are_needed() -> None:
    turned = PLATE.replace("normal: [0, 1, 0]", "normal: [0.6, 0.8, 0]")
    robot = cdprcal.parse_robot(turned, "turned.yaml")
    with pytest.raises(cdprcal.InputError, match="turn the frame of the robot file"):
        cdprcal.compute_workspace(robot)


@pytest.mark.parametrize("name", NAMES)
def test_a_plan_leads_by_lengths(name: str) -> None:
    robot = robot_of(name)
    result = cdprcal.make_plan(robot)
    assert result.status == cdprcal.PlanStatus.planned, result.reason
    plan = result.plan
    assert cdprcal.verify_plan(robot, plan) == ""
    assert len(start_up_plan(plan).pose) == 1 + len(plan.poses)
    assert np.isfinite(plan.predicted_standard_deviation).all()
    fixed = np.flatnonzero(~np.any(may_move(robot), axis=0))
    np.testing.assert_allclose(plan.predicted_standard_deviation[fixed], 0.0, atol=1e-12)
    for stop in plan.poses:
        assert unbalanced(robot, stop.pose, stop.tension_N) < 1e-6
        assert cdprcal.tension_margin_N(robot, stop.tension_N) >= robot.sigma.tension_N - 1e-9


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", ["hang4", "posts8"])
def test_the_default_plan_keeps_every_cable_within_its_limits(name: str, seed: int) -> None:
    """No cable governs the tensions everywhere, and each gives what accelerations take."""
    robot = cdprcal.load_robot(name)
    plan = cdprcal.make_plan(robot).plan
    run = cdprcal.simulate_startup(robot, plan, seed=seed)
    assert run.state == cdprcal.StartUpState.done, run.reason
    moving = run.log.time_s > 5.0
    tension_N = run.log.tension_N[moving]
    low, high = robot.tension_limits_N
    assert tension_N.min() > 0.3 * low
    assert tension_N.max() < 1.05 * high + 3.0 * robot.sigma.tension_N


def test_chosen_poses_know_their_accuracy() -> None:
    result = cdprcal.make_plan(robot_of("plate"), optimal=4)
    assert result.status == cdprcal.PlanStatus.planned, result.reason
    assert result.comparison is not None
    by_count = result.comparison.optimal_standard_deviation
    assert np.isfinite(by_count).all()
    assert by_count[-1][0] < by_count[0][0]


@pytest.mark.parametrize("name", NAMES)
def test_a_start_up_is_simulated_calibrated_and_diagnosed(
    name: str, cli: Cli, tmp_path: Path
) -> None:
    robot = robot_of(name)
    file = tmp_path / "robot.yaml"
    file.write_text(cdprcal.to_yaml(robot))
    plan, run, truth = tmp_path / "plan.csv", tmp_path / "run.csv", tmp_path / "truth.json"
    grid = ["--grid", "2x2x2" if name == "hang4" else "3x3x3"]
    assert cli("plan", file, "-o", plan, *grid).code == 0
    ran = cli("acquire", file, plan, "--seed", "2", "-o", run, "--truth", truth, "--quick",
              "--effect", "mass=0.3")  # fmt: skip
    assert run.exists(), ran.stderr
    there = np.array([pose["position_m"] for pose in json.loads(truth.read_text())["poses"]])
    fixed = [axis for axis in range(3) if not np.any(may_move(robot)[:, axis])]
    assert not there[:, fixed].any()
    result = cdprcal.calibrate(robot, run).result
    assert result.status == cdprcal.CalibrationStatus.converged, result.reason
    assert np.linalg.norm(result.poses[0].position_m - there[0]) < 0.01
    found = json.loads(cli("diagnose", file, run, "--json").stdout)
    assert [effect["name"] for effect in found["effects"]] == ["mass"]


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
