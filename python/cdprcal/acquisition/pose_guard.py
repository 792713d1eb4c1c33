"""Whether the platform is where the plan wants it, watched while it moves.

The initial pose is estimated after every rest. From it, what lengths, swivels and attitude have
changed since says where the platform is now, with a standard deviation; one step of Gauss-Newton
a look is enough, for it moves little in between. Leaving the corridor ends in a stop with the
reason: load cells that lie a little, or friction, can lead the platform far from where its tensions
were meant to hold it, and every other sensor finds nothing wrong with that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import InputError, Pose, RobotSample
from cdprcal.acquisition.guide import Estimate

_LOOK_S = 0.02  # the start-up steps at 50 Hz or more
_STOP_S = 0.2  # in which a safe hold comes to a stop: half of it at the speed it had
_SIGMAS = 3.0
_WAY_PARTS = 8  # of a way from stop to stop: where one meets the next is looked at beforehand
_FIRST_STEPS = 20  # of Gauss-Newton, after a new estimate


@dataclass(frozen=True)
class Place:
    """Where the platform is believed to be."""

    position_m: NDArray[np.float64]
    sigma_m: NDArray[np.float64]  #: by axis


class PoseGuard:
    """The corridor is the box that the plan's poses and ways span, ``margin_m`` wider on all sides.

    floor_m: z that neither the platform's point nor any anchor or corner of it may go below [m];
    -inf: that of the robot file, if any; the higher of the two counts. What else the robot file
    says is in the way ends the motion, too.
    Where three standard deviations are wider than the margin they stand in its place. Raises
    InputError for a margin or floor that guards nothing, and for a floor that the plan goes below.
    """

    def __init__(
        self,
        robot: _core.Robot,
        plan: _core.Plan,
        margin_m: float,
        floor_m: float = -math.inf,
    ) -> None:
        pulleys_m = np.array([cable.pulley.position_m for cable in robot.cables])
        most_m = float(np.ptp(pulleys_m, axis=0).max())
        if not 0.0 <= margin_m <= most_m:
            raise InputError(
                f"corridor: {margin_m:g} m must be 0 to {most_m:.3g} m, what the pulleys span"
            )
        if math.isnan(floor_m) or floor_m == math.inf:
            raise InputError(f"floor: {floor_m:g} m must be a height")
        self._robot = robot
        self._motion = _core.motion_basis(robot)
        planned = _planned_poses(robot, plan)
        places_m = [pose.position_m for pose in planned]
        #: What the plan spans, without the margin [m].
        self.lower_m, self.upper_m = np.min(places_m, axis=0), np.max(places_m, axis=0)
        self._margin_m = margin_m
        self._floor_m = max(floor_m, robot.surroundings.floor_m)
        self._low_m = np.array(
            [cable.platform_anchor_m for cable in robot.cables]
            + [*robot.platform.outline_m, np.zeros(3)]
        )
        lowest_m = min(self._lowest_m(pose) for pose in planned)
        if lowest_m < floor_m:  # that of the robot file is compared where the plan is verified
            raise InputError(
                f"floor: {floor_m:g} m is above z = {lowest_m:.3f} m, which the platform's lowest "
                "point reaches by the plan; give a lower --floor-m, or plan higher poses"
            )
        self._first: RobotSample | None = None
        self._initial: Pose | None = None
        self._covariance = np.zeros((6, 6))
        self._now: Pose | None = None
        self._steps = _FIRST_STEPS
        self._seen_s = math.nan
        self._velocity_m_s = np.zeros(3)
        self.sigma_m = np.full(3, math.nan)  #: of the position now, by axis [m]

    @property
    def position_m(self) -> NDArray[np.float64] | None:
        """Where the platform is believed to be; None: not known yet."""
        return None if self._now is None else self._now.position_m

    @property
    def place(self) -> Place | None:
        """The same with its standard deviation."""
        return None if self._now is None else Place(self._now.position_m, self.sigma_m)

    def learn(self, estimate: Estimate) -> None:
        """Takes over a new estimate of the initial pose, if it is one that can be trusted."""
        if not estimate.trusted or estimate.pose is None or estimate.covariance is None:
            return
        self._initial = estimate.pose
        self._covariance = np.asarray(estimate.covariance)
        self._steps = _FIRST_STEPS  # what has been learned moves all that follows

    def look(self, sample: RobotSample) -> str:
        """Why the platform must stop where it is; empty: it need not, or nobody knows."""
        if self._first is None:
            self._first = sample
        if self._initial is None or sample.time_s - self._seen_s < _LOOK_S - 1e-9:
            return ""
        now = self._now or self._initial
        for _ in range(self._steps):
            stepped = self._step(now, sample)
            if stepped is None:
                return ""
            now = stepped
        if self._now is not None and self._steps == 1:
            went_m = now.position_m - self._now.position_m
            self._velocity_m_s = went_m / (sample.time_s - self._seen_s)
        self._now, self._seen_s, self._steps = now, sample.time_s, 1
        return self._outside(now)

    def _step(self, at: Pose, sample: RobotSample) -> Pose | None:
        """A step of Gauss-Newton from a pose; None where it cannot be told."""
        rows = self._rows(at, sample)
        if rows is None:
            return None
        residual, jacobian, initial_jacobian = rows
        along = jacobian @ self._motion
        try:
            inverse = self._motion @ np.linalg.inv(along.T @ along) @ self._motion.T
        except np.linalg.LinAlgError:
            return None
        passed_on = inverse @ jacobian.T @ initial_jacobian
        covariance = passed_on @ self._covariance @ passed_on.T + inverse
        self.sigma_m = np.sqrt(np.diag(covariance)[:3])
        return _core.plus(at, inverse @ jacobian.T @ residual)

    def _rows(
        self, at: Pose, sample: RobotSample
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]] | None:
        """Whitened (residual, its derivative by the pose, … by the initial pose); None: too few."""
        first, initial, sigma = self._first, self._initial, self._robot.sigma
        assert first is not None
        assert initial is not None
        now, then = (_core.platform_state(self._robot, pose) for pose in (at, initial))
        if not (now.valid and then.valid):
            return None
        parts = []
        for read, read_first, is_now, was, jacobian, deviation, turns in (
            (sample.length_m, first.length_m, now.length_m, then.length_m,
             _core.length_jacobian, sigma.length_m, False),
            (sample.swivel_rad, first.swivel_rad, now.swivel_rad, then.swivel_rad,
             _core.swivel_jacobian, sigma.swivel_rad, True),
        ):  # fmt: skip
            if len(read) != len(is_now) or len(read_first) != len(is_now):
                continue
            known = np.isfinite(read) & np.isfinite(read_first)
            change = (read - read_first) - (is_now - was)
            if turns:  # the model's angle, or the encoder's, may have passed ±π since
                change = np.arctan2(np.sin(change), np.cos(change))
            parts.append(
                (change[known] / deviation, jacobian(now)[known] / deviation,
                 jacobian(then)[known] / deviation)
            )  # fmt: skip
        angles, first_angles = sample.roll_pitch_yaw_rad, first.roll_pitch_yaw_rad
        if np.isfinite(angles).all() and np.isfinite(first_angles).all():
            order = self._robot.euler_convention
            is_now, was = (
                _core.euler_from_rotation(pose.rotation, order) for pose in (at, initial)
            )
            from_north = np.array([0.0, 0.0, first_angles[2] - was[2]])  # roll and pitch: absolute
            off_rad = angles - from_north - is_now
            off_rad = np.arctan2(np.sin(off_rad), np.cos(off_rad))
            rates = [np.linalg.inv(_core.euler_rate_matrix(a, order)) for a in (is_now, was)]
            turn, turn_then = (
                np.hstack([np.zeros((3, 3)), rate]) / sigma.attitude_rad for rate in rates
            )
            turn_then[:2] = 0.0
            parts.append((off_rad / sigma.attitude_rad, turn, turn_then))
        residual, jacobian_now, jacobian_then = (
            np.concatenate([part[i] for part in parts]) if parts else np.empty(0) for i in range(3)
        )
        if len(residual) < self._motion.shape[1]:
            return None
        return residual, jacobian_now, jacobian_then

    def _lowest_m(self, pose: Pose) -> float:
        """z of the platform's lowest point: its own, or that of an anchor or corner."""
        return float(pose.position_m[2] + (self._low_m @ pose.rotation.T)[:, 2].min())

    def _outside(self, now: Pose) -> str:
        """What is wrong with a pose, or with where a stop from there would end."""
        allowed_m = np.maximum(self._margin_m, _SIGMAS * self.sigma_m)
        ends_m = now.position_m + 0.5 * _STOP_S * self._velocity_m_s
        for place_m in (now.position_m, ends_m):
            excess_m = np.maximum(self.lower_m - place_m, place_m - self.upper_m) - allowed_m
            axis = int(np.argmax(excess_m))
            if excess_m[axis] > 0.0:
                return (
                    f"the platform leaves the plan's corridor: {'xyz'[axis]} = "
                    f"{now.position_m[axis]:.3f} ± {self.sigma_m[axis]:.3f} m, where "
                    f"{self.lower_m[axis] - allowed_m[axis]:.3f} to "
                    f"{self.upper_m[axis] + allowed_m[axis]:.3f} m is allowed"
                )
        lowest_m = self._lowest_m(now)
        for z_m in (lowest_m, lowest_m + ends_m[2] - now.position_m[2]):
            if z_m < self._floor_m:
                return (
                    f"the platform comes too close to the floor: its lowest point is at z = "
                    f"{lowest_m:.3f} ± {self.sigma_m[2]:.3f} m, and {self._floor_m:.3f} m is the "
                    "limit"
                )
        for place_m in (now.position_m, ends_m):
            if found := _core.obstruction(self._robot, Pose(place_m, now.rotation)):
                return f"something is in the platform's way: {found}"
        return ""


def _planned_poses(robot: _core.Robot, plan: _core.Plan) -> list[Pose]:
    """The plan's stops, and what the platform passes on the way from one to the next.

    Between two tensions the platform may hang a tenth of a metre below both.
    """
    stops = [(plan.start_pose, plan.start_tension_N)]
    stops += [(stop.pose, stop.tension_N) for stop in plan.poses]
    poses = [pose for pose, _ in stops]
    if _core.holds_orientation(robot):  # lengths lead it, straight from pose to pose
        return poses
    for (pose, from_N), (_, to_N) in pairwise(stops):
        at = pose
        for tension_N in np.linspace(from_N, to_N, _WAY_PARTS, endpoint=False)[1:]:
            found = _core.direct_from_tensions(robot, tension_N, at)
            if found.pose is None or found.status != _core.EquilibriumStatus.found:
                break
            at = found.pose
            poses.append(at)
    return poses


__all__ = ["PoseGuard"]
