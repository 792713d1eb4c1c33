"""Whether the platform is where the plan wants it, watched while it moves.

The initial pose is estimated after every rest. From it, what lengths, swivels and attitude have
changed since says where the platform is now, with a standard deviation; one step of Gauss-Newton
a look is enough, for it moves little in between. Leaving the corridor ends in a stop with the
reason: load cells that lie a little, or friction, can lead the platform far from where its tensions
were meant to hold it, and every other sensor finds nothing wrong with that.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import InputError, Pose, RobotSample
from cdprcal.acquisition.guide import Estimate

_LOOK_S = 0.02  # the start-up steps at 50 Hz or more
_STOP_S = 0.2  # in which a safe hold comes to a stop: half of it at the speed it had
_SPEED_S = 0.1  # over which a speed is told: its noise then moves the end of a stop like its place
_SIGMAS = 3.0
_WAY_PARTS = 8  # of a way from stop to stop: where one meets the next is looked at beforehand
_FIRST_STEPS = 20  # of Gauss-Newton, after a new estimate
_LEAST_MARGIN_M = 0.1
#: Of a way: how far a healthy platform swings past its end, or lags beside it. Both grow with the
#: distance. Simulated robots of 0.3 to 40 m, at the plan's speed and with --quick: up to 0.04.
_PAST_THE_END = 0.05


@dataclass(frozen=True)
class Place:
    """Where the platform is believed to be."""

    position_m: NDArray[np.float64]
    sigma_m: NDArray[np.float64]  #: by axis


class PoseGuard:
    """The corridor is the box that the plan's poses and ways span, ``margin_m`` wider on all sides.

    margin_m: None: 0.1 m, or 5 % of the plan's longest way from stop to stop where that is more.
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
        margin_m: float | None = None,
        floor_m: float = -math.inf,
    ) -> None:
        pulleys_m = np.array([cable.pulley.position_m for cable in robot.cables])
        most_m = float(np.ptp(pulleys_m, axis=0).max())
        if margin_m is None:
            margin_m = min(most_m, max(_LEAST_MARGIN_M, _PAST_THE_END * _longest_way_m(plan)))
        if not 0.0 <= margin_m <= most_m:
            raise InputError(
                f"corridor: {margin_m:g} m must be 0 to {most_m:.3g} m, what the pulleys span; "
                "give a --corridor-m within that"
            )
        if math.isnan(floor_m) or floor_m == math.inf:
            raise InputError(
                f"floor: {floor_m:g} m must be a height; give --floor-m as z in metres"
            )
        self._robot = robot
        self._motion = _core.motion_basis(robot)
        planned = _planned_poses(robot, plan)
        places_m = [pose.position_m for pose in planned]
        #: What the plan spans, without the margin [m].
        self.lower_m, self.upper_m = np.min(places_m, axis=0), np.max(places_m, axis=0)
        self.margin_m = margin_m
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
        self._seen: deque[tuple[float, NDArray[np.float64]]] = deque()
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

    def admit(self, at: Pose, tension_N: NDArray[np.float64], way: _core.StartUpPlan) -> None:
        """Widens the corridor by a way that the plan's order does not take, before it is gone.

        From a pose and its tensions [N] through the set-points of ``way``.
        """
        poses = list(way.pose)
        if not _core.holds_orientation(self._robot):
            for from_N, to_N in pairwise([tension_N, *way.setpoint_N]):
                part = _held(self._robot, at, np.linspace(from_N, to_N, _WAY_PARTS + 1)[1:])
                poses += part
                if len(part) < _WAY_PARTS:
                    break
                at = part[-1]
        places_m = [pose.position_m for pose in poses]
        self.lower_m = np.min([self.lower_m, *places_m], axis=0)
        self.upper_m = np.max([self.upper_m, *places_m], axis=0)

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
        if self._steps > 1:
            self._seen.clear()
        self._follow(sample.time_s, now.position_m)
        self._now, self._seen_s, self._steps = now, sample.time_s, 1
        return self._outside(now)

    def _follow(self, time_s: float, position_m: NDArray[np.float64]) -> None:
        """How fast it goes; as before where nothing tells yet."""
        until_s = time_s - _SPEED_S + 1e-9
        while len(self._seen) > 1 and self._seen[1][0] <= until_s:
            self._seen.popleft()
        if self._seen and self._seen[0][0] <= until_s:
            began_s, began_m = self._seen[0]
            self._velocity_m_s = (position_m - began_m) / (time_s - began_s)
        self._seen.append((time_s, position_m))

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
        allowed_m = np.maximum(self.margin_m, _SIGMAS * self.sigma_m)
        further_m = 0.5 * _STOP_S * self._velocity_m_s
        lowest_m = self._lowest_m(now)
        for on_m in (np.zeros(3), further_m):
            place_m = now.position_m + on_m
            excess_m = np.maximum(self.lower_m - place_m, place_m - self.upper_m) - allowed_m
            axis = int(np.argmax(excess_m))
            if excess_m[axis] > 0.0:
                return (
                    f"the platform leaves the plan's corridor: {'xyz'[axis]} = "
                    f"{now.position_m[axis]:.3f} ± {self.sigma_m[axis]:.3f} m"
                    f"{_ending(place_m[axis], on_m)}, where "
                    f"{self.lower_m[axis] - allowed_m[axis]:.3f} to "
                    f"{self.upper_m[axis] + allowed_m[axis]:.3f} m is allowed"
                )
            if lowest_m + on_m[2] < self._floor_m:
                return (
                    f"the platform comes too close to the floor: its lowest point is at z = "
                    f"{lowest_m:.3f} ± {self.sigma_m[2]:.3f} m"
                    f"{_ending(lowest_m + on_m[2], on_m)}, and {self._floor_m:.3f} m is the limit"
                )
            if found := _core.obstruction(self._robot, Pose(place_m, now.rotation)):
                where = ", at the end of a stop from here" if on_m.any() else ""
                return f"something is in the platform's way{where}: {found}"
        return ""


def _ending(at_m: float, on_m: NDArray[np.float64]) -> str:
    """Where a stop would end, if it is that which is wrong."""
    return f", at the end of a stop from here {at_m:.3f} m" if on_m.any() else ""


def _longest_way_m(plan: _core.Plan) -> float:
    places_m = np.array([plan.start_pose.position_m, *(s.pose.position_m for s in plan.poses)])
    return float(np.linalg.norm(np.diff(places_m, axis=0), axis=1).max(initial=0.0))


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
        between_N = np.linspace(from_N, to_N, _WAY_PARTS, endpoint=False)[1:]
        poses += _held(robot, pose, between_N)
    return poses


def _held(robot: _core.Robot, at: Pose, tensions_N: Iterable[NDArray[np.float64]]) -> list[Pose]:
    """Where tensions hold the platform one after the other, until they do not."""
    poses: list[Pose] = []
    for tension_N in tensions_N:
        found = _core.direct_from_tensions(robot, tension_N, at)
        if found.pose is None or found.status != _core.EquilibriumStatus.found:
            break
        at = found.pose
        poses.append(at)
    return poses


__all__ = ["PoseGuard"]
