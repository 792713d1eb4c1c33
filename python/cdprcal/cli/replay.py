"""``cdprcal replay``: a log on the live page, as if it were running."""

from __future__ import annotations

from typing import Annotated

import typer

from cdprcal.cli.live import PortOption, serve
from cdprcal.command import LogArgument, load_robot, reports_errors

EXAMPLE = "Example: cdprcal replay run.csv --speed 10"


@reports_errors
def command(
    log: LogArgument,
    robot: Annotated[
        str,
        typer.Option(
            "--robot",
            metavar="ROBOT",
            help="Whose tension limits to show (default: the one in an acquired log).",
        ),
    ] = "",
    speed: Annotated[
        float, typer.Option(min=0.0, help="Seconds of the log per second; 0: all at once.")
    ] = 1.0,
    port: PortOption = 0,
) -> None:
    """Show a log on the live page, from its beginning for every page that is opened.

    Only this computer can open the page. Ctrl-C ends the command.
    """
    from cdprcal import _core
    from cdprcal.io import load_log, read_inputs
    from cdprcal.live import LiveServer, places_of, replay_messages
    from cdprcal.tables import print_findings

    file = load_log(log)
    print_findings(file.findings)
    held = read_inputs(log)
    the_robot = None
    if robot:
        the_robot = load_robot(robot)
    elif held is not None:
        the_robot = _core.parse_robot(held.robot_yaml, f"{log}: robot")
    setpoints = None
    if held is not None:
        setpoints = 1 + _core.parse_plan(held.plan_csv, f"{log}: plan").measured_count
    places = {} if the_robot is None else places_of(file.log, the_robot)
    with LiveServer(
        lambda: replay_messages(file, the_robot, setpoints, places=places, speed=speed), port=port
    ) as server:
        serve(server)
