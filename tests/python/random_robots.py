"""Seeded random robots and poses, 1 to 8 cables: nothing about them is special."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

import cdprcal
from cdprcal import Pose, Robot
from robots import altered

Floats = NDArray[np.float64]
CONVENTIONS = list(cdprcal.EulerConvention.__members__.values())
#: How many robots a property is tried on; all 1,000: CDPRCAL_PROPERTY_ROBOTS=1000.
COUNT = int(os.environ.get("CDPRCAL_PROPERTY_ROBOTS", "64"))


def random_rotation(random: np.random.Generator) -> Floats:
    """Uniform over all orientations."""
    q, r = np.linalg.qr(random.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    if np.linalg.det(q) < 0.0:
        q[:, 0] = -q[:, 0]
    found: Floats = q
    return found


def random_robot(random: np.random.Generator, cables: int, **changes: Any) -> Robot:
    """Anchors, axes, inertia and convention random, in a hall of about 4 × 4 × 3 m."""
    mass = random.uniform(2.0, 40.0)
    squares = random.uniform(0.2, 0.6, size=3) ** 2
    axes = random_rotation(random)
    platform = cdprcal.Platform(
        mass_kg=mass,
        centre_of_mass_m=random.uniform([-0.1, -0.1, -0.15], [0.1, 0.1, 0.15]),
        inertia_kg_m2=axes @ np.diag(mass / 12.0 * (squares.sum() - squares)) @ axes.T,
    )
    eyelets = random.random() < 0.2
    made = []
    for _ in range(cables):
        turn = random_rotation(random)
        made.append(
            cdprcal.Cable(
                pulley=cdprcal.Pulley(
                    radius_m=0.0 if eyelets else random.uniform(0.01, 0.08),
                    position_m=random.uniform([-2.0, -2.0, 1.8], [2.0, 2.0, 3.0]),
                    x_axis=turn[:, 0],
                    swivel_axis=turn[:, 2],
                ),
                platform_anchor_m=random.uniform([-0.4, -0.4, 0.0], [0.4, 0.4, 0.3]),
            )
        )
    fields: dict[str, Any] = {
        "name": f"random{cables}",
        "platform": platform,
        "cables": made,
        "tension_limits_N": [0.05 * 9.81 * mass, 5.0 * 9.81 * mass],
        "gravity_m_s2": random.uniform(9.7, 9.9),
        "euler_convention": CONVENTIONS[int(random.integers(len(CONVENTIONS)))],
    }
    return Robot(**(fields | changes))


def is_comfortable(robot: Robot, pose: Pose, margin_m: float = 0.15) -> bool:
    """Every cable is this far from where it loses its tangent: numeric derivatives may step."""
    state = cdprcal.platform_state(robot, pose)
    return state.valid and all(
        min(cable.radial_distance_m, cable.free_length_m) > margin_m for cable in state.cable
    )


def random_pose(random: np.random.Generator, robot: Robot) -> Pose:
    """A comfortable pose of any orientation."""
    for _ in range(10_000):
        position = random.uniform([-0.8, -0.8, 0.1], [0.8, 0.8, 1.4])
        pose = Pose(position, random_rotation(random))
        if is_comfortable(robot, pose):
            return pose
    raise AssertionError("no comfortable pose of this robot")


def random_tensions(random: np.random.Generator, robot: Robot) -> Floats:
    """Within the limits."""
    low, high = robot.tension_limits_N
    found: Floats = random.uniform(low, high, size=robot.cable_count)
    return found


def moved_base(robot: Robot, turn: Floats, shift_m: Floats) -> Robot:
    """The same installation, its world frame moved: what was at p is at turn p + shift."""
    cables = [
        cdprcal.Cable(
            pulley=cdprcal.Pulley(
                radius_m=cable.pulley.radius_m,
                position_m=turn @ cable.pulley.position_m + shift_m,
                x_axis=turn @ cable.pulley.x_axis,
                swivel_axis=turn @ cable.pulley.swivel_axis,
            ),
            platform_anchor_m=cable.platform_anchor_m,
        )
        for cable in robot.cables
    ]
    return altered(robot, cables=cables)


def moved_platform(robot: Robot, turn: Floats, shift_m: Floats) -> Robot:
    """The same platform in another frame of its own: what was at a is at turn a + shift."""
    platform = robot.platform
    cables = [
        cdprcal.Cable(
            pulley=cable.pulley, platform_anchor_m=turn @ cable.platform_anchor_m + shift_m
        )
        for cable in robot.cables
    ]
    return altered(
        robot,
        cables=cables,
        platform=cdprcal.Platform(
            mass_kg=platform.mass_kg,
            centre_of_mass_m=turn @ platform.centre_of_mass_m + shift_m,
            inertia_kg_m2=turn @ platform.inertia_kg_m2 @ turn.T,
        ),
    )
