"""``cdprcal check``: what is wrong with this robot file or log, before anyone fits it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdprcal.command import (
    DONE,
    UNTRUSTED,
    ForceOption,
    JsonOption,
    MapOption,
    SegmentOption,
    VerboseOption,
    fail,
    keep_apart,
    keep_existing,
    load_robot,
    print_json,
    reports_errors,
)
from cdprcal.completion import robot_names

if TYPE_CHECKING:
    from cdprcal import _core
    from cdprcal.mapping import Proposal

EXAMPLE = (
    "Example: cdprcal check irma4 run.csv\n\n"
    "A file of your own: cdprcal check irma4 raw.csv --propose map.yaml"
)


@reports_errors
def command(
    robot: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT",
            autocompletion=robot_names,
            help="Robot file (YAML) or built-in name (irma4, ring3, ring5, posts8, belts4, hang4); "
            "may be left out with --propose.",
        ),
    ],
    log: Annotated[
        str,
        typer.Argument(
            metavar="[LOG]",
            help="Canonical CSV, MCAP or raw robot log, told apart by content; without one the "
            "robot file itself is checked.",
        ),
    ] = "",
    propose: Annotated[
        str,
        typer.Option(
            "--propose",
            metavar="FILE",
            help="Write a mapping file for a log of any kind, from what its columns seem to be; "
            "with ROBOT, directions and units are tried on its physics.",
        ),
    ] = "",
    map_: MapOption = "",
    segment: SegmentOption = -1,
    verbose: VerboseOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Say what is wrong with a robot file or a log: where, how bad, and what to do.

    Thresholds come from the robot file's sigma and limits, from physics and from the data's own
    noise. Exit code 1: it cannot be trusted; with --propose: a line of the map is but a guess.
    """
    from cdprcal.check import check_file, check_log, check_robot
    from cdprcal.mapping import Reader, map_offered
    from cdprcal.tables import print_check, print_robot_check

    if propose:
        raw, known = (log, load_robot(robot)) if log else (robot, None)
        if map_:
            fail("--propose: writes a mapping file; leave out --map")
        keep_apart({"--propose": propose}, {"log": raw, "robot file": robot if log else ""})
        raise typer.Exit(_propose(raw, known, propose, robot if log else "ROBOT", force, json))
    the_robot = load_robot(robot)
    if not log:
        about = check_robot(the_robot)
        if json:
            print_json(about.as_dict())
        else:
            print_robot_check(about.as_dict(), about.findings)
        raise typer.Exit(DONE if about.trusted else UNTRUSTED)
    if map_:
        report = check_log(the_robot, Reader(the_robot, map_).load(log), segment)
    else:
        with map_offered(log, the_robot):
            report = check_file(the_robot, log, segment)
    if json:
        print_json(report.as_dict())
    else:
        print_check(report.as_dict(), report.findings, verbose=verbose)
    raise typer.Exit(DONE if report.trusted else UNTRUSTED)


def _propose(
    raw: str, robot: _core.Robot | None, output: str, shown_robot: str, force: bool, json: bool
) -> int:
    """Writes a mapping file, says how sure it is; the exit code."""
    from cdprcal.io.files import shown_path, write_text
    from cdprcal.mapping import propose_file
    from cdprcal.terminal import answers, as_typed, counted, say

    proposal = propose_file(raw, robot)
    keep_existing({"mapping file": output}, force=force)
    write_text(Path(output), proposal.text())
    lines = proposal.all_lines()
    guesses = [line.name for line in lines if line.sure == "guess"]
    lacks = proposal.lacks if robot is not None else ""
    said = [f"to be corrected where wrong: {', '.join(guesses)}"] if guesses else []
    said += [lacks] if lacks else []
    if json:
        print_json({"trusted": not said, "map": shown_path(output), **proposal.as_dict()})
    else:
        out = answers()
        say(out, f"{output}: {counted(len(lines), 'line')}, {'; '.join(said) or 'none a guess'}")
        _print_lines(proposal)
        say(out, f"next: {as_typed('check', shown_robot, raw, '--map', output)}")
    return UNTRUSTED if said else DONE


def _print_lines(proposal: Proposal) -> None:
    """The lines as a table, and what none of them takes."""
    from cdprcal.io.files import shown_text
    from cdprcal.terminal import Table, answers, say

    table = Table("what", "how sure", "unit", "sign", "columns", "because", text=range(6))
    for line in proposal.all_lines():
        signs = line.sign if len(set(line.sign)) > 1 else line.sign[:1]
        columns = ", ".join(filter(None, line.columns)) or f"{proposal.rate_Hz:g} rows a second"
        table.add_row(
            line.name,
            line.sure,
            str(line.unit),
            " ".join(f"{sign:+d}" for sign in signs),
            columns,
            line.why,
        )
    answers().print(table)
    if spare := proposal.unused():
        say(answers(), f"not used: {', '.join(shown_text(name) for name in spare)}")
