"""``cdprcal plan``: which poses to measure, in which order, at which tensions and how fast."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdprcal.command import (
    EffectsOption,
    ForceOption,
    JsonOption,
    RobotArgument,
    VerboseOption,
    fail,
    keep_apart,
    keep_existing,
    print_json,
    reports_errors,
    robot_with_effects,
)
from cdprcal.completion import one_of
from cdprcal.option_values import (
    DEFAULT_GRID,
    DistributionOption,
    LambdaOption,
    OrientationOption,
    ThreadsOption,
    parse_box,
    parse_grid,
    parse_lambda,
    parse_orientation,
    parse_position,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cdprcal import _core

EXAMPLE = "Example: cdprcal plan irma4 --order random -o plan.csv --plot plan.png"


@reports_errors
def command(
    robot: RobotArgument,
    output: Annotated[
        str, typer.Option("-o", "--output", metavar="FILE", help="Write the plan (CSV).")
    ] = "",
    grid: Annotated[
        str,
        typer.Option(
            "--grid",
            metavar="NXxNYxNZ",
            help="Positions along each side of the box.",
            show_default=DEFAULT_GRID,
        ),
    ] = "",
    box: Annotated[
        str,
        typer.Option(
            "--box",
            metavar="X,Y,Z:X,Y,Z",
            help="Where to measure: two opposite corners [m], for example "
            "-0.4,-0.4,0.6:0.4,0.4,1.2 (default: the largest that is safe; that of eq. 19 for "
            "irma4).",
        ),
    ] = "",
    optimal: Annotated[
        int,
        typer.Option(
            "--optimal",
            min=0,
            help="Instead of the grid, this many poses chosen by what they say about the initial "
            "pose (D-optimal), from all over the workspace unless --box is given; and how many "
            "poses of the grid they are worth.",
        ),
    ] = 0,
    position: Annotated[
        list[str] | None,
        typer.Option("--position", metavar="X,Y,Z", help="Instead of the grid; may be repeated."),
    ] = None,
    home: Annotated[
        str,
        typer.Option("--home", metavar="X,Y,Z", help="Where the run starts (default: mid box)."),
    ] = "",
    order: Annotated[
        str,
        one_of(
            "least-time|random",
            help="random: each pose several times, shuffled, so that drifts and creep look like no "
            "pose and friction shows in both directions; diagnose wants it (default: least-time; "
            "random with --visits, --seed or --for).",
        ),
    ] = "",
    visits: Annotated[
        int | None, typer.Option(min=1, help="Of each pose, in random order (default: 2).")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Of the random order (default: 1).")
    ] = None,
    distribution: DistributionOption = "barycentre",
    lambda_: LambdaOption = "",
    orientation: OrientationOption = "",
    margin: Annotated[
        float | None,
        typer.Option(
            "--margin-n",
            help="Least distance of tensions from their limits [N] (default: one sigma).",
        ),
    ] = None,
    bounds: Annotated[
        str,
        typer.Option(
            "--bounds",
            metavar="X,Y,Z:X,Y,Z",
            help="What the platform may not leave, on the way either (default: the pulleys' box).",
        ),
    ] = "",
    speed: Annotated[
        float, typer.Option("--speed-m-s", help="Peak speed of the platform and of any cable.")
    ] = 0.5,
    damping: Annotated[
        float, typer.Option("--damping", help="Damping ratio of the platform's swings.")
    ] = 0.1,
    threads: ThreadsOption = 0,
    plot: Annotated[
        str, typer.Option("--plot", metavar="FILE", help="Draw the plan (PNG, PDF or SVG).")
    ] = "",
    diagnose: Annotated[
        bool,
        typer.Option(
            "--diagnose",
            help="Also say which effects this run would show, from what size, and which it would "
            "tell apart.",
        ),
    ] = False,
    show: Annotated[
        str,
        typer.Option(
            "--for",
            metavar="EFFECT,…",
            help="With --diagnose: add places where these effects show at smaller sizes or look "
            "less like others, each visited several times in random order.",
        ),
    ] = "",
    effects: EffectsOption = None,
    verbose: VerboseOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Plan a start-up run: measurement poses, tension set-points, order and times.

    Every set-point is a stable equilibrium with a margin to the tension limits, and every
    transition is followed to see that the platform stays inside; times come from the platform's own
    natural frequencies. From six cables on lengths lead the platform, in one orientation, and
    tensions are chosen within the limits. Effects that the robot file lists are taken into account:
    set-points are what its load cells will read, poses are where its platform will rest.
    """
    from cdprcal import _core
    from cdprcal.io.files import write_text
    from cdprcal.io.replacing import signed
    from cdprcal.planning import plan_as_dict
    from cdprcal.planning.table import print_plan
    from cdprcal.terminal import notes, progress_bar, say

    keep_apart({"-o": output, "--plot": plot}, {"robot file": robot, "--effects": effects or []})
    keep_existing({"plan": output, "picture": plot}, force=force)
    shuffled = {"--visits": visits is not None, "--seed": seed is not None, "--for": bool(show)}
    order = order or ("random" if any(shuffled.values()) else "least-time")
    the_order = _core.parse_visiting_order(order)
    if the_order != _core.VisitingOrder.random:
        for option in (option for option, given in shuffled.items() if given):
            fail(f"{option} is for a random order: leave out --order {order}")
    if not 0.0 < speed < math.inf:
        fail(f"--speed-m-s: {speed:g} is no speed; give metres per second above 0")
    if not 0.0 < damping < 1.0:
        fail(f"--damping: {damping:g} is no damping ratio; give one above 0 and below 1")
    if grid and position:
        fail("--position says where to measure: leave out --grid")
    the_robot = robot_with_effects(robot, effects)
    the_distribution = _core.parse_tension_distribution(distribution)
    options: dict[str, Any] = {
        "box": parse_box("--box", box),
        "grid": parse_grid(grid or DEFAULT_GRID),
        "optimal": optimal,
        "positions_m": [parse_position("--position", text) for text in position or []] or None,
        "home_m": parse_position("--home", home) if home else None,
        "order": the_order,
        "visits": 2 if visits is None else visits,
        "seed": 1 if seed is None else seed,
        "set_points": _core.SetPointOptions(
            distribution=the_distribution,
            lambda_N=parse_lambda(the_distribution, lambda_),
            tension_margin_N=margin,
            rotation=parse_orientation(the_robot, orientation),
        ),
        "bounds": parse_box("--bounds", bounds),
        "timing": _core.TimingOptions(
            max_platform_speed_m_s=speed, max_cable_speed_m_s=speed, damping_ratio=damping
        ),
        "threads": threads,
    }
    if optimal and position:
        fail("--optimal chooses the poses itself: leave out --position")
    if show and not diagnose:
        fail("--for says what --diagnose shall show: give both")
    if show and optimal:
        fail("--for adds places to a grid or to --position: leave out --optimal")
    asked = [name.strip() for name in show.split(",") if name.strip()]
    with progress_bar() as shown:
        result = _core.make_plan(the_robot, progress=shown, **options)
    if result.status != _core.PlanStatus.planned:
        fail(
            f"{the_robot.name}: no plan: {result.reason}; try another --grid or --box, "
            "cdprcal workspace shows where"
        )
    without = result.plan
    added: list[NDArray[np.float64]] = []
    if asked:
        result, added = _with_more(the_robot, result, asked, options)
    document = plan_as_dict(the_robot, result)
    if result.comparison is not None:
        document["comparison"]["chosen_from"] = "the box" if box else "the static workspace"
    if diagnose:
        from cdprcal.diagnosis.foresight import foresight_as_dict, print_foresight, with_added

        document["diagnose"] = foresight_as_dict(the_robot, result.plan)
        if asked:
            document["diagnose"] = with_added(
                document["diagnose"], the_robot, without, asked, added
            )
    if plot:
        from cdprcal.planning.pictures import write_plan_picture

        write_plan_picture(the_robot, result, Path(plot))
    if output:
        write_text(Path(output), signed(_core.format_plan(result.plan)))
    if json:
        print_json(document)
    else:
        print_plan(document, verbose=verbose)
        if diagnose:
            print_foresight(document["diagnose"], the_robot)
    out = notes()
    for path in filter(None, (output, plot)):
        say(out, path)


def _with_more(
    robot: _core.Robot, result: _core.PlanResult, asked: list[str], options: dict[str, Any]
) -> tuple[_core.PlanResult, list[NDArray[np.float64]]]:
    """A plan with places besides where these effects show; the given one where none can be had."""
    import numpy as np

    from cdprcal import _core
    from cdprcal.diagnosis.foresight import positions_that_show
    from cdprcal.terminal import progress_bar

    with progress_bar() as shown:
        more = positions_that_show(robot, result.plan, result.box, asked, progress=shown)
    places = [np.asarray(stop.pose.position_m) for stop in result.plan.poses if stop.measured]
    kept = [p for k, p in enumerate(places) if not any(np.allclose(p, q) for q in places[:k])]
    while more:
        wider = options | {
            "positions_m": [*kept, *more],
            "home_m": result.plan.start_pose.position_m,
        }
        with progress_bar() as shown:
            found = _core.make_plan(robot, progress=shown, **wider)
        if found.status == _core.PlanStatus.planned:
            return found, more
        more = more[:-1]  # a place that cannot be reached safely
    return result, []
