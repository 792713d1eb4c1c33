"""The calls that people write: paths, arrays and words where the core wants its own objects.

``cdprcal.calibrate("irma4", "run.csv", method="static")`` is what the command does with
``--method static``; what comes back is the core's own result.
"""

from __future__ import annotations

import copy
import functools
import os
import pathlib
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from numpy.typing import ArrayLike

from cdprcal import _core
from cdprcal._core import (
    CalibrateOptions,
    Calibration,
    DiagnoseOptions,
    Diagnosis,
    Formulation,
    FrameResult,
    InjectedEffect,
    InputError,
    Log,
    Method,
    NoiseSource,
    Plan,
    Robot,
    RobotSample,
    SimulatorOptions,
    StartUpCommand,
    StartUpOptions,
    StartUpPlan,
    StartUpRun,
    Track,
)
from cdprcal.check import caveats_with_log
from cdprcal.io.loaded import LogFile
from cdprcal.mapping import Reader
from cdprcal.planning.start_up import start_up_plan
from cdprcal.tracking.start import require_robot, require_start

Path: TypeAlias = str | os.PathLike[str]


def as_robot(robot: Robot | Path) -> Robot:
    """A robot, or the one of a file or built-in name. Raises InputError."""
    return robot if isinstance(robot, Robot) else _core.load_robot(os.fspath(robot))


def as_log(log: Log | Path | Any, robot: Robot, map: Path = "") -> Log:
    """A log, a file of one (with ``map`` of any kind), or a pandas.DataFrame. Raises InputError."""
    if isinstance(log, Log):
        return log
    if isinstance(log, str | os.PathLike):
        return Reader(robot, os.fspath(map) if map else "").load(os.fspath(log)).log
    if hasattr(log, "columns"):
        return Log.from_dataframe(log)
    raise InputError(
        f"log: is a {type(log).__name__}; give a Log, the path of a file or a pandas.DataFrame"
    )


def _as_logs(logs: Any, robot: Robot, map: Path) -> list[Log]:
    """One log or several, each as ``as_log`` takes it."""
    several = isinstance(logs, Sequence) and not isinstance(logs, str)
    return [as_log(log, robot, map) for log in (logs if several else [logs])]


def calibrate(
    robot: Robot | Path,
    log: Log | Path | Any,
    options: CalibrateOptions | None = None,
    *,
    method: Method | str | None = None,
    formulation: Formulation | str | None = None,
    noise: NoiseSource | str | None = None,
    at_s: Sequence[float] | None = None,
    segment: int | None = None,
    motion: bool = False,
    map: Path = "",
) -> Calibration:
    """From a log to the initial pose. Look at result.status, then at caveats.

    ``robot``: a Robot, built-in name or path; ``log``: a Log, a path or a pandas.DataFrame;
    ``map``: of a file of any kind, its mapping file. Keywords are those of the command and override
    ``options``: method 'unified', 'static' or 'kinematic'; formulation 'full' or 'paper'; noise
    'data' or 'specified'; at_s: times of the poses [s]; segment: which is the run, from 0, -1 the
    last; motion: the balance counts between the rests too. The result's ``caveats`` are Findings:
    errors for which the log is not to be trusted, warnings with which the pose may be off by more
    than its σ. Raises InputError for a log that does not fit the robot.

    >>> calibrate("irma4", "none.csv")
    Traceback (most recent call last):
    cdprcal._core.InputError: none.csv: cannot be read: no such file or directory; check the path
    """
    the_robot = as_robot(robot)
    the_log = as_log(log, the_robot, map)
    chosen = _with(
        options, method=method, formulation=formulation, noise=noise, at_s=at_s, segment=segment
    )
    if motion:
        found = _core.calibrate_in_motion(the_robot, the_log, chosen).calibration
    else:
        found = _core.calibrate(the_robot, the_log, chosen)
    file = LogFile(pathlib.Path(the_log.source), "csv", the_log)
    run = -1 if chosen is None else chosen.segment
    found.caveats = caveats_with_log(the_robot, file, found, run)
    again = functools.partial(calibrate, motion=motion)
    found._recipe = (again, (the_robot, the_log, copy.copy(chosen)))  # type: ignore[attr-defined]
    return found


#: Options that may be given as words, or as any sequence.
_READ: dict[str, Callable[[Any], Any]] = {
    "method": lambda word: _core.parse_method(str(word)),
    "formulation": lambda word: _core.parse_formulation(str(word)),
    "noise": lambda word: _core.parse_noise_source(str(word)),
    "at_s": list,
}


def _with(options: CalibrateOptions | None, **given: Any) -> CalibrateOptions | None:
    """Options with what is not None in place of theirs; as they are where all of it is."""
    told = {name: value for name, value in given.items() if value is not None}
    if not told:
        return options
    changed = copy.copy(options or CalibrateOptions())
    for name, value in told.items():
        setattr(changed, name, _READ[name](value) if name in _READ else value)
    return changed


def diagnose(
    robot: Robot | Path,
    logs: Log | Path | Sequence[Log | Path | Any] | Any,
    options: DiagnoseOptions | None = None,
    progress: Callable[[str], Any] | None = None,
    *,
    motion: bool = False,
    map: Path = "",
) -> Diagnosis:
    """Names what the model lacks, from one or more logs of one robot. Look at verdict first.

    ``robot``, ``logs`` and ``map`` as for ``calibrate``; one log or a sequence of them; motion:
    moments at which the platform moves count as rests do (as ``options.motion``).
    ``progress`` is called with each step's name; False ends the search and keeps what was found.
    Raises InputError for a log that does not fit the robot.
    """
    the_robot = as_robot(robot)
    the_logs = _as_logs(logs, the_robot, map)
    chosen = DiagnoseOptions() if options is None else copy.copy(options)
    chosen.motion = chosen.motion or motion
    found = _core.diagnose(the_robot, the_logs, chosen, progress)
    found._recipe = (diagnose, (the_robot, the_logs, chosen))  # type: ignore[attr-defined]
    return found


def geometry(
    robot: Robot | Path,
    logs: Log | Path | Sequence[Log | Path | Any] | Any,
    *,
    offset: str = "common",
    scale: str = "common",
    poses: str = "automatic",
    map: Path = "",
) -> FrameResult:
    """Where the pulleys of a frame are, from the lengths at many poses. Look at status first.

    ``robot``, ``logs`` and ``map`` as for ``diagnose``; ``offset``, ``scale`` and
    ``poses`` as the command's: 'none', 'common' or 'each'; 'common' or 'each'; 'automatic',
    'samples' or 'rests'. Raises InputError for logs that
    do not fit the robot or hold no lengths.
    """
    the_robot = as_robot(robot)
    the_logs = _as_logs(logs, the_robot, map)
    return _core.find_frame(the_robot, the_logs, offset=offset, scale=scale, poses=poses)


def track(
    robot: Robot | Path,
    log: Log | Path | Any,
    calibration: Calibration | None = None,
    *,
    segment: int = -1,
    motion: bool = False,
    map: Path = "",
) -> Track:
    """Pose, twist and their covariances at every sample of a run.

    ``robot``, ``log`` and ``map`` as for ``calibrate``; ``calibration``: of the start-up whose
    counting the log goes on with (None: of this log, with ``motion`` as for ``calibrate``);
    ``segment``: which is the run, from 0, -1 the last. Look at ``trusted``. Raises InputError for a
    calibration without a pose that can be trusted, and for one of another robot.
    """
    the_robot = as_robot(robot)
    the_log = as_log(log, the_robot, map)
    if calibration is None:
        calibration = calibrate(the_robot, the_log, segment=segment, motion=motion)
        require_start(calibration, the_log, "" if motion else "motion=True")
    else:
        require_robot("calibration", calibration.problem.robot, the_robot)
    return _core.track(calibration, the_log, segment)


def simulate_startup(
    robot: Robot | Path,
    plan: StartUpPlan | Plan | Path,
    *,
    effects: Sequence[InjectedEffect | str] | InjectedEffect | str | None = None,
    seed: int | None = None,
    simulator: SimulatorOptions | None = None,
    startup: StartUpOptions | None = None,
    control_rate_Hz: float = 100.0,
    log_rate_Hz: float = 10.0,
    initial_tension_N: ArrayLike | None = None,
    progress: Callable[[StartUpCommand, RobotSample], Any] | None = None,
) -> StartUpRun:
    """The start-up procedure on a simulated robot. Look at state.

    ``robot``: a Robot, built-in name or path; ``plan``: a Plan, the path of a plan file, or a
    StartUpPlan; ``effects``: hidden in the robot, as ``--effect`` has them ('mass=0.7'), one or
    several; ``seed``: of where it hangs and of its noise. Both go before those of ``simulator``,
    which stays as it is, or stand alone. Of a plan its tensions are visited, as fast as the
    platform's slowest mode allows. ``progress(command, sample)`` is called with every command;
    False stops the run. Raises InputError for an effect that there is not.
    """
    if not isinstance(plan, StartUpPlan):
        stops = plan if isinstance(plan, Plan) else _core.read_plan(os.fspath(plan))
        plan = start_up_plan(stops, quick=True)
    the_robot = as_robot(robot)
    options = copy.copy(simulator or SimulatorOptions())
    if seed is not None:
        options.seed = seed
    if effects is not None:
        effects = [effects] if isinstance(effects, str | InjectedEffect) else effects
        options.effects = [
            _core.parse_injected_effect(effect, the_robot) if isinstance(effect, str) else effect
            for effect in effects
        ]
    return _core.simulate_startup(
        the_robot,
        plan,
        simulator=options,
        startup=startup or StartUpOptions(),
        control_rate_Hz=control_rate_Hz,
        log_rate_Hz=log_rate_Hz,
        initial_tension_N=initial_tension_N,
        progress=progress or (lambda *_: None),  # Ctrl-C is heard where Python runs
    )
