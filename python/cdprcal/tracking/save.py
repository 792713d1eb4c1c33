"""A track as a CSV file: a row a sample, units in the names of the columns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.io.files import write_texts
from cdprcal.tracking.document import deviations

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
