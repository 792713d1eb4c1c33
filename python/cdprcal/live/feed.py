"""What the live page is told: messages, kept for pages that are opened late, passed on to others.

Messages are plain data with a ``type``: ``hello`` (what robot), ``sample``, ``estimate``, ``end``.
"""

from __future__ import annotations

import contextlib
import json
import math
import queue
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from cdprcal import _core
from cdprcal._core import RobotSample, StartUpCommand, StartUpState
from cdprcal.acquisition.pose_guard import Place
from cdprcal.acquisition.procedure import STATES
from cdprcal.local_page import LocalServer, Messages

Message = dict[str, Any]

#: Messages kept: half an hour of ten per second. What is older is no longer shown.
_KEPT = 20_000
#: A page that is so far behind has stopped reading.
_WAITING = 5_000


class Feed:
    """Messages to any number of readers. Publishing never waits for them."""

    def __init__(self, hello: Message) -> None:
        self._hello = hello
        self._kept: deque[str] = deque(maxlen=_KEPT)
        self._readers: list[queue.Queue[str | None]] = []
        self._lock = threading.Lock()
        self._gone = threading.Condition(self._lock)
        self._reading = 0
        self._closed = False

    def publish(self, message: Message) -> None:
        """Passes a message on; a reader that does not keep up is dropped."""
        text = json.dumps(message, allow_nan=False)
        with self._lock:
            self._kept.append(text)
            for reader in list(self._readers):
                try:
                    reader.put_nowait(text)
                except queue.Full:
                    self._readers.remove(reader)

    def close(self, wait_s: float = 1.0) -> None:
        """Ends every reader, after what it has not read yet; waits for that, but not for long."""
        with self._lock:
            self._closed = True
            for reader in self._readers:
                with contextlib.suppress(queue.Full):
                    reader.put_nowait(None)
            self._readers.clear()
            self._gone.wait_for(lambda: self._reading == 0, timeout=wait_s)

    def messages(self, heartbeat_s: float = 5.0) -> Iterator[str]:
        """Hello, all that is kept, then what comes; '' when nothing came for ``heartbeat_s``."""
        reader: queue.Queue[str | None] = queue.Queue(_WAITING)
        with self._lock:
            kept = list(self._kept)
            closed = self._closed
            self._reading += 1
            if not closed:
                self._readers.append(reader)
        try:
            yield json.dumps(self._hello, allow_nan=False)
            yield from kept
            while not closed:
                try:
                    text = reader.get(timeout=heartbeat_s)
                except queue.Empty:
                    text = ""
                if text is None:
                    return
                yield text
        finally:
            with self._lock:
                if reader in self._readers:
                    self._readers.remove(reader)
                self._reading -= 1
                self._gone.notify_all()


def hello(
    title: str,
    robot: _core.Robot | None,
    cables: int,
    setpoints: int | None,
    *,
    replay: bool,
    may_stop: bool = False,
) -> Message:
    """The first message: what is shown. Without a robot there are no limits."""
    return {
        "type": "hello",
        "title": title,
        "robot": None if robot is None else robot.name,
        "cables": cables,
        "limits_N": None if robot is None else list(robot.tension_limits_N),
        "setpoints": setpoints,
        "replay": replay,
        "may_stop": may_stop,
    }


def sample_message(
    time_s: float,
    tension_N: Iterable[float],
    setpoint_N: Iterable[float],
    *,
    state: str = "",
    does: str = "",
    setpoint: int | None = None,
    done: int = 0,
    remaining_s: float = math.nan,
    ripple: float = math.nan,
    place: Place | None = None,
) -> Message:
    """One sample: readings, what the robot is doing (``setpoint`` from 1), how many are done."""
    return {
        "type": "sample",
        "time_s": finite(time_s, 3),
        "tension_N": [finite(value, 2) for value in tension_N],
        "setpoint_N": [finite(value, 2) for value in setpoint_N],
        "state": state,
        "does": does,
        "setpoint": setpoint,
        "done": done,
        "remaining_s": finite(remaining_s, 1),
        "ripple": finite(ripple, 2),
        "place": None
        if place is None
        else {
            "position_m": [finite(value, 4) for value in place.position_m],
            "position_sigma_m": [finite(value, 5) for value in place.sigma_m],
        },
    }


def estimate_message(
    time_s: float, estimate: Mapping[str, Any], convention: _core.EulerConvention
) -> Message:
    """The initial pose as known so far, from the event that ``acquire`` logs after every rest."""
    pose = None
    if estimate.get("position_m") is not None and estimate.get("rotation") is not None:
        angles = _core.euler_from_rotation(estimate["rotation"], convention)
        pose = {
            "position_m": [finite(value) for value in estimate["position_m"]],
            "roll_pitch_yaw_rad": [finite(value) for value in angles],
        }
    return {
        "type": "estimate",
        "time_s": finite(time_s, 3),
        "rests": estimate.get("rests"),
        "in_motion": estimate.get("in_motion", False),
        "status": str(estimate.get("status", "")),
        "trusted": bool(estimate.get("trusted", True)),
        "pose": pose,
        "position_sigma_m": estimate.get("position_sigma_m"),
        "rotation_sigma_rad": estimate.get("rotation_sigma_rad"),
        "reached": bool(estimate.get("reached")),
        "diagnosis": estimate.get("diagnosis"),
    }


def end_message(state: str, reason: str) -> Message:
    """The last message."""
    return {"type": "end", "state": state, "reason": reason}


class LiveRun:
    """A start-up as the page follows it: to be told every command, as ``Monitor`` is."""

    def __init__(self, feed: Feed, convention: _core.EulerConvention) -> None:
        self._feed = feed
        self._convention = convention
        self._state: StartUpState | None = None
        self._done = 0

    def show(
        self,
        command: StartUpCommand,
        sample: RobotSample,
        logged: bool,
        place: Place | None = None,
    ) -> None:
        """Publishes what was logged, and every change of state; where it is, if that is known."""
        changed = command.state != self._state
        if not logged and not changed:
            return
        if changed and self._state == StartUpState.measuring:
            self._done += command.state != StartUpState.holding
        self._state = command.state
        self._feed.publish(
            sample_message(
                sample.time_s,
                sample.tension_N.tolist(),
                command.tension_setpoint_N.tolist(),
                state=command.state.name,
                does=command.reason or STATES[command.state],
                setpoint=command.setpoint + 1,
                done=self._done,
                remaining_s=command.remaining_s,
                ripple=command.ripple,
                place=place,
            )
        )

    def estimate(self, time_s: float, estimate: Mapping[str, Any]) -> None:
        """Publishes an estimate, as the log has it."""
        self._feed.publish(estimate_message(time_s, estimate, self._convention))

    def end(self, state: StartUpState, reason: str) -> None:
        """Publishes how it ended."""
        self._feed.publish(end_message(state.name, reason))


def finite(value: float, digits: int = 6) -> float | None:
    """A rounded finite number, or None."""
    return round(float(value), digits) if math.isfinite(value) else None


class LiveServer(LocalServer):
    """Serves the page while its context lasts.

    messages: called once for every page that is opened. stop: what the page's stop button does;
    None: there is no such button, and nothing that the page asks for changes anything. port: 0 is
    any that is free. Raises InputError when the port cannot be had.
    """

    def __init__(
        self, messages: Messages, *, port: int = 0, stop: Callable[[], None] | None = None
    ) -> None:
        def act(_: Any) -> None:
            if stop is not None:
                stop()

        actions = {} if stop is None else {"/stop": act}
        super().__init__("cdprcal.live", port=port, messages=messages, actions=actions)
