"""What commands answer, word for word: at 80 and 60 columns, in a pipe, and in the locale C."""

from __future__ import annotations

import difflib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

import cdprcal
from cdprcal.findings import Finding
from cdprcal.letters import readable
from cdprcal.tables import print_findings
from cdprcal.terminal import Table, answers, summed_up

STORED = Path(__file__).parent / "answers"

COMMANDS = {
    "calibrate": ("calibrate", "irma4", "run.csv"),
    "diagnose": ("diagnose", "irma4", "faulty.csv"),
    "check": ("check", "irma4", "run.csv"),
    "plan": ("plan", "irma4", "--optimal", "3"),
    "demo": ("demo", "-o", "again"),
}
TERMINALS = {
    "80": {"COLUMNS": "80", "LC_ALL": "C.UTF-8"},
    "60": {"COLUMNS": "60", "LC_ALL": "C.UTF-8"},
    "pipe": {"LC_ALL": "C.UTF-8"},
    "ascii": {"COLUMNS": "80", "LC_ALL": "C"},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A demonstration's logs, to answer questions about."""
    path = tmp_path_factory.mktemp("answers")
    assert answer(path, ("demo", "-o", "."), TERMINALS["pipe"])[0] == 0
    return path


def answer(
    folder: Path, arguments: tuple[str, ...], terminal: dict[str, str]
) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a program that writes to pipes."""
    kept = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LANG", "LC_CTYPE")}
    ran = subprocess.run(
        [sys.executable, "-m", "cdprcal", *arguments],
        cwd=folder,
        env=kept | {"PYTHONUTF8": "1"} | terminal,
        capture_output=True,
        timeout=120,
        check=False,
    )
    return ran.returncode, ran.stdout.decode(), ran.stderr.decode()


def comparable(text: str) -> str:
    """Without what differs from machine to machine: times taken, and how often a solver stepped;
    without the digits after a point, which other compilers round otherwise."""
    text = re.sub(r" {2,}\d+\.\d+ ms", lambda m: "T ms".rjust(len(m[0])), text)
    text = re.sub(r"\d+\.\d+ ms", "T ms", text)
    text = re.sub(r"\d+\s+iterations", "N iterations", text)
    text = re.sub(r"(\d)\.(\d*)", lambda m: f"{m[1]}.{'#' * len(m[2])}", text)
    return "\n".join(line.rstrip() for line in text.splitlines()) + "\n"


@pytest.mark.parametrize(
    ("command", "terminal"),
    # A demonstration takes long, and its tables are those of the others.
    [(c, t) for c in COMMANDS for t in TERMINALS if c != "demo" or t in ("80", "60")],
)
def test_an_answer_is_what_it_was(folder: Path, command: str, terminal: str) -> None:
    """After a wanted change: CDPRCAL_STORE_ANSWERS=1 writes anew, and git diff shows it."""
    code, said, _ = answer(folder, COMMANDS[command], TERMINALS[terminal])
    assert code == 0
    if width := TERMINALS[terminal].get("COLUMNS"):
        assert max(map(len, said.splitlines())) <= int(width)
    tables = [line for line in said.splitlines() if re.search(r"\S {2,}\S", line)]
    assert max(map(len, tables)) <= 80, "a table that a pipe folds"
    if terminal == "ascii":
        assert said.isascii()
    else:
        assert "…" not in said
    stored = STORED / f"{command}-{terminal}.txt"
    if os.environ.get("CDPRCAL_STORE_ANSWERS"):
        stored.parent.mkdir(exist_ok=True)
        stored.write_text(comparable(said), encoding="utf-8")
    before, now = stored.read_text(encoding="utf-8"), comparable(said)
    assert now == before, "".join(
        difflib.unified_diff(before.splitlines(True), now.splitlines(True), "stored", "now")
    )


def test_in_a_pipe_a_sentence_is_one_line_and_stderr_has_the_progress(folder: Path) -> None:
    _, said, progress = answer(folder, COMMANDS["diagnose"], TERMINALS["pipe"])
    assert "correct the centre of mass in the robot file, or move the payload\n" in said
    assert "… baseline" in progress
    assert "baseline" not in said


@pytest.mark.parametrize("columns", ["0", "00", "-3"])
def test_a_width_that_is_none_is_unknown(folder: Path, columns: str) -> None:
    arguments = ("check", "irma4")
    expected = answer(folder, arguments, TERMINALS["80"])
    assert expected[1]
    assert answer(folder, arguments, TERMINALS["80"] | {"COLUMNS": columns}) == expected


def test_verbose_has_what_is_summed_up_otherwise(folder: Path) -> None:
    short = answer(folder, COMMANDS["calibrate"], TERMINALS["80"])[1]
    long = answer(folder, (*COMMANDS["calibrate"], "--verbose"), TERMINALS["80"])[1]
    assert len(re.findall(r" (?:static|kinematic) *$", long, flags=re.M)) == 54
    assert not re.search(r"\d +(?:static|kinematic) *$", short, flags=re.M)


def test_lines_alike_become_one_with_a_count() -> None:
    lines = [f"left out at {t}.5 s: cable 5 is slack ({t} N)" for t in range(150)]
    lines.append("left out at 3.5 s: cable 4 is slack (2 N)")
    assert summed_up(lines) == [f"150 times, here the first: {lines[0]}", lines[-1]]
    assert summed_up(lines, verbose=True) == lines


def test_findings_alike_become_one_with_a_count(capfd: pytest.CaptureFixture[str]) -> None:
    def finding(time_s: float) -> Finding:
        return Finding(
            severity="warning", code="jump", message="it jumps", remedy="hold it", time_s=time_s
        )

    print_findings([finding(1.0), finding(2.0), finding(3.0)], answers())
    assert capfd.readouterr().out == (
        "warning: it jumps [1 s]; and 2 more like it: --verbose\n    hold it\n"
    )
    print_findings([finding(1.0), finding(2.0)], answers(), verbose=True)
    assert capfd.readouterr().out.count("it jumps") == 2


@pytest.mark.parametrize("width", [20, 40, 60, 80, 200])
def test_no_table_loses_a_cell(width: int, capsys: pytest.CaptureFixture[str]) -> None:
    table = Table("name", *(f"column{i} [unit{i}]" for i in range(9)), "words", text={0, 10})
    for row in range(3):
        cells = (f"{row}{i}.123" for i in range(9))
        table.add_row(f"row{row}", *cells, "a few words to be wrapped")
    Console(width=width).print(table)
    said = capsys.readouterr().out
    assert max(map(len, said.splitlines())) <= width
    for row in range(3):
        assert all(f" {row}{i}.123" in said for i in range(9))
    assert all(f"column{i}" in said and f"[unit{i}]" in said for i in range(9))
    assert said.count("wrapped") == 3
    assert "…" not in said


def test_a_row_that_does_not_fit_the_headers_is_refused() -> None:
    with pytest.raises(ValueError, match="1 cells for 2 columns"):
        Table("a", "b").add_row("1")


def test_letters_of_all_that_is_said_have_an_ascii(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of sentences and units of the catalogue, and of the sources of what prints."""
    monkeypatch.setenv("LC_ALL", "C")
    said = [info.sentence + info.remedy for info in cdprcal.effect_catalogue()]
    root = Path(cdprcal.__file__).parent
    said += [
        (root / name).read_text(encoding="utf-8")
        for name in ("tables.py", "planning/table.py", "diagnosis/table.py", "demo/table.py")
    ]
    assert {c for text in said for c in readable(text) if not c.isascii()} == set()
    monkeypatch.setenv("LC_ALL", "C.UTF-8")
    assert readable("± 2 µm") == "± 2 µm"
