"""Faults of configuration that a case may hide, and those that are made in the readings of a log.

Values are what was done to the readings (mm: 1000), as the simulator takes them. The cases of the
first studies draw from FIRST; what came later stands beside it, so that old seeds stay what they
were.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from cdprcal import _core
from cdprcal.testing.blind_bench.signals import Readings

Values = list[float]
_DEGREES = 180.0 / np.pi
#: Newtons in a kilogram-force, a pound-force, a kilonewton.
_UNITS_N = (9.80665, 4.4482216152605, 1000.0)


def _signs(rng: np.random.Generator, cables: int) -> Values:
    signs = np.ones(cables)
    flipped = rng.choice(cables, size=int(rng.integers(1, cables + 1)), replace=False)
    signs[flipped] = -1.0
    return signs.tolist()


def _order(rng: np.random.Generator, cables: int) -> Values:
    in_order = np.arange(1, cables + 1)
    order = in_order
    while np.all(order == in_order):
        order = rng.permutation(cables) + 1
    return [float(v) for v in order]


def _angle_unit(rng: np.random.Generator, _cables: int) -> Values:
    return [[_DEGREES, 1.0], [1.0, _DEGREES], [_DEGREES, _DEGREES]][int(rng.integers(3))]


#: How the values of each fault of the first studies are drawn.
FIRST: dict[str, Callable[[np.random.Generator, int], Values]] = {
    "length_sign": _signs,
    "swivel_sign": _signs,
    "cable_order": _order,
    "angle_unit": _angle_unit,
    "length_unit": lambda _rng, _cables: [1000.0],
}


def _convention(rng: np.random.Generator, robot: _core.Robot) -> Values:
    """One that turns about x and y the other way round: of a platform that hangs straight but for
    small angles, the place of z among them does not show."""

    def x_first(name: str) -> bool:
        return name.index("X") < name.index("Y")

    own = x_first(robot.euler_convention.name)
    numbers = [i for i, e in enumerate(_core.EulerConvention) if x_first(e.name) != own]
    return [float(numbers[int(rng.integers(len(numbers)))])]


def _attitude_sign(rng: np.random.Generator, _robot: _core.Robot) -> Values:
    signs = np.ones(3)
    signs[rng.integers(3)] = -1.0
    return signs.tolist()


def _tension_columns(rng: np.random.Generator, robot: _core.Robot) -> Values:
    """A cable_order of two parts: the encoders', which is right, and the load cells'."""
    in_order = [float(i + 1) for i in range(robot.cable_count)]
    return in_order + _order(rng, robot.cable_count)


def _mounting(rng: np.random.Generator, _robot: _core.Robot) -> Values:
    """A rotation vector: across, upside down, or askew by more than sensors are by mistake."""
    if rng.integers(2):
        axis, quarters = np.eye(3)[rng.integers(3)], int(rng.integers(1, 4))
        return [float(v) for v in axis * np.pi / 2.0 * (quarters if quarters < 3 else -1)]
    axis = rng.normal(size=3)
    return [float(v) for v in axis / np.linalg.norm(axis) * rng.uniform(0.2, 1.0)]


def _zero_angles(rng: np.random.Generator, _robot: _core.Robot) -> Values:
    lean = rng.uniform(0.15, 0.4, size=2) * rng.choice([-1.0, 1.0], size=2)
    return [*lean.tolist(), float(rng.uniform(-3.0, 3.0))]


def _zero_loads(rng: np.random.Generator, robot: _core.Robot) -> Values:
    share = robot.weight_N / robot.cable_count
    return [float(v) for v in share * rng.uniform(0.5, 1.5, size=robot.cable_count)]


Draw = Callable[[np.random.Generator, _core.Robot], list[tuple[str, Values]]]


def _alone(name: str, draw: Callable[[np.random.Generator, _core.Robot], Values]) -> Draw:
    return lambda rng, robot: [(name, draw(rng, robot))]


def _first(name: str) -> Draw:
    return _alone(name, lambda rng, robot: FIRST[name](rng, robot.cable_count))


def _order_and_signs(rng: np.random.Generator, robot: _core.Robot) -> list[tuple[str, Values]]:
    n = robot.cable_count
    return [("cable_order", _order(rng, n)), ("length_sign", _signs(rng, n))]


#: Every way to get the configuration wrong: one fault, or two that come together.
CONFIGURATIONS: list[Draw] = [
    *(_first(name) for name in FIRST),
    _alone("euler_convention", _convention),
    _alone("attitude_sign", _attitude_sign),
    _alone("tension_unit", lambda rng, _robot: [1.0 / float(rng.choice(_UNITS_N))]),
    _alone("cable_order", _tension_columns),
    _order_and_signs,
    _alone("attitude_mounting", _mounting),
    _alone("attitude_offset", _zero_angles),
    _alone("tension_offset", _zero_loads),
]
#: The names that faults are given.
NAMES = {
    *FIRST,
    *("euler_convention", "attitude_sign", "tension_unit"),
    *("attitude_mounting", "attitude_offset", "tension_offset"),
}


def _exchange_tensions(readings: Readings, values: Values) -> None:
    """Cable i is read on channel order[i], as the robot file says it."""
    channels = np.array(values[len(values) // 2 :], dtype=int) - 1
    for name in ("tension_N", "tension_setpoint_N"):
        exchanged = np.empty_like(readings[name])
        exchanged[:, channels] = readings[name]
        readings[name][:] = exchanged


_MADE_IN_READINGS: dict[str, Callable[[Readings, Values], None]] = {
    "cable_order": _exchange_tensions,
}


@cache
def _taken_by_plant(cables: int) -> dict[str, int]:
    """How many values the simulator's plant takes for what it makes itself."""
    sizes = {"scalar": 1, "n": cables, "3": 3, "n,3": 3 * cables, "2": 2}
    return {
        effect["name"]: sum(sizes[shape] for _, shape in effect["parameters"])
        for effect in _core.injectable_effects()
    }


def in_readings(
    name: str, values: Values, cables: int
) -> Callable[[Readings, Values], None] | None:
    """What makes this fault in the readings; None: the plant does, or it is no fault.

    The plant takes one order of the cables: a second one, the load cells', is made here.
    """
    if _taken_by_plant(cables).get(name) == len(values):
        return None
    return _MADE_IN_READINGS.get(name)
