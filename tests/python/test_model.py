"""Robots from files, from keyword arguments, and through pickling."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal import Cable, InputError, Platform, Pulley, Robot


def parts(count: int = 3, **changes: Any) -> dict[str, Any]:
    """Keyword arguments of a plain robot."""
    turn = 2 * np.pi * np.arange(count) / count
    return {
        "name": "plain",
        "platform": Platform(
            mass_kg=5, centre_of_mass_m=[0, 0, 0.1], inertia_kg_m2=np.diag([0.1, 0.1, 0.15])
        ),
        "cables": [
            Cable(
                pulley=Pulley(
                    position_m=[np.cos(t), np.sin(t), 2], x_axis=[0, 0, -3], swivel_axis=[2, 0, 0]
                ),
                platform_anchor_m=[0.1 * np.cos(t), 0.1 * np.sin(t), 0.2],
            )
            for t in turn
        ],
        "tension_limits_N": (5, 100),
    } | changes


@pytest.mark.parametrize("cables", [1, 2, 3, 4, 5, 6, 7, 8])
def test_a_robot_of_any_size_reads_back_from_its_own_file(cables: int) -> None:
    robot = Robot(**parts(cables))
    again = cdprcal.parse_robot(cdprcal.to_yaml(robot), "again")
    assert cdprcal.to_yaml(again) == cdprcal.to_yaml(robot)
    assert again.cable_count == cables
    assert again.tension_limits_N == [5, 100]
    for a, b in zip(again.cables, robot.cables, strict=True):
        np.testing.assert_array_equal(a.pulley.axes_world, b.pulley.axes_world)
        np.testing.assert_array_equal(a.platform_anchor_m, b.platform_anchor_m)


def test_a_robot_survives_pickling(robot: Robot) -> None:
    assert cdprcal.to_yaml(pickle.loads(pickle.dumps(robot))) == cdprcal.to_yaml(robot)


def test_irma4_is_built_in_and_a_file_is_read_by_path(robot: Robot, tmp_path: Path) -> None:
    assert cdprcal.builtin_robot_names() == ["irma4", "ring3", "ring5", "posts8", "belts4", "hang4"]
    path = tmp_path / "mine.yaml"
    path.write_text(cdprcal.builtin_robot_yaml("irma4"))
    assert cdprcal.to_yaml(cdprcal.load_robot(str(path))) == cdprcal.to_yaml(robot)
    assert robot.weight_N == pytest.approx(12.992 * 9.81)
    np.testing.assert_allclose(robot.gravity_force_N, [0, 0, -12.992 * 9.81])


def test_axes_are_completed_to_a_right_handed_frame() -> None:
    pulley = Pulley(position_m=[0, 0, 0], x_axis=[0, 0, -3], swivel_axis=[2, 0, 0], radius_m=0.03)
    np.testing.assert_allclose(pulley.x_axis, [0, 0, -1])
    np.testing.assert_allclose(pulley.swivel_axis, [1, 0, 0])
    np.testing.assert_allclose(pulley.y_axis, np.cross(pulley.swivel_axis, pulley.x_axis))
    assert np.linalg.det(pulley.axes_world) == pytest.approx(1)


def test_the_parts_handed_out_are_copies(robot: Robot) -> None:
    robot.cables.clear()
    anchor = robot.cables[0].platform_anchor_m
    anchor[:] = 99
    assert robot.cable_count == 4
    assert robot.cables[0].platform_anchor_m[0] == pytest.approx(0.075)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"name": ""}, "name"),
        ({"gravity_m_s2": -9.81}, "gravity_m_s2"),
        ({"cables": []}, "cables"),
        ({"tension_limits_N": (100, 5)}, "tension_limits_N"),
        ({"sigma": cdprcal.SensorSigma(length_m=0)}, "length_m"),
        (
            {"platform": Platform(mass_kg=-1, centre_of_mass_m=[0, 0, 0], inertia_kg_m2=np.eye(3))},
            "mass_kg",
        ),
    ],
)
def test_an_impossible_robot_is_refused_by_field(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError, match=field):
        Robot(**parts(**changes))


def test_an_impossible_pulley_is_refused_by_field() -> None:
    with pytest.raises(InputError, match=r"^pulley\.swivel_axis"):
        Pulley(position_m=[0, 0, 0], x_axis=[1, 0, 0], swivel_axis=[0, 0, 0])
    with pytest.raises(InputError, match=r"^pulley\.x_axis.*perpendicular"):
        Pulley(position_m=[0, 0, 0], x_axis=[1, 0, 0], swivel_axis=[1, 0, 0])
    with pytest.raises(InputError, match=r"^pulley\.radius_m"):
        Pulley(position_m=[0, 0, 0], x_axis=[1, 0, 0], swivel_axis=[0, 0, 1], radius_m=-1)


def test_per_cable_arrays_of_another_length_are_refused(robot: Robot) -> None:
    state = cdprcal.platform_state(robot, cdprcal.Pose([0, 0, 1]))
    assert state.valid
    for wrong in ([1.0] * 3, [1.0] * 9, [1.0] * 100):
        with pytest.raises(InputError, match="tension_N"):
            cdprcal.wrench_residual(robot, state, wrong)


def test_table_ii_is_in_balance(robot: Robot) -> None:
    pose = cdprcal.Pose.from_euler([0.4, 0.4, 1.2], [0.084023, -0.090510, 0.004690])
    state = cdprcal.platform_state(robot, pose)
    tension = [118.476264, 170.828165, 115.569155, 82.981581]
    np.testing.assert_allclose(cdprcal.wrench_residual(robot, state, tension), 0, atol=4e-4)
    np.testing.assert_allclose(
        cdprcal.structure_matrix(state).T, cdprcal.length_jacobian(state), atol=1e-15
    )
    rows = cdprcal.left_inverse_rows(4)
    model = cdprcal.tensions_left_inverse(robot, state, rows)
    assert model.valid
    assert model.by_twist.shape == (4, 6)


def test_derivatives_where_there_are_none_are_refused() -> None:
    pulley = Pulley(position_m=[0, 0, 0], x_axis=[1, 0, 0], swivel_axis=[0, 0, 1], radius_m=0.1)
    state = cdprcal.cable_state(pulley, [0.1, 0, 0])
    assert state.status == cdprcal.CableStatus.anchor_inside_pulley
    with pytest.raises(InputError, match="status"):
        cdprcal.cable_derivatives(pulley, state)
