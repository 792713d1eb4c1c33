"""``cdprcal template``: a robot file to fill in."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from cdprcal.command import fail, reports_errors

EXAMPLE = "Example: cdprcal template --cables 4 -o myrobot.yaml && cdprcal check myrobot.yaml"


@reports_errors
def command(
    output: Annotated[
        str, typer.Option("-o", "--output", metavar="FILE", help="The robot file (YAML).")
    ],
    cables: Annotated[int, typer.Option(min=1, max=8, help="How many cables.")] = 4,
) -> None:
    """Write a robot file with blanks and what goes into them.

    An existing file is never overwritten. cdprcal check then names one blank after the other.
    """
    from cdprcal.io.files import write_text
    from cdprcal.robot_template import BLANK, robot_template
    from cdprcal.terminal import answers, say

    path = Path(output)
    if path.exists():
        fail(f"{output}: exists already; give another name")
    name = re.sub(r"\W+", "_", path.stem) or "robot"
    write_text(path, robot_template(name, cables))
    say(answers(), f"{output}: replace every {BLANK}; next: cdprcal check {output}")
