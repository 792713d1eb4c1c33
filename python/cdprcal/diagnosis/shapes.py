"""How many numbers a parameter of an effect has, and how they are nested."""

from __future__ import annotations

from cdprcal import _core


def value_shape(shape: _core.ParameterShape, cables: int) -> tuple[int, ...]:
    """The nesting in a robot file: () a number, (cables,), (3,) or (cables, 3)."""
    return {
        _core.ParameterShape.scalar: (),
        _core.ParameterShape.per_cable: (cables,),
        _core.ParameterShape.vector3: (3,),
        _core.ParameterShape.per_cable_vector3: (cables, 3),
    }[shape]
