"""A plan file as a command takes it: of this robot, and one that it can go through."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cdprcal.command import fail

if TYPE_CHECKING:
    from cdprcal import _core

_MOST_BYTES = 64_000_000  # what the C++ reader takes


def plan_of(robot: _core.Robot, path: str) -> tuple[_core.Plan, str]:
    """The plan and its text; ends the command for one of another robot, or that does not hold it.

    Raises InputError for what is no plan file.
    """
    from cdprcal import _core
    from cdprcal._core import InputError
    from cdprcal.io.files import read_utf_8

    text = read_utf_8(Path(path), _MOST_BYTES)
    plan = _core.parse_plan(text, path)
    if plan.robot_name != robot.name:
        fail(
            f"{path}: is of robot {plan.robot_name}, not of {robot.name}; make one with "
            "cdprcal plan"
        )
    try:
        wrong = _core.verify_plan(robot, plan)
    except InputError as error:
        wrong = str(error).removeprefix("plan: ")
    if wrong:
        fail(f"{path}: cannot be run with {robot.name}: {wrong}; make one with cdprcal plan")
    return plan, text
