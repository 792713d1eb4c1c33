"""``calibrate --motion``: the balance counts between the rests too."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from conftest import Ran
from test_schemas import validate
from test_track import rows_of

Cli = Callable[..., Ran]


@pytest.fixture(scope="module")
def run(robot: cdprcal.Robot) -> cdprcal.StartUpRun:
    plan = cdprcal.StartUpPlan(setpoint_N=cdprcal.default_setpoints(robot, 2, 2, 1))
    return cdprcal.simulate_startup(robot, plan, seed=5, log_rate_Hz=20.0)


@pytest.fixture(scope="module")
def log(run: cdprcal.StartUpRun) -> cdprcal.Log:
    """Its first 15 seconds."""
    return rows_of(run.log, run.log.time_s <= run.log.time_s[0] + 15.0)


@pytest.fixture
def path(log: cdprcal.Log, tmp_path: Path) -> Path:
    file = tmp_path / "short.csv"
    cdprcal.write_log(log, str(file))
    return file


def test_a_short_run_says_how_it_moved(
    cli: Cli, path: Path, run: cdprcal.StartUpRun, tmp_path: Path
) -> None:
    out = tmp_path / "result.json"
    ran = cli("calibrate", "irma4", str(path), "--motion", "--json", "-o", str(out))
    document = json.loads(ran.stdout)
    validate("calibrate", document)
    assert document["status"] == "converged"
    assert document["motion"]["moments"] > 10
    assert 0.5 < document["motion"]["damping_shift_1_s"] < 1.5  # the simulated one decays in 1 s
    kinds = [pose["kind"] for pose in document["poses"]]
    assert kinds.count("kinematic") == document["motion"]["moments"]
    assert "of motion too" in cli("calibrate", "irma4", str(path), "--motion").stdout
    error_m = np.array(document["initial_pose"]["position_m"]) - run.truth[0].pose.position_m
    assert np.linalg.norm(error_m) < 3e-3
    again = cli("repeat", str(out))
    assert again.code == 0, again.stderr
    assert "the same again" in again.stdout


def test_without_the_option_nothing_is_said_of_motion(cli: Cli, path: Path) -> None:
    document = json.loads(cli("calibrate", "irma4", str(path), "--json").stdout)
    assert "motion" not in document


def test_options_that_leave_motion_out_are_refused(cli: Cli, path: Path) -> None:
    ran = cli("calibrate", "irma4", str(path), "--motion", "--method", "static")
    assert ran.code == 2
    assert "leave the other options out" in ran.stderr


def test_python_takes_a_word_and_pickles(robot: cdprcal.Robot, log: cdprcal.Log) -> None:
    found = cdprcal.calibrate(robot, log, motion=True)
    core = cdprcal.calibrate_in_motion(robot, log)
    assert core.in_motion
    np.testing.assert_array_equal(
        found.result.poses[0].position_m, core.calibration.result.poses[0].position_m
    )
    again = pickle.loads(pickle.dumps(found))
    np.testing.assert_array_equal(again.result.covariance, found.result.covariance)
    assert f"{core.calibration.kinematic_poses} moments" in repr(core)
