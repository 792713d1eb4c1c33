"""Terminal and disk may stand still: the control loop does not."""

from __future__ import annotations

import os
import pty
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

import cdprcal
from cdprcal.acquisition import acquire, start_up_plan
from cdprcal.acquisition import monitor as monitor_module
from cdprcal.acquisition.beside import MOST_WAITING, Beside, LogBeside
from cdprcal.acquisition.monitor import Monitor
from cdprcal.io import AcquisitionInputs, load_log, open_live_log
from cdprcal.testing.simulated_devices.connect import SimulatedSession
from robots import small_plan
from winch_bus import AT_ONCE, example_session


class SlowLog:
    """A log whose disk stands still until it is let go, or that fails."""

    def __init__(self, error: OSError | None = None) -> None:
        self.go = threading.Event()
        self.rows: list[float] = []
        self.closed = False
        self.error = error

    def sample(self, sample: cdprcal.RobotSample, setpoint_N: Any) -> None:
        self.go.wait()
        if self.error is not None:
            raise self.error
        self.rows.append(sample.time_s)

    def event(self, event: Any) -> None: ...

    def close(self) -> None:
        self.closed = True


def row(time_s: float) -> cdprcal.RobotSample:
    return cdprcal.RobotSample(time_s=time_s)


def fill(log: LogBeside, rows: int, wait_s: float = 0.0) -> None:
    for number in range(rows):
        log.sample(row(number), np.zeros(4))
        time.sleep(wait_s)


def test_rows_are_written_in_order_and_all_before_it_is_closed() -> None:
    slow = SlowLog()
    log = LogBeside(slow)
    begun = time.monotonic()
    fill(log, 100)
    assert time.monotonic() - begun < 0.5
    threading.Timer(0.1, slow.go.set).start()
    log.close()
    assert slow.rows == [float(number) for number in range(100)]
    assert slow.closed


def test_what_fails_there_is_told_here_and_at_the_end() -> None:
    slow = SlowLog(OSError(28, "No space left on device"))
    log = LogBeside(slow)
    log.sample(row(0.0), np.zeros(4))
    slow.go.set()
    with pytest.raises(OSError, match="No space left"):
        fill(log, 1000, 0.01)
    with pytest.raises(OSError, match="No space left"):
        log.close()
    assert slow.closed


def test_a_disk_that_stands_still_for_too_long_is_an_error() -> None:
    slow = SlowLog()
    log = LogBeside(slow)
    with pytest.raises(OSError, match="stood still"):
        fill(log, MOST_WAITING + 2)
    slow.go.set()
    log.close()


def test_a_disk_that_stands_still_stops_the_robot_and_nothing_else(tmp_path: Path) -> None:
    robot = cdprcal.load_robot("irma4")
    plan = small_plan(robot)
    backend = SimulatedSession.connect(example_session(**AT_ONCE), robot, plan, armed=True)
    slow = SlowLog()
    startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
    let_go = threading.Timer(20.0, slow.go.set)  # who waits for it is late
    let_go.start()
    stopped: list[float] = []
    stop = backend.stop

    def stopping() -> None:
        stop()
        stopped.append(time.monotonic())
        slow.go.set()

    backend.stop = stopping  # type: ignore[method-assign]
    run = acquire(startup, backend, LogBeside(slow), log_rate_Hz=50.0)
    let_go.cancel()
    assert run.state == cdprcal.StartUpState.holding
    assert "the disk has stood still for too long" in run.reason
    assert len(slow.rows) >= MOST_WAITING - 1


def test_a_run_is_logged_as_without(tmp_path: Path) -> None:
    robot = cdprcal.load_robot("irma4")
    plan = small_plan(robot)
    logs = []
    for beside in (False, True):
        backend = SimulatedSession.connect(example_session(**AT_ONCE), robot, plan, armed=True)
        startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
        path = tmp_path / f"{beside}.csv"
        log: Any = open_live_log(path, 4, AcquisitionInputs("", "", {}), 10.0)
        if beside:
            log = LogBeside(log)

        def paced(*_: Any, log: Any = log) -> None:
            while isinstance(log, LogBeside) and not log._beside.idle:
                time.sleep(1e-4)

        acquire(startup, backend, log, watch=paced)
        logs.append(load_log(path).log)
    assert cdprcal.format_log(logs[0]) == cdprcal.format_log(logs[1])


@pytest.mark.parametrize("terminal", [True, False])
def test_a_terminal_that_stands_still_holds_nobody_up(
    terminal: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As after Ctrl-S: nobody reads the other end."""
    robot = cdprcal.load_robot("irma4")
    plan = small_plan(robot)
    other, here = pty.openpty() if terminal else os.pipe()
    stream = os.fdopen(here, "w")
    console = Console(file=stream, force_terminal=terminal, width=100)
    monkeypatch.setattr(monitor_module, "notes", lambda: console)
    monkeypatch.setattr(monitor_module, "_PATIENCE_S", 0.2)
    monkeypatch.setattr(monitor_module, "_REFRESH_S", 0.0)
    startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
    longest_s = 0.0
    with Monitor(robot, plan, "run.csv", beside=Beside("terminal")) as monitor:
        for number in range(3000):
            sample = row(number / 100)
            sample.length_m = sample.tension_N = np.full(4, 80.0)
            sample.roll_pitch_yaw_rad = np.zeros(3)
            command = startup.step(sample)
            begun = time.monotonic()
            monitor.show(command, sample)
            monitor.tell("a note " + "x" * 200)
            longest_s = max(longest_s, time.monotonic() - begun)
        begun = time.monotonic()
    assert time.monotonic() - begun < 2.0
    assert longest_s < 0.5
    os.close(other)
