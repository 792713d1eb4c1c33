"""The robot's own log: read as it is, damage named by line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal import InputError
from cdprcal.io import LogFile, load_log, sniff_format
from conftest import changed, raw_text

GROUPS = ("time_s", "length_m", "swivel_rad", "tension_N", "tension_setpoint_N")


def load(tmp_path: Path, data: str | bytes) -> LogFile:
    path = tmp_path / "robot.log"
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return load_log(path)


@pytest.fixture(scope="module")
def short(log: cdprcal.Log) -> cdprcal.Log:
    """The first fifty samples of the synthetic run."""
    names = (*GROUPS, "roll_pitch_yaw_rad")
    return cdprcal.Log(**{name: getattr(log, name)[:50] for name in names})


@pytest.fixture(scope="module")
def text(short: cdprcal.Log) -> str:
    return raw_text(short)


def codes(file: LogFile) -> list[str]:
    return [finding.code for finding in file.findings]


def assert_same(log: cdprcal.Log, expected: cdprcal.Log) -> None:
    for name in GROUPS:
        np.testing.assert_array_equal(getattr(log, name), getattr(expected, name), name)
    np.testing.assert_allclose(
        log.roll_pitch_yaw_rad, expected.roll_pitch_yaw_rad, rtol=1e-14, atol=1e-16
    )


def test_readings_are_taken_as_they_are(tmp_path: Path, text: str, short: cdprcal.Log) -> None:
    file = load(tmp_path, text)
    assert file.format == "raw"
    assert file.findings == ()
    assert_same(file.log, short)
    assert file.line is not None
    assert [file.line_of(0), file.line_of(1), file.line_of(49)] == [1, 7, 49 * 6 + 1]


def test_windows_line_ends_change_nothing(tmp_path: Path, text: str, short: cdprcal.Log) -> None:
    assert_same(load(tmp_path, text.replace("\n", "\r\n")).log, short)


@pytest.mark.parametrize("where", [0, 60, 300])
def test_nul_padding_between_lines_loses_nothing(
    tmp_path: Path, text: str, short: cdprcal.Log, where: int
) -> None:
    lines = text.splitlines(keepends=True)
    file = load(tmp_path, "".join(lines[:where]) + "\0" * 500 + "".join(lines[where:]))
    assert codes(file) == ["nul_padding"]
    assert "500 NUL bytes" in file.findings[0].message
    assert file.findings[0].line == where + 1
    assert_same(file.log, short)


def test_a_line_that_nul_bytes_swallowed_is_left_out(tmp_path: Path, text: str) -> None:
    lines = text.splitlines(keepends=True)
    lines[12] = lines[12][:20] + "\0" * 40 + "\n"
    file = load(tmp_path, "".join(lines))
    assert codes(file) == ["nul_padding", "damaged_line"]
    assert {finding.line for finding in file.findings} == {13}
    assert np.isnan(file.log.length_m[2]).tolist() == [True, False, False, False]


def test_a_cut_last_line_is_left_out(tmp_path: Path, text: str) -> None:
    for cut in (1, 5, 20):
        file = load(tmp_path, text[:-cut])
        assert codes(file) == ["truncated"]
        assert file.findings[0].line == 300


def test_a_number_cut_short_is_not_taken_for_the_number(tmp_path: Path, text: str) -> None:
    lines = text.splitlines(keepends=True)
    file = load(tmp_path, "".join(lines[:-2])[:-3])
    assert np.isnan(file.log.swivel_rad[-1, 3])


def test_ragged_and_foreign_lines_are_named_and_left_out(
    tmp_path: Path, text: str, short: cdprcal.Log
) -> None:
    lines = text.splitlines(keepends=True)
    lines[10:10] = ["3,1,2\n", "5,1,2,3,4,5\n", "hello\n", "8,1,2,3\n", "\n"]
    file = load(tmp_path, "".join(lines))
    assert codes(file) == ["ragged_line", "ragged_line", "unknown_line"]
    assert [finding.line for finding in file.findings] == [11, 12, 13]
    assert_same(file.log, short)


def test_missing_sensors_are_absent(tmp_path: Path, text: str) -> None:
    lines = text.splitlines(keepends=True)
    without_attitude = load(tmp_path, "".join(x for x in lines if not x.startswith("5"))).log
    assert without_attitude.roll_pitch_yaw_rad.shape == (50, 0)
    without_cable = load(
        tmp_path, "".join(x for x in lines if not (x[0] == "3" and x.split(",")[2] == "2"))
    ).log
    assert without_cable.cable_count == 4
    assert np.isnan(without_cable.length_m).all(axis=0).tolist() == [False, False, True, False]
    only_attitude = load(tmp_path, "".join(x for x in lines if x.startswith("5"))).log
    assert only_attitude.cable_count == 0


def test_blank_and_nan_readings_are_absent(tmp_path: Path, text: str) -> None:
    lines = text.splitlines(keepends=True)
    for blank in ("", "nan"):
        cells = lines[0].split(",")
        cells[7] = blank
        log = load(tmp_path, "".join([",".join(cells), *lines[1:]])).log
        assert np.isnan(log.length_m).sum() == 1
        assert np.isnan(log.length_m[0, 0])


def test_time_that_goes_back_is_an_error_with_its_line(
    tmp_path: Path, text: str, short: cdprcal.Log
) -> None:
    lines = text.splitlines(keepends=True)
    file = load(tmp_path, "".join(lines[:120] + lines[60:90] + lines[120:]))
    assert codes(file) == ["time_not_increasing"]
    assert (file.findings[0].severity, file.findings[0].line) == ("error", 121)
    assert "5 samples" in file.findings[0].message
    assert_same(file.log, short)


def test_a_repeated_cable_line_is_named_and_the_last_is_taken(tmp_path: Path, text: str) -> None:
    lines = text.splitlines(keepends=True)
    cells = lines[0].split(",")
    cells[7] = "42.0"
    file = load(tmp_path, "".join([lines[0], ",".join(cells), *lines[1:]]))
    assert codes(file) == ["repeated_line"]
    assert file.findings[0].line == 2
    assert file.log.length_m[0, 0] == 42


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        (7, "abc", r"robot\.log:7: cable length: 'abc' is not a number"),
        (9, "1.2.3", r"robot\.log:7: tension: '1.2.3' is not a number"),
        (13, "inf", r"robot\.log:7: swivel angle: is infinite"),
        (2, "8", r"robot\.log:7: cable id: .* not 8"),
        (2, "0.5", r"robot\.log:7: cable id: .* not 0.5"),
        (2, "nan", r"robot\.log:7: cable id: .* not nan"),
    ],
)
def test_text_in_a_number_is_an_error_with_file_line_and_field(
    tmp_path: Path, text: str, column: int, value: str, words: str
) -> None:
    lines = text.splitlines()
    cells = lines[6].split(",")
    cells[column] = value
    lines[6] = ",".join(cells)
    with pytest.raises(InputError, match=words):
        load(tmp_path, "\n".join(lines) + "\n")


def test_a_file_without_a_complete_line_is_refused(tmp_path: Path) -> None:
    for data in ("6,1,2\n", "3,1,2\n", "3,1.0,0,9"):
        with pytest.raises(InputError, match="no complete cable"):
            load(tmp_path, data)


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (b"3,184.922,0,9\n", "raw"),
        (b"\0\0\0\0\n5,1.0,0,0,0\n", "raw"),
        (b"\r\n 6,-1.0e3,0\n", "raw"),
        (b"\0" * 70000 + b"3,1.0,0,9\n", "raw"),
        (b"time_s,length_1_m\n0,1\n", "csv"),
        (b"# made by hand\ntime_s\n0\n", "csv"),
        (b"", "csv"),
        (b"\x89MCAP0\r\n", "mcap"),
    ],
)
def test_the_kind_of_log_is_told_by_content(data: bytes, kind: str) -> None:
    assert sniff_format(data) == kind


@pytest.mark.parametrize(("name", "samples", "first"), [
    ("sc_8_final.log", 1345, 65),
    ("sc_27_medium_a.log", 4964, 122),
])  # fmt: skip
def test_measured_logs(shared_data: Path, name: str, samples: int, first: int) -> None:
    file = load_log(shared_data / "irma4" / name)
    assert file.findings == ()
    log = file.log
    assert (len(log), log.cable_count) == (samples, 4)
    assert [len(s) for s in cdprcal.segments(log)] == [first, samples - first]
    for group in (*GROUPS, "roll_pitch_yaw_rad"):
        assert np.isfinite(getattr(log, group)).all()


def test_the_measured_run_is_the_one_the_authors_cleaned(shared_data: Path) -> None:
    """Same tensions and attitude to the last digit; the relative channels differ as they may."""
    raw = load_log(shared_data / "irma4" / "sc_8_final.log").log
    cleaned = load_log(shared_data / "irma4" / "trial_a.csv").log
    run = slice(cdprcal.segments(raw)[-1].begin, None)
    np.testing.assert_array_equal(raw.time_s[run], cleaned.time_s)
    np.testing.assert_array_equal(raw.tension_N[run], cleaned.tension_N)
    np.testing.assert_allclose(
        raw.roll_pitch_yaw_rad[run, :2], cleaned.roll_pitch_yaw_rad[:, :2], atol=1e-9
    )


def test_an_hour_at_100_hz_is_read_in_seconds(tmp_path: Path, text: str) -> None:
    """A tenth of an hour, so that the test is quick; no per-line Python may creep in."""
    import time

    block = "".join(text.splitlines(keepends=True)[:6])
    stamp = block.split(",")[1]
    data = "".join(block.replace(f",{stamp},", f",{i / 100:.2f},") for i in range(36000))
    begin = time.perf_counter()
    log = load(tmp_path, data).log
    assert len(log) == 36000
    assert time.perf_counter() - begin < 5


def test_absent_columns_stay_absent_through_import(tmp_path: Path, short: cdprcal.Log) -> None:
    log = changed(short, tension_setpoint_N=None, roll_pitch_yaw_rad=None)
    again = cdprcal.parse_log(cdprcal.format_log(log), "x")
    assert again.tension_setpoint_N.shape == (50, 0)
