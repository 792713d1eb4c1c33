"""``cdprcal check``: what is wrong with this log, before anyone fits it."""

from __future__ import annotations

import typer

from cdprcal.cli.common import (
    DONE,
    UNTRUSTED,
    JsonOption,
    LogArgument,
    RobotArgument,
    SegmentOption,
    print_json,
    reports_errors,
)

EXAMPLE = "Example: cdprcal check irma4 run.csv"


@reports_errors
def command(
    robot: RobotArgument, log: LogArgument, segment: SegmentOption = -1, json: JsonOption = False
) -> None:
    """Say what is wrong with a log: where, how bad, and what to do.

    Thresholds come from the robot file's sigma and limits, from physics and from the data's own
    noise. Exit code 1: the log cannot be trusted.
    """
    from cdprcal._core import load_robot
    from cdprcal.check import check_file

    report = check_file(load_robot(robot), log, segment)
    if json:
        print_json(report.as_dict())
    else:
        from cdprcal.tables import print_check

        print_check(report.as_dict(), report.findings)
    raise typer.Exit(DONE if report.trusted else UNTRUSTED)
