"""``cdprcal import``: any log → canonical log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdprcal.cli.common import DONE, UNTRUSTED, LogArgument, reports_errors

EXAMPLE = "Example: cdprcal import robot.log -o run.csv"


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
) -> None:
    """Turn a raw robot log or MCAP into a canonical log.

    Nothing is corrected: signs, scales and offsets stay as the robot wrote them. Exit code 1:
    written, but the log cannot be trusted as it is (for example, its clock went back).
    """
    from cdprcal._core import InputError
    from cdprcal.io import load_log, read_inputs, save_log
    from cdprcal.io.files import write_text
    from cdprcal.tables import console, print_findings, say

    file = load_log(raw)
    target = Path(output)
    if target.exists() and target.samefile(raw):
        raise InputError(f"{output}: is the log that is read; give another name")
    held = read_inputs(raw) if inputs else None
    if inputs and held is None:
        raise InputError(f"{raw}: holds no robot, plan and settings: cdprcal did not acquire it")
    save_log(file.log, target)
    if held is not None:
        try:
            Path(inputs).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{inputs}: cannot be made: {error.strerror}") from None
        for name, text in held.files().items():
            write_text(Path(inputs) / name, text)
    print_findings(file.findings)
    log = file.log
    say(
        console(),
        f"{output}: {len(log)} samples of {log.cable_count} cables, {log.time_s[0]:g} to "
        f"{log.time_s[-1]:g} s",
    )
    errors = any(finding.severity == "error" for finding in file.findings)
    raise typer.Exit(UNTRUSTED if errors else DONE)
