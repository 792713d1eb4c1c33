"""What a report is about: a robot, its logs, and what was made of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.check import marks, pauses
from cdprcal.diagnosis.document import TRUSTED
from cdprcal.findings import Finding
from cdprcal.io.events import told_in
from cdprcal.io.loaded import LogFile
from cdprcal.io.result_file import Result, calibrate_options, calibrate_options_as_dict, naming
from cdprcal.results import calibration_as_dict

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Run:
    """One log and its calibration (the document of ``calibrate --json``).

    ``corrected`` is the same with what the diagnosis found in the model; None when that is nothing.
    ``told``: what ``acquire --diagnose`` said of the run while it went on, estimate by estimate.
    """

    log: _core.Log
    calibration: dict[str, Any]
    options: dict[str, Any]
    findings: tuple[Finding, ...] = ()
    corrected: dict[str, Any] | None = None
    told: tuple[dict[str, Any], ...] = ()

    @property
    def best(self) -> dict[str, Any]:
        """What to show: the corrected calibration, where there is one with a pose."""
        if self.corrected is not None and self.corrected["poses"]:
            return self.corrected
        return self.calibration


@dataclass(frozen=True)
class Subject:
    """A robot, its runs, and the diagnosis of all of them (the document of ``diagnose --json``).

    ``diagnosis`` is None when there is none; ``no_diagnosis`` says why. ``command`` repeats the
    report.
    """

    robot: _core.Robot
    runs: tuple[Run, ...]
    diagnosis: dict[str, Any] | None
    no_diagnosis: str
    command: tuple[str, ...]

    @property
    def corrected(self) -> _core.Robot:
        """The robot with what the diagnosis found."""
        if self.diagnosis is None or not self.diagnosis["effects"]:
            return self.robot
        return _core.parse_robot(self.diagnosis["corrected"], "corrected robot file")

    @property
    def converged(self) -> bool:
        """Whether every log gave an initial pose, with what was found in the model."""
        return all(run.best["status"] == "converged" for run in self.runs)

    @property
    def trusted(self) -> bool:
        """Whether poses were found and nothing is left unexplained."""
        return self.converged and (self.diagnosis is None or self.diagnosis["verdict"] in TRUSTED)


def subject_of_logs(
    robot: _core.Robot,
    files: Sequence[LogFile],
    command: Sequence[str],
    progress: Progress = lambda step: None,
) -> Subject:
    """Calibrates each log by itself, then diagnoses all together. Raises InputError."""
    runs = tuple(
        replace(_calibrated(robot, file.log, None, file), told=told_in(file.path)) for file in files
    )
    diagnosis, why_not = _diagnosed(robot, [file.log for file in files], progress)
    return _with_corrected(Subject(robot, runs, diagnosis, why_not, tuple(command)))


def subject_of_diagnosis(
    robot: _core.Robot,
    logs: Sequence[_core.Log],
    diagnosis: _core.Diagnosis,
    command: Sequence[str],
) -> Subject:
    """Of logs that were diagnosed already."""
    from cdprcal.diagnosis import diagnosis_as_dict

    runs = tuple(_calibrated(robot, log, None) for log in logs)
    document = diagnosis_as_dict(diagnosis, robot, logs=logs)
    return _with_corrected(Subject(robot, runs, document, "", tuple(command)))


def subject_of_results(results: Sequence[Result], command: Sequence[str]) -> Subject:
    """From result files, whose documents are shown as they are: calibrations, a diagnosis, or both.

    A log that was diagnosed only is calibrated here. Raises InputError when the files are of
    different robots or logs.
    """
    with naming(results[0].source):
        return _of_results(results, command)


def _of_results(results: Sequence[Result], command: Sequence[str]) -> Subject:
    robot = results[0].robot
    if any(_core.to_yaml(other.robot) != _core.to_yaml(robot) for other in results):
        raise InputError("the results are of different robot files: make a report of each")
    diagnoses = [result for result in results if result.command == "diagnose"]
    if len(diagnoses) > 1:
        raise InputError(f"{len(diagnoses)} diagnoses: a report shows one; make a report of each")
    calibrated = {
        _core.format_log(result.logs[0]): result
        for result in results
        if result.command == "calibrate"
    }
    if not diagnoses:
        runs = [_of_result(result) for result in calibrated.values()]
        why_not = "give one, of cdprcal diagnose ROBOT LOG -o FILE.json, beside the results"
        return Subject(robot, tuple(runs), None, why_not, tuple(command))
    runs = []
    for log in diagnoses[0].logs:
        found = calibrated.pop(_core.format_log(log), None)
        runs.append(_calibrated(robot, log, None) if found is None else _of_result(found))
    if calibrated:
        names = ", ".join(result.logs[0].source for result in calibrated.values())
        raise InputError(
            f"{names}: was calibrated, but the diagnosis is of other logs; give "
            "results of the same logs"
        )
    return _with_corrected(Subject(robot, tuple(runs), diagnoses[0].document, "", tuple(command)))


def _with_corrected(subject: Subject) -> Subject:
    """Calibrates each run once more with what the diagnosis found.

    The first run's initial pose is the diagnosis' own, which was fitted together with the effects
    and knows their uncertainty.
    """
    if subject.diagnosis is None or not subject.diagnosis["effects"]:
        return subject
    robot = subject.corrected
    runs = []
    for run in subject.runs:
        calibration = _core.calibrate(robot, run.log, calibrate_options(run.options))
        runs.append(replace(run, corrected=calibration_as_dict(robot, calibration)))
    first = runs[0].corrected
    if first is not None and first["poses"]:
        pose = subject.diagnosis["initial_pose_after"]
        _move_encoders(first, robot, runs[0].log, pose)
        first["initial_pose"] = pose
        first["poses"][0] |= {key: pose[key] for key in ("position_m", "rotation")}
        first["covariance"] = subject.diagnosis["covariance_after"]
        first["least_observed"] = None  # said of the calibration, whose covariance this is not
    return replace(subject, runs=tuple(runs))


def _move_encoders(
    document: dict[str, Any], robot: _core.Robot, log: _core.Log, pose: dict[str, Any]
) -> None:
    """Initial lengths and swivels at another initial pose: what is entered fits what is shown."""
    known, _ = _core.with_known_effects(robot, log)
    here, there = (
        _core.platform_state(known, _core.Pose(p["position_m"], p["rotation"]))
        for p in (document["initial_pose"], pose)
    )
    for key, values in (("initial_lengths_m", "length_m"), ("initial_swivels_rad", "swivel_rad")):
        change = np.asarray(getattr(there, values)) - np.asarray(getattr(here, values))
        document[key] = [
            None if reading is None else reading + float(by)
            for reading, by in zip(document[key], change, strict=True)
        ]


def _calibrated(
    robot: _core.Robot,
    log: _core.Log,
    options: dict[str, Any] | None,
    file: LogFile | None = None,
) -> Run:
    """``file``: where the log comes from, where that is known."""
    file = file or LogFile(Path(log.source), "csv", log)
    chosen = _core.CalibrateOptions() if options is None else calibrate_options(options)
    document = calibration_as_dict(robot, _core.calibrate(robot, log, chosen))
    findings = (*file.findings, *marks(robot, [file]), *pauses(robot, [file], chosen.segment))
    return Run(log, document, calibrate_options_as_dict(chosen), findings)


def _of_result(result: Result) -> Run:
    findings = tuple(Finding(**caveat) for caveat in result.document["caveats"])
    return Run(result.logs[0], result.document, result.options, findings)


def _diagnosed(
    robot: _core.Robot, logs: list[_core.Log], progress: Progress
) -> tuple[dict[str, Any] | None, str]:
    from cdprcal.diagnosis import diagnosis_as_dict

    try:
        diagnosis = _core.diagnose(robot, logs, progress=progress)
    except InputError as error:  # too few rests, no tensions: the pose is still worth a page
        return None, str(error)
    return diagnosis_as_dict(diagnosis, robot, logs=logs), ""
