"""What commands draw on a terminal while they run, and what Ctrl-C does there; lines and tables for
people: every reading that can be left out has a name."""

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
from cdprcal.diagnosis.table import value_rows
from cdprcal.tables import CHANNELS, gated_line, sigma_of
from cdprcal.terminal import Table, as_typed, fixed, measured
from cdprcal.testing.simulated_devices.connect import SimulatedSession
from cdprcal.testing.simulated_devices.faults import Fault
from conftest import Cli, Ran, changed
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


@pytest.mark.parametrize(
    ("channel", "component", "words"),
    [
        ("length", 3, "length 4"),
        ("swivel", 7, "swivel 8"),
        ("roll_pitch", 1, "pitch"),
        ("yaw", 0, "yaw"),
        ("balance", 0, "the balance of the tensions"),
        ("absolute_yaw", 0, "absolute yaw"),
        ("direct_length", 3, "direct length 4"),
        ("position", 2, "position z"),
    ],
)
def test_every_outlier_has_a_name(channel: str, component: int, words: str) -> None:
    gated = {"reason": "outlier", "time_s": 1.0, "size": 9.0}
    line = gated_line(gated | {"channel": channel, "component": component})
    assert line == f"left out at 1.000 s: {words}, an outlier of 9.0 standard deviations"


@pytest.mark.parametrize(
    ("value", "sigma", "said"),
    [
        (15.602, 2.656, ("+15.6", "2.7")),
        (2.6e-4, 1.04e-4, ("+0.00026", "0.00010")),
        (-2.6e-9, 1.04e-10, ("-2.60e-9", "0.10e-9")),
        (4e-10, 1.24e-9, ("+0.4e-9", "1.2e-9")),
        (123456.7, 1234.0, ("+123457", "1234")),
        (0.0999, 0.0996, ("+0.10", "0.10")),
        (-0.0004, 0.1, ("+0.00", "0.10")),
        (2.6e-4, 0.0, ("+0.00026", "0")),
        (-2.6, np.nan, ("-2.6", "–")),
        (-2.6, None, ("-2.6", "–")),
        (2.6, np.inf, ("+2.6", "inf")),
        (np.nan, 1.0, ("–", "–")),
        (None, None, ("–", "–")),
    ],
)
def test_a_value_has_the_digits_that_sigma_needs(
    value: float | None, sigma: float | None, said: tuple[str, str]
) -> None:
    assert measured(value, sigma) == said


def printed(table: Table, width: int) -> list[str]:
    console = Console(width=width, file=io.StringIO())
    with console.capture() as said:
        console.print(table)
    return [line.rstrip() for line in said.get().splitlines()]


def test_no_word_of_a_table_is_broken_where_another_column_has_room() -> None:
    table = Table("effect", "found from", "of its usual size", "looks like", text={0, 1, 3})
    table.add_row("magnetic_disturbance", "no believable size", "", "external_force, umbilical")
    *_, row, rest = printed(table, 80)
    assert row.split() == ["magnetic_disturbance", "no", "believable", "size", "external_force,"]
    assert rest.split() == ["umbilical"]


def test_units_go_below_names_before_a_key_is_broken() -> None:
    table = Table("effect", "of", "value [mm]", "evidence [nat]", text={0, 1}, keys=2)
    table.add_row("eccentric_drum", "cosine_m cable 1", "+0.039", "222.9")
    assert printed(table, 62)[0].split() == [
        "effect", "of", "value", "[mm]", "evidence", "[nat]",
    ]  # fmt: skip
    _, units, row = printed(table, 52)
    assert units.split() == ["effect", "of", "[mm]", "[nat]"]
    assert row.split() == ["eccentric_drum", "cosine_m", "cable", "1", "+0.039", "222.9"]


def test_nothing_is_less_than_zero_by_nothing() -> None:
    assert fixed(-0.0, 1) == "0.0"
    assert fixed(-0.0004, 3) == "0.000"
    assert measured(-0.0, None, sign="") == ("0", "–")


def test_the_numbers_of_a_law_are_seen() -> None:
    """Newtons per square newton are small."""
    effect = {
        "name": "a_law",
        "parameters": {"curve_N_N2": [2.6e-4, -1.23e-3]},
        "standard_deviation": {"curve_N_N2": [1.0e-4, None]},
        "units": {"curve_N_N2": "N/N2"},
        "shapes": {"curve_N_N2": "per_cable"},
    }
    assert list(value_rows(effect)) == [
        ("cable 1", "+0.00026", "0.00010", "N/N2"),
        ("cable 2", "-0.00123", "–", "N/N2"),
    ]


def test_the_parts_of_a_vector_are_its_axes_also_where_no_catalogue_has_it() -> None:
    """Of a step; of two logs."""
    effect = {
        "name": "a_step",
        "parameters": {"time_s": 7.5, "shift_m": [[0.01, 0.02, -0.03], [0.0, 0.0, 0.0]]},
        "standard_deviation": {"shift_m": [[0.001] * 3] * 2},
        "units": {"shift_m": "m"},
        "shapes": {"shift_m": "vector3"},
    }
    assert [where for where, *_ in value_rows(effect)] == [
        "time_s",
        *(f"shift_m log {log}, {axis}" for log in (1, 2) for axis in "xyz"),
    ]


def test_every_channel_with_a_sigma_has_it(robot: cdprcal.Robot) -> None:
    keys = {sigma for _, _, _, sigma in CHANNELS.values() if sigma}
    assert keys <= sigma_of(robot).keys()


def test_an_outlier_of_the_last_cable_is_left_out_and_said(
    cli: object, log: cdprcal.Log, tmp_path: Path
) -> None:
    assert callable(cli)
    length_m = log.length_m.copy()
    rest = log.time_s > 48.0  # the whole of a dwell
    length_m[rest & (log.time_s < 53.0), 3] += 0.02
    cdprcal.write_log(changed(log, length_m=length_m), str(tmp_path / "run.csv"))
    ran: Ran = cli("calibrate", "irma4", tmp_path / "run.csv")
    assert "internal error" not in ran.stderr
    assert "length 4, an outlier of" in ran.stdout
    assert np.isfinite(length_m).all()
