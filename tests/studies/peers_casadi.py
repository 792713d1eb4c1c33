"""The same calibration in CasADi: the model written anew as expressions, derivatives by CasADi."""

from __future__ import annotations

from typing import Any, ClassVar

import casadi as ca
import numpy as np
from peers_data import Case, Outcome, Vector

import cdprcal


def exponential(v: Any) -> Any:
    """exp(v) by Rodrigues, with derivatives that hold at v = 0."""
    angle = ca.sqrt(ca.dot(v, v) + 1e-30)
    half = ca.sin(angle / 2) / (angle / 2)
    skew = ca.skew(v)
    return ca.SX.eye(3) + ca.sin(angle) / angle * skew + 0.5 * half**2 * (skew @ skew)


def cable(pulley: Any, q: Any) -> tuple[Any, Any, Any]:
    """(length, swivel angle, direction) of eqs 1 to 5."""
    i, k = ca.DM(pulley.x_axis), ca.DM(pulley.swivel_axis)
    j, r = ca.cross(k, i), pulley.radius_m
    swivel = ca.atan2(ca.dot(j, q), ca.dot(i, q))
    u = ca.cos(swivel) * i + ca.sin(swivel) * j
    across, along = ca.dot(u, q) - r, ca.dot(k, q)
    square = across**2 + along**2
    free = ca.sqrt(square - r**2)
    cosine = (r * across - free * along) / square
    sine = (r * along + free * across) / square
    # The tangency angle psi lies in (-pi, pi]: the cable never wraps by more than half a turn here.
    length = free + r * (np.pi - ca.atan2(sine, cosine))
    return length, swivel, sine * u - cosine * k


class CasadiCalibration:
    """x: poses 1 … k, then pose 0; six numbers each: displacement and rotation vector.

    They count from the guess. One pose is an SX function, mapped over all. The readings and the
    guess are constants.
    """

    def __init__(self, case: Case) -> None:
        self.case = case
        robot = case.problem.robot
        if str(robot.euler_convention.name) != "XYZ":
            raise ValueError("written for R = Rx Ry Rz")
        self.n = robot.cable_count
        k = case.poses - 1
        self.x = ca.MX.sym("x", 6 * (k + 1))
        own = ca.reshape(self.x[: 6 * k], 6, k)
        guess = np.array([np.r_[g.position_m, g.rotation.ravel(order="F")] for g in case.guess])
        model = self._model(robot, case.tensions)
        first = model(self.x[6 * k :], guess[0])
        modelled = model.map(k)(own, guess[1:].T)
        relative = 2 * self.n + 1  # lengths, swivels, yaw count from the reference
        # As a constant times a vector: its derivative is then as sparse as it is.
        difference = modelled - ca.vertcat(
            ca.repmat(first[:relative], 1, k), ca.MX(modelled.shape[0] - relative, k)
        )
        measured, weights = self._readings()
        self.residual = ca.vec((difference - measured) * weights)

    def _model(self, robot: Any, tensions: bool) -> Any:
        """(lengths, swivels, yaw, roll, pitch and, if wanted, tensions) of one pose."""
        x, guess = ca.SX.sym("x", 6), ca.SX.sym("guess", 12)
        position = guess[:3] + x[:3]
        rotation = exponential(x[3:]) @ ca.reshape(guess[3:], 3, 3)
        lengths, swivels, columns = [], [], []
        for one in robot.cables:
            arm = rotation @ ca.DM(one.platform_anchor_m)
            length, swivel, t = cable(one.pulley, position + arm - ca.DM(one.pulley.position_m))
            lengths.append(length)
            swivels.append(swivel)
            # Rows x, y, z and yaw of the wrench in Euler-rate coordinates (eq. 12).
            columns.append(ca.vertcat(t, ca.dot(rotation[:, 2], ca.cross(arm, t))))
        roll = ca.atan2(-rotation[1, 2], rotation[2, 2])
        pitch = ca.asin(rotation[0, 2])
        yaw = ca.atan2(-rotation[0, 1], rotation[0, 0])
        rows = [*lengths, *swivels, yaw, roll, pitch]
        if tensions:
            weight = ca.DM([0.0, 0.0, -robot.platform.mass_kg * robot.gravity_m_s2])
            arm = rotation @ ca.DM(robot.platform.centre_of_mass_m)
            load = ca.vertcat(weight, ca.dot(rotation[:, 2], ca.cross(arm, weight)))
            rows.append(ca.solve(ca.horzcat(*columns), load))
        return ca.Function("model", [x, guess], [ca.vertcat(*rows)])

    def _readings(self) -> tuple[Vector, Vector]:
        """What every row reads, relative to the reference where it is; and 1/sigma."""
        measurements = self.case.problem.measurements
        sigma = self.case.problem.robot.sigma
        zero = measurements[0]
        columns: list[Vector] = []
        for m in measurements[1:]:
            yaw = m.roll_pitch_yaw_rad[2] - zero.roll_pitch_yaw_rad[2]
            parts: list[Any] = [
                m.length_m - zero.length_m,
                m.swivel_rad - zero.swivel_rad,
                [np.remainder(yaw + np.pi, 2.0 * np.pi) - np.pi],
                m.roll_pitch_yaw_rad[:2],
            ]
            columns.append(np.concatenate(parts + ([m.tension_N] if self.case.tensions else [])))
        spread = np.r_[
            np.full(self.n, sigma.length_m),
            np.full(self.n, sigma.swivel_rad),
            np.full(3, sigma.attitude_rad),
            np.full(self.n if self.case.tensions else 0, sigma.tension_N),
        ]
        measured = np.array(columns).T
        return measured, np.repeat(1.0 / spread[:, None], measured.shape[1], axis=1)

    def start(self) -> Vector:
        return np.zeros(6 * self.case.poses)

    def outcome(self, x: Vector, cost: float, iterations: int) -> Outcome:
        pose = cdprcal.plus(self.case.guess[0], np.asarray(x).ravel()[-6:])
        return Outcome(cost, pose, iterations)


class Ipopt:
    """IPOPT on half the sum of squares, exact Hessian."""

    def __init__(self, case: Case) -> None:
        self.calibration = CasadiCalibration(case)
        cost = 0.5 * ca.sumsqr(self.calibration.residual)
        quiet = {"print_level": 0, "sb": "yes", "tol": 1e-8, "max_iter": 200}
        self.solver = ca.nlpsol(
            "solver",
            "ipopt",
            {"x": self.calibration.x, "f": cost},
            {"ipopt": quiet, "print_time": False},
        )

    def solve(self) -> Outcome:
        found = self.solver(x0=self.calibration.start())
        stats = self.solver.stats()
        if not stats["success"]:
            raise RuntimeError(stats["return_status"])
        return self.calibration.outcome(found["x"], float(found["f"]), stats["iter_count"])


class GaussNewton:
    """Gauss-Newton with CasADi's own sparse Jacobian and LDL' of the normal equations."""

    #: Of the function that makes a step: none, CasADi's virtual machine runs it.
    options: ClassVar[dict[str, Any]] = {}

    def __init__(self, case: Case) -> None:
        self.calibration = CasadiCalibration(case)
        x, r = self.calibration.x, self.calibration.residual
        jacobian = ca.jacobian(r, x)
        step = -ca.solve(jacobian.T @ jacobian, jacobian.T @ r, "ldl")
        self.step = ca.Function("step", [x], [step, 0.5 * ca.sumsqr(r)], self.options)

    def solve(self) -> Outcome:
        x = ca.DM(self.calibration.start())
        before = np.inf
        for iteration in range(1, 101):
            step, cost = self.step(x)
            x += step
            if abs(before - float(cost)) <= 1e-12 * float(cost) or float(ca.norm_inf(step)) < 1e-12:
                return self.calibration.outcome(x, float(cost), iteration)
            before = float(cost)
        raise RuntimeError("Gauss-Newton did not settle")


class CompiledGaussNewton(GaussNewton):
    """The same, its step written out in C and compiled for this processor: CasADi at its fastest.

    Writing and compiling are not timed; they take seconds for 8 poses, minutes for hundreds.
    """

    options: ClassVar[dict[str, Any]] = {
        "jit": True,
        "compiler": "shell",
        "jit_options": {"compiler": "gcc", "flags": ["-O3", "-march=native"]},
    }
