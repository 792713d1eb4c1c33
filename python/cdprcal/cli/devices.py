"""What ``cdprcal acquire`` does with a session file: connects its devices, or only reads them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import typer

from cdprcal.command import DONE, UNTRUSTED, WRONG_USE, fail, print_json

if TYPE_CHECKING:
    from rich.console import Group

    from cdprcal import _core
    from cdprcal.hardware.drives.backend import FieldbusBackend
    from cdprcal.hardware.session import Session


def session_for(backend: str, path: str) -> Session:
    """The session file of a backend that needs one; ends the command when they do not fit."""
    from cdprcal.hardware.session import load_session

    if not path:
        fail(f"--backend {backend}: needs --session FILE, which says what is wired to what")
    session = load_session(path)
    if session.bus.type != backend:
        fail(f"--backend {backend}: the session is of bus.type {session.bus.type}; give that one")
    return session


def refuse_simulator_options(session: Session, *, effects: bool, truth: bool) -> None:
    """Ends the command when the simulator is asked for things where there is none."""
    here = session.is_simulated and session.bus.interface == "virtual"
    for name, given in (("--effect", effects), ("--truth", truth)):
        if given and not here:
            fail(f"{name}: is for simulated drives in this process only; leave it out")


def start_up(
    session: Session,
    robot: _core.Robot,
    plan: _core.StartUpPlan,
    options: _core.StartUpOptions,
) -> _core.StartUp:
    """The procedure, no faster than the session allows."""
    from cdprcal import _core

    startup = _core.StartUp(robot, plan, options)
    if startup.velocity_limit_m_s <= session.limits.velocity_m_s:
        return startup
    options.velocity_limit_m_s = session.limits.velocity_m_s
    return _core.StartUp(robot, plan, options)


def connect(
    session: Session,
    robot: _core.Robot,
    plan: _core.Plan,
    options: _core.SimulatorOptions,
    *,
    armed: bool,
) -> FieldbusBackend:
    """The devices; ends the command with exit code 1 when one does not answer or obey."""
    from cdprcal.hardware import BackendError

    backend: FieldbusBackend
    try:
        if session.is_simulated:
            from cdprcal.testing.simulated_devices.connect import SimulatedSession

            backend = SimulatedSession.connect(session, robot, plan, options, armed=armed)
        else:
            from cdprcal.hardware.connect import SessionBackend

            backend = SessionBackend.connect(session, robot, armed=armed)
    except BackendError as error:
        fail(str(error), UNTRUSTED)
    if armed:
        limits = backend.limits
        low, high = limits["tension_N"]
        typer.echo(
            f"cdprcal: limits: tension {low:g} to {high:g} N, cable {limits['velocity_m_s']:g} m/s;"
            f" after a fault it stands within {limits['stop_time_s']:.2f} s and "
            f"{limits['stop_distance_m']:.2f} m",
            err=True,
        )
        for line in _drive_limits(limits["drives"]):
            typer.echo(f"cdprcal: {line}", err=True)
        if limits["travel_m"] is None:
            typer.echo(
                "cdprcal: travel of the cables: what the drives' own set-up says; give "
                "limits.travel_m to limit it here and in the drives",
                err=True,
            )
    return backend


def confirm(backend: FieldbusBackend, *, yes: bool) -> None:
    """Has the operator say that these limits are meant; ends the command when they are not.

    Simulated drives need no word. Where nobody can be asked ``yes`` is needed.
    """
    import sys

    if yes or not backend.is_real:
        return
    if not sys.stdin.isatty():
        backend.stop()
        fail("--arm: nobody is there to confirm the limits above; read them, then add --yes")
    try:
        meant = typer.confirm("cdprcal: move the robot within these limits?", err=True)
    except BaseException:
        backend.stop()
        raise
    if not meant:
        backend.stop()
        fail("nothing was moved; correct the session's limits, then acquire again", UNTRUSTED)


def _drive_limits(drives: list[dict[str, float]]) -> Iterator[str]:
    """What the drives keep by themselves, equal ones in one line."""
    units = {
        "tension_N": "N (0x6072)",
        "velocity_m_s": "m/s (0x6080)",
        "travel_m": "m from here (0x607D)",
    }
    texts = [
        " and ".join(f"{value:.3g} {units[name]}" for name, value in one.items()) for one in drives
    ]
    for text in dict.fromkeys(texts):
        cables = ", ".join(str(at + 1) for at, other in enumerate(texts) if other == text)
        yield f"drives of cables {cables} keep below: {text or 'what their own set-up says'}"


class News:
    """What a device notes, each once: while it is set up, and while it is armed."""

    def __init__(self, device: object) -> None:
        # Only devices by a session file have something to note.
        self._notes: list[str] = getattr(device, "notes", [])
        self._told = 0
        self.tell()

    def tell(self, say: Callable[[str], None] | None = None) -> dict[str, object]:
        """Says what was noted since the last call, on stderr; for the log: ``notes``, if any."""
        new = self._notes[self._told :]
        self._told += len(new)
        for note in new:
            line = f"cdprcal: note: {note}"
            say(line) if say else typer.echo(line, err=True)
        return {"notes": new} if new else {}


def run_dry(backend: FieldbusBackend, seconds: float, *, json: bool) -> None:
    """Reads and prints; ends the command."""
    from cdprcal.hardware import BackendError
    from cdprcal.hardware.dry_run import dry_run, readings

    if not 0.0 < seconds < math.inf:
        backend.stop()
        fail("--seconds: must be above 0", WRONG_USE)
    News(backend)
    screen = _Screen(backend)
    try:
        with screen:
            sample = dry_run(backend, seconds, stop=screen.stop_wanted, watch=screen.show)
    except BackendError as error:
        fail(str(error), UNTRUSTED)
    if json:
        print_json(readings(backend, sample))
    screen.end(sample, json=json)
    raise typer.Exit(UNTRUSTED if backend.tripped else DONE)


class _Screen:
    """The readings as a table: refreshed on a terminal, else printed once at the end."""

    def __init__(self, backend: FieldbusBackend) -> None:
        from rich.live import Live

        from cdprcal.terminal import notes

        self._backend = backend
        self._out = notes()
        self._live = Live(console=self._out, transient=True, auto_refresh=False)
        self._shown_s = 0.0
        self._stop = False

    def __enter__(self) -> _Screen:
        import signal

        if self._out.is_terminal:
            self._live.start()
        self._handler = signal.signal(signal.SIGINT, lambda *_: setattr(self, "_stop", True))
        return self

    def __exit__(self, *_: object) -> None:
        import signal

        signal.signal(signal.SIGINT, self._handler)
        if self._out.is_terminal:
            self._live.stop()

    def stop_wanted(self) -> bool:
        return self._stop

    def show(self, sample: _core.RobotSample) -> None:
        now_s = time.monotonic()
        if self._out.is_terminal and now_s - self._shown_s > 0.1:
            self._shown_s = now_s
            self._live.update(_table(self._backend, sample), refresh=True)

    def end(self, sample: _core.RobotSample, *, json: bool) -> None:
        from cdprcal.terminal import answers, notes, say

        out = notes() if json else answers()
        out.print(_table(self._backend, sample))
        if self._backend.tripped:
            say(out, f"would have stopped: {self._backend.tripped}")
        # Simulated drives are armed unless the run is to be dry.
        move = "add --arm" if self._backend.is_real else "leave out --dry-run"
        say(out, f"dry run: no drive was enabled and no log written; to move, {move}")


def _table(backend: FieldbusBackend, sample: _core.RobotSample) -> Group:
    import numpy as np
    from rich.console import Group

    from cdprcal.terminal import Table

    columns = (
        "cable",
        "node",
        "drive",
        "position",
        "length [m]",
        "swivel [°]",
        "load cell",
        "τ [N]",
    )
    table = Table(*columns, text={2})
    for state in backend.winches:
        table.add_row(
            str(state.winch.cable),
            str(state.winch.node),
            state.state.value + (f" 0x{state.error_code:04X}" if state.error_code else ""),
            "–" if state.position_counts is None else str(state.position_counts),
            f"{state.length_m:.4f}",
            f"{math.degrees(state.swivel_rad):.2f}",
            "–" if state.load_cell_counts is None else str(state.load_cell_counts),
            f"{state.tension_N:.1f}",
        )
    roll, pitch, yaw = np.rad2deg(sample.roll_pitch_yaw_rad).tolist()
    attitude = f"roll {roll:.2f}°  pitch {pitch:.2f}°  yaw {yaw:.2f}°  {sample.time_s:.1f} s"
    return Group(table, attitude)
