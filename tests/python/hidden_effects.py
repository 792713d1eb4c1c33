"""Effects hidden in simulated robots, by their typical sizes."""

from __future__ import annotations

import math

import numpy as np

import cdprcal
from cdprcal.diagnosis.document import value_shape


def drawn_effect(
    random: np.random.Generator, name: str, sizes: tuple[float, float]
) -> cdprcal.InjectedEffect:
    """An effect of the catalogue, so many typical sizes of irma4 large, of random signs."""
    info = next(i for i in cdprcal.effect_catalogue() if i.name == name)
    values: list[float] = []
    for parameter in info.parameters:
        count = math.prod(value_shape(parameter.shape, 4))
        drawn = random.uniform(*sizes, count) * parameter.typical
        if not info.one_sided:
            drawn *= random.choice([-1.0, 1.0], count)
        values += list(1.0 / drawn if info.inverse else drawn)
    return cdprcal.InjectedEffect(name, values)


def drawn_effects(
    random: np.random.Generator, count: int, sizes: tuple[float, float]
) -> list[cdprcal.InjectedEffect]:
    """So many different ones, of those that every robot has a little of."""
    names = [info.name for info in cdprcal.effect_catalogue() if not info.all_or_nothing]
    chosen = random.choice(len(names), size=count, replace=False)
    return [drawn_effect(random, names[int(index)], sizes) for index in chosen]
