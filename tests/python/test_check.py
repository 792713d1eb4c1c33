"""Each fault injected into a good log is found, by name, place and severity, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal import InputError, Log, Robot
from cdprcal.check import CheckReport, check_file, check_log
from cdprcal.io import LogFile
from cdprcal.sensors import SENSORS
from conftest import changed

Array = np.ndarray


def check(robot: Robot, log: Log, segment: int = -1) -> CheckReport:
    return check_log(robot, LogFile(Path("made.csv"), "csv", log), segment)


def found(report: CheckReport) -> set[tuple[str, str]]:
    return {(finding.severity, finding.code) for finding in report.findings}


def edited(log: Log, name: str, edit: Callable[[Array], object]) -> Log:
    """A copy of a log with one array edited in place."""
    values = np.array(getattr(log, name))
    edit(values)
    return changed(log, **{name: values})


def test_a_good_log_is_trusted(robot: Robot, log: Log) -> None:
    report = check(robot, log)
    assert report.findings == ()
    assert report.trusted
    assert len(report.equilibria) == 8


def test_what_the_robot_lists_is_taken_into_account(robot: Robot, log: Log) -> None:
    bias = np.array([-60.0, 10.0, 150.0, 0.0])
    log = edited(log, "tension_N", lambda t: t.__iadd__(bias))
    log = edited(log, "length_m", lambda length: length.__imul__(1000.0))
    codes = {code for _, code in found(check(robot, log))}
    assert {"impossible_value", "slack"} <= codes
    listing = cdprcal.parse_robot(
        cdprcal.to_yaml(robot) + "effects:\n  - {name: length_unit, factor: 0.001}\n"
        f"  - {{name: load_cell_bias, bias_N: {bias.tolist()}}}\n",
        "listing",
    )
    report = check(listing, log)
    assert report.findings == ()
    assert report.robot is listing


FAULTS: dict[str, tuple[str, Callable[[Array], None], set[tuple[str, str]], str | None]] = {
    "slack": (
        "tension_N",
        lambda t: t.__setitem__((slice(100, 130), 2), 0.4),
        {("error", "slack")},
        "tension_3_N",
    ),
    "one slack sample": (
        "tension_N",
        lambda t: t.__setitem__((100, 2), 0.4),
        {("warning", "slack")},
        "tension_3_N",
    ),
    "saturated at the limit": (
        "tension_N",
        lambda t: t.__setitem__((slice(100, 130), 0), 400.0),
        {("error", "saturated_tension")},
        "tension_1_N",
    ),
    "clipped below the limit": (
        "tension_N",
        lambda t: np.minimum(t, 150.0, out=t),
        {("error", "saturated_tension")},
        None,
    ),
    "below the limit": (
        "tension_N",
        lambda t: t.__setitem__((slice(100, 110), 1), 15.0),
        {("warning", "tension_outside_limits")},
        "tension_2_N",
    ),
    "set-point beyond the limit": (
        "tension_setpoint_N",
        lambda t: t.__setitem__((slice(100, 110), 1), 500.0),
        {("warning", "setpoint_outside_limits")},
        "tension_setpoint_2_N",
    ),
    "stuck encoder": (
        "length_m",
        lambda v: v.__setitem__((slice(150, None), 3), v[150, 3]),
        {("error", "stuck_sensor")},
        "length_4_m",
    ),
    "stuck from the start": (
        "swivel_rad",
        lambda v: v.__setitem__((slice(None), 0), 0.25),
        {("error", "stuck_sensor")},
        "swivel_1_rad",
    ),
    "locked winches": (  # the platform swings on: nothing is wrong with an encoder
        "length_m",
        lambda v: v.__setitem__(slice(150, None), v[150]),
        set(),
        "",
    ),
    "a pulley that shakes": (
        "swivel_rad",
        lambda v: v.__setitem__(
            (slice(200, 230), 2), v[200:230, 2] + 1.5 * np.sin(2.0 * np.arange(30.0))
        ),
        {("warning", "vibration")},
        "swivel_3_rad",
    ),
    "lost counts": (
        "length_m",
        lambda v: v.__setitem__((slice(200, None), 1), v[200:, 1] + 0.5),
        {("error", "jump")},
        "length_2_m",
    ),
    "attitude spike": (
        "roll_pitch_yaw_rad",
        lambda v: v.__setitem__((200, 0), 1.4),
        {("warning", "spike")},
        "roll_rad",
    ),
    "attitude in degrees": (
        "roll_pitch_yaw_rad",
        lambda v: np.rad2deg(v, out=v),
        {("error", "impossible_value")},
        "roll_rad",
    ),
    "lengths in millimetres": (
        "length_m",
        lambda v: np.multiply(v, 1000, out=v),
        {("error", "impossible_value")},
        "length_1_m",
    ),
    "swivel in degrees": (
        "swivel_rad",
        lambda v: np.rad2deg(v, out=v),
        {("error", "impossible_value")},
        "swivel_1_rad",
    ),
    "dropout": (
        "length_m",
        lambda v: v.__setitem__((slice(200, 230), 1), np.nan),
        {("warning", "dropout")},
        "length_2_m",
    ),
    "one dead swivel encoder": (
        "swivel_rad",
        lambda v: v.__setitem__((slice(None), 1), np.nan),
        {("warning", "missing_sensor")},
        "swivel_2_rad",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found(robot: Robot, log: Log, fault: str) -> None:
    name, edit, expected, channel = FAULTS[fault]
    report = check(robot, edited(log, name, edit))
    assert expected <= found(report)
    # A unit error also makes jumps; no other fault may be blamed on something else.
    assert found(report) - expected <= {("error", "jump"), ("warning", "sudden_change")}
    if fault not in ("attitude in degrees", "lengths in millimetres", "swivel in degrees"):
        assert found(report) == expected
    assert report.trusted == all(severity != "error" for severity, _ in expected)
    if channel:
        assert channel in {finding.channel for finding in report.findings}
    for finding in report.findings:
        assert finding.remedy
        assert finding.time_s is not None


COARSE = {
    "tension": ("tension_N", 1, 15.0, slice(240, 360)),
    "roll": ("roll_pitch_yaw_rad", 0, 0.8 * np.radians(2.0), slice(400, 520)),
    "length": ("length_m", 2, 0.05, slice(400, None)),
}


@pytest.mark.parametrize("sensor", COARSE)
@pytest.mark.parametrize("stuck", ["never", "a while", "always"])
def test_a_sensor_that_reads_in_coarse_steps_is_stuck_only_if_it_should_have_left_them(
    robot: Robot, log: Log, sensor: str, stuck: str
) -> None:
    name, column, step, a_while = COARSE[sensor]
    rows = {"never": slice(0), "a while": a_while, "always": slice(0, None)}[stuck]

    def spoil(values: Array) -> None:
        values[:, column] = step * np.round(values[:, column] / step)
        values[rows, column] = values[rows.start or 0, column]

    report = check(robot, edited(log, name, spoil))
    named = [finding.channel for finding in report.findings if finding.code == "stuck_sensor"]
    assert set(named) == (set() if stuck == "never" else {SENSORS[name].column(column)})
    if stuck == "never" and sensor != "length":  # lengths go on through their steps
        told = [signal.signal.resolution for signal in report.signals]
        alone = [finding.message for finding in report.findings]
        assert any(f"in steps of {step:.3g} " in message for message in alone) or step == (
            pytest.approx(max(told))
        )


@pytest.mark.parametrize("group", ["length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"])
@pytest.mark.parametrize("how", ["no columns", "empty cells"])
def test_a_missing_sensor_is_found(robot: Robot, log: Log, group: str, how: str) -> None:
    old = getattr(log, group)
    log = changed(log, **{group: None if how == "no columns" else np.full_like(old, np.nan)})
    report = check(robot, log)
    assert ("warning", "missing_sensor") in found(report)
    assert group in {finding.channel for finding in report.findings}
    assert report.trusted


def test_several_missing_sensors_are_one_sentence_of_what_there_is(robot: Robot, log: Log) -> None:
    without = changed(log, swivel_rad=None, tension_N=None)
    (finding,) = check(robot, without).findings
    assert finding.message == "no swivel angle and no cable tension was read in the run"
    assert finding.remedy == "the pose rests on cable lengths and attitude alone, without statics"


def test_without_lengths_and_swivels_nothing_can_be_done(robot: Robot, log: Log) -> None:
    report = check(robot, changed(log, length_m=None, swivel_rad=None))
    assert ("error", "missing_sensor") in found(report)


def shifted(log: Log, after: int, by: float) -> Log:
    time = np.array(log.time_s)
    time[after:] += by
    return changed(log, time_s=time)


def test_a_gap_starts_a_segment_and_the_last_is_the_run(robot: Robot, log: Log) -> None:
    late = shifted(log, 90, 30.0)
    report = check(robot, late)
    assert found(report) == {("warning", "gap")}
    assert report.findings[0].time_s == pytest.approx(late.time_s[90])
    assert [len(segment) for segment in report.segments] == [90, len(log) - 90]
    assert report.run == 1
    short = check(robot, shifted(log, 400, 30.0))
    assert ("warning", "short_run") in found(short)


def test_missing_samples_within_the_run_are_found(robot: Robot, log: Log) -> None:
    report = check(robot, shifted(log, 20, 1.0))
    assert found(report) == {("warning", "missing_samples")}


def test_too_little_of_a_run(robot: Robot, log: Log) -> None:
    names = (
        "time_s", "length_m", "swivel_rad", "tension_N", "tension_setpoint_N", "roll_pitch_yaw_rad"
    )  # fmt: skip
    few = Log(**{name: getattr(log, name)[:2] for name in names})
    assert ("error", "too_few_samples") in found(check(robot, few))
    one_pose = Log(**{name: getattr(log, name)[:35] for name in names})
    assert ("error", "too_few_poses") in found(check(robot, one_pose))
    # Winches locked, and a swing of a degree: that is a motion.
    time_s = np.arange(1000) / 100.0
    rest = log.roll_pitch_yaw_rad[10]
    angles = rest + np.radians(0.5) * np.sin(2.0 * np.pi * time_s)[:, None]
    angles += np.random.default_rng(1).normal(0.0, np.radians(0.005), angles.shape)
    still: dict[str, Any] = {
        name: np.tile(getattr(log, name)[10], (1000, 1)) for name in names[1:4]
    }
    swing = Log(time_s=time_s, roll_pitch_yaw_rad=angles, **still)
    assert ("error", "too_few_poses") not in found(check(robot, swing))


def test_another_robots_log_is_wrong_use(robot: Robot, log: Log) -> None:
    log = changed(
        log,
        **{
            name: getattr(log, name)[:, :3]
            for name in ("length_m", "swivel_rad", "tension_N", "tension_setpoint_N")
        },
    )
    with pytest.raises(InputError, match=r"has 3 cables, robot irma4 has 4"):
        check(robot, log)


@pytest.mark.parametrize("segment", [1, -2])
def test_a_segment_that_is_not_there_is_wrong_use(robot: Robot, log: Log, segment: int) -> None:
    with pytest.raises(InputError, match="--segment"):
        check(robot, log, segment)


def damaged(path: Path, edit: Callable[[list[bytes]], bytes]) -> Path:
    path.write_bytes(edit(path.read_bytes().splitlines(keepends=True)))
    return path


#: Edit, code, line; -1 is the line after the last sample, -2 the last sample's own.
DAMAGE: dict[str, tuple[Callable[[list[bytes]], bytes], str, int]] = {
    "NUL tail": (lambda rows: b"".join(rows) + b"\0" * 99, "nul_padding", -1),
    "NUL in between": (
        lambda rows: b"".join(rows[:50]) + b"\0" * 99 + b"".join(rows[50:]),
        "nul_padding",
        51,
    ),
    "cut": (lambda rows: b"".join(rows)[:-60], "truncated", -2),
    "clock went back": (
        lambda rows: b"".join(
            [*rows[:50], *(row[:-1] + b"0\n" for row in rows[30:40]), *rows[50:]]
        ),
        "time_not_increasing",
        51,
    ),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_csv_is_read_as_far_as_it_is_good(
    robot: Robot, log_path: Path, log: Log, damage: str
) -> None:
    edit, code, line = DAMAGE[damage]
    if line < 0:
        line += len(log) + 3
    report = check_file(robot, damaged(log_path, edit))
    assert found(report) == {("error", code)}
    assert report.findings[0].line == line
    assert len(report.file.log) >= len(log) - 1
    assert not report.trusted


def test_times_of_whole_seconds_are_no_clock_that_was_set(robot: Robot, log_path: Path) -> None:
    header, *rows = log_path.read_text().splitlines()
    cells = [row.split(",", 1) for row in rows]
    whole = [f"{int(float(time))},{rest}" for time, rest in cells]
    log_path.write_text("\n".join([header, *whole, ""]))
    finding = check_file(robot, log_path).findings[0]
    assert finding.code == "time_not_increasing"
    assert "rate_Hz" in finding.remedy


def test_the_line_of_a_finding_is_the_line_of_the_file(
    robot: Robot, log: Log, tmp_path: Path
) -> None:
    log = edited(log, "tension_N", lambda t: t.__setitem__((slice(100, 130), 2), 0.4))
    path = tmp_path / "slack.csv"
    path.write_text("# made by hand\n" + cdprcal.format_log(log))
    (finding,) = check_file(robot, path).findings
    assert finding.line == 103
    time = path.read_text().splitlines()[finding.line - 1].split(",")[0]
    assert float(time) == finding.time_s


def test_what_damage_does_not_explain_stays_an_error(robot: Robot, log_path: Path) -> None:
    rows = log_path.read_bytes().splitlines(keepends=True)
    rows[20] = rows[20].replace(b",", b",abc", 1)
    log_path.write_bytes(b"".join(rows) + b"\0")
    with pytest.raises(InputError):
        check_file(robot, log_path)


def test_measured_logs_have_a_gap_and_nothing_worse(robot: Robot, shared_data: Path) -> None:
    for name in ("sc_8_final.log", "sc_27_medium_a.log"):
        report = check_file(robot, shared_data / "irma4" / name)
        assert found(report) == {("warning", "gap")}
    assert check_file(robot, shared_data / "irma4" / "trial_a.csv").findings == ()


def test_attitude_that_counts_from_0_to_360_degrees_is_none_in_degrees(
    robot: Robot, log: Log
) -> None:
    wrapped = edited(log, "roll_pitch_yaw_rad", lambda a: np.mod(a, 2 * np.pi, out=a))
    assert np.ptp(wrapped.roll_pitch_yaw_rad[:, 0]) > 6.0, "this tests nothing"
    assert check(robot, wrapped).findings == ()
    small = edited(log, "roll_pitch_yaw_rad", lambda a: a.__imul__(180 / np.pi))
    assert ("error", "impossible_value") in found(check(robot, small))


def test_stamps_that_jitter_are_no_jumps(robot: Robot, log: Log) -> None:
    """Each off by up to 30 % of a period: rates over a short step are noise, not motion."""
    random = np.random.default_rng(3)
    jitter_s = 0.03 * random.uniform(-1.0, 1.0, log.time_s.size)
    jitter_s[0] = 0.0
    log = edited(log, "time_s", lambda t: t.__iadd__(jitter_s))
    assert np.all(np.diff(log.time_s) > 0.0), "this tests nothing"
    assert not [f for f in check(robot, log).findings if f.severity == "error"]


@pytest.mark.parametrize("late_s", [0.03, 0.06])
def test_stamps_of_a_busy_logger_are_no_jumps(robot: Robot, log: Log, late_s: float) -> None:
    """Now and then two rows come at once, and one is a period late and more."""
    random = np.random.default_rng(4)
    stamps = log.time_s + random.exponential(late_s, log.time_s.size)
    for i in range(1, stamps.size):
        stamps[i] = max(stamps[i], stamps[i - 1] + 2e-3)
    log = edited(log, "time_s", lambda t: np.copyto(t, stamps))
    assert not [f for f in check(robot, log).findings if f.severity == "error"]
    slipped = edited(log, "length_m", lambda lengths: lengths[300:, 1].__iadd__(0.5))
    assert {code for _, code in found(check(robot, slipped))} & {"jump", "vibration"}


def test_a_frame_whose_z_points_down_is_said_to_be_one(robot: Robot, log: Log) -> None:
    def turn_over(angles: Array) -> None:
        angles[:, 0] = (angles[:, 0] + 2.0 * np.pi) % (2.0 * np.pi) - np.pi

    report = check(robot, edited(log, "roll_pitch_yaw_rad", turn_over))
    assert found(report) == {("warning", "upside_down")}


def test_single_odd_readings_are_counted_and_rests_leave_them_out(robot: Robot, log: Log) -> None:
    random = np.random.default_rng(5)

    def spoil(lengths: np.ndarray) -> None:
        rows = random.choice(np.arange(10, len(lengths) - 10, 5), 12, replace=False)
        lengths[rows, 1] += random.choice([-1.0, 1.0], 12) * 0.3

    odd = edited(log, "length_m", spoil)
    report = check(robot, odd)
    assert report.trusted
    (spikes,) = (f for f in report.findings if f.code == "spike")
    assert spikes.message.startswith("12 single readings of length_2_m")
    clean, spoilt = (cdprcal.calibrate(robot, one).result for one in (log, odd))
    assert spoilt.status == cdprcal.CalibrationStatus.converged
    apart = cdprcal.minus(spoilt.poses[0], clean.poses[0])
    assert np.all(np.abs(apart) < clean.standard_deviation)


def test_milliseconds_are_one_finding(robot: Robot, log: Log) -> None:
    """Not a gap a sample: what is wrong is said once, with what it probably is."""
    log = edited(log, "time_s", lambda t: t.__imul__(1000.0))
    findings = check(robot, log).findings
    assert {finding.code for finding in findings} == {"impossible_value", "too_few_samples"}
    (time,) = (finding for finding in findings if finding.channel == "time_s")
    assert time.severity == "error"
    assert "milliseconds" in time.remedy
    assert "100 s" in time.message


def test_differences_between_listed_rests_are_no_noise(robot: Robot, log: Log) -> None:
    """One row a rest: tensions differ by tens of newtons from row to row, and no cable is slack."""
    rests = cdprcal.calibrate(robot, log).equilibria
    middle_s = [0.5 * (rest.begin_s + rest.end_s) for rest in rests]
    rows = np.searchsorted(log.time_s, middle_s)
    groups = ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
    read = {name: getattr(log, name)[rows] for name in groups}
    log = Log(time_s=10.0 * np.arange(len(rows)), **read)
    assert check(robot, log).findings == ()
    log = edited(log, "tension_N", lambda t: t.__setitem__((slice(2, 4), 1), 0.5))
    (finding,) = check(robot, log).findings
    assert finding.code == "slack"
    assert " at 2 rests, down to 0.5 N" in finding.message


@pytest.mark.parametrize("rows", [slice(100, 130), slice(5, None, 40)], ids=["once", "scattered"])
@pytest.mark.parametrize(
    ("number", "code", "said"),
    [
        (-999.0, "missing_mark", "tension_2_N holds -999 ("),
        (-77.0, "impossible_value", "tension_2_N is -77 N in "),  # nothing that people use so
    ],
)
def test_a_number_that_stands_for_no_reading_is_no_slack_cable(
    robot: Robot, log: Log, rows: slice, number: float, code: str, said: str
) -> None:
    log = edited(log, "tension_N", lambda t: t.__setitem__((rows, 1), number))
    (finding,) = check(robot, log).findings
    assert (finding.severity, finding.code) == ("error", code)
    assert finding.message.startswith(said)
    assert "cells empty" in finding.remedy
    assert finding in cdprcal.calibrate(robot, log).caveats


def test_a_load_cell_with_its_sign_reversed_is_no_slack_cable(robot: Robot, log: Log) -> None:
    log = edited(log, "tension_N", lambda t: t[:, 2].__imul__(-1.0))
    report = check(robot, log)
    assert found(report) == {("error", "impossible_value")}
    (finding,) = report.findings
    assert finding.channel == "tension_3_N"
    assert "sign reversed" in finding.remedy
