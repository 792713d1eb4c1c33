"""The document of ``geometry --json``."""

from __future__ import annotations

from typing import Any

from cdprcal import _core
from cdprcal.results import number, numbers
from cdprcal.trust import caveats_of_frame


def frame_as_dict(found: _core.FrameResult) -> dict[str, Any]:
    """A frame as plain data: NaN and absent become None."""
    return {
        "status": found.status.name,
        "reason": found.reason,
        "caveats": [caveat.as_dict() for caveat in caveats_of_frame(found)],
        "anchors_m": numbers(found.anchors_m),
        "anchors_sigma_m": numbers(found.anchors_sigma_m),
        "gauge": found.gauge,
        "offset_m": [_estimate(offset) for offset in found.offset_m],
        "scale": _estimate(found.scale),
        "own_scale": [_estimate(scale) for scale in found.own_scale],
        "stiffness_N": _estimate(found.stiffness_N),
        "off_plane_m": _estimate(found.off_plane_m),
        "weight_N": _estimate(found.weight_N),
        "rms_m": number(found.rms_m),
        "held_out_rms_m": number(found.held_out_rms_m),
        "noise_m": number(found.noise_m),
        "lack_of_fit": number(found.lack_of_fit),
        "poses": len(found.poses),
        "left_out": [
            {
                "log": pose.log + 1,
                "sample": pose.sample + 1,
                "cable": pose.cable + 1 if pose.cable >= 0 else None,
                "error_m": number(pose.error_m),
            }
            for pose in found.left_out
        ],
        "not_determined": list(found.not_determined),
        "next": list(found.next),
        "corrected": _core.to_yaml(found.corrected),
        "iterations": found.iterations,
        "solve_time_s": found.solve_time_s,
    }


def _estimate(estimate: _core.Estimate | None) -> dict[str, float | None] | None:
    if estimate is None:
        return None
    return {"value": number(estimate.value), "sigma": number(estimate.sigma)}
