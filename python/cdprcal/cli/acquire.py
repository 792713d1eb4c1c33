"""``cdprcal acquire``: run the start-up procedure on a robot and log it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import typer

from cdprcal.cli.live import LiveOption, LiveStopOption, PortOption, live_page
from cdprcal.cli.plan_file import plan_of
from cdprcal.command import (
    DONE,
    UNTRUSTED,
    WITH_CAVEATS,
    EffectsOption,
    JsonOption,
    LogOutputOption,
    RobotArgument,
    fail,
    keep_apart,
    print_json,
    reports_errors,
    robot_with_effects,
)
from cdprcal.completion import injected_effects

if TYPE_CHECKING:
    from cdprcal import _core
    from cdprcal.acquisition import Acquired, Guide
    from cdprcal.hardware.drives.backend import FieldbusBackend
    from cdprcal.hardware.session import Session

EXAMPLE = (
    "Example: cdprcal plan irma4 -o plan.csv && cdprcal acquire irma4 plan.csv --seed 3 -o run.mcap"
    "\n\nOver CANopen, drives simulated: cdprcal template --session -o session.yaml && cdprcal "
    "acquire irma4 plan.csv --backend canopen --session session.yaml -o can.mcap"
)


@reports_errors
def command(
    robot: RobotArgument,
    plan: Annotated[
        str, typer.Argument(metavar="PLAN", help="Plan file (CSV), as cdprcal plan writes it.")
    ],
    output: LogOutputOption,
    backend: Annotated[
        str, typer.Option(metavar="simulated|canopen|ethercat", help="Which robot to drive.")
    ] = "simulated",
    session: Annotated[
        str,
        typer.Option(metavar="FILE", help="canopen, ethercat: which device is which cable (YAML)."),
    ] = "",
    arm: Annotated[
        bool,
        typer.Option(
            "--arm",
            help="canopen, ethercat: let real drives move. Without it they are read and nothing "
            "else.",
        ),
    ] = False,
    yes: Annotated[
        bool,
        typer.Option("--yes", help="With --arm: the limits that are printed need no confirmation."),
    ] = False,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Read and print, with simulated drives too; no log."),
    ] = False,
    seconds: Annotated[float, typer.Option(help="How long a dry run reads.")] = 5.0,
    seed: Annotated[
        int,
        typer.Option(min=0, help="Simulated: of where it hangs at power-on, offsets and noise."),
    ] = 1,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect",
            metavar="NAME=VALUES",
            autocompletion=injected_effects,
            help="Simulated: an imperfection of the plant, by its name in the catalogue; may be "
            "repeated.",
        ),
    ] = None,
    truth: Annotated[
        str,
        typer.Option(
            metavar="FILE", help="Simulated: also write the true pose of every sample, as JSON."
        ),
    ] = "",
    speed: Annotated[
        float,
        typer.Option(min=0.0, help="Simulated: seconds per second; 0: as fast as it goes."),
    ] = 0.0,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Instead of the plan's transition times: as fast as the platform's slowest mode "
            "and the speed of the winches allow. Their tension loops must damp its swings.",
        ),
    ] = False,
    until: Annotated[
        str,
        typer.Option(
            metavar="ACCURACY",
            help="Stop, after three rests (with --motion, ten seconds) or more, when the initial "
            "pose is known this well (1 sigma, worst axis), for example 5mm,0.5deg (5mm where the "
            "platform cannot turn); the stops of "
            "the plan are then visited in the order in which they teach most, and go on while "
            "calibrate would have caveats. Exit code 1 when all of them are not enough, 3 when "
            "they are but for caveats.",
        ),
    ] = "",
    diagnose: Annotated[
        bool,
        typer.Option(
            "--diagnose",
            help="Diagnose after every rest (with --motion, set-point), go to the plan's stops "
            "that tell apart what looks alike so far, and end the run when more would not change "
            "the answer: the same effects, and no rival left or none that this plan tells apart. "
            "For plans with --order random.",
        ),
    ] = False,
    motion: Annotated[
        bool,
        typer.Option(
            "--motion",
            help="Wait for no rest: the platform passes the stops and its motion is what is "
            "measured, inertia included. For calibrate --motion; with --until the run ends when "
            "it says that the pose is known.",
        ),
    ] = False,
    corridor_m: Annotated[
        float | None,
        typer.Option(
            "--corridor-m",
            help="How far the platform may leave the box of the plan's poses and ways (those that "
            "--until and --diagnose choose, too), by the estimate after every rest and the sensors "
            "since. Where three sigma are more they count.",
            show_default="0.1, or 5 % of the plan's longest way where that is more",
        ),
    ] = None,
    floor_m: Annotated[
        float | None,
        typer.Option("--floor-m", help="z that no point of the platform may go below."),
    ] = None,
    effects: EffectsOption = None,
    rate_hz: Annotated[
        float | None,
        typer.Option(
            "--rate-hz",
            help="Rows of the log per second, at most 100.",
            show_default="10, with --motion 100",
        ),
    ] = None,
    live: LiveOption = False,
    live_stop: LiveStopOption = False,
    port: PortOption = 0,
    json: JsonOption = False,
) -> None:
    """Run the start-up procedure: tensions at power-on, to tau_0, through all set-points of a plan.

    The platform is measured wherever it comes to rest, or with --motion on its way, and the initial
    pose is estimated while it goes on. Ctrl-C, a closed terminal, a fault of a sensor or drive, a
    slack or overloaded cable, a full disk: the winches stop and lock, and the log is kept. It holds
    the robot file, the plan and the seed: all that is needed to solve again. Exit code 1: the robot
    was stopped early. 0: the log is whole, whatever calibrate will say of it; with --until, of the
    pose, too.
    """
    from pathlib import Path

    from cdprcal import _core
    from cdprcal.acquisition import (
        Guide,
        PoseGuard,
        PowerOn,
        acquire,
        parse_accuracy,
        start_up_options,
        start_up_plan,
    )
    from cdprcal.acquisition.beside import Beside, LogBeside
    from cdprcal.acquisition.monitor import Monitor
    from cdprcal.cli import devices
    from cdprcal.hardware import BACKENDS
    from cdprcal.hardware.simulated import SimulatedBackend
    from cdprcal.io import AcquisitionInputs, open_live_log
    from cdprcal.io.files import refuse_unwritable, shown_path, write_text
    from cdprcal.io.log_file import is_mcap_name
    from cdprcal.io.replacing import check_ending, may_replace
    from cdprcal.io.result_file import cdprcal_version
    from cdprcal.results import truth_text

    if backend not in BACKENDS:
        fail(f"--backend: {backend!r} is not one of {', '.join(BACKENDS)}")
    rate_hz = rate_hz if rate_hz is not None else 100.0 if motion else 10.0
    if not 0.0 < rate_hz <= 100.0:
        fail("--rate-hz: must be above 0 and at most 100")
    keep_apart(
        {"-o": output, "--truth": truth},
        {
            "robot file": robot,
            "plan": plan,
            "session file": session,
            "--effects": effects or [],
        },
    )
    is_mcap_name(Path(output))
    if truth:
        check_ending(Path(truth), "truth")
        refuse_unwritable(Path(truth))
        if not may_replace(Path(truth), "truth"):
            fail(
                f"{shown_path(truth)}: exists already and is no earlier truth; give another name "
                "with --truth"
            )
    the_robot = robot_with_effects(robot, effects)
    asked = parse_accuracy(until, turns="R" in the_robot.platform.motion) if until else None
    the_plan, plan_text = plan_of(the_robot, plan)
    shown = live_page(live, live_stop, port, the_robot, the_plan, output, bool(until))
    options = _core.SimulatorOptions(
        seed=seed, effects=[_core.parse_injected_effect(text, the_robot) for text in effect or []]
    )
    visits, patience = (
        start_up_plan(the_plan, quick=quick),
        start_up_options(the_plan, wait_for_rest=not motion),
    )
    wired: Session | None = None
    if backend == "simulated":
        if session or arm or yes or dry_run:
            fail("--session, --arm, --yes and --dry-run: need --backend canopen or ethercat")
        startup = _core.StartUp(the_robot, visits, patience)
        paced = speed > 0.0
    else:
        wired = devices.session_for(backend, session)
        devices.refuse_simulator_options(wired, effects=bool(effect), truth=bool(truth))
        startup = devices.start_up(wired, the_robot, visits, patience)
        paced = wired.simulated is None or wired.simulated.speed > 0.0
    pose_guard = PoseGuard(
        the_robot, the_plan, corridor_m, -math.inf if floor_m is None else floor_m
    )
    power_on = PowerOn(the_robot, patience)
    guide = Guide(
        the_robot,
        the_plan,
        startup,
        asked=asked,
        diagnoses=diagnose,
        quick=quick,
        in_motion=motion,
        background=paced,
        on_way=pose_guard.admit,
    )
    device: SimulatedBackend | FieldbusBackend
    if wired is None:
        device = SimulatedBackend.somewhere(
            the_robot, the_plan, options, velocity_limit_m_s=startup.velocity_limit_m_s, speed=speed
        )
    else:
        armed = not dry_run and (arm or wired.is_simulated)
        device = devices.connect(wired, the_robot, the_plan, options, armed=armed)
        if not armed:
            devices.run_dry(device, seconds, json=json)
        devices.confirm(device, yes=yes)
    settings = device.settings | {
        "robot": the_robot.name,
        "quick": quick,
        "until": until,
        "diagnose": diagnose,
        "motion": motion,
        "corridor_m": pose_guard.margin_m,
        "floor_m": floor_m,
        "log_rate_Hz": rate_hz,
        "version": cdprcal_version(),
    }
    inputs = AcquisitionInputs(_core.to_yaml(the_robot), plan_text, settings)
    try:
        log = open_live_log(
            output,
            the_robot.cable_count,
            inputs,
            rate_hz,
            inertial_unit=device.settings["inertial_unit"],
        )
    except BaseException:
        device.stop()
        raise
    poses: list[tuple[float, _core.Pose]] = []
    news = devices.News(device)
    with (
        shown as page,
        Monitor(
            the_robot,
            the_plan,
            output,
            guided=asked is not None,
            beside=Beside("terminal") if paced else None,
        ) as monitor,
    ):

        def watch(
            command: _core.StartUpCommand, sample: _core.RobotSample, logged: bool
        ) -> dict[str, object] | None:
            if truth and logged:
                assert hasattr(device, "truth")  # refuse_simulator_options saw to that
                poses.append((sample.time_s, device.truth().pose))
            event = news.tell(monitor.tell)
            estimate = guide.step(command, sample, logged)
            monitor.show(command, sample, estimate)
            page.show(command, sample, logged, estimate, pose_guard.place)
            if estimate is not None:
                pose_guard.learn(estimate)
                event["estimate"] = estimate.as_event()
            when = {"time_s": sample.time_s, "state": command.state.name}
            return when | event if event else None

        def stop() -> bool:
            return monitor.stop_wanted() or page.stop_wanted

        run = acquire(
            startup,
            device,
            LogBeside(log) if paced else log,
            log_rate_Hz=rate_hz,
            stop=stop,
            watch=watch,
            guard=lambda sample: power_on.look(sample) or pose_guard.look(sample),
        )
        page.end(run)
    guide.close()
    document = run_as_dict(run, the_plan, output) | {
        "estimates": [estimate.as_event() for estimate in guide.estimates],
        "asked": None
        if asked is None
        else {
            "position_sigma_m": asked.position_m,
            "rotation_sigma_rad": asked.rotation_rad if math.isfinite(asked.rotation_rad) else None,
            "reached": guide.reached,
        },
        "settled": guide.settled or None,
        "caveats": [caveat.as_dict() for caveat in guide.caveats],
    }
    if json:
        print_json(document)
    else:
        monitor.print_end(run, robot, guide)
    if truth:  # at last: how the run ended is said whatever becomes of this file
        write_text(Path(truth), truth_text(the_robot, poses))
    raise typer.Exit(exit_code(run, guide, asked))


def exit_code(run: Acquired, guide: Guide, asked: _core.AskedAccuracy | None) -> int:
    """Of a run, and where an accuracy was asked for of the pose."""
    if run.reason:
        return UNTRUSTED
    if asked is None or guide.reached:
        return DONE
    severities = {caveat.severity for caveat in guide.caveats}
    return WITH_CAVEATS if severities and "error" not in severities else UNTRUSTED


def run_as_dict(run: Acquired, plan: _core.Plan, log: str) -> dict[str, object]:
    """The document of ``acquire --json``."""
    return {
        "state": run.state.name,
        "reason": run.reason,
        "log": log,
        "samples": run.samples,
        "duration_s": run.duration_s,
        "rests": [
            {"setpoint": rest.setpoint + 1, "begin_s": rest.begin_s, "end_s": rest.end_s}
            for rest in run.rests
        ],
        "setpoints": 1 + plan.measured_count,
    }
