"""What objects of the core look like to people, and what they become: text, frames, pictures.

The bindings call these functions for ``repr``, ``_repr_html_``, ``to_pandas``, ``plot`` and
pickles, so that a result is as useful in a notebook as on the command line.
"""

from __future__ import annotations

import html
import math
from collections.abc import Callable
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import (
    Calibration,
    Comparison,
    Diagnosis,
    InputError,
    Log,
    Plan,
    PlanResult,
    Track,
)
from cdprcal.diagnosis import diagnosis_as_dict
from cdprcal.diagnosis.plots import gap_panels, gap_steps
from cdprcal.diagnosis.table import headline, value_rows
from cdprcal.extras import need
from cdprcal.planning.table import promise
from cdprcal.results import calibration_as_dict
from cdprcal.sensors import LOG_GROUPS, MOST_CABLES, columns_of
from cdprcal.tables import pose_line
from cdprcal.tracking import columns_of_track

# Text.


@singledispatch
def text_of(result: object) -> str:
    """``repr``: what there is to know first, on a line."""
    raise TypeError(f"no text for {type(result).__name__}")


@text_of.register
def _(result: Calibration) -> str:
    document = _calibration(result)
    if result.result.status != _core.CalibrationStatus.converged:
        return f"<Calibration {document['status']}: {document['reason']}>"
    return f"<Calibration converged: {pose_line(document)}>"


@text_of.register
def _(result: Diagnosis) -> str:
    return f"<Diagnosis {headline(_diagnosis(result)).plain}>"


@text_of.register
def _(result: Comparison) -> str:
    moved = [f"{n.info.name}[{n.entry}]" for n in result.numbers if n.moved]
    return f"<Comparison of {len(result.logs)} logs: {', '.join(moved) or 'nothing'} moved>"


@text_of.register
def _(result: PlanResult) -> str:
    if result.status != _core.PlanStatus.planned:
        return f"<PlanResult {result.status.name}: {result.reason}>"
    plan = result.plan
    deviation = {
        "position_m": plan.predicted_standard_deviation[:3].tolist(),
        "rotation_rad": plan.predicted_standard_deviation[3:].tolist(),
    }
    said = promise(plan.measured_count, plan.duration_s, deviation)
    return f"<PlanResult {said.plain}>"


@text_of.register
def _(result: Track) -> str:
    time_s, trusted = result.time_s, result.trusted
    return (
        f"<Track of {len(result)} samples, {time_s[0]:.3f} to {time_s[-1]:.3f} s, "
        f"{int(trusted.sum())} to be trusted>"
    )


def html_of(result: Any) -> str:
    """``_repr_html_``: the text, and the frame as a table where pandas is there."""
    said = f"<p>{html.escape(repr(result).strip('<>'))}</p>"
    try:
        frame = frame_of(result)
    except InputError:
        return said
    table: str = frame.to_html(max_rows=12, float_format=lambda value: f"{value:.4g}", border=0)
    return said + table


def _calibration(result: Calibration) -> dict[str, Any]:
    return calibration_as_dict(result.problem.robot, result)


def _diagnosis(result: Diagnosis) -> dict[str, Any]:
    # It does not hold its logs; nothing here shows the ripple, for which they are asked.
    return diagnosis_as_dict(result, result.corrected)


# Frames.


def _pandas() -> Any:
    need("pandas")
    import pandas

    return pandas


@singledispatch
def frame_of(result: object) -> Any:
    """``to_pandas``: a data frame; columns have their units in their names."""
    raise TypeError(f"no frame for {type(result).__name__}")


@frame_of.register
def _(log: Log) -> Any:
    columns = {"time_s": np.array(log.time_s)}
    for field, group in LOG_GROUPS.items():
        values = getattr(log, field)
        for i, name in enumerate(columns_of(group, log.cable_count)[: values.shape[1]]):
            columns[name] = np.array(values[:, i])
    return _pandas().DataFrame(columns)


@frame_of.register
def _(result: Calibration) -> Any:
    convention = result.problem.robot.euler_convention
    found = result.result.poses
    rows = []
    for pose, read in zip(found, result.problem.measurements[: len(found)], strict=True):
        angles = np.degrees(_core.euler_from_rotation(pose.rotation, convention)).tolist()
        row = dict(zip(("x_m", "y_m", "z_m"), pose.position_m.tolist(), strict=True))
        row |= dict(zip(("roll_deg", "pitch_deg", "yaw_deg"), angles, strict=True))
        rows.append({"time_s": read.time_s, **row, "kind": str(read.kind)})
    return _pandas().DataFrame(rows)


@frame_of.register
def _(result: Diagnosis) -> Any:
    rows = []
    for effect in _diagnosis(result)["effects"]:
        for where, value, deviation, unit in value_rows(effect):
            rows.append(
                {
                    "effect": effect["name"],
                    "of": where,
                    "value": _number(value),
                    "sigma": _number(deviation),
                    "unit": unit,
                    "log_evidence": effect["log_evidence"],
                }
            )
    columns = ["effect", "of", "value", "sigma", "unit", "log_evidence"]
    return _pandas().DataFrame(rows, columns=columns)


def _number(text: str) -> float | str:
    try:
        return float(text) if text not in ("", "–") else math.nan
    except ValueError:  # the value of a fault is a word
        return text


@frame_of.register
def _(plan: Plan) -> Any:
    rows = []
    for stop in plan.poses:
        row = dict(zip(("x_m", "y_m", "z_m"), stop.pose.position_m.tolist(), strict=True))
        row |= {f"tension_{i + 1}_N": v for i, v in enumerate(stop.tension_N.tolist())}
        rows.append(row | {"transition_s": stop.transition_s, "dwell_s": stop.dwell_s,
                           "measured": stop.measured})  # fmt: skip
    return _pandas().DataFrame(rows)


@frame_of.register
def _(result: PlanResult) -> Any:
    return frame_of(result.plan)


@frame_of.register
def _(track: Track) -> Any:
    return _pandas().DataFrame(columns_of_track(track))


def log_of(frame: Any, source: str) -> Log:
    """``Log.from_dataframe``: columns as ``to_pandas`` names them, those that are there.

    Times may be dates (then seconds since the first) or durations. Raises InputError for a group of
    which a column is missing or misspelt, for text, and when there is no column of a log at all.
    """
    names = [str(name) for name in frame.columns]
    _refuse_misspelt(names, source)
    time_s = _seconds(frame["time_s"] if "time_s" in names else frame.index, source)
    arrays = {}
    for field, group in LOG_GROUPS.items():
        wanted = columns_of(group, MOST_CABLES)
        if group.is_per_cable:
            last = max((i for i, name in enumerate(wanted) if name in names), default=-1)
            wanted = wanted[: last + 1]
        there = [name for name in wanted if name in names]
        if there and len(there) < len(wanted):
            gone = next(name for name in wanted if name not in names)
            raise InputError(f"{source}: has {there[0]} but no {gone}; add it, NaN where unknown")
        if there:
            columns = [_numbers(frame[name], f"{source}: column {name}") for name in wanted]
            arrays[field] = np.column_stack(columns)
    if not arrays:
        raise InputError(
            f"{source}: has no column of a log but {', '.join(names[:20]) or 'none'}; name them "
            "time_s, length_1_m … (docs/your-log.md)"
        )
    return Log(time_s=time_s, source=source, **arrays)


def _refuse_misspelt(names: list[str], source: str) -> None:
    """A column that begins as one of a log, but is none, would be left out in silence."""
    known: dict[str, str] = {}  # a column → how it begins
    for group in LOG_GROUPS.values():
        for name in columns_of(group, MOST_CABLES):
            whole = name.startswith(f"{group.name}_")  # length_1_m, but roll_rad
            known[name] = f"{group.name if whole else name.partition('_')[0]}_"
    for name in names:
        like = [right for right, begin in known.items() if name.lower().startswith(begin)]
        if like and name not in known:
            raise InputError(
                f"{source}: column {name!r} is none of a log, but begins like one; name it as "
                f"{like[0]} is (cables count from 1), or leave it out"
            )


def _seconds(time: Any, source: str) -> NDArray[np.float64]:
    """Times as numbers; dates count from the first, durations from 0."""
    kind = getattr(time.dtype, "kind", "O")
    if kind == "M":
        dates = np.asarray(time, dtype="datetime64[ns]")
        return np.asarray((dates - dates[:1]) / np.timedelta64(1, "s"), dtype=float)
    if kind == "m":
        return np.asarray(
            np.asarray(time, dtype="timedelta64[ns]") / np.timedelta64(1, "s"), dtype=float
        )
    return _numbers(time, f"{source}: time_s")


def _numbers(column: Any, what: str) -> NDArray[np.float64]:
    """A column of pandas, whose values may be absent, or of anything like it."""
    try:
        if hasattr(column, "array"):
            column = column.to_numpy(dtype=float, na_value=np.nan)
        return np.asarray(column, dtype=float)
    except (TypeError, ValueError):
        raise InputError(
            f"{what}: holds what is no number; give numbers, NaN where unknown"
        ) from None


# Pictures.


def plot_of(result: Any, ax: Any) -> Any:
    """``plot``: into a matplotlib Axes, which is returned."""
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(layout="constrained").subplots()
    _drawn(result, ax)
    return ax


@singledispatch
def _drawn(result: object, ax: Any) -> None:
    raise TypeError(f"no picture of {type(result).__name__}")


@_drawn.register
def _(log: Log, ax: Any) -> None:
    """Tensions over time, or whatever else is read one a cable."""
    for field, group in sorted(LOG_GROUPS.items(), key=lambda item: item[1].name != "tension"):
        values = getattr(log, field)
        if group.is_per_cable and values.shape[1]:
            for i in range(values.shape[1]):
                ax.plot(log.time_s, values[:, i], label=f"cable {i + 1}")
            ax.set(xlabel="time [s]", ylabel=f"{group.name.replace('_', ' ')} [{group.unit}]")
            ax.legend()
            return


@_drawn.register
def _(result: Calibration, ax: Any) -> None:
    """The poses from above, the initial one marked."""
    points = np.array([pose.position_m for pose in result.result.poses]).reshape(-1, 3)
    ax.plot(points[:, 0], points[:, 1], "-o", markersize=3, linewidth=0.8, label="poses")
    ax.plot(points[:1, 0], points[:1, 1], "*", markersize=14, label="initial pose")
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    ax.legend()


@_drawn.register
def _(result: Diagnosis, ax: Any) -> None:
    """The gap on held-out poses, of every channel over what it was before."""
    document = _diagnosis(result)
    steps = gap_steps(document)
    for panel in gap_panels(document):
        held_out = next(iter(panel.series)).y
        first = held_out[0] if held_out else math.nan
        if first and math.isfinite(first):
            ax.plot(steps, [value / first for value in held_out], "-o", label=panel.quantity)
    ax.set(ylabel="gap on held-out poses, over that before", yscale="log")
    ax.tick_params(axis="x", rotation=30)
    ax.legend()


@_drawn.register
def _(plan: Plan, ax: Any) -> None:
    """The stops from above, in visiting order."""
    stops = [plan.start_pose, *(stop.pose for stop in plan.poses)]
    points = np.array([pose.position_m for pose in stops])
    ax.plot(points[:, 0], points[:, 1], "-o", markersize=4, linewidth=0.8)
    for i, point in enumerate(points):
        ax.annotate(str(i), (point[0], point[1]), textcoords="offset points", xytext=(4, 4))
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")


@_drawn.register
def _(track: Track, ax: Any) -> None:
    """The way from above, with gaps where it is not to be trusted."""
    points = np.where(track.trusted[:, None], track.position_m, np.nan)
    ax.plot(points[:, 0], points[:, 1], linewidth=0.8, label="P")
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    ax.legend()


# Pickles.


def reduced(result: Any) -> tuple[Callable[..., Any], tuple[Any, ...]]:
    """``__reduce__``: logs and plans as their numbers; results as what they are solved from.

    A result is solved again when it is unpickled: the same numbers, in milliseconds. Raises
    TypeError for a result of another maker than ``cdprcal.calibrate`` and ``cdprcal.diagnose``.
    """
    if isinstance(result, Log):
        arrays = {f: np.array(v) for f in LOG_GROUPS if (v := getattr(result, f)).shape[1]}
        return _log, ({"time_s": np.array(result.time_s), "source": result.source} | arrays,)
    if isinstance(result, Plan):
        return _core.parse_plan, (_core.format_plan(result), "pickled plan")
    recipe: tuple[Callable[..., Any], tuple[Any, ...]] | None = getattr(result, "_recipe", None)
    if recipe is None:
        kind = type(result).__name__
        raise TypeError(
            f"this {kind} holds no log to be solved again from: make it with "
            f"cdprcal.{'calibrate' if kind == 'Calibration' else 'diagnose'}, or pickle what "
            "you need of it"
        )
    return recipe


def _log(arrays: dict[str, Any]) -> Log:
    return Log(**arrays)
