"""Anybody's files: a map is proposed, at most two lines are corrected, a pose comes out."""

from __future__ import annotations

import gzip
import json
import math
import re
import sys
import zipfile
from collections.abc import Callable, Iterable
from datetime import datetime, timedelta
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal import Log, Robot, sensors
from cdprcal.io import LogFile, load_log, save_log
from cdprcal.io.marks import marks_in
from cdprcal.mapping import Line, Proposal, load_mapped, parse_map, propose_file, read_raw
from cdprcal.mapping.document import GROUPS, QUATERNIONS
from cdprcal.mapping.raw import unwrapped
from cdprcal.mapping.recognise import taken_apart
from cdprcal.mapping.units import UNITS, factor, unit_named
from cdprcal.ros2 import save_bag
from conftest import Cli
from raw_files import (
    SHAPES,
    bag_of_arrays,
    bag_of_joints,
    german_excel,
    parquet,
    quaternions,
    simulink,
)

LETTERS = {"s": "swivel_rad", "t": "tension_N", "p": "tension_setpoint_N"}


def mapped(cli: Cli, shape: str, log: Log, folder: Path) -> tuple[Path, Path]:
    """A raw file, and its map as proposed and corrected in at most two lines."""
    made = SHAPES[shape]
    raw, the_map = made.make(log, folder), folder / "map.yaml"
    ran = cli("check", "irma4", raw, "--propose", the_map)
    text = the_map.read_text()
    assert ran.code == int("# guess" in text), ran
    assert len(made.corrections) <= 2
    for before, after in made.corrections:
        text, count = re.subn(before, after, text)
        assert count == 1, f"{before} in\n{text}"
    the_map.write_text(text)
    return raw, the_map


@pytest.mark.parametrize("shape", SHAPES)
def test_a_raw_file_ends_in_a_pose(
    cli: Cli, synthetic: cdprcal.SyntheticLog, tmp_path: Path, shape: str
) -> None:
    raw, the_map = mapped(cli, shape, synthetic.log, tmp_path)
    ran = cli("calibrate", "irma4", raw, "--map", the_map, "--json")
    assert ran.code == 0, f"{the_map.read_text()}{ran.stderr}"
    found = json.loads(ran.stdout)
    truth = synthetic.poses[0]
    off_m = np.linalg.norm(np.subtract(found["initial_pose"]["position_m"], truth.position_m))
    assert off_m < 2e-3
    turn = np.array(found["initial_pose"]["rotation"]).T @ truth.rotation
    assert math.degrees(math.acos(min(1.0, (np.trace(turn) - 1.0) / 2.0))) < 0.3


@pytest.mark.parametrize("shape", SHAPES)
def test_every_reading_arrives(cli: Cli, log: Log, tmp_path: Path, shape: str) -> None:
    raw, the_map = mapped(cli, shape, log, tmp_path)
    out = tmp_path / "run.csv"
    assert cli("import", raw, "--map", the_map, "--robot", "irma4", "-o", out).code == 0
    log, truth = load_log(out).log, log
    np.testing.assert_allclose(log.time_s, truth.time_s - truth.time_s[0], atol=1e-4)
    groups = ["length_m", *(LETTERS[letter] for letter in SHAPES[shape].groups)]
    for group in groups:
        np.testing.assert_allclose(getattr(log, group), getattr(truth, group), atol=1e-4 * 20)
    angles = np.asarray(log.roll_pitch_yaw_rad - truth.roll_pitch_yaw_rad)
    turned = np.unwrap(angles[:, 2])
    np.testing.assert_allclose(angles[:, :2], 0.0, atol=1e-5)
    np.testing.assert_allclose(turned, turned[0], atol=1e-5)  # yaw is relative
    absent = {"swivel_rad", "tension_setpoint_N"} - set(groups)
    assert all(getattr(log, group).shape[1] == 0 for group in absent)


def test_the_proposal_says_how_sure_it_is(cli: Cli, log: Log, tmp_path: Path) -> None:
    raw, the_map = german_excel(log, tmp_path), tmp_path / "map.yaml"
    ran = cli("check", raw, "--propose", the_map)  # without a robot, too
    assert ran.code == 0
    assert ran.stdout.startswith(f"{the_map}: 5 lines, none a guess\n")
    assert f"next: cdprcal check ROBOT '{raw}' --map {the_map}" in ran.stdout
    checked = cli("check", "irma4", raw, "--map", the_map)
    assert checked.code == 0
    assert "can be used" in checked.stdout
    found = cli("diagnose", "irma4", raw, "--map", the_map)
    assert (found.code, found.stdout.splitlines()[0]) == (0, "consistent: no effect found")
    cli("check", "irma4", raw, "--propose", the_map, "--map", the_map).refused("leave out --map")
    cli("check", "irma4", raw, "--propose", raw).refused("is the log that is read")


def proposed(raw: Path, robot: Robot | None = None) -> dict[str, Line]:
    """The lines that are proposed for the channels of a file, by name."""
    return {line.name: line for line in propose_file(raw, robot).lines}


def through_its_map(proposal: Proposal) -> LogFile:
    """The file of a proposal as its map reads it."""
    the_map = proposal.raw.path.with_name("map.yaml")
    the_map.write_text(proposal.text())
    return load_mapped(proposal.raw.path, the_map, None)


def table(path: Path, names: Iterable[str], *columns: Any) -> Path:
    """A CSV file of these names and columns."""
    header = ",".join(names)
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")
    return path


def canonical(log: Log, path: Path, *renamed: tuple[str, str]) -> Path:
    """A canonical log whose header is written otherwise: (pattern, what stands in its place)."""
    cdprcal.write_log(log, str(path))
    header, rest = path.read_text().split("\n", 1)
    for pattern, other in renamed:
        header, count = re.subn(pattern, other, header)
        assert count, f"{pattern} in {header}"
    path.write_text(f"{header}\n{rest}")
    return path


@pytest.mark.parametrize(
    "angles",
    [
        "roll,pitch,yaw",
        "phi,theta,psi",
        "rx,ry,rz",
        "rpy_x,rpy_y,rpy_z",
        "imu_attitude.x,imu_attitude.y,imu_attitude.z",
    ],
)
@pytest.mark.parametrize("swivel", ["theta", "phi", "rz"])
def test_numbered_angles_are_the_swivels(
    log: Log, tmp_path: Path, angles: str, swivel: str
) -> None:
    renamed = [(r"swivel_(\d)_rad", rf"{swivel}_\1_rad")]
    for was, now in zip(("roll", "pitch", "yaw"), angles.split(","), strict=True):
        renamed.append((rf"\b{was}_rad", f"{now}_rad"))
    raw = canonical(log, tmp_path / "raw.csv", *renamed)
    lines = proposed(raw)
    assert lines["swivels"].columns == tuple(f"{swivel}_{i}_rad" for i in (1, 2, 3, 4))
    assert lines["attitude"].columns == tuple(f"{angle}_rad" for angle in angles.split(","))


@pytest.mark.parametrize("asked", ["TargetPosition_{}_m", "length_{}_ref_m", "Seil_Soll_{}_m"])
def test_what_was_commanded_is_not_what_was_read(
    cli: Cli, log: Log, tmp_path: Path, asked: str
) -> None:
    raw = tmp_path / "raw.csv"
    names = [asked.format(i) for i in (1, 2, 3, 4)] + [f"ActualPosition_{i}_m" for i in range(4)]
    header = ["time_s", *names, "roll_ref_rad", "roll_rad"]
    roll = log.roll_pitch_yaw_rad[:, :1]
    table(raw, header, log.time_s, log.length_m + 0.01, log.length_m, roll + 0.01, roll)
    lines = proposed(raw)
    assert lines["lengths"].columns == tuple(names[4:])
    assert lines["attitude"].columns == ("roll_rad", "", "")
    table(raw, header[:5], log.time_s, log.length_m + 0.01)
    (lengths,) = propose_file(raw).lines  # there is nothing else
    assert (lengths.sure, lengths.columns) == ("guess", tuple(names[:4]))
    assert "says that it was commanded" in lengths.why


@pytest.mark.parametrize(
    ("length", "tension"), [("length_{}_AI{}", "LC{}_500N"), ("AI{1}_wire{0}", "F_{0}_ch{1}_N")]
)
def test_the_number_that_tells_cables_apart_is_found_among_others(
    log: Log, tmp_path: Path, length: str, tension: str
) -> None:
    raw = tmp_path / "raw.csv"
    names = [pattern.format(i, i + 7) for pattern in (length, tension) for i in (1, 2, 3, 4)]
    table(raw, ["time_s", *names], log.time_s, log.length_m, log.tension_N)
    lines = proposed(raw)
    assert lines["lengths"].columns == tuple(names[:4])
    assert lines["tensions"].columns == tuple(names[4:])


def test_a_map_without_a_cable_is_no_success(cli: Cli, log: Log, tmp_path: Path) -> None:
    raw = tmp_path / "raw.csv"
    header = ("time_s", "roll_rad", "pitch_rad", "yaw_rad")
    table(raw, header, log.time_s, log.roll_pitch_yaw_rad)
    ran = cli("check", "irma4", raw, "--propose", tmp_path / "map.yaml")
    assert ran.code == 1
    assert "2 lines, no column is recognised as a cable's: add lengths" in ran.stdout
    assert "# no column is recognised as a cable's" in (tmp_path / "map.yaml").read_text()


def test_a_clock_that_stands_still_is_the_time_rather_than_a_count(
    log: Log, tmp_path: Path
) -> None:
    ticks = np.asarray(log.time_s).copy()
    ticks[30::40] = ticks[29::40][: len(ticks[30::40])]
    written = [f"{i};{time:.3f}" for i, time in enumerate(ticks.tolist())]
    raw = with_times(log, tmp_path / "raw.csv", ";t", written)
    proposal = propose_file(raw)
    assert (proposal.time.columns, proposal.time.sure) == (("t",), "likely")
    assert "rows of the same time are left out" in proposal.time.why
    # A count alone is but a guess.
    proposal = propose_file(with_times(log, raw, "", [f"{i}" for i in range(len(ticks))]))
    assert (proposal.time.columns, proposal.time.sure) == (("column_1",), "guess")
    assert "it counts the rows" in proposal.time.why
    # And a time of no logger's steps is the time all the same.
    proposal = propose_file(with_times(log, raw, "t", [f"{50 * i}" for i in range(len(ticks))]))
    assert (proposal.time.columns, proposal.time.unit) == (("t",), "ms")
    proposal = propose_file(with_times(log, raw, "t", [f"{i / 1e9}" for i in range(len(ticks))]))
    assert (proposal.time.columns, proposal.time.sure) == (("t",), "guess")


@pytest.mark.parametrize("day", ["", "2026-03-01 12:00:"])
def test_stamps_of_whole_seconds_give_way_to_the_rate(log: Log, tmp_path: Path, day: str) -> None:
    the_map = tmp_path / "map.yaml"
    written = [f"{day}{int(time) % 60:02d}" for time in np.asarray(log.time_s)[:500]]
    log = Log(time_s=log.time_s[:500], length_m=log.length_m[:500],
                      tension_N=log.tension_N[:500])  # fmt: skip
    raw = with_times(log, tmp_path / "raw.csv", "stamp", written)
    proposal = propose_file(raw)
    assert proposal.rate_Hz == pytest.approx(10.0)
    assert proposal.time.sure == "guess"
    assert "'stamp' goes on by 1 s at a time" in proposal.time.why
    the_map.write_text(re.sub("time: .*", 'time: {column: "stamp", unit: "s"}', proposal.text()))
    (finding,) = load_mapped(raw, the_map, None).findings
    assert finding.message.startswith("450 of 500 rows have the time of the row before")
    assert "write time: {rate_Hz: 10} into the mapping file" in finding.remedy
    # Of rows that are written again nothing is lost.
    header, *rows = raw.read_text().splitlines()
    raw.write_text("\n".join([header, *(row for row in rows[::10] for _ in range(10))]))
    assert propose_file(raw).time.columns == ("stamp",)


def test_a_full_name_beats_an_alias(log: Log, tmp_path: Path) -> None:
    renamed = ("tension_1_N", "theta_rad"), ("tension_2_N", "rx_rad")
    raw = canonical(log, tmp_path / "raw.csv", *renamed)
    lines = proposed(raw)
    assert lines["attitude"].columns == ("roll_rad", "pitch_rad", "yaw_rad")


@pytest.mark.parametrize("name", ["T{} [N]", "T{}", "x{} [N]", "forza_{}"])
def test_numbered_forces_are_the_tensions(log: Log, tmp_path: Path, name: str) -> None:
    renamed = (r"tension_(\d)_N", name.format(r"\1"))
    raw = canonical(log, tmp_path / "raw.csv", renamed)
    proposal = propose_file(raw, cdprcal.load_robot("irma4"))
    lines = {line.name: line for line in proposal.lines}
    assert lines["tensions"].columns == tuple(name.format(i) for i in (1, 2, 3, 4))
    assert lines["tensions"].unit == "N"
    assert proposal.time.columns == ("time_s",)


def test_a_column_twice_is_a_guess_and_what_is_not_used_is_said(
    cli: Cli, log: Log, tmp_path: Path
) -> None:
    renamed = ("roll_rad", "length_1_m"), ("pitch_rad", "spindle")
    raw = canonical(log, tmp_path / "raw.csv", *renamed)
    ran = cli("check", "irma4", raw, "--propose", tmp_path / "map.yaml")
    assert ran.code == 1
    assert "to be corrected where wrong: lengths" in ran.stdout
    assert "not used: length_1_m (column " in ran.stdout
    assert "spindle" in ran.stdout
    text = (tmp_path / "map.yaml").read_text()
    assert "the file names length_1_m more than once, the first is taken" in text
    assert '["length_1_m", "length_2_m", "length_3_m", "length_4_m"]' in text


def test_an_array_of_angles_is_the_attitude(log: Log, tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    path = tmp_path / "run.mat"
    held = {"t": log.time_s, "L": log.length_m, "T": log.tension_N, "rpy": log.roll_pitch_yaw_rad}
    io.savemat(path, {key: np.array(values) for key, values in held.items()})
    lines = proposed(path)
    assert lines["attitude"].columns == ("rpy.1", "rpy.2", "rpy.3")
    assert lines["tensions"].columns == ("T.1", "T.2", "T.3", "T.4")


def test_a_bag_that_was_exported_is_proposed_whole(log: Log, robot: Robot, tmp_path: Path) -> None:
    save_bag(log, tmp_path / "bag", robot.euler_convention)
    lines = proposed(tmp_path / "bag", robot)
    assert {"lengths", "swivels", "tensions", "attitude"} <= set(lines)
    assert lines["lengths"].columns[0] == "/joint_states.position.cable_1"
    assert lines["swivels"].columns[0] == "/joint_states.position.swivel_1"
    assert lines["tensions"].columns[0] == "/joint_states.effort.cable_1"


@pytest.mark.parametrize("command", ["check", "calibrate", "diagnose"])
def test_other_columns_are_answered_by_the_way_to_a_map(
    cli: Cli, log: Log, log_path: Path, tmp_path: Path, command: str
) -> None:
    raw = german_excel(log, tmp_path)
    cli(command, "irma4", raw).refused(f"cdprcal check '{raw}' --propose map.yaml writes one")
    log_path.write_text(log_path.read_text().replace("length_1_m", "length_one", 1))
    ran = cli(command, "irma4", log_path)  # a slip in a log is a slip
    ran.refused()
    assert "--propose" not in ran.stderr


def _each_row(text: str, at_end: str) -> str:
    header, *rows = text.splitlines()
    return "\n".join([header, *(row + at_end for row in rows), ""])


def _dated(text: str) -> str:
    header, *rows = text.splitlines()
    begin = datetime(2026, 3, 1, 12)
    for i, row in enumerate(rows):
        time_s, rest = row.split(",", 1)
        rows[i] = f"{(begin + timedelta(seconds=float(time_s))).isoformat()},{rest}"
    return "\n".join([header, *rows, ""])


ALMOST_LOGS: dict[str, Callable[[str], str]] = {
    "degrees": lambda text: text.replace("swivel_1_rad", "swivel_1_deg"),
    "millimetres": lambda text: text.replace("length_1_m", "length_1_mm"),
    "a comment": lambda text: _each_row(text, ",good").replace("\n", ",comment\n", 1),
    "from zero": lambda text: re.sub(r"_(\d)_", lambda found: f"_{int(found[1]) - 1}_", text),
    "dates": _dated,
    "old Mac": lambda text: text.replace("\n", "\r"),
    "trailing commas": lambda text: _each_row(text, ","),
    "trailing commas in all lines": lambda text: text.replace("\n", ",\n"),
}


@pytest.mark.parametrize("slip", ALMOST_LOGS)
def test_what_a_map_would_read_is_answered_by_the_way_to_it(
    cli: Cli, log_path: Path, tmp_path: Path, slip: str
) -> None:
    log_path.write_bytes(ALMOST_LOGS[slip](log_path.read_text()).encode())
    for command in (["check", "irma4", log_path], ["import", log_path, "-o", tmp_path / "o.csv"]):
        ran = cli(*command)
        assert ran.code == 2
        assert ran.stderr.count("--map") == 1
        assert f"cdprcal check {log_path} --propose map.yaml writes" in ran.stderr
    assert cli("check", log_path, "--propose", tmp_path / "map.yaml").code < 2


@pytest.mark.parametrize("ending", [".csv", " of others.csv"])
def test_another_number_of_cables_is_said_before_a_map_is_written(
    cli: Cli, log: Log, tmp_path: Path, ending: str
) -> None:
    raw, the_map = tmp_path / f"three{ending}", tmp_path / "map.yaml"
    cdprcal.write_log(Log(time_s=log.time_s, length_m=log.length_m[:, :3]), str(raw))
    if "of others" in ending:
        raw.write_text(raw.read_text().replace("length_", "rope "))
    ran = cli("check", "irma4", raw, "--propose", the_map)
    ran.refused("has 3 cables, robot irma4 has 4; use the robot file of the robot that")
    assert not the_map.exists()
    assert "--propose" not in cli("check", "irma4", raw).stderr or "of others" in ending


MAP = """format: cdprcal-map-1
time: {column: t, unit: ms}
channels:
  lengths: {columns: [a, b, c, d], unit: mm, sign: [1, -1, 1, 1]}
"""
BAD_MAPS = {
    "unit of another kind": (
        "unit: mm",
        "unit: kg",
        r"map.yaml:4:42: channels.lengths.unit: 'kg' is not one of m, mm",
    ),
    "unknown channel": (
        "lengths",
        "lenghts",
        "map.yaml:4:12: channels.lenghts: is not one of lengths, swivels",
    ),
    "no channels": ("channels:", "more:", "more: is not known here|channels: is missing"),
    "two signs": ("[1, -1, 1, 1]", "[1, -1]", "2 signs for 4 columns"),
    "no sign": (
        "[1, -1, 1, 1]",
        "0",
        "map.yaml:4:52: channels.lengths.sign: 0 is neither 1 nor -1; give 1 where cables grow",
    ),
    "no sign of one": ("[1, -1, 1, 1]", "[1, 0.5, 1, 1]", "lengths.sign: 0.5 is neither 1 nor"),
    "an encoding of nobody": (
        "time:",
        "text: {encoding: klingon}\ntime:",
        "map.yaml:2:18: text.encoding: 'klingon' is no encoding of text; give utf-8, utf-16",
    ),
    "an encoding of no text": (
        "time:",
        "text: {encoding: hex}\ntime:",
        "text.encoding: 'hex' is no encoding of text; give utf-8",
    ),
    "a tab as it is not read": (
        "time:",
        "text: {separator: '\\t'}\ntime:",
        r"map.yaml:2:19: text.separator: '..t' is not one character; give .* or .\\t\"$",
    ),
    "a column twice": (
        "[a, b, c, d]",
        "[a, b, c, a]",
        "map.yaml:4:.*channels.lengths: names column 'a' twice",
    ),
    "a negative unit": ("unit: mm", "unit: -1", "channels.lengths: unit -1 is not above 0.*sign"),
    "a unit of nothing": ("unit: mm", "unit: 0", "channels.lengths: unit 0 is not above 0"),
    "an endless unit": ("unit: mm", "unit: .inf", "channels.lengths: unit inf is not above 0"),
    "a unit of time of nothing": ("unit: ms", "unit: 0.0", "time: unit 0 is not above 0"),
    "unit of time": ("unit: ms", "unit: mm", "unit 'mm' is not one of s, ms"),
    "a part of another kind": (
        "unit: ms",
        "unit: s, plus: {column: n, unit: mm}",
        "time.plus.unit: unit 'mm' is not one of s, ms",
    ),
    "a part of no column": ("unit: ms", "plus: {column: '', unit: ns}", "time.plus.column"),
    "time and rate": ("unit: ms", "rate_Hz: 10", "give either a column or rate_Hz"),
    "another format": ("map-1", "map-9", r"map.yaml:1:9: format"),
    "no map": (MAP, "- 1\n", "a mapping file is a map; see docs/your-log.md"),
    "a quaternion of three": (
        "lengths: {columns: [a, b, c, d], unit: mm, sign: [1, -1, 1, 1]}",
        "attitude: {columns: [a, b, c], unit: quaternion_xyzw}",
        "must be 4 for a quaternion",
    ),
    "a cable too few": (
        "lengths: {columns: [a, b, c, d], unit: mm, sign: [1, -1, 1, 1]}",
        "lengths: {columns: [a, b, c], unit: mm}\n  tensions: {columns: [d, e, f, g], unit: N}",
        "map.yaml:4:.*channels.lengths.columns: has 3 columns, tensions has 4; name one a cable",
    ),
    "two angles": (
        "lengths: {columns: [a, b, c, d], unit: mm, sign: [1, -1, 1, 1]}",
        "attitude: {columns: [a, b], unit: deg}",
        "has 2 columns, expected 3; write '' for one that is not there",
    ),
}


@pytest.mark.parametrize("case", BAD_MAPS)
def test_a_wrong_map_is_refused_by_line(case: str) -> None:
    before, after, words = BAD_MAPS[case]
    assert parse_map(MAP, "map.yaml").channels["lengths"].sign == [1, -1, 1, 1]
    assert before in MAP
    with pytest.raises(cdprcal.InputError, match=words):
        parse_map(MAP.replace(before, after, 1), "map.yaml")


def test_names_that_are_not_there_are_answered_by_those_that_are(tmp_path: Path) -> None:
    raw, the_map = tmp_path / "raw.csv", tmp_path / "map.yaml"
    the_map.write_text(MAP)
    raw.write_text("t,a,bb,c,d\n0,1,2,3,4\n100,1,2,3,5\n")
    with pytest.raises(
        cdprcal.InputError, match=r"has no column 'b'; give one of those it has: 'bb', 't'"
    ):
        load_mapped(raw, the_map, None)
    raw.write_text("zeit,a,b,c,d\n0,1,2,3,4\n100,1,2,3,5\n")
    with pytest.raises(cdprcal.InputError, match=r"map.yaml: time: .* has no column 't'"):
        load_mapped(raw, the_map, None)
    raw.write_text("t,a,b,c,d\n0,1,2,3,4\n100,1,2,3,5\n50,1,2,3,6\n200,,2,3,7\n")
    file = load_mapped(raw, the_map, None)
    np.testing.assert_allclose(file.log.time_s, [0.0, 0.1, 0.2])
    np.testing.assert_allclose(file.log.length_m[:, 1], [-0.002, -0.002, -0.002])
    assert math.isnan(file.log.length_m[2, 0])
    assert [finding.code for finding in file.findings] == ["same_time"]
    assert file.line_of(2) == 5


READ_MAP = """format: cdprcal-map-1
text: {{separator: ";", decimal: "{decimal}"}}
time: {{column: t, unit: s}}
channels:
  lengths: {{columns: [a, b], unit: mm}}
"""


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"t,a,b\n0,1,2\n1,1,3\n", 'map.yaml: text.separator: .*csv has no .*";"; give ",",'),
        (b"t\ta\tb\n0\t1\t2\n1\t1\t3\n", 'map.yaml: text.separator: .*; give "\\\\t", which'),
        (b"t;a;b [\xb0]\n0;1;2\n", "map.yaml: text.encoding: .* is not utf-8 text; give cp1252"),
    ],
    ids=["comma", "tab", "encoding"],
)
def test_a_text_that_is_cut_otherwise_is_answered_by_its_form(
    content: bytes, said: str, tmp_path: Path
) -> None:
    raw, the_map = tmp_path / "raw.csv", tmp_path / "map.yaml"
    the_map.write_text(READ_MAP.format(decimal="."))
    raw.write_bytes(content)
    with pytest.raises(cdprcal.InputError, match=said):
        load_mapped(raw, the_map, None)
    the_map.write_text(the_map.read_text().replace("decimal", "header_line: 2, decimal"))
    raw.write_bytes(b"t;a;b\n0;1;2\n1;1;3\n")
    with pytest.raises(cdprcal.InputError, match=r"or correct text\.header_line: line 2 "):
        load_mapped(raw, the_map, None)


def read_cell(folder: Path, cell: str, decimal: str = ".") -> float:
    """What a mapped log holds where a file says ``cell`` [mm]; Mode is no column of the map."""
    raw, the_map = folder / "raw.csv", folder / "map.yaml"
    the_map.write_text(READ_MAP.format(decimal=decimal))
    raw.write_text(f"t;a;b;Mode\n0;1;2;HOLD\n1;1;{cell};HOLD\n2;1;3;HOLD\n")
    return float(load_mapped(raw, the_map, None).log.length_m[1, 1])


@pytest.mark.parametrize(
    ("cell", "decimal", "remedy"),
    [
        ("1,817.471", ".", "write numbers without separators of thousands"),
        ("1'817.471", ".", "write numbers without separators of thousands"),
        ("1 817.471", ".", "write numbers without separators of thousands"),
        ("1.817,471", ",", "write numbers without separators of thousands"),
        ("1.817", ",", "or correct text.decimal"),
        ("1,817", ".", "or correct text.decimal"),
        ("3238.7 mm", ".", "write the unit into the name of the column, not into the cells"),
        ("3238,7mm", ",", "write the unit into the name of the column, not into the cells"),
        ("inf", ".", "leave the cell empty where nothing was read"),
        ("1e400", ".", "leave the cell empty where nothing was read"),
        ("overload", ".", "or delete the line if it is no row"),
    ],
)
def test_a_cell_that_cannot_be_read_is_refused_by_line_and_column(
    tmp_path: Path, cell: str, decimal: str, remedy: str
) -> None:
    with pytest.raises(cdprcal.InputError) as refused:
        read_cell(tmp_path, cell, decimal)
    said = str(refused.value)
    assert f"raw.csv:3: column 'b': {cell!r} is not a number; " in said
    assert remedy in said


@pytest.mark.parametrize(
    "cell", ["", "NaN", "-nan", "-", "N/A", "null", "None", "?", "-1.#IND", "#NV"]
)
def test_a_cell_may_say_that_nothing_was_read(tmp_path: Path, cell: str) -> None:
    assert math.isnan(read_cell(tmp_path, cell))


@pytest.mark.parametrize(
    ("cell", "decimal"), [("\N{MINUS SIGN}18.5", "."), ("-18,5", ","), ("-1.85e1", ".")]
)
def test_a_number_may_be_written_in_any_way_that_has_one_meaning(
    tmp_path: Path, cell: str, decimal: str
) -> None:
    assert read_cell(tmp_path, cell, decimal) == pytest.approx(-0.0185)


@pytest.mark.parametrize(
    ("write", "said"),
    [
        ("{:,.3f}", r"raw.csv:2: column 'length_1_mm': '1,\d{3}\.\d{3}' is not a number; write"),
        ("{:.3f} mm", r"raw.csv:2: column 'length_1_mm': '1\d+\.\d+ mm' is not a number; write"),
    ],
)
def test_no_map_is_proposed_for_cells_that_cannot_be_read(
    cli: Cli, log: Log, tmp_path: Path, write: str, said: str
) -> None:
    raw = tmp_path / "raw.csv"
    lines = ["t_s;" + ";".join(f"length_{i}_mm" for i in (1, 2, 3, 4))]
    for time_s, row in zip(log.time_s.tolist(), (1e3 * log.length_m).tolist(), strict=True):
        lines.append(f"{time_s};" + ";".join(write.format(length) for length in row))
    raw.write_text("\n".join([*lines, ""]))
    ran = cli("check", "irma4", raw, "--propose", tmp_path / "map.yaml")
    assert ran.code == 2
    assert re.search(said, ran.stderr)
    assert not (tmp_path / "map.yaml").exists()


@pytest.mark.parametrize("mark", [-999, -9999, 9999, 65535])
def test_marks_of_missing_readings_are_named_with_what_to_do(
    cli: Cli, log: Log, tmp_path: Path, mark: int
) -> None:
    raw, the_map = canonical(log, tmp_path / "raw.csv"), tmp_path / "map.yaml"
    header, *rows = (line.split(",") for line in raw.read_text().splitlines())
    at = [header.index(name) for name in ("length_2_m", "tension_3_N", "roll_rad")]
    for row in rows[3::7]:
        for i in at:
            row[i] = str(mark)
    raw.write_text("\n".join([",".join(row) for row in [header, *rows]]) + "\n")
    ran = cli("check", "irma4", raw, "--propose", the_map)
    assert ran.code == 0, ran
    assert re.search(rf"missing +likely +\[{mark}\] +length_2_m", ran.stdout)
    found = load_mapped(raw, the_map, None)
    assert found.findings == ()
    there = np.isfinite(np.asarray(found.log.length_m))
    assert there.sum(axis=0).tolist() == [len(rows), len(rows) - len(rows[3::7])] + [len(rows)] * 2
    # Without the line, check and import say so.
    the_map.write_text(re.sub("(?m)^missing.*\n", "", the_map.read_text()))
    (finding,) = load_mapped(raw, the_map, None).findings
    assert finding.message.startswith(f"{mark} stands {3 * len(rows[3::7])} times in length_2_m, ")
    assert finding.remedy == f"write missing: [{mark}] into the mapping file"
    for command in (["check", "irma4"], ["import", "-o", tmp_path / "run.csv"]):
        ran = cli(*command, raw, "--map", the_map)
        assert "seems to say that nothing was read" in " ".join((ran.stdout + ran.stderr).split())


@pytest.mark.parametrize(
    ("values", "marks"),
    [
        ([*range(100), -999, *range(100, 200), -999, -999, 200], {-999: 3}),
        ([*range(100), -999, *range(100, 200), 9999, -999, 9999, 200], {-999: 2, 9999: 2}),
        ([7.0] * 50 + [-999.0] + [7.0] * 20 + [-999.0], {-999: 2}),
        ([*range(100), *[-999] * 8], {-999: 8}),  # one step, and it stands as no reading does
        ([7.0] * 60 + [-999.0] * 8, {}),  # as all readings do
        ([*range(100), -999, *range(100, 200)], {}),  # once may be anything
        ([*range(900, 1100), *range(1100, 900, -1)], {}),  # on its way
        ([*range(900, 999), 999, 999, 999, *range(998, 900, -1)], {}),  # at its end
        ([0.0, 5000.0] * 50 + [-999.0, 0.0, -999.0], {}),  # other steps are as large
        ([1.0, -999.0, -999.0, 2.0], {}),  # too few to tell
        ([*range(100), -1, *range(100, 200), -1], {}),  # nothing that people use so
        ([math.nan] * 5 + [-999.0] * 5, {}),
        ([math.nan] * 5, {}),
    ],
)
def test_what_is_a_mark(values: list[float], marks: dict[int, int]) -> None:
    assert marks_in(np.array(values, dtype=np.float64)) == marks


def scaled(log: Log, path: Path, scale: dict[str, float], *renamed: tuple[str, str]) -> Path:
    """As ``canonical``, columns that begin so in another unit: how many of it SI's one is."""
    columns = [line.split(",") for line in canonical(log, path).read_text().splitlines()]
    header = columns[0]
    for i, name in enumerate(header):
        if size := next((size for stem, size in scale.items() if name.startswith(stem)), None):
            for row in columns[1:]:
                row[i] = f"{size * float(row[i]):.6g}"
        for pattern, other in renamed:
            header[i] = re.sub(pattern, other, header[i])
    path.write_text("\n".join(",".join(row) for row in columns) + "\n")
    return path


@pytest.mark.parametrize(
    ("stem", "written", "size", "unit"),
    [
        ("length", "dm", 10.0, "dm"),
        ("length", "µm", 1e6, "um"),
        ("tension", "cN", 100.0, "cN"),
        ("tension", "dN", 10.0, "dN"),
        ("tension", "kgf", 1.0 / 9.80665, "kgf"),
        ("tension", "kg", 1.0 / 9.80665, "kgf"),
        ("tension", "kp", 1.0 / 9.80665, "kgf"),
        ("swivel", "mrad", 1e3, "mrad"),
        ("swivel", "μrad", 1e6, "urad"),
        ("swivel", "arcmin", 60.0 * math.degrees(1.0), "arcmin"),
    ],
)
def test_a_unit_in_brackets_is_taken(
    log: Log, tmp_path: Path, stem: str, written: str, size: float, unit: str
) -> None:
    renamed = rf"^{stem}_(\d)_\w+$", rf"{stem} \1 [{written}]"
    raw = scaled(log, tmp_path / "raw.csv", {f"{stem}_": size}, renamed)
    proposal = propose_file(raw)
    line = next(line for line in proposal.lines if line.name == f"{stem}s")
    assert (line.unit, line.sure) == (unit, "sure")
    found = through_its_map(proposal).log
    field = {"length": "length_m", "tension": "tension_N", "swivel": "swivel_rad"}[stem]
    np.testing.assert_allclose(getattr(found, field), getattr(log, field), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize(
    ("stem", "written", "one"),
    [
        ("length", "counts", "m"),
        ("length", "rev", "m"),
        ("length", "encoder ticks", "m"),
        ("tension", "mV/V", "N"),
        ("tension", "%", "N"),
        ("swivel", "LSB", "rad"),
        ("swivel", "mm", "rad"),
    ],
)
@pytest.mark.parametrize("below", [False, True])
def test_a_unit_of_no_known_size_is_a_guess_and_says_so(
    cli: Cli, log: Log, tmp_path: Path, stem: str, written: str, one: str, below: bool
) -> None:
    name = rf"{stem} \1" + ("" if below else f" [{written}]")
    raw = scaled(log, tmp_path / "raw.csv", {}, (rf"^{stem}_(\d)_\w+$", name))
    if below:
        header, rest = raw.read_text().split("\n", 1)
        units = [written if stem in name else "" for name in header.split(",")]
        units = [unit or ("s" if i == 0 else "deg") for i, unit in enumerate(units)]
        header = re.sub(r"_(m|N|s|rad)(?=,|$)", "", header)
        raw.write_text(f"{header}\n{','.join(units)}\n{rest}")
    ran = cli("check", "irma4", raw, "--propose", tmp_path / "map.yaml")
    assert ran.code == 1
    text = (tmp_path / "map.yaml").read_text()
    line = next(line for line in text.splitlines() if line.startswith(f"  {stem}s:"))
    assert "# guess: by name; " in line
    assert f"in {written}, which is no known unit of it: give the {one} that one is" in line
    assert "sign by the robot's physics" not in text  # of a wrong scale physics says nothing


@pytest.mark.parametrize(("unit", "size"), [("kgf", 9.80665), ("daN", 10.0), ("lbf", 4.4482216)])
def test_tensions_without_a_unit_are_weighed_by_physics(
    log: Log, robot: Robot, tmp_path: Path, unit: str, size: float
) -> None:
    renamed = r"^tension_(\d)_N$", r"tension_\1"
    raw = scaled(log, tmp_path / "raw.csv", {"tension_": 1.0 / size}, renamed)
    tensions = proposed(raw, robot)["tensions"]
    assert (tensions.unit, tensions.sure) == (unit, "likely")
    # Without a robot nothing says it.
    tensions = proposed(raw)["tensions"]
    assert (tensions.unit, tensions.sure) == ("N", "guess")
    assert "nothing says the unit" in tensions.why


def test_of_maps_that_agree_as_well_the_one_that_changes_least_is_proposed(
    log: Log, robot: Robot, tmp_path: Path
) -> None:
    """Millimetres under a header that says metres: the frame seen from behind agrees as well."""
    raw = scaled(log, tmp_path / "raw.csv", {"length_": 1e3})
    lines = proposed(raw, robot)
    assert lines["lengths"].unit == "mm"
    assert lines["lengths"].columns == tuple(f"length_{i}_m" for i in range(1, 5))
    for line in lines.values():
        assert set(line.sign) == {1}, line


def test_eight_cables_are_read_as_they_stand(cli: Cli, tmp_path: Path) -> None:
    """One start of a blind calibration misses the pose, and signs seemed to set it right."""
    raw = tmp_path / "raw.csv"
    assert cli("generate", "posts8", "-o", raw).code == 0
    for line in propose_file(raw, cdprcal.load_robot("posts8")).lines:
        assert set(line.sign) == {1}, line


def test_columns_of_several_units_are_a_guess(log: Log, tmp_path: Path) -> None:
    renamed = r"^length_1_m$", "length_1_mm"
    raw = scaled(log, tmp_path / "raw.csv", {"length_1": 1e3}, renamed)
    lengths = proposed(raw)["lengths"]
    assert lengths.sure == "guess"
    assert "in m and mm" in lengths.why
    assert "convert the columns to one unit" in lengths.why


def with_times(log: Log, path: Path, names: str, written: list[str]) -> Path:
    """A canonical log whose times are written otherwise, semicolons between its cells."""
    canonical(log, path, ("time_s", names))
    header, *rows = path.read_text().replace(",", ";").splitlines()
    rows = [f"{time};{row.partition(';')[2]}" for time, row in zip(written, rows, strict=True)]
    path.write_text("\n".join([header, *rows, ""]))
    return path


@pytest.mark.parametrize(
    "form",
    [
        "%Y-%m-%dT%H:%M:%S.%f+02:00",
        "%Y-%m-%d %H:%M:%S.%f +0200",
        "%Y-%m-%d %H:%M:%S,%f-05",
        "%Y-%m-%dT%H:%M:%S.%fZ",
        "%d/%m/%Y %H:%M:%S.%f",
        "%m/%d/%Y %I:%M:%S.%f %p",
        "%d.%m.%Y %H:%M:%S,%f",
        "%d.%m.%y %H:%M:%S.%f",
        "%m/%d/%y %H:%M:%S.%f",
        "%Y%m%dT%H%M%S.%f",
        "%d-%b-%Y %H:%M:%S.%f",
        "%H:%M:%S.%f",
        "%I:%M:%S.%f %p",
    ],
)
def test_dates_and_times_of_day_pass_midnight(log: Log, tmp_path: Path, form: str) -> None:
    begin = datetime(2026, 3, 1, 23, 59, 30)
    stamps = [begin + timedelta(seconds=time) for time in log.time_s.tolist()]
    written = [stamp.strftime(form) for stamp in stamps]
    proposal = propose_file(with_times(log, tmp_path / "raw.csv", "stamp", written))
    assert proposal.time.why == "dates or times of day"
    file = through_its_map(proposal)
    assert file.findings == ()
    np.testing.assert_allclose(file.log.time_s, log.time_s - log.time_s[0], atol=2e-5)


@pytest.mark.parametrize("first", [46000.54, 740000.5])
def test_days_of_excel_and_matlab_are_times(log: Log, tmp_path: Path, first: float) -> None:
    written = [f"{first + time / 86400.0:.11f}" for time in log.time_s.tolist()]
    proposal = propose_file(with_times(log, tmp_path / "raw.csv", "Time", written))
    assert (proposal.time.unit, proposal.time.sure) == ("d", "likely")
    file = through_its_map(proposal)
    np.testing.assert_allclose(file.log.time_s, log.time_s - log.time_s[0], atol=1e-4)


@pytest.mark.parametrize("bits", [16, 32])
def test_a_counter_that_overflows_begins_no_other_run(log: Log, tmp_path: Path, bits: int) -> None:
    since = (log.time_s - log.time_s[0]) * (1e3 if bits == 16 else 1e6)
    counts = (2**bits - 20_000 + np.round(since).astype(np.int64)) % 2**bits
    name = "time_ms" if bits == 16 else "time_us"
    raw = with_times(log, tmp_path / "raw.csv", name, [str(count) for count in counts])
    proposal = propose_file(raw)
    assert proposal.time.columns == (name,)
    file = through_its_map(proposal)
    assert file.findings == ()
    np.testing.assert_allclose(file.log.time_s, log.time_s - log.time_s[0], atol=1e-3)


def test_a_clock_that_is_set_back_is_no_counter() -> None:
    steps = np.arange(40.0)
    for back in (1.0, 20.0, 2.0**16):
        values = np.concatenate([steps + 2.0**16, steps + 2.0**16 + 40.0 - back])
        np.testing.assert_array_equal(unwrapped(values), values)


def test_rows_out_of_order_are_said_to_be(log: Log, tmp_path: Path) -> None:
    header, *rows = canonical(log, tmp_path / "raw.csv").read_text().splitlines()
    (tmp_path / "raw.csv").write_text("\n".join([header, *reversed(rows), ""]))
    proposal = propose_file(tmp_path / "raw.csv")
    assert proposal.time.sure == "guess"
    assert re.search(r"'time_s' goes back at \d+ of \d+ rows: sort the rows", proposal.time.why)


def test_milliseconds_beside_a_time_of_day_are_a_part_of_it(log: Log, tmp_path: Path) -> None:
    begin = datetime(2026, 3, 1, 23, 59, 30)
    stamps = [begin + timedelta(seconds=time) for time in log.time_s.tolist()]
    written = [f"{stamp:%d.%m.%Y;%H:%M:%S};{stamp.microsecond // 1000}" for stamp in stamps]
    raw = with_times(log, tmp_path / "raw.csv", "Datum;Uhrzeit;ms", written)
    proposal = propose_file(raw)
    assert proposal.time.columns == ("Uhrzeit", "ms")
    file = through_its_map(proposal)
    np.testing.assert_allclose(file.log.time_s, log.time_s - log.time_s[0], atol=2e-3)


PREAMBLES = {
    "a name more than readings": "{header},Comment\n{rows}",
    "as wide as the table": "Channels,15\nSamples{wide}\nX0{wide}\n\n{header}\n{rows}",
    "LabVIEW": "Samples{wide}\nX0{wide}\n***End_of_Header***\n{header},Comment\n{rows}",
    "names that come again": "{header}\n{rows}\n{header}\n{more}",
}


@pytest.mark.parametrize("form", PREAMBLES)
def test_the_names_are_found_below_and_beyond_what_loggers_write(
    log: Log, tmp_path: Path, form: str
) -> None:
    raw = canonical(log, tmp_path / "raw.csv")
    header, *rows = raw.read_text().splitlines()
    half = len(rows) // 2 if "{more}" in PREAMBLES[form] else len(rows)
    raw.write_text(
        PREAMBLES[form].format(
            header=header,
            rows="\n".join(rows[:half]),
            more="\n".join(rows[half:]),
            wide=",751" * header.count(","),
        )
    )
    proposal = propose_file(raw)
    assert {line.name for line in proposal.lines} >= {"lengths", "swivels", "tensions", "attitude"}
    np.testing.assert_array_equal(through_its_map(proposal).log.length_m, log.length_m)


def test_points_that_part_thousands_are_refused_and_those_of_fractions_are_not(
    tmp_path: Path,
) -> None:
    for form, refused in (("{:,.0f}", True), ("{:.3f}", False), ("{:.4g}", False)):
        lengths = np.linspace(820.0, 1180.0, 60)
        cells = [form.format(length).replace(",", ".") for length in lengths]
        rows = [f"{i};{cell};{cell}" for i, cell in enumerate(cells)]
        (tmp_path / "raw.csv").write_text("\n".join(["t;a;b", *rows, ""]))
        (tmp_path / "map.yaml").write_text(READ_MAP.format(decimal="."))
        if refused:
            with pytest.raises(cdprcal.InputError, match="without separators of thousands"):
                load_mapped(tmp_path / "raw.csv", tmp_path / "map.yaml", None)
        else:
            log = load_mapped(tmp_path / "raw.csv", tmp_path / "map.yaml", None).log
            np.testing.assert_allclose(log.length_m[:, 0], 1e-3 * lengths, atol=1e-3)


def test_a_time_zone_that_changes_is_no_jump_and_a_clock_set_back_is_one(tmp_path: Path) -> None:
    raw, the_map = tmp_path / "raw.csv", tmp_path / "map.yaml"
    the_map.write_text(MAP.replace("unit: ms", "unit: s"))
    for stamps, times in (
        (("2026-10-25T02:59:59+02:00", "2026-10-25T02:00:00+01:00"), [0.0, 1.0]),
        (("02:59:59", "02:00:00"), [0.0]),
        (("22:00:00", "02:00:00"), [0.0, 4.0 * 3600.0]),
        (("01:00:00", "14:00:00"), [0.0, 13.0 * 3600.0]),
    ):
        raw.write_text("t,a,b,c,d\n" + "".join(f"{stamp},1,2,3,4\n" for stamp in stamps))
        np.testing.assert_allclose(load_mapped(raw, the_map, None).log.time_s, times, atol=2e-5)


@pytest.mark.parametrize(
    ("names", "per_s"),
    [
        ("sec;nanosec", 1_000_000_000),
        ("header.stamp.sec;header.stamp.nanosec", 1_000_000_000),
        ("field.header.stamp.secs;field.header.stamp.nsecs", 1_000_000_000),
        ("tv_sec;tv_usec", 1_000_000),
    ],
)
def test_seconds_and_what_passed_since_are_one_time(
    log: Log, tmp_path: Path, names: str, per_s: int
) -> None:
    ticks = [1_772_366_400 * per_s + round(per_s * time) for time in log.time_s.tolist()]
    written = [f"{tick // per_s};{tick % per_s}" for tick in ticks]
    raw = with_times(log, tmp_path / "raw.csv", names, written)
    proposal = propose_file(raw)
    assert (proposal.time.sure, proposal.time.columns) == ("sure", tuple(names.split(";")))
    found = through_its_map(proposal).log
    np.testing.assert_allclose(found.time_s, log.time_s - log.time_s[0], atol=1e-5)


def test_the_hours_that_excel_does_not_show_go_on(log: Log, tmp_path: Path) -> None:
    since_s = [3570.0 + time for time in log.time_s.tolist()]
    written = [f"{int(s % 3600 // 60):02d}:{s % 60:04.1f}" for s in since_s]
    raw = with_times(log, tmp_path / "raw.csv", "Time", written)
    proposal = propose_file(raw)
    assert proposal.time.why == "dates or times of day"
    found = through_its_map(proposal).log
    np.testing.assert_allclose(found.time_s, log.time_s - log.time_s[0], atol=0.051)


def test_rows_before_all_sensors_began_are_rows(log: Log, tmp_path: Path) -> None:
    raw = canonical(log, tmp_path / "raw.csv", ("time_s", "t [s]"))
    header, *rows = (line.split(",") for line in raw.read_text().splitlines())
    late = [i for i, name in enumerate(header) if name.startswith(("length", "swivel", "tension"))]
    for row in rows[:5]:
        for i in late:
            row[i] = ""
    raw.write_text("\n".join(",".join(row) for row in [header, *rows]) + "\n")
    proposal = propose_file(raw)
    assert proposal.raw.form is not None
    assert proposal.raw.form.header_line == 1
    assert len(proposal.raw.columns["length_1_m"].values) == len(rows)


@pytest.mark.parametrize("first", ["wxyz", "xyzw"])
def test_the_order_of_numbered_quaternions_is_found_by_physics(
    log: Log, robot: Robot, tmp_path: Path, first: str
) -> None:
    raw = with_quaternions(log, tmp_path / "raw.csv", first, 1.0)
    proposal = propose_file(raw, robot)
    attitude = next(line for line in proposal.lines if line.name == "attitude")
    assert (attitude.unit, attitude.sure) == (f"quaternion_{first}", "likely")
    attitude = proposed(raw)["attitude"]
    assert (attitude.unit, attitude.sure) == ("quaternion_wxyz", "guess")


def with_quaternions(log: Log, path: Path, order: str, one: float, odd: int = 0) -> Path:
    """Lengths and tensions beside q0 … q3, of norm ``one``; the last ``odd`` are of half of it."""
    parts = one * quaternions(log)[:, ["wxyz".index(axis) for axis in order]]
    parts[len(parts) - odd :] *= 0.5
    names = [f"{stem}_{i}{unit}" for stem, unit in (("length", "_m"), ("tension", "_N"))
             for i in (1, 2, 3, 4)]  # fmt: skip
    header = ["time_s", *names, "q0", "q1", "q2", "q3"]
    return table(path, header, log.time_s, log.length_m, log.tension_N, parts)


def test_quaternions_of_another_norm_are_scaled_counted_or_refused(
    log: Log, robot: Robot, tmp_path: Path
) -> None:
    raw, the_map = tmp_path / "raw.csv", tmp_path / "map.yaml"
    the_map.write_text(
        "format: cdprcal-map-1\ntime: {column: time_s, unit: s}\nchannels:\n"
        "  attitude: {columns: [q0, q1, q2, q3], unit: quaternion_wxyz}\n"
    )
    scaled_by = load_mapped(with_quaternions(log, raw, "wxyz", 32767.0), the_map, robot)
    assert scaled_by.findings == ()
    np.testing.assert_allclose(
        scaled_by.log.roll_pitch_yaw_rad[:, :2], log.roll_pitch_yaw_rad[:, :2], atol=1e-6
    )
    some = load_mapped(with_quaternions(log, raw, "wxyz", 1.0, odd=7), the_map, robot)
    (finding,) = some.findings
    assert finding.message == f"7 of {len(log)} quaternions are not of norm 1 and are left out"
    assert np.isfinite(some.log.roll_pitch_yaw_rad[:, 0]).sum() == len(log) - 7
    with_quaternions(log, raw, "wxyz", 3.0, odd=7)
    with pytest.raises(cdprcal.InputError, match=r"map.yaml: channels.attitude: .* but of 3 \(med"):
        load_mapped(raw, the_map, robot)


def test_a_unit_of_lengths_that_physics_contradicts_gives_way(tmp_path: Path) -> None:
    robot = cdprcal.load_robot("hang4")
    log = cdprcal.synthetic_log(robot, cdprcal.default_setpoints(robot, 2, 2, 2)).log
    renamed = r"^length_(\d)_m$", r"len_\1"
    raw = scaled(log, tmp_path / "raw.csv", {"length_": 1e3}, renamed)
    lengths = proposed(raw, robot)["lengths"]
    assert (lengths.unit, lengths.sure) == ("mm", "likely")


@pytest.mark.parametrize("every", [1, 10])
def test_what_is_stamped_late_is_set_back(tmp_path: Path, every: int) -> None:
    def roll(time_s: Any) -> Any:
        return 3.0 + 1.5 * np.sin(1.3 * time_s)  # it goes over ±π

    time_s = np.arange(0.0, 20.0, 0.02)
    lines = ["t,l,r,p,y"]
    for row, now in enumerate(time_s):
        angle = float(np.angle(np.exp(1j * roll(now - 0.085))))
        cells = f"{angle:.9f},0.1,0.2" if row % every == 0 else ",,"
        lines.append(f"{now:.3f},{now:.3f},{cells}")
    (tmp_path / "raw.csv").write_text("\n".join([*lines, ""]))
    (tmp_path / "map.yaml").write_text(
        "format: cdprcal-map-1\ntext: {}\ntime: {column: t}\nchannels:\n"
        '  lengths: {columns: ["l"], unit: m}\n'
        '  attitude: {columns: ["r", "p", "y"], unit: rad, delay_s: 0.085}\n'
    )
    log = load_mapped(tmp_path / "raw.csv", tmp_path / "map.yaml", None).log
    found = np.asarray(log.roll_pitch_yaw_rad[:, 0])
    there = np.isfinite(found)
    assert there.sum() > 0.97 * len(time_s) / every
    turns = np.asarray(found - roll(time_s))[there] / (2.0 * np.pi)
    assert turns == pytest.approx(np.round(turns), abs=2e-4 * every)
    assert log.length_m[:, 0] == pytest.approx(time_s)  # nothing else is late


def test_a_latency_is_no_part_of_the_time(log: Log, tmp_path: Path) -> None:
    whole = np.arange(len(log)).tolist()
    written = [f"{time};{time % 7}" for time in whole]
    raw = with_times(log, tmp_path / "raw.csv", "time_s;latency_ms", written)
    assert propose_file(raw).time.columns == ("time_s",)


@pytest.mark.parametrize("at_end", [",", ",,", ";", "\t", "\t\t", " ; "])
@pytest.mark.parametrize("of", ["all", "header", "rows"])
@pytest.mark.parametrize("units", [False, True])
def test_separators_at_the_end_of_lines_make_no_column(
    log: Log, tmp_path: Path, at_end: str, of: str, units: bool
) -> None:
    raw = canonical(log, tmp_path / "raw.csv")
    text = raw.read_text()
    if units:  # below the names, and none of the time
        names, _, below = text.partition("\n")
        parts = [name.rpartition("_") for name in names.split(",")[1:]]
        own = ",".join(["t", *(name for name, _, _ in parts)])
        text = f"{own}\n{','.join(['', *(unit for _, _, unit in parts)])}\n{below}"
    header, *rows = text.replace(",", at_end.strip(" ")[0]).splitlines()
    header += at_end if of != "rows" else ""
    rows = [row + at_end if of != "header" else row for row in rows]
    raw.write_text("\n".join([header, *rows, ""]))
    proposal = propose_file(raw)
    assert {"lengths", "swivels", "tensions", "attitude"} <= {line.name for line in proposal.lines}
    assert proposal.unused() == []


def test_files_of_other_kinds_are_no_reason_for_a_map(cli: Cli, log: Log, tmp_path: Path) -> None:
    raw, packed = german_excel(log, tmp_path), tmp_path / "raw.csv.gz"
    packed.write_bytes(gzip.compress(raw.read_bytes()))
    assert "--propose map.yaml writes one" in cli("check", "irma4", packed).stderr
    assert cli("check", "irma4", packed, "--propose", tmp_path / "map.yaml").code == 0
    ran = cli("check", "irma4", packed, "--map", tmp_path / "map.yaml")
    assert "can be used" in ran.stdout
    with zipfile.ZipFile(tmp_path / "raw.zip", "w") as files:
        files.write(raw)
    for more in ([], ["--propose", tmp_path / "map.yaml"]):
        ran = cli("check", "irma4", tmp_path / "raw.zip", *more)
        ran.refused("raw.zip: cannot be read: is a ZIP archive, as .npz is; unpack it")
        assert "--propose map.yaml" not in ran.stderr


def test_json_messages_of_mcap_are_topics(cli: Cli, log: Log, tmp_path: Path) -> None:
    writing = pytest.importorskip("mcap.writer")
    raw, the_map = tmp_path / "rig.mcap", tmp_path / "map.yaml"
    begin = 1_772_366_400_000_000_000
    with raw.open("wb") as stream:
        writer = writing.Writer(stream)
        writer.start()
        channels = [
            writer.register_channel(topic, kind, 0)
            for topic, kind in (("/winch", "json"), ("/ahrs", "json"), ("/camera", "protobuf"))
        ]
        for time, lengths, angles in zip(
            log.time_s.tolist(), log.length_m.tolist(), log.roll_pitch_yaw_rad.tolist(), strict=True
        ):
            stamp = begin + round(1e9 * time)
            rpy = dict(zip(("roll", "pitch", "yaw"), angles, strict=True))
            held: tuple[Any, ...] = (
                {"length": lengths, "state": "run", "spare": None},
                {"rpy": rpy},
                [],
            )
            for channel, message in zip(channels, held, strict=True):
                writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
        writer.finish()
    cli("check", "irma4", raw).refused("--propose map.yaml writes one")
    assert cli("check", raw, "--propose", the_map).code == 0
    read = load_mapped(raw, the_map, None).log
    np.testing.assert_allclose(read.time_s, log.time_s - log.time_s[0], atol=1e-9)
    np.testing.assert_array_equal(read.length_m, log.length_m)
    np.testing.assert_array_equal(read.roll_pitch_yaw_rad, log.roll_pitch_yaw_rad)
    raw.write_bytes(raw.read_bytes()[:-100])
    with pytest.raises(cdprcal.InputError, match=r"is no whole MCAP file .*; repair it"):
        propose_file(raw)


def test_a_log_as_mcap_is_proposed_whole(cli: Cli, log: Log, tmp_path: Path) -> None:
    raw, the_map = tmp_path / "run.mcap", tmp_path / "map.yaml"
    save_log(log, raw)
    assert cli("check", "irma4", raw, "--propose", the_map).code == 0
    read = load_mapped(raw, the_map, None).log
    np.testing.assert_array_equal(read.swivel_rad, log.swivel_rad)


def test_a_misspelt_topic_is_answered_by_those_there_are(
    cli: Cli, robot: Robot, log: Log, tmp_path: Path
) -> None:
    raw, the_map = bag_of_joints(log, tmp_path), tmp_path / "map.yaml"
    assert cli("check", "irma4", raw, "--propose", the_map).code in (0, 1)
    text = the_map.read_text()
    for old, new, said in (
        (
            'column: "/rig/winches"',
            'column: "/rig/winch"',
            "no topic '/rig/winch' with numbers; give one of those it has: /rig/winches, /platform",
        ),
        (
            "/platform/ahrs.orientation.x",
            "/platform/ahr.orientation.x",
            "has no column '/platform/ahr.orientation.x'; give one of those it has: '/platform/ah",
        ),
    ):
        the_map.write_text(text.replace(old, new))
        ran = cli("import", raw, "--map", the_map, "--robot", "irma4", "-o", tmp_path / "run.csv")
        ran.refused(said)
    the_map.write_text(text)
    ran = cli("import", raw, "--map", the_map, "-o", tmp_path / "run.csv")
    ran.refused("is a quaternion: give --robot")
    assert not (tmp_path / "run.csv").exists()


def test_a_session_names_its_robot_and_topics_that_are_there(
    cli: Cli, robot: Robot, log: Log, tmp_path: Path
) -> None:
    bag, out = tmp_path / "bag", tmp_path / "run.csv"
    save_bag(log, bag, robot.euler_convention)
    example = Path(__file__).resolve().parents[2] / "examples" / "canopen-simulated.yaml"
    session = tmp_path / "session.yaml"
    text = re.sub(r"(?ms)^ros2:.*?(?=^\S|\Z)", "", example.read_text())
    session.write_text(text + "\nros2: {imu: /imu/dat}\n")
    ran = cli("import", bag, "--robot", "irma4", "--session", session, "-o", out)
    ran.refused("nothing on /imu/dat, which the session names; it holds /imu/data, /joint")
    session.write_text(text.replace("robot: irma4", "robot: other"))
    ran = cli("import", bag, "--robot", "irma4", "--session", session, "-o", out)
    ran.refused("is the session of robot other, not irma4")
    session.write_text(text)
    assert cli("import", bag, "--robot", "irma4", "--session", session, "-o", out).code == 0
    ran = cli("import", bag, "--map", session, "--session", session, "-o", out)
    ran.refused("leave one of both out")
    assert cli("import", bag, "--robot", "ring3", "-o", out).code == 2  # three cables


def test_what_needs_an_extra_names_it(
    log: Log, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mat = simulink(log, tmp_path)
    (tmp_path / "x.parquet").write_bytes(b"PAR1 and more")
    (tmp_path / "x.h5").write_bytes(b"\x89HDF\r\n\x1a\n")
    with zipfile.ZipFile(tmp_path / "x.xlsx", "w") as file:
        file.writestr("xl/workbook.xml", "")
    for name in ("scipy", "pyarrow", "h5py", "openpyxl"):
        monkeypatch.setitem(sys.modules, name, None)
    files = {"mat": mat.name, "arrow": "x.parquet", "hdf5": "x.h5", "excel": "x.xlsx"}
    for extra, name in files.items():
        with pytest.raises(cdprcal.InputError, match=rf"pip install 'cdprcal\[{extra}\]'"):
            read_raw(tmp_path / name)


DAMAGED = {
    "x.mat": (b"MATLAB 5.0 MAT-file" + bytes(200), "is no whole MAT-file"),
    "x.csv": (b"once upon a time\nthere was\n", "is no table of numbers"),
    "empty.csv": (b"", "empty.csv: is empty; a log must start with a header"),
    "remarks.csv": (b"# my log\n\n", "remarks.csv: is empty; a log must"),
    "header.csv": (b"time_s,length_1_m\n", "header.csv: no samples follow the header; log again"),
    "units.csv": (b"t;l1\n[s];[mm]\n", "units.csv: no samples follow the header; log again"),
    "one.csv": (
        b"time_s,length_1_m\n0.5,1.5\n",
        "one.csv: a single sample follows the header; log for longer",
    ),
    "one line.json": (
        b'{"a":{' + b'"1":2.5,' * 30000 + b'"9":0}',
        "one line.json:1: has a cell of more than 131072",
    ),
    "label.json": (
        b'{"0":{"0":1,"1":2},"1":{"0":3,"1":4}}',
        "label.json: is JSON, but no table whose rows and columns can be told apart; write it as",
    ),
    "twice.json": (
        b'{"columns":["t","a","a"],"data":[[0,1,2],[1,2,3]]}',
        "twice.json: has two columns 'a'; rename one of them",
    ),
    "ragged.csv": (b"t,a\n0,1\n1,2\n2\n3,4\n4,5\n", "ragged.csv:4: has 1 columns, the header 2"),
    "long.csv": (
        b't,"' + b"x" * 140000 + b'"\n1,2\n2,3\n3,4\n',
        "long.csv:1: has a cell of more than 131072 characters, which no reading has; correct or",
    ),
    "lines.jsonl": (
        b'{"t": 0, "a": 1}\n{"t": 1, "a": 2}\n{"t": 2, "a": 3}\n' + b" " * 70000 + b"\n[1]\n{}\n",
        r"lines.jsonl:5: '\[1\]' is no JSON object as the lines before it; correct or delete",
    ),
    "value.txt": (
        b"Run {a: 1, b: 2}, {a: 2, b: 3}\nthen {a: 1, b: high}\n",
        "value.txt:2: b is 'high', which is not a number; write null where nothing was read",
    ),
    "braces.txt": (
        b"Run {a: 1, b: 2}, {a: 2, b: 3}\nthen\n{a: 1, b 3}\n",
        r"braces.txt:3: '{a: 1, b 3}' is no record like {a: 1.5, b: null}; correct or delete it",
    ),
    "names.csv": (
        b"time,cable,rope,wire,imu\nfirst,1,2,3,roll\n"
        + b"".join(b"%d,1,2,3,4\n" % i for i in range(9)),
        "names.csv:2: column 'time': 'first' is not a number; .*, or write all of a name into one",
    ),
    "scope.csv": (
        b"Name;Scope Project\n\nName;L1;Name;L2\nSampleTime[ms];10;SampleTime[ms];10\n\n"
        b"0;1,5;0;1,6\n10;1,5;10;high\n20;1,5;20;1,6\n",
        "scope.csv:7: 'high' is not a number; export again, or delete the line",
    ),
    "x.h5": (
        b"\x89HDF\r\n\x1a\n" + bytes(200),
        r"x.h5: is no whole HDF5 file \(OSError\); save it again",
    ),
    "words.csv": (b"red,green\n1,2\n2,3\n3,4\n", "no column is recognised"),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_a_file_that_is_none_is_refused(tmp_path: Path, name: str) -> None:
    content, words = DAMAGED[name]
    (tmp_path / name).write_bytes(content)
    if name.endswith(".mat"):
        pytest.importorskip("scipy")
    with pytest.raises(cdprcal.InputError, match=words):
        propose_file(tmp_path / name)


def test_records_may_lack_a_reading_and_hold_words(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("Run {of: us} {a:1, b:null, by:'me, too'}\n{a:-, b:2, by:'you'}\n")
    raw = read_raw(path)
    np.testing.assert_array_equal(raw.columns["a"].values, [1.0, np.nan])
    np.testing.assert_array_equal(raw.columns["b"].values, [np.nan, 2.0])
    assert raw.left_out == ("by",)


def test_json_lines_are_records_with_times_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    begin = datetime(2026, 3, 1, 12)
    stamps = [str(begin + timedelta(seconds=0.1 * i)) for i in range(5)]
    lines = [json.dumps({"stamp": s, "a": None if i == 1 else i, "note": "x"})
             for i, s in enumerate(stamps)]  # fmt: skip
    path.write_text("\n\n".join(lines))
    raw = read_raw(path)
    assert raw.columns["stamp"].is_clock
    np.testing.assert_allclose(np.diff(raw.columns["stamp"].values), 0.1, atol=1e-5)
    np.testing.assert_array_equal(raw.columns["a"].values, [0.0, np.nan, 2.0, 3.0, 4.0])
    assert raw.left_out == ("note",)
    assert raw.line is not None
    assert raw.line.tolist() == [1, 3, 5, 7, 9]


@pytest.mark.parametrize(
    "text",
    [
        "t,a,b\n" + "".join(f"{i},{i}.5,2\n" for i in range(9)) + "9,9.",
        "".join(f'{{"t": {i}, "a": 1}}\n' for i in range(10)) + '{"t": 10, "a',
        "".join(f"{{t: {i}, a: 1}}\n" for i in range(10)) + "{t: 10, a",
        "SampleTime[ms],1\n" + "".join(f"{i},2.5\n" for i in range(9)) + "9",
        "".join(f"{i // 2},{'ab'[i % 2]},2{i}.5\n" for i in range(10)) + "5,a",
    ],
    ids=["CSV", "JSON lines", "records", "TwinCAT Scope", "a reading a row"],
)
def test_a_last_line_that_is_cut_off_is_left_out_and_said_so(text: str, tmp_path: Path) -> None:
    path = tmp_path / "killed.txt"
    path.write_text(text)
    assert read_raw(path).cut_line == 11
    path.write_text(text.rpartition("\n")[0])
    assert read_raw(path).cut_line is None


@pytest.mark.parametrize("at_end", ["77.1,1817.5,18", "\0" * 512, "77.1,1817.5,18\0\0\0"])
def test_who_maps_a_log_is_told_of_its_cut_last_line(
    cli: Cli, log: Log, tmp_path: Path, at_end: str
) -> None:
    raw, the_map = SHAPES["kgf, unsaid"].make(log, tmp_path), tmp_path / "map.yaml"
    lines = len(raw.read_text().splitlines())
    raw.write_text(raw.read_text() + at_end)
    assert f"not used: line {lines + 1}, which is cut off" in (
        cli("check", "irma4", raw, "--propose", the_map).stdout
    )
    for command in (("check", "irma4", raw), ("import", raw, "-o", tmp_path / "run.csv")):
        ran = cli(*command, "--map", the_map)
        assert ran.code == 0, ran
        assert f"the last line, {lines + 1}, is cut off and left out" in ran.stdout + ran.stderr


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("t,a,b\n" + "".join(f"{i},{i}.5,2\n" for i in range(9)), 8),
        ("{t: 99, a: 1}\n" + "".join(f"{{t: {i}, a: 1}}\n" for i in range(9)), 10),
        ("SampleTime[ms],1\n" + "".join(f"{i},2.5\n" for i in range(9)), 8),
        ("t,name,value\n" + "".join(f"{i // 2},{'ab'[i % 2]},2{i}.5\n" for i in range(12)), 6),
    ],
    ids=["CSV", "records", "TwinCAT Scope", "a reading a row"],
)
def test_nul_bytes_in_the_middle_are_lost_data(text: str, rows: int, tmp_path: Path) -> None:
    """Without them a line may look whole: of the end of one row and the beginning of another."""
    path = tmp_path / "power-cut.txt"
    lines = text.splitlines(keepends=True)
    of_record = lines[5].startswith("{")
    lines[5] = "\0" * 40 + lines[5] if of_record else lines[5][:2] + "\0" * 40 + lines[5][2:]
    path.write_text("".join(lines))
    raw = read_raw(path)
    assert raw.lost == "line 6"
    assert {len(column.values) for column in raw.columns.values()} == {rows}
    lines[8] = "\0" + lines[8]
    path.write_text("".join(lines))
    assert read_raw(path).lost == "line 6 (and 1 more, the last 9)"


def test_who_maps_a_log_is_told_of_nul_bytes(cli: Cli, log: Log, tmp_path: Path) -> None:
    raw, the_map = SHAPES["kgf, unsaid"].make(log, tmp_path), tmp_path / "map.yaml"
    lines = raw.read_text().splitlines(keepends=True)
    lines[100] = lines[100][:20] + "\0" * 512 + lines[102][20:]
    raw.write_text("".join(lines))
    assert "not used: NUL bytes in line 101" in (
        cli("check", "irma4", raw, "--propose", the_map).stdout
    )
    ran = cli("import", raw, "-o", tmp_path / "run.csv", "--map", the_map)
    assert "NUL bytes in line 101: what was to be written there is lost" in ran.stderr
    assert len(cdprcal.read_log(tmp_path / "run.csv")) == len(log) - 1


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_utf_16_needs_no_mark(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "unmarked.csv"
    path.write_bytes(("Zeit,Länge\n" + "".join(f"{i},{i}.5\n" for i in range(9))).encode(encoding))
    raw = read_raw(path)
    assert (raw.lost, [*raw.columns]) == ("", ["Zeit", "Länge"])
    assert len(raw.columns["Zeit"].values) == 9


COLUMNS: dict[str, list[Any]] = {
    "t": [0.0, 0.1, 0.2],
    "length 1": [1.0, None, 3.0],
    "note": ["x", "y", "z"],
}
ROWS: list[dict[str, Any]] = [
    dict(zip(COLUMNS, row, strict=True)) for row in zip(*COLUMNS.values(), strict=True)
]


@pytest.mark.parametrize(
    "held",
    [
        {name: {str(i): cell for i, cell in enumerate(c)} for name, c in COLUMNS.items()},
        {str(i): row for i, row in enumerate(ROWS)},
        {"columns": [*COLUMNS], "index": [0, 1, 2], "data": [[*row.values()] for row in ROWS]},
        ROWS,
        {"schema": {"fields": [{"name": "t"}, {"name": "note"}]}, "data": ROWS},
        {"robot": "irma", "rate_Hz": 10, **COLUMNS},
    ],
    ids=["columns", "index", "split", "records", "table", "list"],
)
@pytest.mark.parametrize("indent", [None, 2])
def test_json_of_one_table_is_read(held: Any, indent: int | None, tmp_path: Path) -> None:
    path = tmp_path / "frame.json"
    path.write_text(json.dumps(held, indent=indent))
    raw = read_raw(path)
    assert list(raw.columns) == ["t", "length 1"]
    np.testing.assert_array_equal(raw.columns["t"].values, COLUMNS["t"])
    np.testing.assert_array_equal(raw.columns["length 1"].values, [1.0, np.nan, 3.0])


def test_a_data_frame_in_json_ends_in_a_map(log: Log, tmp_path: Path) -> None:
    """Its index is the time; names of two levels are one; columns may be lists of lists."""
    pandas = pytest.importorskip("pandas")
    path = tmp_path / "frame.json"
    stamps = pandas.Timestamp("2026-03-01 12:00") + pandas.to_timedelta(log.time_s, unit="s")
    names = pandas.MultiIndex.from_product([["length [mm]"], ["1", "2", "3", "4"]])
    frame = pandas.DataFrame(1e3 * log.length_m, index=stamps, columns=names)
    frame.to_json(path, date_format="iso")
    lists = {"time_ms": (1e3 * log.time_s).tolist(), "length_mm": (1e3 * log.length_m).tolist()}
    for text in (path.read_text(), json.dumps(lists)):
        path.write_text(text)
        proposal = propose_file(path)
        assert (proposal.time.sure, proposal.lines[0].unit) == ("sure", "mm")
        read = through_its_map(proposal).log
        np.testing.assert_allclose(read.length_m, log.length_m, atol=1e-6)
        np.testing.assert_allclose(read.time_s, log.time_s - log.time_s[0], atol=1e-3)
    path.write_text(pandas.DataFrame(log.length_m).to_json(orient="values"))
    assert list(read_raw(path).columns) == [f"column_{i}" for i in range(1, 5)]


def one_a_row(rows: list[tuple[Any, ...]]) -> str:
    return "".join(",".join(map(str, row)) + "\n" for row in rows)


def test_a_reading_a_row_is_a_column_a_signal(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    rows: list[tuple[Any, ...]] = [("t", "quantity", "cable", "value")]
    rows += [(0.1 * k, q, c, 10 * k + c) for k in range(20) for q in ("length", "force")
             for c in (1, 2)]  # fmt: skip
    path.write_text(one_a_row(rows))
    raw = read_raw(path)
    assert list(raw.columns) == ["t", "length.1", "length.2", "force.1", "force.2"]
    np.testing.assert_allclose(raw.columns["t"].values, 0.1 * np.arange(20))
    np.testing.assert_array_equal(raw.columns["force.2"].values, 10.0 * np.arange(20) + 2.0)


def test_signals_with_times_of_their_own_stand_at_those_of_the_longest(tmp_path: Path) -> None:
    """Columns that each logger writes when it likes: rows are those of one, the others nearest."""
    random = np.random.default_rng(1)
    path, times = tmp_path / "long.csv", {}
    rows: list[tuple[Any, ...]] = []
    for name, count in (("a", 200), ("b", 100)):
        times[name] = np.sort(random.uniform(0.0, 10.0, count)).round(4)
        rows += [(t, name, 3.0 * t) for t in times[name].tolist()]
    path.write_text(one_a_row(rows))
    columns = read_raw(path).columns
    np.testing.assert_array_equal(columns["time"].values, times["a"])
    read = columns["b"].values
    there = np.isfinite(read)
    assert there.sum() > 100
    np.testing.assert_allclose(read[there] / 3.0, times["a"][there], atol=0.06)


def test_a_reading_a_row_in_json_and_excel(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    held = [(0.1 * k, name, k + at) for k in range(10) for at, name in enumerate(("a", "b"))]
    lines = tmp_path / "long.jsonl"
    keys = ("ts", "signal", "value")
    objects = [dict(zip(keys, row, strict=True)) for row in held]
    lines.write_text("\n".join(map(json.dumps, objects)))
    (tmp_path / "long.json").write_text(json.dumps(objects))
    book = openpyxl.Workbook()
    for row in (keys, *held):
        book.active.append(row)
    book.save(tmp_path / "long.xlsx")
    for path in (lines, tmp_path / "long.json", tmp_path / "long.xlsx"):
        columns = read_raw(path).columns
        assert list(columns) == ["ts", "a", "b"]
        np.testing.assert_array_equal(columns["b"].values, np.arange(10) + 1.0)


def test_a_table_of_signals_is_offered_a_map(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    rows: list[tuple[Any, ...]] = [("time_s", "signal", "value")]
    rows += [(0.1 * k, name, k) for k in range(30) for name in ("length_1", "force_1")]
    path.write_text(one_a_row(rows))
    cli("check", "irma4", path).refused("--propose map.yaml")


def test_a_reading_that_is_none_is_named_by_its_line(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    rows: list[tuple[Any, ...]] = [(0.1 * k, name, k) for k in range(30) for name in ("a", "b")]
    rows[7] = (0.3, "b", "n/a")
    path.write_text(one_a_row(rows))
    assert np.isnan(read_raw(path).columns["b"].values[3])
    rows[7] = (0.3, "b", "broken")
    path.write_text(one_a_row(rows))
    with pytest.raises(cdprcal.InputError, match=r"long\.csv:8: 'broken' is not a number; leave"):
        read_raw(path)


@pytest.mark.parametrize(
    "row",
    [
        lambda k: (0.1 * k, "rest" if k % 20 < 10 else "move", k, 2 * k, 3 * k),  # states
        lambda k: (0.1 * k, "run 7", k),  # one signal
        lambda k: (0.1 * k, f"note {k}", k),  # a name for every row
    ],
)
def test_words_beside_readings_make_no_signals(
    tmp_path: Path, row: Callable[[int], tuple[Any, ...]]
) -> None:
    path = tmp_path / "wide.csv"
    names = ("t", "note", "length_1", "length_2", "length_3")[: len(row(0))]
    path.write_text(one_a_row([names, *map(row, range(60))]))
    assert list(read_raw(path).columns) == list(names)


def test_arrays_of_other_rows_are_left_out_and_named(cli: Cli, log: Log, tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    path = tmp_path / "run.mat"
    held = {"t": log.time_s, "L": log.length_m, "imu": {"rpy": np.zeros((1500, 3))}}
    geometry = {f"anchor_{i}": np.zeros(3) for i in range(20)}  # more vectors than readings
    io.savemat(path, {**{k: np.array(v) for k, v in held.items() if k != "imu"},
                      "imu": held["imu"], "g": geometry})  # fmt: skip
    proposal = propose_file(path)
    assert proposal.lines[0].columns == ("L.1", "L.2", "L.3", "L.4")
    assert proposal.unused()[:2] == ["imu.rpy.1 (1500 rows)", "imu.rpy.2 (1500 rows)"]
    assert '# not used: "imu.rpy.1 (1500 rows)"' in proposal.text()


def test_arrow_holds_more_kinds_than_numbers(log: Log, tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    from pyarrow import parquet as pq

    path = tmp_path / "run.parquet"
    since = np.round(1e9 * np.asarray(log.time_s)).astype("timedelta64[ns]")
    stamps = np.datetime64("2026-03-01T12:00:00", "ns") + since
    lengths = np.asarray(log.length_m).tolist()
    cents = [Decimal(f"{tension:.2f}") for tension in log.tension_N[:, 0].tolist()]
    columns = {
        "stamp": pa.array([None, *stamps[1:]], type=pa.timestamp("ns")),
        "since": pa.array(since),
        "length": pa.array([*lengths[:-1], None], type=pa.large_list(pa.float64())),
        "ends": pa.array([dict(zip("ab", row[:2], strict=True)) for row in lengths]),
        "load": pa.array(cents),
        "phase": pa.array(["run"] * len(log)),
        "ragged": pa.array([[1.0] * (1 + i % 2) for i in range(len(log))]),
    }
    pq.write_table(pa.table(columns), path)
    raw = read_raw(path)
    assert raw.left_out == ("phase", "ragged")
    np.testing.assert_allclose(raw.columns["since"].values, log.time_s - log.time_s[0], atol=1e-6)
    assert np.isnan(raw.columns["stamp"].values[0])
    assert raw.columns["stamp"].values[1] == 0.0
    np.testing.assert_allclose(raw.columns["length.4"].values[:-1], log.length_m[:-1, 3])
    assert np.isnan(raw.columns["length.4"].values[-1])
    np.testing.assert_allclose(raw.columns["ends.b"].values, log.length_m[:, 1])
    np.testing.assert_allclose(raw.columns["load"].values, log.tension_N[:, 0], atol=0.006)
    pq.write_table(pa.table({"phase": columns["phase"]}), path)
    with pytest.raises(cdprcal.InputError, match=r"no columns of numbers; write .* It holds phase"):
        read_raw(path)


def test_a_clock_that_begins_again_begins_another_run(tmp_path: Path) -> None:
    raw, the_map = tmp_path / "raw.csv", tmp_path / "map.yaml"
    the_map.write_text(MAP)
    rows = [f"{100 * i},{n},2,3,4" for n, count in ((1, 50), (2, 30)) for i in range(count)]
    raw.write_text("\n".join(["t,a,b,c,d", *rows, ""]))
    file = load_mapped(raw, the_map, None)
    np.testing.assert_allclose(file.log.time_s, 0.1 * np.arange(30))
    np.testing.assert_allclose(file.log.length_m[:, 0], 0.002)
    (finding,) = file.findings
    assert finding.message == "the time begins again at line 52: what stands before is left out"
    assert file.line_of(0) == 52
    # Set back for a moment, it is one run.
    raw.write_text("\n".join(["t,a,b,c,d", *rows[:60], ""]))
    file = load_mapped(raw, the_map, None)
    assert len(file.log) == 50
    assert [finding.code for finding in file.findings] == ["same_time"]


def test_damaged_tables_of_arrow_are_refused(log: Log, tmp_path: Path) -> None:
    path = parquet(log, tmp_path)
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(cdprcal.InputError, match="is no whole file of its kind"):
        read_raw(path)


def test_a_cut_bag_is_refused(log: Log, tmp_path: Path) -> None:
    file = next(bag_of_arrays(log, tmp_path).glob("*.mcap"))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(cdprcal.InputError, match="is no whole ROS 2 bag"):
        read_raw(file.parent)


@pytest.mark.parametrize(
    ("name", "kind", "index", "unit"),
    [
        ("Seilkraft 3 [N]", "tensions", "3", "N"),
        ("cable_length_2_mm", "lengths", "2", "mm"),
        ("L4", "lengths", "4", None),
        ("tensionRef1", "tension_setpoints", "1", None),
        ("Wire2.Speed", "none", "2", None),
        ("motor_current_1", "none", "1", None),
        ("Nickwinkel (°)", "pitch", "", "deg"),
        ("t_ms", "time", "", "ms"),
        ("yaw", "yaw", "", None),
        ("spindle", "", "", None),
        ("tension_1_kN", "tensions", "1", "kN"),
        ("F1_kN", "tensions", "1", "kN"),
        ("F1kN", "tensions", "1", "kN"),
        ("F1 [kN]", "tensions", "1", "kN"),
        ("tension_1_KN", "tensions", "1", "kN"),
        ("tension_1_mN", "tensions", "1", "mN"),
        ("tension_1_MN", "tensions", "1", "MN"),
        ("F1 [MN]", "tensions", "1", "MN"),
        ("tension_1_daN", "tensions", "1", "daN"),
        ("cell2.forcekN", "tensions", "2", "kN"),
        ("cell2.forceN", "tensions", "2", "N"),
        ("cell2.forceMean", "tensions", "2", None),
        ("TENSION 4", "tensions", "4", None),
        ("TENSION", "tensions", "", None),
        ("rope3LengthMm", "lengths", "3", "mm"),
        ("Zugspannung F1 [N]", "tensions", "1", "N"),
        ("wire_force_disp_1 [N]", "tensions", "1", "N"),
        ("tension_setpoint_1_N", "tension_setpoints", "1", "N"),
        ("Seil 2 Sollkraft [N]", "tension_setpoints", "2", "N"),
        ("current_position_1", "lengths", "1", None),
        ("/robot_state/cable_length/1", "lengths", "1", None),
        ("Drive1.ActPos [mm]", "lengths", "1", "mm"),
        ("Drive1.Force [N]", "tensions", "1", "N"),
        ("Drive1.Current", "none", "1", None),
        ("cable_1_state", "none", "1", None),
        ("drive_mode_cable_1", "none", "1", None),
        ("position_error_1", "none", "1", None),
    ],
)
def test_names_are_taken_apart(name: str, kind: str, index: str, unit: str | None) -> None:
    found = taken_apart(name)
    assert (found.kind, found.index, found.unit) == (kind, index, unit)


def test_the_groups_and_units_are_those_of_the_library() -> None:
    assert {group.field for group in GROUPS.values()} == set(sensors.LOG_GROUPS)
    assert {group.unit for group in GROUPS.values()} < set(UNITS)
    page = (Path(__file__).resolve().parents[2] / "docs" / "your-log.md").read_text("utf-8")
    assert all(f"`{' '.join(units)}`" in page for units in UNITS.values())
    for dimension, units in UNITS.items():
        assert units[dimension.replace("_s", "/s")] == 1.0
        assert all(factor(dimension, unit) == units[unit] for unit in units)
        assert all(unit_named(unit) == unit for unit in units if unit != "g")  # alone it is a force
    assert factor("N", "kg") == pytest.approx(9.80665)
    assert factor("rad", "°") == pytest.approx(math.pi / 180.0)
    assert factor("m", 0.05) == 0.05
    assert factor("m", "N") is None
    for order in QUATERNIONS.values():
        assert sorted(order) == [0, 1, 2, 3]


def scope_of(log: Log, separator: str, decimal: str) -> str:
    """As TwinCAT Scope exports a log of which the attitude is sampled half as often."""
    attitude = log.roll_pitch_yaw_rad[::2]
    signals = {
        **{f"MAIN.L[{i + 1}]": log.length_m[:, i] for i in range(log.length_m.shape[1])},
        **{f"MAIN.T[{i + 1}]": log.tension_N[:, i] for i in range(log.tension_N.shape[1])},
        **{name: attitude[:, k] for k, name in enumerate(("Roll", "Pitch", "Yaw"))},
    }
    header = [
        ["Name", "YT Scope Project"],
        [],
        [cell for name in signals for cell in ("Name", name)],
        ["Data-Type", "LREAL"] * len(signals),
        ["SampleTime[ms]", "100"] * len(signals),
        [cell for i in range(len(signals)) for cell in ("SymbolName", f"symbol {i}")],
        [],
    ]
    rows = []
    for i in range(len(log.time_s)):
        row = []
        for values in signals.values():
            time_ms = 1e3 * log.time_s[:: 1 if len(values) == len(log.time_s) else 2]
            here = i < len(values)
            row += [f"{time_ms[i]:.3f}", repr(float(values[i]))] if here else ["", ""]
        rows.append([cell.replace(".", decimal) for cell in row])
    return "\r\n".join(separator.join(row) for row in [*header, *rows])


@pytest.mark.parametrize(("separator", "decimal"), [("\t", "."), (";", ","), (",", ".")])
def test_an_export_of_twincat_scope_has_a_time_for_every_signal(
    log: Log, tmp_path: Path, separator: str, decimal: str
) -> None:
    path = tmp_path / "scope.csv"
    path.write_text(scope_of(log, separator, decimal), encoding="utf-16")
    raw = read_raw(path)
    assert list(raw.columns)[:2] == ["time [ms]", "MAIN.L[1]"]
    assert list(raw.columns)[-3:] == ["Roll", "Pitch", "Yaw"]
    np.testing.assert_allclose(raw.columns["time [ms]"].values, 1e3 * np.array(log.time_s))
    np.testing.assert_array_equal(raw.columns["MAIN.T[2]"].values, log.tension_N[:, 1])
    np.testing.assert_array_equal(raw.columns["Yaw"].values[::2], log.roll_pitch_yaw_rad[::2, 2])
    assert np.isnan(raw.columns["Yaw"].values[1::2]).all()


def test_arrays_of_two_rates_stand_on_the_times_of_both(log: Log, tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    path = tmp_path / "run.mat"
    time_s = np.array(log.time_s)
    slow = np.arange(0, len(time_s), 3)
    held: dict[str, Any] = {
        "drives": {"time": time_s, "L": np.array(log.length_m)},
        "imu": {"time": time_s[slow], "rpy": np.array(log.roll_pitch_yaw_rad)[slow]},
        "anchors": np.eye(4)[:, :3],
    }
    io.savemat(path, held)
    raw = read_raw(path)
    assert list(raw.columns) == [
        "drives.time",
        *(f"drives.L.{i}" for i in range(1, 5)),
        *(f"imu.rpy.{i}" for i in range(1, 4)),
    ]
    np.testing.assert_array_equal(raw.columns["drives.time"].values, time_s)
    np.testing.assert_array_equal(raw.columns["drives.L.2"].values, log.length_m[:, 1])
    yaw = raw.columns["imu.rpy.3"].values
    np.testing.assert_array_equal(yaw[slow], log.roll_pitch_yaw_rad[slow, 2])
    assert np.isfinite(yaw).sum() == len(slow)
    # Clocks that do not go over the same span are not one.
    held["imu"]["time"] = 1e3 * time_s[slow]
    io.savemat(path, held)
    assert "imu.time (201 rows)" in read_raw(path).left_out
