"""``cdprcal explore``: effects switched on and off on a page, everything fitted again at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdprcal.cli.live import PortOption, serve
from cdprcal.command import (
    ForceOption,
    MapOption,
    RobotArgument,
    keep_apart,
    keep_existing,
    load_robot,
    reports_errors,
)

EXAMPLE = "Example: cdprcal explore irma4 run.csv -o explored.yaml"


@reports_errors
def command(
    robot: RobotArgument,
    logs: Annotated[
        list[str],
        typer.Argument(metavar="LOG…", help="As for diagnose; two are laid over each other."),
    ],
    output: Annotated[
        str,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Where the page saves the corrected robot file (default: your downloads).",
        ),
    ] = "",
    map_: MapOption = "",
    force: ForceOption = False,
    port: PortOption = 0,
) -> None:
    """Switch effects on and off on a page, leave poses out, watch residuals, pose and evidence.

    The page begins with what diagnose finds; every number on it is from the same fit as diagnose's.
    Only this computer can open it. Ctrl-C ends the command.
    """
    from cdprcal.explore import Exploration, ExploreServer
    from cdprcal.mapping import Reader
    from cdprcal.tables import print_findings

    keep_apart({"-o": output}, {"robot file": robot, "log": logs, "mapping file": map_})
    keep_existing({"robot file": output}, force=force)
    the_robot = load_robot(robot)
    files = Reader(the_robot, map_).load_all(logs)
    for file in files:
        print_findings(file.findings)
    exploration = Exploration(the_robot, [file.log for file in files])
    names = [file.path.name for file in files]
    with ExploreServer(
        exploration, names, output=Path(output) if output else None, port=port
    ) as server:
        serve(server)
