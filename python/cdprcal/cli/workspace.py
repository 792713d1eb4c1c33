"""``cdprcal workspace``: where the platform can hang."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from cdprcal.command import (
    DONE,
    INTERRUPTED,
    UNTRUSTED,
    ForceOption,
    JsonOption,
    RobotArgument,
    fail,
    interruptible,
    keep_apart,
    keep_existing,
    load_robot,
    print_json,
    reports_errors,
)
from cdprcal.completion import one_of
from cdprcal.option_values import (
    DistributionOption,
    LambdaOption,
    OrientationOption,
    ThreadsOption,
    parse_box,
    parse_lambda,
    parse_orientation,
    parse_position,
)

if TYPE_CHECKING:
    from cdprcal import _core

EXAMPLE = "Example: cdprcal workspace irma4 -o mesh.ply --plot workspace.png"


@reports_errors
def command(
    robot: RobotArgument,
    output: Annotated[
        str,
        typer.Option("-o", "--output", metavar="FILE", help="Write the mesh: .ply, or .stl."),
    ] = "",
    box: Annotated[
        str,
        typer.Option(
            "--box",
            metavar="X,Y,Z:X,Y,Z",
            help="Where to search: two opposite corners [m], for example "
            "-0.4,-0.4,0.6:0.4,0.4,1.2 (default: below and between the pulleys).",
        ),
    ] = "",
    step_m: Annotated[
        float | None,
        typer.Option(
            "--step-m", help="Between the grid's points [m] (default: 80,000 points in the box)."
        ),
    ] = None,
    alpha_m2: Annotated[
        float | None,
        typer.Option(
            "--alpha-m2",
            help="Squared radius of the alpha shape [m²] (default: the least that leaves one piece "
            "with all points in it).",
        ),
    ] = None,
    stability: Annotated[
        str,
        one_of(
            "locked-lengths|constant-tensions",
            help="What must hold the platform still: the winches' brakes (eq. A4), or tension "
            "control, which demands more.",
        ),
    ] = "locked-lengths",
    distribution: DistributionOption = "barycentre",
    lambda_: LambdaOption = "",
    orientation: OrientationOption = "",
    seed: Annotated[
        list[str] | None,
        typer.Option(
            "--from",
            metavar="X,Y,Z",
            help="Search outward from here only (default: from all over the box); may be repeated.",
        ),
    ] = None,
    section: Annotated[
        list[float] | None,
        typer.Option("--section-m", metavar="Z", help="Cut at this height; may be repeated."),
    ] = None,
    probe: Annotated[
        list[str] | None,
        typer.Option(
            "--probe",
            metavar="X,Y,Z",
            help="Tensions, stiffness and margin to the limits at a point; may be repeated.",
        ),
    ] = None,
    ascii_: Annotated[
        bool, typer.Option("--ascii", help="Write the mesh as text, not binary.")
    ] = False,
    threads: ThreadsOption = 0,
    plot: Annotated[
        str, typer.Option("--plot", metavar="FILE", help="Draw the workspace (PNG, PDF or SVG).")
    ] = "",
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Find the static workspace: where the platform hangs stably within the tension limits.

    Searches outward on a grid, then draws the alpha shape around what was found. Ctrl-C ends the
    search and keeps what was found until then (exit code 1). From six cables on it is where one
    orientation is wrench-feasible within the limits. Geometry and mass are those with the
    effects that the robot file lists; forces and sensor errors do not count here.
    """
    from cdprcal import _core
    from cdprcal.io.files import atomic_output
    from cdprcal.terminal import notes, progress_bar, say
    from cdprcal.workspace import round_step_m, workspace_as_dict
    from cdprcal.workspace.table import print_workspace

    keep_apart({"-o": output, "--plot": plot}, {"robot file": robot})
    the_robot = load_robot(robot)
    the_box = parse_box("--box", box) or _core.workspace_box(the_robot)
    seeds = [parse_position("--from", text) for text in seed or []]
    probes = [parse_position("--probe", text) for text in probe or []]
    keep_existing({"mesh": output, "picture": plot}, force=force)
    the_distribution = _core.parse_tension_distribution(distribution)
    lambda_N = parse_lambda(the_distribution, lambda_)
    with progress_bar() as show:

        def progress(done: _core.WorkspaceProgress) -> None:
            show(f"{done.inside} points inside", done.tested / done.total)

        workspace = _core.compute_workspace(
            the_robot,
            box=the_box,
            step_m=round_step_m(the_box, 80_000) if step_m is None else step_m,
            distribution=the_distribution,
            lambda_N=lambda_N,
            stability=_stability(stability),
            rotation=parse_orientation(the_robot, orientation),
            seeds_m=seeds or None,
            threads=threads,
            progress=progress,
        )
    if not workspace.points_inside:
        _nothing(workspace)
    out = notes()
    if not workspace.complete:
        say(out, "interrupted: going on with what was found; Ctrl-C again ends at once")
    with interruptible(), out.status("drawing the boundary"):
        shape = _core.workspace_shape(workspace, alpha_m2)
    document = workspace_as_dict(workspace, shape, heights_m=section, probes_m=probes)
    if plot:
        from cdprcal.workspace.pictures import write_workspace_picture

        write_workspace_picture(workspace, shape, Path(plot))
    if output:
        encoding = _core.MeshEncoding.ascii if ascii_ else _core.MeshEncoding.binary
        with atomic_output(Path(output)) as temporary:
            try:
                _core.write_mesh(str(temporary), shape.mesh, encoding)
            except _core.InputError as error:  # says the temporary's name
                why = str(error).rsplit(": ", 1)[-1]
                raise _core.InputError(f"{output}: {why}") from None
    if json:
        print_json(document)
    else:
        print_workspace(document)
    for path in filter(None, (output, plot)):
        say(out, path)
    raise typer.Exit(DONE if workspace.complete else UNTRUSTED)


def _stability(name: str) -> _core.StabilityNotion:
    from cdprcal._core import InputError, StabilityNotion

    names = {notion.name.replace("_", "-"): notion for notion in StabilityNotion}
    if name not in names:
        raise InputError(f"--stability: {name!r} is not one of {', '.join(names)}")
    return names[name]


def _nothing(workspace: _core.Workspace) -> NoReturn:
    """Ends the command: there is no workspace to draw."""
    from cdprcal._core import explain_empty

    if not workspace.complete:
        fail("interrupted", INTERRUPTED)
    fail(f"{workspace.robot.name}: {explain_empty(workspace)}")
