"""What a run looks like while it goes on, on stderr; and Ctrl-C, which stops the robot gently."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable
from types import FrameType
from typing import Any, Self

import numpy as np
from rich.console import Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from cdprcal import _core
from cdprcal._core import RobotSample, StartUpCommand, StartUpState
from cdprcal.acquisition.beside import Beside
from cdprcal.acquisition.guide import Estimate, Guide
from cdprcal.acquisition.procedure import STATES, Acquired
from cdprcal.acquisition.remedies import remedy_for
from cdprcal.interrupt import stopping
from cdprcal.tables import print_findings
from cdprcal.terminal import answers, as_typed, fixed, notes, say

_REFRESH_S = 0.1
_PATIENCE_S = 2.0  # with a terminal that stands still
_BAR_WIDTH = 30


class Monitor:
    """Shows state, tensions against set-points, ripple, poses done and time left.

    On a terminal as a table that is refreshed; else one line for each rest. Within its context
    Ctrl-C, SIGTERM and SIGHUP set ``stop_wanted``; a second Ctrl-C raises KeyboardInterrupt.
    """

    def __init__(
        self,
        robot: _core.Robot,
        plan: _core.Plan,
        log: str,
        *,
        guided: bool = False,
        beside: Beside | None = None,
    ) -> None:
        """guided: the run chooses its stops, so how many are left is not known.

        beside: who writes on the terminal, which may stand still (Ctrl-S); None: the caller.
        """
        self._beside = beside
        self._cables = robot.cable_count
        self._limits_N = robot.tension_limits_N
        self._stops = [True, *(stop.measured for stop in plan.poses)]
        self._guided = guided
        self._estimate: Estimate | None = None
        self._log = log
        self._out = notes()
        # What others print must not wait for a terminal that stands still.
        self._live = Live(
            console=self._out,
            transient=True,
            auto_refresh=False,
            redirect_stdout=False,
            redirect_stderr=False,
        )
        self._animated = self._out.is_terminal
        self._shown_s = 0.0
        self._stop = False
        self._handlers: dict[signal.Signals, Any] = {}
        self._state: tuple[StartUpState, int] | None = None

    def __enter__(self) -> Self:
        for name in stopping():
            try:
                self._handlers[name] = signal.signal(name, self._interrupted)
            except ValueError:  # not the main thread: signals are not ours
                break
        if self._animated:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._animated:
            self._write(self._live.stop)
        if self._beside is not None:
            # The robot stands: what is left may take its time, but not for ever.
            self._beside.end(_PATIENCE_S)
            self._beside = None
        for name, handler in self._handlers.items():
            signal.signal(name, handler)

    def stop_wanted(self) -> bool:
        """Whether the operator asked to stop."""
        return self._stop

    def show(
        self, command: StartUpCommand, sample: RobotSample, estimate: Estimate | None = None
    ) -> None:
        """To be called with every command; draws ten times per second."""
        self._estimate = estimate or self._estimate
        if not self._animated:
            if estimate is not None:
                self._say(f"{sample.time_s:7.1f} s  initial pose {estimate}")
                if estimate.told is not None:
                    self._say(f"{sample.time_s:7.1f} s  {estimate.told}")
            self._say_state(command, sample)
            return
        now = time.monotonic()
        if now - self._shown_s < _REFRESH_S:
            return
        self._shown_s = now
        if self._beside is not None and not self._beside.idle:
            return  # the terminal stands still: what is shown next is what is true then
        self._write(lambda: self._live.update(self._picture(command, sample), refresh=True))

    def tell(self, line: str) -> None:
        """Prints a line on stderr, in between."""
        self._say(line)

    def _say(self, line: str) -> None:
        self._write(lambda: say(self._out, line))

    def _write(self, work: Callable[[], object]) -> None:
        if self._beside is None:
            work()
        else:
            self._beside.do(work)

    def print_end(self, run: Acquired, robot: str, guide: Guide) -> None:
        """The last word: what was acquired, why it stopped, what to do next."""
        out = answers()
        done = run.state == StartUpState.done and not run.reason
        style = "bold green" if done else "bold red"
        text = Text("done" if done else "stopped", style=style)
        if run.reason:
            text += Text(f": {run.reason}", style="none")
        say(out, text)
        say(
            out,
            f"{self._log}: {run.samples} samples, {guide.visited} of {sum(self._stops)} "
            f"set-points {'passed' if guide.in_motion else 'measured'}, "
            f"{run.duration_s:.1f} s of robot time",
        )
        if guide.estimates:
            last = guide.estimates[-1]
            say(out, f"initial pose {last}")
            if not last.trusted and last.reason:
                say(out, last.reason)
            if last.told is not None:
                ended = f" ({guide.settled})" if guide.settled else ""
                say(out, f"{last.told}{ended}")
            if last.caveats:
                print_findings(last.caveats)
                say(
                    out,
                    Text("the accuracy asked for was reached, with caveats", style="bold red")
                    + Text(": the pose may be off by more than its σ", style="none"),
                )
            elif self._guided and not guide.reached:
                weakest = f"; weakest: {last.least_observed}" if last.least_observed else ""
                say(
                    out,
                    Text("the accuracy asked for was not reached", style="bold red")
                    + Text(f"{weakest}; plan more or more varied poses", style="none"),
                )
        if done:
            self._print_next(robot, guide)
        elif remedy := remedy_for(run.reason):
            say(out, f"what to do: {remedy}")

    def _print_next(self, robot: str, guide: Guide) -> None:
        last = guide.estimates[-1] if guide.estimates else None
        moving = ("--motion",) if guide.in_motion else ()
        diagnose = as_typed("diagnose", robot, self._log, *moving)
        if last is not None and last.told is not None:
            say(answers(), f"next: {diagnose}")
        elif last is not None and (last.caveats or not last.trusted):
            say(answers(), f"next: {as_typed('check', robot, self._log)}, then {diagnose}")
        else:
            say(answers(), f"next: {as_typed('calibrate', robot, self._log, *moving)}")

    def _interrupted(self, number: int, frame: FrameType | None) -> None:
        if self._stop and number == signal.SIGINT:
            raise KeyboardInterrupt
        self._stop = True

    def _say_state(self, command: StartUpCommand, sample: RobotSample) -> None:
        state = (command.state, command.setpoint)
        if state == self._state:
            return
        self._state = state
        if command.state in (StartUpState.moving, StartUpState.moving_to_start):
            most = "" if self._guided else f" of {len(self._stops)}"
            left = "" if self._guided else f", {_duration(command.remaining_s)} left"
            self._say(f"{sample.time_s:7.1f} s  set-point {command.setpoint + 1}{most}{left}")

    def _picture(self, command: StartUpCommand, sample: RobotSample) -> Group:
        head = Table.grid(padding=(0, 2))
        row: list[Text | str] = [
            Text(STATES[command.state], style="bold"),
            f"{sample.time_s:.1f} s",
        ]
        if not self._guided:
            row.insert(1, f"set-point {command.setpoint + 1} of {len(self._stops)}")
            row.append(f"{_duration(command.remaining_s)} left")
        head.add_row(*row)
        poses = Table.grid(padding=(0, 2))
        total = sum(self._stops)
        done = self._done(command)
        poses.add_row("measured", ProgressBar(total, done, width=_BAR_WIDTH), f"{done} of {total}")
        if self._estimate is not None:
            poses.add_row("initial pose", "", str(self._estimate))
        if math.isfinite(command.ripple):
            still = ProgressBar(1.0, min(1.0, 1.0 / max(command.ripple, 1e-9)), width=_BAR_WIDTH)
            rest = "rest" if command.ripple <= 1 else f"{command.ripple:.1f} × what rest allows"
            poses.add_row("ripple", still, rest)
        return Group(head, poses, self._tensions(command, sample), Text(self._log, style="dim"))

    def _done(self, command: StartUpCommand) -> int:
        if self._guided:
            return self._estimate.rests if self._estimate is not None else 0
        return sum(self._stops[: command.setpoint]) + (command.state == StartUpState.done)

    def _tensions(self, command: StartUpCommand, sample: RobotSample) -> Table:
        table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
        for name in ("cable", "τ [N]", "set-point [N]"):
            table.add_column(name, justify="right")
        table.add_column(f"{self._limits_N[0]:g} … {self._limits_N[1]:g} N")
        wanted = command.tension_setpoint_N.tolist()
        missing = [math.nan] * self._cables
        read = sample.tension_N.tolist() if len(sample.tension_N) == self._cables else missing
        for i, (tension_N, setpoint_N) in enumerate(zip(read, wanted, strict=True)):
            there = math.isfinite(tension_N)
            bar = ProgressBar(
                self._limits_N[1], float(np.nan_to_num(max(0.0, tension_N))), width=_BAR_WIDTH
            )
            table.add_row(
                str(i + 1), fixed(tension_N if there else None, 1), fixed(setpoint_N, 1), bar
            )
        return table


def _duration(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "–"
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
