"""Pictures of a demonstration: tensions over time, the way of the platform, each method's error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal.demo.story import Row, Run
from cdprcal.pictures import new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_TRUE, _FOUND, _REST, _PULLEY = "#7f7f7f", "#c44e52", "#dfe8f5", "#333333"


def write_pictures(robot: _core.Robot, run: Run, rows: list[Row], folder: Path) -> list[Path]:
    """Writes tensions.png, path.png and methods.png; gives back their paths. Raises InputError."""
    figures = {
        "tensions.png": draw_tensions(robot, run),
        "path.png": draw_path(robot, run, rows[-1]),
        "methods.png": draw_methods(rows),
    }
    for name, figure in figures.items():
        save_figure(figure, folder / name)
    return [folder / name for name in figures]


def draw_tensions(robot: _core.Robot, run: Run) -> Figure:
    """Measured tensions and set-points, as paper Fig. 5; shaded: rests that were measured."""
    figure = new_figure(10.0, 4.2)
    axes = figure.subplots()
    for rest in run.acquired.rests:
        axes.axvspan(rest.begin_s, rest.end_s, color=_REST, zorder=0)
    time_s = run.log.time_s
    for cable in range(robot.cable_count):
        axes.plot(time_s, run.log.tension_N[:, cable], linewidth=0.9, label=f"cable {cable + 1}")
    for cable in range(robot.cable_count):
        axes.plot(
            time_s,
            run.log.tension_setpoint_N[:, cable],
            color="black",
            linewidth=0.7,
            label="set-points" if cable == 0 else None,
        )
    axes.set_xlabel("time [s]")
    axes.set_ylabel("tension [N]")
    axes.set_xlim(time_s[0], time_s[-1])
    axes.set_title(
        f"{robot.name}: tensions during the start-up (shaded: at rest, measured)", fontsize=10
    )
    axes.legend(fontsize=8, ncols=robot.cable_count + 1, loc="upper left")
    axes.set_ylim(0.0, 1.18 * float(np.nanmax(run.log.tension_N)))
    return figure


def draw_path(robot: _core.Robot, run: Run, row: Row) -> Figure:
    """Where the platform truly went, and where the calibration says it was at each measurement."""
    figure = new_figure(10.0, 4.6)
    above, side = figure.subplots(1, 2)
    truth = np.array([pose.position_m for pose in run.truth])
    found = np.array([pose.position_m for pose in row.calibration.result.poses])
    pulleys = np.array([cable.pulley.position_m for cable in robot.cables])
    for axes, (i, j) in ((above, (0, 1)), (side, (0, 2))):
        _draw_view(axes, truth, found, pulleys, i, j)
    above.set_title("from above", fontsize=10)
    side.set_title("from the side", fontsize=10)
    handles, labels = above.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8)
    error = "" if row.error is None else f": initial pose {1e3 * row.error.position_m:.2f} mm off"
    figure.suptitle(f"{robot.name}, calibrated by {row.label}{error}", fontsize=11)
    return figure


def _draw_view(axes: Axes, truth: Array, found: Array, pulleys: Array, i: int, j: int) -> None:
    axes.plot(truth[:, i], truth[:, j], color=_TRUE, linewidth=1.0, label="true path")
    if len(found):
        axes.plot(found[1:, i], found[1:, j], ".", color=_FOUND, markersize=4, label="found")
        axes.plot(
            found[0, i], found[0, j], "*", color=_FOUND, markersize=13, label="found, initial pose"
        )
    axes.plot(
        truth[0, i],
        truth[0, j],
        "o",
        color="black",
        markersize=9,
        fillstyle="none",
        label="true initial pose",
    )
    axes.plot(pulleys[:, i], pulleys[:, j], "s", color=_PULLEY, markersize=5, label="pulleys")
    axes.set_aspect("equal", "datalim")
    axes.set_xlabel(f"{'xyz'[i]} [m]")
    axes.set_ylabel(f"{'xyz'[j]} [m]")
    axes.grid(linewidth=0.3)


def draw_methods(rows: list[Row]) -> Figure:
    """Errors of the initial pose, method by method."""
    figure = new_figure(9.0, 3.4)
    position, rotation = figure.subplots(1, 2, sharey=True)
    labels = [row.label for row in rows]
    places = np.arange(len(rows))
    errors = [row.error for row in rows]
    position.barh(places, [1e3 * e.position_m if e else np.nan for e in errors], color=_FOUND)
    position.set_xlabel("position error [mm]")
    for shift, colour, label, values in (
        (-0.2, _FOUND, "geodesic", [e.rotation_rad if e else np.nan for e in errors]),
        (0.2, _TRUE, "eq. 20", [e.angle_difference_rad if e else np.nan for e in errors]),
    ):
        rotation.barh(places + shift, np.rad2deg(values), 0.4, color=colour, label=label)
    rotation.set_xlabel("rotation error [deg]")
    rotation.legend(fontsize=8)
    position.set_yticks(places, labels)
    position.invert_yaxis()
    figure.suptitle("error of the initial pose", fontsize=10)
    return figure
