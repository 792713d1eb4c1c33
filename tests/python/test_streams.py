"""What becomes of a command whose stdout or stderr is closed, full, or read by nobody."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from cdprcal.io import load_log
from scripts import executed


def shell(line: str, *names: str | Path) -> subprocess.CompletedProcess[str]:
    """Runs a line of bash; ``cdprcal`` in it is this one, {} are names."""
    program = shlex.join([sys.executable, "-m", "cdprcal"])
    line = line.format(*(shlex.quote(str(name)) for name in names))
    command = f'set -o pipefail; cdprcal() {{ {program} "$@"; }}; {line}'
    return executed(["bash", "-c", command])


#: Nobody reads it, no room for it, closed.
LOST = pytest.mark.parametrize("to", ["2> >(head -1 >/dev/null)", "2>/dev/full", "2>&-"])


@LOST
def test_a_run_goes_on_without_its_progress(to: str, tmp_path: Path) -> None:
    plan, log = tmp_path / "plan.csv", tmp_path / "run.csv"
    assert shell("cdprcal plan irma4 --grid 2x1x1 -o {}", plan).returncode == 0
    ran = shell(f"cdprcal acquire irma4 {{}} -o {{}} {to}", plan, log)
    assert (ran.returncode, ran.stdout.splitlines()[0]) == (0, "done")
    assert f"{len(load_log(log).log)} samples" in " ".join(ran.stdout.split())


@LOST
def test_a_diagnosis_is_written_without_its_progress(
    to: str, log_path: Path, tmp_path: Path
) -> None:
    corrected = tmp_path / "corrected.yaml"
    ran = shell(f"cdprcal diagnose irma4 {{}} -o {{}} {to}", log_path, corrected)
    assert ran.returncode == 0
    assert "cables:" in corrected.read_text()


@pytest.mark.parametrize(
    "pipe", ["-o /dev/stdout | cat > {}", "-o >(cat > {}) && sleep 0.5", "-o /dev/stdout > {}"]
)
def test_a_file_may_be_a_pipe_and_answers_stand_beside_it(pipe: str, tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    ran = shell(f"cdprcal generate irma4 {pipe}", log)
    assert ran.returncode == 0
    assert f"{len(load_log(log).log)} samples" in ran.stdout + ran.stderr
    ran = shell("cdprcal generate irma4 -o /dev/stdout | true")
    assert "/dev/stdout: cannot be written: broken pipe; see why" in ran.stderr


def test_an_error_keeps_its_exit_code_where_nobody_is_told(tmp_path: Path) -> None:
    assert shell("cdprcal check {} 2>/dev/full", tmp_path / "none.yaml").returncode == 2


@pytest.mark.parametrize("command", ["--help", "schema calibrate", "calibrate irma4 {}"])
def test_a_full_stdout_is_said(command: str, log_path: Path) -> None:
    ran = shell(f"cdprcal {command} >/dev/full", log_path)
    said = "cdprcal: output: cannot be written: no space left on device"
    assert (ran.returncode, ran.stderr.strip().startswith(said)) == (2, True)
    assert len(ran.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("command", ["--help", "schema calibrate", "calibrate irma4 {} --json"])
def test_a_closed_stdout_is_as_dev_null(command: str, log_path: Path) -> None:
    ran = shell(f"cdprcal {command} >&-", log_path)
    assert (ran.returncode, ran.stderr) == (0, "")


@pytest.mark.parametrize("command", ["--help", "schema calibrate", "calibrate irma4 {}"])
def test_a_pipe_that_nobody_reads_ends_as_pipes_do(command: str, log_path: Path) -> None:
    ran = shell(f"cdprcal {command} | true", log_path)
    assert (ran.returncode, ran.stderr) == (141, "")


def test_what_is_to_be_written_is_where_nobody_reads_the_answer(
    log_path: Path, tmp_path: Path
) -> None:
    result = tmp_path / "result.json"
    ran = shell("cdprcal calibrate irma4 {} --json -o {} | true", log_path, result)
    assert ran.returncode == 141
    assert result.is_file()
