"""A log as if it were running: the messages of the live page, in the log's time."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError, StartUpState
from cdprcal.acquisition.pose_guard import Place
from cdprcal.acquisition.procedure import STATES
from cdprcal.io.events import read_events
from cdprcal.io.loaded import LogFile
from cdprcal.live.feed import end_message, estimate_message, hello, sample_message

_DOES = {state.name: text for state, text in STATES.items()}
_LONGEST_PAUSE_S = 2.0


def replay_messages(
    file: LogFile,
    robot: _core.Robot | None,
    setpoints: int | None,
    *,
    places: Mapping[float, Place] | None = None,
    speed: float = 1.0,
    sleep: Callable[[float], None] = time.sleep,
) -> Iterator[str]:
    """Messages of a log from its beginning, ``speed`` seconds of it per second; 0: all at once.

    What the robot was doing comes from the events of an acquired log; in others, rests are found.
    setpoints: of the plan, where it is known. places: where the platform is, by time (places_of).
    """
    log = file.log
    title = Path(file.path).name
    yield _text(hello(title, robot, log.cable_count, setpoints, replay=True))
    following = _Events(file, robot) if file.format != "raw" else _Rests(file, robot)
    if isinstance(following, _Events) and following.empty:
        following = _Rests(file, robot)
    before_s = None
    read: tuple[list[float], list[float]] = ([], [])

    def sample(until_s: float) -> str:
        """What is shown of the latest row, with all that happened until then."""
        assert before_s is not None
        state, does, setpoint, done = following.at(until_s)
        place = places.get(before_s) if places else None
        return _text(
            sample_message(
                before_s, *read, state=state, does=does, setpoint=setpoint, done=done, place=place
            )
        )

    for i, time_s in enumerate(log.time_s.tolist()):
        if speed and before_s is not None:
            sleep(min((time_s - before_s) / speed, _LONGEST_PAUSE_S))
        before_s = time_s
        read = (log.tension_N[i].tolist(), log.tension_setpoint_N[i].tolist())
        shown = sample(time_s)
        yield from map(_text, following.estimates())
        yield shown
    if before_s is not None:
        last = sample(math.inf)
        yield from map(_text, following.estimates())
        yield last
    yield _text(end_message(following.last_state, following.reason))


def places_of(log: _core.Log, robot: _core.Robot) -> dict[float, Place]:
    """Where the platform is at every sample of a log that can be trusted there, by time.

    From the calibration of the whole log, which who watches the run does not have yet. Empty where
    it gives no pose.
    """
    try:
        track = _core.track(_core.calibrate(robot, log), log)
    except InputError:
        return {}
    sigma_m = np.sqrt(track.pose_covariance[:, range(3), range(3)])
    rows = zip(track.time_s.tolist(), track.position_m, sigma_m, track.trusted, strict=True)
    return {time_s: Place(at_m, of_m) for time_s, at_m, of_m, trusted in rows if trusted}


class _Events:
    """What an acquired log says the robot was doing."""

    def __init__(self, file: LogFile, robot: _core.Robot | None) -> None:
        self._events = read_events(file.path)
        self._convention = _core.EulerConvention.XYZ if robot is None else robot.euler_convention
        self._next = 0
        self._now: Mapping[str, Any] = {}
        self._done = 0
        self._new: list[dict[str, Any]] = []

    @property
    def empty(self) -> bool:
        return not self._events

    @property
    def last_state(self) -> str:
        return str(self._events[-1].get("state", "done"))

    @property
    def reason(self) -> str:
        return str(self._events[-1].get("reason", ""))

    def at(self, time_s: float) -> tuple[str, str, int | None, int]:
        while self._next < len(self._events) and self._events[self._next]["time_s"] <= time_s:
            event = self._events[self._next]
            self._next += 1
            if isinstance(event.get("estimate"), dict):
                self._new.append(
                    estimate_message(event["time_s"], event["estimate"], self._convention)
                )
            elif "state" in event:
                ended = event["state"] != StartUpState.holding.name
                if ended and self._now.get("state") == StartUpState.measuring.name:
                    self._done += 1
                self._now = event
        state = str(self._now.get("state", ""))
        does = str(self._now.get("reason", "")) or _DOES.get(state, state)
        return state, does, self._now.get("setpoint"), self._done

    def estimates(self) -> list[dict[str, Any]]:
        new, self._new = self._new, []
        return new


class _Rests:
    """Where nobody says: the rests that are found in the log."""

    last_state, reason = "done", ""

    def __init__(self, file: LogFile, robot: _core.Robot | None) -> None:
        sigma = None if robot is None else robot.sigma
        self._rests = []
        for segment in _core.segments(file.log):
            try:
                self._rests += _core.detect_equilibria(file.log, segment, sigma)
            except _core.InputError:
                return  # nothing that could tell

    def at(self, time_s: float) -> tuple[str, str, int | None, int]:
        done = sum(rest.end_s < time_s for rest in self._rests)
        resting = any(rest.begin_s <= time_s <= rest.end_s for rest in self._rests)
        if not self._rests:
            return "", "", None, 0
        return ("measuring", "at rest", None, done) if resting else ("moving", "moving", None, done)

    def estimates(self) -> list[dict[str, Any]]:
        return []


def _text(message: dict[str, Any]) -> str:
    return json.dumps(message, allow_nan=False)
