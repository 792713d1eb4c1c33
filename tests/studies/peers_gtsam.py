"""The same calibration in GTSAM: a custom factor a pose, with our analytic Jacobians.

The factors are Python functions, since GTSAM has none for a swivel pulley. What they take is told
beside (callback share): a factor in C++ would take about what ours takes.
"""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import gtsam
import numpy as np
from peers_data import BlockLinearisation, Case, Outcome

from cdprcal import Pose


class GtsamCalibration:
    """Keys 0 … k are the poses. GTSAM's tangent is (rotation, translation) in the body's axes."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.callback_s = 0.0
        measurements = case.problem.measurements
        self.parts = [
            BlockLinearisation(
                Case(_pair(case, measurements[0], measurements[i]), [case.guess[0], case.guess[i]])
            )
            for i in range(1, case.poses)
        ]
        self.graph = gtsam.NonlinearFactorGraph()
        noise = gtsam.noiseModel.Unit.Create(self.parts[0].rows)
        for i in range(1, case.poses):
            self.graph.add(gtsam.CustomFactor(noise, [0, i], partial(self._error, i - 1)))
        self.start = gtsam.Values()
        for i, pose in enumerate(case.guess):
            self.start.insert(i, gtsam.Pose3(gtsam.Rot3(pose.rotation), pose.position_m))

    def _error(self, part: int, factor: Any, values: Any, jacobians: Any) -> Any:
        begin = time.perf_counter()
        keys = factor.keys()
        places = [values.atPose3(keys[0]), values.atPose3(keys[1])]
        poses = [Pose(p.translation(), p.rotation().matrix()) for p in places]
        residual, own, first = self.parts[part](poses)
        if jacobians is not None:
            for which, block in enumerate((first[0], own[0])):
                rotation = poses[which].rotation
                turned = np.hstack([block[:, 3:] @ rotation, block[:, :3] @ rotation])
                jacobians[which] = np.asfortranarray(turned)
        self.callback_s += time.perf_counter() - begin
        return residual[0]

    def solve(self) -> Outcome:
        self.callback_s = 0.0
        begin = time.perf_counter()
        parameters = gtsam.LevenbergMarquardtParams()
        parameters.setRelativeErrorTol(1e-12)
        parameters.setAbsoluteErrorTol(1e-12)
        parameters.setMaxIterations(100)
        optimizer = gtsam.LevenbergMarquardtOptimizer(self.graph, self.start, parameters)
        values = optimizer.optimize()
        share = self.callback_s / (time.perf_counter() - begin)
        first = values.atPose3(0)
        pose = Pose(first.translation(), first.rotation().matrix())
        return Outcome(optimizer.error(), pose, int(optimizer.iterations()), share)


def _pair(case: Case, first: Any, other: Any) -> Any:
    from peers_data import problem_of

    return problem_of(case.problem.robot, [first, other], case.tensions)
