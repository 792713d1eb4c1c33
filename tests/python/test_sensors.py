"""Sensor sets are open: any subset works or says why not, each sensor weighted by its own sigma.

Some of what tests/studies/sensor_subsets.py tries is here: any sensors, two to eight cables.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import sensor_subsets as study
from scipy.stats import chi2

import cdprcal
from cdprcal import CalibrateOptions, CalibrationStatus, InputError, Method
from cdprcal.cli.generate import with_sensors
from cdprcal.io import load_log, save_log
from cdprcal.sensors import OPTIONS
from cdprcal.studies.monte_carlo import start_up_options
from conftest import TABLE_II_TENSIONS_N, Cli, changed, few

ABSOLUTE = ("absolute_yaw_rad", "direct_length_m", "position_m")
#: Those that say something of a pose: how fast the platform turns is nothing at rest.
SENSORS = {name: field for name, field in OPTIONS.items() if name != "angular-velocity"}


def run_of(robot: cdprcal.Robot, seed: int = 6, noise: float = 0.2) -> cdprcal.SyntheticLog:
    options = start_up_options(robot, seed, noise, dwell_s=3.0, move_s=3.0)
    options.noise = cdprcal.reading_noise(robot.sigma, noise, absolute=True)
    if robot.cable_count == 4:
        set_points = [np.array(tension_N) for tension_N in TABLE_II_TENSIONS_N[:5]]
    else:
        set_points = cdprcal.default_setpoints(robot, 2, 2, 2)
    return cdprcal.synthetic_log(robot, set_points, options)


@pytest.fixture(scope="module")
def made(robot: cdprcal.Robot) -> cdprcal.SyntheticLog:
    return run_of(robot)


def test_any_subset_works_or_says_why(robot: cdprcal.Robot, made: cdprcal.SyntheticLog) -> None:
    unlikely = chi2.ppf(1.0 - 1e-6, 6)
    converged = set()
    for size in range(1, len(SENSORS) + 1):
        for chosen in itertools.combinations(SENSORS, size):
            log = with_sensors(made.log, {SENSORS[name] for name in chosen})
            refused = None
            try:
                result = cdprcal.calibrate(robot, log, CalibrateOptions(most_starts=3)).result
            except InputError as refusal:
                refused = str(refusal)
            if refused is not None:
                assert "to tell rest from motion by" in refused, chosen  # tensions alone
                continue
            assert result.reason, chosen
            if result.status != CalibrationStatus.converged:
                continue
            converged.add(frozenset(chosen))
            assert result.covariance is not None
            error = cdprcal.minus(result.poses[0], made.poses[0])
            assert error @ np.linalg.solve(result.covariance, error) < unlikely, chosen
    enough = [
        {"lengths", "swivels", "tensions", "attitude"},
        {"lengths", "tensions", "attitude"},
        {"swivels", "tensions", "attitude"},
        {"lengths", "swivels", "attitude"},
        {"attitude", "absolute-yaw", "position"},
        {"attitude", "absolute-yaw", "direct-lengths"},
        {"direct-lengths", "tensions", "attitude"},
        {"position", "tensions", "attitude"},
    ]
    for group in enough:
        assert frozenset(group) in converged, group
    for group in ({"attitude"}, {"absolute-yaw"}, {"position"}, {"direct-lengths"}, {"lengths"}):
        assert frozenset(group) not in converged, group


SUBSETS = [("irma4", 1.0), ("ring3", 0.2), ("irma4", 0.2), ("ring3", 1.0)]
SUBSETS += [("ring5", 0.2), ("ring5", 1.0)]


@pytest.mark.parametrize(("name", "noise"), few(SUBSETS))
def test_no_subset_of_any_robot_is_silently_wrong(name: str, noise: float) -> None:
    """Few sensors leave several minima; a pose is claimed only where no other fits as well."""
    robot = cdprcal.load_robot(name)
    made = run_of(robot, seed=3, noise=noise)
    converged = 0
    for size in range(1, len(SENSORS) + 1):
        for chosen in itertools.combinations(SENSORS, size):
            log = with_sensors(made.log, {SENSORS[sensor] for sensor in chosen})
            try:
                result = cdprcal.calibrate(robot, log).result
            except InputError:
                continue
            if result.status != CalibrationStatus.converged:
                assert result.covariance is None or result.reason
                continue
            converged += 1
            assert result.covariance is not None
            # By the sigma that are stated: along a curved valley the numbers are off together.
            error = cdprcal.minus(result.poses[0], made.poses[0])
            assert np.max(np.abs(error) / np.sqrt(np.diag(result.covariance))) < 5.0, chosen
    assert converged > 140


@pytest.mark.parametrize("name", ["irma4", "posts8"])
def test_all_sensors_together(name: str) -> None:
    """Forty readings a rest where eight cables have them all."""
    robot = cdprcal.load_robot(name)
    made = run_of(robot, seed=3)
    options = CalibrateOptions(allow_for_effects=False)
    result = cdprcal.calibrate(robot, with_sensors(made.log, set(OPTIONS.values())), options).result
    assert result.status == CalibrationStatus.converged
    error = cdprcal.minus(result.poses[0], made.poses[0])
    assert np.all(np.abs(error) < 5.0 * result.standard_deviation)


def test_diagnosis_accuses_nobody_where_few_sensors_say_little() -> None:
    for name in ("irma4", "ring3", "ring5"):
        robot = cdprcal.load_robot(name)
        made = run_of(robot, seed=4)
        for size in (2, 3, 4):
            for chosen in itertools.combinations(
                ("lengths", "swivels", "tensions", "attitude"), size
            ):
                log = with_sensors(made.log, {SENSORS[sensor] for sensor in chosen})
                try:
                    found = cdprcal.diagnose(robot, [log])
                except InputError:
                    continue
                assert not found.faults, (name, chosen)
                assert not found.effects, (name, chosen)


def test_a_sensor_more_is_never_worse(robot: cdprcal.Robot, made: cdprcal.SyntheticLog) -> None:
    plain = {"length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"}

    def claim(groups: set[str]) -> np.ndarray:
        options = CalibrateOptions(noise=cdprcal.NoiseSource.specified)
        result = cdprcal.calibrate(robot, with_sensors(made.log, groups), options).result
        assert result.status == CalibrationStatus.converged, result.reason
        return np.asarray(result.standard_deviation)

    before = claim(plain)
    for name in ABSOLUTE:
        assert np.all(claim(plain | {name}) <= 1.001 * before), name
    assert np.all(claim(plain | {"position_m"})[:3] <= 1.01 * robot.sigma.position_m)


def test_derivatives(robot: cdprcal.Robot, made: cdprcal.SyntheticLog) -> None:
    log = with_sensors(made.log, {*ABSOLUTE, "length_m", "roll_pitch_yaw_rad"})
    problem = cdprcal.prepare(robot, log, CalibrateOptions(method=Method.kinematic)).problem
    random = np.random.default_rng(1)
    rows = np.searchsorted(made.log.time_s, [m.time_s for m in problem.measurements])
    poses = [
        cdprcal.plus(made.poses[min(row, len(made.poses) - 1)], 0.02 * random.normal(size=6))
        for row in rows
    ]
    _, jacobian = cdprcal.linearise(problem, poses)
    step = 1e-6
    for pose in (0, 2, len(poses) - 1):
        for axis in range(6):
            twist = np.zeros(6)
            twist[axis] = step
            ends = []
            for sign in (1.0, -1.0):
                moved = list(poses)
                moved[pose] = cdprcal.plus(poses[pose], sign * twist)
                ends.append(cdprcal.linearise(problem, moved)[0])
            numeric = (ends[0] - ends[1]) / (2.0 * step)
            analytic = jacobian[:, 6 * pose + axis]
            scale = np.abs(jacobian).max()
            assert np.allclose(numeric, analytic, rtol=0.0, atol=1e-7 * scale)


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_logs_hold_them(made: cdprcal.SyntheticLog, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"run.{suffix}"
    gaps = made.log.position_m.copy()
    gaps[3, 1] = np.nan
    log = changed(made.log, position_m=gaps)
    save_log(log, str(path))
    back = load_log(str(path)).log
    for name in (*ABSOLUTE, "length_m", "roll_pitch_yaw_rad", "tension_setpoint_N"):
        np.testing.assert_array_equal(getattr(back, name), getattr(log, name), err_msg=name)
    # Some columns of a group are enough; the others are absent.
    text = "time_s,length_1_m,length_2_m,position_z_m\n0,1,2,0.5\n1,1,2,0.5\n"
    partial = cdprcal.parse_log(text, "x")
    assert partial.position_m.shape == (2, 3)
    assert np.isnan(partial.position_m[:, :2]).all()
    assert partial.absolute_yaw_rad.shape == (2, 0)


def test_wrong_columns_and_shapes(made: cdprcal.SyntheticLog) -> None:
    with pytest.raises(InputError, match=r"direct_length_9_m.*numbered 1 to 8"):
        cdprcal.parse_log("time_s,direct_length_9_m\n0,1\n", "x")
    with pytest.raises(InputError, match="direct_length_2_m: is missing"):
        cdprcal.parse_log("time_s,length_1_m,length_2_m,direct_length_1_m\n0,1,1,1\n", "x")
    with pytest.raises(InputError, match="position_m: has shape"):
        changed(made.log, position_m=np.zeros((len(made.log), 2)))


def test_robot_files_state_their_sigma(robot: cdprcal.Robot) -> None:
    text = cdprcal.to_yaml(robot).replace(
        "tension_N: 10", "tension_N: 10, absolute_yaw_deg: 0.5, direct_length_m: 0.004", 1
    )
    other = cdprcal.parse_robot(text, "x")
    assert other.sigma.absolute_yaw_rad == pytest.approx(np.radians(0.5))
    assert other.sigma.direct_length_m == 0.004
    assert other.sigma.position_m == robot.sigma.position_m
    assert cdprcal.to_yaml(cdprcal.parse_robot(cdprcal.to_yaml(other), "y")) == cdprcal.to_yaml(
        other
    )
    with pytest.raises(InputError, match="position_m"):
        cdprcal.parse_robot(text.replace("direct_length_m: 0.004", "position_m: 0"), "x")


def test_a_wrong_tracker_is_contradicted(robot: cdprcal.Robot, made: cdprcal.SyntheticLog) -> None:
    off = made.log.position_m + np.array([0.05, 0.0, 0.0])
    result = cdprcal.calibrate(robot, changed(made.log, position_m=off)).result
    trusted = result.status == CalibrationStatus.converged
    assert not trusted or "lacks something" in result.reason
    assert "position" in result.reason or "length" in result.reason


def test_by_command(cli: Cli, tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    ran = cli("generate", "irma4", "-o", log, "--sensors", "lengths,attitude,position,absolute-yaw")
    assert ran.code == 0, ran.stderr
    header = log.read_text().splitlines()[0]
    assert "position_x_m" in header
    assert "swivel_1_rad" not in header
    document = cli("calibrate", "irma4", log, "--json", "--method", "kinematic").document()
    assert document["residual_rms"]["position_m"] < 2e-3
    assert "direct_length_m" not in document["residual_rms"]
    assert "position" in document["noise"]
    ran = cli("generate", "irma4", "-o", tmp_path / "no.csv", "--sensors", "lengths,sonar")
    ran.refused("sonar")
    assert not (tmp_path / "no.csv").exists()


@pytest.mark.parametrize("cables", range(2, 9))
def test_the_default_solves_what_any_method_solves(cables: int) -> None:
    subsets = study.subsets()
    chosen = np.random.default_rng(cables).choice(len(subsets), size=6, replace=False)
    found = [study.outcome((cables, subsets[k], 1)) for k in chosen]
    assert not [one.in_words() for one in found if one.is_missed or "unified" in one.wrong]


@pytest.mark.parametrize("cables", [3, 4])
def test_encoders_at_rest_are_enough_below_six_cables(cables: int) -> None:
    found = study.outcome((cables, ("length", "swivel"), 2))
    assert found.sigma_m["unified"] is not None, found.reasons["unified"]
    assert not found.wrong


def test_a_rest_that_hangs_deep_does_not_make_the_balance_doubtful() -> None:
    """Its cables are parallel: one of its rows hardly depends on the load cells."""
    found = study.outcome((5, ("tension", "roll_pitch_yaw", "absolute_yaw", "position"), 1))
    assert not found.is_worse, found.in_words()
    assert "misfits" not in found.reasons["unified"]


def test_a_minimum_that_fits_badly_is_not_the_last_that_is_looked_at() -> None:
    """Residuals of four times the noise pass for a minimum, but another fits ten times better."""
    found = study.outcome((5, ("swivel", "tension", "direct_length"), 1))
    assert found.sigma_m["unified"] is not None, found.reasons["unified"]
    assert not found.wrong, found.in_words()
