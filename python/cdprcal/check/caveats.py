"""The caveats of a calibration together with what is wrong with its log and robot file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cdprcal import _core
from cdprcal.check.check import check_log, choose_segment
from cdprcal.check.plausibility import check_ranges
from cdprcal.check.robot import sizes_of
from cdprcal.check.subject import Subject
from cdprcal.check.tension import check_tensions
from cdprcal.check.timing import check_segments
from cdprcal.findings import Finding
from cdprcal.io.files import shown_path
from cdprcal.io.loaded import LogFile
from cdprcal.trust import caveats_of

#: What a calibration leaves out by itself, rest by rest; ``gated`` says where.
_LEFT_OUT = ("slack",)
#: What a swing makes untrue whose moments balance in motion, however gentle it is.
_BUT_IN_MOTION = ("too_few_poses",)
#: Of numbers that seem to say that nothing was read.
_MARK = "missing_mark"
#: Fewer tell nothing of tensions.
_LEAST_SAMPLES = 3
#: Groups of a log that read nothing where all of their numbers are zero.
_READ = ("length_m", "swivel_rad", "tension_N")


def caveats_with_log(
    robot: _core.Robot, file: LogFile, calibration: _core.Calibration, segment: int = -1
) -> tuple[Finding, ...]:
    """Why a pose is not to be used (errors) or with care (warnings); none when neither.

    Errors are those for which ``check`` says that a log or robot file cannot be trusted; where
    there is no pose, rather the signs, orders and units with which there would be one. Of
    warnings, those of ``pauses`` come last. ``segment`` is that of the calibration. Raises
    InputError as ``check_log`` does.
    """
    about_run = pauses(robot, [file], segment)
    absurd = [f for f in sizes_of(robot) if f.severity == "error"]
    found = check_log(robot, file, segment).findings
    moves = any(m.moves for m in calibration.problem.measurements)
    settled = _LEFT_OUT + (_BUT_IN_MOTION if moves else ())
    errors = absurd + [f for f in found if f.severity == "error" and f.code not in settled]
    if calibration.result.status != _core.CalibrationStatus.converged:
        # What was not read looks like a unit, or a sign.
        no_reason = not absurd and all(finding.code != _MARK for finding in found)
        tried = no_reason and segment == -1 and _may_be_misread(calibration, file.log)
        return (*((_misread(robot, file.log) if tried else ()) or errors), *about_run)
    return (*errors, *caveats_of(calibration), *about_run)


def marks(robot: _core.Robot, files: Sequence[LogFile]) -> tuple[Finding, ...]:
    """The errors of ``check`` about numbers in the last run that seem to say that nothing was read.

    Of several logs each is named.
    """
    found: list[Finding] = []
    for file in files:
        run = _core.segments(file.log)[-1]
        if len(run) < _LEAST_SAMPLES:
            continue
        subject = Subject(robot, file, slice(run.begin, run.end))
        check_ranges(subject)
        check_tensions(subject)
        found += _named(files, file, [f for f in subject.findings if f.code == _MARK])
    return tuple(found)


def _named(files: Sequence[LogFile], file: LogFile, findings: list[Finding]) -> list[Finding]:
    """Findings of one of several logs with its name."""
    name = f"{shown_path(file.path)}: " if len(files) > 1 else ""
    return [replace(finding, message=name + finding.message) for finding in findings]


def pauses(robot: _core.Robot, files: Sequence[LogFile], segment: int = -1) -> tuple[Finding, ...]:
    """The warnings of ``check`` about pauses, which decide what the run is and its initial pose.

    None where a segment was chosen. Of several logs each is named. Raises InputError.
    """
    found: list[Finding] = []
    for file in files if segment == -1 else ():
        segments = _core.segments(file.log)
        run = choose_segment(len(segments), segment)
        subject = Subject(robot, file, slice(segments[run].begin, segments[run].end))
        check_segments(subject, segments, run)
        warnings = [f for f in subject.findings if f.severity == "warning"]
        found += _named(files, file, warnings)
    return tuple(found)


def _may_be_misread(calibration: _core.Calibration, log: _core.Log) -> bool:
    """Whether signs, orders or units could be why there is no pose.

    Trying all of them takes many seconds, and says nothing of a log that never rests, of zeros, or
    of cables that do not pull.
    """
    static = (m.kind == _core.PoseKind.static_pose for m in calibration.problem.measurements)
    if not calibration.equilibria and not any(static):
        return False
    groups = [values for name in _READ if (values := getattr(log, name)).size]
    slack = log.tension_N.size > 0 and (log.tension_N <= 0.0).all()
    return not slack and all(values.any() for values in groups)


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
