"""``cdprcal calibrate``: the initial pose from a log."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
from cdprcal.completion import one_of
from cdprcal.option_values import split_numbers

if TYPE_CHECKING:
    from cdprcal._core import Calibration
    from cdprcal.findings import Finding

EXAMPLE = "Example: cdprcal calibrate irma4 run.csv -o result.json"


@reports_errors
def command(
    robot: RobotArgument,
    log: LogArgument,
    method: Annotated[
        str,
        one_of(
            "unified|static|kinematic",
            help="static: tensions, lengths, swivels and attitude at rest; kinematic: without "
            "tensions, also in motion; unified: both.",
        ),
    ] = "unified",
    formulation: Annotated[
        str,
        one_of(
            "full|paper",
            help="full: all six equations of statics and everything the first pose knows; paper: "
            "eqs 13-17 to the letter.",
        ),
    ] = "full",
    at: Annotated[
        str,
        typer.Option(
            metavar="T1,T2,…",
            help="Times of the poses in seconds, the first is the reference (default: found).",
        ),
    ] = "",
    noise: Annotated[
        str,
        one_of(
            "data|specified",
            help="Where the weights come from: the readings themselves, with outliers and slack "
            "cables left out, or the robot file's sigma (default: data; specified for "
            "--formulation paper).",
        ),
    ] = "",
    motion: Annotated[
        bool,
        typer.Option(
            "--motion",
            help="Let the balance of forces and inertia count between the rests too, and all along "
            "where nothing rests: for short runs, and platforms that swing.",
        ),
    ] = False,
    map_: MapOption = "",
    segment: SegmentOption = -1,
    verbose: VerboseOption = False,
    json: JsonOption = False,
    output: Annotated[
        str,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Also write the result (.json), with robot, log and options: for cdprcal report "
            "and cdprcal repeat.",
        ),
    ] = "",
    force: ForceOption = False,
) -> None:
    """Find the initial pose, with its uncertainty, from a log.

    Exit code 1: log or solution cannot be trusted; the status and its reason, or an error of
    check, say why. 3: a pose, but with caveats, which are listed; it may be off by more than its σ.
    """
    from cdprcal import _core
    from cdprcal.check import caveats_with_log
    from cdprcal.mapping import Reader
    from cdprcal.results import calibration_as_dict, motion_as_dict

    if output.lower().endswith((".yaml", ".yml")):
        fail(f"{output}: calibrate corrects no robot file; give a name in .json for the result")
    keep_apart({"-o": output}, {"robot file": robot, "log": log, "mapping file": map_})
    keep_existing({"result": output}, force=force)
    options = _core.CalibrateOptions(
        method=_core.parse_method(method),
        formulation=_core.parse_formulation(formulation),
        noise=_core.parse_noise_source(noise) if noise else None,
        at_s=parse_times(at),
        segment=segment,
    )
    the_robot = load_robot(robot)
    file = Reader(the_robot, map_).load(log)
    with interruptible():
        if motion:
            found = _core.calibrate_in_motion(the_robot, file.log, options)
            calibration = found.calibration
        else:
            calibration = _core.calibrate(the_robot, file.log, options)
        caveats = caveats_with_log(the_robot, file, calibration, segment)
    document = calibration_as_dict(the_robot, calibration, caveats)
    if motion:
        document |= motion_as_dict(found, document)
    if output:
        from cdprcal.io.result_file import calibrate_options_as_dict, save_result

        as_dict = calibrate_options_as_dict(options, motion=motion)
        save_result(Path(output), "calibrate", document, the_robot, [file.log], as_dict)
    if json:
        print_json(document)
    else:
        from cdprcal.tables import (
            print_calibration,
            print_findings,
            print_motion,
            sigma_of,
        )

        print_findings(file.findings, verbose=verbose)
        print_findings(caveats, verbose=verbose)
        print_calibration(document, sigma_of(the_robot), verbose=verbose)
        if motion:
            print_motion(document["motion"])
    code = exit_code(calibration, caveats)
    if code != DONE and not json:
        from cdprcal.terminal import answers, as_typed, say

        same = (robot, log, *(("--map", map_) if map_ else ()))
        check, diagnose = as_typed("check", *same), as_typed("diagnose", *same)
        say(answers(), f"next: {check}, then {diagnose}")
    raise typer.Exit(code)


def exit_code(calibration: Calibration, caveats: Iterable[Finding]) -> int:
    """Of a calibration with these caveats."""
    from cdprcal._core import CalibrationStatus
    from cdprcal.trust import against_pose

    severities = {caveat.severity for caveat in against_pose(caveats)}
    if calibration.result.status != CalibrationStatus.converged or "error" in severities:
        return UNTRUSTED
    return WITH_CAVEATS if severities else DONE


def parse_times(text: str) -> list[float]:
    """'1,2.5' → [1.0, 2.5]. Raises InputError naming what is no time."""
    import math

    from cdprcal._core import InputError

    times = []
    for part, time in split_numbers(text):
        if math.isnan(time):
            raise InputError(f"--at: {part!r} is not a time in seconds (write --at 12.5,20,31)")
        times.append(time)
    return times
