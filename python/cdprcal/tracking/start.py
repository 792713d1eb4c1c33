"""Where a track starts: a calibration of a log, or of what a result file holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.io.loaded import LogFile
from cdprcal.io.result_file import calibrate_options, load_result


def saved_start(path: str, robot: _core.Robot) -> tuple[LogFile, _core.CalibrateOptions, bool]:
    """What a result file was calibrated from: log, options, and whether motion counted.

    Raises InputError for one that is no calibration, or of another robot.
    """
    result = load_result(path)
    if result.command != "calibrate":
        raise InputError(
            f"{result.source}: is a diagnosis; give its log, or the result of calibrate -o"
        )
    require_robot(result.source, result.robot, robot)
    options = calibrate_options(result.options)
    return LogFile(Path(path), "csv", result.logs[0]), options, bool(result.options.get("motion"))


def require_robot(what: str, calibrated: _core.Robot, robot: _core.Robot) -> None:
    """Raises InputError naming what was calibrated with another robot file."""
    if _core.to_yaml(calibrated) != _core.to_yaml(robot):
        raise InputError(
            f"{what}: is of {calibrated.name} with another robot file than that of {robot.name}; "
            "give the robot that was calibrated"
        )


def motion_would_tell(calibration: _core.Calibration, log: _core.Log) -> bool:
    """Whether the balance in motion may say what a log with hardly a rest does not."""
    return calibration.static_poses < 2 and bool(np.isfinite(log.tension_N).any())


def require_start(calibration: _core.Calibration, log: _core.Log, motion: str) -> None:
    """Raises InputError for a calibration without a pose that can be trusted.

    ``motion``: how motion is made to count; '' where it counted.
    """
    if calibration.result.status == _core.CalibrationStatus.converged:
        return
    hint = ""
    if motion and motion_would_tell(calibration, log):
        hint = f"{motion}, as this one hardly rests, "
    raise InputError(
        f"{log.source or 'log'}: no initial pose to track from: {calibration.result.reason}; "
        f"give {hint}a log that calibrates, or the robot file that diagnose -o writes"
    )
