"""Pictures of a diagnosis: residuals, the gap's staircase, the ranking, held-out against fitted."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal.diagnosis.units import GAP_CHANNELS
from cdprcal.io.files import atomic_output, reason

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_BEFORE, _AFTER, _RIVAL, _OTHER = "#c44e52", "#4c72b0", "#dd8452", "#b0b0b0"
_DOTS_PER_INCH = 130

#: Rows of the residual picture: channel, what its columns are called, and how to read them.
_RESIDUALS: tuple[tuple[str, tuple[str, ...], Callable[[_core.PoseResidual], Any]], ...] = (
    ("length_m", (), lambda r: r.length_m),
    ("swivel_rad", (), lambda r: r.swivel_rad),
    ("tension_N", (), lambda r: r.tension_N),
    ("roll_pitch_rad", ("roll", "pitch"), lambda r: r.roll_pitch_yaw_rad[:2]),
    ("yaw_rad", ("yaw",), lambda r: r.roll_pitch_yaw_rad[2:]),
    ("absolute_yaw_rad", ("absolute yaw",), lambda r: [r.absolute_yaw_rad]),
    ("direct_length_m", (), lambda r: r.direct_length_m),
    ("position_m", ("x", "y", "z"), lambda r: r.position_m),
)


def write_pictures(diagnosis: _core.Diagnosis, folder: Path) -> list[Path]:
    """Writes residuals.png, gap.png, ranking.png and held_out.png; gives back their paths.

    Makes the folder if need be. Raises InputError when it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _core.InputError(f"{folder}: cannot be made: {reason(error)}") from None
    pictures = {
        "residuals.png": draw_residuals,
        "gap.png": draw_gap,
        "ranking.png": draw_ranking,
        "held_out.png": draw_held_out,
    }
    return [_write(draw(diagnosis), folder / name) for name, draw in pictures.items()]


def draw_residuals(diagnosis: _core.Diagnosis) -> Figure:
    """Each channel and cable over the run, without and with what was found."""
    before = _core.model_residuals(diagnosis.baseline)
    after = _core.model_residuals(diagnosis.model)
    rows = [row for row in _RESIDUALS if np.isfinite(_values(before, row[2])).any()]
    columns = max(_values(before, read).shape[1] for _, _, read in rows)
    figure = _figure(2.6 * columns, 1.7 * len(rows) + 0.6)
    for i, (channel, names, read) in enumerate(rows):
        name, unit, factor = GAP_CHANNELS[channel]
        values = [factor * _values(residuals, read) for residuals in (before, after)]
        limit = 1.1 * float(np.nanmax(np.abs(values[0]), initial=1e-12))
        for column in range(values[0].shape[1]):
            axes = figure.add_subplot(len(rows), columns, i * columns + column + 1)
            for residuals, table, colour, label in (
                (before, values[0], _BEFORE, "before"),
                (after, values[1], _AFTER, "after"),
            ):
                times = [residual.run_time_s for residual in residuals]
                axes.plot(times, table[:, column], ".", color=colour, markersize=4, label=label)
            axes.axhline(0.0, color="black", linewidth=0.6)
            axes.set_ylim(-limit, limit)
            axes.set_title(names[column] if names else f"cable {column + 1}", fontsize=8)
            if column == 0:
                axes.set_ylabel(f"{name} [{unit}]", fontsize=8)
            if i == len(rows) - 1:
                axes.set_xlabel("time in the run [s]", fontsize=8)
            axes.tick_params(labelsize=7)
            if i == 0 and column == 0:
                axes.legend(fontsize=7, loc="best")
    figure.suptitle("what the model leaves of each reading (modelled minus measured)", fontsize=10)
    return figure


def draw_gap(diagnosis: _core.Diagnosis) -> Figure:
    """The gap's staircase: rms of each channel before any effect and after each."""
    steps = list(dict.fromkeys(gap.after_effect for gap in diagnosis.gap))
    channels = [c for c in GAP_CHANNELS if any(gap.channel == c for gap in diagnosis.gap)]
    figure = _figure(2.6 * len(channels), 2.9)
    for i, channel in enumerate(channels):
        name, unit, factor = GAP_CHANNELS[channel]
        axes = figure.add_subplot(1, len(channels), i + 1)
        for label, colour, style in (("fitted", _AFTER, "-"), ("held out", _BEFORE, "--")):
            heights = [_gap_of(diagnosis, step, channel, label) * factor for step in steps]
            edges = np.arange(len(steps) + 1) - 0.5
            axes.stairs(heights, edges, color=colour, linestyle=style, linewidth=1.8, label=label)
        floor = _ripple(diagnosis, channel)
        if floor is not None:
            axes.axhline(
                floor * factor, color="black", linestyle=":", linewidth=0.9, label="ripple"
            )
        axes.set_ylim(bottom=0.0)
        axes.set_xticks(range(len(steps)), [s or "before" for s in steps], rotation=30, ha="right")
        axes.tick_params(labelsize=7)
        axes.set_title(f"{name} [{unit}]", fontsize=9)
        if i == 0:
            axes.set_ylabel("rms", fontsize=8)
            axes.legend(fontsize=7)
    return figure


def draw_ranking(diagnosis: _core.Diagnosis) -> Figure:
    """How well each effect of the catalogue would explain the gap before any was accepted."""
    scores = list(reversed(diagnosis.ranking))
    accepted = {effect.info.name for effect in diagnosis.effects}
    rivals = {rival for effect in diagnosis.effects for rival in effect.rivals}
    colours = [
        _AFTER if s.name in accepted else _RIVAL if s.name in rivals else _OTHER for s in scores
    ]
    figure = _figure(7.0, 0.26 * len(scores) + 1.2)
    axes = figure.add_subplot()
    axes.barh([s.name for s in scores], [s.log_evidence for s in scores], color=colours)
    # From the smallest that matters to hundreds: linear near zero, logarithmic beyond.
    axes.set_xscale("symlog", linthresh=3.0)
    axes.axvline(0.0, color="black", linewidth=0.6)
    axes.axvline(3.0, color="black", linestyle=":", linewidth=0.9)
    axes.tick_params(labelsize=8)
    axes.set_xlabel("evidence for the effect, before any refit [nat]; dotted: what is asked for")
    handles = [axes.barh([0], [0], color=c) for c in (_AFTER, _RIVAL, _OTHER)]
    axes.legend(handles, ["accepted", "rival: cannot be told apart", "other"], fontsize=8)
    axes.grid(axis="x", linewidth=0.3)
    return figure


def draw_held_out(diagnosis: _core.Diagnosis) -> Figure:
    """Residuals on held-out poses against those fitted, and what each effect did to them."""
    figure = _figure(8.0, 3.4)
    axes = figure.add_subplot(1, 2, 1)
    limits = []
    markers = "osD^vP*X"
    steps = list(dict.fromkeys(gap.after_effect for gap in diagnosis.gap))
    for i, channel in enumerate(GAP_CHANNELS):
        floor = _ripple(diagnosis, channel)
        rows = [gap for gap in diagnosis.gap if gap.channel == channel]
        if not rows or not floor:
            continue
        fitted = [gap.train_rms / floor for gap in rows]
        held = [gap.held_out_rms / floor for gap in rows]
        limits += fitted + held
        axes.plot(fitted, held, "-", color=f"C{i}", linewidth=0.6)
        for k, gap in enumerate(rows):
            last = steps.index(gap.after_effect) == len(steps) - 1
            axes.plot(
                fitted[k],
                held[k],
                markers[i % len(markers)],
                color=f"C{i}",
                fillstyle="full" if last else "none",
                label=GAP_CHANNELS[channel][0] if k == 0 else None,
            )
    if limits:
        ends = [0.8 * min(limits), 1.25 * max(limits)]
        axes.plot(ends, ends, color="black", linewidth=0.6)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("rms fitted / ripple", fontsize=8)
    axes.set_ylabel("rms held out / ripple", fontsize=8)
    axes.set_title("open: before, full: with all that was found", fontsize=9)
    axes.tick_params(labelsize=7)
    axes.legend(fontsize=7)
    _draw_held_out_cost(figure.add_subplot(1, 2, 2), diagnosis)
    return figure


def _draw_held_out_cost(axes: Axes, diagnosis: _core.Diagnosis) -> None:
    axes.set_title("½ Σ (residual/σ)² a held-out pose", fontsize=9)
    axes.tick_params(labelsize=8)
    if not diagnosis.effects:
        axes.text(0.5, 0.5, "no effect was needed", ha="center", va="center")
        axes.set_axis_off()
        return
    places = np.arange(len(diagnosis.effects))
    for shift, colour, label, heights in (
        (-0.2, _BEFORE, "without", [e.held_out_before for e in diagnosis.effects]),
        (0.2, _AFTER, "with", [e.held_out_after for e in diagnosis.effects]),
    ):
        axes.bar(places + shift, heights, 0.4, color=colour, label=label)
    axes.set_xticks(places, [e.info.name for e in diagnosis.effects], rotation=20, ha="right")
    axes.set_yscale("log")
    axes.legend(fontsize=8)


def _figure(width: float, height: float) -> Figure:
    # Without pyplot: no window system, no state that outlives the picture.
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _write(figure: Figure, path: Path) -> Path:
    with atomic_output(path) as temporary:
        figure.savefig(temporary, dpi=_DOTS_PER_INCH, format="png")
    return path


def _values(residuals: list[_core.ModelResidual], read: Callable[..., Any]) -> Array:
    return np.array([read(residual.residual) for residual in residuals], dtype=float)


def _gap_of(diagnosis: _core.Diagnosis, step: str, channel: str, label: str) -> float:
    for gap in diagnosis.gap:
        if gap.after_effect == step and gap.channel == channel:
            return gap.train_rms if label == "fitted" else gap.held_out_rms
    return math.nan


def _ripple(diagnosis: _core.Diagnosis, channel: str) -> float | None:
    """The readings' own noise in the channel's unit; None when there is no such channel."""
    index = list(GAP_CHANNELS).index(channel)
    level = float(diagnosis.baseline.floor[index])
    if channel == "tension_N":
        level *= diagnosis.corrected.sigma.tension_N
    return level if level > 0 else None
