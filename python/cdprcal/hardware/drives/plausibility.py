"""Whether a session is true of its winches, seen before anything moves.

While the drives hold the platform at standstill, each motor's torque must be that of its cable's
tension, and all tensions together must carry the platform. A drum's diameter for its radius, a gear
left out, a sign, a load cell in other units: all of them show here. Torque mode would act on
them at once, and the limits of the last layer come from the same numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdprcal import _core
from cdprcal.hardware.drives.supervision import name_of
from cdprcal.hardware.drives.winch import WinchState

#: How many standard deviations (of the robot file) a load cell may be off.
_SIGMAS = 2.0


class Plausibility:
    """Collects what is read at standstill, and judges it."""

    def __init__(self, robot: _core.Robot, winches: Sequence[WinchState]) -> None:
        self._robot = robot
        self._winches = winches
        self._rows: list[tuple[list[float], list[float]]] = []

    def collect(self) -> None:
        """A cycle's readings; those with one missing do not count."""
        row = (
            [winch.tension_N for winch in self._winches],
            [winch.torque_tension_N for winch in self._winches],
        )
        if all(map(math.isfinite, row[0])):
            self._rows.append(row)

    def wrong(self) -> str:
        """What cannot be true; empty: nothing, or there is too little to say."""
        if not self._rows:
            return ""
        read_N, torque_N = np.mean(self._rows, axis=0)
        off_N = _SIGMAS * self._robot.sigma.tension_N
        for at, winch in enumerate(self._winches):
            if said := _apart(read_N[at], torque_N[at], off_N, efficiency_of(winch)):
                return f"{name_of(winch)}: {said}"
        all_off_N = off_N * math.sqrt(len(self._winches))
        weight_N, sum_N = self._robot.weight_N, float(read_N.sum())
        if sum_N + all_off_N < weight_N:
            return (
                f"all load cells together read {sum_N:.0f} N, and the platform weighs "
                f"{weight_N:.0f} N; check counts_per_N, zero_counts and the robot file's mass_kg"
            )
        worst = min(efficiency_of(winch) for winch in self._winches)
        if said := _apart(sum_N, float(torque_N.sum()), all_off_N, worst):
            return f"all winches together: {said}"
        return ""


def efficiency_of(winch: WinchState) -> float:
    """Of gear, drum and pulleys, as the session has it; 1 where it says nothing."""
    return 1.0 if winch.winch.torque is None else winch.winch.torque.efficiency


def _apart(read_N: float, torque_N: float, off_N: float, efficiency: float) -> str:
    """What is wrong when friction does not explain a torque; NaN is not."""
    least_N, most_N = efficiency * (read_N - off_N), (read_N + off_N) / efficiency
    if not (torque_N < least_N or torque_N > most_N):
        return ""
    return (
        f"the motor's torque would hold {torque_N:.0f} N where the load cell reads {read_N:.0f} N; "
        "check sign, drum_radius_m, gear_ratio, rated_torque_Nm and counts_per_N"
    )


__all__ = ["Plausibility"]
