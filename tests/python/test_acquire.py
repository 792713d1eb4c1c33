"""``cdprcal acquire`` and the loop behind it: the simulated robot, faults, what is in the log; and
``--diagnose``: the evidence grows rest by rest, and the run ends when it has told."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

import cdprcal
from cdprcal import Plan, Robot, RobotSample, StartUp, StartUpCommand, StartUpState
from cdprcal.acquisition import Acquired, Guide, PowerOn, acquire, start_up_options, start_up_plan
from cdprcal.acquisition.remedies import remedy_for
from cdprcal.acquisition.told import Told, settled, told_by
from cdprcal.hardware import BackendError
from cdprcal.hardware.simulated import SimulatedBackend
from cdprcal.io import AcquisitionInputs, LiveLog, load_log, open_live_log, read_inputs
from cdprcal.io.events import read_events, told_in
from conftest import Cli
from test_live_log import disk_of

SWING_S = 2.9  # of irma4's platform, the slowest
FAULT_S = 6.0
KINDS = pytest.mark.parametrize("kind", ["csv", "mcap"])


class Tampered:
    """The simulated robot with a fault of the readings from FAULT_S on."""

    def __init__(
        self,
        inner: SimulatedBackend,
        fault: Callable[[RobotSample], None],
        *,
        from_s: float = FAULT_S,
    ) -> None:
        self.inner = inner
        self.from_s = from_s
        self.fault = fault
        self.commands: list[StartUpCommand] = []
        self.stops = 0

    @property
    def settings(self) -> dict[str, Any]:
        return self.inner.settings

    def read(self) -> RobotSample:
        sample = self.inner.read()
        if sample.time_s >= self.from_s:
            self.fault(sample)
        return sample

    def command(self, command: StartUpCommand) -> None:
        self.commands.append(command)
        self.inner.command(command)

    def stop(self) -> None:
        self.stops += 1
        self.inner.stop()


def hung(robot: Robot, plan: Plan, startup: StartUp, effects: list[str]) -> SimulatedBackend:
    injected = [cdprcal.parse_injected_effect(effect) for effect in effects]
    return SimulatedBackend.somewhere(
        robot,
        plan,
        cdprcal.SimulatorOptions(seed=1, effects=injected),
        velocity_limit_m_s=startup.velocity_limit_m_s,
    )


def run_with(
    robot: Robot,
    plan: Plan,
    path: Path,
    fault: Callable[[RobotSample], None],
    *,
    effects: list[str] | None = None,
    **options: Any,
) -> tuple[Acquired, Tampered]:
    startup = StartUp(robot, start_up_plan(plan, quick=True))
    backend = Tampered(hung(robot, plan, startup, effects or []), fault)
    inputs = AcquisitionInputs(cdprcal.to_yaml(robot), cdprcal.format_plan(plan), backend.settings)
    log = open_live_log(path, robot.cable_count, inputs, 10.0)
    return acquire(startup, backend, log, **options), backend


def set_nan(name: str, cable: int) -> Callable[[RobotSample], None]:
    def fault(sample: RobotSample) -> None:
        values = getattr(sample, name).copy()
        values[cable] = np.nan
        setattr(sample, name, values)

    return fault


def set_to(name: str, cable: int, value: float) -> Callable[[RobotSample], None]:
    def fault(sample: RobotSample) -> None:
        values = getattr(sample, name).copy()
        values[cable] = value
        setattr(sample, name, values)

    return fault


def lose_connection(sample: RobotSample) -> None:
    raise BackendError("bus off")


def drive_error(sample: RobotSample) -> None:
    sample.drive_error = "node 3: following error"


def dead(name: str) -> Callable[[RobotSample], None]:
    return lambda sample: setattr(sample, name, FAULT_S)


@KINDS
@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (set_nan("tension_N", 2), "cable 3: the load cell does not answer"),
        (set_nan("length_m", 0), "cable 1: the winch encoder does not answer"),
        (set_nan("swivel_rad", 3), "cable 4: the swivel encoder does not answer"),
        (set_nan("roll_pitch_yaw_rad", 1), "the AHRS does not answer"),
        (dead("drives_time_s"), "the drives' readings are stale"),
        (dead("attitude_time_s"), "the AHRS readings are stale"),
        (set_to("tension_N", 1, 77.25), "cable 2: the load cell is stuck"),
        (set_to("length_m", 1, 0.25), "cable 2: the winch"),
        (set_to("tension_N", 0, 1.0), "cable 1: slack"),
        (set_to("tension_N", 0, 450.0), "cable 1: over-tension"),
        (drive_error, "drive error: node 3: following error"),
        (lose_connection, "drive error: bus off"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_fault_ends_in_the_safe_state_with_a_readable_log(
    kind: str,
    fault: Callable[[RobotSample], None],
    words: str,
    robot: Robot,
    plan: Plan,
    tmp_path: Path,
) -> None:
    path = tmp_path / f"run.{kind}"
    run, backend = run_with(robot, plan, path, fault)
    assert run.state == StartUpState.holding
    assert words in run.reason
    # Where load cells and winches can be trusted the platform has one swing to come to rest.
    doubted = not any(sensor in words for sensor in ("swivel", "AHRS", "operator"))
    assert FAULT_S - 0.015 < run.end_s < FAULT_S + (2.0 if doubted else 0.5 + SWING_S)
    assert_safe(backend)
    file = load_log(path)
    assert file.findings == ()
    assert len(file.log) == run.samples > 50
    assert words.encode() in path.read_bytes() or kind == "mcap"  # compressed there
    inputs = read_inputs(path)
    assert inputs is not None
    assert inputs.robot_yaml == cdprcal.to_yaml(robot)


@pytest.mark.parametrize("slack_s", [0.0, 0.5])
def test_a_cable_that_is_slack_at_power_on_is_refused_before_a_winch_moves(
    slack_s: float, robot: Robot, plan: Plan, tmp_path: Path
) -> None:
    def fault(sample: RobotSample) -> None:
        if sample.time_s >= slack_s:
            set_to("tension_N", 2, 0.1)(sample)

    startup = StartUp(robot, start_up_plan(plan, quick=True))
    backend = Tampered(hung(robot, plan, startup, []), fault, from_s=0.0)
    log = open_live_log(tmp_path / "run.csv", 4, AcquisitionInputs("", "", {}), 10.0)
    guard = PowerOn(robot, cdprcal.StartUpOptions()).look
    run = acquire(startup, backend, log, guard=guard)
    assert run.state == StartUpState.holding
    assert "cable 3: slack at power-on, 0.1 N" in run.reason
    assert "tighten that cable" in remedy_for(run.reason)
    assert all(not command.velocity_m_s.any() for command in backend.commands)


def test_what_is_slack_for_a_moment_or_later_is_not_refused_at_power_on(
    robot: Robot,
) -> None:
    least_N = robot.tension_limits_N[0]
    guard = PowerOn(robot, cdprcal.StartUpOptions())
    for k in range(300):
        sample = RobotSample(time_s=7.0 + 0.01 * k)
        sample.tension_N = np.full(4, least_N)
        if k % 20 < 10 or k > 101:  # 0.1 s; while it moves, which the watchdog looks at
            sample.tension_N = np.array([least_N, 0.0, np.nan, least_N])
        assert guard.look(sample) == ""


def assert_safe(backend: Tampered) -> None:
    """Locked, and standing still from there on."""
    assert backend.stops == 1
    backend.inner.read()
    before = backend.inner.truth().pose
    twist = np.inf
    for _ in range(1000):
        backend.inner.read()
        twist = float(np.linalg.norm(backend.inner.truth().twist))
    assert twist < 0.02  # what is left of a swing after ten seconds
    after = backend.inner.truth().pose
    assert np.linalg.norm(after.position_m - before.position_m) < 0.2


@KINDS
def test_a_cable_that_runs_off_stops_the_robot(
    kind: str, robot: Robot, plan: Plan, tmp_path: Path
) -> None:
    path = tmp_path / f"run.{kind}"
    effects = [f"cable_slip={FAULT_S},2,2"]
    run, backend = run_with(robot, plan, path, lambda sample: None, effects=effects)
    assert run.state == StartUpState.holding
    assert "cable 2: slack" in run.reason
    assert backend.stops == 1
    assert len(load_log(path).log) == run.samples


@KINDS
def test_a_full_disk_stops_the_robot(kind: str, robot: Robot, plan: Plan, tmp_path: Path) -> None:
    path = tmp_path / f"run.{kind}"
    with disk_of(30_000):
        run, backend = run_with(robot, plan, path, lambda sample: None)
    assert run.state == StartUpState.holding
    assert "the log cannot be written: file too large" in run.reason
    assert_safe(backend)
    log = load_log(path).log
    assert run.samples - len(log) <= 10
    assert run.end_s - log.time_s[-1] < 2.0


def test_whatever_is_raised_on_the_way_the_winches_are_locked_and_the_log_closed(
    robot: Robot, plan: Plan, tmp_path: Path
) -> None:
    path = tmp_path / "run.csv"
    closed = []

    def note_close(log: LiveLog) -> LiveLog:
        close = log.close

        def noted() -> None:
            closed.append(True)
            close()

        log.close = noted  # type: ignore[method-assign]
        return log

    def fault(sample: RobotSample) -> None:
        raise ZeroDivisionError

    backends: list[Tampered] = []

    def watch(command: StartUpCommand, sample: RobotSample, logged: bool) -> None:
        if sample.time_s > 1.0:
            raise ZeroDivisionError

    startup = StartUp(robot, start_up_plan(plan, quick=True))
    backend = Tampered(hung(robot, plan, startup, []), fault)
    backends.append(backend)
    inputs = AcquisitionInputs("", "", {})
    log = note_close(open_live_log(path, 4, inputs, 10.0))
    with pytest.raises(ZeroDivisionError):
        acquire(startup, backend, log, watch=watch)
    assert backend.stops == 1
    assert closed


def test_the_loop_is_that_of_the_core(robot: Robot, plan: Plan, tmp_path: Path) -> None:
    """The same robot, plan and seed through simulate_startup: the same samples to the last bit."""
    run, _ = run_with(robot, plan, tmp_path / "run.csv", lambda sample: None)
    corners = np.array([plan.start_pose.position_m, *(s.pose.position_m for s in plan.poses)])
    start = cdprcal.random_start(robot, cdprcal.Box(corners.min(axis=0), corners.max(axis=0)), 1)
    assert start is not None
    core = cdprcal.simulate_startup(
        robot,
        start_up_plan(plan, quick=True),
        simulator=cdprcal.SimulatorOptions(seed=1),
        initial_tension_N=start.tension_N,
    )
    log = load_log(tmp_path / "run.csv").log
    assert run.state == core.state == StartUpState.done
    assert len(run.rests) == len(core.rests) == 4
    for name in ("time_s", "length_m", "swivel_rad", "tension_N", "tension_setpoint_N"):
        np.testing.assert_array_equal(getattr(log, name), getattr(core.log, name))


@KINDS
def test_a_log_alone_is_enough_to_solve_and_to_run_again(
    kind: str, cli: Cli, plan_path: Path, tmp_path: Path
) -> None:
    path, truth = tmp_path / f"run.{kind}", tmp_path / "truth.json"
    effects = ("--effect", "load_cell_bias=1,-1,2,0", "--effect", "mass=0.05")
    ran = cli("acquire", "irma4", plan_path, "--seed", 5, *effects, "--quick", "-o", path,
              "--truth", truth, "--json")  # fmt: skip
    document = ran.document()
    assert document["state"] == "done"
    assert document["setpoints"] == len(document["rests"]) == 4
    inputs = read_inputs(path)
    assert inputs is not None
    assert inputs.plan_csv == plan_path.read_text()
    assert inputs.settings["seed"] == 5
    assert inputs.settings["effects"] == ["load_cell_bias=1,-1,2,0", "mass=0.05"]
    # Solve again: the robot in the log, the pose it truly had.
    robot = cdprcal.parse_robot(inputs.robot_yaml, "log")
    log = load_log(path).log
    result = cdprcal.calibrate(robot, log).result
    assert result.status == cdprcal.CalibrationStatus.converged
    poses = json.loads(truth.read_text())["poses"]
    assert [pose["time_s"] for pose in poses] == log.time_s.tolist()
    error = np.subtract(poses[0]["position_m"], result.poses[0].position_m)
    assert np.linalg.norm(error) < 0.02  # the effects are not in the model
    # Run again: the same bytes.
    held = tmp_path / "held"
    ran = cli("import", path, "-o", tmp_path / "copy.csv", "--inputs", held)
    assert ran.code == 0, ran.stderr
    np.testing.assert_array_equal(load_log(tmp_path / "copy.csv").log.length_m, log.length_m)
    # Whatever it is turned into, it holds the same.
    for copy in ("copy.csv", "copy.mcap"):
        assert cli("import", path, "-o", tmp_path / copy, "--force").code == 0
        assert load_log(tmp_path / copy).findings == ()
        assert read_inputs(tmp_path / copy) == inputs
        assert read_events(tmp_path / copy) == read_events(path) != []
    again, robot_again, plan_again = (
        tmp_path / f"again.{kind}",
        held / "robot.yaml",
        held / "plan.csv",
    )
    assert json.loads((held / "settings.json").read_text()) == inputs.settings
    injected = [a for effect in inputs.settings["effects"] for a in ("--effect", effect)]
    seed = inputs.settings["seed"]
    ran = cli("acquire", robot_again, plan_again, "--seed", seed, *injected, "--quick", "-o", again)
    assert ran.code == 0, ran.stderr
    assert again.read_bytes() == path.read_bytes()


def test_settings_that_are_damaged_are_left_out(cli: Cli, plan_path: Path, tmp_path: Path) -> None:
    path, copy = tmp_path / "run.csv", tmp_path / "copy.csv"
    assert cli("acquire", "irma4", plan_path, "--quick", "-o", path).code == 0
    path.write_bytes(path.read_bytes().replace(b'# settings| {"', b"# settings| "))
    ran = cli("import", path, "-o", copy)
    assert (ran.code, read_inputs(copy)) == (0, None)
    assert "its settings are damaged" in ran.stderr
    assert cli("import", path, "-o", copy, "--inputs", tmp_path / "held").code == 2


def test_a_log_without_inputs_has_none_to_give(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    ran = cli("import", log_path, "-o", tmp_path / "copy.csv", "--inputs", tmp_path / "held")
    ran.refused("cdprcal did not acquire it")
    assert not (tmp_path / "copy.csv").exists()


def test_progress_is_said_on_stderr_and_the_end_on_stdout(
    cli: Cli, plan_path: Path, tmp_path: Path
) -> None:
    ran = cli("acquire", "irma4", plan_path, "--quick", "-o", tmp_path / "run.csv")
    assert ran.code == 0
    for words in ("set-point 1 of 4", "set-point 4 of 4", "left"):
        assert words in ran.stderr
    assert ran.stdout.startswith("done")
    for words in ("4 of 4 set-points measured", "next: cdprcal calibrate irma4"):
        assert words in ran.stdout


def test_wrong_use_is_said_and_nothing_written(cli: Cli, plan_path: Path, tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    for arguments, words in (
        (("irma4", plan_path, "--backend", "canopen5"), "--backend: 'canopen5'"),
        (("irma4", plan_path, "--rate-hz", "0"), "--rate-hz"),
        (("irma4", plan_path, "--effect", "mas=1"), "effect 'mas': not known"),
        (("irma4", plan_path, "--truth", out), "is the file of -o too"),
        (("ring3", plan_path), "is of robot irma4, not of ring3; make one with cdprcal plan"),
        (("irma4", tmp_path / "none.csv"), "none.csv"),
        (("irma4", tmp_path), "cannot be read"),
    ):
        cli("acquire", *arguments, "-o", out).refused(words)
        assert not out.exists()
    out.write_text("precious")
    cli("acquire", "irma4", plan_path, "-o", out).refused("exists already")
    assert out.read_text() == "precious"


def test_the_truth_is_refused_before_the_run(cli: Cli, plan_path: Path, tmp_path: Path) -> None:
    """A file that is no truth, a folder that is not there; an earlier truth is replaced."""
    out, mine = tmp_path / "run.csv", tmp_path / "mine.json"
    mine.write_text("precious")
    for truth, words in (
        (mine, "mine.json: exists already and is no earlier truth; give another name"),
        (tmp_path / "none" / "t.json", "t.json: cannot be written: no such file or directory"),
        (tmp_path, "is a directory; give the path of a file"),
    ):
        cli("acquire", "irma4", plan_path, "-o", out, "--truth", truth).refused(words)
        assert not out.exists()
    assert mine.read_text() == "precious"
    mine.write_text('{\n  "poses": []}')
    assert cli("acquire", "irma4", plan_path, "--quick", "-o", out, "--truth", mine).code == 0
    assert len(json.loads(mine.read_text())["poses"]) > 100


@pytest.mark.parametrize("json_too", [[], ["--json"]])
def test_a_truth_that_cannot_be_written_hides_no_end(
    json_too: list[str],
    cli: Cli,
    plan_path: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def full(path: Path, text: str) -> NoReturn:
        raise cdprcal.InputError(f"{path}: cannot be written: no space left; free some space")

    monkeypatch.setattr("cdprcal.io.files.write_text", full)
    ran = cli("acquire", "irma4", plan_path, "--quick", "-o", tmp_path / "run.csv",
              "--truth", tmp_path / "truth.json", *json_too)  # fmt: skip
    ran.refused("truth.json: cannot be written")
    assert '"state": "done"' in ran.stdout if json_too else "done" in ran.stdout.split("\n")[0]


@KINDS
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_a_signal_stops_the_robot_and_keeps_the_log(
    kind: str, number: signal.Signals, plan_path: Path, tmp_path: Path
) -> None:
    path = tmp_path / f"run.{kind}"
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "cdprcal",
            "acquire",
            "irma4",
            plan_path,
            "-o",
            path,
            "--speed",
            "4",
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=dict(os.environ),  # readline, in this process, sets COLUMNS behind its back
    )
    # A few seconds of robot time, then the signal.
    deadline = time.monotonic() + 30.0
    while not (path.exists() and path.stat().st_size > 12_000):
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(number)
    said, _ = process.communicate(timeout=30)
    assert process.returncode == 1, said
    assert "stopped by the operator" in said
    assert "Traceback" not in said
    file = load_log(path)
    assert file.findings == ()
    assert f"{len(file.log)} samples" in said


def run_and_tell(robot: Robot, plan: Plan, path: Path, tell: int) -> NoReturn:
    """A run at 50 times real time that tells of every logged row; ends the process."""

    def watch(command: StartUpCommand, sample: RobotSample, logged: bool) -> None:
        if logged:
            os.write(tell, b"%d\n" % round(10 * sample.time_s))
            time.sleep(0.002)

    try:
        run_with(robot, plan, path, lambda sample: None, watch=watch)
    finally:
        os._exit(0)


KILLS = int(os.environ.get("CDPRCAL_KILLS", "50"))


def test_killed_at_any_moment_a_log_loses_at_most_a_second(
    robot: Robot, plan: Plan, tmp_path: Path
) -> None:
    """kill -9 of the process that acquires; what it had logged by then is told through a pipe."""
    random = np.random.default_rng(9)
    whole = tmp_path / "whole.csv"
    run_with(robot, plan, whole, lambda sample: None)
    complete = load_log(whole).log
    for kill in range(KILLS):
        path = tmp_path / f"killed{kill}.{'csv' if kill % 2 else 'mcap'}"
        told, tell = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(told)
            run_and_tell(robot, plan, path, tell)
        os.close(tell)
        with os.fdopen(told) as pipe:
            # By rows, not by time: a busy machine takes long to begin.
            lines = list(itertools.islice(pipe, int(random.integers(12, len(complete)))))
            time.sleep(float(random.uniform(0.0, 0.004)))
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            lines += pipe.readlines()
        file = load_log(path)
        lost_s = 0.1 * int(lines[-1]) - file.log.time_s[-1]
        assert lost_s < 1.0, f"kill {kill}: {lost_s:.1f} s lost"
        assert {finding.code for finding in file.findings} <= {"truncated", "unfinished"}
        count = len(file.log)
        np.testing.assert_array_equal(file.log.length_m, complete.length_m[:count])
        inputs = read_inputs(path)
        assert inputs is not None
        assert inputs.plan_csv == cdprcal.format_plan(plan)


def test_a_platform_that_is_slow_to_settle_is_waited_for(cli: Cli, tmp_path: Path) -> None:
    """Low in a corner of a large robot it sinks for half a minute, and the plan says so: longer
    than the 20 s after which StartUp gives up by itself."""
    robot = large_robot()
    (tmp_path / "large.yaml").write_text(cdprcal.to_yaml(robot))
    plan = cdprcal.make_plan(
        robot, positions_m=[[0.8, -1.02, 0.052]], home_m=[0.0, -0.13, 1.0]
    ).plan
    (tmp_path / "plan.csv").write_text(cdprcal.format_plan(plan))
    usual_s = cdprcal.StartUpOptions().settle_timeout_s
    assert plan.poses[0].dwell_s > usual_s
    assert start_up_options(plan).settle_timeout_s > plan.poses[0].dwell_s
    out = tmp_path / "run.csv"
    ran = cli("acquire", tmp_path / "large.yaml", tmp_path / "plan.csv", "--seed", 5, "-o", out)
    assert ran.code == 0, ran
    events = [plan.poses[0].transition_s, load_log(out).log.time_s[-1]]
    assert events[1] - events[0] > usual_s, "it did not take long: this tests nothing"


def large_robot() -> Robot:
    """Five cables on a circle of 2 m, 2.5 m high, and 20 kg."""
    directions = [
        np.array([np.cos(angle), np.sin(angle), 0.0])
        for angle in 0.3 + 2.0 * np.pi * np.arange(5) / 5
    ]
    return Robot(
        name="large",
        platform=cdprcal.Platform(
            mass_kg=20.0,
            centre_of_mass_m=[0.0, 0.0, -0.05],
            inertia_kg_m2=np.diag([0.6, 0.6, 0.9]),
        ),
        cables=[
            cdprcal.Cable(
                pulley=cdprcal.Pulley(
                    position_m=2.0 * out + [0.0, 0.0, 2.5],
                    x_axis=[0.0, 0.0, -1.0],
                    swivel_axis=-out,
                    radius_m=0.03,
                ),
                platform_anchor_m=0.25 * out + [0.0, 0.0, 0.2],
            )
            for out in directions
        ],
        tension_limits_N=[15.0, 600.0],
        sigma=cdprcal.SensorSigma(
            length_m=0.002, swivel_rad=0.0035, attitude_rad=0.0035, tension_N=2.0
        ),
    )


def test_a_platform_that_settles_soon_is_not_waited_for_longer(plan: Plan) -> None:
    rests_s = [plan.start_dwell_s, *(stop.dwell_s for stop in plan.poses)]
    usual_s = cdprcal.StartUpOptions().settle_timeout_s
    assert start_up_options(plan).settle_timeout_s == max(usual_s, 2.0 * max(rests_s))


def told(
    *effects: tuple[str, float, tuple[str, ...]],
    verdict: str = "explained",
    within_reach: bool = False,
) -> Told:
    return Told(verdict, (), effects, {}, within_reach)


def test_it_is_settled_when_the_same_is_said_three_times_without_a_rival() -> None:
    bias = told(("load_cell_bias", 40.0, ()))
    assert settled([bias] * 2) == ""
    assert "no rival is left" in settled([bias] * 3)
    assert settled([bias, told(("mass", 40.0, ())), bias]) == ""
    assert settled([told(("load_cell_bias", 4.0, ()))] * 9) == ""


def test_it_is_not_settled_while_another_effect_begins_to_show() -> None:
    bias = told(("load_cell_bias", 40.0, ()))
    assert settled([bias, bias, replace(bias, suspect="yaw_drift")]) == ""
    assert settled([bias, replace(bias, suspect="yaw_drift"), bias]) != ""


def test_rivals_get_more_rests_and_nothing_found_gets_all() -> None:
    tied = told(("mass", 90.0, ("load_cell_gain",)), within_reach=True)
    assert settled([tied] * 5) == ""
    assert "told nothing more apart" in settled([tied] * 6)
    for_ever = told(("mass", 90.0, ("external_force",)))
    assert settled([for_ever] * 2) == ""
    assert "no stop of the plan" in settled([for_ever] * 3)
    assert settled([told(verdict="consistent")] * 20) == ""
    assert settled([told(("mass", 90.0, ()), verdict="unexplained")] * 20) == ""
    assert settled([]) == ""


@pytest.fixture
def random_plan(cli: Cli, tmp_path: Path) -> Path:
    path = tmp_path / "plan.csv"
    assert cli("plan", "irma4", "--order", "random", "-o", path).code == 0
    return path


def test_a_run_ends_when_the_effect_is_known(cli: Cli, random_plan: Path, tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    hidden = ("--effect", "load_cell_bias=6,-5,14,-8", "--seed", "3")
    ran = cli(
        "acquire", "irma4", random_plan, *hidden, "--quick", "--diagnose", "--json", "-o", log
    )
    document = ran.document()
    assert "no rival is left" in document["settled"]
    last = document["estimates"][-1]["diagnosis"]
    assert [effect["name"] for effect in last["effects"]] == ["load_cell_bias"]
    assert len(document["rests"]) < 17
    assert "load_cell_bias" in cli("diagnose", "irma4", log).stdout.splitlines()[0]
    page = tmp_path / "report.html"
    assert cli("report", "irma4", log, "-o", page).code == 0
    text = page.read_text()
    assert '"told-0"' in text
    assert text.count("explained: load_cell_bias (") == len(told_in(log)) >= 3


def test_events_of_others_are_no_diagnoses(tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    log.write_text(
        '# event| {"time_s": 1, "estimate": {"diagnosis": 3}}\n'
        '# event| {"time_s": 2, "estimate": {"diagnosis": {"verdict": "explained"}}}\n'
        '# event| {"time_s": 3, "estimate": {}}\n'
    )
    assert told_in(log) == ()


def test_a_clean_robot_goes_through_its_plan(cli: Cli, random_plan: Path, tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    ran = cli("acquire", "irma4", random_plan, "--seed", 3, "--quick", "--diagnose", "-o", log)
    assert ran.code == 0, ran.stderr
    assert "17 of 17 set-points measured" in ran.stdout
    assert "consistent: no effect found" in ran.stdout
    assert "next: cdprcal diagnose irma4" in ran.stdout


def test_it_goes_where_rivals_come_apart(robot: Robot) -> None:
    plan = cdprcal.make_plan(robot, order=cdprcal.VisitingOrder.random).plan
    startup = StartUp(robot, start_up_plan(plan, quick=True), start_up_options(plan))
    guide = Guide(robot, plan, startup, diagnoses=True, quick=True)
    stops = [i for i, stop in enumerate(plan.poses) if stop.measured]
    chosen = guide._telling(stops[:2], {stops[5]: 4.0, stops[9]: 0.5})
    assert chosen is not None
    assert chosen.stop == stops[5]
    # Worth nothing more: on in the plan's order.
    onward = guide._telling(stops[:2], {})
    assert onward is not None
    assert onward.stop == stops[2]
    assert guide._telling(stops, {}) is None


def test_stops_are_worth_what_they_tell_between_rivals(robot: Robot) -> None:
    plan = cdprcal.make_plan(robot, order=cdprcal.VisitingOrder.random).plan
    run = cdprcal.simulate_startup(robot, plan, effects=["mass=0.8"], seed=4)
    left = {i: stop for i, stop in enumerate(plan.poses) if stop.measured}
    heavy = told_by(robot, run.log, left)
    assert heavy is not None
    assert heavy.rivals
    assert set(heavy.worth) == set(left)
    # What pulls straight down does so everywhere.
    assert not heavy.within_reach
    assert not any(heavy.worth.values())
    assert told_by(robot, run.log).worth == {}  # type: ignore[union-attr]
    with pytest.raises(cdprcal.InputError, match="give the place of one in effects"):
        cdprcal.separation_by_stops(cdprcal.diagnose(robot, [run.log]), 9, "mass", [], [])
