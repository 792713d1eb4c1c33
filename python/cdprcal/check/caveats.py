"""The caveats of a calibration together with what is wrong with its log and robot file."""

from __future__ import annotations

from cdprcal import _core
from cdprcal.check.check import check_log
from cdprcal.check.robot import sizes_of
from cdprcal.findings import Finding
from cdprcal.io.loaded import LogFile
from cdprcal.trust import caveats_of

#: What a calibration leaves out by itself, rest by rest; ``gated`` says where.
_LEFT_OUT = ("slack",)


def caveats_with_log(
    robot: _core.Robot, file: LogFile, calibration: _core.Calibration, segment: int = -1
) -> tuple[Finding, ...]:
    """Why a pose is not to be used (errors) or with care (warnings); none when neither.

    Errors are those for which ``check`` says that a log or robot file cannot be trusted; where
    there is no pose, the signs, orders and units with which there would be one. ``segment`` is that
    of the calibration. Raises InputError as ``check_log`` does.
    """
    if calibration.result.status != _core.CalibrationStatus.converged:
        return _misread(robot, file.log) if segment == -1 else ()
    found = [*sizes_of(robot), *check_log(robot, file, segment).findings]
    errors = [f for f in found if f.severity == "error" and f.code not in _LEFT_OUT]
    return (*errors, *caveats_of(calibration))


def _misread(robot: _core.Robot, log: _core.Log) -> tuple[Finding, ...]:
    """What ``diagnose`` sets right before it looks for effects, if that makes the log agree."""
    try:
        found = _core.diagnose(robot, [log], _core.DiagnoseOptions(effects=[])).faults
    except _core.InputError:  # a log in which nothing can be looked for
        return ()
    return tuple(
        Finding(
            severity="error",
            code="misread",
            message=f"the readings look as if {fault.text}",
            remedy="correct the log or its mapping file, or let cdprcal diagnose write a robot "
            "file that sets it right (-o)",
        )
        for fault in found
    )
