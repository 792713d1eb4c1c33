"""``cdprcal export``: any log → ROS 2 bag."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from cdprcal.command import (
    DONE,
    LogArgument,
    RobotArgument,
    keep_apart,
    load_robot,
    reports_errors,
)

EXAMPLE = "Example: cdprcal export irma4 run.mcap -o bag && ros2 bag play bag"


@reports_errors
def command(
    robot: RobotArgument,
    log: LogArgument,
    output: Annotated[
        str, typer.Option("-o", "--output", metavar="FOLDER", help="The bag, a new folder.")
    ],
    session: Annotated[
        str,
        typer.Option(metavar="FILE", help="Its section ros2 names topics and joints."),
    ] = "",
    storage: Annotated[
        Literal["mcap", "sqlite3"], typer.Option(help="What the bag is made of.")
    ] = "mcap",
) -> None:
    """Turn a log into a ROS 2 bag: joint states, IMU, wrenches. ROS need not be installed."""
    from cdprcal.hardware.session import load_topics
    from cdprcal.io import load_run
    from cdprcal.ros2 import save_bag
    from cdprcal.terminal import answers, say

    keep_apart({"-o": output}, {})
    the_robot = load_robot(robot)
    file = load_run(log, the_robot)
    topics = load_topics(session).ros2 if session else None
    save_bag(file.log, output, the_robot.euler_convention, topics, storage=storage)
    say(answers(), f"{output}: {len(file.log)} samples of {file.log.cable_count} cables")
    raise typer.Exit(DONE)
