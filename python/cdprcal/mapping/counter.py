"""Counters of few bits, which begin again at 0 when they are full."""

from __future__ import annotations

import numpy as np

from cdprcal.mapping.raw import Floats

_BITS = (16, 24, 31, 32)
#: So many usual steps around a full counter it may begin again.
_NEAR = 4.0


def unwrapped(values: Floats) -> Floats:
    """Values that go on rising where a counter of whole numbers was full; others as they are."""
    there = np.flatnonzero(np.isfinite(values))
    if len(there) < 3 or np.any(values[there] != np.round(values[there])):
        return values
    steps = np.diff(values[there])
    usual = float(np.median(steps))
    back = steps < 0.0
    if usual <= 0.0 or not back.any():
        return values
    for bits in _BITS:
        passed = steps[back] + 2.0**bits
        if np.all((passed > 0.0) & (passed < _NEAR * usual)) and values[there].max() < 2.0**bits:
            out = values.copy()
            out[there[1:]] += 2.0**bits * np.cumsum(back)
            return out
    return values
