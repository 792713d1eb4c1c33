"""``cdprcal check``: what is wrong with this robot file or log, before anyone fits it."""

from __future__ import annotations

from typing import Annotated

import typer

from cdprcal.command import (
    DONE,
    UNTRUSTED,
    JsonOption,
    RobotArgument,
    SegmentOption,
    VerboseOption,
    print_json,
    reports_errors,
)

EXAMPLE = "Example: cdprcal check irma4 run.csv"


@reports_errors
def command(
    robot: RobotArgument,
    log: Annotated[
        str,
        typer.Argument(
            metavar="[LOG]",
            help="Canonical CSV, MCAP or raw robot log, told apart by content; without one the "
            "robot file itself is checked.",
        ),
    ] = "",
    segment: SegmentOption = -1,
    verbose: VerboseOption = False,
    json: JsonOption = False,
) -> None:
    """Say what is wrong with a robot file or a log: where, how bad, and what to do.

    Thresholds come from the robot file's sigma and limits, from physics and from the data's own
    noise. Exit code 1: it cannot be trusted.
    """
    from cdprcal._core import load_robot
    from cdprcal.check import check_file, check_robot
    from cdprcal.tables import print_check, print_robot_check

    the_robot = load_robot(robot)
    if not log:
        about = check_robot(the_robot)
        if json:
            print_json(about.as_dict())
        else:
            print_robot_check(about.as_dict(), about.findings)
        raise typer.Exit(DONE if about.trusted else UNTRUSTED)
    report = check_file(the_robot, log, segment)
    if json:
        print_json(report.as_dict())
    else:
        print_check(report.as_dict(), report.findings, verbose=verbose)
    raise typer.Exit(DONE if report.trusted else UNTRUSTED)
