"""What must not hold up the control loop, done beside it: drawing on a terminal, writing a log."""

from __future__ import annotations

import queue
import sys
import threading
from collections.abc import Callable
from typing import Any

from cdprcal._core import RobotSample
from cdprcal.io.events import Event
from cdprcal.io.live_log import LiveLog

#: What may wait: at 10 rows a second more than ten seconds of a disk that stands still.
MOST_WAITING = 128
#: A tenth of Python's own 5 ms: half a cycle at 1 kHz.
_SWITCH_S = 5e-4


class Beside:
    """A thread that does what it is given, in order. Exceptions end it, and are kept."""

    def __init__(self, name: str, most: int = MOST_WAITING) -> None:
        # Whoever computes in Python holds all others up for so long.
        sys.setswitchinterval(_SWITCH_S)
        self._waiting: queue.Queue[Callable[[], object] | None] = queue.Queue(most)
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def failure(self) -> BaseException | None:
        """What ended it."""
        return self._failure

    def do(self, work: Callable[[], object]) -> bool:
        """Takes it over and returns at once; False where too much is waiting already."""
        try:
            self._waiting.put_nowait(work)
        except queue.Full:
            return False
        return True

    @property
    def idle(self) -> bool:
        """Whether all that was taken over has at least begun."""
        return self._waiting.empty()

    def end(self, patience_s: float | None = None) -> bool:
        """Lets it finish, for so long at most; whether it has."""
        try:
            self._waiting.put(None, timeout=patience_s)
        except queue.Full:
            return False
        self._thread.join(patience_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (work := self._waiting.get()) is not None:
            if self._failure is not None:
                continue  # what was taken over is emptied, so that nobody waits for room
            try:
                work()
            except BaseException as error:
                self._failure = error


class LogBeside:
    """A log that another thread writes. What fails there is raised by the next call here.

    A disk that stands still for so long that ``MOST_WAITING`` rows wait is an error, too.
    """

    def __init__(self, log: LiveLog) -> None:
        self._log = log
        self._beside = Beside("log")

    def sample(self, sample: RobotSample, setpoint_N: Any) -> None:
        """As LiveLog: the arrays are new ones in every cycle, and are kept as they are."""
        self._take(lambda: self._log.sample(sample, setpoint_N))

    def event(self, event: Event) -> None:
        """As LiveLog."""
        self._take(lambda: self._log.event(event))

    def close(self) -> None:
        """Waits until all is written. Raises OSError as LiveLog, once."""
        self._beside.end()
        failure = self._beside.failure
        try:
            self._log.close()
        finally:
            if failure is not None:
                raise failure

    def _take(self, write: Callable[[], None]) -> None:
        if self._beside.failure is not None:
            raise self._beside.failure
        if not self._beside.do(write):
            raise OSError(None, "the disk has stood still for too long", "log")


__all__ = ["Beside", "LogBeside"]
