"""What the demonstration does, step by step, without printing anything."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.acquisition import Acquired, acquire, start_up_options, start_up_plan
from cdprcal.demo.folder import MARK
from cdprcal.hardware.simulated import SimulatedBackend
from cdprcal.io import AcquisitionInputs, load_log, open_live_log
from cdprcal.io.files import write_text
from cdprcal.io.replacing import signed

Say = Callable[[str], None]

#: Imperfections to hide, of a size that robots of a few metres have; for any number of cables.
HIDDEN = (
    "cable_sag=0.06",
    "centre_of_mass=0.012,-0.008,0.004",
    "external_force=4,-3,0",
    "transmission_ratio=0.02",
    "cable_elasticity=30000",
)
#: Of these, what a platform must be able to turn for.
_SEEN_BY_TURNING = ("centre_of_mass",)

#: Paper Table III, trials a and b: the robot, measured.
PAPER_ROWS = (
    ("static: the paper's robot (trial a)", 2.23 * 60.0, 8, 12.0, None, 1.24),
    ("kinematic: the paper's robot (trial b)", 2.24 * 60.0, 19, 23.0, None, 5.44),
)

#: (label, method, formulation): j = τlσε and j = lσε as the paper has them, then with all that pose
#: 0 knows, then both together.
METHODS = (
    ("static, as in the paper", "static", "paper"),
    ("kinematic, as in the paper", "kinematic", "paper"),
    ("static", "static", "full"),
    ("kinematic", "kinematic", "full"),
    ("unified, the default", "unified", "full"),
)


#: Cables that the left inverse of eq. 12 can have.
_MOST_OF_PAPER = 6


def hidden_effect(robot: _core.Robot, seed: int) -> str:
    """Which imperfection a demonstration hides: one that this robot's platform shows."""
    turns = bool(np.any(_core.motion_basis(robot)[3:]))
    shown = [e for e in HIDDEN if turns or not e.startswith(_SEEN_BY_TURNING)]
    return shown[seed % len(shown)]


@dataclass(frozen=True)
class Run:
    """One simulated start-up, with what nobody told the robot."""

    log: _core.Log
    path: Path
    acquired: Acquired
    truth: list[_core.Pose]  # one a sample

    @property
    def initial_pose(self) -> _core.Pose:
        return self.truth[0]


@dataclass(frozen=True)
class Error:
    """How far an estimated initial pose is from the true one."""

    position_m: float
    rotation_rad: float  # geodesic
    angle_difference_rad: float  # paper eq. 20

    @classmethod
    def of(cls, pose: _core.Pose, truth: _core.Pose) -> Error:
        return cls(
            float(np.linalg.norm(pose.position_m - truth.position_m)),
            _core.rotation_distance_rad(pose, truth),
            _core.rotation_angle_difference_rad(pose, truth),
        )


@dataclass(frozen=True)
class Row:
    """One line of the table: a method and what it found."""

    label: str
    method: str
    formulation: str
    calibration: _core.Calibration
    duration_s: float  # acquisition and solution
    poses: int  # k, the initial one included
    error: Error | None  # None: no pose was found


@dataclass(frozen=True)
class Hidden:
    """The second part: a robot with an imperfection that its file does not know."""

    effect: str
    run: Run
    diagnosis: _core.Diagnosis
    before: Error
    after: Error

    @property
    def name(self) -> str:
        return self.effect.partition("=")[0]

    @property
    def named(self) -> bool:
        """Whether the diagnosis named it."""
        return any(effect.info.name == self.name for effect in self.diagnosis.effects)

    @property
    def among_rivals(self) -> bool:
        """Whether it named something that cannot be told apart from it with these poses."""
        return any(self.name in effect.rivals for effect in self.diagnosis.effects)


def make_plan(robot: _core.Robot, path: Path) -> _core.PlanResult:
    """The default plan, also written to a file."""
    result = _core.make_plan(robot)
    if result.status != _core.PlanStatus.planned:
        raise InputError(f"{robot.name}: no plan: {result.reason}; try another robot")
    write_text(path, signed(_core.format_plan(result.plan)))
    return result


def start_up(
    robot: _core.Robot, plan: _core.Plan, seed: int, effects: list[str], path: Path
) -> Run:
    """Hangs the robot somewhere, runs the start-up procedure and logs it."""
    startup = _core.StartUp(robot, start_up_plan(plan, quick=True), start_up_options(plan))
    options = _core.SimulatorOptions(
        seed=seed, effects=[_core.parse_injected_effect(text, robot) for text in effects]
    )
    backend = SimulatedBackend.somewhere(
        robot, plan, options, velocity_limit_m_s=startup.velocity_limit_m_s
    )
    settings = backend.settings | MARK
    inputs = AcquisitionInputs(_core.to_yaml(robot), _core.format_plan(plan), settings)
    path.unlink(missing_ok=True)  # of an earlier demonstration
    log = open_live_log(path, robot.cable_count, inputs, 10.0)
    truth: list[_core.Pose] = []

    def watch(command: _core.StartUpCommand, sample: _core.RobotSample, logged: bool) -> None:
        if logged:
            truth.append(backend.truth().pose)

    acquired = acquire(startup, backend, log, watch=watch)
    return Run(load_log(path).log, path, acquired, truth)


def calibrate_by_all_methods(robot: _core.Robot, run: Run) -> list[Row]:
    """The lines of the table, in the order of METHODS; those that a robot has."""
    rows = []
    for label, method, formulation in METHODS:
        if (method, formulation) == ("static", "paper") and robot.cable_count > _MOST_OF_PAPER:
            continue
        options = _core.CalibrateOptions(
            method=_core.parse_method(method), formulation=_core.parse_formulation(formulation)
        )
        calibration = _core.calibrate(robot, run.log, options)
        poses = calibration.result.poses
        rows.append(
            Row(
                label,
                method,
                formulation,
                calibration,
                run.acquired.duration_s + calibration.result.solve_time_s,
                calibration.static_poses + calibration.kinematic_poses,
                Error.of(poses[0], run.initial_pose) if poses else None,
            )
        )
    return rows


def write_hidden_report(robot: _core.Robot, hidden: Hidden, path: Path) -> None:
    """The page of ``cdprcal report`` about the second robot."""
    from cdprcal.report import subject_of_diagnosis, write_report

    command = ("cdprcal", "report", robot.name, str(hidden.run.path), "-o", str(path))
    write_report(subject_of_diagnosis(robot, [hidden.run.log], hidden.diagnosis, command), path)


def diagnose_hidden(
    robot: _core.Robot, plan: _core.Plan, seed: int, effect: str, path: Path, say: Say
) -> Hidden:
    """A start-up of a robot with an effect that nobody knows of, and what is made of it."""
    run = start_up(robot, plan, seed, [effect], path)
    if run.acquired.reason:
        raise InputError(
            f"--effect {effect}: the robot was stopped: {run.acquired.reason}; take a smaller one"
        )
    diagnosis = _core.diagnose(robot, [run.log], progress=say)
    return Hidden(
        effect,
        run,
        diagnosis,
        Error.of(diagnosis.initial_pose_before, run.initial_pose),
        Error.of(diagnosis.initial_pose_after, run.initial_pose),
    )
