"""``cdprcal import``: any log → canonical log."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdprcal.command import DONE, UNTRUSTED, LogArgument, reports_errors

if TYPE_CHECKING:
    from cdprcal.io import LogFile

EXAMPLE = (
    "Example: cdprcal import robot.log -o run.csv\n\n"
    "A ROS 2 bag: cdprcal import bag --robot irma4 --session mine.yaml -o run.csv"
)


@reports_errors
def command(
    raw: LogArgument,
    output: Annotated[
        str,
        typer.Option("-o", "--output", metavar="FILE", help="Canonical log: .csv, or .mcap."),
    ],
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
            metavar="ROBOT", help="Of a ROS 2 bag with orientations: whose Euler convention to use."
        ),
    ] = "",
    session: Annotated[
        str,
        typer.Option(metavar="FILE", help="Of a ROS 2 bag: its section ros2 names the topics."),
    ] = "",
) -> None:
    """Turn a raw robot log, MCAP or ROS 2 bag into a canonical log.

    Nothing is corrected: signs, scales and offsets stay as the robot wrote them. Exit code 1:
    written, but the log cannot be trusted as it is (for example, its clock went back).
    """
    from cdprcal._core import InputError
    from cdprcal.io import load_log, read_inputs, save_log
    from cdprcal.io.files import reason, write_text
    from cdprcal.tables import print_findings
    from cdprcal.terminal import answers, say

    file = _load_bag(raw, robot, session) or load_log(raw)
    target = Path(output)
    if target.exists() and target.samefile(raw):
        raise InputError(f"{output}: is the log that is read; give another name")
    held = read_inputs(raw) if inputs else None
    if inputs and held is None:
        raise InputError(
            f"{raw}: holds no robot, plan and settings: cdprcal did not acquire it; "
            "leave out --inputs"
        )
    save_log(file.log, target)
    if held is not None:
        try:
            Path(inputs).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{inputs}: cannot be made: {reason(error)}") from None
        for name, text in held.files().items():
            write_text(Path(inputs) / name, text)
    print_findings(file.findings)
    log = file.log
    say(
        answers(),
        f"{raw}: {len(log)} samples of {log.cable_count} cables, {log.time_s[0]:g} to "
        f"{log.time_s[-1]:g} s, now in {output}",
    )
    errors = any(finding.severity == "error" for finding in file.findings)
    raise typer.Exit(UNTRUSTED if errors else DONE)


def _load_bag(path: str, robot: str, session: str) -> LogFile | None:
    """A ROS 2 bag; None when it is none."""
    from cdprcal import _core
    from cdprcal.hardware.session import load_session
    from cdprcal.ros2 import is_bag, load_bag

    if not is_bag(Path(path)):
        return None
    topics = load_session(session).ros2 if session else None
    convention = _core.load_robot(robot).euler_convention if robot else None
    return load_bag(path, topics, convention)
