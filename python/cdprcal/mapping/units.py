"""Units that people write, and what they are in SI."""

from __future__ import annotations

import math
import re

G = 9.80665

#: Dimension → unit as people write it → how many of SI's one of them is.
UNITS: dict[str, dict[str, float]] = {
    "s": {
        "s": 1.0,
        "ms": 1e-3,
        "us": 1e-6,
        "ns": 1e-9,
        "min": 60.0,
        "h": 3600.0,
        "d": 86400.0,
    },
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "dm": 0.1, "um": 1e-6, "in": 0.0254, "ft": 0.3048},
    "rad": {
        "rad": 1.0,
        "deg": math.radians(1.0),
        "mrad": 1e-3,
        "urad": 1e-6,
        "mdeg": math.radians(1e-3),
        "arcmin": math.radians(1.0 / 60.0),
        "arcsec": math.radians(1.0 / 3600.0),
        "rev": 2.0 * math.pi,
        "gon": math.pi / 200.0,
    },
    "m_s2": {"m/s2": 1.0, "cm/s2": 1e-2, "mm/s2": 1e-3, "g": G, "mg": 1e-3 * G},
    "rad_s": {
        "rad/s": 1.0,
        "deg/s": math.radians(1.0),
        "mrad/s": 1e-3,
        "mdeg/s": math.radians(1e-3),
        "rpm": math.pi / 30.0,
    },
    "N": {
        "N": 1.0,
        "kN": 1e3,
        "dN": 0.1,
        "cN": 1e-2,
        "mN": 1e-3,
        "MN": 1e6,
        "daN": 10.0,
        "kgf": G,
        "gf": 1e-3 * G,
        "lbf": 4.4482216,
    },
}
_ALIASES = {
    "sec": "s",
    "second": "s",
    "sekunden": "s",
    "millis": "ms",
    "msec": "ms",
    "millisecond": "ms",
    "micros": "us",
    "microsec": "us",
    "usec": "us",
    "microsecond": "us",
    "day": "d",
    "nsec": "ns",
    "nanosec": "ns",
    "nanosecond": "ns",
    "metre": "m",
    "meter": "m",
    "inch": "in",
    "°": "deg",
    "degree": "deg",
    "grad": "deg",  # German; the gradian is gon
    "radian": "rad",
    "turn": "rev",
    "m/s/s": "m/s2",
    "m s-2": "m/s2",
    "°/s": "deg/s",
    "dps": "deg/s",
    "newton": "N",
    "kp": "kgf",
    "kg": "kgf",
    "g": "gf",
    "lb": "lbf",
    "lbs": "lbf",
}
#: Signs for micro (the letter, and that of Latin-1) and for a square.
_SIGNS = str.maketrans({"\N{GREEK SMALL LETTER MU}": "u", "\N{MICRO SIGN}": "u", "²": "2", "^": ""})
_EXACT = {unit for units in UNITS.values() for unit in units} - {"g"}
#: Of two that differ in case only (mN and MN) the smaller: who means mega writes it.
_PLAIN = {unit.lower(): unit for unit in sorted(_EXACT)} | {"g": "gf"}
#: Letters after what is none; or, after a word, a unit with a capital, else what a capital begins.
_AT_END = (
    re.compile(r"(?<=[\W\d_])[^\W\d_]+$"),
    re.compile(rf"(?<=[a-zäöü])({'|'.join(u for u in _EXACT if u != u.lower())})$"),
    re.compile(r"(?<=[a-zäöü])[A-Z][a-z]*$"),
)


def unit_named(text: str) -> str | None:
    """'[MM]' → 'mm', '°' → 'deg', 'kg' → 'kgf' (of a force); None for what is no unit here."""
    plain = text.strip().strip("[]() ").strip().translate(_SIGNS)
    if plain in _EXACT:
        return plain
    lower = plain.lower()
    one = lower.removesuffix("s") if len(lower) > len("lbs") else lower  # meters → meter
    return _ALIASES.get(lower) or _ALIASES.get(one) or _PLAIN.get(lower)


def unit_at_end(text: str) -> tuple[str | None, str]:
    """The unit that ends a name, and the name without it: 'F1_kN', 'F1kN' and 'forcekN' are kN."""
    for pattern in _AT_END:
        found = pattern.search(text)
        # Of single letters only those that nothing else is called.
        if found and (len(found[0]) > 1 or found[0] in ("m", "N", "s")) and unit_named(found[0]):
            return unit_named(found[0]), text[: found.start()]
    return None, text


def factor(dimension: str, unit: str | float) -> float | None:
    """How many SI units one of them is; a number is that already; None: no unit of the kind."""
    if isinstance(unit, int | float):
        return float(unit)
    found = unit if unit in UNITS[dimension] else unit_named(unit)
    return UNITS[dimension].get(found) if found else None
