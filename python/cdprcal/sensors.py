"""The tables of sensors and channels, as the library has them: one row each.

Whatever is done for every sensor is done in a loop over these: a new one needs no change here.
"""

from __future__ import annotations

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
        f"{sensor.name}s" if sensor.is_per_cable else (sensor.sigma_field or "").rpartition("_")[0]
    )
    return name.replace("_", "-")


#: Names of sensors on the command line.
OPTIONS = {_option(sensor): field for field, sensor in SENSORS.items()}


def columns_of(group: _core.Sensor, cables: int) -> list[str]:
    """The columns of a log: ['length_1_m', …] or ['position_x_m', …]."""
    return [group.column(i) for i in range(group.columns_of(cables))]


def component_names(sensor: _core.Sensor) -> list[str]:
    """['roll', 'pitch', 'yaw'], ['x', 'y', 'z']; none for what is read one a cable."""
    return [name.rsplit("_", 2)[-2] for name in columns_of(sensor, 0)]
