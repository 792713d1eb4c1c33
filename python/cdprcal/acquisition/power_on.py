"""Whether every cable bears something at power-on, looked at before any winch moves."""

from __future__ import annotations

import math

import numpy as np

from cdprcal import _core
from cdprcal._core import RobotSample


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


__all__ = ["PowerOn"]
