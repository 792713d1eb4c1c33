"""``cdprcal import``: any log → canonical log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdprcal.cli.common import DONE, UNTRUSTED, LogArgument, reports_errors


@reports_errors
def command(
    raw: LogArgument,
    output: Annotated[
        str,
        typer.Option("-o", "--output", metavar="FILE", help="Canonical log: .csv, or .mcap."),
    ],
) -> None:
    """Turn a raw robot log or MCAP into a canonical log.

    Nothing is corrected: signs, scales and offsets stay as the robot wrote them. Exit code 1:
    written, but the log cannot be trusted as it is (for example, its clock went back).
    """
    from cdprcal._core import InputError
    from cdprcal.io import load_log, save_log
    from cdprcal.tables import console, print_findings, say

    file = load_log(raw)
    target = Path(output)
    if target.exists() and target.samefile(raw):
        raise InputError(f"{output}: is the log that is read; give another name")
    save_log(file.log, target)
    print_findings(file.findings)
    log = file.log
    say(
        console(),
        f"{output}: {len(log)} samples of {log.cable_count} cables, {log.time_s[0]:g} to "
        f"{log.time_s[-1]:g} s",
    )
    errors = any(finding.severity == "error" for finding in file.findings)
    raise typer.Exit(UNTRUSTED if errors else DONE)
