"""A robot is immutable: copies of it with something else in them."""

from __future__ import annotations

from typing import Any

from cdprcal import _core

_FIELDS = (
    "name",
    "platform",
    "cables",
    "tension_limits_N",
    "gravity_m_s2",
    "sigma",
    "effects",
    "surroundings",
    "effect_definitions",
)


def altered(robot: _core.Robot, **changes: Any) -> _core.Robot:
    """A copy of a robot with some fields replaced."""
    kept = {field: getattr(robot, field) for field in _FIELDS}
    return _core.Robot(**(kept | {"euler_convention": robot.euler_convention} | changes))
