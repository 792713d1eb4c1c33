"""Families of cases: what all cases of a study have in common beside poses and noise.

One row a family. `white` and `rest` are the studies of the first records; the others hold the
diagnosis against signals, robots, start-ups and configurations as they are met.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cdprcal.testing.blind_bench.machines import Machine, draw_machine
from cdprcal.testing.blind_bench.signals import SIGNALS

#: 30 % clean, 40 % one effect, 20 % two, 10 % from outside the catalogue; and beside these hundred
#: shares, ten of discrete faults and of events in time, which are gated before any fit.
MIXED = ["clean"] * 30 + ["one"] * 40 + ["two"] * 20 + ["outside"] * 10 + ["fault"] * 10
_ONE = ["clean"] * 30 + ["one"] * 80
#: A fault of configuration alone, and with one effect beside it.
_CONFIGURED = ["clean"] * 30 + ["configuration"] * 40 + ["configuration_one"] * 40
#: Families draw the noise from these shares of the robot file's σ, unless it is given.
NOISES = (0.2, 0.5, 1.0)


@dataclass(frozen=True)
class Family:
    """One row of the table."""

    about: str
    signals: tuple[str, ...]  #: drawn evenly, by name
    machine: Callable[[np.random.Generator], Machine] = lambda _rng: Machine()
    rests: tuple[int, int] | None = None  #: fewest and most, drawn evenly; None: all poses
    revisits: bool = False  #: two places are visited twice
    swings: bool = False  #: the platform does not come to rest
    kinds: tuple[str, ...] = tuple(MIXED)  #: each in its share
    effects: tuple[str, ...] = ()  #: that may be hidden; empty: the whole catalogue
    draws_noise: bool = True


#: How noise comes where the family is about something else: it averages out, or it does not.
_EITHER = ("white", "rest")


def _signal(name: str, draws_noise: bool = True) -> Family:
    return Family(SIGNALS[name].about, (name,), draws_noise=draws_noise)


FAMILIES: dict[str, Family] = {
    **{name: _signal(name, draws_noise=False) for name in ("white", "rest", "quantised")},
    "place": replace(_signal("place"), revisits=True),
    **{
        name: _signal(name)
        for name in ("walk", "wander", "heavy_tailed", "held", "filtered", "low_passes", "spiked")
    },
    "robots": Family("3 to 6 cables, built in and random, 0.3 to 500 kg", _EITHER, draw_machine),
    "weights": Family(
        "irma4 built for 0.3, 13, 100 or 500 kg: what its load cells say of its weight",
        _EITHER,
        lambda rng: Machine(mass_kg=float(rng.choice([0.3, 13.0, 100.0, 500.0]))),
        kinds=tuple(_ONE),
        effects=("mass", "external_force", "load_cell_bias", "load_cell_gain"),
    ),
    "eight": Family(
        "posts8: lengths lead its eight cables, parked by eye",
        _EITHER,
        lambda rng: Machine(name="posts8"),
    ),
    "four": Family("irma4 under the signals and noise of `eight`, to compare", _EITHER),
    "no_load_cells": Family(
        "no tension is read", _EITHER, lambda rng: replace(draw_machine(rng), load_cells=False)
    ),
    "no_swivels": Family(
        "no swivel is read", _EITHER, lambda rng: replace(draw_machine(rng), swivels=False)
    ),
    "one_rest": Family("one rest only, in half of them knocked", _EITHER, rests=(1, 1)),
    "few_rests": Family("2 to 4 rests", _EITHER, rests=(2, 4)),
    "swinging": Family('the platform swings on while it "rests"', ("white",), swings=True),
    "faults": Family(
        "a configuration that is wrong, alone and beside an effect",
        ("white",),
        kinds=tuple(_CONFIGURED),
        draws_noise=False,
    ),
}
