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
            help="The log of the start-up, where it is another: LOG goes on counting from it "
            "(default: LOG itself).",
        ),
    ] = "",
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
    from cdprcal.mapping import Reader
    from cdprcal.pictures import check_picture_name
    from cdprcal.tables import print_findings
    from cdprcal.tracking import save_track, track_as_dict

    inputs = {"robot file": robot, "log": log, "--start": start, "mapping file": map_}
    keep_apart({"-o": output, "--bag": bag, "--plot": plot}, inputs)
    if output and Path(output).suffix.lower() != ".csv":
        fail(f"{output}: a track is CSV; give a name in .csv, or --bag FOLDER for ROS 2")
    if plot:
        check_picture_name(Path(plot))
    keep_existing({"track": output, "picture": plot}, force=force)
    the_robot = _core.load_robot(robot)
    reader = Reader(the_robot, map_)
    file = reader.load(log)
    first = reader.load(start) if start else file
    of_start = -1 if start else segment
    with interruptible():
        calibration = _core.calibrate(
            the_robot, first.log, _core.CalibrateOptions(segment=of_start)
        )
        caveats = caveats_with_log(the_robot, first, calibration, of_start)
    if start:
        caveats += pauses(the_robot, [file], segment)
    code = exit_code(calibration, caveats)
    if calibration.result.status != _core.CalibrationStatus.converged:
        fail(
            f"{first.log.source}: no initial pose to track from: {calibration.result.reason}; "
            "give a log that calibrates, or the robot file that diagnose -o writes",
            UNTRUSTED,
        )
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
        from cdprcal.tracking.table import print_track

        print_findings(caveats, verbose=verbose)
        print_track(document, verbose=verbose)
    if not document["last"]["trusted"]:
        code = UNTRUSTED
    elif document["untrusted"] and code == DONE:
        code = WITH_CAVEATS
    raise typer.Exit(code)
