"""``cdprcal import``: any log → canonical log."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdprcal.command import (
    DONE,
    UNTRUSTED,
    ForceOption,
    LogArgument,
    LogOutputOption,
    MapOption,
    fail,
    keep_apart,
    keep_existing,
    load_robot,
    reports_errors,
)

if TYPE_CHECKING:
    from cdprcal import _core
    from cdprcal.io import LogFile

EXAMPLE = (
    "Example: cdprcal import robot.log -o robot.csv\n\n"
    "A file of your own: cdprcal import raw.csv --map map.yaml -o mine.csv"
)


@reports_errors
def command(
    raw: LogArgument,
    output: LogOutputOption,
    map_: MapOption = "",
    inputs: Annotated[
        str,
        typer.Option(
            "--inputs",
            metavar="DIR",
            help="Of a log that cdprcal acquired: also write the robot file, the plan and the "
            "settings that it holds.",
        ),
    ] = "",
    robot: Annotated[
        str,
        typer.Option(
            metavar="ROBOT",
            help="Of a file with orientations: whose Euler convention to use. A log or session of "
            "another robot is refused.",
        ),
    ] = "",
    session: Annotated[
        str,
        typer.Option(metavar="FILE", help="Of a ROS 2 bag: its section ros2 names the topics."),
    ] = "",
    force: ForceOption = False,
) -> None:
    """Turn a raw robot log, MCAP, ROS 2 bag, or with --map any file, into a canonical log.

    Nothing is corrected but what the map says: signs, scales and offsets stay. Of a log that
    cdprcal acquired, robot, plan, settings and events are kept. Exit code 1:
    written, but the log cannot be trusted as it is (for example, its clock went back).
    """
    from cdprcal._core import InputError
    from cdprcal.io import load_log, read_inputs, save_log
    from cdprcal.io.acquisition_inputs import PLAN, ROBOT, SETTINGS
    from cdprcal.io.events import read_events
    from cdprcal.io.files import make_folder, write_text
    from cdprcal.io.log_file import is_mcap_name, require_cable_count
    from cdprcal.mapping import load_mapped, map_offered
    from cdprcal.tables import print_findings
    from cdprcal.terminal import answers, notes, say

    read = {"log": raw, "mapping file": map_, "robot file": robot, "session file": session}
    held_at = {name: str(Path(inputs) / name) if inputs else "" for name in (ROBOT, PLAN, SETTINGS)}
    keep_apart({"-o": output, "--inputs": held_at[ROBOT]}, read)
    is_mcap_name(Path(output))
    the_robot = load_robot(robot) if robot else None
    if map_ and session:
        fail("--session: a mapping file names topics, too; leave one of both out")
    bag = None if map_ else _load_bag(raw, the_robot, session)
    if map_:
        file = load_mapped(raw, map_, the_robot)
    else:
        with map_offered(raw, the_robot):
            file = bag or load_log(raw)
    acquired = not map_ and bag is None
    if the_robot is not None:
        require_cable_count(file, the_robot)
    held = None
    try:
        held = read_inputs(raw) if acquired else None
    except InputError:
        if inputs:
            raise
        say(notes(), f"{raw}: its settings are damaged: robot, plan and settings are left out")
    if inputs and held is None:
        raise InputError(
            f"{raw}: holds no robot, plan and settings: cdprcal did not acquire it; "
            "leave out --inputs"
        )
    keep_existing(
        {
            "log": output,
            "robot file": held_at[ROBOT],
            "plan": held_at[PLAN],
            "settings": held_at[SETTINGS],
        },
        force=force,
    )
    save_log(file.log, output, held, read_events(raw) if held is not None else ())
    if inputs and held is not None:
        make_folder(Path(inputs))
        for name, text in held.files().items():
            write_text(Path(held_at[name]), text)
    print_findings(file.findings)
    log = file.log
    say(
        answers(),
        f"{raw}: {len(log)} samples of {log.cable_count} cables, {log.time_s[0]:g} to "
        f"{log.time_s[-1]:g} s, now in {output}",
    )
    errors = any(finding.severity == "error" for finding in file.findings)
    raise typer.Exit(UNTRUSTED if errors else DONE)


def _load_bag(path: str, robot: _core.Robot | None, session: str) -> LogFile | None:
    """A ROS 2 bag; None when it is none. Ends the command when the session is another robot's."""
    from cdprcal.hardware.session import load_topics
    from cdprcal.ros2 import is_bag, load_bag

    if not is_bag(Path(path)):
        return None
    about = load_topics(session) if session else None
    if about is not None and robot is not None and about.robot != robot.name:
        fail(
            f"{session}: is the session of robot {about.robot}, not {robot.name}; give that one "
            "with --robot, or the session of this robot"
        )
    topics = about.ros2 if about is not None else None
    return load_bag(path, topics, robot.euler_convention if robot is not None else None)
