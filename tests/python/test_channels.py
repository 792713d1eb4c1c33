"""Sensors and channels are data: who adds one names it in few files, as docs/extend/sensor.md does
for show, and everything follows."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal.io import load_log, save_log
from cdprcal.results import residual_as_dict
from cdprcal.schemas import schema
from cdprcal.sensors import ABSOLUTE, CHANNELS, LOG_GROUPS, OPTIONS, SENSORS, columns_of
from conftest import TABLE_II_TENSIONS_N, Cli
from scripts import executed

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def log(robot: cdprcal.Robot) -> cdprcal.Log:
    options = cdprcal.SyntheticLogOptions(
        noise=cdprcal.reading_noise(robot.sigma, 0.1, absolute=True), seed=5
    )
    setpoints = [np.array(tension_N) for tension_N in TABLE_II_TENSIONS_N[:4]]
    return cdprcal.synthetic_log(robot, setpoints, options).log


def naming(name: str) -> list[str]:
    """The files of the product that name a channel."""
    folders = ("cpp/cdprcal", "bindings", "python/cdprcal")
    files = (path for folder in folders for path in sorted((ROOT / folder).rglob("*.*")))
    frames = (ROOT / "cpp/cdprcal/frame", ROOT / "python/cdprcal/cli/geometry.py")
    return [
        path.relative_to(ROOT).as_posix()
        for path in files
        if path.suffix in (".cpp", ".hpp", ".py", ".pyi", ".json", ".html", ".js")
        and not any(path.is_relative_to(frame) for frame in frames)  # found from whole lengths
        and name in path.read_text(encoding="utf-8")
    ]


@pytest.mark.parametrize("name", ["absolute_yaw", "direct_length"])
def test_a_channel_is_named_in_few_files(name: str) -> None:
    assert len(naming(name)) <= 6


@pytest.mark.parametrize("field", LOG_GROUPS)
def test_a_log_holds_it(field: str, log: cdprcal.Log, tmp_path: Path) -> None:
    group = LOG_GROUPS[field]
    values = getattr(log, field)
    assert values.shape[1] == group.columns_of(log.cable_count)
    one = cdprcal.Log(time_s=log.time_s, **{field: values})
    np.testing.assert_array_equal(getattr(one, field), values)
    assert cdprcal.format_log(one).splitlines()[0].split(",")[1:] == columns_of(
        group, log.cable_count
    )
    for suffix in (".csv", ".mcap"):
        path = tmp_path / f"one{suffix}"
        save_log(one, path)
        np.testing.assert_array_equal(getattr(load_log(path).log, field), values)


@pytest.mark.parametrize("channel", ABSOLUTE.values(), ids=lambda c: c.name)
def test_what_few_robots_have_is_there_by_name(
    channel: cdprcal.ChannelRow, robot: cdprcal.Robot, log: cdprcal.Log
) -> None:
    field = channel.sensor.field
    assert channel.sensor.sigma_field
    assert getattr(cdprcal.SensorSigma(**{channel.sensor.sigma_field: 0.5}), field) == 0.5
    assert getattr(cdprcal.ReadingNoise(**{field: 0.5}), field) == 0.5
    assert np.isnan(getattr(cdprcal.ReadingNoise(), field))
    measurement = cdprcal.measurement_at(log, 3, cdprcal.PoseKind.static_pose, robot.cable_count)
    given = {field: getattr(measurement, field)}
    same = cdprcal.Measurement(
        time_s=0.0,
        kind=cdprcal.PoseKind.static_pose,
        length_m=measurement.length_m,
        swivel_rad=measurement.swivel_rad,
        tension_N=measurement.tension_N,
        roll_pitch_yaw_rad=measurement.roll_pitch_yaw_rad,
        **given,
    )
    np.testing.assert_array_equal(getattr(same, field), given[field])
    for wrong in ({field: "text"}, {"height_of_nobody_m": 1.0}):
        with pytest.raises(TypeError, match=next(iter(wrong)) if field in wrong else "known are"):
            cdprcal.Log(time_s=log.time_s, **wrong)


def test_wrong_shapes_are_input_errors(log: cdprcal.Log) -> None:
    for field in SENSORS:
        given: dict[str, Any] = {field: np.zeros((3, 2))}
        with pytest.raises(cdprcal.InputError, match=re.escape(field)):
            cdprcal.Log(time_s=log.time_s, **given)


def test_results_and_schemas_show_it_where_it_was_read(
    robot: cdprcal.Robot, log: cdprcal.Log
) -> None:
    result = cdprcal.calibrate(robot, log).result
    residual = schema("diagnose")["properties"]["residuals"]["properties"]["before"]["items"]
    rms = schema("calibrate")["properties"]["residual_rms"]["properties"]
    for channel in CHANNELS.values():
        assert channel.rms_field in rms
        assert channel.sensor.field in residual["properties"]
        if channel.name == "angular_velocity":
            continue  # which says nothing of a pose
        if channel.name != "balance":  # which has a rms of its own, of forces and of moments
            assert np.isfinite(getattr(result.residual_rms, channel.rms_field)), channel.name
        assert channel.sensor.field in residual_as_dict(result.residuals[0])
    paper: dict[str, Any] = {f: getattr(log, f) for f in SENSORS if not SENSORS[f].is_absolute}
    without = cdprcal.Log(time_s=log.time_s, **paper)
    shown = residual_as_dict(cdprcal.calibrate(robot, without).result.residuals[0])
    assert not shown.keys() & {channel.sensor.field for channel in ABSOLUTE.values()}


@pytest.mark.parametrize("option", OPTIONS)
def test_generate_takes_it_alone(option: str, cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "one.csv"
    cli("generate", "irma4", "--sensors", option, "--grid", "1x1x2", "-o", path)
    groups = {field for field in SENSORS if getattr(load_log(path).log, field).shape[1]}
    assert groups == {OPTIONS[option]}


def test_noise_of_a_result_names_every_channel(log_path: Path, cli: Cli) -> None:
    document = json.loads(cli("calibrate", "irma4", log_path, "--json").stdout)
    assert list(document["noise"]) == sorted(name for name in CHANNELS if name not in ABSOLUTE)


PAGE = (ROOT / "docs" / "extend" / "sensor.md").read_text(encoding="utf-8")
SECTION = PAGE.split("\n## A sensor inside the estimator\n", 1)[1]
CHANGES = re.findall(r"`(\S+)`:\n\n```diff\n(.*?)```", SECTION, re.DOTALL)
PROGRAM = Path(__file__).with_name("show_channel.cpp")
#: What it takes to read a log, to evaluate a pose and to write its rows.
SOURCES = (
    *("geometry/euler", "geometry/pose", "kinematics/cable", "kinematics/platform", "statistics"),
    *("model/sensors", "readings/equilibrium_detection", "readings/log", "readings/log_columns"),
    *("readings/fresh", "readings/log_checks", "readings/odd_readings", "readings/signal"),
    *("readings/measurement", "readings/noise", "effects/pose_evaluation"),
    *("text", "text_file", "singular_values"),
    *("statics/inertial_wrench", "statics/wrench", "estimation/row_batch", "lanes/processor"),
)


def changed(text: str, diff: str) -> str:
    """The text with the changes of one block; @@ alone in a line parts them."""
    for hunk in diff.split("@@\n"):
        lines = hunk.splitlines(keepends=True)
        before = "".join(line[1:] for line in lines if line[0] in " -")
        after = "".join(line[1:] for line in lines if line[0] in " +")
        assert text.count(before) == 1, f"not there, or not once:\n{before}"
        text = text.replace(before, after)
    return text


def test_it_touches_few_files() -> None:
    listed = re.findall(r"^\| `([^`]+)` \|", SECTION, re.MULTILINE)
    assert {name for name, _ in CHANGES} < set(listed)
    assert len(listed) <= 6
    assert all((ROOT / name).is_file() for name in listed)


def test_what_the_page_says_compiles_and_works(tmp_path: Path) -> None:
    compiler = shutil.which("g++")
    eigen = Path("/usr/include/eigen3")
    if compiler is None or not eigen.is_dir():
        pytest.skip("needs g++ and Eigen")
    for name, diff in CHANGES:
        path = tmp_path / Path(name).relative_to("cpp")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(changed((ROOT / name).read_text(encoding="utf-8"), diff), encoding="utf-8")
    folders = (tmp_path / "cdprcal", ROOT / "cpp" / "cdprcal")
    sources = [
        next(path for folder in folders if (path := folder / f"{name}.cpp").is_file())
        for name in SOURCES
    ]
    program = tmp_path / "show"
    # Together, so that what nearly all of them include is compiled once.
    together = tmp_path / "together.cpp"
    together.write_text("".join(f'#include "{path}"\n' for path in (*sources, PROGRAM)), "utf-8")
    command = [compiler, "-std=c++20", "-O0", f"-I{tmp_path}", f"-I{ROOT / 'cpp'}"]
    command += ["-isystem", str(eigen), str(together), "-o", str(program)]
    ran = executed(command)
    assert ran.returncode == 0, ran.stderr[-3000:]
    shown = executed([program])
    assert shown.returncode == 0, shown.stdout + shown.stderr
