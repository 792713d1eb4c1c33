"""A short version of tests/studies/peers.py: everybody comes to the same minimum."""

from __future__ import annotations

import numpy as np
import peers
import pytest
from peers_data import BlockLinearisation, Outcome, make_case, ours

import cdprcal

pytest.importorskip("scipy", reason="SciPy is not installed (the test extra has it)")


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
