"""``cdprcal diagnose``: what the model lacks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
from cdprcal.completion import effect_names

if TYPE_CHECKING:
    from cdprcal import _core
    from cdprcal.io import LogFile

EXAMPLE = "Example: cdprcal diagnose irma4 run.csv -o corrected.yaml -o diagnosis.json"


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
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write what the name says: .yaml the corrected robot file; .json the result, with "
            "robot and logs, for cdprcal report and cdprcal repeat. May be repeated.",
        ),
    ] = None,
    map_: MapOption = "",
    effects: EffectsOption = None,
    motion: Annotated[
        bool,
        typer.Option(
            "--motion",
            help="Let moments at which the platform moves count as rests do, with inertia and "
            "damping, all along where nothing rests: for platforms that swing.",
        ),
    ] = False,
    fit: Annotated[
        list[str] | None,
        typer.Option(
            "--fit",
            metavar="EFFECT",
            help="Fit this effect, with no search for others. May be repeated: one after the "
            "other.",
            autocompletion=effect_names,
        ),
    ] = None,
    plot: Annotated[
        str, typer.Option("--plot", metavar="DIR", help="Write pictures (PNG) into this folder.")
    ] = "",
    result: Annotated[
        str,
        typer.Option(
            "--result",
            metavar="FILE",
            help="As -o FILE.json, under any name.",
        ),
    ] = "",
    verbose: VerboseOption = False,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Find where the model and the logs disagree, name the missing effects, show the gap shrink.

    Several logs of one robot are explained together. What no name explains is put into a formula,
    where one predicts what it was not fitted on. Exit code 1: something is left all the same, too
    little was measured to say, or a log gives no initial pose that
    can be trusted even so.
    """
    from cdprcal import _core
    from cdprcal.check import marks, pauses
    from cdprcal.diagnosis import diagnosis_as_dict
    from cdprcal.diagnosis.document import TRUSTED
    from cdprcal.io.files import write_texts
    from cdprcal.io.replacing import check_ending, signed
    from cdprcal.io.result_file import diagnose_options, result_text
    from cdprcal.mapping import Reader
    from cdprcal.tables import print_findings
    from cdprcal.terminal import answers, as_typed, notes, say
    from cdprcal.trust import caveats_of_diagnosis

    corrected, saved = _outputs(output or [], result)
    keep_apart(
        {"-o": corrected, "--result": saved},
        {"robot file": robot, "log": logs, "mapping file": map_, "--effects": effects or []},
    )
    if corrected:
        check_ending(Path(corrected), "robot file", "result")
    keep_existing({"robot file": corrected, "result": saved}, force=force, any_name=(result,))
    the_robot = robot_with_effects(robot, effects)
    files = Reader(the_robot, map_).load_all(logs)
    the_logs = [file.log for file in files]
    out = notes()
    for file in files:
        print_findings(file.findings, verbose=verbose)
    caveats = (*marks(the_robot, files), *pauses(the_robot, files))
    print_findings(caveats, verbose=verbose)

    def progress(step: str) -> None:
        say(out, f"… {step}")

    with interruptible():
        try:
            asked = {**({"motion": True} if motion else {}), **({"effects": fit} if fit else {})}
            options = diagnose_options(asked)
            diagnosis = _core.diagnose(the_robot, the_logs, options, progress=progress)
        except _core.InputError:
            if not motion:
                _refuse_without_rest(the_robot, files)
            raise
    print_findings(caveats_of_diagnosis(diagnosis), verbose=verbose)
    document = diagnosis_as_dict(diagnosis, the_robot, caveats, logs=the_logs)
    texts = {}
    if corrected:
        texts[Path(corrected)] = signed(_core.to_yaml(diagnosis.corrected))
    if saved:
        texts[Path(saved)] = result_text("diagnose", document, the_robot, the_logs, asked)
    if plot:
        from cdprcal.diagnosis.pictures import write_pictures

        for path in write_pictures(document, Path(plot)):
            say(out, f"{path}")
    write_texts(texts)
    if json:
        print_json(document)
    else:
        from cdprcal.diagnosis.table import print_diagnosis

        print_diagnosis(document, verbose=verbose)
        if corrected:
            mapped = ("--map", map_) if map_ else ()
            moving = ("--motion",) if motion else ()
            again = as_typed("calibrate", corrected, logs[0], *mapped, *moving)
            holds = (
                "the robot file with what was found"
                if document["effects"]
                else "nothing was found: the robot file as it was given"
            )
            say(answers(), f"{corrected}: {holds}; next: {again}")
    raise typer.Exit(DONE if document["verdict"] in TRUSTED else UNTRUSTED)


def _outputs(names: list[str], result: str) -> tuple[str, str]:
    """Of the names after -o that of the robot file and that of the result; empty: not wanted."""
    results = [name for name in names if name.lower().endswith(".json")]
    robots = [name for name in names if name not in results]
    if len(robots) > 1:
        fail(f"-o: {robots[0]} and {robots[1]} would be the same robot file; give one")
    results += [result] if result else []
    if len(results) > 1:
        fail(f"-o: {results[0]} and {results[1]} would be the same result; give one")
    return "".join(robots), "".join(results)


def _refuse_without_rest(robot: _core.Robot, files: list[LogFile]) -> None:
    """Raises InputError for a log whose run has no rest that could be found."""
    from cdprcal import _core
    from cdprcal.io.files import shown_path

    for file in files:
        *others, run = _core.segments(file.log)
        if others and len(run) < 2:
            continue  # times that are no seconds: what was raised before says so
        try:
            rests = len(_core.detect_equilibria(file.log, run, robot.sigma))
        except _core.InputError:
            continue  # no channel could tell: what was raised before says more
        if not rests:
            window_s = _core.DetectionOptions().window_s
            raise _core.InputError(
                f"{shown_path(file.path)}: no pose at rest was found in the run ({len(run)} "
                f"samples), and diagnose needs some: rests of 3 s, logged at 10 Hz or more "
                f"({window_s:g} s must hold several samples); diagnose --motion does without"
            )
