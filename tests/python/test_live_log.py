"""Logs that are written while the robot moves, and what a crash or a full disk leaves of them."""

from __future__ import annotations

import json
import os
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal import InputError, RobotSample
from cdprcal.io import AcquisitionInputs, LiveLog, load_log, open_live_log, read_inputs
from cdprcal.io.damaged_csv import load_log_leniently

INPUTS = AcquisitionInputs(
    cdprcal.builtin_robot_yaml("irma4"),
    "# cdprcal plan\n# robot: irma4\n\npurpose,position_x_m\nmeasure,0.4\n",
    {"backend": "simulated", "seed": 7, "effects": ["mass=0.1"], "name": "Kübler 4"},
)
KINDS = pytest.mark.parametrize("kind", ["csv", "mcap"])
RATE_HZ = 10.0


def sample_at(row: int) -> RobotSample:
    random = np.random.default_rng(row)
    return RobotSample(
        time_s=row / RATE_HZ,
        length_m=random.normal(size=4),
        swivel_rad=random.normal(size=4),
        tension_N=random.uniform(50, 150, size=4),
        roll_pitch_yaw_rad=random.normal(size=3),
    )


def setpoint_at(row: int) -> np.ndarray:
    return np.array([100.0, 90.0, 80.0, 70.0]) + 0.1 * row


def assert_rows(log: cdprcal.Log, count: int) -> None:
    """The first ``count`` samples, to the last bit."""
    assert len(log) == count
    for row in range(count):
        sample = sample_at(row)
        assert log.time_s[row] == sample.time_s
        np.testing.assert_array_equal(log.length_m[row], sample.length_m)
        np.testing.assert_array_equal(log.swivel_rad[row], sample.swivel_rad)
        np.testing.assert_array_equal(log.tension_N[row], sample.tension_N)
        np.testing.assert_array_equal(log.tension_setpoint_N[row], setpoint_at(row))
        np.testing.assert_array_equal(log.roll_pitch_yaw_rad[row], sample.roll_pitch_yaw_rad)


@KINDS
def test_what_was_written_is_read_back_with_its_inputs(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"run.{kind}"
    log = open_live_log(path, 4, INPUTS, RATE_HZ)
    log.event({"time_s": 0.0, "state": "recording", "setpoint": 1})
    for row in range(40):
        log.sample(sample_at(row), setpoint_at(row))
        if row == 20:
            log.event({"time_s": 2.0, "state": "moving", "setpoint": 2})
    log.event({"time_s": 4.0, "state": "holding", "setpoint": 2, "reason": "it is enough"})
    log.close()
    file = load_log(path)
    assert file.format == kind
    assert file.findings == ()
    assert_rows(file.log, 40)
    assert read_inputs(path) == INPUTS
    assert cdprcal.parse_robot(INPUTS.robot_yaml, "log").cable_count == 4
    if kind == "csv":  # findings name the right line, comments or not
        lines = path.read_text().splitlines()
        for row in (0, 20, 21, 39):
            number = file.line_of(row)
            assert number is not None
            assert lines[number - 1].startswith(f"{row / RATE_HZ!r},")


@KINDS
def test_absent_sensors_stay_absent(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"run.{kind}"
    log = open_live_log(path, 2, INPUTS, RATE_HZ)
    log.sample(
        RobotSample(time_s=0.0, length_m=[1.0, np.nan], swivel_rad=[], tension_N=[5.0, 6.0]),
        np.array([5.0, 6.0]),
    )
    log.close()
    read = load_log(path).log
    np.testing.assert_array_equal(read.length_m, [[1.0, np.nan]])
    np.testing.assert_array_equal(read.tension_N, [[5.0, 6.0]])
    for absent in (read.swivel_rad, read.roll_pitch_yaw_rad):
        assert absent.size == 0 or np.isnan(absent).all()


@KINDS
def test_a_log_is_never_overwritten(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"run.{kind}"
    path.write_text("precious")
    with pytest.raises(InputError, match="exists already"):
        open_live_log(path, 4, INPUTS, RATE_HZ)
    assert path.read_text() == "precious"
    with pytest.raises(InputError, match="cannot be written"):
        open_live_log(tmp_path / "nowhere" / "run.csv", 4, INPUTS, RATE_HZ)


@KINDS
def test_every_row_is_on_its_way_to_the_disk_within_a_second(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"run.{kind}"
    log = open_live_log(path, 4, INPUTS, RATE_HZ)
    for row in range(60):
        log.sample(sample_at(row), setpoint_at(row))
        if row < 10:
            continue
        # What another process would read now.
        seen = load_log(path).log
        assert row + 1 - len(seen) < 1.0 * RATE_HZ
        assert_rows(seen, len(seen))
    assert read_inputs(path) == INPUTS
    log.close()


@contextmanager
def disk_of(size: int) -> Iterator[None]:
    """No file may grow beyond ``size`` bytes: writes fail as on a full disk."""
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


def rows_until_it_fails(log: LiveLog) -> int:
    row = 0
    with suppress(OSError):
        while row < 1000:
            log.sample(sample_at(row), setpoint_at(row))
            row += 1
    assert row < 1000, "the disk did not fill"
    return row


@KINDS
@pytest.mark.parametrize("size", [7000, 20000, 20001, 20050, 24321])
def test_a_full_disk_leaves_a_log_that_ends_with_a_whole_row(
    kind: str, size: int, tmp_path: Path
) -> None:
    path = tmp_path / f"run.{kind}"
    log = open_live_log(path, 4, INPUTS, RATE_HZ)
    with disk_of(size):
        written = rows_until_it_fails(log)
        log.close()
    assert path.stat().st_size <= size
    read = load_log(path).log
    assert written - len(read) < 1.0 * RATE_HZ
    assert_rows(read, len(read))
    assert read_inputs(path) == INPUTS


def test_a_disk_that_is_full_at_once_is_said_at_once(tmp_path: Path) -> None:
    for name in ("run.csv", "run.mcap"):
        with disk_of(100), pytest.raises(InputError, match="cannot be written"):
            open_live_log(tmp_path / name, 4, INPUTS, RATE_HZ)


@KINDS
def test_a_log_cut_anywhere_is_read_as_far_as_it_goes(kind: str, tmp_path: Path) -> None:
    """As after a power cut, which may also cut a row."""
    whole = tmp_path / f"whole.{kind}"
    log = open_live_log(whole, 4, INPUTS, RATE_HZ)
    sizes = []
    for row in range(50):
        log.sample(sample_at(row), setpoint_at(row))
        sizes.append(whole.stat().st_size)
    log.event({"time_s": 5.0, "state": "done", "setpoint": 1})
    log.close()
    data = whole.read_bytes()
    path = tmp_path / f"cut.{kind}"
    for size in np.random.default_rng(5).integers(sizes[12], len(data) - 1, size=40).tolist():
        path.write_bytes(data[:size])
        file = load_log_leniently(path)
        assert file.findings
        there = sum(size >= end for end in sizes)
        assert there - len(file.log) < 1.0 * RATE_HZ
        assert_rows(file.log, len(file.log))
        assert read_inputs(path) == INPUTS


def test_a_log_that_was_not_acquired_has_no_inputs(log_path: Path, tmp_path: Path) -> None:
    assert read_inputs(log_path) is None
    damaged = tmp_path / "damaged.csv"
    damaged.write_text("# cdprcal acquisition\n# robot| a\n# plan| b\n# settings| {\ntime_s\n")
    with pytest.raises(InputError, match="settings"):
        read_inputs(damaged)


@KINDS
def test_an_unfinished_log_is_said_to_be_so(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"run.{kind}"
    log = open_live_log(path, 4, INPUTS, RATE_HZ)
    log.event({"time_s": 0.0, "state": "recording", "setpoint": 1})
    for row in range(20):
        log.sample(sample_at(row), setpoint_at(row))
    child = os.fork()  # a process that dies with the file open
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)
    codes = {finding.code for finding in load_log(path).findings}
    assert codes & {"unfinished", "truncated"}
    log.close()


def test_events_of_an_mcap_log_are_a_channel_of_their_own(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    path = tmp_path / "run.mcap"
    log = open_live_log(path, 4, INPUTS, RATE_HZ)
    log.event({"time_s": 0.0, "state": "recording", "setpoint": 1})
    log.sample(sample_at(0), setpoint_at(0))
    log.close()
    with path.open("rb") as stream:
        reader = make_reader(stream)
        found = {
            channel.topic: (schema, json.loads(message.data))
            for schema, channel, message in reader.iter_messages()
        }
        assert {a.name for a in reader.iter_attachments()} == set(INPUTS.files())
    assert found.keys() == {"/cdprcal/sample", "/cdprcal/event"}
    for schema, message in found.values():
        assert schema is not None
        assert schema.encoding == "jsonschema"
        properties = json.loads(schema.data)["properties"]
        assert message.keys() <= properties.keys()
