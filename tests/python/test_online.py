"""The estimate while the robot is measured, when to stop, and where to go next."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import stopping

import cdprcal
from cdprcal import CalibrateOptions, CalibrationStatus, InputError, Log, Method, Robot
from cdprcal.acquisition import (
    Acquired,
    Estimate,
    Guide,
    acquire,
    parse_accuracy,
    start_up_plan,
)
from cdprcal.acquisition.monitor import Monitor
from cdprcal.hardware.simulated import SimulatedBackend
from cdprcal.io import load_log
from cdprcal.studies import Workers
from cdprcal.studies.monte_carlo import start_up_options
from conftest import TABLE_II_TENSIONS_N, Cli, changed

PERIOD_S = 8.0  # of one rest and one move


@pytest.fixture(scope="module")
def made(robot: Robot) -> cdprcal.SyntheticLog:
    options = start_up_options(robot, 4, 0.2, dwell_s=4.0, move_s=4.0)
    return cdprcal.synthetic_log(robot, [np.array(t) for t in TABLE_II_TENSIONS_N], options)


@pytest.fixture(scope="module")
def plan() -> cdprcal.Plan:
    return stopping.planned("irma4")


@pytest.fixture(scope="module")
def default_plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plan") / "plan.csv"
    path.write_text(cdprcal.format_plan(cdprcal.make_plan(cdprcal.load_robot("irma4")).plan))
    return path


def rows(log: Log, begin: int, end: int) -> Log:
    names = ("length_m", "swivel_rad", "tension_N", "tension_setpoint_N", "roll_pitch_yaw_rad")
    arrays = {name: getattr(log, name)[begin:end] for name in names if getattr(log, name).size}
    return Log(time_s=log.time_s[begin:end], **arrays)


def stretches(log: Log) -> list[Log]:
    """Cut at the end of each rest."""
    ends = [int(np.searchsorted(log.time_s, PERIOD_S * i + 4.0 - 1e-6)) for i in range(8)]
    return [rows(log, begin, end) for begin, end in zip([0, *ends[:-1]], ends, strict=True)]


@pytest.mark.parametrize("method", [Method.unified, Method.statics, Method.kinematic])
def test_piece_by_piece_is_as_good_as_at_once(
    robot: Robot, made: cdprcal.SyntheticLog, method: Method
) -> None:
    options = CalibrateOptions(method=method)
    online = cdprcal.OnlineCalibration(robot, options)
    claims = []
    for stretch in stretches(made.log):
        result = online.add(stretch)
        if result.covariance is not None:
            claims.append(result.standard_deviation)
            error = cdprcal.minus(result.poses[0], made.poses[0])
            assert np.all(np.abs(error) < 4.5 * result.standard_deviation)
    assert result.status == CalibrationStatus.converged
    assert np.all(claims[-1] < claims[0])  # more rests, less doubt
    whole = cdprcal.calibrate(robot, made.log, options).result
    apart = cdprcal.minus(result.poses[0], whole.poses[0])
    assert np.all(np.abs(apart) < whole.standard_deviation)  # other samples in motion
    ratio = result.standard_deviation / whole.standard_deviation
    assert np.all((ratio > 0.7) & (ratio < 1.4))


def test_too_little_is_said(robot: Robot, made: cdprcal.SyntheticLog) -> None:
    online = cdprcal.OnlineCalibration(robot, CalibrateOptions(method=Method.kinematic))
    result = online.add(rows(made.log, 0, 39))  # rest alone
    assert result.status == CalibrationStatus.unobservable
    assert result.reason
    assert online.calibration.kinematic_poses + online.calibration.static_poses == len(
        online.calibration.problem.measurements
    )


def test_what_cannot_be_added(robot: Robot, made: cdprcal.SyntheticLog) -> None:
    online = cdprcal.OnlineCalibration(robot)
    first, second = stretches(made.log)[:2]
    online.add(first)
    with pytest.raises(InputError, match="begin before the last ones end"):
        online.add(first)
    online.add(second)  # nothing was spoilt
    with pytest.raises(InputError, match="belong to finished logs"):
        cdprcal.OnlineCalibration(robot, CalibrateOptions(at_s=[0.0, 1.0]))
    with pytest.raises(InputError, match="cables"):
        cdprcal.OnlineCalibration(cdprcal.load_robot("ring3")).add(first)


def test_an_update_is_quick(robot: Robot) -> None:
    """Among 128 rests, beside a calibration of all of them in the same minute."""
    import time

    setpoints = cdprcal.default_setpoints(robot, 4, 4, 8)
    log = cdprcal.synthetic_log(
        robot,
        setpoints,
        cdprcal.SyntheticLogOptions(
            dwell_s=2.0, move_s=2.0, noise=cdprcal.reading_noise(robot.sigma, 0.2), seed=1
        ),
    ).log
    ends = [int(np.searchsorted(log.time_s, 4.0 * i + 2.0 - 1e-6)) for i in range(128)]
    options = CalibrateOptions(method=Method.statics)
    online = cdprcal.OnlineCalibration(robot, options)
    times = []
    for begin, end in zip([0, *ends[:-1]], ends, strict=True):
        stretch = rows(log, begin, end)
        began = time.perf_counter()
        result = online.add(stretch)
        times.append(time.perf_counter() - began)
    assert result.status == CalibrationStatus.converged
    assert online.calibration.static_poses >= 128
    anew = []
    for _ in range(3):
        began = time.perf_counter()
        cdprcal.calibrate(robot, log, options)
        anew.append(time.perf_counter() - began)
    update_s = np.median(times[-16:])  # these only start from the last solution
    print(f"an update {1e3 * update_s:.1f} ms, all anew {1e3 * np.median(anew):.1f} ms")
    assert update_s < np.median(anew) / 3.0


def test_the_next_stop_teaches_most_per_second(robot: Robot, plan: cdprcal.Plan) -> None:
    chooser = cdprcal.NextStopChooser(robot, plan)
    asked = parse_accuracy("5mm,0.5deg")
    start = plan.start_pose
    reading_N = plan.start_tension_N
    measured: list[int] = []
    traces = []
    for _ in range(6):
        choice = chooser.choose(measured, start, reading_N, asked)
        assert choice is not None
        assert choice.stop not in measured
        assert choice.time_s > 0.0
        assert choice.way.via == [True] * (len(choice.way.via) - 1) + [False]
        np.testing.assert_array_equal(choice.way.setpoint_N[-1], plan.poses[choice.stop].tension_N)
        deviation = choice.predicted_deviation
        traces.append(float(np.sum(deviation[:3] ** 2) / 5e-3**2 + np.sum(deviation[3:] ** 2)))
        measured.append(choice.stop)
    assert np.all(np.diff(traces) < 0.0)
    everything = [i for i, stop in enumerate(plan.poses) if stop.measured]
    assert chooser.choose(everything, start, reading_N, asked) is None
    with pytest.raises(InputError, match="none that is measured"):
        chooser.choose([len(plan.poses)], start, reading_N, asked)


def test_accuracy_as_text() -> None:
    asked = parse_accuracy("5mm,0.5deg")
    assert asked.position_m == pytest.approx(5e-3)
    assert asked.rotation_rad == pytest.approx(math.radians(0.5))
    assert parse_accuracy(" 0.01 rad, 0.002m").rotation_rad == pytest.approx(0.01)
    assert asked.reached(np.diag([4.9e-3, 1e-3, 1e-3, 8e-3, 1e-4, 1e-4]) ** 2)
    # The worst axis counts, whichever way it points.
    oblique = np.zeros((6, 6))
    oblique[0, 1] = oblique[1, 0] = 0.9 * (4.9e-3) ** 2
    np.fill_diagonal(oblique, [4.9e-3**2, 4.9e-3**2, 1e-9, 1e-9, 1e-9, 1e-9])
    assert not asked.reached(oblique)
    for text in (
        "5mm",
        "5mm,3mm",
        "5,0.5",
        "0mm,1deg",
        "-1mm,1deg",
        "5mm,0.5deg,1rad",
        "e mm,1deg",
    ):
        with pytest.raises(InputError, match="for example 5mm"):
            parse_accuracy(text)


class Stepper:
    """A start-up on the simulated robot, a step at a time."""

    def __init__(self, robot: Robot, plan: cdprcal.Plan) -> None:
        self.startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
        self.device = SimulatedBackend.somewhere(robot, plan)
        self.command: cdprcal.StartUpCommand | None = None

    def until(self, reached: Callable[[cdprcal.StartUpCommand], bool]) -> None:
        for _ in range(60_000):
            self.command = self.startup.step(self.device.read())
            if reached(self.command) or self.startup.finished:
                return
            self.device.command(self.command)
        raise AssertionError("did not get there")


def test_a_start_up_can_end_early(robot: Robot, plan: cdprcal.Plan) -> None:
    run = Stepper(robot, plan)
    run.until(lambda c: c.state == cdprcal.StartUpState.moving and c.setpoint == 2)
    run.startup.finish()
    run.until(lambda c: False)
    assert run.startup.state == cdprcal.StartUpState.done
    assert run.startup.reason == ""
    assert [rest.setpoint for rest in run.startup.rests] == [0, 1]
    with pytest.raises(InputError, match="has ended"):
        run.startup.go_on_with(start_up_plan(plan))


def test_a_start_up_can_go_on_elsewhere(robot: Robot, plan: cdprcal.Plan) -> None:
    run = Stepper(robot, plan)
    run.until(lambda c: c.state == cdprcal.StartUpState.measuring)
    bad = cdprcal.StartUpPlan([np.full(robot.cable_count, 1e4)])
    with pytest.raises(InputError, match="outside the robot's limits"):
        run.startup.go_on_with(bad)
    elsewhere = plan.poses[1].tension_N
    run.startup.go_on_with(cdprcal.StartUpPlan([elsewhere]))
    run.until(lambda c: False)
    assert run.startup.state == cdprcal.StartUpState.done
    assert [rest.setpoint for rest in run.startup.rests] == [0, 1]
    assert run.command is not None
    np.testing.assert_array_equal(run.command.tension_setpoint_N, elsewhere)


def test_who_chooses_a_way_says_so_before_it_is_gone(robot: Robot, plan: cdprcal.Plan) -> None:
    """The corridor covers it then: the plan's own order never goes there."""
    run = Stepper(robot, plan)
    ways: list[tuple[cdprcal.Pose, np.ndarray, cdprcal.StartUpPlan]] = []
    guide = Guide(
        robot,
        plan,
        run.startup,
        asked=parse_accuracy("0.001mm,0.0001deg"),
        quick=True,
        on_way=lambda *way: ways.append(way),
    )
    while len(ways) < 3:
        sample = run.device.read()
        command = run.startup.step(sample)
        guide.step(command, sample, True)
        run.device.command(command)
        assert not run.startup.finished
    begins_N = [tension_N for _, tension_N, _ in ways]
    np.testing.assert_array_equal(begins_N[0], plan.start_tension_N)
    for (_, _, way), (pose, begin_N, _) in itertools.pairwise(ways):
        np.testing.assert_array_equal(way.setpoint_N[-1], begin_N)
        stop = next(s for s in plan.poses if np.array_equal(s.tension_N, begin_N))
        np.testing.assert_array_equal(stop.pose.position_m, pose.position_m)


def test_until(cli: Cli, plan: cdprcal.Plan, tmp_path: Path) -> None:
    path, log = tmp_path / "plan.csv", tmp_path / "run.csv"
    path.write_text(cdprcal.format_plan(plan))
    ran = cli("acquire", "irma4", path, "-o", log, "--until", "1.5mm,0.1deg", "--seed", 3, "--json")
    document = ran.document()
    assert document["asked"]["reached"]
    last = document["estimates"][-1]
    assert last["reached"]
    assert last["position_sigma_m"] <= 1.5e-3
    assert len(document["rests"]) < plan.measured_count / 2
    # Anyone who calibrates the log finds the same.
    result = cdprcal.calibrate(cdprcal.load_robot("irma4"), load_log(log).log).result
    assert result.covariance is not None
    assert parse_accuracy("1.6mm,0.11deg").reached(result.covariance)
    # Asked for more than the plan can give: everything is measured, and the code says so.
    short = tmp_path / "short.csv"
    three = cdprcal.make_plan(
        cdprcal.load_robot("irma4"),
        positions_m=[np.array(p) for p in ([0.2, 0.1, 0.8], [-0.2, 0.1, 1.0], [0.0, -0.2, 0.9])],
    ).plan
    path.write_text(cdprcal.format_plan(three))
    ran = cli("acquire", "irma4", path, "-o", short, "--until", "0.01mm,0.001deg", "--quick")
    assert ran.code == 1
    assert "was not reached" in ran.stdout
    assert "4 of 4" in ran.stdout
    ran = cli("acquire", "irma4", path, "-o", tmp_path / "no.csv", "--until", "soon")
    assert ran.code == 2
    assert not (tmp_path / "no.csv").exists()


def test_until_of_a_platform_that_cannot_turn_is_of_its_position(cli: Cli, tmp_path: Path) -> None:
    assert parse_accuracy("1.5mm", turns=False).rotation_rad == math.inf
    assert parse_accuracy("1.5mm,1rad", turns=False).rotation_rad == 1.0
    with pytest.raises(InputError, match=r"of the position, for example 5mm$"):
        parse_accuracy("1deg", turns=False)
    plan = tmp_path / "plan.csv"
    assert cli("plan", "hang4", "-o", plan).code == 0
    ran = cli("acquire", "hang4", plan, "-o", tmp_path / "run.csv", "--until", "5mm", "--json")
    asked = ran.document()["asked"]
    assert asked == {"position_sigma_m": 0.005, "rotation_sigma_rad": None, "reached": True}
    ran = cli("acquire", "irma4", plan, "-o", tmp_path / "no.csv", "--until", "5mm")
    assert ran.code == 2


def test_until_is_not_fooled_by_a_single_rest(cli: Cli, tmp_path: Path, default_plan: Path) -> None:
    """After one rest these load cells look faultless, and the pose is 15 mm off, 5 σ."""
    truth = tmp_path / "truth.json"
    ran = cli(
        *("acquire", "irma4", default_plan, "-o", tmp_path / "run.csv", "--json"),
        *(
            "--until",
            "5mm,0.5deg",
            "--seed",
            17,
            "--effect",
            "load_cell_gain=0.08,-0.06,0.05,-0.07",
            "--truth",
            truth,
        ),
    )
    document = json.loads(ran.stdout)
    was = json.loads(truth.read_text())["poses"][0]["position_m"]
    result = cdprcal.calibrate(
        cdprcal.load_robot("irma4"), load_log(tmp_path / "run.csv").log
    ).result
    assert len(document["rests"]) >= 3
    assert np.linalg.norm(result.poses[0].position_m - was) < 0.005


def test_until_goes_on_while_something_speaks_against_the_pose(
    cli: Cli, tmp_path: Path, default_plan: Path
) -> None:
    """A pulley is 10 mm from where the file has it: σ is small at once, and the pose is off."""
    log = tmp_path / "run.csv"
    ran = cli(
        *("acquire", "irma4", default_plan, "-o", log, "--json", "--seed", 2),
        *("--until", "10mm,1deg", "--effect", "frame_anchors=0.01,0,0,0,0,0,0,0,0,0,0,0"),
    )
    document = ran.document(3)
    assert not document["asked"]["reached"]
    assert document["state"] == "done"
    assert len(document["rests"]) == document["setpoints"]  # all of the plan
    assert all("misfit" in estimate["caveats"] for estimate in document["estimates"][2:])
    assert "with caveats: misfit" in ran.stderr
    calibrated = cli("calibrate", "irma4", log, "--json")
    assert document["caveats"] == calibrated.document(3)["caveats"]


def test_an_estimate_that_is_not_to_be_trusted_has_no_sigma() -> None:
    good = Estimate(9.0, 3, "converged", "", 1e-3, 1e-3, "", None, None, False)
    assert str(good) == "after 3 rests: ± 1 mm, ± 0.057° (1 σ, worst axis)"
    for status, words in (("not_converged", "not converged"), ("converged", "not to be trusted")):
        said = str(replace(good, status=status, trusted=False))
        assert words in said
        assert "±" not in said
    assert not replace(good, trusted=False).as_event()["trusted"]


def test_the_end_says_that_there_is_no_pose(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    why = "a minimum was found, but it contradicts the readings"
    off = Estimate(9.0, 3, "not_converged", why, 1e-3, 1e-3, "", None, None, False, trusted=False)
    plan = cdprcal.make_plan(robot, positions_m=[np.array([0.0, 0.0, 0.9])]).plan
    guide = Guide(robot, plan, cdprcal.StartUp(robot, start_up_plan(plan)))
    guide.estimates.append(off)
    run = Acquired(cdprcal.StartUpState.done, "", (), 0.0, 9.0, 90)
    Monitor(robot, plan, "run.csv").print_end(run, "irma4", guide)
    said = capsys.readouterr().out
    assert "after 3 rests: not converged" in said
    assert why in said
    assert "next: cdprcal check irma4 run.csv, then cdprcal diagnose irma4 run.csv" in said


def test_a_start_up_that_waits_for_no_rest_ends_when_the_pose_is_known(
    tmp_path: Path, cli: Cli, default_plan: Path
) -> None:
    truth, log = tmp_path / "truth.json", tmp_path / "run.csv"
    ran = cli(
        *(
            "acquire",
            "irma4",
            default_plan,
            "-o",
            log,
            "--motion",
            "--quick",
            "--until",
            "5mm,0.5deg",
        ),
        *("--json", "--seed", 17, "--truth", truth),
    )
    document = ran.document()
    assert document["state"] == "done"
    assert document["rests"] == []
    assert document["asked"]["reached"]
    assert document["duration_s"] <= 15.0
    assert all(estimate["in_motion"] for estimate in document["estimates"])
    was = json.loads(truth.read_text())["poses"][0]["position_m"]
    last = document["estimates"][-1]
    assert np.linalg.norm(np.subtract(last["position_m"], was)) < 0.003
    result = cdprcal.calibrate("irma4", log, motion=True).result
    np.testing.assert_allclose(result.poses[0].position_m, last["position_m"], atol=1e-3)


def test_a_run_in_motion_is_diagnosed_on_its_way(
    tmp_path: Path, cli: Cli, default_plan: Path
) -> None:
    """It ends when the answer no longer changes, and nothing is asked twice at one place."""
    path = tmp_path / "run.csv"
    ran = cli("acquire", "irma4", default_plan, "--motion", "--diagnose", "--seed", 4,
              "--effect", "centre_of_mass=0.01,0.01,0", "-o", path, "--json")  # fmt: skip
    document = ran.document()
    assert document["state"] == "done"
    told = [e["diagnosis"] for e in document["estimates"] if "diagnosis" in e]
    assert [effect["name"] for effect in told[-1]["effects"]] == ["centre_of_mass"]
    assert "set-points in a row named the same" in ran.stderr + ran.stdout
    times_s = [estimate["time_s"] for estimate in document["estimates"]]
    assert min(np.diff(times_s)) >= 1.0
    assert times_s[-1] < 70.0  # the whole plan takes 98 s


def test_a_live_robot_does_not_wait_for_the_estimate(robot: Robot, plan: cdprcal.Plan) -> None:
    """On a thread of its own the estimate comes when it comes, and is the same."""
    runs = []
    for background in (False, True):
        startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
        guide = Guide(robot, plan, startup, background=background)
        device = SimulatedBackend.somewhere(robot, plan)
        step = guide.step

        def watch(
            command: cdprcal.StartUpCommand,
            sample: cdprcal.RobotSample,
            logged: bool,
            step: Callable[..., object] = step,
            guide: Guide = guide,
            wait: bool = background,
        ) -> None:
            step(command, sample, logged)
            while wait and guide._pending is not None and not guide._pending.done():
                pass  # the simulator does not wait by itself

        acquire(
            startup,
            device,
            stopping.NoLog(),
            watch=watch,
            stop=lambda guide=guide: len(guide.estimates) >= 3,  # type: ignore[misc]
        )
        guide.close()
        runs.append([e.as_event() for e in guide.estimates[:3]])
    assert runs[0] == runs[1]


def test_stopping_keeps_its_promise() -> None:
    """The study, in short: python tests/studies/stopping.py has the long version."""
    problems = stopping.study(4, 1.0, Workers(jobs=1), "irma4", [])
    assert problems == []


def test_yaw_around_half_a_turn_is_not_noise(robot: Robot, made: cdprcal.SyntheticLog) -> None:
    yaw = made.log.roll_pitch_yaw_rad.copy()
    yaw[:, 2] += np.pi - yaw[0, 2]
    yaw[:, 2] = (yaw[:, 2] + np.pi) % (2 * np.pi) - np.pi
    turned = changed(made.log, roll_pitch_yaw_rad=yaw)
    assert np.ptp(yaw[:20, 2]) > 6.0  # it does jump
    plain, other = (cdprcal.calibrate(robot, log) for log in (made.log, turned))
    noise = [c.problem.noise.channels["yaw"].sample for c in (plain, other)]
    assert noise[1] == pytest.approx(noise[0], rel=1e-6)
    assert cdprcal.channel_noise(yaw[:, 2], angles=True) < 0.1 * cdprcal.channel_noise(yaw[:20, 2])
    apart = cdprcal.minus(other.result.poses[0], plain.result.poses[0])
    assert np.all(np.abs(apart) < 1e-6)


def test_the_reference_is_what_stood_still(robot: Robot, made: cdprcal.SyntheticLog) -> None:
    """A creep below the noise of a reading, but not below that of a mean, is not part of ζ0."""
    sigma_m = 0.2 * robot.sigma.length_m
    length_m = made.log.length_m.copy()
    time_s = made.log.time_s
    creeping = (time_s > 2.0) & (time_s < 4.0)
    length_m[creeping] += 1.5 * sigma_m * ((time_s[creeping] - 2.0) / 2.0)[:, None]
    length_m[time_s >= 4.0] += 1.5 * sigma_m
    log = changed(made.log, length_m=length_m, tension_setpoint_N=None)
    first = cdprcal.prepare(robot, log).problem.measurements[0]
    still = made.log.length_m[time_s < 2.0].mean(axis=0)
    assert np.all(np.abs(first.length_m - still) < 0.5 * sigma_m)


def test_a_balance_is_no_better_than_stated_until_shown(robot: Robot) -> None:
    """Two rests cannot show that the model is exact to millinewtons, so nobody claims it."""
    exact = cdprcal.synthetic_log(
        robot,
        [np.array(t) for t in TABLE_II_TENSIONS_N[:2]],
        cdprcal.SyntheticLogOptions(
            dwell_s=4.0, move_s=4.0, noise=cdprcal.reading_noise(robot.sigma, 1.0), seed=2
        ),
    )
    noise = cdprcal.calibrate(robot, exact.log).problem.noise
    assert noise.wrench_force_N > 0.5 * robot.sigma.wrench_force_N


def test_the_same_bits_every_time(robot: Robot, made: cdprcal.SyntheticLog) -> None:
    results = []
    ballast = []
    for i in range(3):
        ballast.append(np.empty(1000 + 17 * i))  # other addresses
        result = cdprcal.calibrate(robot, made.log).result
        assert result.covariance is not None
        results.append((result.poses[0].position_m.tobytes(), result.covariance.tobytes()))
    assert results[0] == results[1] == results[2]
