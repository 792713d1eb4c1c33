"""What is hidden in a blind case: drawn from the split, the seed and the case's number alone."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.diagnosis.document import value_shape
from cdprcal.testing.blind_bench import faults
from cdprcal.testing.blind_bench.families import FAMILIES, NOISES, Family
from cdprcal.testing.blind_bench.machines import Machine, Scale


class Split(StrEnum):
    """Development looks at `tuning` only; `sealed` is for the published numbers."""

    tuning = "tuning"
    sealed = "sealed"


#: Families that had another word when the first studies were drawn: it is part of their seed.
_FIRST_WORDS = {"white": "reading", "rest": "pose"}


@dataclass(frozen=True)
class Setting:
    """What all cases of a study share."""

    poses: int = 27  #: 8 or 27
    noise: float = 0.2  #: of the robot file's σ; for families that do not draw it
    family: str = "white"

    @property
    def name(self) -> str:
        """For file names and reports."""
        noise = "drawn" if FAMILIES[self.family].draws_noise else f"{self.noise:g}"
        return f"{self.poses}-poses_{noise}-sigma_{_FIRST_WORDS.get(self.family, self.family)}"


@dataclass(frozen=True)
class Hidden:
    """One effect or fault of a case: values parameter after parameter, reported units."""

    name: str
    values: list[float]
    size: float  #: in typical sizes


@dataclass(frozen=True)
class Case:
    """Everything that the log follows from."""

    number: int
    seed: int  #: of the simulator's offsets and noise
    kind: str  #: clean, one, two, outside, fault, configuration, configuration_one
    shuffled: bool  #: poses in random order, or in a serpentine
    stated: float  #: σ in the robot file ÷ true σ of a reading
    hidden: list[Hidden] = field(default_factory=list)
    machine: Machine = field(default_factory=Machine)
    signal: str = "white"
    noise: float | None = None  #: of the robot file's σ; None: the setting's
    rests: tuple[int, int] | None = None  #: first set-point visited and how many; None: all
    knocked: bool = False  #: the platform swings after it has rested

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


#: What a diagnosis that knows the catalogue cannot know. In the simulator, or (last three) in the
#: readings: see simulate.py. Values at size 1, each with its unit.
OUTSIDE: dict[str, list[tuple[float, str]]] = {
    "bent_frame_under_load": [(1e-5, "m/N")],  # 1 mm at 100 N
    "temperature_step": [(float("nan"), ""), (12.0, "K")],  # time drawn
    "drum_runout": [(1.5e-3, "m"), (0.314, "m")],
    "swivel_eccentricity": [(0.015, "")],  # rad: encoder disc off its axis
    "roll_pitch_bend": [(0.4, "1/rad")],  # reading = angle (1 + b angle)
    "load_cell_curvature": [(4e-4, "1/N")],  # reading = τ (1 + c τ)
}
#: Those that go either way.
_EITHER_SIGN = {"roll_pitch_bend"}

#: Sizes of events, with their units.
EVENTS = {
    "slack": (0.05, "m"),
    "outlier": (0.1, "m"),
    "oscillation": (6.0, "N s"),
    "cable_slip": (0.02, "m"),
}


def _salt(split: Split, seed: int, setting: Setting) -> tuple[int, int]:
    text = f"cdprcal blind bench {split} {seed} {setting.name}"
    digest = hashlib.sha256(text.encode()).digest()
    return int.from_bytes(digest[:8], "little"), int.from_bytes(digest[8:16], "little")


def kind_of(split: Split, seed: int, setting: Setting, number: int) -> str:
    """Kind of case `number`: in their shares over every 110 cases in a row, in random order."""
    kinds = FAMILIES[setting.family].kinds
    block, place = divmod(number, len(kinds))
    rng = np.random.default_rng([_salt(split, seed, setting)[1], block])
    return kinds[int(rng.permutation(len(kinds))[place])]


def draw_case(split: Split, seed: int, setting: Setting, number: int) -> Case:
    """Case `number` of a study: the same whenever and wherever it is drawn."""
    salt = _salt(split, seed, setting)[0]
    rng = np.random.default_rng([salt, number])
    family = FAMILIES[setting.family]
    # From numbers of its own: what is hidden does not depend on what a family draws besides.
    case = _draw_surroundings(family, setting, np.random.default_rng([salt, number, 1]))
    kind = kind_of(split, seed, setting, number)
    stated = float(rng.choice([2.0, 0.5])) if rng.random() < 1.0 / 3.0 else 1.0
    hidden = _draw_hidden(kind, family, case.machine, rng)
    return replace(
        case,
        number=number,
        seed=int(rng.integers(2**62)),
        kind=kind,
        shuffled=bool(rng.random() < 0.5),
        stated=stated,
        hidden=hidden,
    )


def _draw_surroundings(family: Family, setting: Setting, rng: np.random.Generator) -> Case:
    """A case without what is hidden: robot, signal, noise, start-up."""
    rests = None
    if family.rests:
        count = int(rng.integers(family.rests[0], family.rests[1] + 1))
        rests = (int(rng.integers(setting.poses - count + 1)), count)
    return Case(
        number=0,
        seed=0,
        kind="clean",
        shuffled=False,
        stated=1.0,
        machine=family.machine(rng),
        signal=str(rng.choice(family.signals)),
        noise=float(rng.choice(NOISES)) if family.draws_noise else None,
        rests=rests,
        knocked=family.rests == (1, 1) and bool(rng.random() < 0.5),
    )


def _draw_hidden(
    kind: str, family: Family, machine: Machine, rng: np.random.Generator
) -> list[Hidden]:
    scale = machine.scale
    hidden: list[Hidden] = []
    if kind.startswith("configuration"):
        draw = faults.CONFIGURATIONS[int(rng.integers(len(faults.CONFIGURATIONS)))]
        hidden += [Hidden(name, values, 1.0) for name, values in draw(rng, machine.robot())]
    if kind in ("one", "two", "configuration_one"):
        # The bench diagnoses what rests show, and single samples between them.
        catalogue = [
            effect
            for effect in _core.effect_catalogue()
            if (not family.effects or effect.name in family.effects)
            and machine.reads(effect.name)
            and effect.shows != _core.Shows.in_moving_balance
            and not effect.all_or_nothing  # what every robot has a little of
        ]
        count = 2 if kind == "two" else 1
        for index in rng.choice(len(catalogue), size=count, replace=False):
            hidden.append(draw_effect(catalogue[int(index)], rng, machine.cables, scale))
    elif kind == "outside":
        hidden.append(_draw_outside(str(rng.choice(_known(OUTSIDE, machine))), rng, scale))
    elif kind == "fault":
        hidden.append(_draw_fault(rng, machine))
    return hidden


def _known(names: Iterable[str], machine: Machine) -> list[str]:
    return [name for name in names if machine.reads(name)]


def _size(rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(np.log(0.7), np.log(2.0))))


def draw_effect(
    info: _core.EffectInfo, rng: np.random.Generator, cables: int, scale: Scale
) -> Hidden:
    """0.7 to 2 typical sizes, in root mean square over the entries of each parameter."""
    size = _size(rng)
    values: list[float] = []
    for parameter in info.parameters:
        count = math.prod(value_shape(parameter.shape, cables))
        direction = rng.standard_normal(count)
        if info.one_sided:
            direction = np.abs(direction)
        direction *= np.sqrt(count) / np.linalg.norm(direction)
        own = size * parameter.typical * direction
        values += (scale.of(parameter.unit) * (1.0 / own if info.inverse else own)).tolist()
    return Hidden(info.name, values, size)


def _draw_outside(name: str, rng: np.random.Generator, scale: Scale) -> Hidden:
    size = _size(rng)
    values = [value * scale.of(unit) for value, unit in OUTSIDE[name]]
    if math.isnan(values[0]):
        # A share of the run's duration, resolved once that is known (simulate.py).
        return Hidden(name, [float(rng.uniform(0.1, 0.6)), size * values[1]], size)
    values[0] *= size * (float(rng.choice([-1.0, 1.0])) if name in _EITHER_SIGN else 1.0)
    return Hidden(name, values, size)


def _draw_fault(rng: np.random.Generator, machine: Machine) -> Hidden:
    name = str(rng.choice(_known([*faults.FIRST, *EVENTS], machine)))
    if name in EVENTS:
        share = float(rng.uniform(0.15, 0.85))  # of the run's duration
        cable = float(rng.integers(1, machine.cables + 1))
        size, unit = EVENTS[name]
        return Hidden(name, [share, cable, size * machine.scale.of(unit) * _size(rng)], 1.0)
    return Hidden(name, faults.FIRST[name](rng, machine.cables), 1.0)
