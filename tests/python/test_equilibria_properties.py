"""What symmetry and scaling demand of equilibria and workspaces, whatever the numbers.

Above the paper's box several orientations are in balance at one position, and which one the search
from nothing takes depends on rounding: there the image of the one that was found is asked for.
"""
# mypy: disable-error-code="union-attr"
# A pose that is None fails the test by itself.

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import cdprcal
from robots import angle_between, heavier, polygon_robot, rotation_z, turned

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
