"""The example at the end of every command's --help: copied, it runs."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import cdprcal
from cdprcal.cli import COMMANDS
from conftest import raw_text
from raw_files import kilograms

ROOT = Path(__file__).resolve().parents[2]
#: Commands in an order in which each finds what it reads.
ORDER = (
    "generate",
    "plan",
    "acquire",
    "export",
    "check",
    "import",
    "calibrate",
    "track",
    "diagnose",
    "compare",
    "geometry",
    "report",
    "repeat",
    "replay",
    "explore",
    "workspace",
    "template",
    "effects",
    "explain",
    "schema",
    "demo",
)


def examples(command: str) -> list[str]:
    """The commands after 'Example:' and after other lead-ins, from what --help is made of."""
    _, example, _ = COMMANDS[command]
    lines = example.split("\n\n")
    assert lines[0].startswith("Example: cdprcal ")
    return [line.partition(": ")[2] for line in lines]


def page_blocks(language: str, page: str) -> list[str]:
    """The blocks of a page of the documentation in a language."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def folder(log: cdprcal.Log, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where all are run, one after the other; the robot's raw log and ROS's program are there."""
    folder = tmp_path_factory.mktemp("examples")
    (folder / "robot.log").write_text(raw_text(log))
    kilograms(log, folder).rename(folder / "raw.csv")
    (folder / "examples").symlink_to(ROOT / "examples")
    (folder / "mine.yaml").symlink_to(ROOT / "examples" / "canopen-simulated.yaml")
    belts, records = page_blocks("yaml", "robots/maslow.md")[:2]
    (folder / "belts.yaml").write_text(belts)
    (folder / "records.yaml").write_text(records)
    (script,) = page_blocks("python", "robots/maslow.md")
    subprocess.run([sys.executable, "-c", script], cwd=folder, check=True)
    programs = folder / ".bin"
    programs.mkdir()
    for name, line in (("cdprcal", f'exec "{sys.executable}" -m cdprcal "$@"'), ("ros2", "exit 0")):
        (programs / name).write_text(f"#!/bin/sh\n{line}\n")
        (programs / name).chmod(0o755)
    return folder


def run(script: str, folder: Path) -> subprocess.Popen[str]:
    """Begins a command line in a shell of its own process group."""
    return subprocess.Popen(
        ["bash", "-eu", "-c", script],
        cwd=folder,
        env={**os.environ, "PATH": f"{folder / '.bin'}:{os.environ['PATH']}"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def test_every_command_has_an_example() -> None:
    assert sorted(ORDER) == sorted(COMMANDS)
    for command in ORDER:
        for line in examples(command):
            assert re.match(r"cdprcal [a-z]+ ", line), line
            assert f"cdprcal {command} " in line


def test_their_examples_run_one_after_the_other(folder: Path) -> None:
    """One test: each finds what those before it wrote, on whatever worker they run."""
    for command in ORDER:
        for script in examples(command):
            if "--backend canopen" not in script:  # takes long; test_winches.py runs the same
                its_example_runs(command, script, folder)


def its_example_runs(command: str, script: str, folder: Path) -> None:
    running = run(script, folder)
    if command in ("replay", "explore"):  # until Ctrl-C
        assert running.stderr is not None
        assert "http://127.0.0.1:" in running.stderr.readline()
        os.killpg(running.pid, signal.SIGINT)
    out, err = running.communicate(timeout=120)
    assert running.returncode == 0, f"{script}\n{out}{err}"
    assert "Traceback" not in err
    if command == "explore":
        return  # saves when its page is told to
    for name in re.findall(r"(?:-o|--output|--plot|--truth|--result|>) (\S+)", script):
        assert (folder / name).exists(), name
