"""``cdprcal repeat``: solve again what a result file holds, and compare."""

from __future__ import annotations

from typing import Annotated

import typer

from cdprcal.command import (
    DONE,
    UNTRUSTED,
    JsonOption,
    interruptible,
    print_json,
    reports_errors,
)

EXAMPLE = "Example: cdprcal calibrate irma4 run.csv -o result.json && cdprcal repeat result.json"


@reports_errors
def command(
    result: Annotated[
        str,
        typer.Argument(
            metavar="RESULT",
            help="Result file (JSON), from calibrate -o or diagnose -o.",
        ),
    ],
    json: JsonOption = False,
) -> None:
    """Solve again from a result file alone, and say whether the same comes out.

    The file holds robot, logs and options; nothing else is needed. Exit code 1: the initial pose
    differs by more than a tenth of its standard deviation, or the verdict is another.
    """
    from cdprcal.io.result_file import load_result
    from cdprcal.repeat import repeat
    from cdprcal.terminal import answers, say

    held = load_result(result)
    with interruptible():
        again = repeat(held)
    if json:
        print_json(again.as_dict())
    else:
        say(answers(), again.sentence())
    raise typer.Exit(DONE if again.same else UNTRUSTED)
