"""Every format that is written is read again: the same numbers to the last bit, the same bytes."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

import cdprcal
from cdprcal import InputError
from cdprcal.hardware.session import Session, load_session, parse_session
from cdprcal.io import AcquisitionInputs, load_log, read_inputs, save_log
from cdprcal.io.acquisition_inputs import as_comments
from cdprcal.io.result_file import calibrate_options_as_dict, load_result, save_result
from cdprcal.results import calibration_as_dict
from random_robots import random_robot

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
GROUPS = {
    "length_m": 0,
    "swivel_rad": 0,
    "tension_N": 0,
    "tension_setpoint_N": 0,
    "direct_length_m": 0,
    "roll_pitch_yaw_rad": 3,
    "absolute_yaw_rad": 1,
    "position_m": 3,
}
#: Any double but infinities; what is written with sixteen digits and what with one.
numbers = st.floats(allow_infinity=False) | st.integers(-5, 5).map(float)
#: Names as people give them; no line breaks of any alphabet are left out.
texts = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=30)


def assert_same_log(a: cdprcal.Log, b: cdprcal.Log) -> None:
    np.testing.assert_array_equal(a.time_s, b.time_s)
    for name in GROUPS:
        one, two = getattr(a, name), getattr(b, name)
        np.testing.assert_array_equal(one, two, err_msg=name)
        assert np.array_equal(np.signbit(one), np.signbit(two)) or np.isnan(one).any()


@st.composite
def logs(draw: st.DrawFn) -> cdprcal.Log:
    cables, samples = draw(st.integers(1, 8)), draw(st.integers(1, 4))
    times = st.lists(st.floats(-1e9, 1e9), min_size=samples, max_size=samples, unique=True)
    arrays: dict[str, Any] = {}
    for name, width in GROUPS.items():
        if draw(st.booleans()):
            row = st.lists(numbers, min_size=width or cables, max_size=width or cables)
            arrays[name] = np.array(draw(st.lists(row, min_size=samples, max_size=samples)))
    return cdprcal.Log(time_s=sorted(draw(times)), **arrays)


@settings(max_examples=60, deadline=None)
@given(log=logs())
def test_csv_log(log: cdprcal.Log) -> None:
    text = cdprcal.format_log(log)
    again = cdprcal.parse_log(text, "again")
    assert_same_log(again, log)
    assert cdprcal.format_log(again) == text


@settings(max_examples=60, deadline=None)
@given(log=logs())
def test_mcap_log(log: cdprcal.Log, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.getbasetemp() / "round.mcap"
    read = np.array([any(np.isfinite(getattr(log, name)[i]).any() for name in GROUPS)
                     for i in range(len(log))])  # fmt: skip
    save_log(log, path)
    if not read.any():
        with pytest.raises(InputError, match="no JSON messages"):
            load_log(path)
        return
    again = load_log(path).log
    np.testing.assert_array_equal(again.time_s, log.time_s)
    for name in GROUPS:
        before = getattr(log, name)
        # A sensor that never answered has no key in any message.
        if np.isfinite(before).any():
            np.testing.assert_array_equal(getattr(again, name), before, err_msg=name)
    first = path.read_bytes()
    save_log(again, path)
    if all(np.isfinite(getattr(log, name)).any() for name in GROUPS if getattr(log, name).size):
        assert path.read_bytes() == first


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32), cables=st.integers(1, 8), name=texts)
def test_robot_file(seed: int, cables: int, name: str) -> None:
    random = np.random.default_rng(seed)
    try:
        robot = random_robot(random, cables, name=name)
        text = cdprcal.to_yaml(robot)
    except InputError:
        return  # a name that no robot may have
    again = cdprcal.parse_robot(text, "again")
    assert cdprcal.to_yaml(again) == text
    assert again.name == robot.name
    assert again.gravity_m_s2 == robot.gravity_m_s2
    np.testing.assert_array_equal(again.tension_limits_N, robot.tension_limits_N)
    for field in ("mass_kg", "centre_of_mass_m", "inertia_kg_m2"):
        np.testing.assert_array_equal(
            getattr(again.platform, field), getattr(robot.platform, field)
        )
    for one, two in zip(again.cables, robot.cables, strict=True):
        np.testing.assert_array_equal(one.platform_anchor_m, two.platform_anchor_m)
        for field in ("radius_m", "position_m", "x_axis", "swivel_axis"):
            np.testing.assert_array_equal(getattr(one.pulley, field), getattr(two.pulley, field))
    assert again.euler_convention == robot.euler_convention


@pytest.mark.parametrize("effect", [e.name for e in cdprcal.effect_catalogue()])
def test_robot_file_with_every_effect(effect: str, robot: cdprcal.Robot) -> None:
    injected = next((e for e in cdprcal.injectable_effects() if e["name"] == effect), None)
    if injected is None:
        pytest.skip("has no continuous parameters")
    random = np.random.default_rng(7)
    values = []
    for parameter, shape in injected["parameters"]:
        sizes = {"n": robot.cable_count}
        size = [] if shape == "scalar" else [sizes.get(n) or int(n) for n in shape.split(",")]
        values.append(
            f"    {parameter}: {np.asarray(random.uniform(1e-3, 2e-3, size=size)).tolist()}"
        )
    text = cdprcal.to_yaml(robot) + f"effects:\n  - name: {effect}\n" + "\n".join(values) + "\n"
    try:
        listed = cdprcal.parse_robot(text, "listed")
    except InputError as error:
        pytest.skip(str(error))
    again = cdprcal.to_yaml(listed)
    assert effect in again
    assert cdprcal.to_yaml(cdprcal.parse_robot(again, "again")) == again


@settings(max_examples=60, deadline=None)
@given(data=st.data(), cables=st.integers(1, 8), stops=st.integers(1, 4), modes=st.integers(0, 6))
def test_plan_file(data: st.DataObject, cables: int, stops: int, modes: int) -> None:
    positive, any_time = st.floats(1e-300, 1e300), st.floats(0.0, 1e9)
    finite = st.floats(allow_nan=False, allow_infinity=False)

    def row(numbers: st.SearchStrategy[float], count: int) -> str:
        drawn = data.draw(st.lists(numbers, min_size=count, max_size=count))
        return ",".join(repr(x) for x in drawn)

    def quaternion() -> str:
        q = np.array(data.draw(st.lists(st.floats(-1, 1), min_size=4, max_size=4)))
        length = np.linalg.norm(q)
        q = q / length if length > 1e-3 else np.array([1.0, 0.0, 0.0, 0.0])
        return ",".join(repr(x) for x in q.tolist())

    names = [
        "purpose,position_x_m,position_y_m,position_z_m",
        "quaternion_w,quaternion_x,quaternion_y,quaternion_z",
        *(f"tension_{i + 1}_N" for i in range(cables)),
        "transition_s,dwell_s",
        *(f"natural_frequency_{i + 1}_hz" for i in range(modes)),
    ]
    lines = [
        "# cdprcal plan",
        "# robot: r, with a comma",
        f"# start_tension_N: {row(positive, cables)}",
        f"# start_position_m: {row(finite, 3)}",
        f"# start_quaternion_wxyz: {quaternion()}",
        f"# start_dwell_s: {row(any_time, 1)}",
        f"# stops: {stops}",
        f"# predicted_standard_deviation_m_rad: {row(positive, 6)}",
        ",".join(names),
    ]
    for _ in range(stops):
        purpose = data.draw(st.sampled_from(["measure", "via"]))
        cells = [purpose, row(finite, 3), quaternion(), row(positive, cables), row(any_time, 2)]
        lines.append(",".join(cells + ([row(any_time, modes)] if modes else [])))
    plan = cdprcal.parse_plan("\n".join(lines) + "\n", "drawn")
    text = cdprcal.format_plan(plan)
    again = cdprcal.parse_plan(text, "again")
    assert cdprcal.format_plan(again) == text
    drawn = [float(x) for x in lines[2].split(":")[1].split(",")]
    assert again.start_tension_N.tolist() == drawn
    for line, stop in zip(lines[9:], again.poses, strict=True):
        cells = line.split(",")
        assert stop.pose.position_m.tolist() == [float(x) for x in cells[1:4]]
        assert stop.tension_N.tolist() == [float(x) for x in cells[8 : 8 + cables]]
        assert stop.transition_s == float(cells[8 + cables])
        assert stop.measured == (cells[0] == "measure")


def test_result_file(robot: cdprcal.Robot, log: cdprcal.Log, tmp_path: Path) -> None:
    options = cdprcal.CalibrateOptions(at_s=[1.5, 9.5, 17.5, 25.5])
    document = calibration_as_dict(robot, cdprcal.calibrate(robot, log, options))
    first, second = tmp_path / "first.json", tmp_path / "second.json"
    plain = calibrate_options_as_dict(options)
    save_result(first, "calibrate", document, robot, [log], plain)
    read = load_result(first)
    assert read.document == json.loads(json.dumps(document))
    assert read.options == plain
    assert cdprcal.to_yaml(read.robot) == cdprcal.to_yaml(robot)
    assert_same_log(read.logs[0], log)
    save_result(second, read.command, read.document, read.robot, read.logs, read.options)
    assert second.read_bytes() == first.read_bytes()


@pytest.mark.parametrize("name", ["canopen-simulated.yaml", "canopen-two-processes.yaml"])
def test_session_file(name: str) -> None:
    session = load_session(EXAMPLES / name)
    assert parse_session(written(session), "again") == session


def written(session: Session) -> str:
    """A session as YAML text, every field of it."""
    stream = io.StringIO()
    YAML(typ="safe", pure=True).dump(session.model_dump(mode="json", exclude_none=True), stream)
    return stream.getvalue()


@settings(max_examples=60, deadline=None)
@given(rate=st.floats(50, 1000), scale=st.floats(1e-300, 1e300), zero=st.floats(-1e300, 1e300))
def test_session_numbers(rate: float, scale: float, zero: float) -> None:
    session = load_session(EXAMPLES / "canopen-simulated.yaml")
    plain = session.model_dump(mode="json", exclude_none=True)
    plain["rate_Hz"] = rate
    plain["winches"][0]["counts_per_m"] = scale
    plain["winches"][0]["load_cell"]["zero_counts"] = zero
    changed = Session.model_validate(plain)
    assert parse_session(written(changed), "again") == changed


@settings(max_examples=100, deadline=None)
@given(robot=texts, plan=texts, key=texts, value=numbers)
def test_what_a_log_was_acquired_with(
    robot: str, plan: str, key: str, value: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    settings_ = {"x" + key: value if np.isfinite(value) else None}
    inputs = AcquisitionInputs(f"name: {robot}\n", f"# {plan}\n", settings_)
    path = tmp_path_factory.getbasetemp() / "acquired.csv"
    path.write_bytes(as_comments(inputs) + b"time_s,length_1_m\n0,1\n")
    assert read_inputs(path) == inputs
    assert len(load_log(path).log) == 1
