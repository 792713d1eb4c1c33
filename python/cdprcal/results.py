"""What calculations give back, as plain data for JSON: NaN and absent become None."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.findings import Finding
from cdprcal.sensors import ABSOLUTE, CHANNELS, SENSORS
from cdprcal.trust import caveats_of

#: Fields of residual_rms that are always there.
_RMS = (
    *(channel.rms_field for channel in CHANNELS.values() if channel.name not in ABSOLUTE),
    "wrench_force_N",
    "wrench_moment_Nm",
)


def strict_json(document: Any) -> str:
    """JSON that every reader accepts: NaN and infinities are refused, not written."""
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def number(value: float) -> float | None:
    """A finite float, or None."""
    return float(value) if math.isfinite(value) else None


def numbers(values: Any) -> Any:
    """An array of any shape as nested lists of finite floats or None; a number as itself."""
    array = np.asarray(values, dtype=float)
    if array.ndim == 0:
        return number(float(array))
    if array.ndim == 1:
        return [number(value) for value in array.tolist()]
    return [numbers(row) for row in array]


def pose_as_dict(pose: _core.Pose, convention: _core.EulerConvention) -> dict[str, Any]:
    """position_m [3], rotation [3][3], euler_rad [3] (roll, pitch, yaw)."""
    return {
        "position_m": numbers(pose.position_m),
        "rotation": numbers(pose.rotation),
        "euler_rad": numbers(pose.euler_rad(convention)),
    }


def truth_text(robot: _core.Robot, poses: Iterable[tuple[float, _core.Pose]]) -> str:
    """The file of ``--truth``: what the pose really was at each time [s]."""
    rows = [{"time_s": t} | pose_as_dict(pose, robot.euler_convention) for t, pose in poses]
    return strict_json({"poses": rows})


def calibration_as_dict(
    robot: _core.Robot,
    calibration: _core.Calibration,
    caveats: Iterable[Finding] | None = None,
) -> dict[str, Any]:
    """The document of ``calibrate --json``; ``caveats``: None is those of ``caveats_of``."""
    caveats = caveats_of(calibration) if caveats is None else caveats
    result = calibration.result
    convention = robot.euler_convention
    return {
        "status": result.status.name,
        "reason": result.reason,
        "caveats": [caveat.as_dict() for caveat in caveats],
        "reference_time_s": number(calibration.reference_time_s),
        "initial_pose": pose_as_dict(result.poses[0], convention) if result.poses else None,
        "covariance": None if result.covariance is None else numbers(result.covariance),
        "standard_deviation": numbers(result.standard_deviation),
        "initial_lengths_m": numbers(result.initial_length_m),
        "initial_swivels_rad": numbers(result.initial_swivel_rad),
        "cost": number(result.cost),
        "residual_count": result.residual_count,
        "parameter_count": result.parameter_count,
        "chi_square_p_value": number(result.chi_square_p_value),
        "iterations": result.iterations,
        "solve_time_s": number(result.solve_time_s),
        "static_poses": calibration.static_poses,
        "kinematic_poses": calibration.kinematic_poses,
        "least_observed": result.least_observed or None,
        "noise": {
            name: {"pose": number(level.pose), "sample": number(level.sample)}
            for name, level in calibration.problem.noise.channels.items()
            if name not in ABSOLUTE
            or number(getattr(result.residual_rms, ABSOLUTE[name].rms_field)) is not None
        },
        "gated": [
            {
                "reason": g.reason,
                "time_s": number(g.time_s),
                "channel": g.channel,
                "component": g.component,
                "size": number(g.size),
            }
            for g in calibration.gated
        ],
        "residual_rms": _rms(result.residual_rms),
        "poses": list(_poses(calibration)),
        "equilibria": [{"begin_s": e.begin_s, "end_s": e.end_s} for e in calibration.equilibria],
    }


def motion_as_dict(found: _core.InMotion, document: dict[str, Any]) -> dict[str, Any]:
    """What ``calibrate --motion`` has in place of parts of the document; null: motion adds nothing.

    Moments of motion are in balance as rests are, but rest nowhere.
    """
    if not found.in_motion:
        return {"motion": None}
    rests = document["equilibria"]
    poses = [
        pose if i == 0 or _is_within(pose["time_s"], rests) else pose | {"kind": "kinematic"}
        for i, pose in enumerate(document["poses"])
    ]
    motion = {
        "moments": found.calibration.kinematic_poses,
        "damping_shift_1_s": number(found.damping_shift_1_s),
        "damping_turn_1_s": number(found.damping_turn_1_s),
        "late": [{"name": late.name, "parameters": late.parameters} for late in found.late],
        "swings": [
            {key: number(getattr(swing, key)) for key in ("model_hz", "measured_hz", "size_m")}
            for swing in found.swings
        ],
        "pushes": [
            {key: number(getattr(push, key)) for key in ("begin_s", "end_s", "before_J", "after_J")}
            for push in found.pushes
        ],
    }
    return {"poses": poses, "motion": motion}


def _is_within(time_s: float, rests: Iterable[dict[str, float]]) -> bool:
    return any(rest["begin_s"] <= time_s <= rest["end_s"] for rest in rests)


def _rms(rms: _core.ResidualRms) -> dict[str, float | None]:
    document = {name: number(getattr(rms, name)) for name in _RMS}
    # Sensors that few robots have: only where they read something.
    extra = {c.rms_field: number(getattr(rms, c.rms_field)) for c in ABSOLUTE.values()}
    return document | {name: value for name, value in extra.items() if value is not None}


def _poses(calibration: _core.Calibration) -> Iterable[dict[str, Any]]:
    result = calibration.result
    count = len(result.poses)  # none when the problem was not even solved
    measurements = calibration.problem.measurements[:count]
    residuals: list[_core.PoseResidual | None] = [*result.residuals[:count]] or [None] * count
    for pose, measurement, residual in zip(result.poses, measurements, residuals, strict=True):
        rests = measurement.kind == _core.PoseKind.static_pose
        yield {
            "time_s": number(measurement.time_s),
            "position_m": numbers(pose.position_m),
            "rotation": numbers(pose.rotation),
            "kind": "static" if rests else "kinematic",
            "residuals": None if residual is None else residual_as_dict(residual),
        }


def residual_as_dict(residual: _core.PoseResidual) -> dict[str, Any]:
    """Modelled minus measured at one pose (eq. 13), by channel; absent: None.

    Channels of sensors that few robots have are there where something was read.
    """
    read = {field: getattr(residual, field) for field in SENSORS}
    return {
        **{field: numbers(read[field]) for field in SENSORS if not SENSORS[field].is_absolute},
        "wrench": numbers(residual.wrench),
        **{
            field: numbers(read[field])
            for field in SENSORS
            if SENSORS[field].is_absolute and np.isfinite(read[field]).any()
        },
    }
