"""Solving a result file again: the same numbers, from the file alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.io.result_file import (
    Result,
    calibrate_options,
    cdprcal_version,
    diagnose_options,
    naming,
)
from cdprcal.results import calibration_as_dict

#: What counts as the same initial pose, in its own standard deviations: far below what matters, far
#: above where the solver stops (its threads add numbers in another order each time).
SAME_SIGMAS = 0.1


@dataclass(frozen=True)
class Repeated:
    """What came out again, beside what the file says.

    ``status``: calibration's status or diagnosis' verdict, before and again; ``difference_sigma``:
    largest difference of the initial pose over its standard deviation, None without a pose.
    """

    command: str
    made_by: str
    status: tuple[str, str]
    effects: tuple[list[str], list[str]]
    difference_sigma: float | None
    document: dict[str, Any]

    @property
    def same(self) -> bool:
        """Whether status, effects and initial pose are those of the file."""
        return (
            self.status[0] == self.status[1]
            and self.effects[0] == self.effects[1]
            and (self.difference_sigma is None or self.difference_sigma < SAME_SIGMAS)
        )

    def sentence(self) -> str:
        """For people."""
        if self.same:
            apart = self.difference_sigma
            pose = "" if apart is None else f"; initial pose within {max(apart, 1e-9):.1g} σ"
            return f"the same again: {self.status[1]}{pose} (made by cdprcal {self.made_by})"
        what = [f"{a} before, {b} now" for a, b in (self.status,) if a != b]
        if self.effects[0] != self.effects[1]:
            before, now = (", ".join(names) or "no effect" for names in self.effects)
            what.append(f"{before} before, {now} now")
        if self.difference_sigma is not None and self.difference_sigma >= SAME_SIGMAS:
            what.append(f"the initial pose moved by {self.difference_sigma:.2g} σ")
        return (
            f"not the same: {'; '.join(what)} (made by cdprcal {self.made_by}, now "
            f"{cdprcal_version()})"
        )

    def as_dict(self) -> dict[str, Any]:
        """The document of ``repeat --json``."""
        return {
            "same": self.same,
            "command": self.command,
            "made_by": self.made_by,
            "version": cdprcal_version(),
            "status": {"before": self.status[0], "again": self.status[1]},
            "effects": {"before": self.effects[0], "again": self.effects[1]},
            "difference_sigma": self.difference_sigma,
            "again": self.document,
        }


def repeat(result: Result) -> Repeated:
    """Solves again what a result file holds. Raises InputError when the file is damaged."""
    with naming(result.source):
        return _repeated(result)


def _repeated(result: Result) -> Repeated:
    if result.command == "calibrate":
        options = calibrate_options(result.options)
        given = (result.robot, result.logs[0], options)
        calibration = (
            _core.calibrate_in_motion(*given).calibration
            if result.options.get("motion")
            else _core.calibrate(*given)
        )
        document = calibration_as_dict(result.robot, calibration)
        keys = ("status", "initial_pose", "covariance")
    else:
        from cdprcal.diagnosis import diagnosis_as_dict

        how = diagnose_options(result.options)
        diagnosis = _core.diagnose(result.robot, list(result.logs), how)
        document = diagnosis_as_dict(diagnosis, result.robot, logs=result.logs)
        keys = ("verdict", "initial_pose_after", "covariance_after")
    before = result.document
    return Repeated(
        result.command,
        result.version,
        (before[keys[0]], document[keys[0]]),
        (_effects(before), _effects(document)),
        _difference(before[keys[1]], document[keys[1]], before[keys[2]]),
        document,
    )


def _effects(document: dict[str, Any]) -> list[str]:
    return [effect["name"] for effect in document.get("effects", [])]


def _difference(before: Any, again: Any, covariance: Any) -> float | None:
    if before is None or again is None or covariance is None:
        return None
    a, b = (_core.Pose(pose["position_m"], pose["rotation"]) for pose in (before, again))
    difference = _core.minus(b, a)
    deviation = np.sqrt(np.diag(np.array(covariance, dtype=float)))
    moves = deviation > 0.0  # a planar platform: not in all directions
    return float(np.max(np.abs(difference[moves]) / deviation[moves]))
