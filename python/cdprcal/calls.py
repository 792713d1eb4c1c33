"""The calls that people write: paths, arrays and words where the core wants its own objects.

``cdprcal.calibrate("irma4", "run.csv", method="static")`` is what the command does with
``--method static``; what comes back is the core's own result.
"""

from __future__ import annotations

import os
import pathlib
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from cdprcal import _core
from cdprcal._core import (
    CalibrateOptions,
    Calibration,
    DiagnoseOptions,
    Diagnosis,
    Formulation,
    InputError,
    Log,
    Method,
    NoiseSource,
    Robot,
)
from cdprcal.check import caveats_with_log
from cdprcal.io.loaded import LogFile
from cdprcal.io.result_file import calibrate_options, calibrate_options_as_dict
from cdprcal.mapping import Reader

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
    map: Path = "",
) -> Calibration:
    """From a log to the initial pose. Look at result.status, then at caveats.

    ``robot``: a Robot, built-in name or path; ``log``: a Log, a path or a pandas.DataFrame;
    ``map``: of a file of any kind, its mapping file. Keywords are those of the command and override
    ``options``: method 'unified', 'static' or 'kinematic'; formulation 'full' or 'paper'; noise
    'data' or 'specified'; at_s: times of the poses [s]; segment: which is the run, from 0, -1 the
    last. The result's ``caveats`` are Findings: errors for which the log is not to be trusted,
    warnings with which the pose may be off by more than its σ. Raises InputError for a log that
    does not fit the robot.

    >>> calibrate("irma4", "none.csv")
    Traceback (most recent call last):
    cdprcal._core.InputError: none.csv: cannot be read: no such file or directory; check the path
    """
    the_robot = as_robot(robot)
    the_log = as_log(log, the_robot, map)
    chosen = options
    words = (method, formulation, noise, at_s, segment)
    if any(word is not None for word in words):
        chosen = _with(options or CalibrateOptions(), *words)
    found = _core.calibrate(the_robot, the_log, chosen)
    again = calibrate_options_as_dict(chosen or CalibrateOptions())
    file = LogFile(pathlib.Path(the_log.source), "csv", the_log)
    run = -1 if chosen is None else chosen.segment
    found.caveats = caveats_with_log(the_robot, file, found, run)
    found._recipe = (_calibrated, (the_robot, the_log, again))  # type: ignore[attr-defined]
    return found


def _with(
    options: CalibrateOptions,
    method: Method | str | None,
    formulation: Formulation | str | None,
    noise: NoiseSource | str | None,
    at_s: Sequence[float] | None,
    segment: int | None,
) -> CalibrateOptions:
    """A copy of options with what is not None in place of theirs."""
    kept = CalibrateOptions(
        method=options.method,
        formulation=options.formulation,
        noise=options.noise,
        allow_for_effects=options.allow_for_effects,
        at_s=list(options.at_s if at_s is None else at_s),
        segment=options.segment if segment is None else segment,
        kinematic_spacing_s=options.kinematic_spacing_s,
        guess=options.guess,
        detection=options.detection,
        solve=options.solve,
        most_starts=options.most_starts,
    )
    if method is not None:
        kept.method = _core.parse_method(str(method))
    if formulation is not None:
        kept.formulation = _core.parse_formulation(str(formulation))
    if noise is not None:
        kept.noise = _core.parse_noise_source(str(noise))
    return kept


def _calibrated(robot: Robot, log: Log, options: dict[str, Any]) -> Calibration:
    """A pickled calibration, solved again."""
    return calibrate(robot, log, calibrate_options(options))


def diagnose(
    robot: Robot | Path,
    logs: Log | Path | Sequence[Log | Path | Any] | Any,
    options: DiagnoseOptions | None = None,
    progress: Callable[[str], Any] | None = None,
    *,
    map: Path = "",
) -> Diagnosis:
    """Names what the model lacks, from one or more logs of one robot. Look at verdict first.

    ``robot``, ``logs`` and ``map`` as for ``calibrate``; one log or a sequence of them.
    ``progress`` is called with each step's name; False ends the search and keeps what was found.
    Raises InputError for a log that does not fit the robot.
    """
    the_robot = as_robot(robot)
    if isinstance(logs, str) or not isinstance(logs, Sequence):
        logs = [logs]
    the_logs = [as_log(log, the_robot, map) for log in logs]
    found = _core.diagnose(the_robot, the_logs, options, progress)
    if options is None:
        found._recipe = (diagnose, (the_robot, the_logs))  # type: ignore[attr-defined]
    return found
