"""The API as people write it: paths and words in, results that show, pickle and become frames."""

from __future__ import annotations

import ast
import builtins
import copy
import doctest
import enum
import inspect
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal import Log, Robot, _core, calls
from cdprcal.copying import PLAIN, fields_of
from conftest import changed
from raw_files import german_excel
from scripts import executed


def test_paths_and_words_do_what_objects_and_enums_do(
    robot: Robot, log: Log, log_path: Path
) -> None:
    options = cdprcal.CalibrateOptions(
        method=cdprcal.Method.statics, noise=cdprcal.NoiseSource.specified
    )
    plain = cdprcal.calibrate(robot, log, options)
    for found in (
        cdprcal.calibrate("irma4", log_path, method="static", noise="specified"),
        cdprcal.calibrate("irma4", str(log_path), options),
        cdprcal.calibrate(robot, log, method=cdprcal.Method.statics, noise="specified"),
        cdprcal.calibrate("irma4", log_path, cdprcal.CalibrateOptions(
            method=cdprcal.Method.kinematic), method="static", noise="specified"),
    ):  # fmt: skip
        assert found.kinematic_poses == 0
        np.testing.assert_allclose(
            found.result.poses[0].position_m, plain.result.poses[0].position_m, atol=1e-9
        )
    named = cdprcal.calibrate("irma4", log_path, at_s=[2.0, 10.0, 18.0, 26.0, 34.0], segment=0)
    assert named.equilibria == []
    with pytest.raises(cdprcal.InputError, match="'fast'"):
        cdprcal.calibrate("irma4", log_path, method="fast")
    with pytest.raises(cdprcal.InputError, match="log: is a int; give a Log, the path"):
        cdprcal.calibrate("irma4", 3)


def test_files_are_named_by_paths_too(robot: Robot, log: Log, tmp_path: Path) -> None:
    cdprcal.write_log(log, tmp_path / "a.csv")
    np.testing.assert_array_equal(cdprcal.read_log(tmp_path / "a.csv").length_m, log.length_m)
    plan = cdprcal.make_plan(robot, grid=[2, 1, 1]).plan
    cdprcal.write_plan(plan, tmp_path / "plan.csv")
    assert cdprcal.read_plan(tmp_path / "plan.csv").measured_count == plan.measured_count


def test_what_is_masked_is_not_read(log: Log) -> None:
    mask = np.zeros(log.length_m.shape, dtype=bool)
    mask[3:5, 1] = True
    length_m = np.ma.masked_array(log.length_m, mask)
    whole = np.ma.masked_array(np.full(mask.shape, 9999), mask)  # integers have no NaN
    read = Log(time_s=log.time_s, length_m=length_m, swivel_rad=whole, direct_length_m=length_m)
    for values in (read.length_m, read.swivel_rad, read.direct_length_m):
        np.testing.assert_array_equal(np.isnan(values), mask)
    np.testing.assert_array_equal(read.length_m[~mask], log.length_m[~mask])


@pytest.mark.parametrize("kind", ["datetime64[ms]", "timedelta64[us]"])
def test_dates_are_no_seconds(log: Log, kind: str) -> None:
    time = np.arange(log.time_s.size).astype(kind)
    with pytest.raises(cdprcal.InputError, match=r"counts no seconds: give numbers"):
        Log(time_s=time, length_m=log.length_m)
    log = Log(time_s=(time - time[0]) / np.timedelta64(1, "s"), length_m=log.length_m)
    assert log.time_s[1] == (1e-3 if "ms" in kind else 1e-6)


def test_the_module_says_its_version() -> None:
    assert cdprcal.__version__ == version("cdprcal")


def test_a_start_up_is_simulated_with_words(robot: Robot, tmp_path: Path) -> None:
    plan = cdprcal.make_plan(robot, grid=[2, 1, 1]).plan
    cdprcal.write_plan(plan, str(tmp_path / "plan.csv"))
    stops_N = [plan.start_tension_N, *(stop.tension_N for stop in plan.poses)]
    via = [False, *(not stop.measured for stop in plan.poses)]
    mass = cdprcal.parse_injected_effect("mass=0.7")
    core = _core.simulate_startup(
        robot,
        cdprcal.StartUpPlan(stops_N, [], via),
        simulator=cdprcal.SimulatorOptions(seed=3, effects=[mass]),
    )
    options = cdprcal.SimulatorOptions(effects=[mass])
    for run in (
        cdprcal.simulate_startup("irma4", tmp_path / "plan.csv", effects=["mass=0.7"], seed=3),
        cdprcal.simulate_startup(robot, plan, effects=[mass], seed=3),
        cdprcal.simulate_startup(robot, plan, simulator=options, seed=3),
    ):
        assert cdprcal.format_log(run.log) == cdprcal.format_log(core.log)
    other = cdprcal.simulate_startup(robot, plan, seed=3)
    assert cdprcal.format_log(other.log) != cdprcal.format_log(core.log)
    with pytest.raises(cdprcal.InputError, match="nonsense"):
        cdprcal.simulate_startup(robot, plan, effects=["nonsense=1"])


def test_a_simulated_start_up_hears_ctrl_c(robot: Robot) -> None:
    plan = cdprcal.make_plan(robot, grid=[2, 2, 2]).plan
    options = cdprcal.SimulatorOptions(step_s=1e-5)  # it takes half a minute
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    # As at a terminal: who starts the tests in the background may have SIGINT ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        timer.start()
        begin_s = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            cdprcal.simulate_startup(robot, plan, simulator=options)
        assert time.monotonic() - begin_s < 5.0
    finally:
        signal.signal(signal.SIGINT, before)


def test_one_log_several_logs_and_files_of_any_kind(
    log: Log, log_path: Path, tmp_path: Path
) -> None:
    from cdprcal.mapping import propose_file

    raw, the_map = german_excel(log, tmp_path), tmp_path / "map.yaml"
    the_map.write_text(propose_file(raw).text())
    for logs, map_ in ((log_path, ""), ([log_path], ""), (log, ""), (raw, the_map)):
        assert cdprcal.diagnose("irma4", logs, map=map_).verdict == cdprcal.Verdict.consistent
    assert cdprcal.calibrate("irma4", raw, map=the_map).result.poses


def test_results_show_what_there_is_to_know(robot: Robot, log: Log) -> None:
    found = cdprcal.calibrate(robot, log)
    assert repr(found).startswith("<Calibration converged: x ")
    assert " mm; roll " in repr(found)
    assert repr(cdprcal.diagnose(robot, log)) == ("<Diagnosis consistent: no effect found>")
    planned = cdprcal.make_plan(robot)
    assert repr(planned).startswith("<PlanResult 8 measured poses, 2 min ")
    few = cdprcal.calibrate(robot, log, method="kinematic", at_s=[2.0])
    assert repr(few).startswith("<Calibration unobservable: ")


def test_members_of_enums_are_called_as_on_the_command_line() -> None:
    assert str(cdprcal.Verdict.explained) == "explained"
    assert f"{cdprcal.Method.statics}" == "static"
    assert cdprcal.parse_method(str(cdprcal.Method.statics)) == cdprcal.Method.statics
    assert str(cdprcal.NoiseSource.from_data) == "data"
    for order in cdprcal.VisitingOrder:
        assert cdprcal.parse_visiting_order(str(order)) == order
    for form in cdprcal.Formulation:
        assert cdprcal.parse_formulation(str(form)) == form
    for member in cdprcal.StabilityNotion:
        assert str(member) == member.name.replace("_", "-")


def test_members_of_enums_are_words() -> None:
    kinds = [k for k in vars(_core).values() if isinstance(k, type) and issubclass(k, enum.Enum)]
    assert len(kinds) > 15
    for kind in kinds:
        for member in kind:
            assert pickle.loads(pickle.dumps(member)) is member
            assert copy.deepcopy(member) is member
            assert kind[member.name] is member
            if kind is cdprcal.PointStatus:  # of arrays of numbers
                assert str(member) == member.name
                continue
            assert member == member.value == str(member) == f"{member}"
            assert kind(member.value) is member
            assert json.dumps({"is": member}) == f'{{"is": "{member.value}"}}'
    assert cdprcal.Verdict.explained == "explained"
    assert cdprcal.Method("static") is cdprcal.Method.statics
    with pytest.raises(ValueError, match="'fast' is not a valid Method"):
        cdprcal.Method("fast")


def test_enums_of_the_core_are_exact(robot: Robot) -> None:
    """A word alone, or a member of another enum, is not taken for a member."""
    assert robot.euler_convention is cdprcal.EulerConvention.XYZ
    options = cdprcal.CalibrateOptions(method=cdprcal.Method.kinematic)
    assert options.method is cdprcal.Method.kinematic
    for wrong in ("kinematic", cdprcal.PoseKind.kinematic_pose, 2):
        with pytest.raises(TypeError):
            options.method = wrong  # type: ignore[assignment]


def test_logs_plans_and_results_pickle(robot: Robot, synthetic: cdprcal.SyntheticLog) -> None:
    bare = changed(synthetic.log, swivel_rad=None)
    for log in (synthetic.log, bare):
        again = pickle.loads(pickle.dumps(log))
        assert cdprcal.format_log(again) == cdprcal.format_log(log)
        assert again.source == log.source
        assert cdprcal.format_log(copy.deepcopy(log)) == cdprcal.format_log(log)
    plan = cdprcal.make_plan(robot).plan
    assert cdprcal.format_plan(pickle.loads(pickle.dumps(plan))) == cdprcal.format_plan(plan)
    found = cdprcal.calibrate(robot, synthetic.log, method="kinematic")
    again = pickle.loads(pickle.dumps(found))
    assert (again.static_poses, again.kinematic_poses) == (0, found.kinematic_poses)
    np.testing.assert_allclose(
        again.result.poses[0].position_m, found.result.poses[0].position_m, atol=1e-9
    )
    diagnosis = pickle.loads(pickle.dumps(cdprcal.diagnose(robot, synthetic.log)))
    assert diagnosis.verdict == cdprcal.Verdict.consistent
    with pytest.raises(TypeError, match=r"make it with cdprcal\.calibrate"):
        pickle.dumps(_core.calibrate(robot, synthetic.log))
    assert pickle.loads(pickle.dumps(cdprcal.load_robot)) is cdprcal.load_robot


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_every_protocol_of_pickle(robot: Robot, protocol: int) -> None:
    pose = cdprcal.Pose.from_euler([0.1, 0.2, 0.3], [0.1, -0.2, 0.3])
    again = pickle.loads(pickle.dumps((robot, pose, robot.sigma), protocol))
    assert cdprcal.to_yaml(again[0]) == cdprcal.to_yaml(robot)
    assert (again[1].rotation == pose.rotation).all()
    assert again[2].length_m == robot.sigma.length_m
    # The old protocols make instances of the base, where pybind11 would abort.
    with pytest.raises(TypeError):
        pickle.dumps(cdprcal.RandomNormal(1), protocol)


def test_options_are_copied_pickled_and_solved_with_again(robot: Robot, log: Log) -> None:
    options = cdprcal.CalibrateOptions(
        method=cdprcal.Method.statics,
        noise=cdprcal.NoiseSource.specified,
        allow_for_effects=False,
        at_s=[2.0, 10.0, 18.0, 26.0],
        detection=cdprcal.DetectionOptions(window_s=1.5),
        solve=cdprcal.SolveOptions(max_iterations=77, explain=False),
        most_starts=3,
    )
    for again in (copy.deepcopy(options), pickle.loads(pickle.dumps(options))):
        assert (again.at_s, again.most_starts) == (options.at_s, 3)
        assert (again.detection.window_s, again.solve.max_iterations) == (1.5, 77)
        assert not again.allow_for_effects
    found = cdprcal.calibrate(robot, log, options)
    assert found.static_poses == 4
    solved = pickle.loads(pickle.dumps(found))
    assert solved.static_poses == 4
    assert solved.result.least_observed == found.result.least_observed
    usual = cdprcal.calibrate(robot, log, method="static").result
    assert usual.least_observed != found.result.least_observed, "this tests nothing"


def test_a_diagnosis_keeps_its_options(robot: Robot, log: Log) -> None:
    off = changed(log, tension_N=np.array(log.tension_N) + 5.0)
    options = cdprcal.DiagnoseOptions(most_effects=0, draws=99, seed=5)
    assert cdprcal.diagnose(robot, off).effects
    again = pickle.loads(pickle.dumps(cdprcal.diagnose(robot, off, options)))
    assert again.effects == []
    copied = copy.copy(options)
    assert (copied.draws, copied.seed, copied.effects) == (99, 5, None)


def test_frames_hold_what_the_objects_hold(robot: Robot, log: Log) -> None:
    pandas = pytest.importorskip("pandas")
    frame = log.to_pandas()
    assert list(frame.columns[:3]) == ["time_s", "length_1_m", "length_2_m"]
    assert len(frame) == len(log)
    back = Log.from_dataframe(frame)
    assert cdprcal.format_log(back) == cdprcal.format_log(log)
    indexed = Log.from_dataframe(frame.set_index("time_s"), source="mine")
    assert (indexed.source, len(indexed)) == ("mine", len(log))
    found = cdprcal.calibrate(robot, frame)
    poses = found.to_pandas()
    assert list(poses.columns) == [
        "time_s", "x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg", "kind"
    ]  # fmt: skip
    assert poses.x_m[0] == found.result.poses[0].position_m[0]
    assert set(poses.kind) == {"static", "kinematic"}
    assert "<table" in found._repr_html_()
    off = changed(log, tension_N=np.array(log.tension_N) + np.array([6.0, -5.0, 4.0, -8.0]))
    effects = cdprcal.diagnose(robot, off).to_pandas()
    assert list(effects.effect.unique()) == ["load_cell_bias"]
    np.testing.assert_allclose(effects.value, [6.0, -5.0, 4.0, -8.0], atol=0.5)
    assert len(cdprcal.make_plan(robot).plan.to_pandas()) == 8
    with pytest.raises(cdprcal.InputError, match="has length_1_m but no length_2_m"):
        Log.from_dataframe(frame.drop(columns="length_2_m"))
    with pytest.raises(cdprcal.InputError, match="no column of a log but a; name them"):
        Log.from_dataframe(pandas.DataFrame({"a": [1.0, 2.0]}))


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("tension_1_N", "Tension_1_N"),
        ("length_1_m", "length_9_m"),
        ("length_1_m", "length_0_m"),
        ("roll_rad", "roll_deg"),
        ("swivel_2_rad", "swivel_2"),
    ],
)
def test_a_misspelt_column_is_not_left_out(log: Log, right: str, wrong: str) -> None:
    frame = log.to_pandas()
    for columns in (frame.rename(columns={right: wrong}), frame.assign(**{wrong: 0.0})):
        with pytest.raises(cdprcal.InputError, match=f"column '{wrong}' is none of a log"):
            Log.from_dataframe(columns)
    beside = frame.assign(comment="fine", temperature_C=20.0, rolling=0.0)
    assert len(Log.from_dataframe(beside)) == len(frame)


def test_text_in_a_frame_is_named_by_its_column(log: Log) -> None:
    frame = log.to_pandas()
    for name, words in (("length_3_m", "column length_3_m"), ("time_s", "time_s")):
        with pytest.raises(cdprcal.InputError, match=f"data frame: {words}: holds what is no numb"):
            Log.from_dataframe(frame.astype({name: object}).assign(**{name: "far"}))


@pytest.mark.parametrize("unit", ["ns", "us", "ms"])
def test_times_of_a_frame_may_be_dates_and_durations(log: Log, unit: str) -> None:
    pandas = pytest.importorskip("pandas")
    frame = log.to_pandas()
    time_s, rest = frame.time_s, frame.drop(columns="time_s")
    durations = pandas.TimedeltaIndex(pandas.to_timedelta(time_s, unit="s")).as_unit(unit)
    dates = pandas.Timestamp("2026-03-01") + durations
    for times in (durations, dates, dates.tz_localize("Europe/Zurich")):
        for given in (rest.set_index(times), rest.assign(time_s=times)):
            log = Log.from_dataframe(given)
            np.testing.assert_allclose(log.time_s, time_s - time_s[0], atol=1e-9)
    absent = frame.convert_dtypes().astype({"tension_1_N": "Float64"})
    absent.loc[3, "tension_1_N"] = pandas.NA
    assert np.isnan(Log.from_dataframe(absent).tension_N[3, 0])


def test_without_pandas_it_is_named(log: Log, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(cdprcal.InputError, match=r"pip install 'cdprcal\[pandas\]'"):
        log.to_pandas()
    assert log._repr_html_().startswith("<p>Log(source=")


SEEN = """
import copy, pickle, cdprcal
options = cdprcal.CalibrateOptions(at_s=[1.0])
print(copy.copy(options).at_s, pickle.loads(pickle.dumps(options)).at_s)
"""


def test_options_pickle_before_anything_else_is_used() -> None:
    ran = executed([sys.executable, "-c", SEEN], check=True)
    assert ran.stdout == "[1.0] [1.0]\n"


def different(value: Any) -> Any:
    """Another value of the kind of an attribute."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float) and not isinstance(value, enum.Enum):
        return value + 1 if np.isfinite(value) else 0.5
    return value


def plain_values(robot: Robot) -> dict[type, Any]:
    """One of every class that is copied as what it is made from, where it needs arguments."""
    pose = cdprcal.Pose([0.1, 0.2, 0.3], np.eye(3))
    return {
        cdprcal.AppliedEffect: cdprcal.AppliedEffect(
            name="mass", parameters={"mass_error_kg": [0.5]}, run="run.csv"
        ),
        cdprcal.Cable: robot.cables[0],
        cdprcal.Mesh: cdprcal.Mesh(np.eye(3), [[0, 1, 2]]),
        cdprcal.Platform: robot.platform,
        cdprcal.Pulley: robot.cables[1].pulley,
        cdprcal.Box: cdprcal.Box([0.0, 0.0, 0.0], [1.0, 2.0, 3.0]),
        cdprcal.InjectedEffect: cdprcal.InjectedEffect("mass", [0.5]),
        cdprcal.AskedAccuracy: cdprcal.AskedAccuracy(position_m=0.01, rotation_rad=0.02),
        cdprcal.ReadingOffsets: cdprcal.ReadingOffsets(
            length_m=[1.0, 2.0], swivel_rad=[0.1, 0.2], yaw_rad=0.3
        ),
        cdprcal.SampleRange: cdprcal.SampleRange(3, 8),
        cdprcal.SensorSigma: robot.sigma,
        cdprcal.SetPoint: cdprcal.SetPoint(pose, [1.0, 2.0, 3.0, 4.0]),
        cdprcal.StartUpPlan: cdprcal.StartUpPlan([[1.0, 2.0, 3.0, 4.0]]),
        cdprcal.ReadingNoise: cdprcal.reading_noise(robot.sigma, 0.1, absolute=True),
    }


@pytest.mark.parametrize("kind", PLAIN, ids=lambda kind: kind.__name__)
def test_plain_values_keep_every_field(robot: Robot, kind: type) -> None:
    made = plain_values(robot).get(kind) or kind()
    taken, settable = fields_of(kind)
    for name in settable:
        setattr(made, name, different(getattr(made, name)))
    for protocol in (2, pickle.HIGHEST_PROTOCOL):
        for again in (copy.copy(made), pickle.loads(pickle.dumps(made, protocol))):
            assert type(again) is kind
            assert again is not made
            for name in (n for n, v in vars(kind).items() if isinstance(v, property)):
                old, new = getattr(made, name), getattr(again, name)
                if type(old) not in PLAIN and not isinstance(old, cdprcal.Pose | list):
                    np.testing.assert_array_equal(np.asarray(new), np.asarray(old), name)
    assert {*taken, *settable} <= set(dir(kind))


def test_options_within_options_keep_theirs() -> None:
    solve = cdprcal.SolveOptions()
    solve.settled = 1e-3
    options = cdprcal.CalibrateOptions(solve=solve)
    assert copy.deepcopy(options).solve.settled == 1e-3
    simulator = cdprcal.SimulatorOptions()
    simulator.winch.time_constant_s = 0.7
    simulator.effects = [cdprcal.InjectedEffect("mass", [0.5])]
    again = pickle.loads(pickle.dumps(simulator))
    assert again.winch.time_constant_s == 0.7
    assert [effect.name for effect in again.effects] == ["mass"]


def test_a_simulation_leaves_its_options_alone(robot: Robot) -> None:
    options = cdprcal.SimulatorOptions()
    plan = cdprcal.StartUpPlan(cdprcal.default_setpoints(robot, 1, 1, 2))
    for effects in ("mass=0.5", cdprcal.InjectedEffect("mass", [0.5]), ["mass=0.5"]):
        cdprcal.simulate_startup(
            robot, plan, simulator=options, seed=99, effects=effects, progress=lambda *_: False
        )
    assert (options.seed, options.effects) == (cdprcal.SimulatorOptions().seed, [])


def test_a_track_wants_the_robot_that_was_calibrated(robot: Robot, log: Log) -> None:
    found = cdprcal.calibrate(robot, log)
    assert len(cdprcal.track("irma4", log, found)) == len(log)
    with pytest.raises(cdprcal.InputError, match="give the robot that was calibrated"):
        cdprcal.track("ring3", log, found)


def test_pictures_go_into_the_axes_given(robot: Robot, log: Log) -> None:
    from matplotlib.figure import Figure

    off = changed(log, tension_N=np.array(log.tension_N) + 5.0)
    for result in (
        log,
        cdprcal.calibrate(robot, log),
        cdprcal.diagnose(robot, off),
        cdprcal.make_plan(robot).plan,
    ):
        ax = Figure().subplots()
        assert result.plot(ax=ax) is ax
        assert ax.lines
        assert ax.get_ylabel()
        assert result.plot().lines


def test_every_function_has_a_signature() -> None:
    names = [name for name in dir(cdprcal) if name[0] != "_" and callable(getattr(cdprcal, name))]
    functions = [name for name in names if not inspect.isclass(getattr(cdprcal, name))]
    assert len(functions) > 100
    for name in functions:
        function: Any = getattr(cdprcal, name)
        signature = inspect.signature(function)
        assert function.__doc__, name
        assert signature.return_annotation is not inspect.Signature.empty, name
    planned = inspect.signature(cdprcal.make_plan).parameters
    assert planned["visits"].default == 2
    assert planned["visits"].kind is inspect.Parameter.KEYWORD_ONLY


def test_the_examples_in_docstrings_hold(log_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(log_path.parent)
    assert doctest.testmod(calls).failed == 0


def test_a_star_imports_what_people_use() -> None:
    names: dict[str, Any] = {}
    exec("from cdprcal import *", names)
    assert names["calibrate"] is cdprcal.calibrate
    assert names["Log"] is _core.Log
    assert not {"Any", "annotations", "TYPE_CHECKING"} & names.keys()
    assert not (names.keys() - {"__builtins__"}) & vars(builtins).keys()


EXAMPLES = Path(__file__).resolve().parents[2] / "docs" / "api" / "examples.md"


def session() -> str:
    """What the page of examples types, and what it is answered."""
    text = EXAMPLES.read_text(encoding="utf-8")
    return "\n\n".join(re.findall(r"^```pycon\n(.*?)^```$", text, re.M | re.S))


def test_the_page_of_examples_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    test = doctest.DocTestParser().get_doctest(session(), {}, "examples", str(EXAMPLES), 0)
    assert len(test.examples) > 120
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    kept = np.get_printoptions()
    try:
        runner.run(test, out=said.append)
    finally:
        np.set_printoptions(**kept)
    assert runner.failures == 0, "".join(said)


def test_every_function_has_an_example() -> None:
    called = {
        node.func.attr
        for example in doctest.DocTestParser().get_examples(session())
        for node in ast.walk(ast.parse(example.source))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id == "cdprcal"
    }
    functions = {
        name
        for name in dir(cdprcal)
        if name[0] != "_"
        and callable(getattr(cdprcal, name))
        and not inspect.isclass(getattr(cdprcal, name))
    }
    assert functions - called == set(), "show them in docs/api/examples.md"


def out_of_reach(robot: Robot, log: Log) -> dict[str, Any]:
    """Calls with numbers that are not there, by what the message has to say."""
    rest = cdprcal.PoseKind.static_pose
    point = cdprcal.SetPoint(cdprcal.Pose(), np.full(3, 100.0))
    position = next(s for s in cdprcal.log_groups() if s.field == "position_m")
    simulator = cdprcal.Simulator(robot)
    last_but_one = cdprcal.CalibrateOptions(segment=-2)
    beyond, rests = cdprcal.SampleRange(0, 10**9), cdprcal.detect_equilibria(log)
    short = Log(time_s=log.time_s[:5], length_m=log.length_m[:5])
    return {
        "cable_count: 9": lambda: cdprcal.random_offsets(9, cdprcal.RandomNormal(1)),
        "cable_count: -1": lambda: cdprcal.random_offsets(-1, cdprcal.RandomNormal(1)),
        "cable_count: is 9": lambda: cdprcal.measurement_at(log, 0, rest, 9),
        "cable_count: is 3": lambda: cdprcal.measurement_mean(
            log, cdprcal.SampleRange(0, 5), rest, 3
        ),
        "range: must hold": lambda: cdprcal.measurement_mean(
            log, cdprcal.SampleRange(0, 0), rest, 4
        ),
        "range: rows 0 to 1000000000": lambda: cdprcal.fresh_rows(log.length_m, 0, 10**9),
        "range: rows -5 to 10": lambda: cdprcal.fresh_rows(log.length_m, -5, 10),
        "range: rows 5 to 2": lambda: cdprcal.fresh_rows(log.length_m, 5, 2),
        "index: 3 is no column": lambda: position.column(3),
        "index: -1 is no column": lambda: position.column(-1),
        "set_point.tension_N: has 3": lambda: cdprcal.settling_deviation(robot, point),
        "start.tension_N: has 3": lambda: cdprcal.predicted_covariance(robot, point, []),
        "range: [0, 1000000000)": lambda: cdprcal.signals(log, beyond, [], robot.sigma),
        "range: [-3, 5)": lambda: cdprcal.signals(log, cdprcal.SampleRange(-3, 5), [], robot.sigma),
        f"range: [{rests[-1].samples.begin}, ": lambda: cdprcal.signals(
            short, cdprcal.SampleRange(0, 5), rests[-1:], robot.sigma
        ),
        "segment -2 asked for": lambda: cdprcal.prepare(robot, log, last_but_one),
        "advance: a duration": lambda: simulator.advance(float("inf")),
        "push: must be finite": lambda: simulator.push([np.nan] * 3, [0.0] * 3),
        "the log has 4 cables": lambda: cdprcal.with_known_effects(
            cdprcal.load_robot("ring3"), log
        ),
        "window_s: must be": lambda: cdprcal.detect_equilibria(
            log, options=cdprcal.DetectionOptions(window_s=0.0)
        ),
    }


def test_numbers_that_are_not_there_are_refused(robot: Robot, log: Log) -> None:
    """Some of them ended the interpreter, or read what stands beside an array."""
    for message, call in out_of_reach(robot, log).items():
        with pytest.raises(cdprcal.InputError, match=re.escape(message)):
            call()


SCRIPT = """
import cdprcal

found = cdprcal.calibrate("irma4", "run.csv", method="static")
x_m: float = found.result.poses[0].position_m[0]
diagnosis = cdprcal.diagnose("irma4", ["run.csv"])
verdict: cdprcal.Verdict = diagnosis.verdict
frame = found.to_pandas()
axes = diagnosis.plot(ax=None)
log = cdprcal.Log.from_dataframe(frame)
count: int = log.cable_count
"""


def test_a_users_script_passes_strict_mypy(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    root = Path(cdprcal.__file__).parents[1]
    command = [sys.executable, "-m", "mypy", "--strict", str(script)]
    # Installed, it is found as any package is; a source tree has to be named.
    env = dict(os.environ) if root.name == "site-packages" else os.environ | {"MYPYPATH": str(root)}

    def run() -> subprocess.CompletedProcess[str]:
        return executed(command, cwd=tmp_path, env=env, timeout=300)

    assert (ran := run()).returncode == 0, ran.stdout
    script.write_text(SCRIPT.replace("method=", "methods="))
    assert run().returncode == 1
