"""A measurement plan as plain data: the document of ``plan --json``."""

from __future__ import annotations

from typing import Any

from cdprcal import _core
from cdprcal.results import number, numbers


def plan_as_dict(robot: _core.Robot, result: _core.PlanResult) -> dict[str, Any]:
    """Stops in visiting order (``measured`` false: passed through only), start, times, accuracy."""
    plan = result.plan
    return {
        "robot": robot.name,
        "poses": [_stop(stop) for stop in plan.poses],
        "start_tension_N": numbers(plan.start_tension_N),
        "start_pose": _pose(plan.start_pose),
        "start_dwell_s": number(plan.start_dwell_s),
        "duration_s": number(plan.duration_s),
        "measured_count": plan.measured_count,
        "predicted_standard_deviation": _deviation(plan.predicted_standard_deviation),
        "box": box_as_dict(result.box),
        "box_origin": result.box_origin,
        "order_is_optimal": result.order_is_optimal,
        "approach": _approach(result.approach),
        "candidates": result.candidates,
        "comparison": _comparison(result.comparison),
    }


def box_as_dict(box: _core.Box) -> dict[str, Any]:
    """lower_m [3], upper_m [3]."""
    return {"lower_m": numbers(box.lower_m), "upper_m": numbers(box.upper_m)}


def _pose(pose: _core.Pose) -> dict[str, Any]:
    return {"position_m": numbers(pose.position_m), "rotation": numbers(pose.rotation)}


def _stop(stop: _core.PlannedPose) -> dict[str, Any]:
    return _pose(stop.pose) | {
        "tension_N": numbers(stop.tension_N),
        "transition_s": number(stop.transition_s),
        "dwell_s": number(stop.dwell_s),
        "measured": stop.measured,
        "natural_frequencies_hz": numbers(stop.natural_frequencies_hz),
        "constant_tension_frequencies_hz": numbers(stop.constant_tension_frequencies_hz),
    }


def _deviation(deviation: Any) -> dict[str, Any]:
    values = numbers(deviation)
    return {"position_m": values[:3], "rotation_rad": values[3:]}


def _approach(approach: _core.ApproachCoverage | None) -> dict[str, int] | None:
    return None if approach is None else {"both": approach.both, "possible": approach.possible}


def _comparison(comparison: _core.GridComparison | None) -> dict[str, Any] | None:
    if comparison is None:
        return None
    return {
        "grid_poses": comparison.grid_poses,
        "grid_standard_deviation": _deviation(comparison.grid_standard_deviation),
        "optimal": [
            {"poses": i + 1, "standard_deviation": _deviation(row)}
            for i, row in enumerate(comparison.optimal_standard_deviation)
        ],
        "poses_needed": comparison.poses_needed,
    }
