"""The same calibration by scipy.optimize.least_squares with the same analytic Jacobian.

An independent optimiser has to find the same minimum; and both times stand in one table:
pytest tests/python/test_scipy_peer.py --benchmark-columns=median,min,rounds

And a short version of tests/studies/peers.py: everybody comes to the same minimum.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import peers
import pytest
from numpy.typing import NDArray
from peers_data import BlockLinearisation, Outcome, make_case, ours
from scipy.optimize import OptimizeResult, least_squares
from scipy.spatial.transform import Rotation

import cdprcal
from cdprcal import CalibrateOptions, CalibrationProblem, Formulation, Method, Pose
from conftest import TABLE_II_TENSIONS_N

Case = tuple[CalibrationProblem, list[Pose]]
Vector = NDArray[np.float64]


def left_jacobian(rotation_vector: Vector) -> Vector:
    """J with exp(v + dv) = exp(J dv) exp(v) to first order (Rodrigues' series, closed form)."""
    angle = float(np.linalg.norm(rotation_vector))
    x, y, z = rotation_vector
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    result: Vector
    if angle < 1e-6:
        result = np.eye(3) + 0.5 * skew + skew @ skew / 6.0
        return result
    a = (1.0 - np.cos(angle)) / angle**2
    b = (angle - np.sin(angle)) / angle**3
    result = np.eye(3) + a * skew + b * skew @ skew
    return result


class ScipyCalibration:
    """x: six numbers a pose (displacement, rotation vector) relative to the guess."""

    def __init__(self, problem: CalibrationProblem, guess: Sequence[Pose]) -> None:
        self.problem = problem
        self.guess = list(guess)

    def poses(self, x: Vector) -> list[Pose]:
        twists = x.reshape(-1, 6)
        return [cdprcal.plus(g, t) for g, t in zip(self.guess, twists, strict=True)]

    def residual(self, x: Vector) -> Vector:
        return cdprcal.linearise(self.problem, self.poses(x))[0]

    def jacobian(self, x: Vector) -> Vector:
        jacobian = cdprcal.linearise(self.problem, self.poses(x))[1][:, : x.size].copy()
        for i, twist in enumerate(x.reshape(-1, 6)):
            rotation = slice(6 * i + 3, 6 * i + 6)
            jacobian[:, rotation] = jacobian[:, rotation] @ left_jacobian(twist[3:])
        return jacobian

    def solve(self) -> OptimizeResult:
        return least_squares(
            self.residual,
            np.zeros(6 * len(self.guess)),
            self.jacobian,
            method="trf",
            x_scale="jac",
            ftol=1e-12,
            xtol=1e-12,
            gtol=1e-12,
        )


def trial_a(robot: cdprcal.Robot, folder: Path) -> Case:
    record = json.loads((folder / "trial_a.json").read_text())
    guess = [Pose.from_euler(g[:3], g[3:]) for g in record["initial_guess"]]
    options = CalibrateOptions(
        method=Method.statics, formulation=Formulation.paper, at_s=record["times_s"]
    )
    log = cdprcal.read_log(str(folder / "trial_a.csv"))
    return cdprcal.prepare(robot, log, options).problem, guess


def generated(robot: cdprcal.Robot) -> Case:
    """Eight static poses, eqs 13-17, from 0.05 m and 3 degrees off."""
    options = cdprcal.SyntheticLogOptions(
        dwell_s=2.0, move_s=2.0, noise=cdprcal.reading_noise(robot.sigma, 0.05), seed=3
    )
    made = cdprcal.synthetic_log(robot, [np.array(t) for t in TABLE_II_TENSIONS_N], options)
    times = [4.0 * i + 1.5 for i in range(len(TABLE_II_TENSIONS_N))]  # late in each dwell
    calibrate = CalibrateOptions(method=Method.statics, formulation=Formulation.paper, at_s=times)
    calibration = cdprcal.calibrate(robot, made.log, calibrate)
    random = np.random.default_rng(4)
    guess = []
    for pose in calibration.result.poses:
        direction, axis = random.normal(size=(2, 3))
        twist = np.r_[
            0.05 * direction / np.linalg.norm(direction),
            np.deg2rad(3.0) * axis / np.linalg.norm(axis),
        ]
        guess.append(cdprcal.plus(pose, twist))
    return calibration.problem, guess


@pytest.fixture(scope="module", params=["generated", "trial_a"])
def case(request: pytest.FixtureRequest, robot: cdprcal.Robot) -> Case:
    if request.param == "trial_a":
        shared: Path = request.getfixturevalue("shared_data")
        return trial_a(robot, shared / "irma4")
    return generated(robot)


def test_left_jacobian_is_the_derivative_of_the_exponential() -> None:
    random = np.random.default_rng(1)
    for size in (0.0, 1e-8, 1e-3, 1.0, 3.0):
        v = random.normal(size=3)
        v *= size / np.linalg.norm(v)
        at = Rotation.from_rotvec(v)
        for k in range(3):
            step = 1e-6 * np.eye(3)[k]
            ahead = Rotation.from_rotvec(v + step) * at.inv()
            behind = Rotation.from_rotvec(v - step) * at.inv()
            numeric = (ahead.as_rotvec() - behind.as_rotvec()) / 2e-6
            np.testing.assert_allclose(left_jacobian(v)[:, k], numeric, atol=1e-8)


def test_jacobian_of_the_linearised_problem(case: Case) -> None:
    """Against central differences of its residual, at the guess."""
    problem, guess = case
    residual, jacobian = cdprcal.linearise(problem, guess)
    assert jacobian.shape == (residual.size, 6 * len(guess) + 2 * problem.robot.cable_count + 1)
    scipy = ScipyCalibration(problem, guess)
    for column in range(6 * len(guess)):
        step = np.zeros(6 * len(guess))
        step[column] = 1e-6
        numeric = (scipy.residual(step) - scipy.residual(-step)) / 2e-6
        np.testing.assert_allclose(
            jacobian[:, column], numeric, atol=1e-6 * np.abs(jacobian[:, column]).max() + 1e-6
        )


def test_linearise_refuses_other_sizes(case: Case) -> None:
    problem, guess = case
    with pytest.raises(cdprcal.InputError, match="guessed poses"):
        cdprcal.linearise(problem, guess[1:])
    with pytest.raises(cdprcal.InputError, match="reference errors"):
        cdprcal.linearise(problem, guess, np.zeros(3))


def test_scipy_finds_the_same_minimum(case: Case) -> None:
    problem, guess = case
    ours = cdprcal.solve(problem, guess)
    assert ours.status == cdprcal.CalibrationStatus.converged
    scipy = ScipyCalibration(problem, guess)
    theirs = scipy.solve()
    assert theirs.cost == pytest.approx(ours.cost, rel=1e-9, abs=1e-9)
    for a, b in zip(ours.poses, scipy.poses(theirs.x), strict=True):
        np.testing.assert_allclose(cdprcal.minus(a, b), 0.0, atol=1e-6)


@pytest.mark.alone
@pytest.mark.benchmark(group="one calibration, 8 static poses")
def test_time_of_ours(benchmark: Callable[..., Any], case: Case) -> None:
    result = benchmark(cdprcal.solve, *case)
    assert result.status == cdprcal.CalibrationStatus.converged


@pytest.mark.alone
@pytest.mark.benchmark(group="one calibration, 8 static poses")
def test_time_of_scipy(benchmark: Any, case: Case) -> None:
    result = benchmark.pedantic(ScipyCalibration(*case).solve, rounds=5, warmup_rounds=1)
    assert result.success


@pytest.mark.parametrize("tensions", [False, True])
def test_everybody_comes_to_the_same_minimum(tensions: bool) -> None:
    left_out: list[str] = []
    rows = peers.calibrations(8, tensions, rounds=1, left_out=left_out)
    assert [row.solver for row in rows if not row.agrees] == []
    assert {"cdprcal", "SciPy, dense", "SciPy, sparse"} <= {row.solver for row in rows}
    assert len(rows) + len(left_out) == len(peers.SOLVERS)  # nobody is missing without a word
    peers.show(rows)


def test_equilibria_are_those_of_fsolve() -> None:
    rows = peers.all_equilibria(points=20, rounds=1, left_out=[])
    assert len(rows) == 4
    assert all(row.agrees for row in rows)


@pytest.mark.parametrize("tensions", [False, True])
def test_blocks_are_those_of_the_whole_problem(tensions: bool) -> None:
    case = make_case(30, tensions)
    residual, jacobian = cdprcal.linearise(case.problem, case.guess)
    parts, own, first = BlockLinearisation(case)(case.guess)
    np.testing.assert_array_equal(parts.ravel(), residual)
    rows = parts.shape[1]
    np.testing.assert_array_equal(first.reshape(-1, 6), jacobian[:, :6])
    for i in range(29):
        block = jacobian[rows * i : rows * (i + 1), 6 * (i + 1) : 6 * (i + 2)]
        np.testing.assert_array_equal(own[i], block)


@pytest.mark.parametrize("tensions", [False, True])
def test_the_model_in_casadi_has_our_residuals(tensions: bool) -> None:
    ca = pytest.importorskip("casadi", reason="CasADi is not installed (the peers extra has it)")
    from peers_casadi import CasadiCalibration

    case = make_case(27, tensions)
    theirs = CasadiCalibration(case)
    at_guess = ca.Function("residual", [theirs.x], [theirs.residual])(theirs.start())
    residual, _ = cdprcal.linearise(case.problem, case.guess)
    np.testing.assert_allclose(np.asarray(at_guess).ravel(), residual, rtol=0.0, atol=1e-9)


def test_another_minimum_is_noticed() -> None:
    case = make_case(8, tensions=False)
    good = ours(case)
    moved = cdprcal.plus(good.initial_pose, [2e-6, 0, 0, 0, 0, 0])
    assert peers.agree(good, good)
    assert not peers.agree(Outcome(good.cost, moved, 1), good)
    assert not peers.agree(Outcome(1.01 * good.cost, good.initial_pose, 1), good)
