"""All checks of a log, in order, and the report they add up to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.check.coverage import check_coverage, find_equilibria
from cdprcal.check.plausibility import check_gravity, check_jumps, check_ranges
from cdprcal.check.sensors import check_presence, check_stuck
from cdprcal.check.signals import SignalReport, describe_signals
from cdprcal.check.subject import Subject
from cdprcal.check.tension import check_tensions
from cdprcal.check.timing import check_sampling, check_segments
from cdprcal.findings import Finding, worst_first
from cdprcal.io.damaged_csv import load_log_leniently
from cdprcal.io.files import shown_path
from cdprcal.io.loaded import LogFile
from cdprcal.io.log_file import require_cable_count


@dataclass(frozen=True)
class CheckReport:
    """What was found, the worst first, and what the log holds."""

    file: LogFile
    robot: _core.Robot
    segments: tuple[_core.SampleRange, ...]
    run: int
    equilibria: tuple[_core.Equilibrium, ...]
    signals: tuple[SignalReport, ...]
    findings: tuple[Finding, ...]

    @property
    def trusted(self) -> bool:
        """No finding is an error."""
        return all(finding.severity != "error" for finding in self.findings)

    def as_dict(self) -> dict[str, Any]:
        """The report as plain data, for ``check --json``."""
        time = self.file.log.time_s
        return {
            "trusted": self.trusted,
            "log": shown_path(self.file.path),
            "format": self.file.format,
            "robot": self.robot.name,
            "samples": len(self.file.log),
            "segments": [
                {
                    "begin_s": float(time[segment.begin]),
                    "end_s": float(time[segment.end - 1]),
                    "samples": len(segment),
                    "run": number == self.run,
                }
                for number, segment in enumerate(self.segments)
            ],
            "equilibria": [{"begin_s": e.begin_s, "end_s": e.end_s} for e in self.equilibria],
            "signals": [signal.as_dict() for signal in self.signals],
            "findings": [finding.as_dict() for finding in self.findings],
        }


def check_file(robot: _core.Robot, path: str | Path, segment: int = -1) -> CheckReport:
    """Reads a log of any kind, damaged or not, and checks it. Raises InputError when it cannot be
    read at all or is another robot's."""
    return check_log(robot, load_log_leniently(path), segment)


def check_log(robot: _core.Robot, file: LogFile, segment: int = -1) -> CheckReport:
    """Checks one segment of a log (from 0; -1 is the last) against a robot. Raises InputError.

    What the robot lists as known (``effects:``) is taken into account before anything is judged.
    """
    require_cable_count(file, robot)
    given = robot
    if robot.effects:
        robot, log = _core.with_known_effects(robot, file.log)
        file = replace(file, log=log)
    segments = _core.segments(file.log)
    run = choose_segment(len(segments), segment)
    subject = Subject(robot, file, slice(segments[run].begin, segments[run].end))
    subject.findings.extend(file.findings)
    if not subject.is_list:
        check_segments(subject, segments, run)
        check_sampling(subject)
    check_presence(subject)
    check_ranges(subject)
    check_gravity(subject)
    equilibria = find_equilibria(subject) if subject.time_s.size >= 3 else []
    signals = describe_signals(subject, equilibria)
    if subject.time_s.size >= 3:
        if not subject.is_list:
            check_jumps(subject)
            check_stuck(subject, signals)
        check_tensions(subject)
        check_coverage(subject, equilibria)
    findings = worst_first(subject.findings)
    return CheckReport(file, given, tuple(segments), run, tuple(equilibria), signals, findings)


def choose_segment(count: int, segment: int) -> int:
    """The number of the segment meant, from 0; -1 is the last. Raises InputError."""
    if not -1 <= segment < count:
        raise InputError(
            f"--segment: {segment} is not one of the log's {count} segments (0 to {count - 1}; "
            "-1 is the last)"
        )
    return segment % count
