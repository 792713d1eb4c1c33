"""``cdprcal generate``: a synthetic log of a robot, with known truth."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdprcal.cli.plan_file import plan_of
from cdprcal.command import (
    ForceOption,
    LogOutputOption,
    RobotArgument,
    fail,
    keep_apart,
    keep_existing,
    load_robot,
    reports_errors,
)
from cdprcal.option_values import DEFAULT_GRID, parse_grid, parse_sensors

if TYPE_CHECKING:
    from cdprcal import _core

EXAMPLE = "Example: cdprcal generate irma4 --grid 3x3x3 -o run.csv --truth truth.json"


@reports_errors
def command(
    robot: RobotArgument,
    output: LogOutputOption,
    grid: Annotated[
        str,
        typer.Option(
            metavar="NXxNYxNZ",
            help="Equilibria to visit, in a grid around the middle of the frame.",
            show_default=DEFAULT_GRID,
        ),
    ] = "",
    plan: Annotated[
        str,
        typer.Option(
            metavar="PLAN",
            help="Instead of the grid, what a plan file (CSV) of cdprcal plan goes through, its "
            "start first.",
        ),
    ] = "",
    noise: Annotated[
        float, typer.Option(min=0.0, help="Noise of the readings, in the robot's own sigma.")
    ] = 0.1,
    rate_hz: Annotated[float, typer.Option("--rate-hz", help="Samples per second.")] = 10.0,
    dwell_s: Annotated[float, typer.Option("--dwell-s", help="Rest at each pose.")] = 5.0,
    move_s: Annotated[float, typer.Option("--move-s", help="Motion between two poses.")] = 5.0,
    sensors: Annotated[
        str,
        typer.Option(
            metavar="LIST",
            help="What the robot has: lengths, swivels, tensions, attitude; absolute-yaw, "
            "direct-lengths, position, specific-force, angular-velocity.",
        ),
    ] = "lengths,swivels,tensions,attitude",
    seed: Annotated[int, typer.Option(min=0, help="Of noise and offsets.")] = 1,
    truth: Annotated[
        str,
        typer.Option(metavar="FILE", help="Also write the true pose of every sample, as JSON."),
    ] = "",
    force: ForceOption = False,
) -> None:
    """Generate the log of a start-up run: quasi-static, with unknown offsets and noise.

    It obeys the estimator's own model: for trying things out, not for judging the model.
    """
    from cdprcal import _core
    from cdprcal.io import save_log
    from cdprcal.io.files import write_text
    from cdprcal.io.log_file import is_mcap_name
    from cdprcal.planning.start_up import stops_of
    from cdprcal.results import truth_text
    from cdprcal.terminal import answers, counted, say

    for option, value in (("--rate-hz", rate_hz), ("--dwell-s", dwell_s)):
        if not 0.0 < value < math.inf:
            fail(f"{option}: must be above 0; give another")
    if plan and grid:
        fail("--plan says where to go: leave out --grid")
    keep_apart({"-o": output, "--truth": truth}, {"robot file": robot, "plan": plan})
    is_mcap_name(Path(output))
    keep_existing({"log": output, "truth": truth}, force=force)
    the_robot = load_robot(robot)
    options = _core.SyntheticLogOptions(
        dwell_s=dwell_s,
        move_s=move_s,
        rate_Hz=rate_hz,
        noise=_core.reading_noise(the_robot.sigma, noise, absolute=True),
        seed=seed,
    )
    setpoints, poses = (
        stops_of(plan_of(the_robot, plan)[0])
        if plan
        else _core.default_stops(the_robot, *parse_grid(grid or DEFAULT_GRID))
    )
    groups = parse_sensors(sensors)
    held = _core.holds_orientation(the_robot)
    made = _core.synthetic_log(the_robot, setpoints, options, poses if held else [])
    save_log(with_sensors(made.log, groups), output)
    if truth:
        truly = zip(made.log.time_s.tolist(), made.poses, strict=True)
        write_text(Path(truth), truth_text(the_robot, truly))
    say(
        answers(),
        f"{output}: {len(made.log)} samples, "
        f"{counted(len(setpoints), 'equilibrium', 'equilibria')}, "
        f"{made.log.time_s[-1]:g} s",
    )
    for time_s, pose in zip(made.log.time_s.tolist(), made.poses, strict=True):
        if found := _core.obstruction(the_robot, pose):
            typer.echo(
                f"cdprcal: note: at {time_s:g} s something is in the way that the log does not "
                f"know of: {found}; what cdprcal plan writes keeps clear of it: give it with "
                "--plan",
                err=True,
            )
            break


def with_sensors(log: _core.Log, groups: set[str]) -> _core.Log:
    """The log of a robot that has these sensors only (set-points are kept)."""
    from cdprcal import _core

    kept = {group: getattr(log, group) for group in (*groups, "tension_setpoint_N")}
    return _core.Log(time_s=log.time_s, source=log.source, **kept)
