"""Reads a robot for a while and moves nothing: for wiring, signs and scales."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from cdprcal._core import RobotSample
from cdprcal.hardware.drives.backend import FieldbusBackend
from cdprcal.results import number


def dry_run(
    backend: FieldbusBackend,
    duration_s: float,
    *,
    stop: Callable[[], bool] = lambda: False,
    watch: Callable[[RobotSample], None] = lambda sample: None,
) -> RobotSample:
    """Reads for so long; the last sample. The backend is stopped, whatever is raised."""
    try:
        while True:
            sample = backend.read()
            watch(sample)
            if sample.time_s >= duration_s or stop():
                return sample
    finally:
        backend.stop()


def readings(backend: FieldbusBackend, sample: RobotSample) -> dict[str, Any]:
    """The document of ``acquire --json`` after a dry run."""
    rows = []
    for state in backend.winches:
        rows.append(
            {
                "cable": state.winch.cable,
                "node": state.winch.node,
                "state": state.state.value,
                "statusword": state.statusword,
                "error_code": state.error_code,
                "position_counts": state.position_counts,
                "length_m": number(state.length_m),
                "swivel_rad": number(state.swivel_rad),
                "load_cell_counts": state.load_cell_counts,
                "tension_N": number(state.tension_N),
            }
        )
    angles = sample.roll_pitch_yaw_rad
    return {
        "state": "dry_run",
        "reason": backend.tripped,
        "duration_s": sample.time_s,
        "winches": rows,
        "roll_pitch_yaw_rad": angles.tolist() if np.isfinite(angles).all() else None,
        "devices": backend.settings["drives"],
        "ahrs": backend.settings["ahrs"],
    }
