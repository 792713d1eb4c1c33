"""Robots that the tests make: polygons of 3, 4 and 5 cables, changed copies, hidden effects; and a
small plan."""

from __future__ import annotations

import math
from io import StringIO
from typing import Any

import numpy as np
from ruamel.yaml import YAML

import cdprcal
from cdprcal.diagnosis.document import value_shape
from cdprcal.testing.altered import altered as altered


def polygon_robot(count: int, pulley_radius_m: float = 0.02, **changes: Any) -> cdprcal.Robot:
    """Pulleys on a circle of 1.2 m at heights around 2 m; nothing is exactly symmetric."""
    cables = []
    for i in range(count):
        angle = 2.0 * np.pi * (i + 0.15 * np.sin(3.0 * i)) / count
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        cables.append(
            cdprcal.Cable(
                pulley=cdprcal.Pulley(
                    position_m=1.2 * out + [0.0, 0.0, 2.0 + 0.05 * np.cos(2.0 * i)],
                    x_axis=[0.0, 0.0, -1.0],
                    swivel_axis=[-out[1], out[0], 0.0],
                    radius_m=pulley_radius_m,
                ),
                platform_anchor_m=0.15 * out + [0.0, 0.0, 0.12],
            )
        )
    platform = cdprcal.Platform(
        mass_kg=8.0,
        centre_of_mass_m=[0.004, -0.003, 0.02],
        inertia_kg_m2=[[0.12, 0.004, 0.0], [0.004, 0.1, -0.003], [0.0, -0.003, 0.14]],
    )
    usual: dict[str, Any] = {
        "name": f"polygon{count}",
        "platform": platform,
        "cables": cables,
        "tension_limits_N": [4.0, 200.0],
        "sigma": cdprcal.SensorSigma(tension_N=1.0),
    }
    return cdprcal.Robot(**(usual | changes))


def turned(robot: cdprcal.Robot, angle_rad: float) -> cdprcal.Robot:
    """The whole installation turned about the vertical through the world's origin."""
    turn = rotation_z(angle_rad)
    cables = [
        cdprcal.Cable(
            pulley=cdprcal.Pulley(
                position_m=turn @ cable.pulley.position_m,
                x_axis=turn @ cable.pulley.x_axis,
                swivel_axis=turn @ cable.pulley.swivel_axis,
                radius_m=cable.pulley.radius_m,
            ),
            platform_anchor_m=cable.platform_anchor_m,
        )
        for cable in robot.cables
    ]
    return altered(robot, cables=cables)


def rotation_z(angle_rad: float) -> np.ndarray:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def heavier(robot: cdprcal.Robot, factor: float) -> cdprcal.Robot:
    """Mass, inertia and tension limits times a factor."""
    platform = robot.platform
    scaled = cdprcal.Platform(
        mass_kg=factor * platform.mass_kg,
        centre_of_mass_m=platform.centre_of_mass_m,
        inertia_kg_m2=factor * platform.inertia_kg_m2,
    )
    low, high = robot.tension_limits_N
    return altered(robot, platform=scaled, tension_limits_N=[factor * low, factor * high])


def angle_between(a: np.ndarray, b: np.ndarray) -> float:
    """Geodesic angle of two rotations [rad], accurate near zero."""
    return float(2.0 * np.arcsin(min(1.0, np.linalg.norm(a - b) / np.sqrt(8.0))))


#: How well a tape measures where a pulley is, an axis.
TAPE_M = 0.05


def by_tape(
    robot: cdprcal.Robot, rng: np.random.Generator, off_m: float = TAPE_M, said: bool = True
) -> cdprcal.Robot:
    """The robot with pulleys where somebody measured them, or guessed, and whether he says so."""
    yaml = YAML(typ="safe")
    file = yaml.load(cdprcal.to_yaml(robot))
    for cable in file["cables"]:
        pulley = cable["pulley"]
        off = rng.normal(0.0, off_m, 3)
        pulley["position_m"] = [float(p) for p in np.array(pulley["position_m"]) + off]
        if said:
            pulley["position_sigma_m"] = off_m
    text = StringIO()
    yaml.dump(file, text)
    return cdprcal.parse_robot(text.getvalue(), "by tape")


def small_plan(robot: cdprcal.Robot) -> cdprcal.Plan:
    """Three stops near the middle: quick."""
    positions = [[0.2, 0.1, 0.8], [-0.2, 0.1, 1.0], [0.0, -0.2, 0.9]]
    result = cdprcal.make_plan(robot, positions_m=[np.array(p) for p in positions])
    assert result.status == cdprcal.PlanStatus.planned, result.reason
    return result.plan


def drawn_effect(
    random: np.random.Generator, name: str, sizes: tuple[float, float]
) -> cdprcal.InjectedEffect:
    """An effect of the catalogue, so many typical sizes of irma4 large, of random signs."""
    info = next(i for i in cdprcal.effect_catalogue() if i.name == name)
    values: list[float] = []
    for parameter in info.parameters:
        count = math.prod(value_shape(parameter.shape, 4))
        drawn = random.uniform(*sizes, count) * parameter.typical
        if not info.one_sided:
            drawn *= random.choice([-1.0, 1.0], count)
        values += list(1.0 / drawn if info.inverse else drawn)
    return cdprcal.InjectedEffect(name, values)


def drawn_effects(
    random: np.random.Generator, count: int, sizes: tuple[float, float]
) -> list[cdprcal.InjectedEffect]:
    """So many different ones, of those that every robot has a little of."""
    names = [info.name for info in cdprcal.effect_catalogue() if not info.all_or_nothing]
    chosen = random.choice(len(names), size=count, replace=False)
    return [drawn_effect(random, names[int(index)], sizes) for index in chosen]
