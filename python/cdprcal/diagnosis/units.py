"""Units that people read: %, N, °, mm for what is 1, N, rad and m inside."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cdprcal.sensors import CHANNELS

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

_UNITS = {
    "m": ("mm", 1e3),
    "rad": ("°", _DEGREE),
    "N": ("N", 1.0),
    "m_s2": ("m/s²", 1.0),
    "rad_s": ("°/s", _DEGREE),
}
#: Channel of the gap → name for people, unit, factor to it; in the order of the model's noise.
GAP_CHANNELS = {
    channel.rms_field: (channel.label.removesuffix(" angle"), *_UNITS[channel.sensor.unit])
    for channel in CHANNELS.values()
}


def for_people(unit: str, largest: float) -> tuple[str, float]:
    """Unit for people and the factor to it; ``largest`` is the largest value to be shown."""
    if unit == "N" and abs(largest) >= 1e4:
        return "kN", 1e-3
    return _FOR_PEOPLE.get(unit, (unit, 1.0))


def shown_word(word: str, values: Sequence[float | None]) -> tuple[str, str, float]:
    """A formula's word without its unit ('length_m'), the unit for people, and the factor to it."""
    name, _, unit = word.rpartition("_")
    largest = max((abs(value) for value in values if value is not None), default=0.0)
    if unit == "m" and name:
        return name, *(("mm", 1e3) if largest < 0.1 else ("m", 1.0))
    if unit == "rad":
        return name, "°", _DEGREE
    if unit in ("N", "s", "kg"):
        return name, unit, 1.0
    return word, "1", 1.0
