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
from cdprcal.diagnosis.units import GAP_CHANNELS
from cdprcal.report.subject import Run, Subject

Figure = dict[str, Any]

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
INK, MUTED, RULE, REST = "#1f2933", "#6b7785", "#e3e7eb", "#eef2f6"
BEFORE, AFTER, RIVAL = "#D55E00", "#0072B2", "#E69F00"
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


#: Rows of the residuals: channel of the gap, key of a residual, its columns (none: by cable).
_RESIDUALS: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("length_m", "length_m", ()),
    ("swivel_rad", "swivel_rad", ()),
    ("tension_N", "tension_N", ()),
    ("roll_pitch_rad", "roll_pitch_yaw_rad", ("roll", "pitch", "yaw")),
    ("absolute_yaw_rad", "absolute_yaw_rad", ("yaw",)),
    ("direct_length_m", "direct_length_m", ()),
    ("position_m", "position_m", ("x", "y", "z")),
)


def _parts(residual: dict[str, Any], key: str, columns: int) -> list[float | None]:
    """A channel's residuals; None where nothing was read."""
    value = residual.get(key)
    if value is None:
        return [None] * columns
    return list(value) if isinstance(value, list) else [value]


def residuals(subject: Subject) -> Figure | None:
    """What the model leaves of each reading, by channel and cable; None without a fit."""
    series = _residual_series(subject)
    if not series:
        return None
    columns = max(subject.robot.cable_count, 3)
    rows = [
        row
        for row in _RESIDUALS
        if any(v is not None for residual in series[0][3] for v in _parts(residual, row[1], 0))
    ]
    data: list[dict[str, Any]] = []
    axes: dict[str, Any] = {}
    notes: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    number = 0
    for r, (channel, key, picked) in enumerate(rows):
        name, unit, factor = GAP_CHANNELS[channel]
        name = "attitude" if channel == "roll_pitch_rad" else name
        titles = picked or [f"cable {i + 1}" for i in range(subject.robot.cable_count)]
        everything = [
            abs(v)
            for _, _, _, table in series
            for res in table
            for v in _parts(res, key, 0)
            if v is not None
        ]
        limit = 1.15 * factor * max([*everything, 1e-12])
        sigma = _ripple(subject, channel)
        height = 1.0 / len(rows)
        top = 1.0 - r * height
        for column, title in enumerate(titles):
            number += 1
            suffix = "" if number == 1 else str(number)
            x_key, y_key = f"x{suffix}", f"y{suffix}"
            for label, colour, symbol, table in series:
                data.append(
                    {
                        "type": "scatter",
                        "x": rounded([res["run_time_s"] for res in table], 2),
                        "y": rounded(
                            [
                                _scaled(_parts(res, key, len(titles))[column], factor)
                                for res in table
                            ]
                        ),
                        "mode": "markers",
                        "name": label,
                        "legendgroup": label,
                        "showlegend": number == 1,
                        "marker": {"color": colour, "symbol": symbol, "size": 5},
                        "hovertemplate": f"%{{y:.3g}} {unit} at %{{x:.1f}} s<extra></extra>",
                        "xaxis": x_key,
                        "yaxis": y_key,
                    }
                )
            width = 1.0 / columns
            axes[f"xaxis{suffix}"] = axis(
                "time [s]" if r == len(rows) - 1 else "",
                domain=[column * width + 0.015, (column + 1) * width - 0.015],
                anchor=y_key,
                nticks=4,
            )
            axes[f"yaxis{suffix}"] = axis(
                f"{name} [{unit}]" if column == 0 else "",
                domain=[top - height + 0.05, top - 0.035],
                anchor=x_key,
                range=[-limit, limit],
                showticklabels=column == 0,
                nticks=5,
                zeroline=True,
                zerolinecolor="#9aa5b1",
            )
            if sigma:
                shapes.append(_band(x_key, y_key, sigma * factor))
            notes.append(
                {
                    "text": title,
                    "x": 0.5,
                    "xref": f"{x_key} domain",
                    "y": 1.0,
                    "yref": f"{y_key} domain",
                    "yanchor": "bottom",
                    "showarrow": False,
                    "font": {"size": 11, "color": MUTED},
                }
            )
    figure_layout = layout(60 + 175 * len(rows), annotations=notes, shapes=shapes, **axes)
    figure_layout["legend"]["y"] = 1.01
    return {"data": data, "layout": figure_layout}


def _band(x_key: str, y_key: str, half_width: float) -> dict[str, Any]:
    return {
        "type": "rect",
        "xref": f"{x_key} domain",
        "yref": y_key,
        "x0": 0,
        "x1": 1,
        "y0": -half_width,
        "y1": half_width,
        "fillcolor": "#e4eaf1",
        "line": {"width": 0},
        "layer": "below",
    }


def _residual_series(
    subject: Subject,
) -> list[tuple[str, str, str, list[dict[str, Any]]]]:
    """(label, colour, symbol, residuals); one of the calibration when there was no diagnosis."""
    if subject.diagnosis is not None:
        both = subject.diagnosis["residuals"]
        if not subject.diagnosis["effects"]:
            return [("model as given", AFTER, "circle", both["before"])]
        return [
            ("model as given", BEFORE, "circle-open", both["before"]),
            ("with what was found", AFTER, "diamond", both["after"]),
        ]
    run = subject.runs[0]
    begin_s = run.calibration["reference_time_s"]
    table = [
        {"run_time_s": pose["time_s"] - begin_s} | pose["residuals"]
        for pose in run.calibration["poses"]
        if pose["residuals"] is not None
    ]
    return [("calibration", AFTER, "circle", table)] if table else []


def _ripple(subject: Subject, channel: str) -> float | None:
    if subject.diagnosis is None:
        return None
    level: float | None = subject.diagnosis["ripple"].get(channel)
    return level


def staircase(diagnosis: dict[str, Any]) -> Figure:
    """The gap, channel by channel: before any effect and after each, fitted and held out."""
    gap = diagnosis["gap"]
    steps = list(dict.fromkeys(g["after_effect"] for g in gap))
    channels = [c for c in GAP_CHANNELS if any(g["channel"] == c for g in gap)]
    labels = [first_step(diagnosis), *(f"+ {step}" for step in steps if step)]
    data: list[dict[str, Any]] = []
    axes: dict[str, Any] = {}
    notes: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    width = 1.0 / len(channels)
    for i, channel in enumerate(channels):
        name, unit, factor = GAP_CHANNELS[channel]
        suffix = "" if i == 0 else str(i + 1)
        rows = {g["after_effect"]: g for g in gap if g["channel"] == channel}
        for key, label, colour, dash, symbol in (
            ("held_out_rms", "held out", BEFORE, "dash", "diamond"),
            ("train_rms", "fitted", AFTER, "solid", "circle"),
        ):
            heights = [_scaled(rows[s][key], factor) if s in rows else math.nan for s in steps]
            # A step reaches from half before to half after its place; its ends have no symbol.
            ends = [heights[0], *heights, heights[-1]]
            data.append(
                {
                    "type": "scatter",
                    "x": [-0.5, *range(len(steps)), len(steps) - 0.5],
                    "y": rounded(ends),
                    "text": ["", *labels, ""],
                    "mode": "lines+markers",
                    "name": label,
                    "legendgroup": label,
                    "showlegend": i == 0,
                    "line": {"color": colour, "width": 2, "dash": dash, "shape": "hvh"},
                    "marker": {
                        "color": colour,
                        "symbol": symbol,
                        "size": [0, *(8 for _ in steps), 0],
                        "opacity": 1,
                    },
                    "hovertemplate": f"%{{text}}: %{{y:.3g}} {unit} {label}<extra></extra>",
                    "xaxis": f"x{suffix}",
                    "yaxis": f"y{suffix}",
                }
            )
        ripple = diagnosis["ripple"].get(channel)
        if ripple:
            shapes.append(_ripple_line(suffix, ripple * factor))
        axes[f"xaxis{suffix}"] = axis(
            domain=[i * width + 0.02, (i + 1) * width - 0.02],
            anchor=f"y{suffix}",
            tickvals=list(range(len(steps))),
            ticktext=labels,
            tickangle=-40,
            showgrid=False,
            range=[-0.55, max(len(steps), 2) - 0.45],
        )
        axes[f"yaxis{suffix}"] = axis(rangemode="tozero", anchor=f"x{suffix}", nticks=6)
        notes.append(
            {
                "text": f"{name} [{unit}]",
                "x": 0,
                "xref": f"x{suffix} domain",
                "y": 1.0,
                "yref": f"y{suffix} domain",
                "xanchor": "left",
                "yanchor": "bottom",
                "showarrow": False,
                "font": {"size": 12, "color": INK},
            }
        )
    figure_layout = layout(400, annotations=notes, shapes=shapes, **axes)
    figure_layout["margin"] = {"l": 44, "r": 12, "t": 64, "b": 120}
    figure_layout["legend"]["y"] = 1.1
    return {"data": data, "layout": figure_layout}


def first_step(diagnosis: dict[str, Any]) -> str:
    """What the gap is that the staircase begins with: faults like signs are set right by then."""
    faults = any(effect["p_value"] is None for effect in diagnosis["effects"])
    return "faults set right" if faults else "as given"


def _ripple_line(suffix: str, height: float) -> dict[str, Any]:
    return {
        "type": "line",
        "xref": f"x{suffix} domain",
        "yref": f"y{suffix}",
        "x0": 0,
        "x1": 1,
        "y0": height,
        "y1": height,
        "line": {"color": INK, "width": 1, "dash": "dot"},
    }


def ranking(diagnosis: dict[str, Any], most: int = 12) -> Figure | None:
    """Evidence of the effects that would explain the gap best, before any was accepted."""
    scores = [s for s in diagnosis["ranking"] if s["log_evidence"] is not None][:most]
    if not scores:
        return None
    accepted = {effect["name"] for effect in diagnosis["effects"]}
    rivals = {rival for effect in diagnosis["effects"] for rival in effect["rivals"]}
    kinds = (
        ("accepted", AFTER, ""),
        ("rival: cannot be told apart", RIVAL, "/"),
        ("other", "#b8c0c8", ""),
    )
    data = []
    for kind, (label, colour, pattern) in enumerate(kinds):
        own = [s for s in scores if _kind(s["name"], accepted, rivals) == kind]
        if own:
            data.append(
                {
                    "type": "bar",
                    "orientation": "h",
                    "y": [s["name"] for s in own],
                    "x": [_symlog(s["log_evidence"]) for s in own],
                    "text": [f"{s['log_evidence']:.1f}" for s in own],
                    "textposition": "outside",
                    "cliponaxis": False,
                    "name": label,
                    "marker": {"color": colour, "pattern": {"shape": pattern, "fgcolor": "#fff"}},
                    "hovertemplate": "%{y}: %{text} nat<extra></extra>",
                }
            )
    values = [s["log_evidence"] for s in scores]
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
            categoryorder="array", categoryarray=[s["name"] for s in reversed(scores)], ticks=""
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


def _kind(name: str, accepted: set[str], rivals: set[str]) -> int:
    return 0 if name in accepted else 1 if name in rivals else 2


def _symlog(value: float) -> float:
    """Linear around zero, logarithmic beyond."""
    return math.copysign(math.log10(1.0 + abs(value)), value)


def _scaled(value: float | None, factor: float) -> float:
    return math.nan if value is None else value * factor
