"""The loop between a robot, the start-up procedure and the log (paper §3.2.2, Fig. 3).

What to do is decided in C++ (``cdprcal.StartUp``); here it is only carried to and fro.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal._core import RobotSample, StartUp, StartUpCommand, StartUpRest, StartUpState
from cdprcal.hardware import Backend, BackendError, SlowToArm
from cdprcal.io.files import reason
from cdprcal.io.live_log import LiveLog

#: Called with every command and the sample it answers, and whether that was logged. What it returns
#: goes into the log as an event, with time_s and what else there is to say.
Watch = Callable[[StartUpCommand, RobotSample, bool], Mapping[str, Any] | None]


#: What the robot does in each state, in words.
STATES = {
    StartUpState.idle: "waiting for the first sample",
    StartUpState.recording: "recording the tensions at power-on",
    StartUpState.moving_to_start: "moving to τ0",
    StartUpState.moving: "moving",
    StartUpState.settling: "settling",
    StartUpState.measuring: "at rest, measuring",
    StartUpState.done: "done, winches locked",
    StartUpState.holding: "stopped, winches locked",
}


@dataclass(frozen=True)
class Acquired:
    """How a run ended. done: every set-point was measured; holding: stopped early, see ``reason``.

    Times are the backend's; set-points count from 0, the first is tau_0.
    """

    state: StartUpState
    reason: str
    rests: tuple[StartUpRest, ...]
    begin_s: float
    end_s: float
    samples: int

    @property
    def duration_s(self) -> float:
        """Robot time from the first sample to the last."""
        return self.end_s - self.begin_s


#: A platform may take so many times its planned rest: the plan's damping ratio is an assumption.
_PATIENCE = 2.0


def start_up_options(plan: _core.Plan, *, wait_for_rest: bool = True) -> _core.StartUpOptions:
    """StartUp's own, but with the patience that the plan's slowest stop asks for."""
    options = _core.StartUpOptions(wait_for_rest=wait_for_rest)
    rests_s = [plan.start_dwell_s, *(stop.dwell_s for stop in plan.poses)]
    options.settle_timeout_s = max(options.settle_timeout_s, _PATIENCE * max(rests_s))
    return options


def acquire(
    startup: StartUp,
    backend: Backend,
    log: LiveLog,
    *,
    log_rate_Hz: float = 10.0,
    stop: Callable[[], bool] = lambda: False,
    watch: Watch | None = None,
    guard: Callable[[RobotSample], str] = lambda sample: "",
) -> Acquired:
    """Runs the procedure to its end: done, or holding with a reason. The log is closed either way.

    ``stop`` is asked before every command, and while drives are armed: true stops the robot as an
    operator would; so is ``guard``, of every sample, for a reason to stop, empty if there is none.
    A log that can no longer be written and a robot that no longer answers stop it too. Whatever is
    raised on the way, the winches are locked and the log is closed first.
    """
    if isinstance(backend, SlowToArm):
        backend.stop_if(stop)
    rows = _Rows(log, log_rate_Hz)
    sample = RobotSample(time_s=0.0)
    begin_s = math.nan
    state = StartUpState.idle
    setpoint = 0
    try:
        while True:
            sample = _read(backend, sample)
            begin_s = sample.time_s if math.isnan(begin_s) else begin_s
            sample.stop_requested = sample.stop_requested or stop()
            sample.host_error = rows.fault or guard(sample)
            command = startup.step(sample)
            logged = rows.add(sample, command)
            if (command.state, command.setpoint) != (state, setpoint):
                state, setpoint = command.state, command.setpoint
                rows.event(sample, command)
            if watch is not None:
                rows.note(watch(command, sample, logged))
            if startup.finished:
                break
            _command(backend, command, rows)
    finally:
        backend.stop()
        rows.close()
    return Acquired(
        startup.state,
        startup.reason or rows.fault,
        tuple(startup.rests),
        begin_s,
        sample.time_s,
        rows.count,
    )


def _read(backend: Backend, before: RobotSample) -> RobotSample:
    try:
        return backend.read()
    except BackendError as error:
        # The last that is known, with what happened since.
        before.drive_error = str(error) or "the robot does not answer"
        return before


def _command(backend: Backend, command: StartUpCommand, rows: _Rows) -> None:
    try:
        backend.command(command)
    except BackendError as error:
        rows.fault = rows.fault or f"drive error: {error}"


class _Rows:
    """Samples and events on their way into the log; the first failure is kept as ``fault``."""

    def __init__(self, log: LiveLog, rate_Hz: float) -> None:
        self._log = log
        self._rate_Hz = rate_Hz
        self._ticks = 0
        self._first_s: float | None = None
        self._last_s = float("-inf")
        self.count = 0
        self.fault = ""

    def add(self, sample: RobotSample, command: StartUpCommand) -> bool:
        """Logs the sample if it is due; a log's time increases, so others are left out."""
        if self.fault or not self._last_s < sample.time_s < float("inf"):
            return False
        if self._first_s is None:
            self._first_s = sample.time_s
        if sample.time_s - self._first_s < self._ticks / self._rate_Hz - 1e-9:
            return False
        elapsed = (sample.time_s - self._first_s) * self._rate_Hz
        self._ticks = int(elapsed + 1e-6) + 1
        self._last_s = sample.time_s
        if not self._write(lambda: self._log.sample(sample, command.tension_setpoint_N)):
            return False
        self.count += 1
        return True

    def event(self, sample: RobotSample, command: StartUpCommand) -> None:
        known = [t for t in (self._last_s, sample.time_s) if math.isfinite(t)]
        event: dict[str, Any] = {
            "time_s": max(known, default=0.0),
            "state": command.state.name,
            "setpoint": command.setpoint + 1,
        }
        if command.reason:
            event["reason"] = command.reason
        if not self.fault:
            self._write(lambda: self._log.event(event))

    def note(self, event: Mapping[str, Any] | None) -> None:
        if event is not None and not self.fault:
            self._write(lambda: self._log.event(event))

    def close(self) -> None:
        self._write(self._log.close)

    def _write(self, write: Callable[[], None]) -> bool:
        try:
            write()
        except OSError as error:
            self.fault = self.fault or f"the log cannot be written: {reason(error)}"
            return False
        return True


class PowerOn:
    """While the tensions at power-on are recorded: what the watchdog calls slack once they move.

    ``options``: those of the start-up, whose watchdog says how little and how long.
    """

    def __init__(self, robot: _core.Robot, options: _core.StartUpOptions) -> None:
        self._slack_N = options.watchdog.slack_N(robot)
        self._believed_s = options.watchdog.tension_s
        self._record_s = options.record_s
        self._first_s = math.nan
        self._since_s = np.full(robot.cable_count, math.nan)  # by cable; NaN: not slack

    def look(self, sample: RobotSample) -> str:
        """Why nothing may move; empty: it may, or it moves already."""
        now_s = sample.time_s
        if math.isnan(self._first_s):
            self._first_s = now_s
        tension_N = np.asarray(sample.tension_N)
        if now_s - self._first_s > self._record_s or tension_N.shape != self._since_s.shape:
            return ""
        began_s = np.where(np.isnan(self._since_s), now_s, self._since_s)
        self._since_s = np.where(tension_N < self._slack_N, began_s, math.nan)
        slack = np.flatnonzero(now_s - self._since_s > self._believed_s)
        if not slack.size:
            return ""
        cable = int(slack[0])
        return (
            f"cable {cable + 1}: slack at power-on, {tension_N[cable]:.1f} N where at least "
            f"{self._slack_N:.3g} N are needed; no winch has moved"
        )
