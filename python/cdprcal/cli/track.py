"""``cdprcal track``: where the platform is at every sample."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from cdprcal.command import (
    DONE,
    UNTRUSTED,
    WITH_CAVEATS,
    ForceOption,
    JsonOption,
    LogArgument,
    MapOption,
    RobotArgument,
    SegmentOption,
    VerboseOption,
    fail,
    interruptible,
    keep_apart,
    keep_existing,
    load_robot,
    print_json,
    reports_errors,
)

EXAMPLE = "Example: cdprcal track irma4 run.csv -o track.csv --plot track.png"


@reports_errors
def command(
    robot: RobotArgument,
    log: LogArgument,
    start: Annotated[
        str,
        typer.Option(
            metavar="START",
            help="The log of the start-up, or the result of calibrate -o, where it is another: LOG "
            "goes on counting from it (default: LOG itself).",
        ),
    ] = "",
    motion: Annotated[
        bool,
        typer.Option(
            "--motion",
            help="Calibrate the start as calibrate --motion does: for one that hardly rests.",
        ),
    ] = False,
    output: Annotated[
        str,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Write pose, twist and σ of every sample: .csv."
        ),
    ] = "",
    bag: Annotated[
        str,
        typer.Option(
            metavar="FOLDER",
            help="Write a ROS 2 bag: PoseWithCovarianceStamped and TwistWithCovarianceStamped.",
        ),
    ] = "",
    plot: Annotated[
        str, typer.Option("--plot", metavar="FILE", help="Draw the track (PNG, PDF or SVG).")
    ] = "",
    map_: MapOption = "",
    segment: SegmentOption = -1,
    verbose: VerboseOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Find pose, twist and their uncertainty at every sample, once the start is calibrated.

    Exit code 1: the calibration, or the last sample, cannot be trusted. 3: caveats: of the
    calibration, or some samples contradict one another, and which.
    """
    from cdprcal import _core
    from cdprcal.check import caveats_with_log, pauses
    from cdprcal.cli.calibrate import exit_code
    from cdprcal.io.result_file import is_result_file
    from cdprcal.mapping import Reader
    from cdprcal.tables import print_findings
    from cdprcal.tracking import save_track, track_as_dict
    from cdprcal.tracking.start import motion_would_tell, require_start, saved_start

    inputs = {"robot file": robot, "log": log, "--start": start, "mapping file": map_}
    keep_apart({"-o": output, "--bag": bag, "--plot": plot}, inputs)
    keep_existing({"track": output, "picture": plot}, force=force)
    the_robot = load_robot(robot)
    reader = Reader(the_robot, map_)
    file = reader.load(log)
    # With a mapping file, what begins as JSON may be a log of JSON lines.
    if is_result_file(start) and (not map_ or start.lower().endswith(".json")):
        first, options, moved = saved_start(start, the_robot)
        motion = motion or moved
    else:
        first = reader.load(start) if start else file
        options = _core.CalibrateOptions(segment=-1 if start else segment)
    with interruptible():
        if motion:
            calibration = _core.calibrate_in_motion(the_robot, first.log, options).calibration
        else:
            calibration = _core.calibrate(the_robot, first.log, options)
        caveats = caveats_with_log(the_robot, first, calibration, options.segment)
    if start:
        caveats += pauses(the_robot, [file], segment)
    code = exit_code(calibration, caveats)
    try:
        require_start(calibration, first.log, "" if motion else "--motion")
    except _core.InputError as error:
        fail(str(error), UNTRUSTED)
    with interruptible():
        began_s = time.perf_counter()
        track = _core.track(calibration, file.log, segment)
        document = track_as_dict(track, time.perf_counter() - began_s, caveats)
    if output:
        save_track(track, Path(output))
    if bag:
        from cdprcal.ros2 import save_track_bag

        save_track_bag(track, bag)
    if plot:
        from cdprcal.tracking.pictures import write_track_picture

        write_track_picture(track, Path(plot))
    if json:
        print_json(document)
    else:
        from cdprcal.terminal import notes, say
        from cdprcal.tracking.table import print_track

        print_findings(caveats, verbose=verbose)
        if not motion and motion_would_tell(calibration, first.log):
            say(notes(), "the start hardly rests: --motion also uses how it moves")
        print_track(document, verbose=verbose)
    if not document["last"]["trusted"]:
        code = UNTRUSTED
    elif document["untrusted"] and code == DONE:
        code = WITH_CAVEATS
    raise typer.Exit(code)
