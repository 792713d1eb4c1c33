"""The inverse problem beside scipy.optimize.fsolve: the same points, both warm-started.

pytest tests/python/test_equilibria_speed.py --benchmark-columns=min,median,rounds
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

import cdprcal

POINTS = 200
LINE = np.linspace([-0.4, -0.4, 0.6], [0.4, 0.4, 1.2], POINTS)
MINIMUM_NORM = cdprcal.TensionDistribution.minimum_norm


class NumpyRobot:
    """Eqs 1 to 7 and A1 in numpy, all cables at once; shares no code with the library."""

    def __init__(self, robot: cdprcal.Robot) -> None:
        pulleys = [cable.pulley for cable in robot.cables]
        self.d = np.array([pulley.position_m for pulley in pulleys])
        self.i = np.array([pulley.x_axis for pulley in pulleys])
        self.k = np.array([pulley.swivel_axis for pulley in pulleys])
        self.j = np.cross(self.k, self.i)
        self.r = np.array([pulley.radius_m for pulley in pulleys])
        self.anchors = np.array([cable.platform_anchor_m for cable in robot.cables])
        self.centre = robot.platform.centre_of_mass_m
        self.weight = np.array([0.0, 0.0, -robot.platform.mass_kg * robot.gravity_m_s2])

    def statics(self, position: np.ndarray, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Minimum-norm tensions that carry the weight, and the moment that they leave."""
        arms = self.anchors @ rotation.T
        q = position + arms - self.d
        swivel = np.arctan2((self.j * q).sum(1), (self.i * q).sum(1))[:, None]
        u = np.cos(swivel) * self.i + np.sin(swivel) * self.j
        across, along = (u * q).sum(1) - self.r, (self.k * q).sum(1)
        square = across**2 + along**2
        free = np.sqrt(square - self.r**2)
        cosine = (self.r * across - free * along) / square
        sine = (self.r * along + free * across) / square
        t = sine[:, None] * u - cosine[:, None] * self.k
        tension = t @ np.linalg.solve(t.T @ t, self.weight)
        moment = (np.cross(arms, t) * tension[:, None]).sum(0) - np.cross(
            rotation @ self.centre, self.weight
        )
        return tension, moment


def exp_so3(v: np.ndarray) -> np.ndarray:
    angle = float(np.sqrt(v @ v))
    cross: np.ndarray = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    rotation: np.ndarray = np.eye(3) + cross
    if angle < 1e-9:
        return rotation
    rotation = (
        np.eye(3)
        + np.sin(angle) / angle * cross
        + (1.0 - np.cos(angle)) / angle**2 * (cross @ cross)
    )
    return rotation


def by_fsolve(robot: NumpyRobot) -> np.ndarray:
    from scipy.optimize import fsolve

    rotation, tensions = np.eye(3), []
    for position in LINE:
        start = rotation

        def moment(
            v: np.ndarray, position: np.ndarray = position, start: np.ndarray = start
        ) -> np.ndarray:
            return robot.statics(position, exp_so3(v) @ start)[1]

        solution, _, status, message = fsolve(moment, np.zeros(3), xtol=1e-10, full_output=True)
        assert status == 1, message
        rotation = exp_so3(solution) @ start
        tensions.append(robot.statics(position, rotation)[0])
    return np.array(tensions)


def by_cdprcal(robot: cdprcal.Robot) -> np.ndarray:
    status, _, tension = cdprcal.inverse_along(robot, LINE, distribution=MINIMUM_NORM)
    assert cdprcal.EquilibriumStatus.not_found not in status
    return tension


@pytest.mark.benchmark(group=f"inverse problem, {POINTS} points")
def test_cdprcal(benchmark: Any, robot: cdprcal.Robot) -> None:
    assert benchmark.pedantic(by_cdprcal, (robot,), rounds=20).shape == (POINTS, 4)


@pytest.mark.benchmark(group=f"inverse problem, {POINTS} points")
def test_fsolve(benchmark: Any, robot: cdprcal.Robot) -> None:
    pytest.importorskip("scipy", reason="SciPy is not installed (the test extra has it)")
    theirs = benchmark.pedantic(by_fsolve, (NumpyRobot(robot),), rounds=3)
    elapsed_s = []
    for _ in range(10):  # the least: the machine may be busy
        started = time.perf_counter()
        ours = by_cdprcal(robot)
        elapsed_s.append(time.perf_counter() - started)
    assert ours == pytest.approx(theirs, rel=1e-6)
    if benchmark.stats is not None:  # with --benchmark-disable nothing was timed
        assert benchmark.stats["min"] > 20.0 * min(elapsed_s)
