"""One case from end to end: drawn, simulated, diagnosed, and written down beside its truth."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.results import number, numbers
from cdprcal.testing.blind_bench.cases import Setting, Split, draw_case
from cdprcal.testing.blind_bench.simulate import Simulated, SimulationError, simulate


def run_case(split: Split, seed: int, setting: Setting, number_: int) -> dict[str, Any]:
    """The line of a case in a study's file. Never raises for what the case itself does."""
    case = draw_case(split, seed, setting, number_)
    line: dict[str, Any] = {
        "split": str(split),
        "seed": seed,
        "setting": setting.name,
        "family": setting.family,
        "case": case.as_dict(),
        "cables": case.machine.cables,
    }
    begin = time.process_time()
    try:
        simulated = simulate(case, setting)
    except SimulationError as error:
        return {**line, "status": "not_simulated", "reason": str(error)}
    line["event_time_s"] = simulated.event_time_s
    line["simulation_s"] = round(time.process_time() - begin, 4)
    line["calibrated"] = _calibrated(simulated)
    begin = time.process_time()
    try:
        diagnosis = _core.diagnose(simulated.robot, [simulated.log])
    except _core.InputError as error:
        return {**line, "status": "refused", "reason": str(error)}
    line["diagnosis_s"] = round(time.process_time() - begin, 4)
    line["status"] = "diagnosed"
    line["found"] = _found(diagnosis, simulated)
    return line


def _calibrated(simulated: Simulated) -> dict[str, Any]:
    """What `calibrate` says of the log: whether it trusts its pose, and how far that is off."""
    try:
        result = _core.calibrate(simulated.robot, simulated.log).result
    except _core.InputError as error:
        return {"status": "refused", "reason": str(error)}
    out: dict[str, Any] = {
        "status": result.status.name,
        "warned": result.lacks_something,
        "reason": result.reason,
    }
    if result.initial_pose is not None and result.covariance is not None:
        out["off_sigma"] = _off_sigma(
            result.initial_pose, simulated.initial_pose, result.covariance
        )
    return out


def _found(diagnosis: _core.Diagnosis, simulated: Simulated) -> dict[str, Any]:
    truth = simulated.initial_pose
    before, after = diagnosis.initial_pose_before, diagnosis.initial_pose_after
    shift = np.asarray(_core.minus(after, before))
    sigma = np.sqrt(np.maximum(np.diag(diagnosis.covariance_before), 1e-300))
    return {
        "verdict": diagnosis.verdict.name,
        "faults": [{"name": f.name, "values": numbers(f.values)} for f in diagnosis.faults],
        "effects": [
            {
                "name": e.info.name,
                "where": dict(e.where),
                "values": numbers(e.values),
                "deviation": numbers(e.standard_deviation),
                "log_evidence": number(e.log_evidence),
                "p_value": number(e.p_value),
                "rivals": list(e.rivals),
                "held_out_before": number(e.held_out_before),
                "held_out_after": number(e.held_out_after),
            }
            for e in diagnosis.effects
            if not e.described
        ],
        "formulas": [
            {"name": e.info.name, "equation": e.info.equation, "values": numbers(e.values)}
            for e in diagnosis.effects
            if e.described
        ],
        "rejected": [{"name": r.name, "reason": r.reason} for r in diagnosis.rejected],
        "unexplained": [
            {"channel": u.channel, "depends_on": u.depends_on} for u in diagnosis.unexplained
        ],
        "left_out": list(diagnosis.gated),
        "detectable": {i.name: number(i.detectable) for i in diagnosis.identifiability},
        "detectable_after": {i.name: number(i.detectable_after) for i in diagnosis.identifiability},
        "pose_count": diagnosis.model.pose_count,
        "noise": numbers(diagnosis.model.noise),
        "position_error_m": [
            float(np.linalg.norm(p.position_m - truth.position_m)) for p in (before, after)
        ],
        "rotation_error_rad": [
            float(_core.rotation_distance_rad(p, truth)) for p in (before, after)
        ],
        # Largest move of a coordinate of the initial pose, in its σ before any effect.
        "pose_shift_sigma": number(float(np.max(np.abs(shift) / sigma))),
        "pose_error_sigma": _in_sigma(after, truth, diagnosis.covariance_after),
        "off_sigma": _off_sigma(after, truth, diagnosis.covariance_after),
    }


def _off_sigma(pose: _core.Pose, truth: _core.Pose, covariance: Any) -> list[float | None]:
    """Error of each coordinate of the initial pose (position, then rotation) in its stated σ."""
    error = np.asarray(_core.minus(truth, pose))
    sigma = np.sqrt(np.maximum(np.diag(np.asarray(covariance)), 1e-300))
    return [number(float(off)) for off in error / sigma]


def _in_sigma(pose: _core.Pose, truth: _core.Pose, covariance: Any) -> float | None:
    """Mahalanobis distance of the estimate from the truth, per degree of freedom (1: as stated)."""
    error = np.asarray(_core.minus(truth, pose))
    try:
        squared = float(error @ np.linalg.solve(np.asarray(covariance), error))
    except np.linalg.LinAlgError:
        return None
    return number(float(np.sqrt(max(squared, 0.0) / 6.0)))
