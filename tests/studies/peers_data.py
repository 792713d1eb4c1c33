"""What all peers solve: simulated calibrations of a 4-cable robot, and their linearisation.

The paper's formulation (eqs 13 to 17): twelve unknown offsets do not hide anything from a peer that
can only minimise a sum of squares. Without tensions a pose has eleven rows (lengths, swivels, yaw,
roll, pitch), with them four more (eq. 12).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import cdprcal
from cdprcal import CalibrationProblem, Measurement, Pose, PoseKind, StaticsModel

Vector = NDArray[np.float64]

#: Tension sets [N] whose equilibria spread over irma4's workspace (Table II, rounded).
SETPOINTS_N = (
    (100.0, 100.0, 100.0, 100.0),
    (118.0, 171.0, 116.0, 83.0),
    (83.0, 116.0, 171.0, 118.0),
    (115.0, 83.0, 119.0, 171.0),
    (171.0, 119.0, 83.0, 115.0),
    (81.0, 56.0, 31.0, 54.0),
    (54.0, 31.0, 56.0, 81.0),
    (31.0, 54.0, 81.0, 56.0),
    (56.0, 81.0, 54.0, 31.0),
)


@dataclass(frozen=True)
class Case:
    """A calibration and where everybody starts."""

    problem: CalibrationProblem
    guess: list[Pose]

    @property
    def poses(self) -> int:
        return len(self.guess)

    @property
    def tensions(self) -> bool:
        return bool(self.problem.statics == StaticsModel.left_inverse)


def problem_of(
    robot: cdprcal.Robot, measurements: Sequence[Measurement], tensions: bool
) -> CalibrationProblem:
    return CalibrationProblem(
        robot=robot,
        measurements=list(measurements),
        statics=StaticsModel.left_inverse if tensions else StaticsModel.none,
        reference_attitude=False,
        reference_statics=False,
        reference_noise=False,
    )


def make_case(poses: int, tensions: bool, seed: int = 3) -> Case:
    """`poses` equilibria of irma4, noise a twentieth of eq. 18; guesses 0.02 m and 1 degree off."""
    robot = cdprcal.load_robot("irma4")
    random = cdprcal.RandomNormal(seed)
    offsets = cdprcal.ReadingOffsets(
        length_m=[0.3, -0.2, 0.5, -0.4], swivel_rad=[0.2, -0.1, 0.4, -0.3], yaw_rad=0.5
    )
    noise = cdprcal.reading_noise(robot.sigma, 0.05)
    at = np.linspace(0.0, len(SETPOINTS_N) - 1.0, poses)
    corners = np.array(SETPOINTS_N)
    kind = PoseKind.static_pose if tensions else PoseKind.kinematic_pose
    truth: list[Pose] = []
    measurements = []
    for place in at:
        leg = min(int(place), len(corners) - 2)
        tension_N = corners[leg] + (place - leg) * (corners[leg + 1] - corners[leg])
        start = truth[-1] if truth else None
        rest = cdprcal.direct_from_tensions(robot, tension_N, start)
        if rest.status != cdprcal.EquilibriumStatus.found or rest.pose is None:
            raise RuntimeError(rest.reason)
        truth.append(rest.pose)
        measurements.append(
            cdprcal.synthetic_measurement(robot, rest.pose, tension_N, kind, offsets, noise, random)
        )
    generator = np.random.default_rng(seed)
    guess = []
    for pose in truth:
        shift, turn = generator.normal(size=(2, 3))
        twist = np.r_[
            0.02 * shift / np.linalg.norm(shift),
            np.deg2rad(1.0) * turn / np.linalg.norm(turn),
        ]
        guess.append(cdprcal.plus(pose, twist))
    return Case(problem_of(robot, measurements, tensions), guess)


class BlockLinearisation:
    """Residuals and analytic Jacobian of a case as blocks, without the zeros between them.

    ``cdprcal.linearise`` returns the dense Jacobian; asked for a few poses at a time, beside the
    reference, its blocks cost next to nothing.
    """

    def __init__(self, case: Case, together: int = 12) -> None:
        measurements = case.problem.measurements
        robot = case.problem.robot
        self.rows = 15 if case.tensions else 11  # of a pose
        self.poses = case.poses
        self._parts: list[tuple[CalibrationProblem, int, int]] = []
        for begin in range(1, self.poses, together):
            end = min(begin + together, self.poses)
            part = problem_of(robot, [measurements[0], *measurements[begin:end]], case.tensions)
            self._parts.append((part, begin, end))

    def __call__(self, poses: Sequence[Pose]) -> tuple[Vector, Vector, Vector]:
        """(residual [k, rows], by its own pose [k, rows, 6], by the first pose [k, rows, 6])."""
        count = self.poses - 1
        residual = np.empty((count, self.rows))
        own = np.empty((count, self.rows, 6))
        first = np.empty((count, self.rows, 6))
        for part, begin, end in self._parts:
            size = end - begin
            r, jacobian = cdprcal.linearise(part, [poses[0], *poses[begin:end]])
            residual[begin - 1 : end - 1] = r.reshape(size, self.rows)
            blocks = jacobian.reshape(size, self.rows, -1)
            first[begin - 1 : end - 1] = blocks[:, :, :6]
            for i in range(size):
                own[begin - 1 + i] = blocks[i, :, 6 * (i + 1) : 6 * (i + 2)]
        return residual, own, first


@dataclass(frozen=True)
class Outcome:
    """What a solver came to."""

    cost: float
    initial_pose: Pose
    iterations: int
    #: Share of the time spent in functions that a compiled user would not have to wait for.
    callback_share: float = 0.0
    note: str = ""


#: The others only minimise: no sentence on which readings see what.
WITHOUT_WORDS = cdprcal.SolveOptions(explain=False)


def ours(case: Case, options: cdprcal.SolveOptions = WITHOUT_WORDS) -> Outcome:
    result: Any = cdprcal.solve(case.problem, case.guess, options)
    if result.status != cdprcal.CalibrationStatus.converged:
        raise RuntimeError(result.reason)
    return Outcome(result.cost, result.initial_pose, result.iterations)
