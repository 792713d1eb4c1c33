"""``cdprcal template``: a robot file to fill in, or a session file to be changed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from cdprcal.command import fail, keep_apart, reports_errors
from cdprcal.completion import robot_names

EXAMPLE = (
    "Example: cdprcal template --cables 4 -o myrobot.yaml\n\n"
    "From a robot that is much like it: cdprcal template --from irma4 -o like.yaml\n\n"
    "What is wired to what, for acquire: cdprcal template --session -o session.yaml"
)


@reports_errors
def command(
    output: Annotated[
        str,
        typer.Option("-o", "--output", metavar="FILE", help="The robot or session file (YAML)."),
    ],
    cables: Annotated[
        int | None, typer.Option(min=1, max=8, help="How many cables (default: 4).")
    ] = None,
    source: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="ROBOT",
            autocompletion=robot_names,
            help="Instead of blanks, the values of this robot, to be changed: a built-in name or a "
            "robot file, whose comments stay.",
        ),
    ] = "",
    session: Annotated[
        bool,
        typer.Option(
            "--session",
            help="A session file for acquire instead: irma4 with simulated drives, to be tried as "
            "it is or changed.",
        ),
    ] = False,
) -> None:
    """Write a robot file with blanks and what goes into them, or one like another robot's.

    An existing file is never overwritten. cdprcal check then names one blank after the other.
    """
    from cdprcal.io.files import write_text
    from cdprcal.io.replacing import check_ending
    from cdprcal.robot_template import BLANK, robot_like, robot_template
    from cdprcal.terminal import answers, as_typed, say

    keep_apart({"-o": output}, {})
    path = Path(output)
    check_ending(path, "robot file")
    if path.exists():
        fail(f"{output}: exists already; give another name")
    if session:
        if source or cables is not None:
            fail("--session: is no robot file; leave out --from and --cables")
        _write_session(path)
        return
    name = re.sub(r"\W+", "_", path.stem) or "robot"
    if source:
        if cables is not None:
            fail("--from: has its own cables; leave out --cables")
        write_text(path, robot_like(source, name))
        say(answers(), f"{output}: change what is different; next: {as_typed('check', output)}")
        return
    write_text(path, robot_template(name, cables or 4))
    say(answers(), f"{output}: replace every {BLANK}; next: {as_typed('check', output)}")


def _write_session(path: Path) -> None:
    from cdprcal.hardware.session import example_text
    from cdprcal.io.files import write_text
    from cdprcal.terminal import answers, as_typed, say

    write_text(path, example_text())
    tried = as_typed("acquire", "irma4", "PLAN", "--backend", "canopen", "--session", path)
    say(answers(), f"{path}: irma4 with simulated drives; next: {tried} -o run.mcap")
