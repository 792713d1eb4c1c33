"""Simulated start-ups under the pose guard, and how far the platform truly left its corridor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import cdprcal
from cdprcal.acquisition import Acquired, Guide, PoseGuard, acquire, start_up_plan
from cdprcal.hardware.simulated import SimulatedBackend
from cdprcal.io import AcquisitionInputs, open_live_log


@dataclass
class Ended:
    run: Acquired
    lowest_m: float = math.inf  #: truly, of the platform's point
    worst_sigmas: float = 0.0  #: of the estimate in motion
    #: Truly, beyond the margin and three standard deviations of the estimate then, or of the one
    #: before it, by which it went there.
    excess_m: float = -math.inf


def start_up(
    robot: cdprcal.Robot,
    plan: cdprcal.Plan,
    path: Path,
    effects: Sequence[cdprcal.InjectedEffect],
    margin_m: float,
    floor_m: float = -math.inf,
    *,
    seed: int = 1,
) -> Ended:
    """Goes to the poses of a plan; from the first estimate on the guard watches."""
    options = cdprcal.SimulatorOptions(seed=seed, effects=list(effects))
    backend = SimulatedBackend.somewhere(robot, plan, options)
    startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
    guide = Guide(robot, plan, startup)
    guard = PoseGuard(robot, plan, margin_m, floor_m)
    ended = Ended(None)  # type: ignore[arg-type]
    sigma_m: list[np.ndarray] = []  # of the position, when an estimate was replaced

    def watch(command: cdprcal.StartUpCommand, sample: cdprcal.RobotSample, logged: bool) -> None:
        estimate = guide.step(command, sample, logged)
        if estimate is not None:
            sigma_m.append(guard.sigma_m)
            guard.learn(estimate)
        true_m = backend.truth().pose.position_m
        ended.lowest_m = min(ended.lowest_m, true_m[2])
        if guard.position_m is not None:
            beyond_m = np.maximum(guard.lower_m - true_m, true_m - guard.upper_m)
            excess_m = beyond_m - margin_m - 3.0 * np.fmax(guard.sigma_m, sigma_m[-1])
            ended.excess_m = max(ended.excess_m, float(np.max(excess_m)))
            off = np.abs(guard.position_m - true_m) / guard.sigma_m
            ended.worst_sigmas = max(ended.worst_sigmas, float(off.max()))

    log = open_live_log(path, robot.cable_count, AcquisitionInputs("", "", {}), 10.0)
    ended.run = acquire(startup, backend, log, watch=watch, guard=guard.look)
    return ended
