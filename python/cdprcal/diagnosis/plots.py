"""What the plots of a diagnosis show, as data: drawn by matplotlib (pictures) and plotly (report).

All is read from the document of ``diagnose --json``; values are in the units of people. Colours are
those of Okabe and Ito, which colour-blind people tell apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from cdprcal.diagnosis.units import GAP_CHANNELS
from cdprcal.sensors import CHANNELS, SENSORS, component_names

BEFORE, AFTER, RIVAL, OTHER = "#D55E00", "#0072B2", "#E69F00", "#b8c0c8"
#: Of lines that are told apart: one a cable, or one a number.
CABLES = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
    "#4d4d4d",
    "#8c6d1f",
)

Symbol = Literal["circle", "circle-open", "diamond"]

#: What an effect of the ranking turned out to be, and its colour.
KINDS = {"accepted": AFTER, "rival: cannot be told apart": RIVAL, "other": OTHER}

#: Rows of the residuals: channel of the gap, key of a residual, its columns (none: by cable).
_RESIDUALS = tuple(
    (
        next(c.rms_field for c in CHANNELS.values() if c.sensor.field == field),
        field,
        tuple(component_names(sensor)),
    )
    for field, sensor in SENSORS.items()
)


@dataclass(frozen=True)
class Fit:
    """The residuals of one fit, pose by pose, and how they are told from another's."""

    label: str
    colour: str
    symbol: Symbol
    residuals: Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class Series:
    """Points that belong together; NaN where there is no value."""

    label: str
    colour: str
    symbol: Symbol
    x: list[float]
    y: list[float]


@dataclass(frozen=True)
class Panel:
    """One small plot of several. ``ripple``: the readings' own noise, if it is known."""

    row: int
    column: int
    title: str
    quantity: str  #: with its unit
    unit: str
    series: tuple[Series, ...]
    ripple: float | None

    @property
    def largest(self) -> float:
        """The largest absolute value."""
        return max((abs(v) for s in self.series for v in s.y if math.isfinite(v)), default=0.0)


def fits(document: Mapping[str, Any]) -> list[Fit]:
    """Of the model as it was given, and of it with what was found."""
    both = document["residuals"]
    if not document["effects"]:
        return [Fit("model as given", AFTER, "circle", both["before"])]
    return [
        Fit("model alone", BEFORE, "circle-open", both["before"]),
        Fit("with what was found", AFTER, "diamond", both["after"]),
    ]


def residual_panels(shown: Sequence[Fit], ripple: Mapping[str, float | None]) -> list[Panel]:
    """What the model leaves of each reading over the run: a row a channel that was read."""
    panels: list[Panel] = []
    row = 0
    for channel, key, parts in _RESIDUALS:
        tables = [[_parts(residual, key) for residual in fit.residuals] for fit in shown]
        if all(value is None for values in tables[0] for value in values):
            continue
        name, unit, factor = GAP_CHANNELS[channel]
        name = "attitude" if channel == "roll_pitch_rad" else name
        cables = max(len(values) for table in tables for values in table)
        for column, title in enumerate(parts or [f"cable {i + 1}" for i in range(cables)]):
            series = tuple(
                Series(
                    fit.label,
                    fit.colour,
                    fit.symbol,
                    [residual["run_time_s"] for residual in fit.residuals],
                    [_scaled(values[column] if values else None, factor) for values in table],
                )
                for fit, table in zip(shown, tables, strict=True)
            )
            level = _level(ripple, channel, factor)
            panels.append(Panel(row, column, title, f"{name} [{unit}]", unit, series, level))
        row += 1
    return panels


def gap_steps(document: Mapping[str, Any]) -> list[str]:
    """What the gap's staircase goes over: before any effect, and after each."""
    steps = dict.fromkeys(gap["after_effect"] for gap in document["gap"])
    return [first_step(document) if step is None else f"+ {step}" for step in steps]


def first_step(document: Mapping[str, Any]) -> str:
    """What the gap is that the staircase begins with: faults like signs are set right by then."""
    faults = any(effect["p_value"] is None for effect in document["effects"])
    return "faults set right" if faults else "as given"


def gap_panels(document: Mapping[str, Any]) -> list[Panel]:
    """The gap by channel, held out and fitted: its rms over the places of gap_steps."""
    steps = list(dict.fromkeys(gap["after_effect"] for gap in document["gap"]))
    panels: list[Panel] = []
    for channel, (name, unit, factor) in GAP_CHANNELS.items():
        rows = {gap["after_effect"]: gap for gap in document["gap"] if gap["channel"] == channel}
        if not rows:
            continue
        held_out, fitted = (
            [_scaled(rows[step][key] if step in rows else None, factor) for step in steps]
            for key in ("held_out_rms", "train_rms")
        )
        places = [float(i) for i in range(len(steps))]
        series = (
            Series("held out", BEFORE, "diamond", places, held_out),
            Series("fitted", AFTER, "circle", places, fitted),
        )
        level = _level(document["ripple"], channel, factor)
        panels.append(Panel(0, len(panels), name, f"{name} [{unit}]", unit, series, level))
    return panels


def ranked(document: Mapping[str, Any], most: int | None = None) -> list[tuple[str, float, str]]:
    """Name, evidence [nat] and kind of the effects that would explain the gap best, before any was
    accepted."""
    scores = [s for s in document["ranking"] if s["log_evidence"] is not None][:most]
    accepted = {effect["name"] for effect in document["effects"]}
    rivals = {rival for effect in document["effects"] for rival in effect["rivals"]}
    own, rival, other = KINDS
    return [
        (name, evidence, own if name in accepted else rival if name in rivals else other)
        for name, evidence in ((s["name"], s["log_evidence"]) for s in scores)
    ]


def _parts(residual: Mapping[str, Any], key: str) -> list[float | None]:
    """A channel's residuals; none where nothing was read."""
    value = residual.get(key)
    return [] if value is None else list(value) if isinstance(value, list) else [value]


def _level(ripple: Mapping[str, float | None], channel: str, factor: float) -> float | None:
    level = ripple.get(channel)
    return level * factor if level else None


def _scaled(value: float | None, factor: float) -> float:
    return math.nan if value is None else value * factor
