"""Equilibria from Python, MuJoCo's dynamics as a second opinion that nobody here wrote, and what
symmetry and scaling demand, whatever the numbers."""
# mypy: disable-error-code="union-attr"
# A pose that is None fails the test by itself.

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import cdprcal
from conftest import TABLE_II_TENSIONS_N
from robots import altered, angle_between, heavier, polygon_robot, rotation_z, turned

_SETS = 10  # of tensions, a robot


@pytest.mark.parametrize("row", range(8))
def test_inverse_and_direct_problem_agree_on_table_ii(robot: cdprcal.Robot, row: int) -> None:
    tension = TABLE_II_TENSIONS_N[row]
    direct = cdprcal.direct_from_tensions(robot, tension)
    assert direct.status == cdprcal.EquilibriumStatus.found
    assert direct.stable
    assert direct.residual_N < 1e-7
    assert direct.pose is not None
    state = cdprcal.platform_state(robot, direct.pose)
    inverse = cdprcal.inverse(
        robot,
        direct.pose.position_m,
        distribution=cdprcal.TensionDistribution.given_lambda,
        lambda_N=cdprcal.lambda_of(robot, state, tension),
    )
    assert inverse.status == cdprcal.EquilibriumStatus.found
    assert inverse.tension_N == pytest.approx(tension, abs=1e-6)
    assert angle_between(inverse.pose.rotation, direct.pose.rotation) < 1e-7
    # Rows 5 to 8 hang at the corners of the box to six decimals; see direct_test.cpp for 1 to 4.
    corner = np.array([0.4, 0.4, 0.6 if row >= 4 else 1.2])
    tolerance = 1e-6 if row >= 4 else 1e-5
    assert np.abs(direct.pose.position_m) == pytest.approx([0.4, 0.4, corner[2]], abs=tolerance)


def test_lengths_of_an_equilibrium_give_it_back(robot: cdprcal.Robot) -> None:
    inverse = cdprcal.inverse(robot, [0.2, -0.1, 0.8])
    direct = cdprcal.direct_from_lengths(robot, inverse.length_m)
    assert direct.status == cdprcal.EquilibriumStatus.found
    assert direct.pose.position_m == pytest.approx([0.2, -0.1, 0.8], abs=1e-7)
    assert direct.tension_N == pytest.approx(inverse.tension_N, abs=1e-4)


def test_along_a_line_every_point_is_what_it_is_by_itself(robot: cdprcal.Robot) -> None:
    line = np.linspace([-0.4, -0.4, 0.6], [0.4, 0.4, 1.2], 25)
    status, quaternion, tension = cdprcal.inverse_along(robot, line)
    assert status == [cdprcal.EquilibriumStatus.found] * 25
    for i in (0, 11, 24):
        alone = cdprcal.inverse(robot, line[i])
        assert tension[i] == pytest.approx(alone.tension_N, abs=1e-6)
        assert np.linalg.norm(quaternion[i]) == pytest.approx(1.0)


def test_a_failure_has_no_pose(robot: cdprcal.Robot) -> None:
    weak = cdprcal.direct_from_tensions(robot, [1.0, 1.0, 1.0, 1.0])
    assert weak.status == cdprcal.EquilibriumStatus.not_found
    assert weak.pose is None
    assert weak.reason
    assert not weak.balanced
    below = cdprcal.inverse(robot, [0.0, 0.0, 5.0])
    assert below.status != cdprcal.EquilibriumStatus.found
    assert below.reason


def test_several_equilibria_are_classified(robot: cdprcal.Robot) -> None:
    found = cdprcal.all_equilibria_from_tensions(robot, TABLE_II_TENSIONS_N[0])
    assert found[0].stable
    stable = [equilibrium.stable for equilibrium in found]
    assert stable == sorted(stable, reverse=True), "stable ones first"
    for equilibrium in found:
        assert equilibrium.residual_N < 1e-6
        assert equilibrium.stable == (equilibrium.stability.constant_tensions_N_m > 0.0)


@pytest.mark.parametrize("count", [1, 2])
def test_the_inverse_problem_is_refused_where_it_is_not_defined(count: int) -> None:
    with pytest.raises(cdprcal.InputError, match="needs 3 cables or more"):
        cdprcal.inverse(polygon_robot(count), [0.0, 0.0, 1.0])


def test_lengths_of_more_than_six_cables_are_refused() -> None:
    with pytest.raises(cdprcal.InputError, match="6"):
        cdprcal.direct_from_lengths(polygon_robot(8), np.full(8, 1.5))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda r: cdprcal.inverse(r, [np.nan, 0.0, 1.0]), "finite"),
        (lambda r: cdprcal.direct_from_tensions(r, [50.0, 50.0]), "tension_N"),
        (lambda r: cdprcal.direct_from_tensions(r, [50.0, -50.0, 50.0, 50.0]), "tension"),
        (lambda r: cdprcal.direct_from_lengths(r, [1.0, 1.0, 0.0, 1.0]), "length"),
        (lambda r: cdprcal.parse_tension_distribution("even"), "barycentre"),
        (
            lambda r: cdprcal.inverse(
                r, [0.0, 0.0, 1.0], distribution=cdprcal.TensionDistribution.given_lambda
            ),
            "lambda",
        ),
    ],
)
def test_wrong_use_is_an_input_error(
    robot: cdprcal.Robot, call: Callable[[cdprcal.Robot], object], words: str
) -> None:
    with pytest.raises(cdprcal.InputError, match=words):
        call(robot)


def mujoco_xml(robot: cdprcal.Robot, start: np.ndarray) -> str:
    """Each cable a tendon from eyelet to anchor, pulled by a motor."""
    platform = robot.platform
    inertia = platform.inertia_kg_m2
    full = [
        inertia[0, 0],
        inertia[1, 1],
        inertia[2, 2],
        inertia[0, 1],
        inertia[0, 2],
        inertia[1, 2],
    ]

    def text(values: Any) -> str:
        return " ".join(repr(float(value)) for value in np.ravel(values))

    eyelets, anchors, tendons, motors = [], [], [], []
    for i, cable in enumerate(robot.cables):
        eyelets.append(f'<site name="d{i}" pos="{text(cable.pulley.position_m)}"/>')
        anchors.append(f'<site name="a{i}" pos="{text(cable.platform_anchor_m)}"/>')
        tendons.append(f'<spatial name="c{i}"><site site="d{i}"/><site site="a{i}"/></spatial>')
        motors.append(f'<motor tendon="c{i}"/>')
    # Damping settles the platform and moves no equilibrium.
    return f"""
      <mujoco>
        <option gravity="0 0 {-robot.gravity_m_s2!r}" timestep="0.004" integrator="implicitfast"/>
        <worldbody>
          {"".join(eyelets)}
          <body name="platform" pos="{text(start)}">
            <joint type="free" damping="2.5"/>
            <inertial pos="{text(platform.centre_of_mass_m)}" mass="{platform.mass_kg!r}"
                      fullinertia="{text(full)}"/>
            {"".join(anchors)}
          </body>
        </worldbody>
        <tendon>{"".join(tendons)}</tendon>
        <actuator>{"".join(motors)}</actuator>
      </mujoco>"""


def settle(
    mujoco: Any, model: Any, data: Any, tension_N: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Position and rotation when the platform has come to rest under constant tendon forces."""
    mujoco.mj_resetData(model, data)
    data.ctrl[:] = -tension_N  # a positive force lengthens a tendon
    for _ in range(100):
        mujoco.mj_step(model, data, nstep=500)
        if max(np.abs(data.qvel).max(), np.abs(data.qacc).max()) < 1e-8:
            break
    else:
        pytest.fail("the platform has not come to rest in MuJoCo")
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
    return data.qpos[:3].copy(), rotation.reshape(3, 3)


@pytest.mark.parametrize("count", [3, 4, 5])
def test_mujoco_settles_at_the_same_pose(count: int) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed (the test extra has it)")
    robot = polygon_robot(count, pulley_radius_m=0.0)
    start = np.array([0.0, 0.0, 1.0])
    model = mujoco.MjModel.from_xml_string(mujoco_xml(robot, start))
    data = mujoco.MjData(model)
    random = np.random.default_rng(count)
    sets = 0
    while sets < _SETS:
        position = random.uniform([-0.35, -0.35, 0.6], [0.35, 0.35, 1.4])
        wanted, _ = cdprcal.set_point_at(robot, position)
        if wanted is None:
            continue
        sets += 1
        tension = wanted.tension_N
        ours = cdprcal.direct_from_tensions(robot, tension)  # from nothing
        assert ours.status == cdprcal.EquilibriumStatus.found
        theirs, rotation = settle(mujoco, model, data, tension)  # swings there from the start
        assert ours.pose.position_m == pytest.approx(theirs, abs=1e-6)
        assert angle_between(ours.pose.rotation, rotation) < 1e-6
        assert np.linalg.norm(theirs - start) > 1e-3, "MuJoCo has moved"


def test_a_pulley_of_no_radius_is_the_limit_of_small_ones() -> None:
    """So what MuJoCo says about eyelets says something about pulleys."""
    tension = cdprcal.set_point_at(polygon_robot(4, 0.0), [0.1, 0.2, 1.0])[0].tension_N
    eyelet = cdprcal.direct_from_tensions(polygon_robot(4, 0.0), tension).pose.position_m
    gaps = [
        np.linalg.norm(
            cdprcal.direct_from_tensions(polygon_robot(4, radius), tension).pose.position_m - eyelet
        )
        for radius in (2e-3, 1e-3, 0.0)
    ]
    assert gaps[0] > 1e-5
    assert gaps[1] == pytest.approx(0.5 * gaps[0], rel=0.05)
    assert gaps[2] == 0.0


def test_known_effects_are_left_to_the_commands(robot: cdprcal.Robot) -> None:
    """The problems themselves solve the robot that they are given."""
    effect = cdprcal.AppliedEffect(name="mass", parameters={"mass_error_kg": [2.0]})
    listed = altered(robot, effects=[effect])
    known = cdprcal.KnownEffects(listed).robot
    assert known.platform.mass_kg == pytest.approx(robot.platform.mass_kg + 2.0)
    assert known.effects == []
    alone = cdprcal.inverse(listed, [0.0, 0.0, 0.9]).tension_N
    assert alone == pytest.approx(cdprcal.inverse(robot, [0.0, 0.0, 0.9]).tension_N)
    assert cdprcal.inverse(known, [0.0, 0.0, 0.9]).tension_N.sum() > alone.sum()


# What symmetry and scaling demand. Above the paper's box several orientations are in balance at one
# position, and which one the search from nothing takes depends on rounding: there the image of the
# one that was found is asked for.

IRMA4 = cdprcal.load_robot("irma4")
ROBOTS = {3: polygon_robot(3), 4: IRMA4, 5: polygon_robot(5)}
DISTRIBUTIONS = [
    cdprcal.TensionDistribution.barycentre,
    cdprcal.TensionDistribution.minimum_norm,
    cdprcal.TensionDistribution.mid_range,
]

positions = st.tuples(st.floats(-0.9, 0.9), st.floats(-0.9, 0.9), st.floats(0.2, 1.7)).map(np.array)
angles = st.floats(-np.pi, np.pi)


def margin_is_clear(found: cdprcal.InverseResult) -> bool:
    """Far enough from what decides the status that rounding does not."""
    return found.balanced and (not np.isfinite(found.margin_N) or abs(found.margin_N) > 1e-6)


@given(positions, st.sampled_from(DISTRIBUTIONS))
@settings(max_examples=60, deadline=None)
def test_irma4_is_its_own_mirror_image(
    position: np.ndarray, distribution: cdprcal.TensionDistribution
) -> None:
    """x ↔ -x: cables 1, 2 and 4, 3 change places (Table II, rows 1 and 2)."""
    mirror = np.diag([-1.0, 1.0, 1.0])
    here = cdprcal.inverse(IRMA4, position, distribution=distribution)
    assume(margin_is_clear(here))
    image = mirror @ here.pose.rotation @ mirror
    there = cdprcal.inverse(IRMA4, mirror @ position, distribution=distribution, start=image)
    assert there.status == here.status
    assert there.tension_N == pytest.approx(here.tension_N[::-1], rel=1e-5, abs=1e-5)
    assert angle_between(there.pose.rotation, image) < 1e-6


@given(
    st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(0.6, 1.2)).map(np.array),
    angles,
    st.floats(0.05, 20.0),
)
@settings(max_examples=40, deadline=None)
def test_in_the_papers_box_the_search_from_nothing_finds_the_image(
    position: np.ndarray, angle: float, factor: float
) -> None:
    found = cdprcal.EquilibriumStatus.found
    here = cdprcal.inverse(IRMA4, position)
    mirrored = cdprcal.inverse(IRMA4, position * [-1.0, 1.0, 1.0])
    rotated = cdprcal.inverse(turned(IRMA4, angle), rotation_z(angle) @ position)
    heavy = cdprcal.inverse(heavier(IRMA4, factor), position)
    assert [each.status for each in (here, mirrored, rotated, heavy)] == [found] * 4
    assert mirrored.tension_N[::-1] == pytest.approx(here.tension_N, rel=1e-5)
    assert rotated.tension_N == pytest.approx(here.tension_N, rel=1e-5)
    assert heavy.tension_N == pytest.approx(factor * here.tension_N, rel=1e-5)


@given(st.sampled_from([3, 4, 5]), positions, st.floats(0.05, 20.0))
@settings(max_examples=60, deadline=None)
def test_scaling_mass_and_limits_scales_tensions_and_moves_nothing(
    count: int, position: np.ndarray, factor: float
) -> None:
    robot = ROBOTS[count]
    light = cdprcal.inverse(robot, position)
    assume(margin_is_clear(light))
    heavy = cdprcal.inverse(heavier(robot, factor), position, start=light.pose.rotation)
    assert heavy.status == light.status
    assert heavy.tension_N == pytest.approx(factor * light.tension_N, rel=1e-5, abs=1e-5 * factor)
    assert angle_between(heavy.pose.rotation, light.pose.rotation) < 1e-6


@given(st.sampled_from([3, 4, 5]), positions, st.floats(0.05, 20.0))
@settings(max_examples=40, deadline=None)
def test_scaled_tensions_hold_the_scaled_mass_at_the_same_pose(
    count: int, position: np.ndarray, factor: float
) -> None:
    robot = ROBOTS[count]
    set_point, _ = cdprcal.set_point_at(
        robot, position, cdprcal.SetPointOptions(tension_margin_N=0.0)
    )
    assume(set_point is not None)
    found = cdprcal.direct_from_tensions(
        heavier(robot, factor), factor * set_point.tension_N, set_point.pose
    )
    assert found.status == cdprcal.EquilibriumStatus.found
    assert found.pose.position_m == pytest.approx(set_point.pose.position_m, abs=1e-6)


@given(st.sampled_from([3, 4, 5]), positions, angles)
@settings(max_examples=60, deadline=None)
def test_a_turned_robot_hangs_turned(count: int, position: np.ndarray, angle: float) -> None:
    robot, turn = ROBOTS[count], rotation_z(angle)
    here = cdprcal.inverse(robot, position)
    assume(margin_is_clear(here))
    image = turn @ here.pose.rotation
    there = cdprcal.inverse(turned(robot, angle), turn @ position, start=image)
    assert there.status == here.status
    assert there.tension_N == pytest.approx(here.tension_N, rel=1e-5, abs=1e-5)
    assert angle_between(there.pose.rotation, image) < 1e-6


@given(st.sampled_from([3, 4, 5]), angles, st.integers(0, 2**32 - 1))
@settings(max_examples=6, deadline=None)
def test_a_turned_robot_has_the_turned_workspace(count: int, angle: float, seed: int) -> None:
    """For any angle the grids differ, so the surfaces are compared: volume and inclusion."""
    step = 0.1
    box = cdprcal.Box([-1.3, -1.3, 0.1], [1.3, 1.3, 1.9])  # holds every pulley, however turned
    shapes = [
        cdprcal.workspace_shape(cdprcal.compute_workspace(robot, box=box, step_m=step))
        for robot in (ROBOTS[count], turned(ROBOTS[count], angle))
    ]
    here, there = (shape.mesh for shape in shapes)
    assert shapes[0].watertight
    assert shapes[1].watertight
    # Neither surface is off by more than a tenth of a step on average.
    assert there.volume_m3 == pytest.approx(here.volume_m3, abs=0.1 * step * here.area_m2)
    # Points that are not within a step of the surface are on the same side of both.
    random = np.random.default_rng(seed)
    surface = here.vertices_m
    checked = 0
    for point in random.uniform(box.lower_m, box.upper_m, (40, 3)):
        if np.linalg.norm(surface - point, axis=1).min() < 1.5 * step:
            continue
        turned_point = rotation_z(angle) @ point
        if not box.contains(turned_point):
            continue
        checked += 1
        assert there.contains(turned_point) == here.contains(point)
    assert checked > 10


@pytest.mark.parametrize("count", [3, 4, 5])
def test_a_quarter_turn_keeps_every_grid_point(count: int) -> None:
    """The grid of a square box is its own image, so point by point."""
    box = cdprcal.Box([-1.2, -1.2, 0.1], [1.2, 1.2, 1.9])
    here = cdprcal.compute_workspace(ROBOTS[count], box=box, step_m=0.1)
    there = cdprcal.compute_workspace(turned(ROBOTS[count], np.pi / 2), box=box, step_m=0.1)
    inside = int(cdprcal.PointStatus.inside)
    # (x, y) → (-y, x): along [y, x] that is a transposition and a reversal of x.
    turned_map = np.transpose(here.status == inside, (0, 2, 1))[:, :, ::-1]
    differ = np.count_nonzero(turned_map != (there.status == inside))
    assert differ <= 0.001 * here.points_inside, (
        "points on the limits themselves may fall either way"
    )
    assert here.points_inside > 500
