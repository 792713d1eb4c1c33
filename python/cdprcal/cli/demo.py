"""``cdprcal demo``: the whole story on a simulated robot."""

from __future__ import annotations

from typing import Annotated

import typer

from cdprcal.command import (
    DONE,
    UNTRUSTED,
    EffectsOption,
    ForceOption,
    JsonOption,
    fail,
    keep_apart,
    print_json,
    reports_errors,
    robot_with_effects,
)
from cdprcal.completion import injected_effects

_TO_DRAW = "pip install 'cdprcal[report]'"
EXAMPLE = "Example: cdprcal demo --seed 2 --effect load_cell_bias=6,-5,4,-8"


@reports_errors
def command(
    robot: Annotated[
        str,
        typer.Argument(metavar="[ROBOT]", help="Robot file (YAML) or built-in name."),
    ] = "irma4",
    output: Annotated[
        str,
        typer.Option(
            "-o", "--output", metavar="DIR", help="Where plan, logs, pictures and the report go."
        ),
    ] = "cdprcal-demo",
    seed: Annotated[
        int,
        typer.Option(min=0, help="Of the unknown pose, the noise, and the hidden effect's choice."),
    ] = 1,
    effect: Annotated[
        str,
        typer.Option(
            "--effect",
            metavar="NAME=VALUES",
            autocompletion=injected_effects,
            help="What to hide in the second robot (default: one of a few, by the seed).",
        ),
    ] = "",
    effects: EffectsOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """A robot wakes up somewhere: plan, start up, calibrate by all methods, find a hidden fault.

    All of it simulated, with the noise of real sensors, and with the truth to compare with. Exit
    code 1: a pose was not found, or the hidden effect was not named.
    """
    from pathlib import Path

    from cdprcal import _core
    from cdprcal.demo import pictures, story, table
    from cdprcal.demo.folder import FAULTY, PLAN, REPORT, RUN, refuse_what_is_no_demonstration
    from cdprcal.diagnosis import diagnosis_as_dict
    from cdprcal.diagnosis.pictures import write_pictures
    from cdprcal.extras import lacking
    from cdprcal.io.files import make_folder
    from cdprcal.terminal import answers, notes, say

    keep_apart({"-o": output}, {})
    draws = not lacking("matplotlib", "jinja2", "plotly")
    out = notes()
    the_robot = robot_with_effects(robot, effects)
    if the_robot.cable_count < 3:
        fail(
            f"{robot}: has {the_robot.cable_count} cables, and a start-up is planned for three "
            "and more; give a robot with as many, irma4 for one"
        )
    hide = effect or story.hidden_effect(the_robot, seed)
    _core.expanded_effect(_core.parse_injected_effect(hide, the_robot), the_robot)
    folder = Path(output)
    if not force:
        refuse_what_is_no_demonstration(folder, draws=draws)
    make_folder(folder)

    say(out, f"1. {the_robot.name} wakes up: lengths, swivel angles and yaw are relative")
    plan = story.make_plan(the_robot, folder / PLAN).plan
    say(out, f"2. planned: {plan.measured_count} poses ({folder / PLAN})")
    run = story.start_up(the_robot, plan, seed, [], folder / RUN)
    acquired = run.acquired
    if acquired.reason:
        say(out, f"the robot was stopped: {acquired.reason}")
        raise typer.Exit(UNTRUSTED)
    say(
        out,
        f"3. started up: τ0 and {plan.measured_count} poses at rest in {acquired.duration_s:.1f} s "
        f"of robot time ({run.path})",
    )
    rows = story.calibrate_by_all_methods(the_robot, run)
    say(out, "4. calibrated by all methods")
    drawn = pictures.write_pictures(the_robot, run, rows, folder) if draws else []

    say(out, f"5. another robot, with a fault that nobody knows of: {hide}")
    hidden = story.diagnose_hidden(
        the_robot,
        plan,
        seed + 1,
        hide,
        folder / FAULTY,
        lambda step: say(out, f"   … {step}"),
    )
    page = folder / REPORT
    if draws:
        drawn += write_pictures(
            diagnosis_as_dict(hidden.diagnosis, the_robot, logs=[hidden.run.log]), folder
        )
        story.write_hidden_report(the_robot, hidden, page)
    if not json:
        out = answers()
    say(out, table.headline(rows))
    say(out, table.verdict(hidden))
    say(out, "error of the initial pose, by method")
    out.print(table.methods_table(rows))
    say(out, f"error of the initial pose, with the hidden fault {hide}")
    out.print(table.hidden_table(hidden))
    if draws:
        say(out, f"the report, to be opened in a browser: {page}")
        say(out, f"pictures in {folder}: " + ", ".join(path.name for path in drawn))
    else:
        say(out, f"logs and plan in {folder}; for pictures and a report: {_TO_DRAW}")
    if json:
        print_json(table.demo_as_dict(run, rows, hidden))
    found = all(row.calibration.result.status == _core.CalibrationStatus.converged for row in rows)
    raise typer.Exit(DONE if found and (hidden.named or hidden.among_rivals) else UNTRUSTED)
