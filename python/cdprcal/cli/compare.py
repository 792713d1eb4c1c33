"""``cdprcal compare``: which numbers of a robot moved from log to log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdprcal.command import (
    DONE,
    UNTRUSTED,
    EffectsOption,
    ForceOption,
    JsonOption,
    MapOption,
    RobotArgument,
    VerboseOption,
    fail,
    interruptible,
    keep_apart,
    keep_existing,
    print_json,
    reports_errors,
    robot_with_effects,
)

EXAMPLE = (
    "Example: cdprcal acquire irma4 plan.csv --quick --effect load_cell_bias=6,-5,4,-8 -o "
    "later.csv && cdprcal compare irma4 run.csv later.csv --plot moved.png"
)


@reports_errors
def command(
    robot: RobotArgument,
    logs: Annotated[
        list[str],
        typer.Argument(metavar="LOG LOG…", help="Logs of one robot, in the order of time."),
    ],
    map_: MapOption = "",
    effects: EffectsOption = None,
    plot: Annotated[
        str,
        typer.Option("--plot", metavar="FILE", help="Draw the numbers log by log (PNG, SVG, PDF)."),
    ] = "",
    verbose: VerboseOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Compare one robot over time: which numbers of its model moved, when, by how many sigma.

    The effects that the logs show together or alone are fitted to each log alone. A number has
    moved where chance would scatter it so in one of a hundred comparisons. Exit code 1: the effects
    could not be fitted to every log.
    """
    from cdprcal import _core
    from cdprcal.diagnosis.comparison import comparison_as_dict, draw_comparison, print_comparison
    from cdprcal.mapping import Reader
    from cdprcal.pictures import save_figure
    from cdprcal.tables import print_findings
    from cdprcal.terminal import notes, say

    if len(logs) < 2:
        fail("compare: needs two logs at least; give another")
    keep_apart(
        {"--plot": plot},
        {"robot file": robot, "log": logs, "mapping file": map_, "--effects": effects or []},
    )
    keep_existing({"picture": plot}, force=force)
    the_robot = robot_with_effects(robot, effects)
    files = Reader(the_robot, map_).load_all(logs)
    out = notes()
    for file in files:
        print_findings(file.findings, verbose=verbose)
    with interruptible():
        found = _core.compare(
            the_robot, [file.log for file in files], progress=lambda step: say(out, f"… {step}")
        )
    document = comparison_as_dict(found, the_robot)
    if plot and not document["numbers"]:
        say(out, f"{plot}: not written, as there is no number to draw")
    elif plot:
        save_figure(draw_comparison(document), Path(plot))
        say(out, plot)
    if json:
        print_json(document)
    else:
        print_comparison(document, verbose=verbose)
    raise typer.Exit(UNTRUSTED if document["not_settled"] else DONE)
