"""Words and numbers that say that nothing was read, such as n/a and -999."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: In small letters; the last ones are C's and Excel's, in English and German.
_WORDS = {"", "-", "--", "---", "?", "na", "n/a", "nan", "+nan", "-nan", "null", "nil", "none"}
_WORDS |= {"nan(ind)", "-nan(ind)", "-1.#ind", "1.#qnan", "#n/a", "#nv"}
#: Nines, and where whole numbers of 16 and 32 bits end.
_USUAL = [sign * (10.0**digits - 1.0) for digits in range(3, 8) for sign in (1, -1)]
_USUAL += [-(2.0**15), 2.0**15 - 1.0, 2.0**16 - 1.0, -(2.0**31), 2.0**31 - 1.0, 2.0**32 - 1.0]
#: By chance no more than one column in so many seems to have a mark.
_ONE_IN = 1000


def says_nothing(cell: str) -> bool:
    """Whether a cell of a file says that nothing was read."""
    return cell.lower() in _WORDS


def marks_in(values: Floats) -> dict[int, int]:
    """How often each number stands in a column that seems to mark a missing reading.

    It is one that people use so, stands there more than once, and every step onto it and off it is
    larger than all other steps: of k steps of n all alike that has a chance of 1 : C(n, k). That it
    stands still in between has that of a reading that does, each time.
    """
    there = values[np.isfinite(values)]
    usual = np.isin(there, _USUAL)
    if not usual.any():
        return {}
    others = np.abs(np.diff(there[~usual]))
    steps = np.abs(np.diff(there))
    marks = {}
    for mark in np.unique(there[usual]).tolist():
        is_it = there == mark
        # Between two marks is no step of a reading.
        onto = steps[(is_it[1:] & ~usual[:-1]) | (is_it[:-1] & ~usual[1:])]
        few = min(len(onto), 3)  # enough to tell, and no number of a million digits
        if not few or not len(others) or is_it.sum() < 2:
            continue
        stands = (1.0 + np.count_nonzero(others == 0.0)) / (1.0 + len(others))
        chance = stands ** np.count_nonzero(is_it[1:] & is_it[:-1])
        if math.comb(len(others) + few, few) > _ONE_IN * chance and onto.min() > others.max():
            marks[int(mark)] = int(is_it.sum())
    return marks


def without(values: Floats, marks: Iterable[float]) -> Floats:
    """A column in which marks are no readings."""
    return np.where(np.isin(values, list(marks)), np.nan, values)
