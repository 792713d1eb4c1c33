"""Units that people read: %, N, °, mm for what is 1, N, rad and m inside."""

from __future__ import annotations

import math

_DEGREE = math.degrees(1.0)

#: Unit of the catalogue → unit for people and factor to it.
_FOR_PEOPLE = {
    "1": ("%", 100.0),
    "m": ("mm", 1e3),
    "rad": ("°", _DEGREE),
    "rad/s": ("°/min", 60.0 * _DEGREE),
    "rad/m": ("°/m", _DEGREE),
    "kg/m": ("g/m", 1e3),
    "s": ("ms", 1e3),
}

#: Channel of the gap → name for people, unit, factor to it; in the order of the model's noise.
GAP_CHANNELS = {
    "length_m": ("length", "mm", 1e3),
    "swivel_rad": ("swivel", "°", _DEGREE),
    "roll_pitch_rad": ("roll, pitch", "°", _DEGREE),
    "yaw_rad": ("yaw", "°", _DEGREE),
    "tension_N": ("tension", "N", 1.0),
    "absolute_yaw_rad": ("absolute yaw", "°", _DEGREE),
    "direct_length_m": ("whole length", "mm", 1e3),
    "position_m": ("position", "mm", 1e3),
}


def for_people(unit: str, largest: float) -> tuple[str, float]:
    """Unit for people and the factor to it; ``largest`` is the largest value to be shown."""
    if unit == "N" and abs(largest) >= 1e4:
        return "kN", 1e-3
    return _FOR_PEOPLE.get(unit, (unit, 1.0))
