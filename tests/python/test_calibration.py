"""The calibration through Python: the recorded trial, generated data, odd inputs."""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal import CalibrateOptions, CalibrationStatus, Formulation, InputError, Method, Pose
from conftest import changed


@pytest.fixture(scope="module")
def trial_a(shared_data: Path) -> tuple[cdprcal.Log, dict[str, Any]]:
    folder = shared_data / "irma4"
    record = json.loads((folder / "trial_a.json").read_text())
    return cdprcal.read_log(str(folder / "trial_a.csv")), record


def recorded_options(record: dict[str, Any], **changes: Any) -> CalibrateOptions:
    guess = [Pose.from_euler(g[:3], g[3:]) for g in record["initial_guess"]]
    usual = {
        "method": Method.statics,
        "formulation": Formulation.paper,
        "at_s": record["times_s"],
        "guess": guess,
    }
    return CalibrateOptions(**(usual | changes))


def assert_recorded_minimum(result: cdprcal.CalibrationResult, record: dict[str, Any]) -> None:
    assert result.status == CalibrationStatus.converged
    assert result.cost == pytest.approx(record["cost_at_solution"], abs=1e-5)
    pose = result.poses[0]
    found = np.concatenate([pose.position_m, pose.euler_rad()])
    np.testing.assert_allclose(found, record["recorded_solution_initial_pose"], atol=1e-5, rtol=0)


def test_trial_a_from_the_recorded_guess(
    robot: cdprcal.Robot, trial_a: tuple[cdprcal.Log, dict[str, Any]]
) -> None:
    log, record = trial_a
    calibration = cdprcal.calibrate(robot, log, recorded_options(record))
    assert_recorded_minimum(calibration.result, record)
    assert calibration.static_poses == 8
    assert calibration.reference_time_s == record["times_s"][0]


@pytest.mark.parametrize("seed", range(5))
def test_trial_a_from_guesses_20_cm_and_10_degrees_off(
    robot: cdprcal.Robot, trial_a: tuple[cdprcal.Log, dict[str, Any]], seed: int
) -> None:
    log, record = trial_a
    random = np.random.default_rng(seed)
    guess = []
    for g in record["initial_guess"]:
        step, turn = random.normal(size=(2, 3))
        twist = np.concatenate(
            [0.2 * step / np.linalg.norm(step), np.radians(10) * turn / np.linalg.norm(turn)]
        )
        guess.append(cdprcal.plus(Pose.from_euler(g[:3], g[3:]), twist))
    calibration = cdprcal.calibrate(robot, log, recorded_options(record, guess=guess))
    assert_recorded_minimum(calibration.result, record)


def test_a_prepared_problem_can_be_solved_again(
    robot: cdprcal.Robot, trial_a: tuple[cdprcal.Log, dict[str, Any]]
) -> None:
    log, record = trial_a
    options = recorded_options(record)
    problem = cdprcal.prepare(robot, log, options).problem
    assert len(problem.measurements) == 8
    assert_recorded_minimum(cdprcal.solve(problem, options.guess), record)


@pytest.mark.parametrize("method", list(Method))
@pytest.mark.parametrize("formulation", list(Formulation))
def test_generated_data_are_recovered_within_their_own_covariance(
    robot: cdprcal.Robot,
    synthetic: cdprcal.SyntheticLog,
    method: Method,
    formulation: Formulation,
) -> None:
    options = CalibrateOptions(method=method, formulation=formulation)
    calibration = cdprcal.calibrate(robot, synthetic.log, options)
    result = calibration.result
    assert result.status == CalibrationStatus.converged, result.reason
    index = int(np.argmin(np.abs(synthetic.log.time_s - calibration.reference_time_s)))
    error = cdprcal.minus(result.poses[0], synthetic.poses[index])
    assert result.covariance is not None
    assert result.covariance.shape == (6, 6)
    np.testing.assert_allclose(result.covariance, result.covariance.T, rtol=1e-9, atol=1e-15)
    # The noise is a twentieth of sigma: the paper's formulation, which weighs by sigma, claims far
    # too little; the full one takes the noise from the readings and claims what it reaches.
    sigmas = 1.0 if formulation == Formulation.paper else 4.0
    assert np.all(np.abs(error) < sigmas * result.standard_deviation)
    assert np.linalg.norm(error[:3]) < 0.01


def test_fewer_poses_than_unknowns_are_unobservable(robot: cdprcal.Robot, log: cdprcal.Log) -> None:
    log = changed(log, swivel_rad=None, tension_N=None)
    options = CalibrateOptions(method=Method.kinematic, at_s=[1.0, 10.0])
    result = cdprcal.calibrate(robot, log, options).result
    assert result.status == CalibrationStatus.unobservable
    assert result.covariance is None
    assert np.isnan(result.standard_deviation).all()
    assert result.reason


def test_readings_that_contradict_the_model_do_not_converge(
    robot: cdprcal.Robot, log: cdprcal.Log
) -> None:
    log = changed(log, length_m=-log.length_m)
    result = cdprcal.calibrate(robot, log, CalibrateOptions(method=Method.statics)).result
    assert result.status != CalibrationStatus.converged
    assert result.reason


def test_wrong_use_is_an_input_error(robot: cdprcal.Robot, log: cdprcal.Log) -> None:
    with pytest.raises(InputError, match="no sample at"):
        cdprcal.calibrate(robot, log, CalibrateOptions(at_s=[1e6, 2e6]))
    with pytest.raises(InputError, match="segment"):
        cdprcal.calibrate(robot, log, CalibrateOptions(segment=7))
    problem = cdprcal.prepare(robot, log).problem
    with pytest.raises(InputError, match="guess"):
        cdprcal.solve(problem, [])


def test_what_a_result_hands_out_outlives_it(robot: cdprcal.Robot, log: cdprcal.Log) -> None:
    calibration = cdprcal.calibrate(robot, log)
    covariance = calibration.result.covariance
    pose = calibration.result.poses[0]
    expected = np.array(covariance), np.array(pose.position_m)
    del calibration
    ballast = [np.full(1000, np.nan) for _ in range(1000)]
    np.testing.assert_array_equal(covariance, expected[0])
    np.testing.assert_array_equal(pose.position_m, expected[1])
    assert len(ballast) == 1000


def test_options_are_not_views_of_what_is_gone() -> None:
    options = CalibrateOptions(guess=[Pose([1, 2, 3])], at_s=[1.0])
    guess = options.guess
    options.guess = []
    np.testing.assert_array_equal(guess[0].position_m, [1, 2, 3])
    assert options.guess == []
    options.solve.max_iterations = 3
    assert options.solve.max_iterations == 3


def test_other_threads_run_while_one_solves(robot: cdprcal.Robot, log: cdprcal.Log) -> None:
    """The interpreter lock is free during a solve: another thread counts meanwhile."""
    done = threading.Event()

    def solve() -> None:
        for _ in range(5):
            cdprcal.calibrate(robot, log)
        done.set()

    thread = threading.Thread(target=solve)
    thread.start()
    ticks = 0
    while not done.wait(1e-4):
        ticks += 1
    thread.join()
    assert ticks > 5
