"""``python -m cdprcal.studies``: Monte Carlo, workspace families and plan sweeps as tables."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from cdprcal.command import DONE, UNTRUSTED, RobotArgument, reports_errors
from cdprcal.option_values import parse_grid, parse_numbers, parse_sensors

app = typer.Typer(
    help="The same calculation many times over, on all cores or on a Dask cluster. A table (CSV) "
    "on stdout or in a file, SI units.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

Output = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="FILE", help="CSV; else stdout.")
]
Jobs = Annotated[int, typer.Option("--jobs", min=0, help="Processes; 0: one a core.")]
Dask = Annotated[
    str,
    typer.Option(
        "--dask",
        metavar="ADDRESS",
        help="A Dask scheduler (tcp://…) instead, or 'local' for one that is started here.",
    ),
]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="NAME=V1,V2,…",
        help="A value of the robot file, for example platform.mass_kg=10,12,14 or "
        "cables.*.pulley.radius_m=0,0.03 (cables count from 1); may be repeated: all combinations.",
    ),
]


@app.command(
    "start-ups",
    epilog="Example: python -m cdprcal.studies start-ups irma4 --count 200 --noise 0.2 -o rows.csv",
)
@reports_errors
def start_ups_command(
    robot: RobotArgument,
    count: Annotated[int, typer.Option("--count", min=1, help="Start-ups.")] = 100,
    first_seed: Annotated[int, typer.Option("--first-seed", min=0)] = 1,
    noise: Annotated[float, typer.Option("--noise", help="Of the robot file's sigma.")] = 1.0,
    sensors: Annotated[
        str, typer.Option(metavar="LIST", help="What the robot has, as generate's.")
    ] = "lengths,swivels,tensions,attitude",
    jobs: Jobs = 0,
    dask: Dask = "",
    output: Output = None,
) -> None:
    """Simulated start-ups of eight poses, calibrated and held against their truth."""
    from cdprcal import _core
    from cdprcal.studies import Workers, coverage, start_ups

    seeds = range(first_seed, first_seed + count)
    rows = start_ups(
        _core.load_robot(robot),
        seeds,
        sensors=sorted(parse_sensors(sensors)),
        noise=noise,
        workers=Workers(jobs, dask),
    )
    axes = ("x_m", "y_m", "z_m", "about_x_rad", "about_y_rad", "about_z_rad")
    _write(
        output,
        [
            {
                "seed": row.seed,
                "status": row.status,
                "position_error_m": row.position_error_m,
                "rotation_error_rad": row.rotation_error_rad,
                "mahalanobis": row.mahalanobis,
                **{f"error_{a}": v for a, v in zip(axes, row.twist_error, strict=True)},
                **{f"sigma_{a}": v for a, v in zip(axes, row.standard_deviation, strict=True)},
            }
            for row in rows
        ],
    )
    converged = sum(row.status == "converged" for row in rows)
    inside = coverage(rows)
    honest = "" if math.isnan(inside) else f"; 95 % regions cover {100 * inside:.0f} %"
    typer.echo(f"{converged} of {count} converged{honest}", err=True)
    raise typer.Exit(DONE if converged else UNTRUSTED)


@app.command(
    "workspaces",
    epilog="Example: python -m cdprcal.studies workspaces irma4 --vary platform.mass_kg=5,10,15",
)
@reports_errors
def workspaces_command(
    robot: RobotArgument,
    vary: Vary = None,
    step_m: Annotated[float, typer.Option("--step-m", help="Between grid points [m].")] = 0.05,
    jobs: Jobs = 0,
    dask: Dask = "",
    output: Output = None,
) -> None:
    """The static workspace of every variant of a robot: volume and largest box inside."""
    from cdprcal import _core
    from cdprcal.studies import Workers, workspaces

    rows = workspaces(
        _core.load_robot(robot), _values(vary), step_m=step_m, workers=Workers(jobs, dask)
    )
    ends = ("lower_x_m", "lower_y_m", "lower_z_m", "upper_x_m", "upper_y_m", "upper_z_m")
    nowhere = (math.nan,) * 6
    _write(
        output,
        [
            {
                **row.changes,
                "points_inside": row.points_inside,
                "volume_m3": row.volume_m3,
                **dict(
                    zip(
                        (f"box_{end}" for end in ends),
                        nowhere if row.box is None else row.box[0] + row.box[1],
                        strict=True,
                    )
                ),
            }
            for row in rows
        ],
    )
    raise typer.Exit(DONE if any(row.points_inside for row in rows) else UNTRUSTED)


@app.command(
    "plans",
    epilog="Example: python -m cdprcal.studies plans irma4 --vary platform.mass_kg=10,15 "
    "--vary gravity_m_s2=9.81,1.62",
)
@reports_errors
def plans_command(
    robot: RobotArgument,
    vary: Vary = None,
    grid: Annotated[
        str, typer.Option("--grid", metavar="NXxNYxNZ", help="Positions of each plan.")
    ] = "2x2x2",
    jobs: Jobs = 0,
    dask: Dask = "",
    output: Output = None,
) -> None:
    """The measurement plan of every variant of a robot: duration and predicted accuracy."""
    from cdprcal import _core
    from cdprcal.studies import Workers, plans

    rows = plans(
        _core.load_robot(robot), _values(vary), workers=Workers(jobs, dask), grid=parse_grid(grid)
    )
    _write(
        output,
        [
            {
                **row.changes,
                "status": row.status,
                "poses": row.poses,
                "duration_s": row.duration_s,
                "position_sigma_m": row.position_sigma_m,
                "rotation_sigma_rad": row.rotation_sigma_rad,
                "reason": row.reason,
            }
            for row in rows
        ],
    )
    raise typer.Exit(DONE if any(row.status == "planned" for row in rows) else UNTRUSTED)


def _values(vary: Sequence[str] | None) -> dict[str, list[float]]:
    """NAME=V1,V2,… of each --vary. Raises InputError naming the one that is none."""
    from cdprcal._core import InputError

    values: dict[str, list[float]] = {}
    for text in vary or []:
        name, found, numbers = text.partition("=")
        if not found or not name or not numbers:
            raise InputError(f"--vary {text}: give NAME=V1,V2,…, for example platform.mass_kg=5,10")
        if name in values:
            raise InputError(f"--vary {name}: given twice; name all its values at once")
        values[name] = [float(v) for v in parse_numbers(f"--vary {name}", numbers)]
    return values


def _write(output: Path | None, rows: Sequence[dict[str, Any]]) -> None:
    """One line a row; a number that is not there is an empty cell."""
    from cdprcal.io.files import write_text

    text = io.StringIO()
    table = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    table.writeheader()
    for row in rows:
        table.writerow(
            {k: "" if isinstance(v, float) and math.isnan(v) else v for k, v in row.items()}
        )
    if output is None:
        typer.echo(text.getvalue(), nl=False)
    else:
        write_text(output, text.getvalue())


if __name__ == "__main__":
    app()
