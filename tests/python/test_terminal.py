"""What commands draw on a terminal while they run, and what Ctrl-C does there."""

from __future__ import annotations

import io
import json
import os
import re
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer
from rich.console import Console

import cdprcal
from cdprcal import StartUpState
from cdprcal.acquisition.monitor import Monitor
from cdprcal.cli import COMMANDS
from cdprcal.cli.devices import run_dry
from cdprcal.terminal import as_typed
from cdprcal.testing.simulated_devices.connect import SimulatedSession
from cdprcal.testing.simulated_devices.faults import Fault
from conftest import Cli
from robots import small_plan
from winch_bus import EXAMPLE, example_session

STREAMS = ("answers", "notes")
CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


class Terminal:
    """A console that believes to be a terminal, and all that it was sent."""

    def __init__(self) -> None:
        self._stream = io.StringIO()

    def console(self) -> Console:
        return Console(
            file=self._stream, force_terminal=True, width=120, highlight=False, markup=False
        )

    @property
    def text(self) -> str:
        return CONTROL.sub("", self._stream.getvalue())


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    drawn = Terminal()
    places = [f"cdprcal.{m}.{n}" for m in ("acquisition.monitor", "terminal") for n in STREAMS]
    for place in places:
        monkeypatch.setattr(place, drawn.console)
    # Ten pictures per second of a run that takes a fraction of one hang on the machine: every 5 ms.
    monkeypatch.setattr("cdprcal.acquisition.monitor._REFRESH_S", 0.005)
    return drawn


def test_acquire_draws_the_run(
    cli: Cli, terminal: Terminal, plan_path: Path, tmp_path: Path
) -> None:
    log = tmp_path / "run.csv"
    ran = cli("acquire", "irma4", plan_path, "--quick", "--seed", 3, "-o", log)
    assert ran.code == 0, ran.stderr
    drawn = terminal.text
    assert re.search(r"moving .*set-point [234] of 4 .*\d\.\d s +0:\d\d left", drawn)
    assert re.search(r"measured .* [123] of 4", drawn)
    assert re.search(r"initial pose +\S.*\(1 σ, worst axis\)", drawn)
    # Cable, tension, set-point, and a bar up to the limit.
    assert "20 … 400 N" in drawn
    rows = re.findall(r"^ *([1-4]) +(\d+\.\d) +(\d+\.\d) +━", drawn, flags=re.M)
    assert {row[0] for row in rows} == {"1", "2", "3", "4"}
    assert np.median([abs(float(read) - float(wanted)) for _, read, wanted in rows]) < 5.0
    assert drawn.rstrip().endswith(f"next: cdprcal calibrate irma4 {log}")


def test_a_guided_run_does_not_say_how_long_it_will_take(
    cli: Cli, terminal: Terminal, plan_path: Path, tmp_path: Path
) -> None:
    arguments = ("--quick", "--until", "0.001mm,0.0001deg", "-o", tmp_path / "run.csv")
    ran = cli("acquire", "irma4", plan_path, *arguments)
    assert ran.code == 1, ran.stderr
    drawn = terminal.text
    assert re.search(r"measured .* [123] of 4", drawn)
    assert " left" not in drawn
    assert not re.search(r"set-point \d of", drawn)
    assert "the accuracy asked for was not reached; weakest: " in drawn


@pytest.mark.parametrize(
    ("ripple", "said"), [(3.24, r"━.* 3\.2 × what rest allows"), (0.5, r"━.* rest$")]
)
def test_ripple_is_drawn_against_what_rest_allows(
    robot: cdprcal.Robot, terminal: Terminal, ripple: float, said: str
) -> None:
    command: Any = SimpleNamespace(
        state=StartUpState.moving,
        setpoint=1,
        tension_setpoint_N=np.full(4, 100.0),
        remaining_s=12.0,
        ripple=ripple,
    )
    sample = cdprcal.RobotSample(time_s=1.0)
    sample.tension_N = np.full(4, 99.0)
    with Monitor(robot, small_plan(robot), "run.csv") as monitor:
        monitor.show(command, sample)
    (drawn,) = {line.rstrip() for line in terminal.text.splitlines() if "ripple" in line}
    assert re.search(said, drawn)


def test_readings_that_are_missing_are_drawn_as_such(
    robot: cdprcal.Robot, terminal: Terminal
) -> None:
    command: Any = SimpleNamespace(
        state=StartUpState.moving,
        setpoint=1,
        tension_setpoint_N=np.full(4, 100.0),
        remaining_s=np.nan,
        ripple=np.nan,
    )
    sample = cdprcal.RobotSample(time_s=1.0)
    sample.tension_N = np.array([np.nan, -3.0, 100.0, 200.0])
    with Monitor(robot, small_plan(robot), "run.csv") as monitor:
        monitor.show(command, sample)
        monitor._shown_s = 0.0
        sample.tension_N = np.array([])  # before the first reading
        monitor.show(command, sample)
    drawn = terminal.text
    assert "– left" in drawn
    assert re.search(r"^ *1 +– +100\.0", drawn, flags=re.M)
    assert re.search(r"^ *2 +-3\.0 +100\.0", drawn, flags=re.M)
    assert re.search(r"^ *4 +200\.0 +100\.0", drawn, flags=re.M)
    assert re.search(r"^ *4 +– +100\.0", drawn, flags=re.M)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_asks_to_stop_and_a_second_ctrl_c_insists(
    robot: cdprcal.Robot, number: signal.Signals
) -> None:
    before = signal.getsignal(number)
    monitor = Monitor(robot, small_plan(robot), "run.csv")
    with monitor:
        assert not monitor.stop_wanted()
        os.kill(os.getpid(), number)
        assert monitor.stop_wanted()
        os.kill(os.getpid(), signal.SIGTERM)  # impatient scripts repeat it: it stays gentle
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(number) is before


def test_a_hang_up_that_is_to_be_ignored_is(robot: cdprcal.Robot) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup has it
    try:
        with Monitor(robot, small_plan(robot), "run.csv") as monitor:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not monitor.stop_wanted()
    finally:
        signal.signal(signal.SIGHUP, before)


def test_outside_of_the_main_thread_signals_are_left_alone(robot: cdprcal.Robot) -> None:
    before = signal.getsignal(signal.SIGINT)
    seen = []

    def watch() -> None:
        with Monitor(robot, small_plan(robot), "run.csv"):
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=watch)
    thread.start()
    thread.join()
    assert seen == [before]


def test_a_dry_run_is_drawn_and_ctrl_c_ends_it(
    cli: Cli, terminal: Terminal, plan_path: Path, tmp_path: Path
) -> None:
    before = signal.getsignal(signal.SIGINT)
    timer = threading.Timer(1.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    ran = cli("acquire", "irma4", plan_path, "--backend", "canopen", "--session", EXAMPLE,
              "--dry-run", "--seconds", 10_000, "-o", tmp_path / "run.csv", "--json")  # fmt: skip
    timer.join()
    assert 0.0 < ran.document()["duration_s"] < 9_000
    assert signal.getsignal(signal.SIGINT) is before
    drawn = terminal.text
    assert drawn.count("load cell") >= 2  # refreshed
    assert len(re.findall(r"^ *3 +3  switch on disabled +-?\d+ ", drawn, flags=re.M)) >= 2
    assert re.search(r"roll -?\d+\.\d\d°  pitch .*°  yaw .*°  \d+\.\d s", drawn)


def test_a_dry_run_says_why_it_would_have_stopped(
    robot: cdprcal.Robot, terminal: Terminal, capsys: pytest.CaptureFixture[str]
) -> None:
    lost = Fault(
        "node lost of node 2",
        0.3,
        from_nodes=lambda can_id, data: None if can_id & 0x7F == 2 else data,
    )
    plan = small_plan(robot)
    backend = SimulatedSession.connect(example_session(), robot, plan, armed=False, fault=lost)
    with pytest.raises(typer.Exit) as stop:
        run_dry(backend, 1.0, json=True)
    assert stop.value.exit_code == 1
    document = json.loads(capsys.readouterr().out)
    assert "node 2 (cable 2): does not answer" in document["reason"]
    assert "would have stopped: node 2 (cable 2): does not answer" in terminal.text
    assert "to move, leave out --dry-run" in " ".join(terminal.text.split())


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_help_is_ascii_where_the_locale_is(name: str) -> None:
    def help_of(locale: str, *arguments: str) -> str:
        command = [sys.executable, "-m", "cdprcal", *name.split(), *arguments]
        ran = subprocess.run(
            command,
            env=os.environ | {"LC_ALL": locale, "LANG": locale},
            capture_output=True,
            check=False,
        )
        return (ran.stdout + ran.stderr).decode()

    assert help_of("C", "--help").isascii()
    assert help_of("C", "--nonsense").isascii()
    assert "..." not in help_of("C.UTF-8", "--help").partition("Usage")[2].partition("\n")[2]


def test_help_speaks_unicode_where_the_locale_does() -> None:
    command = [sys.executable, "-m", "cdprcal", "diagnose", "--help"]
    environment = os.environ | {"LC_ALL": "C.UTF-8"}
    ran = subprocess.run(command, env=environment, capture_output=True, check=True)
    assert "LOG…" in ran.stdout.decode()


def test_a_command_to_be_typed_quotes_what_a_shell_would_cut() -> None:
    assert as_typed("check", "Messung 3.csv", "--propose", "map.yaml") == (
        "cdprcal check 'Messung 3.csv' --propose map.yaml"
    )
    assert as_typed("check", Path("run.csv")) == "cdprcal check run.csv"
