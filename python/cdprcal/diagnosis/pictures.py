"""Pictures of a diagnosis: residuals, the gap's staircase, the ranking, held-out against fitted."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cdprcal.diagnosis.plots import (
    AFTER,
    BEFORE,
    KINDS,
    fits,
    gap_panels,
    gap_steps,
    ranked,
    residual_panels,
)
from cdprcal.diagnosis.units import shown_word
from cdprcal.io.files import make_folder
from cdprcal.pictures import new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Of ``diagnose --json``.
Document = Mapping[str, Any]

_MARKERS = {"circle": "o", "circle-open": "o", "diamond": "D"}


def write_pictures(document: Document, folder: Path) -> list[Path]:
    """Writes residuals.png, gap.png, ranking.png, held_out.png and, where effects are formulas,
    formulas.png; gives back their paths.

    document: of ``diagnose --json``. Makes the folder if need be. Raises InputError when it cannot
    be written.
    """
    make_folder(folder)
    pictures = {
        folder / "residuals.png": draw_residuals,
        folder / "gap.png": draw_gap,
        folder / "ranking.png": draw_ranking,
        folder / "held_out.png": draw_held_out,
    }
    if any(effect["course"] for effect in document["effects"]):
        pictures[folder / "formulas.png"] = draw_formulas
    for path, draw in pictures.items():
        save_figure(draw(document), path)
    return list(pictures)


def draw_residuals(document: Document) -> Figure:
    """Each channel and cable over the run, without and with what was found."""
    panels = residual_panels(fits(document), document["ripple"])
    rows, columns = (1 + max(getattr(p, way) for p in panels) for way in ("row", "column"))
    figure = new_figure(2.6 * columns, 1.7 * rows + 0.6)
    for panel in panels:
        axes = figure.add_subplot(rows, columns, panel.row * columns + panel.column + 1)
        for series in panel.series:
            axes.plot(
                series.x,
                series.y,
                _MARKERS[series.symbol],
                color=series.colour,
                fillstyle="none" if series.symbol.endswith("open") else "full",
                markersize=3,
                label=series.label,
            )
        if panel.ripple:
            axes.axhspan(-panel.ripple, panel.ripple, color="#e4eaf1", zorder=0)
        axes.axhline(0.0, color="black", linewidth=0.6)
        limit = 1.15 * max(p.largest for p in panels if p.row == panel.row) or 1e-9
        axes.set_ylim(-limit, limit)
        axes.set_title(panel.title, fontsize=8)
        if panel.column == 0:
            axes.set_ylabel(panel.quantity, fontsize=8)
        if panel.row == rows - 1:
            axes.set_xlabel("time in the run [s]", fontsize=8)
        axes.tick_params(labelsize=7)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    # Below all panels: within one it would lie on readings.
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=7)
    figure.suptitle("what the model leaves of each reading (modelled minus measured)", fontsize=10)
    return figure


def draw_gap(document: Document) -> Figure:
    """The gap's staircase: rms of each channel before any effect and after each."""
    steps, panels = gap_steps(document), gap_panels(document)
    figure = new_figure(2.6 * len(panels), 2.9)
    for panel in panels:
        axes = figure.add_subplot(1, len(panels), panel.column + 1)
        for series, style in zip(panel.series, ("--", "-"), strict=True):
            edges = np.arange(len(steps) + 1) - 0.5
            axes.stairs(
                series.y,
                edges,
                color=series.colour,
                linestyle=style,
                linewidth=1.8,
                label=series.label,
            )
        if panel.ripple:
            axes.axhline(panel.ripple, color="black", linestyle=":", linewidth=0.9, label="ripple")
        axes.set_ylim(bottom=0.0)
        axes.set_xticks(range(len(steps)), steps, rotation=30, ha="right")
        axes.tick_params(labelsize=7)
        axes.set_title(panel.quantity, fontsize=9)
        if panel.column == 0:
            axes.set_ylabel("rms", fontsize=8)
            axes.legend(fontsize=7)
    return figure


def draw_formulas(document: Document) -> Figure:
    """Each formula (dots) against the first of its variables, with what was read (rings)."""
    effects = [effect for effect in document["effects"] if effect["course"]]
    figure = new_figure(7.0, 2.7 * len(effects) + 0.3)
    for place, effect in enumerate(effects):
        axes = figure.add_subplot(len(effects), 1, place + 1)
        course = effect["course"]
        points = course["points"]
        to, unit, factor = shown_word(course["to"], [p["read"] for p in points])
        variable, x_unit, x_factor = shown_word(course["variable"], [p["x"] for p in points])
        for cable in dict.fromkeys(point["cable"] for point in points):
            of = [p for p in points if p["cable"] == cable and p["x"] is not None]
            x = x_factor * np.array([p["x"] for p in of])
            colour = f"C{(cable or 1) - 1}"
            read = factor * np.array([p["read"] for p in of], dtype=float)
            added = factor * np.array([p["added"] for p in of], dtype=float)
            label = f"cable {cable}" if cable else "read"
            axes.plot(x, read, "o", color=colour, markersize=4, fillstyle="none", label=label)
            # The law is known at these poses alone: between them it may swing.
            axes.plot(x, added, ".", color=colour, markersize=3)
        axes.plot([], [], ".", color="black", markersize=3, label="by the formula")
        axes.axhline(0.0, color="black", linewidth=0.5)
        axes.set_title(
            f"{course['to']} += {effect['formula'][course['to']]}", fontsize=8, wrap=True
        )
        axes.set_xlabel(f"{variable} [{x_unit}]", fontsize=8)
        axes.set_ylabel(f"{to}, read minus model [{unit}]", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.legend(fontsize=7, ncols=2)
    return figure


def draw_ranking(document: Document) -> Figure:
    """How well each effect of the catalogue would explain the gap before any was accepted."""
    scores = list(reversed(ranked(document)))
    figure = new_figure(7.0, 0.26 * len(scores) + 1.2)
    axes = figure.add_subplot()
    colours = [KINDS[kind] for _, _, kind in scores]
    axes.barh([name for name, _, _ in scores], [v for _, v, _ in scores], color=colours)
    # From the smallest that matters to hundreds: linear near zero, logarithmic beyond.
    axes.set_xscale("symlog", linthresh=3.0)
    axes.axvline(0.0, color="black", linewidth=0.6)
    axes.axvline(3.0, color="black", linestyle=":", linewidth=0.9)
    axes.tick_params(labelsize=8)
    axes.set_xlabel("evidence for the effect, before any refit [nat]; dotted: what is asked for")
    handles = [axes.barh([0], [0], color=colour) for colour in KINDS.values()]
    axes.legend(handles, list(KINDS), fontsize=8)
    axes.grid(axis="x", linewidth=0.3)
    return figure


def draw_held_out(document: Document) -> Figure:
    """Residuals on held-out poses against those fitted, and what each effect did to them."""
    figure = new_figure(8.0, 3.4)
    axes = figure.add_subplot(1, 2, 1)
    limits: list[float] = []
    markers = "osD^vP*X"
    for panel in gap_panels(document):
        if not panel.ripple:
            continue
        held, fitted = (np.array(series.y) / panel.ripple for series in panel.series)
        limits += [*held, *fitted]
        style, colour = markers[panel.column % len(markers)], f"C{panel.column}"
        axes.plot(fitted, held, "-", color=colour, linewidth=0.6)
        axes.plot(fitted[:-1], held[:-1], style, color=colour, fillstyle="none")
        axes.plot(fitted[-1:], held[-1:], style, color=colour, label=panel.title)
    if limits:
        ends = [0.8 * np.nanmin(limits), 1.25 * np.nanmax(limits)]
        axes.plot(ends, ends, color="black", linewidth=0.6)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("rms fitted / ripple", fontsize=8)
    axes.set_ylabel("rms held out / ripple", fontsize=8)
    axes.set_title("open: before, full: with all that was found", fontsize=9)
    axes.tick_params(labelsize=7)
    axes.legend(fontsize=7)
    _draw_held_out_cost(figure.add_subplot(1, 2, 2), document)
    return figure


def _draw_held_out_cost(axes: Axes, document: Document) -> None:
    axes.set_title("½ Σ (residual/σ)² a held-out pose", fontsize=9)
    axes.tick_params(labelsize=8)
    effects = [effect for effect in document["effects"] if effect["held_out"]["after"] is not None]
    if not effects:
        axes.text(0.5, 0.5, "no effect was needed", ha="center", va="center")
        axes.set_axis_off()
        return
    # Points, as a logarithmic axis has no zero for a bar to begin at.
    for symbol, colour, label, when in (
        ("D", BEFORE, "without", "before"),
        ("o", AFTER, "with", "after"),
    ):
        costs = [effect["held_out"][when] for effect in effects]
        axes.plot(range(len(effects)), costs, symbol, color=colour, label=label)
    axes.set_xticks(range(len(effects)), [e["name"] for e in effects], rotation=20, ha="right")
    axes.set_xlim(-0.5, len(effects) - 0.5)
    axes.grid(axis="y", which="both", linewidth=0.3)
    axes.set_yscale("log")
    axes.legend(fontsize=8)
