"""A simulated robot in a process of its own: drives on a CAN bus, an AHRS on a pty.

    python -m cdprcal.testing.simulated_devices irma4 plan.csv \\
        --session examples/canopen-two-processes.yaml &
    cdprcal acquire irma4 plan.csv --backend canopen \\
        --session examples/canopen-two-processes.yaml -o run.mcap

What the drives do is said on stderr. Ctrl-C ends it.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
import tty
from pathlib import Path
from types import FrameType
from typing import Annotated, Self

import typer

from cdprcal import _core
from cdprcal.command import RobotArgument, fail, reports_errors
from cdprcal.hardware.backend import BackendError
from cdprcal.hardware.drives.bounds import check_session
from cdprcal.hardware.drives.canopen_bus import open_can_bus
from cdprcal.hardware.drives.cia402 import State
from cdprcal.hardware.session import Ahrs, CanopenBus, load_session
from cdprcal.hardware.simulated import start_of
from cdprcal.io.files import read_bytes, reason
from cdprcal.testing.simulated_devices.mti import SimulatedMti
from cdprcal.testing.simulated_devices.robot import SimulatedRobotOnCan

_SYNC = 0x80
_POLL_S = 0.002
#: Time is the master's, cycle by cycle; when it has been silent for so long, that of the wall.
_SILENCE_S = 0.5

EXAMPLE = (
    "Example: python -m cdprcal.testing.simulated_devices irma4 plan.csv --session "
    "examples/canopen-two-processes.yaml"
)


class PtyMti:
    """A simulated MTi at the end of a pty; ``ahrs.port`` becomes a link to its other end."""

    def __init__(self, ahrs: Ahrs) -> None:
        try:
            self._ours, self._theirs = os.openpty()
        except OSError as error:
            raise BackendError(
                f"no pseudo-terminal for the simulated AHRS: {reason(error)}; mount /dev/pts"
            ) from None
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self._link = Path(ahrs.port)
        if self._link.exists() and not self._link.is_symlink():
            raise BackendError(
                f"{ahrs.port}: is there already, and no link of a simulated AHRS; give "
                "another ahrs.port"
            )
        try:
            self._link.unlink(missing_ok=True)
            self._link.symlink_to(os.ttyname(self._theirs))
        except OSError as error:
            raise BackendError(f"{ahrs.port}: cannot be made: {reason(error)}") from None
        self.device = SimulatedMti(ahrs, self._send)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._link.unlink(missing_ok=True)
        os.close(self._ours)
        os.close(self._theirs)

    def serve(self) -> None:
        """Answers what was asked."""
        with contextlib.suppress(BlockingIOError):
            self.device.receive(os.read(self._ours, 4096))

    def _send(self, data: bytes) -> None:
        with contextlib.suppress(BlockingIOError):  # nobody reads: a line forgets
            os.write(self._ours, data)


@reports_errors
def command(
    robot: RobotArgument,
    plan: Annotated[str, typer.Argument(metavar="PLAN", help="It hangs in the plan's box.")],
    session: Annotated[str, typer.Option(metavar="FILE", help="On the interface udp_multicast.")],
    seed: Annotated[int, typer.Option(min=0)] = 1,
    effect: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUES")] = None,
) -> None:
    """Simulate a robot on a CAN bus until Ctrl-C."""
    the_robot = _core.load_robot(robot)
    the_plan = _core.parse_plan(read_bytes(Path(plan)).decode("utf-8", "replace"), plan)
    settings = load_session(session)
    check_session(settings, the_robot)
    bus = settings.bus
    if (
        not settings.is_simulated
        or not isinstance(bus, CanopenBus)
        or bus.interface != "udp_multicast"
    ):
        fail(f"{session}: needs `simulated` and a bus with the interface udp_multicast")
    options = _core.SimulatorOptions(
        seed=seed, effects=[_core.parse_injected_effect(text, the_robot) for text in effect or []]
    )
    stop = _Stop()
    with contextlib.ExitStack() as stack:
        try:
            can_bus = open_can_bus(bus)
            stack.callback(can_bus.shutdown)
            mti = stack.enter_context(PtyMti(settings.ahrs)) if settings.ahrs else None
        except BackendError as error:
            fail(str(error), 1)
        simulated = SimulatedRobotOnCan(
            settings,
            the_robot,
            start_of(the_robot, the_plan, seed),
            options,
            can_bus,
            mti.device if mti else None,
        )
        typer.echo("simulated robot: ready", err=True)
        states = [node.drive.state for node in simulated.nodes]
        heard_s = passed_s = time.monotonic()
        while not stop.wanted:
            message = can_bus.recv(_POLL_S)
            now_s = time.monotonic()
            if mti is not None:
                mti.serve()
            if message is not None:
                heard_s = passed_s = now_s
                if message.arbitration_id == _SYNC:
                    simulated.advance(simulated.time_s + settings.period_s)
                simulated.take(message)
                if message.arbitration_id != _SYNC:
                    continue  # what drives have come to is told once a cycle
            elif now_s - heard_s > _SILENCE_S:
                simulated.advance(simulated.time_s + now_s - passed_s)
                passed_s = now_s
            states = _tell(simulated, states)


def _tell(simulated: SimulatedRobotOnCan, before: list[State]) -> list[State]:
    now: list[State] = [node.drive.state for node in simulated.nodes]
    if now != before:
        words = ", ".join(node.drive.state.value for node in simulated.nodes)
        typer.echo(f"{simulated.time_s:.3f} s  drives: {words}", err=True)
    return now


class _Stop:
    """Set by Ctrl-C and SIGTERM."""

    def __init__(self) -> None:
        self.wanted = False
        for name in (signal.SIGINT, signal.SIGTERM):
            signal.signal(name, self._set)

    def _set(self, number: int, frame: FrameType | None) -> None:
        self.wanted = True


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
    app.command(epilog=EXAMPLE)(command)
    app(sys.argv[1:], prog_name="python -m cdprcal.testing.simulated_devices")
