"""Properties over random robots of 1 to 8 cables: derivatives, frames, singular and absurd poses.

A sample runs in the suite. All 1,000 robots, some minutes:
CDPRCAL_PROPERTY_ROBOTS=1000 pytest tests/python/test_properties.py
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import cdprcal
from cdprcal import InputError, Pose, PoseKind, Robot, StaticsModel
from random_robots import (
    COUNT,
    moved_base,
    moved_platform,
    random_pose,
    random_robot,
    random_rotation,
    random_tensions,
)

Floats = NDArray[np.float64]


def samples(seed: int, every: int = 1) -> Iterator[tuple[np.random.Generator, Robot, Pose]]:
    """A random generator, a robot and a comfortable pose of it; cables 1 to 8 in turn."""
    for number in range(0, COUNT, every):
        random = np.random.default_rng([seed, number])
        robot = random_robot(random, 1 + number // every % 8)
        yield random, robot, random_pose(random, robot)


def numeric(function: Callable[[Floats], Floats], width: int, step: float = 2e-3) -> Floats:
    """Derivative at zero [m, width], central differences extrapolated three times; NaN where they
    do not agree among themselves, as where an angle jumps."""
    columns = []
    for unit in np.eye(width):
        table = []
        for level in range(4):
            h = step / 2**level
            table.append((function(h * unit) - function(-h * unit)) / (2.0 * h))
        coarse = table
        for order in range(1, 4):
            factor = 4.0**order
            coarse = table
            table = [(factor * b - a) / (factor - 1.0) for a, b in itertools.pairwise(table)]
        vague = np.abs(table[0] - coarse[-1]) > 1e-5 * np.maximum(np.abs(table[0]), 1.0)
        columns.append(np.where(vague, np.nan, table[0]))
    return np.stack(columns, axis=-1)


def assert_derivative(analytic: Floats, found: Floats, tolerance: float = 1e-7) -> None:
    assert analytic.shape == found.shape
    known = np.isfinite(found).all(axis=-1)
    assert known.mean() > 0.9, "the numeric derivative is too vague"
    scale = np.maximum(np.abs(found[known]).max(axis=-1, keepdims=True), 1.0)
    np.testing.assert_allclose(
        analytic[known] / scale, found[known] / scale, rtol=0, atol=tolerance
    )


def wrapped(angle: Floats) -> Floats:
    turned: Floats = np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi
    return turned


def test_derivatives_of_kinematics_and_statics() -> None:
    for random, robot, pose in samples(1):
        check_derivatives(robot, pose, random_tensions(random, robot))


def check_derivatives(robot: Robot, pose: Pose, tension: Floats) -> None:
    def at(twist: Floats) -> cdprcal.PlatformState:
        return cdprcal.platform_state(robot, cdprcal.plus(pose, twist))

    def energy(twist: Floats) -> Floats:
        moved = cdprcal.plus(pose, twist)
        return np.array([cdprcal.potential_energy(robot, moved, at(twist), tension)])

    state = cdprcal.platform_state(robot, pose)
    lengths = cdprcal.length_jacobian(state)
    assert_derivative(lengths, numeric(lambda d: at(d).length_m, 6))
    np.testing.assert_array_equal(cdprcal.structure_matrix(state), lengths.T)
    swivels = numeric(lambda d: wrapped(at(d).swivel_rad - state.swivel_rad), 6)
    assert_derivative(cdprcal.swivel_jacobian(state), swivels)
    wrench = cdprcal.wrench_residual(robot, state, tension)
    assert_derivative(wrench[None], numeric(energy, 6), 1e-8)
    change = numeric(lambda d: cdprcal.wrench_residual(robot, at(d), tension), 6)
    assert_derivative(cdprcal.stiffness(robot, state, tension), change)
    both = cdprcal.tension_stiffness(state, tension) + cdprcal.gravity_stiffness(robot, state)
    assert_derivative(both, change)
    if robot.cable_count <= 6:
        model = cdprcal.tensions_least_squares(robot, state)
        if model.valid and np.abs(model.by_twist).max() < 1e6:
            by_twist = numeric(
                lambda d: cdprcal.tensions_least_squares(robot, at(d)).tension_N, 6, 2e-4
            )
            assert_derivative(model.by_twist, by_twist, 1e-5)


def measured(
    random: np.random.Generator, robot: Robot, poses: list[Pose]
) -> list[cdprcal.Measurement]:
    """Readings of every sensor there is, with offsets and noise; the last pose moves."""
    normal = cdprcal.RandomNormal(int(random.integers(1 << 30)))
    offsets = cdprcal.random_offsets(robot.cable_count, normal)
    noise = cdprcal.reading_noise(robot.sigma, 0.1)
    made = []
    for number, pose in enumerate(poses):
        kind = (PoseKind.static_pose, PoseKind.kinematic_pose)[number == len(poses) - 1]
        made.append(
            cdprcal.synthetic_measurement(
                robot, pose, random_tensions(random, robot), kind, offsets, noise, normal
            )
        )
    return made


def near(random: np.random.Generator, pose: Pose) -> Pose:
    """A pose a few centimetres and degrees off."""
    return cdprcal.plus(pose, random.normal(size=6) * 0.03)


def test_derivatives_of_calibration_residuals() -> None:
    for random, robot, pose in samples(2):
        poses = [pose, near(random, pose), near(random, pose)]
        # Not the balance: it is whitened anew at every pose, in axes of its own. Unwhitened it is
        # what test_derivatives_of_kinematics_and_statics looks at.
        statics = [StaticsModel.none]
        if robot.cable_count <= 5:
            statics.append(StaticsModel.left_inverse)
        readings = measured(random, robot, poses)
        for model in statics:
            problem = cdprcal.CalibrationProblem(robot=robot, measurements=readings, statics=model)
            check_residuals(
                problem,
                [near(random, p) for p in poses],
                random.normal(size=2 * robot.cable_count + 1) * 1e-3,
            )


def check_residuals(problem: cdprcal.CalibrationProblem, guess: list[Pose], errors: Floats) -> None:
    def residuals(delta: Floats) -> Floats:
        moved = [cdprcal.plus(p, delta[6 * i : 6 * i + 6]) for i, p in enumerate(guess)]
        return cdprcal.linearise(problem, moved, errors + delta[6 * len(guess) :])[0]

    residual, jacobian = cdprcal.linearise(problem, guess, errors)
    if not np.isfinite(residual).all():  # too close to a pulley: said by NaN, all of it
        return
    if problem.statics == StaticsModel.left_inverse and np.abs(jacobian).max() > 1e5:
        return  # next to a singular left inverse: no step is small enough
    assert_derivative(jacobian, numeric(residuals, jacobian.shape[1], 2e-4), 1e-5)


def test_the_world_frame_is_free() -> None:
    for random, robot, pose in samples(3):
        turn, shift = random_rotation(random), random.uniform(-2.0, 2.0, size=3)
        tension = random_tensions(random, robot)
        here = cdprcal.platform_state(robot, pose)
        moved_robot = moved_base(robot, turn, shift)
        moved_pose = Pose(turn @ pose.position_m + shift, turn @ pose.rotation)
        there = cdprcal.platform_state(moved_robot, moved_pose)
        np.testing.assert_allclose(there.length_m, here.length_m, rtol=0, atol=1e-12)
        difference = wrapped(there.swivel_rad - here.swivel_rad)
        np.testing.assert_allclose(difference, 0.0, atol=1e-11)
        both = np.kron(np.eye(2), turn)
        np.testing.assert_allclose(
            cdprcal.structure_matrix(there), both @ cdprcal.structure_matrix(here), atol=1e-11
        )
        np.testing.assert_allclose(
            cdprcal.tension_stiffness(there, tension),
            both @ cdprcal.tension_stiffness(here, tension) @ both.T,
            rtol=1e-9,
            atol=1e-8 * tension.max(),
        )
        # Gravity is down in any frame: the weight turns back, as seen by the platform.
        weight = robot.platform.mass_kg * robot.gravity_m_s2 * np.array([0.0, 0.0, -1.0])
        arm = moved_pose.rotation @ robot.platform.centre_of_mass_m
        carried = np.r_[weight, np.cross(arm, weight)]
        found = cdprcal.gravity_wrench(moved_robot, there)
        np.testing.assert_allclose(np.abs(found), np.abs(carried), rtol=1e-11, atol=1e-10)
        balance = cdprcal.structure_matrix(there) @ tension - found
        np.testing.assert_allclose(
            cdprcal.wrench_residual(moved_robot, there, tension), balance, atol=1e-9
        )
        # About the vertical everything turns, gravity too.
        yaw = random.uniform(-np.pi, np.pi)
        c, s = np.cos(yaw), np.sin(yaw)
        upright = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        turned = moved_base(robot, upright, shift)
        state = cdprcal.platform_state(
            turned, Pose(upright @ pose.position_m + shift, upright @ pose.rotation)
        )
        both = np.kron(np.eye(2), upright)
        np.testing.assert_allclose(
            cdprcal.wrench_residual(turned, state, tension),
            both @ cdprcal.wrench_residual(robot, here, tension),
            rtol=1e-9,
            atol=1e-9 * tension.max(),
        )


def test_the_platform_frame_is_free() -> None:
    for random, robot, pose in samples(4):
        turn, shift = random_rotation(random), random.uniform(-0.3, 0.3, size=3)
        tension = random_tensions(random, robot)
        here = cdprcal.platform_state(robot, pose)
        other = moved_platform(robot, turn, shift)
        rotation = pose.rotation @ turn.T
        other_pose = Pose(pose.position_m - rotation @ shift, rotation)
        there = cdprcal.platform_state(other, other_pose)
        np.testing.assert_allclose(there.length_m, here.length_m, rtol=0, atol=1e-11)
        np.testing.assert_allclose(wrapped(there.swivel_rad - here.swivel_rad), 0.0, atol=1e-10)
        a = cdprcal.wrench_residual(robot, here, tension)
        b = cdprcal.wrench_residual(other, there, tension)
        np.testing.assert_allclose(b[:3], a[:3], atol=1e-9 * tension.max())
        arm = pose.position_m - other_pose.position_m  # from the new origin to the old
        np.testing.assert_allclose(b[3:], a[3:] + np.cross(arm, a[:3]), atol=1e-9 * tension.max())
        energies = [
            cdprcal.potential_energy(r, p, s, tension)
            for r, p, s in ((robot, pose, here), (other, other_pose, there))
        ]
        assert energies[0] == pytest.approx(energies[1], rel=1e-11, abs=1e-9)


def test_the_estimate_moves_with_the_world_frame() -> None:
    convention = cdprcal.EulerConvention.ZYX  # the vertical turns its yaw alone
    for random, drawn, _ in samples(5, every=4):
        robot = random_robot(random, max(drawn.cable_count, 3), euler_convention=convention)
        upright = Pose(random_pose(random, robot).position_m, np.eye(3))
        poses = [cdprcal.plus(upright, random.normal(size=6) * 0.1) for _ in range(5)]
        if not all(cdprcal.platform_state(robot, p).valid for p in poses):
            continue
        readings = measured(random, robot, poses)
        yaw, shift = random.uniform(-3.0, 3.0), random.uniform(-2.0, 2.0, size=3)
        c, s = np.cos(yaw), np.sin(yaw)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        found = []
        for place, guess in (
            (robot, poses),
            (
                moved_base(robot, turn, shift),
                [Pose(turn @ p.position_m + shift, turn @ p.rotation) for p in poses],
            ),
        ):
            problem = cdprcal.CalibrationProblem(
                robot=place, measurements=readings, statics=StaticsModel.none
            )
            found.append(cdprcal.solve(problem, guess))
        one, two = found
        assert one.status == two.status
        if one.status != cdprcal.CalibrationStatus.converged:
            continue
        assert one.cost == pytest.approx(two.cost, rel=1e-6, abs=1e-8)
        assert one.covariance is not None
        assert two.covariance is not None
        deviation = np.sqrt(np.diag(one.covariance))
        back = Pose(turn.T @ (two.poses[0].position_m - shift), turn.T @ two.poses[0].rotation)
        assert np.all(np.abs(cdprcal.minus(back, one.poses[0])) < 1e-3 * deviation.max())
        both = np.kron(np.eye(2), turn)
        np.testing.assert_allclose(
            two.covariance, both @ one.covariance @ both.T, rtol=1e-3,
            atol=1e-4 * np.abs(one.covariance).max(),
        )  # fmt: skip


# What has no answer must say so, never hand out NaN as if it were one.


def assert_said(robot: Robot, pose: Pose) -> None:
    """Whatever is computed at a pose is finite, or its status says that it is nothing."""
    state = cdprcal.platform_state(robot, pose)
    cables = state.cable
    for cable in cables:
        fine = cable.status == cdprcal.CableStatus.ok
        numbers = [cable.length_m, cable.swivel_rad, cable.tangency_rad, cable.free_length_m]
        vectors = np.r_[cable.direction, cable.contact, cable.radial, cable.groove_normal]
        assert np.isfinite([*numbers, *vectors]).all() == fine, (cable.status, numbers, vectors)
    assert state.valid == all(cable.status == cdprcal.CableStatus.ok for cable in cables)
    assert bool(cdprcal.describe_invalid(state)) != state.valid
    tension = np.full(robot.cable_count, robot.tension_limits_N[0])
    if state.valid:
        assert np.isfinite(state.length_m).all()
        assert np.isfinite(cdprcal.length_jacobian(state)).all()
        assert np.isfinite(cdprcal.swivel_jacobian(state)).all()
        assert np.isfinite(cdprcal.wrench_residual(robot, state, tension)).all()
        assert np.isfinite(cdprcal.stiffness(robot, state, tension)).all()
    models = []
    if robot.cable_count <= 6:
        rows = cdprcal.left_inverse_rows(robot.cable_count)
        models = [
            cdprcal.tensions_least_squares(robot, state),
            cdprcal.tensions_left_inverse(robot, state, rows),
        ]
    for model in models:
        if model.valid:
            assert np.isfinite(model.tension_N).all()
            assert np.isfinite(model.by_twist).all()


def pose_of_anchor(robot: Robot, pose: Pose, q_m: Floats) -> Pose:
    """The pose, moved so that the first anchor is at this place relative to its pulley."""
    target = robot.cables[0].pulley.position_m + q_m
    arm = pose.rotation @ robot.cables[0].platform_anchor_m
    return Pose(target - arm, pose.rotation)


def test_poses_at_pulleys_and_axes_have_a_status() -> None:
    for random, robot, pose in samples(6):
        pulley = robot.cables[0].pulley
        x, axis = pulley.x_axis, pulley.swivel_axis
        places = [
            np.zeros(3),
            pulley.radius_m * x,
            0.5 * pulley.radius_m * x,
            2.0 * pulley.radius_m * x,
            pulley.radius_m * (x + axis),
            0.7 * axis,
            -0.7 * axis,
        ]
        tiny = [10.0**-k for k in range(1, 18)]
        places += [p + e * random.normal(size=3) for p in places[:] for e in tiny[::4]]
        for q in places:
            assert_said(robot, pose_of_anchor(robot, pose, q))
        inside = cdprcal.platform_state(robot, pose_of_anchor(robot, pose, 0.5 * places[1]))
        if pulley.radius_m > 0.0:
            assert inside.cable[0].status != cdprcal.CableStatus.ok


@pytest.mark.parametrize("far_m", [1e3, 1e8, 1e16, 1e100, 1e154, 1e200, 1e300])
def test_poses_far_away_have_a_status(far_m: float) -> None:
    for random, robot, pose in samples(7, every=8):
        direction = random.normal(size=3)
        assert_said(robot, Pose(far_m * direction / np.abs(direction).max(), pose.rotation))


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_poses_that_are_no_poses_are_refused(wrong: float) -> None:
    for _, _, pose in samples(8, every=16):
        for at in range(3):
            position = np.array(pose.position_m)
            position[at] = wrong
            with pytest.raises(InputError, match="finite"):
                Pose(position, pose.rotation)
            rotation = np.array(pose.rotation)
            rotation[at, 1] = wrong
            with pytest.raises(InputError, match="rotation"):
                Pose(pose.position_m, rotation)
            with pytest.raises(InputError):
                Pose.from_euler(pose.position_m, np.where(np.arange(3) == at, wrong, 0.0))
            twist = np.zeros(6)
            twist[at + 3] = wrong
            with pytest.raises(InputError):
                cdprcal.plus(pose, twist)


def test_singular_robots_have_a_status() -> None:
    """All cables alike, or all in one plane: no number may pass for a result."""
    for random, robot, pose in samples(9, every=2):
        alike = moved_base(robot, np.eye(3), np.zeros(3))
        first = alike.cables[0]
        twins = Robot(
            name="twins",
            platform=robot.platform,
            cables=[first] * robot.cable_count,
            tension_limits_N=robot.tension_limits_N,
        )
        assert_said(twins, pose)
        readings = measured(random, twins, [pose, pose])
        problem = cdprcal.CalibrationProblem(robot=twins, measurements=readings)
        result = cdprcal.solve(problem, [pose, pose])
        assert_result(result)
        if robot.cable_count >= 3:
            assert_equilibrium(cdprcal.inverse(twins, pose.position_m))
        tension = random_tensions(random, twins)
        assert_equilibrium(cdprcal.direct_from_tensions(twins, tension, pose))


def assert_equilibrium(result: cdprcal.EquilibriumResult) -> None:
    if result.balanced:
        assert result.pose is not None
        assert np.isfinite(result.pose.position_m).all()
        assert np.isfinite(result.tension_N).all()
    else:
        assert result.status != cdprcal.EquilibriumStatus.found
        assert result.reason


def assert_result(result: cdprcal.CalibrationResult) -> None:
    assert result.reason or result.status == cdprcal.CalibrationStatus.converged
    if result.status == cdprcal.CalibrationStatus.converged:
        assert np.isfinite(result.cost)
        assert result.covariance is not None
        assert np.isfinite(result.covariance).all()
        assert np.isfinite(result.poses[0].position_m).all()
    for pose in result.poses:
        assert np.isfinite(pose.position_m).all()
        assert np.isfinite(pose.rotation).all()


def test_equilibria_of_random_robots_have_a_status() -> None:
    for random, robot, pose in samples(10, every=2):
        tension = random_tensions(random, robot)
        assert_equilibrium(cdprcal.direct_from_tensions(robot, tension, pose))
        lengths = cdprcal.platform_state(robot, pose).length_m
        if robot.cable_count <= 6:
            assert_equilibrium(cdprcal.direct_from_lengths(robot, lengths, pose))
        if robot.cable_count >= 3:
            assert_equilibrium(cdprcal.inverse(robot, pose.position_m))
            assert_equilibrium(cdprcal.inverse(robot, robot.cables[0].pulley.position_m))


def test_absurd_readings_have_a_status() -> None:
    """Readings nobody could have: 1e9 m, 1e300 N, all absent."""
    for random, robot, pose in samples(11, every=4):
        poses = [pose, near(random, pose), near(random, pose)]
        good = measured(random, robot, poses)
        for name, value in itertools.product(
            ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"), (1e9, 1e300, np.nan)
        ):
            fields: dict[str, Any] = {
                "time_s": good[1].time_s,
                "kind": good[1].kind,
                "length_m": good[1].length_m,
                "swivel_rad": good[1].swivel_rad,
                "tension_N": good[1].tension_N,
                "roll_pitch_yaw_rad": good[1].roll_pitch_yaw_rad,
            }
            fields[name] = np.full_like(fields[name], value)
            try:
                problem = cdprcal.CalibrationProblem(
                    robot=robot, measurements=[good[0], cdprcal.Measurement(**fields), good[2]]
                )
                result = cdprcal.solve(problem, poses)
            except InputError:
                continue
            assert_result(result)
