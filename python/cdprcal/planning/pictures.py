"""A picture of a measurement plan: where the platform goes, and the tensions that take it there."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal.pictures import draw_box, new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_WAY, _STOP, _VIA, _START, _BOX, _PULLEY = (
    "#4c72b0", "#c44e52", "#8c8c8c", "#55a868", "#dd8452", "#333333",
)  # fmt: skip
_MOST_NUMBERS = 40


def write_plan_picture(robot: _core.Robot, result: _core.PlanResult, path: Path) -> None:
    """Writes draw_plan(robot, result). Raises InputError when the file cannot be written."""
    save_figure(draw_plan(robot, result), path)


def draw_plan(robot: _core.Robot, result: _core.PlanResult) -> Figure:
    """From above, from the side, and the tension set-points over time."""
    figure = new_figure(11.0, 8.0)
    parts = figure.subfigures(2, 1, height_ratios=(1.35, 1.0), squeeze=False)
    upper, lower = parts.ravel()
    above, side = upper.subplots(1, 2)
    stops = _merged_stops(result.plan)
    ways = _ways(robot, result.plan)
    _draw_view(above, robot, result, stops, ways, (0, 1))
    _draw_view(side, robot, result, stops, ways, (0, 2))
    above.set_title("from above", fontsize=10)
    side.set_title("from the side", fontsize=10)
    handles, labels = above.get_legend_handles_labels()
    upper.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8)
    _draw_tensions(lower.subplots(), robot, result.plan)
    minutes = result.plan.duration_s / 60.0
    figure.suptitle(
        f"{robot.name}: {result.plan.measured_count} measured poses in {minutes:.1f} min"
        f"{_sigma(result)}",
        fontsize=11,
    )
    return figure


def _sigma(result: _core.PlanResult) -> str:
    deviation = result.plan.predicted_standard_deviation
    if not np.isfinite(deviation).all():
        return ""
    position = 1e3 * float(np.linalg.norm(deviation[:3]))
    rotation = float(np.rad2deg(np.linalg.norm(deviation[3:])))
    return f"; initial pose to {position:.1f} mm and {rotation:.2f}° (1 σ)"


def _merged_stops(plan: _core.Plan) -> list[tuple[Array, bool, str]]:
    """(position, measured, visit numbers) of each place, several visits in one label."""
    places: dict[tuple[float, ...], tuple[Array, bool, list[int]]] = {}
    for number, stop in enumerate(plan.poses, start=1):
        position = stop.pose.position_m
        key = tuple(np.round(position, 6).tolist())
        _, measured, numbers = places.get(key, (position, False, []))
        places[key] = (position, measured or stop.measured, [*numbers, number])
    return [
        (position, measured, ",".join(map(str, numbers)))
        for position, measured, numbers in places.values()
    ]


def _ways(robot: _core.Robot, plan: _core.Plan) -> list[Array]:
    """The platform's quasi-static path from stop to stop [m, 3], as the tensions change."""
    known = _core.KnownEffects(robot)
    stops = [_core.SetPoint(plan.start_pose, plan.start_tension_N)]
    stops += [_core.SetPoint(stop.pose, stop.tension_N) for stop in plan.poses]
    ways = []
    for before, after in itertools.pairwise(map(known.as_planned, stops)):
        if before is not None and after is not None:
            path = _core.follow_path(known.robot, before, after)
            ways.append(np.array([point.pose.position_m for point in path.points]))
    return ways


def _draw_view(
    axes: Axes,
    robot: _core.Robot,
    result: _core.PlanResult,
    stops: list[tuple[Array, bool, str]],
    ways: list[Array],
    plane: tuple[int, int],
) -> None:
    """Projection on two world axes."""
    i, j = plane
    pulleys = np.array([cable.pulley.position_m for cable in robot.cables])
    axes.plot(pulleys[:, i], pulleys[:, j], "s", color=_PULLEY, markersize=5, label="pulleys")
    draw_box(axes, result.box, i, j, edgecolor=_BOX, linestyle="--", label="box")
    for k, way in enumerate(ways):
        axes.plot(
            way[:, i],
            way[:, j],
            color=_WAY,
            linewidth=1.0,
            alpha=0.7,
            label="way of the platform" if k == 0 else None,
        )
    for colour, wanted, label in ((_STOP, True, "measured"), (_VIA, False, "on the way")):
        chosen = np.array([position for position, measured, _ in stops if measured == wanted])
        if len(chosen):
            axes.plot(chosen[:, i], chosen[:, j], "o", color=colour, markersize=5, label=label)
    start = result.plan.start_pose.position_m
    axes.plot(start[i], start[j], "*", color=_START, markersize=11, label="start")
    _number_stops(axes, stops, plane)
    axes.set_xlabel(f"{'xyz'[i]} [m]", fontsize=9)
    axes.set_ylabel(f"{'xyz'[j]} [m]", fontsize=9)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(linewidth=0.3)
    axes.tick_params(labelsize=8)


def _number_stops(axes: Axes, stops: list[tuple[Array, bool, str]], plane: tuple[int, int]) -> None:
    """Visit numbers; places behind one another in this view share a label, on the outer side."""
    i, j = plane
    middle = np.mean([position for position, *_ in stops], axis=0)
    shared: dict[tuple[float, float], list[str]] = {}
    for position, _, numbers in stops:
        shared.setdefault((round(position[i], 2), round(position[j], 2)), []).append(numbers)
    if sum(len(numbers) for numbers in shared.values()) > _MOST_NUMBERS:
        return
    for at, visits in shared.items():
        text = " · ".join(visits)
        if len(text) <= 24:
            right, up = at[0] >= middle[i], at[1] >= middle[j]
            axes.annotate(
                text,
                at,
                textcoords="offset points",
                xytext=(5 if right else -5, 5 if up else -5),
                ha="left" if right else "right",
                va="bottom" if up else "top",
                fontsize=7,
                # Ways and stops under it would be read as part of it.
                bbox={"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 0.6},
            )


def _draw_tensions(axes: Axes, robot: _core.Robot, plan: _core.Plan) -> None:
    """Set-points over time: fifth-degree transitions, rests shaded where something is measured."""
    time, tension = 0.0, plan.start_tension_N
    times: list[float] = [0.0, plan.start_dwell_s]
    rows = [tension, tension]
    time = plan.start_dwell_s
    x = np.linspace(0.0, 1.0, 21)[1:]
    share = x**3 * (10.0 + x * (-15.0 + 6.0 * x))
    for stop in plan.poses:
        times += (time + x * stop.transition_s).tolist()
        rows += [tension + s * (stop.tension_N - tension) for s in share]
        time += stop.transition_s
        if stop.measured:
            axes.axvspan(time, time + stop.dwell_s, color="#eeeeee", linewidth=0)
        time, tension = time + stop.dwell_s, stop.tension_N
        times.append(time)
        rows.append(tension)
    table = np.array(rows)
    for cable in range(table.shape[1]):
        axes.plot(times, table[:, cable], color=f"C{cable}", label=f"cable {cable + 1}")
    low, high = robot.tension_limits_N
    span = float(table.max() - table.min()) + 1.0
    for limit in (low, high):
        if table.min() - span < limit < table.max() + span:
            axes.axhline(limit, color="black", linestyle=":", linewidth=0.9)
    axes.set_xlim(0.0, time)
    axes.set_xlabel(
        "time [s]; grey: rest, the platform is measured; dotted: tension limit", fontsize=9
    )
    axes.set_ylabel("tension set-point [N]", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.legend(fontsize=8, ncols=table.shape[1], loc="lower right", bbox_to_anchor=(1.0, 1.0))
