"""The live page of ``acquire``: options, and the page while a run lasts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from cdprcal import _core
    from cdprcal.acquisition import Acquired
    from cdprcal.acquisition.guide import Estimate
    from cdprcal.live import LiveRun

LiveOption = Annotated[
    bool,
    typer.Option(
        "--live",
        help="Show the run on a page in a browser on this computer; simulated robots then want "
        "--speed 1.",
    ),
]
LiveStopOption = Annotated[
    bool, typer.Option("--live-stop", help="As --live, and the page has a button that stops.")
]
PortOption = Annotated[
    int,
    typer.Option(
        "--port", min=0, max=65535, help="Of the page on 127.0.0.1 (default: a free one)."
    ),
]


class Page:
    """The page of a run, or none at all: then everything is a no-op."""

    def __init__(self, run: LiveRun | None = None) -> None:
        self._run = run
        self.stop_wanted = False

    def show(
        self,
        command: _core.StartUpCommand,
        sample: _core.RobotSample,
        logged: bool,
        estimate: Estimate | None,
    ) -> None:
        """To be called with every command, and with an estimate when there is a new one."""
        if self._run is None:
            return
        self._run.show(command, sample, logged)
        if estimate is not None:
            self._run.estimate(sample.time_s, estimate.as_event())

    def end(self, run: Acquired) -> None:
        """Says how the run ended."""
        if self._run is not None:
            self._run.end(run.state, run.reason)

    def stop(self) -> None:
        """What the page's button does."""
        self.stop_wanted = True


@contextmanager
def live_page(
    wanted: bool,
    may_stop: bool,
    port: int,
    robot: _core.Robot,
    plan: _core.Plan,
    log: str,
    guided: bool,
) -> Iterator[Page]:
    """Serves the page of a run while the context lasts, if it is wanted. Raises InputError.

    guided: the run chooses its stops, so nobody knows how many there will be.
    """
    if not (wanted or may_stop):
        yield Page()
        return
    from cdprcal.live import Feed, LiveRun, LiveServer
    from cdprcal.live.feed import hello
    from cdprcal.tables import console, say

    total = None if guided else 1 + plan.measured_count
    feed = Feed(hello(log, robot, robot.cable_count, total, replay=False, may_stop=may_stop))
    page = Page(LiveRun(feed, robot.euler_convention))
    with LiveServer(feed.messages, port=port, stop=page.stop if may_stop else None) as server:
        say(console(), f"{server.address}: open it in a browser on this computer")
        try:
            yield page
        finally:
            feed.close()
