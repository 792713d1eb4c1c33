"""Start-ups that are stopped in mid-motion, on the simulated robot: what its cables bear.

    python tests/studies/interrupted.py                          # built-in robots
    python tests/studies/interrupted.py --robot big.yaml --moments 12

Each robot runs a plan until a moment at which the platform moves, and is stopped there by the
operator, or because a drive reports an error. Printed: the least and the largest true tension in
the run until then, and from the stop until four seconds after the winches have locked. Exit code 1
when a cable bears half more after an operator's stop than in the run, or more than its limit.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import cdprcal
from cdprcal.acquisition import start_up_options, start_up_plan
from cdprcal.hardware.simulated import SimulatedBackend

_AFTER_S = 4.0
#: About the middle of most transitions.
_UNDER_WAY_S = 2.0
_MOVING = (cdprcal.StartUpState.moving, cdprcal.StartUpState.moving_to_start)


@dataclass(frozen=True)
class Interrupted:
    """True tensions [N], least and largest, and how long the winches took to lock."""

    before_N: tuple[float, float]
    after_N: tuple[float, float]
    took_s: float


def interrupted(
    robot: cdprcal.Robot, plan: cdprcal.Plan, at: float, *, seed: int, trusted: bool
) -> Interrupted:
    """Stops a run in the first motion after a share ``at`` of its time, by the operator
    (``trusted``) or by a drive's error."""
    startup = cdprcal.StartUp(robot, start_up_plan(plan), start_up_options(plan))
    options = cdprcal.SimulatorOptions(seed=seed)
    limit_m_s = startup.velocity_limit_m_s
    backend = SimulatedBackend.somewhere(robot, plan, options, velocity_limit_m_s=limit_m_s)
    begins_s, moving_s = at * startup.planned_duration_s, 0.0
    before_s, stopped_s = 0.0, float("nan")
    before: list[NDArray[np.float64]] = []
    after: list[NDArray[np.float64]] = []
    while True:
        sample = backend.read()
        if moving_s >= _UNDER_WAY_S or not np.isnan(stopped_s):
            stopped_s = sample.time_s if np.isnan(stopped_s) else stopped_s
            sample.stop_requested = trusted
            sample.drive_error = "" if trusted else "a drive is hot"
        command = startup.step(sample)
        moves = command.state in _MOVING and sample.time_s >= begins_s
        moving_s = moving_s + sample.time_s - before_s if moves else 0.0
        before_s = sample.time_s
        (before if np.isnan(stopped_s) else after).append(backend.truth().tension_N)
        if startup.finished:
            break
        backend.command(command)
    backend.stop()
    for _ in range(round(_AFTER_S * 100)):
        backend.read()
        after.append(backend.truth().tension_N)
    return Interrupted(_range(before), _range(after), before_s - stopped_s)


def _range(tensions_N: list[NDArray[np.float64]]) -> tuple[float, float]:
    return float(np.min(tensions_N)), float(np.max(tensions_N))


def main(arguments: list[str] | None = None) -> int:
    """Exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", action="append", help="file or built-in (default: four)")
    parser.add_argument("--moments", type=int, default=6, help="a robot (default: 6)")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args(arguments)
    bad = 0
    print(f"{'robot':12}{'stopped by':>12}{'in the run [N]':>18}{'after it [N]':>18}{'locked':>9}")
    for name in asked.robot or ("irma4", "ring3", "ring5", "hang4"):
        robot = cdprcal.load_robot(name)
        plan = cdprcal.make_plan(robot).plan
        for trusted in (True, False):
            runs = [
                interrupted(
                    robot, plan, (k + 0.5) / asked.moments, seed=asked.seed, trusted=trusted
                )
                for k in range(asked.moments)
            ]
            before, after = (
                (min(r[0] for r in each), max(r[1] for r in each))
                for each in ([r.before_N for r in runs], [r.after_N for r in runs])
            )
            took_s = max(r.took_s for r in runs)
            print(
                f"{robot.name:12}{'operator' if trusted else 'drive':>12}"
                f"{before[0]:9.1f} …{before[1]:7.1f}{after[0]:9.1f} …{after[1]:7.1f}{took_s:7.2f} s"
            )
            most_N = min(1.5 * before[1], robot.tension_limits_N[1])
            bad += trusted and after[1] > most_N
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
