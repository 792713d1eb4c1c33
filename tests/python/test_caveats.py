"""A pose that converged, and what restricts it: fields, exit codes, and how often for nothing."""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import edits
import numpy as np
import pytest
from scipy.stats import binom

import cdprcal
from cdprcal.io import save_log
from cdprcal.studies.variants import vary
from cdprcal.trust import BY_EYE, CLAIM, FALSE_ALARMS, _unbalanced, caveats_of, worst_sigma
from conftest import Cli
from conftest import changed as edited


def synthetic(robot: cdprcal.Robot, seed: int, noise: float = 0.1) -> cdprcal.SyntheticLog:
    options = cdprcal.SyntheticLogOptions(
        noise=cdprcal.reading_noise(robot.sigma, noise), seed=seed, dwell_s=4.0, move_s=2.0
    )
    return cdprcal.synthetic_log(robot, cdprcal.default_setpoints(robot, 2, 2, 2), options)


@pytest.mark.parametrize(
    ("group", "name"), [("length_m", "length_2_m"), ("tension_N", "tension_2_N")]
)
def test_marks_of_missing_readings_are_no_unit_and_no_slack_cable(
    cli: Cli, robot: cdprcal.Robot, tmp_path: Path, group: str, name: str
) -> None:
    """A block at a column's end: check, calibrate and diagnose say the same of it."""
    log, path = synthetic(robot, 1).log, tmp_path / "run.csv"
    values = np.array(getattr(log, group))
    values[-40:, 1] = -999.0
    save_log(edited(log, **{group: values}), path)
    for command in ("check", "calibrate", "diagnose"):
        ran = cli(command, "irma4", path)
        said = " ".join((ran.stdout + ran.stderr).split())
        assert f"error: {name} holds -999 (40 times), far from all that is read beside" in said
        assert "leave these cells empty" in said
        if command != "diagnose":
            assert ran.code == 1
            assert "the readings look as if" not in said
            assert "error: cable 2 is slack" not in said


def made(robot: cdprcal.Robot, seed: int = 1, noise: float = 0.1, **changed: Any) -> cdprcal.Log:
    log = synthetic(robot, seed, noise).log
    groups = ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
    return cdprcal.Log(
        time_s=log.time_s, source="made", **{g: getattr(log, g) for g in groups} | changed
    )


def calibrated(cli: Cli, folder: Path, robot: cdprcal.Robot, log: cdprcal.Log) -> tuple[int, Any]:
    """Exit code and document of the command."""
    file, run = folder / "robot.yaml", folder / "run.csv"
    file.write_text(cdprcal.to_yaml(robot), encoding="utf-8")
    save_log(log, str(run))
    ran = cli("calibrate", file, run, "--json")
    return ran.code, json.loads(ran.stdout)


def test_a_sound_log_has_no_caveat(cli: Cli, tmp_path: Path, robot: cdprcal.Robot) -> None:
    log = made(robot)
    code, document = calibrated(cli, tmp_path, robot, log)
    assert (code, document["caveats"]) == (0, [])
    found = cdprcal.calibrate(robot, log)
    assert found.caveats == ()
    assert found.result.reason == CLAIM


def test_sound_logs_get_one_no_more_often_than_said(robot: cdprcal.Robot) -> None:
    count = 60
    alarms = sum(bool(cdprcal.calibrate(robot, made(robot, seed)).caveats) for seed in range(count))
    assert alarms <= binom.ppf(1.0 - 1e-4, count, FALSE_ALARMS)


@pytest.mark.parametrize(
    "changes",
    [
        {"platform.mass_kg": 12.6},
        {"platform.centre_of_mass_m.x": 0.01},
        {"cables.2.pulley.position_m.z": 1.859},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_a_wrong_robot_file_is_told_by_field_and_exit_code(
    cli: Cli, tmp_path: Path, robot: cdprcal.Robot, changes: dict[str, float]
) -> None:
    wrong, log = vary(robot, changes), made(robot)
    code, document = calibrated(cli, tmp_path, wrong, log)
    assert code == 3
    assert document["status"] == "converged"
    assert "misfit" in [caveat["code"] for caveat in document["caveats"]]
    assert {caveat["severity"] for caveat in document["caveats"]} == {"warning"}
    found = cdprcal.calibrate(wrong, log)
    assert [c.as_dict() for c in found.caveats] == document["caveats"]


def test_what_the_core_adds_to_its_claim_is_a_caveat(robot: cdprcal.Robot) -> None:
    found = cdprcal.calibrate(vary(robot, {"platform.mass_kg": 11.0}), made(robot))
    assert "; yet the model misfits" in found.result.reason
    reservation = next(c for c in found.caveats if c.code == "reservation")
    assert reservation.message.startswith("the model misfits")


def test_a_pose_that_no_reading_is_left_to_contradict_is_not_certain(robot: cdprcal.Robot) -> None:
    # Six equations of a rest's balance, six unknowns of its pose: a robot that is 5 % heavier
    # hangs elsewhere, and the tensions fit.
    heavy = vary(robot, {"platform.mass_kg": 1.05 * robot.platform.mass_kg})
    log = made(robot)
    rests = np.searchsorted(log.time_s, np.arange(2.0, log.time_s[-1], 6.0))
    alone = cdprcal.Log(
        time_s=10.0 * np.arange(len(rests)), source="made", tension_N=log.tension_N[rests]
    )
    found = cdprcal.calibrate(heavy, alone)
    assert found.result.status == cdprcal.CalibrationStatus.converged
    assert found.result.residual_count == found.result.parameter_count
    assert ("unchecked", "warning") in [(c.code, c.severity) for c in caveats_of(found)]
    assert "unchecked" in [c.code for c in found.caveats]


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_rests_at_which_something_pulled_are_said(robot: cdprcal.Robot, count: int) -> None:
    setpoints = cdprcal.default_setpoints(robot, 3, 3, 2)
    options = cdprcal.SyntheticLogOptions(
        noise=cdprcal.reading_noise(robot.sigma, 0.1), seed=5, dwell_s=4.0, move_s=2.0
    )
    log = cdprcal.synthetic_log(robot, setpoints, options).log
    tension_N = np.array(log.tension_N)
    for rest in (5, 9, 13)[:count]:  # somebody leans on it
        there = (log.time_s > 6.0 * rest - 1.0) & (log.time_s < 6.0 * rest + 5.0)
        tension_N[there] += 40.0
    pulled = cdprcal.Log(
        time_s=log.time_s, source="made", length_m=log.length_m, swivel_rad=log.swivel_rad,
        tension_N=tension_N, roll_pitch_yaw_rad=log.roll_pitch_yaw_rad,
    )  # fmt: skip
    found = cdprcal.calibrate(robot, pulled)
    assert found.result.status == cdprcal.CalibrationStatus.converged
    said = [c.message for c in found.caveats if c.code == "unbalanced"]
    assert len(said) == (count > 1)
    assert all(message.startswith(f"{count} rests are out of balance") for message in said)


@pytest.mark.parametrize("group", ["length_m", "swivel_rad", "tension_N"])
def test_one_column_that_is_noisier_than_the_others_misfits_nothing(
    robot: cdprcal.Robot, group: str
) -> None:
    log = made(robot, seed=5)
    values = getattr(log, group).copy()
    ripple = np.median([cdprcal.channel_noise(column) for column in values.T])
    values[:, 1] += np.random.default_rng(1).normal(0.0, 8.0 * ripple, len(values))
    found = cdprcal.calibrate(robot, edited(log, **{group: values}))
    assert found.result.status == "converged"
    assert "misfit" not in [caveat.code for caveat in found.caveats]


def test_of_moments_in_motion_none_is_called_a_rest_at_which_something_pulled(
    robot: cdprcal.Robot,
) -> None:
    found = cdprcal.calibrate(robot, made(robot))
    between_s = [0.5 * (a.end_s + b.begin_s) for a, b in itertools.pairwise(found.equilibria)]
    out = [SimpleNamespace(time_s=t, channel="balance", reason="outlier") for t in between_s]
    seen = SimpleNamespace(equilibria=found.equilibria, gated=out)
    assert not list(_unbalanced(cast("cdprcal.Calibration", seen)))
    for reading, rest in zip(out, found.equilibria, strict=False):
        reading.time_s = rest.begin_s
    (caveat,) = _unbalanced(cast("cdprcal.Calibration", seen))
    assert caveat.message.startswith(f"{len(out)} rests are out of balance")


@pytest.mark.parametrize(("noise", "is_said"), [(0.1, False), (3.0, True)])
def test_a_pose_no_better_than_the_eye_is_called_so(
    robot: cdprcal.Robot, noise: float, is_said: bool
) -> None:
    log = made(robot, noise=noise)
    weak = cdprcal.Log(time_s=log.time_s, source="made", tension_N=log.tension_N,
                       roll_pitch_yaw_rad=log.roll_pitch_yaw_rad)  # fmt: skip
    found = cdprcal.calibrate(robot, weak)
    assert found.result.status == cdprcal.CalibrationStatus.converged
    position_m, _ = worst_sigma(found.result.covariance) or (0.0, 0.0)
    assert (position_m > BY_EYE * cdprcal.robot_size_m(robot)) == is_said
    said = [c.message for c in found.caveats if c.code == "imprecise"]
    assert len(said) == is_said
    assert all(re.match(r"the pose is known to ± [1-9]\d mm and ± ", message) for message in said)


def with_pulleys_known_to(robot: cdprcal.Robot, sigma_m: float) -> cdprcal.Robot:
    text = cdprcal.to_yaml(robot)
    return cdprcal.parse_robot(
        text.replace("position_m: ", f"position_sigma_m: {sigma_m}, position_m: "), "told"
    )


@pytest.mark.parametrize("sigma_m", [0.01, 0.03])
def test_sigma_of_a_pose_allows_for_pulleys_that_are_known_so_well(
    robot: cdprcal.Robot, sigma_m: float
) -> None:
    """In the frame that the file describes, whose pulleys are elsewhere by what it says."""
    rng = np.random.default_rng(7)
    known = with_pulleys_known_to(robot, sigma_m)
    off: list[Any] = []
    taken_for_exact: list[Any] = []
    for seed in range(6):
        moves = rng.normal(0.0, sigma_m, (4, 3))
        there = {
            f"cables.{i + 1}.pulley.position_m.{axis}": float(
                robot.cables[i].pulley.position_m[k] + moves[i, k]
            )
            for i in range(4)
            for k, axis in enumerate("xyz")
        }
        run = synthetic(vary(robot, there), seed)
        for which, errors in ((known, off), (robot, taken_for_exact)):
            result = cdprcal.calibrate(which, run.log).result
            assert result.covariance is not None
            error = cdprcal.minus(result.poses[0], run.poses[0])
            errors.append(error / np.sqrt(np.diag(result.covariance)))
    assert np.max(np.abs(off)) < 4.0
    assert np.sqrt(np.mean(np.square(off))) < 1.5
    assert np.max(np.abs(taken_for_exact)) > np.max(np.abs(off))


def test_a_pose_that_is_as_little_known_as_the_pulleys_says_which(robot: cdprcal.Robot) -> None:
    log = made(robot)
    (said,) = (
        c for c in cdprcal.calibrate(with_pulleys_known_to(robot, 0.2), log).caveats
        if c.code == "imprecise"
    )  # fmt: skip
    assert said.remedy.startswith("pulley 1 is known to ± 200 mm (position_sigma_m): measure it")
    exactly = cdprcal.calibrate(with_pulleys_known_to(robot, 1e-5), log)
    assert not exactly.caveats


def test_a_large_misfit_is_said_as_people_write_numbers(robot: cdprcal.Robot) -> None:
    wrong = vary(robot, {"cables.2.pulley.position_m.z": 1.7})
    (said,) = (
        c.message
        for c in cdprcal.calibrate(wrong, made(robot, noise=0.01)).caveats
        if c.code == "misfit"
    )
    assert re.fullmatch(
        r"the model misses the readings by [1-9]\d0 times \(rms\) what these scatter at rest: .*"
        r"\(without either no more than one of 100 logs gets this warning\)",
        said,
    )


def test_people_are_told(cli: Cli, tmp_path: Path, robot: cdprcal.Robot) -> None:
    calibrated(cli, tmp_path, vary(robot, {"platform.mass_kg": 12.6}), made(robot))
    ran = cli("calibrate", tmp_path / "robot.yaml", tmp_path / "run.csv")
    assert ran.code == 3
    assert "the model misses the readings by" in " ".join(ran.stderr.split())
    assert "next: cdprcal check" in ran.stdout


def test_what_check_does_not_trust_is_not_trusted(
    cli: Cli, tmp_path: Path, robot: cdprcal.Robot
) -> None:
    log = made(robot)
    stuck = np.array(log.swivel_rad)
    stuck[:, 1] = stuck[0, 1]
    # With weights of 50°, the fit itself has nothing against it.
    blind = vary(robot, {"sensors.sigma.swivel_deg": 50.0})
    code, document = calibrated(cli, tmp_path, blind, made(robot, swivel_rad=stuck))
    assert code == 1
    if document["status"] == "converged":
        assert ("stuck_sensor", "error") in [
            (caveat["code"], caveat["severity"]) for caveat in document["caveats"]
        ]


@pytest.mark.parametrize(
    ("group", "factor", "words"),
    [
        ("length_m", 1e3, "the lengths are in millimetres"),
        ("swivel_rad", 180.0 / np.pi, "the swivel angles are in degrees"),
        ("tension_N", 1.0 / 9.80665, "the tensions are in kgf"),
        ("swivel_rad", [1.0, -1.0, 1.0, 1.0], "the swivel of cable 2 counts backwards"),
    ],
)
def test_where_there_is_no_pose_units_and_signs_are_named(
    robot: cdprcal.Robot, group: str, factor: Any, words: str
) -> None:
    log = made(robot)
    misread = np.array(getattr(log, group)) * factor
    found = cdprcal.calibrate(robot, made(robot, **{group: misread}))
    assert found.result.status != cdprcal.CalibrationStatus.converged
    said = f"the readings look as if {words}"
    assert [(c.code, c.severity, c.message) for c in found.caveats] == [("misread", "error", said)]


@pytest.mark.parametrize(
    "values",
    [
        {"time_s": lambda log: log.time_s / 60.0},
        {"length_m": lambda log: np.zeros_like(log.length_m)},
        {"swivel_rad": lambda log: np.zeros_like(log.swivel_rad)},
        {"tension_N": lambda log: np.zeros_like(log.tension_N)},
        {"tension_N": lambda log: -log.tension_N},
    ],
    ids=["never rests", "no lengths", "no swivels", "no tensions", "no pull"],
)
def test_no_units_and_signs_are_tried_where_they_cannot_help(
    robot: cdprcal.Robot, monkeypatch: pytest.MonkeyPatch, values: dict[str, Any]
) -> None:
    """Trying them all took most of a minute, and Ctrl-C was not heard."""

    def tried(*_: Any) -> None:
        raise AssertionError

    monkeypatch.setattr(cdprcal._core, "diagnose", tried)
    log = made(robot)
    wrong = edited(log, **{name: change(log) for name, change in values.items()})
    assert cdprcal.calibrate(robot, wrong).result.status != cdprcal.CalibrationStatus.converged


def test_one_that_nothing_sets_right_has_a_reason_and_no_caveat(robot: cdprcal.Robot) -> None:
    log = made(robot)
    drawn = np.random.default_rng(3).normal(size=np.shape(log.length_m))
    found = cdprcal.calibrate(robot, made(robot, length_m=np.array(log.length_m) + drawn))
    assert found.result.status != cdprcal.CalibrationStatus.converged
    assert found.caveats == ()


def test_a_noise_that_was_specified_is_held_to(robot: cdprcal.Robot) -> None:
    wrong = vary(robot, {"platform.mass_kg": 9.0, "sensors.sigma.tension_N": 1.0})
    found = cdprcal.calibrate(wrong, made(robot), noise="specified")
    if found.result.status == cdprcal.CalibrationStatus.converged:
        assert found.result.chi_square_p_value < FALSE_ALARMS
        assert [c.code for c in found.caveats] == ["misfit"]


def test_edits_are_seen_far_oftener_than_not() -> None:
    """The study itself, in small: its counts are in docs/records."""
    outcomes = [edits.run(number, seed=2) for number in range(40)]
    silent = [o for o in outcomes if o.kinds and o.code == 0 and o.wrong]
    assert len(silent) <= 3
    assert all(o.code in (0, 3) for o in outcomes if not o.kinds)
    assert {o.code for o in outcomes if o.kinds} >= {1, 3}


@pytest.fixture
def paused(tmp_path: Path, robot: cdprcal.Robot) -> Path:
    """A log that lacks 2.4 s, so that the run begins behind them."""
    log = made(robot)
    kept = (log.time_s < 17.0) | (log.time_s > 19.4)
    groups = ("time_s", "length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
    save_log(cdprcal.Log(**{g: getattr(log, g)[kept] for g in groups}, source=""), tmp_path / "p")
    return tmp_path / "p"


def test_a_pause_that_decides_which_pose_is_initial_is_told(
    cli: Cli, tmp_path: Path, paused: Path
) -> None:
    checked = json.loads(cli("check", "irma4", paused, "--json").stdout)["findings"]
    gap = next(finding for finding in checked if finding["code"] == "gap")
    told = gap["message"]
    for command in ("calibrate", "track", "diagnose"):
        ran = cli(command, "irma4", paused)
        assert (ran.code, told in " ".join(ran.stderr.split())) == (0, True), command
        document = json.loads(cli(command, "irma4", paused, "--json").stdout)
        assert document["caveats"] == [gap], command
    page = tmp_path / "page.html"
    ran = cli("report", "irma4", paused, "-o", page)
    assert ran.code == 0
    assert told in " ".join(ran.stderr.split())
    assert told in page.read_text(encoding="utf-8")


def test_who_chose_a_segment_is_told_nothing(cli: Cli, paused: Path) -> None:
    ran = cli("calibrate", "irma4", paused, "--segment", "1", "--json")
    assert (ran.code, json.loads(ran.stdout)["caveats"]) == (0, [])


def test_of_several_logs_the_one_with_a_pause_is_named(
    cli: Cli, paused: Path, log_path: Path
) -> None:
    ran = cli("diagnose", "irma4", log_path, paused, "--json")
    assert [c["message"].startswith(f"{paused}: ") for c in json.loads(ran.stdout)["caveats"]] == [
        True
    ]


def test_a_gentle_swing_that_balances_is_no_single_pose() -> None:
    """A swing of a centimetre moves no reading by several of the robot file's sigma."""
    robot = cdprcal.load_robot("irma4")
    simulator = cdprcal.Simulator(robot, cdprcal.SimulatorOptions(seed=1))
    assert simulator.reset(np.array([90.0, 80.0, 85.0, 95.0])).found
    samples, truth = [], []
    for k in range(2000):
        if k == 200:
            simulator.push(np.array([0.1, -0.15, 0.0]), np.array([0.15, 0.2, 0.4]))
        samples.append(simulator.read())
        truth.append(simulator.truth().pose)
        assert simulator.advance(0.01)
    log = cdprcal.Log(
        time_s=np.array([s.time_s for s in samples]),
        length_m=np.array([s.length_m for s in samples]),
        swivel_rad=np.array([s.swivel_rad for s in samples]),
        tension_N=np.array([s.tension_N for s in samples]),
        roll_pitch_yaw_rad=np.array([s.roll_pitch_yaw_rad for s in samples]),
    )
    found = cdprcal.calibrate(robot, log, motion=True)
    assert "too_few_poses" not in {caveat.code for caveat in found.caveats}
    assert np.linalg.norm(found.result.poses[0].position_m - truth[0].position_m) < 2e-3
    at_rest = cdprcal.calibrate(robot, log)
    codes = {caveat.code for caveat in at_rest.caveats}
    assert at_rest.result.status != cdprcal.CalibrationStatus.converged or "too_few_poses" in codes
