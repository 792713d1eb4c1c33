"""The frame of a plate that turns in a plane, its tensions read."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.typing import NDArray

import cdprcal

Array = NDArray[np.float64]
NOISE_M = 8e-3
CORNERS_M = ((-1.5, -1.7, 0.0), (1.8, -1.7, 0.0), (1.8, 1.5, 0.0), (-1.3, 1.5, 0.0))


def plate(pulleys_m: Array, position_sigma_m: float) -> cdprcal.Robot:
    """Four cables hold it in the plane z = 0."""
    file = {
        "name": "plate",
        "platform": {
            "mass_kg": 5.0,
            "centre_of_mass_m": [0.0, 0.0, 0.0],
            "inertia_kg_m2": np.eye(3).tolist(),
            "motion": "1R2T",
            "motion_plane_normal": [0.0, 0.0, 1.0],
        },
        "cables": [
            {
                "pulley": {
                    "position_m": at.tolist(),
                    "position_sigma_m": position_sigma_m,
                    "radius_m": 0.0,
                },
                "platform_anchor_m": corner,
            }
            for at, corner in zip(pulleys_m, CORNERS_M, strict=True)
        ],
        "tension_limits_N": [1.0, 3000.0],
        "sensors": {"sigma": {"tension_N": 2.0, "direct_length_m": NOISE_M}},
    }
    return cdprcal.parse_robot(json.dumps(file), "plate")


@pytest.mark.parametrize("seed", [9, 10, 11])
def test_no_stretch_takes_up_what_pulleys_should(seed: int) -> None:
    """Far from the frame each start ended in belts of other rubber: 9 ends of 10 starts."""
    rng = np.random.default_rng(seed)

    def in_plane(sigma_m: float) -> Array:
        return np.hstack([rng.normal(0.0, sigma_m, (4, 2)), np.zeros((4, 1))])

    about = np.array([(-9.0, -6.3, 0.0), (9.0, -6.3, 0.0), (9.0, 6.3, 0.0), (-9.0, 6.3, 0.0)])
    pulleys_m = about + in_plane(0.3)
    drawn_m = pulleys_m * (1.0 + 0.15 * (seed % 3 - 1)) + in_plane(0.5)
    lengths = []
    for _ in range(55):
        position_m = np.array([rng.uniform(-5.0, 5.0), rng.uniform(-4.0, 4.0), 0.0])
        turn = rng.uniform(-0.6, 0.6)
        cos, sin = np.cos(turn), np.sin(turn)
        rotation = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        corners = position_m + np.array(CORNERS_M) @ rotation.T
        lengths.append(np.linalg.norm(pulleys_m - corners, axis=1))
    length_m = np.array(lengths) + 0.326 + rng.normal(0.0, NOISE_M, (55, 4))
    pull_N = np.clip(130.0 * (1.0 - (length_m - 5.0) / 8.0), 3.0, None)
    log = cdprcal.Log(
        time_s=10.0 * np.arange(55),
        direct_length_m=length_m,
        tension_N=pull_N + rng.normal(0.0, 2.0, (55, 4)),
    )
    found = cdprcal.find_frame(plate(drawn_m, 3.0), [log])
    assert found.status == cdprcal.FrameStatus.converged, found.reason
    between = [(i, j) for i in range(4) for j in range(i)]
    true_m = [np.linalg.norm(pulleys_m[i] - pulleys_m[j]) for i, j in between]
    anchors_m = np.array(found.anchors_m)
    found_m = [np.linalg.norm(anchors_m[i] - anchors_m[j]) for i, j in between]
    assert np.abs(np.subtract(found_m, true_m)).max() < 0.1
    assert found.stiffness_N is not None
    assert not found.stiffness_N.value < 1e5  # nan: none is seen
    assert abs(found.noise_m - NOISE_M) < 0.3 * NOISE_M
