"""Poses and rotations as Python sees them."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import cdprcal
from cdprcal import EulerConvention, InputError, Pose

angles = st.tuples(*[st.floats(-1.5, 1.5)] * 3)
conventions = st.sampled_from(list(EulerConvention))


def turn(axis: int, angle: float) -> np.ndarray:
    """Rotation about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    out = np.eye(3)
    out[i, i] = out[j, j] = c
    out[i, j], out[j, i] = -s, s
    return out


@given(angles, conventions)
def test_euler_angles_compose_in_the_order_of_the_name(
    rpy: tuple[float, float, float], convention: EulerConvention
) -> None:
    expected = np.eye(3)
    for letter in convention.name:
        expected = expected @ turn("XYZ".index(letter), rpy["XYZ".index(letter)])
    rotation = cdprcal.rotation_from_euler(rpy, convention)
    np.testing.assert_allclose(rotation, expected, atol=1e-14)
    np.testing.assert_allclose(
        cdprcal.euler_from_rotation(rotation, convention), rpy, atol=1e-7, rtol=0
    )


@given(angles, st.tuples(*[st.floats(-2, 2)] * 3), angles)
def test_minus_undoes_plus(
    rpy: tuple[float, float, float],
    position: tuple[float, float, float],
    rotation_vector: tuple[float, float, float],
) -> None:
    pose = Pose.from_euler(position, rpy)
    twist = np.concatenate([position[::-1], rotation_vector])
    np.testing.assert_allclose(cdprcal.minus(cdprcal.plus(pose, twist), pose), twist, atol=1e-12)


def test_a_pose_is_immutable_and_hands_out_copies() -> None:
    pose = Pose([1, 2, 3])
    position = pose.position_m
    position[0] = 99
    np.testing.assert_array_equal(pose.position_m, [1, 2, 3])
    with pytest.raises(AttributeError):
        pose.position_m = position  # type: ignore[misc]


def test_a_pose_survives_pickling_to_the_bit() -> None:
    pose = Pose.from_euler([0.1, 0.2, 0.3], [0.4, 0.5, 0.6], EulerConvention.ZYX)
    again = pickle.loads(pickle.dumps(pose))
    np.testing.assert_array_equal(again.position_m, pose.position_m)
    np.testing.assert_array_equal(again.rotation, pose.rotation)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Pose([0, 0, np.nan]), "position_m"),
        (lambda: Pose([0, 0, 0], 2 * np.eye(3)), "rotation"),
        (lambda: Pose([0, 0, 0], np.diag([1, 1, -1])), "rotation"),
        (lambda: cdprcal.log_so3(np.zeros((3, 3))), "rotation"),
        (lambda: cdprcal.parse_euler_convention("XYX"), "XYX"),
    ],
)
def test_what_is_no_rotation_is_refused(make: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()  # type: ignore[operator]


def test_input_error_is_a_value_error() -> None:
    assert issubclass(InputError, ValueError)
    assert InputError.__module__ == "cdprcal._core"


def test_eq_20_is_not_the_geodesic_angle() -> None:
    a = Pose.from_euler([0, 0, 0], [0.0857, -0.1039, -0.0134])
    b = Pose.from_euler([0, 0, 0], [0.0847, -0.0717, 0.0070])
    assert np.degrees(cdprcal.rotation_distance_rad(a, b)) == pytest.approx(2.19, abs=0.01)
    assert np.degrees(cdprcal.rotation_angle_difference_rad(a, b)) == pytest.approx(1.42, abs=0.01)
