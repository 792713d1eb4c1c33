"""Figures of a report as plotly's own JSON: what they share, timelines, residuals, staircase.

Colours are those of Okabe and Ito, which colour-blind people tell apart; nothing is said by colour
alone: symbols, line styles or labels say it too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.diagnosis.plots import (
    AFTER,
    CABLES,
    KINDS,
    RIVAL,
    Fit,
    fits,
    gap_panels,
    gap_steps,
    ranked,
    residual_panels,
)
from cdprcal.diagnosis.units import shown_word
from cdprcal.report.subject import Run, Subject

Figure = dict[str, Any]

INK, MUTED, RULE, REST = "#1f2933", "#6b7785", "#e3e7eb", "#eef2f6"
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
_AXIS: dict[str, Any] = {
    "gridcolor": RULE,
    "zeroline": False,
    "linecolor": "#b8c0c8",
    "ticks": "outside",
    "ticklen": 4,
    "tickcolor": "#b8c0c8",
    "title": {"font": {"size": 12, "color": MUTED}, "standoff": 8},
}
_MOST_SAMPLES = 4000


def layout(height: int, **more: Any) -> dict[str, Any]:
    """The layout that all figures begin with."""
    return {
        "height": height,
        "margin": {"l": 62, "r": 24, "t": 28, "b": 48},
        "font": {"family": FONT, "size": 12, "color": INK},
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "hovermode": "closest",
        "hoverlabel": {"font": {"family": FONT, "size": 12}},
        "legend": {"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom", "font": {"size": 12}},
        **more,
    }


def axis(title: str = "", **more: Any) -> dict[str, Any]:
    """An axis with a title."""
    return {**_AXIS, "title": {**_AXIS["title"], "text": title}, **more}


def rounded(values: Any, digits: int = 5) -> list[Any]:
    """Numbers as plotly takes them: few digits, None for what is absent."""
    array = np.asarray(values, dtype=float)
    return [round(v, digits) if math.isfinite(v) else None for v in array.ravel().tolist()]


def timelines(robot: _core.Robot, run: Run) -> Figure:
    """Tensions and set-points; position; attitude: over the log's time, rests shaded."""
    log, document = run.log, run.best
    data: list[dict[str, Any]] = []
    step = max(1, len(log) // _MOST_SAMPLES)
    time_s = rounded(log.time_s[::step], 3)
    has_tension = log.tension_N.shape[1] > 0
    for cable in range(robot.cable_count if has_tension else 0):
        label = f"cable {cable + 1}"
        data.append(
            {
                "type": "scatter",
                "x": time_s,
                "y": rounded(log.tension_N[::step, cable], 2),
                "mode": "lines",
                "name": label,
                "legendgroup": label,
                "line": {"color": CABLES[cable % 8], "width": 1.3},
                "hovertemplate": f"{label}: %{{y:.1f}} N at %{{x:.1f}} s<extra></extra>",
                "yaxis": "y",
            }
        )
    for cable in range(robot.cable_count if log.tension_setpoint_N.shape[1] else 0):
        data.append(
            {
                "type": "scatter",
                "x": time_s,
                "y": rounded(log.tension_setpoint_N[::step, cable], 2),
                "mode": "lines",
                "name": "set-points",
                "legendgroup": "set-points",
                "showlegend": cable == 0,
                "line": {"color": INK, "width": 0.9, "dash": "dot"},
                "hovertemplate": f"set-point {cable + 1}: %{{y:.1f}} N<extra></extra>",
                "yaxis": "y",
            }
        )
    poses = document["poses"]
    convention = robot.euler_convention
    angles = _angles(poses, convention)
    for i, (name, colour, dash, symbol) in enumerate(
        zip("xyz", CABLES, ("solid", "dash", "dot"), ("circle", "square", "diamond"), strict=False)
    ):
        style = (colour, dash, symbol)
        data.append(_pose_line(poses, [p["position_m"][i] for p in poses], name, "m", "y2", style))
        turned = np.rad2deg(angles[:, i]).tolist()
        name = ("roll", "pitch", "yaw")[i]
        data.append(_pose_line(poses, turned, name, "°", "y3", style))
    y3 = [0.0, 0.29] if has_tension else [0.0, 0.46]
    y2 = [0.34, 0.63] if has_tension else [0.54, 1.0]
    labels = []
    if has_tension:
        ends = [_last(log.tension_N[:, c]) for c in range(robot.cable_count)]
        span = float(np.nanmax(log.tension_N, initial=1.0)) / 0.32
        names = [str(c + 1) for c in range(robot.cable_count)]
        labels += _end_labels(ends, names, "y", span)
    if poses:
        positions = np.array([pose["position_m"] for pose in poses])
        labels += _end_labels(positions[-1].tolist(), ["x", "y", "z"], "y2", _span(positions))
        degrees = np.rad2deg(angles)
        labels += _end_labels(degrees[-1].tolist(), ["roll", "pitch", "yaw"], "y3", _span(degrees))
    figure_layout = layout(
        760 if has_tension else 560,
        xaxis=axis("time in the log [s]", anchor="y3", range=_run_range(log, document)),
        yaxis=axis("tension [N]", domain=[0.68, 1.0], visible=has_tension, rangemode="tozero"),
        yaxis2=axis("position [m]", domain=y2),
        yaxis3=axis("attitude [°]", domain=y3),
        shapes=[
            {
                "type": "rect",
                "xref": "x",
                "yref": "paper",
                "x0": rest["begin_s"],
                "x1": rest["end_s"],
                "y0": 0,
                "y1": 1,
                "fillcolor": REST,
                "line": {"width": 0},
                "layer": "below",
            }
            for rest in document["equilibria"]
        ]
        + (_limits(robot, log) if has_tension else []),
        annotations=labels,
    )
    figure_layout["margin"] = {**figure_layout["margin"], "r": 52}
    return {"data": data, "layout": figure_layout}


def _angles(poses: Sequence[dict[str, Any]], convention: _core.EulerConvention) -> Any:
    """Roll, pitch, yaw [k, 3] [rad] without jumps by whole turns."""
    angles = [_core.euler_from_rotation(pose["rotation"], convention) for pose in poses]
    return np.unwrap(np.array(angles).reshape(-1, 3), axis=0)


def _run_range(log: _core.Log, document: dict[str, Any]) -> list[float]:
    """The run itself; what was logged before it is a zoom away."""
    end_s = float(log.time_s[-1])
    begin_s = document["reference_time_s"] if document["poses"] else float(log.time_s[0])
    margin_s = 0.015 * (end_s - begin_s)
    return [begin_s - margin_s, end_s + margin_s]


def _limits(robot: _core.Robot, log: _core.Log) -> list[dict[str, Any]]:
    """Lines at the tension limits that the run comes near."""
    highest = float(np.nanmax(log.tension_N, initial=0.0))
    return [
        {
            "type": "line",
            "xref": "paper",
            "yref": "y",
            "x0": 0,
            "x1": 1,
            "y0": limit,
            "y1": limit,
            "line": {"color": MUTED, "width": 1, "dash": "longdash"},
            "label": {
                "text": f"limit {limit:g} N",
                "textposition": "start",
                "font": {"size": 11, "color": MUTED},
            },
        }
        for limit in robot.tension_limits_N
        if limit <= 1.1 * highest
    ]


def _last(values: Any) -> float:
    finite = np.asarray(values)[np.isfinite(values)]
    return float(finite[-1]) if finite.size else math.nan


def _span(values: Any) -> float:
    """What the whole figure's height would be in the units of a panel of 0.29 of it."""
    return float(max(np.ptp(values), 1e-9)) * 1.1 / 0.29


def _end_labels(
    values: Sequence[float], names: Sequence[str], y_axis: str, span: float
) -> list[dict[str, Any]]:
    """Each line ends in its name, moved apart where they would lie on each other."""
    least = 0.021 * span
    places: list[float] = []
    labels = []
    order = [i for i in np.argsort(values).tolist() if math.isfinite(values[i])]
    for i in order:
        places.append(max(values[i], places[-1] + least) if places else values[i])
    shift = np.mean([values[i] for i in order]) - np.mean(places) if order else 0.0
    for i, place in zip(order, places, strict=True):
        labels.append(
            {
                "x": 1.0,
                "xref": "paper",
                "y": place + float(shift),
                "yref": y_axis,
                "text": f"<b>{names[i]}</b>",
                "showarrow": False,
                "xanchor": "left",
                "xshift": 4,
                "font": {"color": CABLES[i % 8], "size": 12},
            }
        )
    return labels


def _pose_line(
    poses: Sequence[dict[str, Any]],
    values: Sequence[float],
    name: str,
    unit: str,
    y_axis: str,
    style: tuple[str, str, str],
) -> dict[str, Any]:
    colour, dash, symbol = style
    static = [pose["kind"] == "static" for pose in poses]
    return {
        "type": "scatter",
        "x": rounded([pose["time_s"] for pose in poses], 3),
        "y": rounded(values),
        "mode": "lines+markers",
        "name": name,
        "showlegend": False,
        "line": {"color": colour, "width": 1, "dash": dash},
        "marker": {
            "color": colour,
            "symbol": [symbol if rests else f"{symbol}-open" for rests in static],
            "size": [8 if rests else 4 for rests in static],
        },
        "hovertemplate": f"{name}: %{{y:.4f}} {unit} at %{{x:.1f}} s<extra></extra>",
        "yaxis": y_axis,
    }


def residuals(subject: Subject) -> Figure | None:
    """What the model leaves of each reading, by channel and cable; None without a fit."""
    shown = _fits(subject)
    ripple = {} if subject.diagnosis is None else subject.diagnosis["ripple"]
    panels = residual_panels(shown, ripple) if shown else []
    if not panels:
        return None
    rows = 1 + max(panel.row for panel in panels)
    limit = [1.15 * max(p.largest for p in panels if p.row == row) or 1e-9 for row in range(rows)]
    height, width = 1.0 / rows, 1.0 / (1 + max(panel.column for panel in panels))
    figure_layout = layout(60 + 175 * rows)
    margin = figure_layout["margin"]
    pixel = 1.0 / (figure_layout["height"] - margin["t"] - margin["b"])
    data: list[dict[str, Any]] = []
    axes: dict[str, Any] = {}
    notes: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    for number, panel in enumerate(panels):
        suffix = str(number + 1) if number else ""
        x_key, y_key = f"x{suffix}", f"y{suffix}"
        for series in panel.series:
            data.append(
                {
                    "type": "scatter",
                    "x": rounded(series.x, 2),
                    "y": rounded(series.y),
                    "mode": "markers",
                    "name": series.label,
                    "legendgroup": series.label,
                    "showlegend": number == 0,
                    "marker": {"color": series.colour, "symbol": series.symbol, "size": 5},
                    "hovertemplate": f"%{{y:.3g}} {panel.unit} at %{{x:.1f}} s<extra></extra>",
                    "xaxis": x_key,
                    "yaxis": y_key,
                }
            )
        left, top = panel.column * width, 1.0 - panel.row * height
        axes[f"xaxis{suffix}"] = axis(
            "time [s]" if panel.row == rows - 1 else "",
            domain=[left + 0.015, left + width - 0.015],
            anchor=y_key,
            nticks=4,
        )
        axes[f"yaxis{suffix}"] = axis(
            "" if panel.column else panel.quantity,
            domain=[top - height + 26 * pixel, top - 22 * pixel],  # room for ticks and title
            anchor=x_key,
            range=[-limit[panel.row], limit[panel.row]],
            showticklabels=panel.column == 0,
            nticks=5,
            zeroline=True,
            zerolinecolor="#9aa5b1",
        )
        if panel.ripple:
            band = {"type": "rect", "fillcolor": "#e4eaf1", "line": {"width": 0}, "layer": "below"}
            shapes.append(band | _across(suffix, -panel.ripple, panel.ripple))
        notes.append(_title(suffix, panel.title, 11, MUTED, x=0.5))
    figure_layout |= {"annotations": notes, "shapes": shapes, **axes}
    return {"data": data, "layout": figure_layout}


def _across(suffix: str, low: float, high: float) -> dict[str, Any]:
    """Where a shape lies that reaches from side to side of a panel."""
    x, y = {"x0": 0, "x1": 1}, {"y0": low, "y1": high}
    return {"xref": f"x{suffix} domain", "yref": f"y{suffix}", **x, **y}


def _title(suffix: str, text: str, size: int, colour: str, **place: Any) -> dict[str, Any]:
    """What is written above a panel."""
    where = {"xref": f"x{suffix} domain", "yref": f"y{suffix} domain", "y": 1.0, **place}
    font = {"size": size, "color": colour}
    return {"text": text, "font": font, "yanchor": "bottom", "showarrow": False, **where}


def _fits(subject: Subject) -> list[Fit]:
    """Of the diagnosis; of the calibration when there was none."""
    if subject.diagnosis is not None:
        return fits(subject.diagnosis)
    run = subject.runs[0]
    begin_s = run.calibration["reference_time_s"]
    table = [
        {"run_time_s": pose["time_s"] - begin_s} | pose["residuals"]
        for pose in run.calibration["poses"]
        if pose["residuals"] is not None
    ]
    return [Fit("calibration", AFTER, "circle", table)] if table else []


def _short(step: str) -> str:
    """A step's name where there is little room: a formula's may be long."""
    most = 24
    return step if len(step) <= most else f"{step[: most - 1]}…"


def course(effect: dict[str, Any]) -> Figure:
    """A formula against the first of its variables, with what the readings say of it."""
    points = effect["course"]["points"]
    to, unit, factor = shown_word(effect["course"]["to"], [p["read"] for p in points])
    name, x_unit, x_factor = shown_word(effect["course"]["variable"], [p["x"] for p in points])
    data: list[dict[str, Any]] = []
    for cable in dict.fromkeys(point["cable"] for point in points):
        of = [p for p in points if p["cable"] == cable and p["x"] is not None]
        label = f"cable {cable}" if cable else to
        colour = CABLES[((cable or 1) - 1) % 8]
        # The law is known at these poses alone: between them it may swing.
        for key, symbol, size in (("read", "circle-open", 7), ("added", "circle", 3)):
            data.append(
                {
                    "type": "scatter",
                    "x": rounded([x_factor * p["x"] for p in of], 4),
                    "y": rounded([None if p[key] is None else factor * p[key] for p in of], 4),
                    "mode": "markers",
                    "name": label,
                    "legendgroup": label,
                    "showlegend": key == "read",
                    "marker": {"color": colour, "symbol": symbol, "size": size},
                    "hovertemplate": f"{label}: %{{y:.3g}} {unit} at %{{x:.3g}} {x_unit}"
                    "<extra></extra>",
                }
            )
    return {
        "data": data,
        "layout": layout(
            300,
            xaxis=axis(f"{name} [{x_unit}]"),
            yaxis=axis(f"{to}, read minus model [{unit}]", zeroline=True),
        ),
    }


def evidence(told: Sequence[dict[str, Any]]) -> Figure:
    """How the evidence for each effect grew while the run went on."""
    names = dict.fromkeys(effect["name"] for one in told for effect in one["effects"])
    symbols = ("circle", "diamond", "square", "cross", "triangle-up", "x")
    data: list[dict[str, Any]] = []
    for number, name in enumerate(names):
        nats = [
            next((e["log_evidence"] for e in one["effects"] if e["name"] == name), None)
            for one in told
        ]
        colour = CABLES[number % len(CABLES)]
        data.append(
            {
                "type": "scatter",
                "x": rounded([one["time_s"] for one in told], 2),
                "y": [None if n is None else round(n, 2) for n in nats],
                "mode": "lines+markers",
                "name": name,
                "line": {"color": colour},
                "marker": {"symbol": symbols[number % len(symbols)], "size": 8},
                "hovertemplate": f"{name}: %{{y:.1f}} nats at %{{x:.1f}} s<extra></extra>",
            }
        )
    return {
        "data": data,
        "layout": layout(
            280,
            xaxis=axis("time [s]"),
            yaxis=axis("evidence [nats]", rangemode="tozero"),
            showlegend=True,
        ),
    }


def staircase(diagnosis: dict[str, Any]) -> Figure:
    """The gap, channel by channel: before any effect and after each, fitted and held out."""
    steps, panels = gap_steps(diagnosis), gap_panels(diagnosis)
    data: list[dict[str, Any]] = []
    axes: dict[str, Any] = {}
    notes: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    width = 1.0 / len(panels)
    for i, panel in enumerate(panels):
        suffix = "" if i == 0 else str(i + 1)
        for series, dash in zip(panel.series, ("dash", "solid"), strict=True):
            # A step reaches from half before to half after its place; its ends have no symbol.
            data.append(
                {
                    "type": "scatter",
                    "x": [-0.5, *series.x, len(steps) - 0.5],
                    "y": rounded([series.y[0], *series.y, series.y[-1]]),
                    "text": ["", *steps, ""],
                    "mode": "lines+markers",
                    "name": series.label,
                    "legendgroup": series.label,
                    "showlegend": i == 0,
                    "line": {"color": series.colour, "width": 2, "dash": dash, "shape": "hvh"},
                    "marker": {
                        "color": series.colour,
                        "symbol": series.symbol,
                        "size": [0, *(8 for _ in steps), 0],
                        "opacity": 1,
                    },
                    "hovertemplate": f"%{{text}}: %{{y:.3g}} {panel.unit} {series.label}"
                    "<extra></extra>",
                    "xaxis": f"x{suffix}",
                    "yaxis": f"y{suffix}",
                }
            )
        if panel.ripple:
            line = {"type": "line", "line": {"color": INK, "width": 1, "dash": "dot"}}
            shapes.append(line | _across(suffix, panel.ripple, panel.ripple))
        axes[f"xaxis{suffix}"] = axis(
            domain=[i * width + 0.02, (i + 1) * width - 0.02],
            anchor=f"y{suffix}",
            tickvals=list(range(len(steps))),
            ticktext=[_short(step) for step in steps],
            tickangle=-40,
            showgrid=False,
            range=[-0.55, max(len(steps), 2) - 0.45],
        )
        axes[f"yaxis{suffix}"] = axis(rangemode="tozero", anchor=f"x{suffix}", nticks=6)
        notes.append(_title(suffix, panel.quantity, 12, INK, x=0, xanchor="left"))
    figure_layout = layout(400, annotations=notes, shapes=shapes, **axes)
    figure_layout["margin"] = {"l": 44, "r": 12, "t": 64, "b": 120}
    figure_layout["legend"]["y"] = 1.1
    return {"data": data, "layout": figure_layout}


def ranking(diagnosis: dict[str, Any], most: int = 12) -> Figure | None:
    """Evidence of the effects that would explain the gap best, before any was accepted."""
    scores = ranked(diagnosis, most)
    if not scores:
        return None
    data = []
    for label, colour in KINDS.items():
        own = [(name, evidence) for name, evidence, kind in scores if kind == label]
        # Plotly's own fill, "replace", has nothing but the white lines.
        hatch = {"shape": "/", "fgcolor": "#fff", "fillmode": "overlay"} if colour == RIVAL else {}
        if own:
            data.append(
                {
                    "type": "bar",
                    "orientation": "h",
                    "y": [name for name, _ in own],
                    "x": [_symlog(evidence) for _, evidence in own],
                    "text": [f"{evidence:.1f}" for _, evidence in own],
                    "textposition": "outside",
                    "cliponaxis": False,
                    "name": label,
                    "marker": {"color": colour, "pattern": hatch},
                    "hovertemplate": "%{y}: %{text} nat<extra></extra>",
                }
            )
    values = [evidence for _, evidence, _ in scores]
    ticks = [t for t in (-100, -10, -3, 0, 3, 10, 100, 1000, 10000) if min(values) <= t]
    ticks = [t for t in ticks if t <= 2 * max(*values, 3)]
    figure_layout = layout(
        110 + 24 * len(scores),
        barmode="overlay",
        bargap=0.35,
        xaxis=axis(
            "evidence for the effect [nat], logarithmic",
            tickvals=[_symlog(t) for t in ticks],
            ticktext=[str(t) for t in ticks],
        ),
        yaxis=axis(
            categoryorder="array", categoryarray=[name for name, *_ in reversed(scores)], ticks=""
        ),
        shapes=[
            {
                "type": "line",
                "xref": "x",
                "yref": "paper",
                "x0": _symlog(3),
                "x1": _symlog(3),
                "y0": 0,
                "y1": 1,
                "line": {"color": INK, "width": 1, "dash": "dot"},
            }
        ],
    )
    figure_layout["margin"] = {"l": 170, "r": 60, "t": 36, "b": 48}
    return {"data": data, "layout": figure_layout}


def _symlog(value: float) -> float:
    """Linear around zero, logarithmic beyond."""
    return math.copysign(math.log10(1.0 + abs(value)), value)
