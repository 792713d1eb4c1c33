"""The tables of sensors and channels, as the library has them: one row each.

Whatever is done for every sensor is done in a loop over these: a new one needs no change here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core

#: What a log holds, in the order of its columns; the set-points, which nothing reads, are last.
LOG_GROUPS = {group.field: group for group in _core.log_groups()}
SENSORS = {field: group for field, group in LOG_GROUPS.items() if group.sigma_field}
CHANNELS = {channel.name: channel for channel in _core.channels()}
#: Channels that few robots have: they are shown where something was read.
ABSOLUTE = {name: channel for name, channel in CHANNELS.items() if channel.sensor.is_absolute}
#: Cables that files in other forms are searched for.
MOST_CABLES = 8


def _option(sensor: _core.Sensor) -> str:
    """'direct-lengths', 'attitude'."""
    name = (
        f"{sensor.name}s"
        if sensor.is_per_cable
        else (sensor.sigma_field or "").removesuffix(f"_{sensor.unit}")
    )
    return name.replace("_", "-")


#: Names of sensors on the command line.
OPTIONS = {_option(sensor): field for field, sensor in SENSORS.items()}


def columns_of(group: _core.Sensor, cables: int) -> list[str]:
    """The columns of a log: ['length_1_m', …] or ['position_x_m', …]."""
    return [group.column(i) for i in range(group.columns_of(cables))]


def component_names(sensor: _core.Sensor) -> list[str]:
    """['roll', 'pitch', 'yaw'], ['x', 'y', 'z']; none for what is read one a cable."""
    stems = [name.removesuffix(f"_{sensor.unit}") for name in columns_of(sensor, 0)]
    return [stem.rpartition("_")[2] for stem in stems]


def feels_gravity(specific_force_m_s2: NDArray[np.float64], gravity_m_s2: float = 9.81) -> bool:
    """Whether readings [N, 3] can be an accelerometer's, which mostly reads gravity; none can."""
    size = np.linalg.norm(specific_force_m_s2, axis=1) if specific_force_m_s2.size else np.zeros(0)
    read = size[np.isfinite(size)]
    return not read.size or bool(abs(np.median(read) - gravity_m_s2) < 0.1 * gravity_m_s2)
