"""Robots of six cables and more, end to end: poses are commanded, tensions chosen."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal.cli.generate import with_sensors
from cdprcal.sensors import OPTIONS
from cdprcal.studies import coverage, start_ups
from conftest import Cli, changed, few

#: What each kind of eight-cable robot has.
SENSORS = {
    "encoders": "lengths",
    "load cells": "lengths,tensions",
    "swivels": "lengths,swivels",
    "all": "lengths,swivels,tensions,attitude",
}


@pytest.fixture(scope="module")
def robot() -> cdprcal.Robot:
    return cdprcal.load_robot("posts8")


def test_workspace_is_where_the_orientation_is_wrench_feasible(robot: cdprcal.Robot) -> None:
    workspace = cdprcal.compute_workspace(robot, step_m=0.3)
    assert workspace.points_inside > 50
    rotation = cdprcal.held_orientation(robot)
    outside = 0
    for x in np.linspace(-1.2, 1.2, 5):
        for z in np.linspace(0.2, 2.0, 5):
            position = [x, 0.1, z]
            inside = _feasible(robot, cdprcal.Pose(position, rotation))
            found = cdprcal.inverse(robot, position)
            assert (found.status == cdprcal.EquilibriumStatus.found) == inside
            outside += not inside
    assert 0 < outside < 25


def _feasible(robot: cdprcal.Robot, pose: cdprcal.Pose) -> bool:
    """By linear programming: some tensions within the limits carry the weight."""
    from scipy.optimize import linprog

    state = cdprcal.platform_state(robot, pose)
    balance = cdprcal.structure_matrix(state)
    solved = linprog(
        np.zeros(robot.cable_count),
        A_eq=balance,
        b_eq=cdprcal.gravity_wrench(robot, state),
        bounds=[tuple(robot.tension_limits_N)] * robot.cable_count,
    )
    return bool(solved.status == 0)


def test_an_orientation_is_for_six_cables_and_more(cli: Cli) -> None:
    turned = cli("workspace", "posts8", "--step-m", "0.3", "--orientation", "0,0,-30", "--json")
    assert turned.code == 0, turned.stderr
    cli("plan", "irma4", "--orientation", "0,0,10").refused("do not hold one")


def test_plan_acquire_calibrate_diagnose(cli: Cli, tmp_path: Path) -> None:
    plan, log, truth = (tmp_path / name for name in ("plan.csv", "run.csv", "truth.json"))
    planned = cli("plan", "posts8", "-o", plan)
    assert planned.code == 0, planned.stderr
    ran = cli("acquire", "posts8", plan, "--seed", "3", "-o", log, "--truth", truth)
    assert ran.code == 0, ran.stderr
    calibrated = cli("calibrate", "posts8", log, "--json")
    found = calibrated.document()["initial_pose"]
    true = json.loads(truth.read_text())["poses"][0]
    error_m = np.subtract(found["position_m"], true["position_m"])
    assert np.linalg.norm(error_m) < 2e-3
    diagnosed = cli("diagnose", "posts8", log, "--json")
    assert json.loads(diagnosed.stdout)["verdict"] == "consistent"


def test_encoders_alone_find_the_initial_pose_to_a_tenth_of_a_millimetre(
    robot: cdprcal.Robot,
) -> None:
    setpoints, poses = cdprcal.default_stops(robot, 3, 3, 3)
    noise = cdprcal.reading_noise(robot.sigma, 0.01)  # 0.1 mm, as drives count
    options = cdprcal.SyntheticLogOptions(noise=noise, seed=5)
    made = cdprcal.synthetic_log(robot, setpoints, options, poses)
    log = with_sensors(made.log, {OPTIONS["lengths"]})
    result = cdprcal.calibrate(robot, log).result
    assert result.status == cdprcal.CalibrationStatus.converged, result.reason
    error = cdprcal.minus(result.poses[0], made.poses[0])
    assert np.linalg.norm(error[:3]) < 1e-4


@pytest.mark.parametrize("kind", few(SENSORS))
def test_intervals_hold(robot: cdprcal.Robot, kind: str) -> None:
    """The short version of ``python -m cdprcal.studies start-ups posts8 --sensors …``."""
    groups = {OPTIONS[name] for name in SENSORS[kind].split(",")}
    count = 40
    rows = start_ups(robot, range(1, 1 + count), sensors=groups, noise=0.2)
    assert all(row.status == "converged" for row in rows)
    # 95 % within four standard deviations of the share.
    assert abs(coverage(rows) - 0.95) < 4.0 * np.sqrt(0.95 * 0.05 / count)


def test_encoders_alone_claim_no_pose_where_a_valley_opens_beside_it(
    robot: cdprcal.Robot,
) -> None:
    """At 10 mm of noise: by the slope each of the first was 3 to 6 sigma off along a valley."""
    valleys = [209, 211, 149, 197, 22, 235]
    rows = start_ups(robot, [*valleys, *range(1, 13)], sensors={"length_m"})
    converged = [row for row in rows if row.status == "converged"]
    assert len(converged) >= 4
    for row in converged:
        off = np.abs(row.twist_error) / np.asarray(row.standard_deviation)
        assert off.max() < 4.0, row.seed
    for row in rows[: len(valleys)]:
        assert row.status == "unobservable" or row.mahalanobis < 13.0, row.seed


def test_a_plan_is_led_by_lengths_and_so_is_its_start_up(robot: cdprcal.Robot) -> None:
    result = cdprcal.make_plan(robot)
    assert result.status == cdprcal.PlanStatus.planned, result.reason
    plan = result.plan
    assert cdprcal.verify_plan(robot, plan) == ""
    from cdprcal.planning.start_up import start_up_plan

    visits = start_up_plan(plan)
    assert len(visits.pose) == len(visits.setpoint_N) == 1 + len(plan.poses)
    for stop in plan.poses:
        state = cdprcal.platform_state(robot, stop.pose)
        residual = cdprcal.wrench_residual(robot, state, stop.tension_N)
        assert np.abs(residual).max() < 1e-6
        low, high = robot.tension_limits_N
        assert low + robot.sigma.tension_N <= stop.tension_N.min()
        assert stop.tension_N.max() <= high - robot.sigma.tension_N


@pytest.mark.parametrize("seed", [2, 5])
def test_cells_that_are_empty_accuse_nobody(cli: Cli, tmp_path: Path, seed: int) -> None:
    """Rests seem to leave a direction open where lengths are no better than specified."""
    path = tmp_path / "run.csv"
    words = ("generate", "posts8", "--sensors", "lengths", "--grid", "3x3x3", "--seed", seed)
    assert cli(*words, "-o", path).code == 0
    log = cdprcal.read_log(str(path))
    length_m = np.array(log.length_m)
    length_m[np.random.default_rng(seed).random(length_m.shape) < 0.15] = np.nan
    found = cdprcal.diagnose("posts8", changed(log, length_m=length_m))
    assert (found.verdict, found.effects) == ("consistent", [])


@pytest.mark.parametrize("seed", [1, 3])
def test_lengths_alone_tell_the_pose_without_set_points(
    cli: Cli, tmp_path: Path, seed: int
) -> None:
    """The specified noise accepts many minima; about one of them the rests scatter far less."""
    path, truth_path = tmp_path / "run.csv", tmp_path / "truth.json"
    words = ("generate", "posts8", "--sensors", "lengths", "--grid", "3x3x3", "--seed", seed)
    assert cli(*words, "-o", path, "--truth", truth_path).code == 0
    log = cdprcal.read_log(str(path))
    lengths = cdprcal.Log(time_s=log.time_s, length_m=log.length_m, source="lengths")
    result = cdprcal.calibrate("posts8", lengths).result
    assert result.status == "converged", result.reason
    truth = json.loads(truth_path.read_text())["poses"][0]
    there = cdprcal.Pose(truth["position_m"], np.array(truth["rotation"]))
    error = np.abs(cdprcal.minus(result.poses[0], there))
    assert (error < 4.0 * result.standard_deviation).all()
    assert np.linalg.norm(error[:3]) < 0.01
