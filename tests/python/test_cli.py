"""The contract of the command line: JSON schema, exit codes, what goes to stdout."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal.results import calibration_as_dict
from conftest import Cli, changed, raw_text, strict
from scripts import executed

CHANNELS = {
    "length_m",
    "swivel_rad",
    "roll_pitch_rad",
    "yaw_rad",
    "tension_N",
    "wrench_force_N",
    "wrench_moment_Nm",
}


def assert_is_pose(pose: dict[str, Any]) -> None:
    assert np.shape(pose["position_m"]) == (3,)
    rotation = np.array(pose["rotation"])
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("method", ["unified", "static", "kinematic"])
@pytest.mark.parametrize("formulation", ["full", "paper"])
def test_calibrate_json_is_as_documented(
    cli: Cli, log_path: Path, method: str, formulation: str
) -> None:
    ran = cli(
        "calibrate", "irma4", log_path, "--json", "--method", method, "--formulation", formulation
    )
    result = strict(ran.stdout)
    # Without statics the attitude is known to 15°, which is said.
    weak = (method, formulation) == ("kinematic", "full")
    assert [caveat["code"] for caveat in result["caveats"]] == ["imprecise"] * weak
    assert (ran.code, ran.stderr) == (3 if weak else 0, "")
    assert result["status"] == "converged"
    assert result["reference_time_s"] >= 0
    assert_is_pose(result["initial_pose"])
    rotation = cdprcal.rotation_from_euler(
        result["initial_pose"]["euler_rad"], cdprcal.EulerConvention.XYZ
    )
    np.testing.assert_allclose(rotation, result["initial_pose"]["rotation"], atol=1e-12)
    assert np.shape(result["covariance"]) == (6, 6)
    assert np.shape(result["initial_lengths_m"]) == np.shape(result["initial_swivels_rad"]) == (4,)
    assert result["cost"] > 0
    assert result["iterations"] > 0
    assert result["solve_time_s"] > 0
    assert set(result["residual_rms"]) == CHANNELS
    kinds = [pose["kind"] for pose in result["poses"]]
    assert kinds.count("static") == result["static_poses"]
    assert kinds.count("kinematic") == result["kinematic_poses"]
    for pose in result["poses"]:
        assert pose["time_s"] >= 0
        assert_is_pose(pose)
    if method == "kinematic":
        assert result["residual_rms"]["tension_N"] is None


@pytest.mark.parametrize(
    "mass_kg", ["12.992", "11.0"], ids=["as it is", "with effects allowed for"]
)
def test_one_answer_in_every_language(
    cli: Cli, log_path: Path, tmp_path: Path, mass_kg: str
) -> None:
    """C++ (cdprcal-solve is it), Python and the command line agree to the bit."""
    folder = os.environ.get("CDPRCAL_BIN")
    if not folder:
        pytest.skip("CDPRCAL_BIN does not name the folder of cdprcal-solve")
    robot = tmp_path / "robot.yaml"
    robot.write_text(cdprcal.builtin_robot_yaml("irma4").replace("12.992", mass_kg))
    ran = executed([Path(folder) / "cdprcal-solve", robot, log_path, "--json"])
    cpp = strict(ran.stdout)
    python = cli("calibrate", robot, log_path, "--json")
    command_line = strict(python.stdout)
    assert ran.returncode == python.code == (0 if mass_kg == "12.992" else 3)
    loaded, log = cdprcal.load_robot(str(robot)), cdprcal.read_log(str(log_path))
    library = calibration_as_dict(loaded, cdprcal.calibrate(loaded, log))
    # As many unknowns, but less certain: only where the robot file is wrong.
    blind = cdprcal.calibrate(loaded, log, cdprcal.CalibrateOptions(allow_for_effects=False)).result
    allowed_for = library["standard_deviation"][2] > 1.5 * blind.standard_deviation[2]
    assert allowed_for == (mass_kg != "12.992")
    for document in (cpp, command_line, library):
        del document["solve_time_s"]
    assert cpp == common_part(cpp, command_line) == common_part(cpp, library)


def common_part(wanted: Any, given: Any) -> Any:
    """Of what is given, the fields that the other document has."""
    if isinstance(wanted, dict):
        return {key: common_part(value, given[key]) for key, value in wanted.items()}
    if isinstance(wanted, list) and len(wanted) == len(given):
        return [common_part(*pair) for pair in zip(wanted, given, strict=True)]
    return given


def test_calibrate_at_times_by_hand(cli: Cli, log_path: Path) -> None:
    times = [2.0, 10.0, 18.0, 26.0, 34.0, 42.0, 50.0, 58.0]
    ran = cli(
        "calibrate", "irma4", log_path, "--json", "--method", "static",
        "--at", ",".join(map(str, times)),
    )  # fmt: skip
    result = ran.document()
    assert result["reference_time_s"] == 2.0
    assert [pose["time_s"] for pose in result["poses"]] == times
    assert result["equilibria"] == []


def test_trial_a(cli: Cli, shared_data: Path) -> None:
    record = json.loads((shared_data / "irma4" / "trial_a.json").read_text())
    ran = cli(
        "calibrate", "irma4", shared_data / "irma4" / "trial_a.csv", "--json",
        "--formulation", "paper", "--method", "static",
        "--at", ",".join(map(str, record["times_s"])),
    )  # fmt: skip
    result = ran.document()
    assert result["cost"] == pytest.approx(14.942858, abs=1e-5)
    pose = result["initial_pose"]
    np.testing.assert_allclose(
        pose["position_m"] + pose["euler_rad"],
        record["recorded_solution_initial_pose"],
        atol=1e-5,
        rtol=0,
    )


def test_the_measured_raw_log_is_not_taken_for_solved(cli: Cli, shared_data: Path) -> None:
    """Its swivel angles have another sign than the model: a small cost is not to be had."""
    ran = cli(
        "calibrate", "irma4", shared_data / "irma4" / "sc_8_final.log", "--json",
        "--method", "static",
    )  # fmt: skip
    result = ran.document(1)
    assert result["status"] != "converged"
    assert "swivel" in result["reason"]


def test_the_answer_goes_to_stdout(cli: Cli, log_path: Path) -> None:
    ran = cli("calibrate", "irma4", log_path)
    assert (ran.code, ran.stderr) == (0, "")
    assert re.match(r"x -?\d\.\d{4}, y .* m ± \d+\.\d+ mm; roll .*° ± \d\.\d{3}°\n", ran.stdout)
    for words in ("converged:", "initial pose at 0.000 s", "swivel angle", "static"):
        assert words in ran.stdout


def test_the_result_file_holds_the_result_and_its_inputs(
    cli: Cli, log_path: Path, tmp_path: Path
) -> None:
    path = tmp_path / "result.json"
    ran = cli("calibrate", "irma4", log_path, "--json", "-o", path)
    document = strict(path.read_text())
    inputs = document.pop("inputs")
    assert document.keys() == strict(ran.stdout).keys()
    assert cdprcal.parse_robot(inputs["robot"], "again").name == "irma4"
    assert [log["name"] for log in inputs["logs"]] == [str(log_path)]
    assert (inputs["method"], inputs["formulation"]) == ("unified", "full")


def test_an_unobservable_pose_is_exit_1_and_still_json(
    cli: Cli, log: cdprcal.Log, tmp_path: Path
) -> None:
    path = tmp_path / "poor.csv"
    poor = changed(log, swivel_rad=None, tension_N=None)
    cdprcal.write_log(poor, str(path))
    ran = cli("calibrate", "irma4", path, "--json", "--method", "kinematic", "--at", "1,10")
    result = strict(ran.stdout)
    assert (ran.code, result["status"]) == (1, "unobservable")
    assert result["covariance"] is None
    assert result["standard_deviation"] == [None] * 6
    assert cli("calibrate", "irma4", path, "--method", "kinematic", "--at", "1,10").code == 1


@pytest.mark.parametrize("kind", ["csv", "mcap", "raw"])
def test_a_log_of_any_kind_is_taken_whatever_its_name(
    cli: Cli, log: cdprcal.Log, log_path: Path, tmp_path: Path, kind: str
) -> None:
    path = tmp_path / "log.txt"
    if kind == "csv":
        log_path.rename(path)
    elif kind == "mcap":
        assert cli("import", log_path, "-o", tmp_path / "x.mcap").code == 0
        (tmp_path / "x.mcap").rename(path)
    else:
        path.write_text(raw_text(log))
    assert cli("check", "irma4", path).code == 0
    ran = cli("calibrate", "irma4", path, "--json")
    assert ran.document()["status"] == "converged"
    assert cli("import", path, "-o", tmp_path / "again.csv").code == 0
    again = cdprcal.read_log(str(tmp_path / "again.csv"))
    np.testing.assert_array_equal(again.length_m, log.length_m)


def test_import_says_what_it_left_out(cli: Cli, log: cdprcal.Log, tmp_path: Path) -> None:
    path = tmp_path / "robot.log"
    path.write_text(raw_text(log)[:-5])
    ran = cli("import", path, "-o", tmp_path / "out.csv")
    assert ran.code == 0
    assert "out.csv" in ran.stdout
    assert f"the last line, {6 * len(log)}, has no end" in ran.stderr
    lines = raw_text(log).splitlines(keepends=True)
    path.write_text("".join(lines + lines[:6]))
    ran = cli("import", path, "-o", tmp_path / "out.csv", "--force")
    assert ran.code == 1
    assert "time goes back" in ran.stderr
    assert len(cdprcal.read_log(str(tmp_path / "out.csv"))) == len(log)


def test_check_json(cli: Cli, log: cdprcal.Log, tmp_path: Path) -> None:
    tension = np.array(log.tension_N)
    tension[100:130, 2] = 0.4
    path = tmp_path / "slack.csv"
    cdprcal.write_log(changed(log, tension_N=tension), str(path))
    ran = cli("check", "irma4", path, "--json")
    assert (ran.code, ran.stderr) == (1, "")
    report = strict(ran.stdout)
    assert report["trusted"] is False
    assert (
        report["segments"]
        == [{"begin_s": 0.0, "end_s": pytest.approx(60.0), "samples": 601, "run": True}]
        or report["segments"][0]["run"]
    )
    (finding,) = report["findings"]
    assert finding["severity"] == "error"
    assert finding["code"] == "slack"
    assert finding["line"] == 102
    assert (finding["time_s"], finding["end_s"]) == (
        pytest.approx(log.time_s[100]),
        pytest.approx(log.time_s[129]),
    )
    for_people = cli("check", "irma4", path)
    assert (for_people.code, for_people.stderr) == (1, "")
    assert "cable 3 is slack" in for_people.stdout
    assert for_people.stdout.startswith(f"{path} cannot be trusted: 1 error")


def test_generate_makes_what_calibrate_recovers(cli: Cli, tmp_path: Path) -> None:
    log, truth = tmp_path / "made.csv", tmp_path / "truth.json"
    ran = cli("generate", "irma4", "-o", log, "--truth", truth, "--seed", 3, "--grid", "2x2x2")
    assert (ran.code, ran.stderr) == (0, "")
    assert cli("check", "irma4", log).code == 0
    result = strict(cli("calibrate", "irma4", log, "--json").stdout)
    assert result["status"] == "converged"
    true = strict(truth.read_text())["poses"][0]
    error = np.subtract(result["initial_pose"]["position_m"], true["position_m"])
    deviation = np.sqrt(np.diag(result["covariance"])[:3])
    assert np.all(np.abs(error) < 4.0 * deviation)
    assert np.all(deviation < 1e-3)  # the noise is a tenth of sigma, and means of 50 are taken
    first = log.read_bytes()
    cli("generate", "irma4", "-o", log, "--seed", 3, "--grid", "2x2x2", "--force")
    assert log.read_bytes() == first
    cli("generate", "irma4", "-o", log, "--seed", 4, "--grid", "2x2x2", "--force")
    assert log.read_bytes() != first


def test_generate_goes_through_a_plan(cli: Cli, tmp_path: Path) -> None:
    """Where the grid around the middle of the frame has no equilibria, a box is in the way."""
    robot, plan, log = tmp_path / "keep.yaml", tmp_path / "plan.csv", tmp_path / "made.csv"
    box = "keep_out: [{lower_m: [-0.15, -0.15, 0.0], upper_m: [0.15, 0.15, 0.75]}]\n"
    robot.write_text(cdprcal.builtin_robot_yaml("irma4") + box)
    places = ("--position=0.3,0.3,1.1", "--position=-0.3,0.3,1.2", "--position=0.3,-0.3,1.15")
    assert cli("plan", robot, "-o", plan, *places).code == 0
    ran = cli("generate", robot, "--plan", plan, "-o", log, "--seed", 3)
    assert (ran.code, ran.stderr) == (0, "")
    the_plan = cdprcal.read_plan(str(plan))
    setpoints = np.unique(cdprcal.read_log(str(log)).tension_setpoint_N, axis=0)
    for stop in the_plan.poses:
        assert np.abs(setpoints - stop.tension_N).max(axis=1).min() < 1e-6
    assert cli("calibrate", robot, log).code == 0
    assert_no = cli("generate", robot, "--plan", plan, "--grid", "2x2x2", "-o", tmp_path / "b.csv")
    assert (assert_no.code, assert_no.stdout) == (2, "")
    assert "leave out --grid" in assert_no.stderr
    ran = cli("generate", "ring5", "--plan", plan, "-o", tmp_path / "b.csv")
    ran.refused("is of robot irma4, not of ring5")


def test_generate_says_what_to_do_where_it_fits_no_grid_or_does_not_keep_clear(
    cli: Cli, tmp_path: Path
) -> None:
    robot, log = tmp_path / "shut.yaml", tmp_path / "made.csv"
    yaml = cdprcal.builtin_robot_yaml("irma4")
    robot.write_text(f"{yaml}floor_m: 5\n")
    ran = cli("generate", robot, "-o", log)
    assert ran.code == 2
    assert ran.stderr.endswith("; let cdprcal plan find places, and give its file with --plan\n"), (
        ran.stderr
    )
    assert not log.exists()
    assert cli("generate", "irma4", "-o", log, "--truth", tmp_path / "truth.json").code == 0
    poses = json.loads((tmp_path / "truth.json").read_text())["poses"]
    between = poses[75]["position_m"]  # halfway from the first stop to the second
    box = [[value + by for value in between] for by in (-0.01, 0.01)]
    robot.write_text(f"{yaml}keep_out: [{{lower_m: {box[0]}, upper_m: {box[1]}}}]\n")
    ran = cli("generate", robot, "-o", log, "--force")
    assert ran.code == 0
    assert re.search(r"note: at 7\.\d s something is in the way .* --plan\n", ran.stderr)


def program(*arguments: object, **options: Any) -> subprocess.CompletedProcess[str]:
    return executed([sys.executable, "-m", "cdprcal", *map(str, arguments)], timeout=60, **options)


@pytest.mark.alone
def test_help_answers_at_once() -> None:
    """Best of five, in processor time, which is what a user waits for on a machine of their own."""
    times = []
    for _ in range(5):
        begin = os.times()
        ran = program("--help")
        end = os.times()
        used_s = end.children_user - begin.children_user
        times.append(used_s + end.children_system - begin.children_system)
    assert ran.returncode == 0
    for command in ("import", "check", "calibrate", "generate"):
        assert command in ran.stdout
    assert min(times) < 0.3


def test_help_and_page_name_the_same_commands_with_caveats(cli: Cli) -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "commands.md").read_text("utf-8")
    for text in (cli("--help").stdout, page):
        _, _, caveats = " ".join(text.replace("`", "").split()).partition("2 wrong use, 3 ")
        for command in ("calibrate", "track", "acquire --until", "geometry"):
            assert command in caveats.partition("but with caveats")[0]


def test_every_command_has_help(cli: Cli) -> None:
    for command in ("import", "check", "calibrate", "generate"):
        ran = cli(command, "--help")
        assert (ran.code, ran.stderr) == (0, "")
        assert "Usage" in ran.stdout


def test_the_version_and_those_of_the_libraries_are_told(cli: Cli) -> None:
    ran = cli("--version")
    assert (ran.code, ran.stderr) == (0, "")
    lines = ran.stdout.splitlines()
    assert lines[0] == f"cdprcal {version('cdprcal')}"
    assert f"numpy {np.__version__}" in lines[1]
    for library in ("Boost", "CGAL", "Ceres", "Eigen", "NLopt", "pybind11", "simdjson", "yaml-cpp"):
        assert re.search(rf"\b{library} \d+\.\d+", lines[2])
    assert re.search(r"built with \w+ \d+\.\d+", lines[3])


@pytest.mark.parametrize(
    ("shell", "typed"),
    [
        ("bash", {"COMP_WORDS": "cdprcal cali", "COMP_CWORD": "1"}),
        ("zsh", {"_TYPER_COMPLETE_ARGS": "cdprcal cali"}),
        (
            "fish",
            {"_TYPER_COMPLETE_ARGS": "cdprcal cali", "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
        ),
    ],
)
def test_a_shell_completes_commands(shell: str, typed: dict[str, str]) -> None:
    ran = executed(
        [sys.executable, "-c", "import cdprcal.cli; cdprcal.cli.app(prog_name='cdprcal')"],
        check=True,
        env={**os.environ, **typed, "_CDPRCAL_COMPLETE": f"complete_{shell}"},
    )
    assert "calibrate" in ran.stdout
    assert "diagnose" not in ran.stdout


def test_help_loads_neither_numpy_nor_the_core() -> None:
    code = (
        "import sys, cdprcal.cli; "
        "heavy = {'numpy', 'rich', 'mcap', 'cdprcal._core'} & set(sys.modules); "
        "sys.exit(str(heavy) if heavy else 0)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_reader_that_goes_away_is_no_traceback(log_path: Path) -> None:
    command = f"'{sys.executable}' -m cdprcal calibrate irma4 '{log_path}' --json | head -c 1"
    ran = executed(["bash", "-c", command], timeout=60)
    assert ran.stdout == "{"
    assert "Traceback" not in ran.stderr
    assert "Exception" not in ran.stderr


def test_a_terminal_that_knows_ascii_only_is_no_problem(log_path: Path) -> None:
    environment = os.environ | {"PYTHONIOENCODING": "ascii", "LC_ALL": "C", "PYTHONUTF8": "0"}
    ran = program("calibrate", "irma4", log_path, env=environment)
    assert ran.returncode == 0
    assert "converged" in ran.stdout
    assert ran.stdout.isascii()
    assert "mm; roll" in ran.stdout.splitlines()[0]
    assert " +- " in ran.stdout.splitlines()[0]


def wait_until_idle(pid: int) -> None:
    """Returns when a process that has begun to work waits for something outside, however busy the
    machine is: it sleeps, and uses no processor time for a second."""
    used, since, begun = "", time.monotonic(), time.monotonic()
    while time.monotonic() - begun < 60.0:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        if state[0] != "S" or " ".join(state[11:13]) != used or state[11] == "0":
            used, since = " ".join(state[11:13]), time.monotonic()
        elif time.monotonic() - since > 1.0:
            return
        time.sleep(0.05)
    raise AssertionError("the process did not come to rest")


def test_ctrl_c_ends_without_a_traceback(tmp_path: Path) -> None:
    process, reader = waiting(tmp_path)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=20)
    os.close(reader)
    assert process.returncode == 130
    assert (out, err) == ("", "cdprcal: interrupted\n")


def waiting(folder: Path) -> tuple[subprocess.Popen[str], int]:
    """A command that waits for whoever reads its output, and a reader that does not."""
    pipe = folder / "slow.csv"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    process = subprocess.Popen(
        [sys.executable, "-m", "cdprcal", "generate", "ring3", "-o", str(pipe)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(folder)},
    )
    wait_until_idle(process.pid)
    return process, reader


def test_sigterm_leaves_nothing_behind(tmp_path: Path) -> None:
    process, reader = waiting(tmp_path)
    assert len(list(tmp_path.iterdir())) == 2  # what is being copied into the pipe
    process.terminate()
    out, err = process.communicate(timeout=20)
    os.close(reader)
    assert (process.returncode, out, err) == (143, "", "")
    assert [path.name for path in tmp_path.iterdir()] == ["slow.csv"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_while_modules_are_loaded_ends_quietly(number: signal.Signals) -> None:
    """No exception, which a module that is half loaded would make another one of."""
    program = f"""
import os
from cdprcal.interrupt import loaded, watch
watch()
LOADED
try:
    os.kill(os.getpid(), {int(number)})
except SystemExit:
    print("raised")
    raise
"""
    for at, out in (("", ""), ("loaded()", "raised\n")):
        ran = executed([sys.executable, "-c", program.replace("LOADED", at)], timeout=60)
        assert (ran.returncode, ran.stdout, ran.stderr) == (128 + number, out, "")


@pytest.mark.parametrize("delay_s", [0.06, 0.1, 0.15, 0.2, 0.3])
def test_ctrl_c_at_the_very_start_ends_in_one_line(delay_s: float) -> None:
    """However far modules are loaded by then; until the first of ours runs it is Python's."""
    process = subprocess.Popen(
        [sys.executable, "-X", "importtime", "-m", "cdprcal", "demo", "--help"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr
    for line in process.stderr:  # which is written as modules are loaded
        if "cdprcal.streams" in line:  # the first that is loaded once the signal is ours
            break
    time.sleep(delay_s - 0.06)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert "Traceback" not in err
    # It may have been done, or Python was on its way out and passed the signal on.
    assert process.returncode in (0, 130, -signal.SIGINT)
