"""The same calibration by scipy.optimize.least_squares, with our analytic Jacobian."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from peers_data import BlockLinearisation, Case, Outcome, Vector
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix

import cdprcal
from cdprcal import Pose


def left_jacobians(rotation_vectors: Vector) -> Vector:
    """[k, 3, 3]: J with exp(v + dv) = exp(J dv) exp(v) to first order, of each row v."""
    angle = np.linalg.norm(rotation_vectors, axis=1)
    safe = np.where(angle < 1e-6, 1.0, angle)
    a = np.where(angle < 1e-6, 0.5, (1.0 - np.cos(safe)) / safe**2)[:, None, None]
    b = np.where(angle < 1e-6, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)[:, None, None]
    skew = np.zeros((len(angle), 3, 3))
    x, y, z = rotation_vectors.T
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -z, y, -x
    skew[:, 1, 0], skew[:, 2, 0], skew[:, 2, 1] = z, -y, x
    result: Vector = np.eye(3) + a * skew + b * skew @ skew
    return result


class ScipyCalibration:
    """x: six numbers a pose (displacement, rotation vector) from the guess, as solve() has them."""

    def __init__(self, case: Case, sparse: bool) -> None:
        self.guess = case.guess
        self.sparse = sparse
        self.linearisation = BlockLinearisation(case)
        self.callback_s = 0.0
        self._at: Vector | None = None
        self._residual: Vector = np.empty(0)
        self._jacobian: Any = None
        k, rows = case.poses - 1, self.linearisation.rows
        columns = np.empty((k, rows, 12), dtype=np.int64)
        columns[..., :6] = np.arange(6)
        columns[..., 6:] = 6 * np.arange(1, k + 1)[:, None, None] + np.arange(6)
        self._columns = columns.ravel()
        self._starts = np.arange(0, columns.size + 1, 12)

    def poses(self, x: Vector) -> list[Pose]:
        twists = x.reshape(-1, 6)
        return [cdprcal.plus(g, t) for g, t in zip(self.guess, twists, strict=True)]

    def _evaluate(self, x: Vector) -> None:
        if self._at is not None and np.array_equal(self._at, x):
            return
        begin = time.perf_counter()
        residual, own, first = self.linearisation(self.poses(x))
        turns = left_jacobians(x.reshape(-1, 6)[:, 3:])
        own[..., 3:] = own[..., 3:] @ turns[1:]
        first[..., 3:] = first[..., 3:] @ turns[0]
        data = np.concatenate([first, own], axis=2).ravel()
        jacobian = csr_matrix((data, self._columns, self._starts), (residual.size, x.size))
        self._jacobian = jacobian if self.sparse else jacobian.toarray()
        self._residual = residual.ravel()
        self._at = x.copy()
        self.callback_s += time.perf_counter() - begin

    def residual(self, x: Vector) -> Vector:
        self._evaluate(x)
        return self._residual

    def jacobian(self, x: Vector) -> Any:
        self._evaluate(x)
        return self._jacobian

    def solve(self) -> Outcome:
        begin = time.perf_counter()
        self.callback_s, self._at = 0.0, None
        lsmr = {"tr_options": {"atol": 1e-13, "btol": 1e-13}} if self.sparse else {}
        found = least_squares(
            self.residual,
            np.zeros(6 * len(self.guess)),
            self.jacobian,
            method="trf",
            x_scale="jac",
            tr_solver="lsmr" if self.sparse else "exact",
            ftol=1e-12,
            xtol=1e-12,
            gtol=1e-12,
            max_nfev=100,
            **lsmr,
        )
        share = self.callback_s / (time.perf_counter() - begin)
        return Outcome(found.cost, self.poses(found.x)[0], int(found.nfev), share)
