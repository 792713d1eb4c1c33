"""Whether each winch's load cell and encoder are its own: cables are paid out a millimetre in turn.

Of an elastic structure at rest the tension of cable j changes with the length of cable k as that of
k with the length of j (Betti's theorem), whatever its geometry and pose. A load cell on another
cable, a sign, a scale of lengths or tensions that is not that of the other winches: all of them
break the symmetry. What is the same for all winches does not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Speed of a wiggle, and how long cables rest before and after.
SPEED_M_S, REST_S = 0.004, 0.5
#: A response that is so many times the noise is enough; the same says that two are apart.
ENOUGH, APART = 10.0, 3.0


class Responses:
    """What tensions did when cable by cable was paid out.

    efficiency: of each winch, as its session says: how much of a change friction may keep back.
    """

    def __init__(self, efficiency: Sequence[float]) -> None:
        count = len(efficiency)
        self._efficiency = efficiency
        self._slope_N_m = np.full((count, count), np.nan)  # [cable that reads, cable that moved]
        self._sigma_N_m = np.full((count, count), np.nan)

    @property
    def slope_N_m(self) -> Floats:
        """[n, n]: newtons of cable j a metre of cable k paid out; NaN before it was."""
        return self._slope_N_m

    def add(self, moved: int, by_m: float, before_N: Floats, after_N: Floats) -> None:
        """Cable ``moved`` was paid out so far; tensions [cycles, n] at rest before and after."""
        noise_N = np.hypot(_of_mean(before_N), _of_mean(after_N))
        self._slope_N_m[:, moved] = (after_N.mean(axis=0) - before_N.mean(axis=0)) / by_m
        self._sigma_N_m[:, moved] = noise_N / abs(by_m)

    def wrong(self) -> tuple[int, str] | None:
        """(cable from 0, what is wrong with it); None: nothing shows."""
        cables = range(len(self._efficiency))
        pairs = self._pairs_apart()
        if not pairs:
            return None
        # Whoever is wrong is so with all others; where two are exchanged, all are with these two.
        counts = [sum(c in pair for pair in pairs) for c in cables]
        at = max(cables, key=lambda c: (counts[c], self._odd(c)))
        as_if = ""
        if counts.count(max(counts)) > 1 and (swapped := self._swapped()):
            at = swapped[0][0]
            named = " or ".join(f"{one + 1} and {other + 1}" for one, other in swapped)
            as_if = f", as with the load cells of cables {named} swapped"
        return at, (
            "its tension and length answer the other cables' otherwise than theirs answer it"
            f"{as_if}; check sign, counts_per_m, counts_per_N, and that the load cell is on this "
            "cable"
        )

    def _pairs_apart(self) -> list[tuple[int, int]]:
        cables = range(len(self._efficiency))
        return [(j, k) for j in cables for k in range(j) if self._apart(j, k) or self._apart(k, j)]

    def _swapped(self) -> list[tuple[int, int]]:
        """Cables by twos whose load cells, exchanged, leave nothing that shows, best first.

        A cable that is paid out carries less then, too.
        """
        left: dict[tuple[int, int], float] = {}
        for pair in combinations(range(len(self._efficiency)), 2):
            exchanged = Responses(self._efficiency)
            order = np.arange(len(self._efficiency))
            order[list(pair)] = pair[::-1]
            slope = exchanged._slope_N_m = self._slope_N_m[order]
            exchanged._sigma_N_m = self._sigma_N_m[order]
            if not exchanged._pairs_apart() and np.diag(slope).max() < 0.0:
                left[pair] = float(np.abs(slope - slope.T).sum())
        return sorted(left, key=left.__getitem__)

    def _apart(self, j: int, k: int) -> bool:
        """Whether no friction makes the response of j to k that of k to j."""
        here, there = self._slope_N_m[j, k], self._slope_N_m[k, j]
        share = self._efficiency[j] * self._efficiency[k]
        low, high = sorted((share * there, there / share))
        sigma = math.hypot(self._sigma_N_m[j, k], self._sigma_N_m[k, j] / share)
        return bool(max(low - here, here - high) > APART * sigma)

    def _odd(self, at: int) -> float:
        """By how much the cable's responses differ, a ratio above 1; the middle of all pairs."""
        others = [k for k in range(len(self._efficiency)) if k != at]
        here = np.abs(self._slope_N_m[at, others]) + 1e-300
        there = np.abs(self._slope_N_m[others, at]) + 1e-300
        return float(np.exp(np.median(np.abs(np.log(here / there)))))


def _of_mean(rows: Floats) -> Floats:
    """Standard deviation of the mean of each column, neighbours being alike."""
    off = rows - rows.mean(axis=0)
    squares = (off**2).sum(axis=0) + 1e-300
    alike = np.clip((off[1:] * off[:-1]).sum(axis=0) / squares, 0.0, 1.0 - 1.0 / len(rows))
    spread: Floats = np.sqrt(squares * (1.0 + alike) / (1.0 - alike)) / len(rows)
    return spread


__all__ = ["APART", "ENOUGH", "REST_S", "SPEED_M_S", "Responses"]
