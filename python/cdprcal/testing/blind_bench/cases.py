"""What is hidden in a blind case: drawn from the split, the seed and the case's number alone."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.diagnosis.shapes import value_shape


class Split(StrEnum):
    """Development looks at `tuning` only; `sealed` is for the published numbers."""

    tuning = "tuning"
    sealed = "sealed"


class NoiseKind(StrEnum):
    """`reading`: white, each reading for itself. `pose`: constant while the platform rests."""

    reading = "reading"
    pose = "pose"


@dataclass(frozen=True)
class Setting:
    """What all cases of a study share."""

    poses: int = 27  #: 8 or 27
    noise: float = 0.2  #: of the σ of eq. 18
    noise_kind: NoiseKind = NoiseKind.reading

    @property
    def name(self) -> str:
        """For file names and reports."""
        return f"{self.poses}-poses_{self.noise:g}-sigma_{self.noise_kind}"


@dataclass(frozen=True)
class Hidden:
    """One effect of a case: values parameter after parameter, reported units."""

    name: str
    values: list[float]
    size: float  #: in typical sizes


@dataclass(frozen=True)
class Case:
    """Everything that the log follows from."""

    number: int
    seed: int  #: of the simulator's offsets and noise
    kind: str  #: clean, one, two, outside, fault
    shuffled: bool  #: poses in random order, or in a serpentine
    stated: float  #: σ in the robot file ÷ true σ of a reading
    hidden: list[Hidden] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


#: 30 % clean, 40 % one effect, 20 % two, 10 % from outside the catalogue; and beside these hundred
#: shares, ten of discrete faults and of events in time, which are gated before any fit.
_KINDS = ["clean"] * 30 + ["one"] * 40 + ["two"] * 20 + ["outside"] * 10 + ["fault"] * 10

#: What a diagnosis that knows the catalogue cannot know. In the simulator, or (last three) in the
#: readings: see simulate.py. Values at size 1.
OUTSIDE: dict[str, list[float]] = {
    "bent_frame_under_load": [1e-5],  # m/N: 1 mm at 100 N
    "temperature_step": [float("nan"), 12.0],  # time drawn, K
    "drum_runout": [1.5e-3, 0.314],  # m, m
    "swivel_eccentricity": [0.015],  # rad: encoder disc off its axis
    "roll_pitch_scale": [0.06],  # 1: roll and pitch read too large
    "load_cell_curvature": [4e-4],  # 1/N: reading = τ (1 + c τ)
}
#: Those that go either way.
_EITHER_SIGN = {"roll_pitch_scale"}

_DEGREES = 180.0 / np.pi


def _signs(rng: np.random.Generator, cables: int) -> list[float]:
    signs = np.ones(cables)
    flipped = rng.choice(cables, size=int(rng.integers(1, cables + 1)), replace=False)
    signs[flipped] = -1.0
    return signs.tolist()


def _order(rng: np.random.Generator, cables: int) -> list[float]:
    in_order = np.arange(1, cables + 1)
    order = in_order
    while np.all(order == in_order):
        order = rng.permutation(cables) + 1
    return [float(v) for v in order]


def _angle_unit(rng: np.random.Generator, _cables: int) -> list[float]:
    return [[_DEGREES, 1.0], [1.0, _DEGREES], [_DEGREES, _DEGREES]][int(rng.integers(3))]


#: How the values of each fault are drawn.
DISCRETE: dict[str, Callable[[np.random.Generator, int], list[float]]] = {
    "length_sign": _signs,
    "swivel_sign": _signs,
    "cable_order": _order,
    "angle_unit": _angle_unit,
    "length_unit": lambda _rng, _cables: [1000.0],
}
#: Sizes of events: m, m, N s, m.
EVENTS = {"slack": 0.05, "outlier": 0.1, "oscillation": 6.0, "cable_slip": 0.02}


def _salt(split: Split, seed: int, setting: Setting) -> tuple[int, int]:
    text = f"cdprcal blind bench {split} {seed} {setting.name}"
    digest = hashlib.sha256(text.encode()).digest()
    return int.from_bytes(digest[:8], "little"), int.from_bytes(digest[8:16], "little")


def kind_of(split: Split, seed: int, setting: Setting, number: int) -> str:
    """Kind of case `number`: in their shares over every 110 cases in a row, in random order."""
    block, place = divmod(number, len(_KINDS))
    rng = np.random.default_rng([_salt(split, seed, setting)[1], block])
    return _KINDS[int(rng.permutation(len(_KINDS))[place])]


def draw_case(split: Split, seed: int, setting: Setting, number: int, cables: int) -> Case:
    """Case `number` of a study: the same whenever and wherever it is drawn."""
    rng = np.random.default_rng([_salt(split, seed, setting)[0], number])
    kind = kind_of(split, seed, setting, number)
    stated = float(rng.choice([2.0, 0.5])) if rng.random() < 1.0 / 3.0 else 1.0
    catalogue = _core.effect_catalogue()
    hidden: list[Hidden] = []
    if kind in ("one", "two"):
        count = 1 if kind == "one" else 2
        for index in rng.choice(len(catalogue), size=count, replace=False):
            hidden.append(_draw_effect(catalogue[int(index)], rng, cables))
    elif kind == "outside":
        hidden.append(_draw_outside(str(rng.choice(list(OUTSIDE))), rng))
    elif kind == "fault":
        hidden.append(_draw_fault(rng, cables))
    return Case(
        number=number,
        seed=int(rng.integers(2**62)),
        kind=kind,
        shuffled=bool(rng.random() < 0.5),
        stated=stated,
        hidden=hidden,
    )


def _size(rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(np.log(0.7), np.log(2.0))))


def _draw_effect(info: _core.EffectInfo, rng: np.random.Generator, cables: int) -> Hidden:
    """Each parameter: `size` typical sizes in root mean square over its entries."""
    size = _size(rng)
    values: list[float] = []
    for parameter in info.parameters:
        count = math.prod(value_shape(parameter.shape, cables))
        direction = rng.standard_normal(count)
        if info.one_sided:
            direction = np.abs(direction)
        direction *= np.sqrt(count) / np.linalg.norm(direction)
        own = size * parameter.typical * direction
        values += (1.0 / own if info.inverse else own).tolist()
    return Hidden(info.name, values, size)


def _draw_outside(name: str, rng: np.random.Generator) -> Hidden:
    size = _size(rng)
    values = list(OUTSIDE[name])
    if math.isnan(values[0]):
        # A share of the run's duration, resolved once that is known (simulate.py).
        return Hidden(name, [float(rng.uniform(0.1, 0.6)), size * values[1]], size)
    values[0] *= size * (float(rng.choice([-1.0, 1.0])) if name in _EITHER_SIGN else 1.0)
    return Hidden(name, values, size)


def _draw_fault(rng: np.random.Generator, cables: int) -> Hidden:
    name = str(rng.choice([*DISCRETE, *EVENTS]))
    if name in EVENTS:
        share = float(rng.uniform(0.15, 0.85))  # of the run's duration
        cable = float(rng.integers(1, cables + 1))
        return Hidden(name, [share, cable, EVENTS[name] * _size(rng)], 1.0)
    return Hidden(name, DISCRETE[name](rng, cables), 1.0)
