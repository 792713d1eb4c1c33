"""A track as the document of ``track --json``, and as a CSV file of a row a sample."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.check.subject import stretches
from cdprcal.findings import Finding
from cdprcal.io.files import write_texts
from cdprcal.results import number, numbers, pose_as_dict


def track_as_dict(
    track: _core.Track, solve_time_s: float, caveats: Iterable[Finding] = ()
) -> dict[str, Any]:
    """A track as plain data: its last sample, its worst, and when it is not to be trusted.

    ``caveats``: of the calibration that it begins with, and of the log.
    """
    trusted = track.trusted
    time_s = track.time_s
    left_out = np.array([track[i].left_out for i in range(len(track))])
    lasting_s = [time_s[end - 1] - time_s[begin] for begin, end in stretches(left_out > 0)]
    return {
        "caveats": [caveat.as_dict() for caveat in caveats],
        "samples": len(track),
        "trusted_samples": int(trusted.sum()),
        "begin_s": number(time_s[0]),
        "end_s": number(time_s[-1]),
        "last": _sample(track, track[-1]),
        "largest_standard_deviation": _largest(track.pose_covariance[trusted]),
        "largest_speed_m_s": _most(np.linalg.norm(track.twist[trusted, :3], axis=1)),
        "largest_angular_speed_rad_s": _most(np.linalg.norm(track.twist[trusted, 3:], axis=1)),
        "untrusted": list(_untrusted(track, time_s, trusted)),
        "left_out_readings": int(left_out.sum()),
        "longest_left_out_s": number(max(lasting_s, default=0.0)),
        "solve_time_s": number(solve_time_s),
    }


def _sample(track: _core.Track, sample: _core.TrackedSample) -> dict[str, Any]:
    return {
        "time_s": number(sample.time_s),
        "trusted": sample.trusted,
        "reason": sample.reason,
        "pose": pose_as_dict(sample.pose, track.convention),
        "covariance": numbers(sample.pose_covariance),
        "standard_deviation": numbers(deviations(sample.pose_covariance)),
        "twist": numbers(sample.twist),
        "twist_standard_deviation": numbers(deviations(sample.twist_covariance)),
    }


def _largest(covariances: Any) -> list[float | None]:
    if not len(covariances):
        return [None] * 6
    found: list[float | None] = numbers(deviations(covariances).max(axis=0))
    return found


def _most(values: Any) -> float | None:
    return number(values.max()) if len(values) else None


def _untrusted(track: _core.Track, time_s: Any, trusted: Any) -> Iterable[dict[str, Any]]:
    """Stretches of samples that are not to be trusted, each with its first reason."""
    for begin, end in stretches(~trusted):
        yield {
            "begin_s": number(time_s[begin]),
            "end_s": number(time_s[end - 1]),
            "samples": end - begin,
            "reason": track[begin].reason,
        }


def deviations(covariances: Any) -> Any:
    """Roots of the diagonals: [..., n, n] → [..., n]."""
    return np.sqrt(np.diagonal(covariances, axis1=-2, axis2=-1))


_AXES = "xyz"


def columns_of_track(track: _core.Track) -> dict[str, Any]:
    """Name → array [N] of every column: pose, twist, their standard deviations, trusted."""
    pose_sigma = deviations(track.pose_covariance)
    twist_sigma = deviations(track.twist_covariance)
    columns = {"time_s": track.time_s}
    groups = (
        ([f"{a}_m" for a in _AXES], track.position_m),
        ([f"quaternion_{a}" for a in "wxyz"], track.quaternion_wxyz),
        (["roll_rad", "pitch_rad", "yaw_rad"], track.roll_pitch_yaw_rad),
        ([f"velocity_{a}_m_s" for a in _AXES], track.twist[:, :3]),
        ([f"angular_velocity_{a}_rad_s" for a in _AXES], track.twist[:, 3:]),
        ([f"sigma_{a}_m" for a in _AXES], pose_sigma[:, :3]),
        ([f"sigma_rotation_{a}_rad" for a in _AXES], pose_sigma[:, 3:]),
        ([f"sigma_velocity_{a}_m_s" for a in _AXES], twist_sigma[:, :3]),
        ([f"sigma_angular_velocity_{a}_rad_s" for a in _AXES], twist_sigma[:, 3:]),
    )
    for names, values in groups:
        columns |= {name: values[:, i] for i, name in enumerate(names)}
    return columns | {"trusted": track.trusted.astype(int)}


def save_track(track: _core.Track, path: Path) -> None:
    """Writes the columns as CSV; numbers are read back as they were. Raises InputError."""
    columns = columns_of_track(track)
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(map(_cell, row)) for row in rows)]
    write_texts({path: "\n".join(lines) + "\n"})


def _cell(value: float) -> str:
    return repr(value) if np.isfinite(value) else ""
