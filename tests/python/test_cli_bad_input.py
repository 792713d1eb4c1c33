"""Bad input: one clear message that names the file, line or field, exit 2, nothing written.

Of files that are no good, test_malformed.py.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

import cdprcal
from conftest import Cli, Ran, changed, raw_text


def assert_refused(ran: Ran, *words: str) -> None:
    assert ran.code == 2, ran
    assert ran.stdout == ""
    assert "Traceback" not in ran.stderr
    assert ran.stderr.startswith("cdprcal: ")
    assert ran.stderr.count("\n") == 1, "one message on one line"
    for word in words:
        assert re.search(word, ran.stderr), (word, ran.stderr)


def with_line(path: Path, number: int, edit: Callable[[str], str]) -> None:
    lines = path.read_text().splitlines(keepends=True)
    lines[number - 1] = edit(lines[number - 1])
    path.write_text("".join(lines))


def test_a_log_of_another_robots_cable_count(cli: Cli, log: cdprcal.Log, tmp_path: Path) -> None:
    groups = ("length_m", "swivel_rad", "tension_N", "tension_setpoint_N")
    log = changed(log, **{name: getattr(log, name)[:, :3] for name in groups})
    csv, raw = tmp_path / "three.csv", tmp_path / "three.log"
    cdprcal.write_log(log, str(csv))
    raw.write_text(raw_text(log))
    for path in (csv, raw):
        for command in ("calibrate", "check"):
            assert_refused(cli(command, "irma4", path), path.name, "3 cables", "irma4", "4")


OPTION_FAULTS: list[tuple[tuple[str, ...], str]] = [
    (("--method", "best"), "best"),
    (("--formulation", "short"), "short"),
    (("--at", "1,x"), "--at: 'x'"),
    (("--at", "1,nan"), "--at: 'nan'"),
    (("--at", "1,,2"), "--at: ''"),
    (("--at", "1,1e9"), "no sample at"),
    (("--segment", "5"), "segment"),
]


@pytest.mark.parametrize(("options", "words"), OPTION_FAULTS)
def test_options(cli: Cli, log_path: Path, options: tuple[str, ...], words: str) -> None:
    assert_refused(cli("calibrate", "irma4", log_path, *options), re.escape(words))


def test_usage_errors_are_exit_2_without_a_traceback(cli: Cli, log_path: Path) -> None:
    for arguments in (
        ("calibrate",),
        ("calibrate", "irma4"),
        ("calibrate", "irma4", log_path, "--segment", "x"),
        ("calibrate", "irma4", log_path, "--bogus"),
        ("nonsense",),
        ("import", log_path),
    ):
        ran = cli(*arguments)
        assert (ran.code, ran.stdout) == (2, "")
        assert "Traceback" not in ran.stderr
        assert "Error" in ran.stderr


def test_unknown_robot(cli: Cli, log_path: Path) -> None:
    assert_refused(cli("calibrate", "irma5", log_path), "irma5", "irma4")
    assert_refused(cli("check", log_path.parent / "none.yaml", log_path), "none.yaml")


def test_output_that_cannot_be_written(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    missing = tmp_path / "no" / "such" / "out.csv"
    for command in (
        ("import", log_path, "-o", missing),
        ("import", log_path, "-o", tmp_path),
        ("calibrate", "irma4", log_path, "-o", missing.with_suffix(".json")),
        ("calibrate", "irma4", log_path, "--json", "-o", missing.with_suffix(".json")),
        ("generate", "irma4", "-o", missing),
    ):
        assert_refused(cli(*command), "cannot be written")
    assert set(tmp_path.iterdir()) == {log_path}


@pytest.mark.parametrize("name", ["run.csv.gz", "run.zip", "run.parquet"])
@pytest.mark.parametrize("command", ["generate", "import", "acquire"])
def test_a_logs_name_promises_what_is_written(
    cli: Cli, log_path: Path, tmp_path: Path, command: str, name: str
) -> None:
    given: dict[str, list[str | Path]] = {
        "generate": ["irma4"],
        "import": [log_path],
        "acquire": ["irma4", "no-plan.csv"],
    }
    ran = cli(command, *given[command], "-o", tmp_path / name)
    assert_refused(ran, f"{name}: its ending is that of no log; give .mcap, or for CSV")
    assert not (tmp_path / name).exists()


def test_other_names_of_logs_are_as_good(cli: Cli, tmp_path: Path) -> None:
    for name in ("run.log", "run.TXT", "run", "run_0.5mm"):
        assert cli("generate", "irma4", "-o", tmp_path / name).code == 0
        assert cdprcal.read_log(tmp_path / name).sample_count > 0


def test_import_does_not_overwrite_what_it_reads(cli: Cli, log_path: Path) -> None:
    before = log_path.read_bytes()
    assert_refused(cli("import", log_path, "-o", log_path), "another name")
    assert log_path.read_bytes() == before


def test_a_failed_import_leaves_an_older_output_alone(
    cli: Cli, log_path: Path, tmp_path: Path
) -> None:
    output = tmp_path / "out.csv"
    output.write_text("precious")
    with_line(log_path, 30, lambda s: s.replace(",", ",abc", 1))
    assert_refused(cli("import", log_path, "-o", output), "abc")
    assert output.read_text() == "precious"


@pytest.mark.parametrize("grid", ["2x2", "0x1x1", "axbxc", "2x2x2x2", "100x1x1"])
def test_a_grid_that_is_none(cli: Cli, tmp_path: Path, grid: str) -> None:
    assert_refused(cli("generate", "irma4", "-o", tmp_path / "x.csv", "--grid", grid), "--grid")


def test_a_built_in_robot_that_may_be_meant_is_named(cli: Cli, log_path: Path) -> None:
    for name, meant in (("IRMA4", "irma4"), ("belt4", "belts4")):
        assert_refused(cli("calibrate", name, log_path), f"; give {meant}, if that is meant")
        assert_refused(cli("plan", name), f"; give {meant}, if that is meant")
    assert "is meant" not in cli("calibrate", "my-machine.yaml", log_path).stderr


@pytest.mark.parametrize("option", ["--rate-hz", "--dwell-s"])
@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf"])
def test_times_that_no_log_has_are_refused(
    cli: Cli, tmp_path: Path, option: str, value: str
) -> None:
    ran = cli("generate", "irma4", "-o", tmp_path / "run.csv", option, value)
    assert_refused(ran, f"{option}: must be above 0; give another")
