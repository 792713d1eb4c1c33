"""Logs of one robot, fitted again with the effects that a person chose and without some poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from cdprcal import _core
from cdprcal._core import DiagnoseOptions, Diagnosis, DiscreteFault, InputError, Log, Robot
from cdprcal.sensors import LOG_GROUPS, SENSORS


class LeftOut(NamedTuple):
    """A pose that is not to count: which log, from 0, and when, since its run's first sample."""

    run: int
    run_time_s: float


class Choice(BaseModel):
    """What a person chose."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    #: Names in the order to be fitted; None: those that the diagnosis finds.
    effects: tuple[str, ...] | None = None
    left_out: tuple[LeftOut, ...] = Field(default=())


class Exploration:
    """A robot and logs of it. All numbers are those of ``diagnose``; nothing is fitted here."""

    def __init__(self, robot: Robot, logs: Sequence[Log]) -> None:
        self.robot = robot
        self.logs = tuple(logs)
        # Looking for faults takes longer than a fit: they are those of the first one of its poses.
        self._faults: dict[tuple[LeftOut, ...], list[DiscreteFault]] = {}
        self._formulas = ""  # those that the last search wrote can be chosen by name, too

    def _robot_with_formulas(self) -> Robot:
        if not self._formulas:
            return self.robot
        return _core.with_effect_definitions(self.robot, self._formulas, "formulas")

    def fit(self, choice: Choice, progress: Callable[[str], bool] | None = None) -> Diagnosis:
        """The diagnosis with exactly the chosen effects, or with those that it finds itself.

        ``progress`` is called with each step of a search; False ends it with what was found. Raises
        InputError for an effect that cannot be fitted, a pose that is none, and where what is left
        of a log cannot be fitted.
        """
        for pose in choice.left_out:
            if not 0 <= pose.run < len(self.logs):
                raise InputError(
                    f"there is no log {pose.run + 1} to leave a pose out of; give one that is "
                    "there, counted from 0"
                )
        logs = [
            without_rests(log, self.robot, [p.run_time_s for p in choice.left_out if p.run == run])
            for run, log in enumerate(self.logs)
        ]
        if choice.effects is None:
            found = _core.diagnose(self.robot, logs, None, progress)
            self._formulas = found.corrected.effect_definitions
            return found
        options = DiagnoseOptions(effects=choice.effects, faults=self._faults.get(choice.left_out))
        found = _core.diagnose(self._robot_with_formulas(), logs, options)
        self._faults[choice.left_out] = found.faults
        return found


def without_rests(log: Log, robot: Robot, run_times_s: Sequence[float]) -> Log:
    """A log without what was read at the rests at these times, since its run's first sample.

    The samples stay, without readings: without them there would be a gap, which ends a run. Raises
    InputError where there is no rest, and for the rest that the run begins with.
    """
    if not run_times_s:
        return log
    run = _core.segments(log)[-1]
    rests = [rest.samples for rest in _core.detect_equilibria(log, run, robot.sigma)]
    groups = {field: np.array(getattr(log, field)) for field in LOG_GROUPS}
    for run_time_s in run_times_s:
        time_s = log.time_s[run.begin] + run_time_s
        at = [r for r in rests if log.time_s[r.begin] <= time_s <= log.time_s[r.end - 1]]
        if not at:
            raise InputError(
                f"{log.source}: no rest at {run_time_s:g} s that could be left out; give the time "
                "of one, from the run's first sample on"
            )
        if at[0].begin == run.begin:
            raise InputError(
                f"{log.source}: the rest at {run_time_s:g} s holds the initial pose, which is what "
                "is asked for; leave out another"
            )
        for field in SENSORS:
            groups[field][at[0].begin : at[0].end] = np.nan
    return Log(time_s=np.array(log.time_s), source=log.source, **groups)
