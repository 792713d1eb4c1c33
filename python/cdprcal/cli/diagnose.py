"""``cdprcal diagnose``: what the model lacks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdprcal.cli.common import (
    DONE,
    UNTRUSTED,
    JsonOption,
    RobotArgument,
    interruptible,
    print_json,
    reports_errors,
)

EXAMPLE = "Example: cdprcal diagnose irma4 run.csv -o corrected.yaml --result diagnosis.json"


@reports_errors
def command(
    robot: RobotArgument,
    logs: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG…",
            help="Canonical CSV, MCAP or raw robot logs of this robot, told apart by content.",
        ),
    ],
    output: Annotated[
        str,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Write the corrected robot file (YAML)."
        ),
    ] = "",
    plot: Annotated[
        str, typer.Option("--plot", metavar="DIR", help="Write pictures (PNG) into this folder.")
    ] = "",
    result: Annotated[
        str,
        typer.Option(
            "--result",
            metavar="FILE",
            help="Also write the result as JSON, with robot and logs: for cdprcal report and "
            "cdprcal repeat.",
        ),
    ] = "",
    json: JsonOption = False,
) -> None:
    """Find where the model and the logs disagree, name the missing effects, show the gap shrink.

    Several logs of one robot are explained together. Exit code 1: something is left that no effect
    of the catalogue explains.
    """
    from cdprcal import _core
    from cdprcal.diagnosis import diagnosis_as_dict
    from cdprcal.io import load_run
    from cdprcal.io.files import write_text
    from cdprcal.tables import console, print_findings, say

    the_robot = _core.load_robot(robot)
    files = [load_run(log, the_robot) for log in logs]
    out = console()
    for file in files:
        print_findings(file.findings)

    def progress(step: str) -> None:
        say(out, f"… {step}")

    with interruptible():
        diagnosis = _core.diagnose(the_robot, [file.log for file in files], progress=progress)
    document = diagnosis_as_dict(diagnosis, the_robot)
    if output:
        write_text(Path(output), _core.to_yaml(diagnosis.corrected))
    if result:
        from cdprcal.io.result_file import save_result

        save_result(Path(result), "diagnose", document, the_robot, [file.log for file in files], {})
    if plot:
        from cdprcal.diagnosis.pictures import write_pictures

        for path in write_pictures(diagnosis, Path(plot)):
            say(out, f"{path}")
    if json:
        print_json(document)
    else:
        from cdprcal.diagnosis.table import print_diagnosis

        print_diagnosis(document)
    unexplained = diagnosis.verdict == _core.Verdict.unexplained
    raise typer.Exit(UNTRUSTED if unexplained else DONE)
