"""``calibrate --motion``: the balance counts between the rests too."""

from __future__ import annotations

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from conftest import Cli, changed
from test_schemas import validate
from test_track import rows_of


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
    ran.refused("leave the other options out")


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


@pytest.fixture(scope="module")
def restless(robot: cdprcal.Robot) -> cdprcal.Log:
    """Three seconds of a run that waits for no rest, all of them in motion."""
    plan = cdprcal.StartUpPlan(setpoint_N=cdprcal.default_setpoints(robot, 2, 2, 1))
    startup = cdprcal.StartUpOptions(wait_for_rest=False)
    log = cdprcal.simulate_startup(robot, plan, seed=5, log_rate_Hz=20.0, startup=startup).log
    since_s = log.time_s - log.time_s[0]
    return rows_of(log, (since_s >= 10.0) & (since_s <= 13.0))


def test_a_track_starts_in_motion_where_that_is_asked_for(
    cli: Cli, robot: cdprcal.Robot, restless: cdprcal.Log, tmp_path: Path
) -> None:
    log, start, result, csv = (
        tmp_path / name for name in ("moving.csv", "start.json", "with.csv", "without.csv")
    )
    cdprcal.write_log(restless, str(log))
    refused = cli("track", "irma4", log)
    assert refused.code == 1
    assert "give --motion, as this one hardly rests, a log that calibrates" in refused.stderr
    assert cli("track", "irma4", log, "--motion", "-o", csv).code in (0, 3)
    # From a saved result it goes on as from its log.
    assert cli("calibrate", "irma4", log, "--motion", "-o", start).code in (0, 3)
    ran = cli("track", "irma4", log, "--start", start, "-o", result)
    assert ran.code in (0, 3), ran.stderr
    again, track = (np.genfromtxt(file, delimiter=",", names=True) for file in (result, csv))
    for name, sigma in (("x_m", "sigma_x_m"), ("z_m", "sigma_z_m")):
        assert (np.abs(again[name] - track[name]) < 0.1 * track[sigma]).all()

    with pytest.raises(cdprcal.InputError, match="give motion=True, as this one hardly rests"):
        cdprcal.track(robot, restless)
    found = cdprcal.track(robot, restless, motion=True)
    assert found.trusted.all()
    assert (np.abs(found.position_m[:, 0] - track["x_m"]) < 0.1 * track["sigma_x_m"]).all()


def test_a_platform_that_moves_in_a_plane_has_a_sigma_there_alone() -> None:
    belts = cdprcal.load_robot("belts4")
    plan = cdprcal.StartUpPlan(cdprcal.default_setpoints(belts, 2, 2, 1))
    run = cdprcal.simulate_startup(
        belts,
        plan,
        seed=5,
        log_rate_Hz=20.0,
        startup=cdprcal.StartUpOptions(wait_for_rest=False),
    )
    found = cdprcal.calibrate(belts, run.log, motion=True)
    assert found.kinematic_poses > 10
    sigma = found.result.standard_deviation
    assert np.count_nonzero(sigma) == 2
    assert (sigma[sigma > 0.0] < 0.01).all()
    error = cdprcal.minus(found.result.poses[0], run.truth[0].pose)
    assert (np.abs(error)[sigma > 0.0] < 4.0 * sigma[sigma > 0.0]).all()
    assert cdprcal.track(belts, run.log, motion=True).trusted.any()


def test_a_start_that_hardly_rests_is_told_so(cli: Cli, path: Path) -> None:
    words = "the start hardly rests: --motion also uses how it moves"
    assert words in cli("track", "irma4", path).stderr
    assert words not in cli("track", "irma4", path, "--motion").stderr


def test_motion_is_not_named_where_it_would_not_help(
    robot: cdprcal.Robot, restless: cdprcal.Log
) -> None:
    with pytest.raises(cdprcal.InputError, match=r"changed: no initial pose .*; give a log that"):
        cdprcal.track(robot, changed(restless, tension_N=None))


def test_a_saved_start_is_a_calibration_of_the_robot(
    cli: Cli, run: cdprcal.StartUpRun, path: Path, tmp_path: Path
) -> None:
    start, diagnosis, whole = (tmp_path / n for n in ("start.json", "diagnosis.json", "run.csv"))
    cdprcal.write_log(run.log, str(whole))
    cli("calibrate", "irma4", path, "-o", start)
    heavier = tmp_path / "heavier.yaml"
    text = cdprcal.to_yaml(cdprcal.load_robot("irma4"))
    heavier.write_text(text.replace("mass_kg: 12.992", "mass_kg: 13.5"))
    assert heavier.read_text() != text
    ran = cli("track", heavier, path, "--start", start)
    ran.refused("start.json: is of irma4 with another robot file")
    cli("diagnose", "irma4", whole, "-o", diagnosis)
    ran = cli("track", "irma4", path, "--start", diagnosis)
    ran.refused("diagnosis.json: is a diagnosis; give its log")
