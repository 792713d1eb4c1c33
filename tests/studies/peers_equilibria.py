"""Equilibria by scipy.optimize.fsolve, for the same points from the same starts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import cdprcal

Array = NDArray[np.float64]
MINIMUM_NORM = cdprcal.TensionDistribution.minimum_norm


def line(points: int) -> Array:
    """Positions [points, 3] [m] across irma4's workspace, each close to the one before."""
    return np.linspace([-0.4, -0.4, 0.6], [0.4, 0.4, 1.2], points)


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

    def directions(self, position: Array, rotation: Array) -> tuple[Array, Array]:
        """(t, a') [n, 3] of all cables."""
        arms = self.anchors @ rotation.T
        q = position + arms - self.d
        swivel = np.arctan2((self.j * q).sum(1), (self.i * q).sum(1))[:, None]
        u = np.cos(swivel) * self.i + np.sin(swivel) * self.j
        across, along = (u * q).sum(1) - self.r, (self.k * q).sum(1)
        square = across**2 + along**2
        free = np.sqrt(square - self.r**2)
        cosine = (self.r * across - free * along) / square
        sine = (self.r * along + free * across) / square
        t: Array = sine[:, None] * u - cosine[:, None] * self.k
        return t, arms

    def statics(self, position: Array, rotation: Array) -> tuple[Array, Array]:
        """Minimum-norm tensions that carry the weight, and the moment that they leave."""
        t, arms = self.directions(position, rotation)
        tension: Array = t @ np.linalg.solve(t.T @ t, self.weight)
        return tension, self.moment(t, arms, rotation, tension)

    def wrench(self, position: Array, rotation: Array, tension: Array) -> Array:
        """Eq. 6 [6]: zero where these tensions hold the platform."""
        t, arms = self.directions(position, rotation)
        force = t.T @ tension - self.weight
        both: Array = np.concatenate([force, self.moment(t, arms, rotation, tension)])
        return both

    def moment(self, t: Array, arms: Array, rotation: Array, tension: Array) -> Array:
        moment: Array = (np.cross(arms, t) * tension[:, None]).sum(0) - np.cross(
            rotation @ self.centre, self.weight
        )
        return moment


def exp_so3(v: Array) -> Array:
    angle = float(np.sqrt(v @ v))
    cross: Array = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    rotation: Array = np.eye(3) + cross
    if angle < 1e-9:
        return rotation
    rotation = (
        np.eye(3)
        + np.sin(angle) / angle * cross
        + (1.0 - np.cos(angle)) / angle**2 * (cross @ cross)
    )
    return rotation


def inverse_by_fsolve(robot: NumpyRobot, positions: Array) -> Array:
    """Tensions [points, n] of minimum norm; each point starts from the one before."""
    from scipy.optimize import fsolve

    rotation, tensions = np.eye(3), []
    for position in positions:
        start = rotation

        def moment(v: Array, position: Array = position, start: Array = start) -> Array:
            return robot.statics(position, exp_so3(v) @ start)[1]

        solution, _, status, message = fsolve(moment, np.zeros(3), xtol=1e-10, full_output=True)
        if status != 1:
            raise RuntimeError(message)
        rotation = exp_so3(solution) @ start
        tensions.append(robot.statics(position, rotation)[0])
    return np.array(tensions)


def inverse_by_cdprcal(robot: cdprcal.Robot, positions: Array) -> Array:
    status, _, tension = cdprcal.inverse_along(robot, positions, distribution=MINIMUM_NORM)
    if cdprcal.EquilibriumStatus.not_found in status:
        raise RuntimeError("a point was not found")
    return tension


def direct_starts(robot: cdprcal.Robot, setpoints_N: Any) -> list[tuple[Array, cdprcal.Pose]]:
    """(tensions, a start 0.02 m and 0.02 rad off along every axis)."""
    starts = []
    for tension_N in np.asarray(setpoints_N):
        rest = cdprcal.direct_from_tensions(robot, tension_N)
        if rest.pose is None:
            raise RuntimeError(rest.reason)
        starts.append((tension_N, cdprcal.plus(rest.pose, np.full(6, 0.02))))
    return starts


def direct_by_fsolve(
    robot: NumpyRobot, starts: list[tuple[Array, cdprcal.Pose]]
) -> list[cdprcal.Pose]:
    """Poses in balance; the Jacobian by fsolve's own differences."""
    from scipy.optimize import fsolve

    poses = []
    for tension_N, start in starts:
        position, rotation = start.position_m, start.rotation

        def wrench(
            x: Array,
            position: Array = position,
            rotation: Array = rotation,
            tension_N: Array = tension_N,
        ) -> Array:
            return robot.wrench(position + x[:3], exp_so3(x[3:]) @ rotation, tension_N)

        solution, _, status, message = fsolve(wrench, np.zeros(6), xtol=1e-10, full_output=True)
        if status != 1:
            raise RuntimeError(message)
        poses.append(cdprcal.plus(start, solution))
    return poses


def direct_by_cdprcal(
    robot: cdprcal.Robot, starts: list[tuple[Array, cdprcal.Pose]]
) -> list[cdprcal.Pose]:
    found = [cdprcal.direct_from_tensions(robot, tension_N, start) for tension_N, start in starts]
    poses = [
        f.pose for f in found if f.status == cdprcal.EquilibriumStatus.found and f.pose is not None
    ]
    if len(poses) < len(starts):
        raise RuntimeError("an equilibrium was not found")
    return poses
