"""The live page of ``acquire``: options, and the page while a run lasts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

if TYPE_CHECKING:
    from cdprcal import _core
    from cdprcal.acquisition import Acquired
    from cdprcal.acquisition.guide import Estimate
    from cdprcal.acquisition.pose_guard import Place
    from cdprcal.live import Feed, LiveRun, LiveServer
    from cdprcal.local_page import LocalServer

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


def serve(server: LocalServer) -> NoReturn:
    """Says where a page is, and ends the command at Ctrl-C."""
    import threading

    from cdprcal.terminal import notes, say

    try:
        say(notes(), f"Open {server.address} in a browser on this computer; Ctrl-C ends")
        threading.Event().wait()
    except KeyboardInterrupt:
        pass
    raise typer.Exit


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
        place: Place | None = None,
    ) -> None:
        """To be called with every command, and with an estimate when there is a new one.

        Never raises: the robot does not depend on its page.
        """
        if self._run is None:
            return
        try:
            self._run.show(command, sample, logged, place)
            if estimate is not None:
                self._run.estimate(sample.time_s, estimate.as_event())
        except Exception as error:
            from cdprcal.terminal import notes, say

            self._run = None
            say(notes(), f"the live page stopped, the robot goes on: {error}")

    def end(self, run: Acquired) -> None:
        """Says how the run ended."""
        if self._run is not None:
            self._run.end(run.state, run.reason)

    def stop(self) -> None:
        """What the page's button does."""
        self.stop_wanted = True


def live_page(
    wanted: bool,
    may_stop: bool,
    port: int,
    robot: _core.Robot,
    plan: _core.Plan,
    log: str,
    guided: bool,
) -> AbstractContextManager[Page]:
    """The page of a run, served while the context lasts; one that shows nothing if not wanted.

    The port is taken at once, before any robot is connected: raises InputError when it cannot be
    had. guided: the run chooses its stops, so nobody knows how many there will be.
    """
    if not (wanted or may_stop):
        return nullcontext(Page())
    from cdprcal.live import Feed, LiveRun, LiveServer
    from cdprcal.live.feed import hello

    total = None if guided else 1 + plan.measured_count
    feed = Feed(hello(log, robot, robot.cable_count, total, replay=False, may_stop=may_stop))
    page = Page(LiveRun(feed, robot.euler_convention))
    server = LiveServer(feed.messages, port=port, stop=page.stop if may_stop else None)
    return _served(server, feed, page)


@contextmanager
def _served(server: LiveServer, feed: Feed, page: Page) -> Iterator[Page]:
    from cdprcal.terminal import notes, say

    with server:
        say(notes(), f"Open {server.address} in a browser on this computer")
        try:
            yield page
        finally:
            feed.close()
