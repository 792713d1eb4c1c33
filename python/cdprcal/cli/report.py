"""``cdprcal report``: everything about a start-up on one page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdprcal.command import (
    DONE,
    UNTRUSTED,
    ForceOption,
    MapOption,
    interruptible,
    keep_apart,
    keep_existing,
    load_robot,
    reports_errors,
)

if TYPE_CHECKING:
    from cdprcal.report import Subject

EXAMPLE = "Example: cdprcal report irma4 run.csv -o report.html"


@reports_errors
def command(
    inputs: Annotated[
        list[str],
        typer.Argument(
            metavar="ROBOT LOG… | RESULT…",
            help="Robot file or built-in name and its logs, to be calibrated and diagnosed now; or "
            "result files (.json) of calibrate -o and diagnose -o, to be shown as they are.",
        ),
    ],
    output: Annotated[
        str, typer.Option("-o", "--output", metavar="FILE", help="The page (HTML).")
    ] = "report.html",
    map_: MapOption = "",
    force: ForceOption = False,
) -> None:
    """Write one HTML page about a start-up: pose, robot in 3D, residuals, diagnosis, inputs.

    The page is self-contained: it needs no network and no other file. Exit code 1: written, but a
    pose cannot be trusted or something is left unexplained; the page says so at its top.
    """
    from cdprcal.extras import need
    from cdprcal.report import write_report
    from cdprcal.terminal import answers, notes, say

    need("jinja2", "plotly")
    keep_apart({"-o": output}, {"input": inputs, "mapping file": map_})
    path = Path(output)
    keep_existing({"page": output}, force=force)
    words = ["cdprcal", "report", *inputs, *(("--map", map_) if map_ else ()), "-o", output]
    subject = _subject(inputs, map_, words)
    with interruptible(), notes().status("drawing the page"):
        write_report(subject, path)
    from cdprcal.report.text import headline

    out = answers()
    _, title, lead = headline(subject)
    say(out, title)
    say(out, lead)
    say(out, f"{path}: {path.stat().st_size / 1e6:.1f} MB, open it in any browser")
    raise typer.Exit(DONE if subject.trusted else UNTRUSTED)


def _subject(inputs: list[str], map_: str, command: list[str]) -> Subject:
    from cdprcal._core import InputError
    from cdprcal.check import marks, pauses
    from cdprcal.io.result_file import is_result_file, load_result
    from cdprcal.mapping import Reader
    from cdprcal.report import subject_of_logs, subject_of_results
    from cdprcal.tables import print_findings
    from cdprcal.terminal import notes, say

    if is_result_file(inputs[0]):
        if map_:
            raise InputError("--map: a result file holds its log already; leave it out")
        return subject_of_results([load_result(path) for path in inputs], command)
    robot = load_robot(inputs[0])
    if len(inputs) < 2:
        raise InputError(f"{inputs[0]}: a robot alone is no report: name its logs after it")
    files = Reader(robot, map_).load_all(inputs[1:])
    for file in files:
        print_findings(file.findings)
    print_findings((*marks(robot, files), *pauses(robot, files)))
    with interruptible():
        return subject_of_logs(robot, files, command, lambda step: say(notes(), f"… {step}"))
