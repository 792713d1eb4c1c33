"""``cdprcal geometry``: where the pulleys of a frame are that nobody measured."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdprcal.command import (
    DONE,
    UNTRUSTED,
    WITH_CAVEATS,
    ForceOption,
    JsonOption,
    MapOption,
    RobotArgument,
    VerboseOption,
    interruptible,
    keep_apart,
    keep_existing,
    load_robot,
    print_json,
    reports_errors,
)
from cdprcal.completion import one_of

EXAMPLE = "Example: cdprcal geometry belts.yaml grid.txt --map records.yaml -o calibrated.yaml"


@reports_errors
def command(
    robot: RobotArgument,
    logs: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG…",
            help="Logs of this robot, with whole lengths (direct_length_1_m …) or relative ones.",
        ),
    ],
    output: Annotated[
        str,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Write the robot file with these pulleys."
        ),
    ] = "",
    map_: MapOption = "",
    offset: Annotated[
        str,
        one_of(
            "none|common|each",
            help="What whole lengths may be wrong by: nothing, one number for all cables, or one a "
            "cable.",
        ),
    ] = "common",
    scale: Annotated[
        str,
        one_of(
            "common|each",
            help="Whether lengths read too much by one share for all cables, or by one a cable "
            "(stretched belts, drums of other diameters).",
        ),
    ] = "common",
    poses: Annotated[
        str,
        one_of(
            "automatic|samples|rests",
            help="What counts as a pose (automatic: the rests of a log sampled more often than "
            "twice a second, else every sample).",
        ),
    ] = "automatic",
    verbose: VerboseOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Find where a frame's pulleys are, and what its lengths are wrong by, from many poses.

    Pulleys are known as well as position_sigma_m says. Points (platform.motion 2T, 3T) need no
    guess: the file's positions say which corner is which. The poses are nobody's knowledge either;
    a tracker's (position_x_m …) help. Exit code 1: the poses do not determine the frame. 3: a
    pulley is known no better than by eye.
    """
    from cdprcal import _core
    from cdprcal.findings import Finding
    from cdprcal.frame import frame_as_dict
    from cdprcal.io.files import write_texts
    from cdprcal.io.replacing import signed
    from cdprcal.mapping import Reader
    from cdprcal.tables import print_findings

    keep_apart({"-o": output}, {"robot file": robot, "log": logs, "mapping file": map_})
    keep_existing({"robot file": output}, force=force)
    the_robot = load_robot(robot)
    files = Reader(the_robot, map_).load_all(logs)
    for file in files:
        print_findings(file.findings, verbose=verbose)
    with interruptible():
        found = _core.find_frame(
            the_robot, [file.log for file in files], offset=offset, scale=scale, poses=poses
        )
    document = frame_as_dict(found)
    converged = found.status == _core.FrameStatus.converged
    if output and converged:
        write_texts({Path(output): signed(document["corrected"])})
    if json:
        print_json(document)
    else:
        from cdprcal.frame.table import print_frame

        print_frame(document, verbose=verbose)
        print_findings([Finding(**c) for c in document["caveats"]], verbose=verbose)
    code = WITH_CAVEATS if document["caveats"] else DONE
    raise typer.Exit(code if converged else UNTRUSTED)
