"""Logs and tracks as a rosbag2, MCAP or SQLite inside; logs with the topics of a session."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError, Log
from cdprcal.hardware.session import Ros2
from cdprcal.hardware.xsens.measurement import quaternion_from_rotation, rotation_from_zyx_deg
from cdprcal.io.files import reason
from cdprcal.io.mcap_records import write_checksums
from cdprcal.ros2.storage import write_checksums_of_files
from cdprcal.ros2.topics import (
    IMU,
    JOINT_STATE,
    POSE,
    TWIST,
    WRENCH,
    length_joints,
    swivel_joints,
)

_BAG_VERSION: Literal[8] = 8  # what ROS 2 Humble and later read


def save_bag(
    log: Log,
    path: str | Path,
    convention: _core.EulerConvention,
    topics: Ros2 | None = None,
    *,
    storage: Literal["mcap", "sqlite3"] = "mcap",
) -> None:
    """Writes a bag, a new folder; nothing is left of it when that fails.

    convention: how the log's roll, pitch and yaw are written, the robot's. A time of 0 becomes a
    stamp of 0. Raises InputError naming the path when it exists or cannot be written, or when the
    topics name another number of joints than the log has cables.
    """
    path = Path(path)
    topics = topics or Ros2.model_validate({})
    _check(log, topics)
    _save(lambda types: _LogMessages(types, log, convention, topics), path, storage)


def save_track_bag(
    track: _core.Track, path: str | Path, *, storage: Literal["mcap", "sqlite3"] = "mcap"
) -> None:
    """Writes a track as a bag, a new folder: /pose and /twist with their covariances, in `world`.

    Samples that are not to be trusted are left out. The twist is that of the platform's point P,
    in world axes. Raises InputError naming the path when it exists or cannot be written.
    """
    _save(lambda types: _TrackMessages(types, track), Path(path), storage)


def _save(messages_of: Callable[[Any], _Messages], path: Path, storage: str) -> None:
    if path.exists():
        raise InputError(f"{path}: exists already; give another name for the bag")
    try:
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name[:50]}.") as folder:
            whole = Path(folder) / path.name  # the files inside bear the bag's name
            _write(messages_of, whole, storage)
            shutil.move(whole, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {reason(error)}") from None


def _check(log: Log, topics: Ros2) -> None:
    cables = log.cable_count
    for field in ("length_joints", "swivel_joints", "wrenches"):
        names = getattr(topics, field)
        if names and len(names) != cables:
            raise InputError(
                f"ros2.{field}: names {len(names)}, the log has {cables} cables; name one a cable"
            )


def _write(messages_of: Callable[[Any], _Messages], path: Path, storage: str) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(path, version=_BAG_VERSION, storage_plugin=plugin) as writer:
        messages = messages_of(store.types)
        connections = {
            topic: writer.add_connection(topic, kind, typestore=store)
            for topic, kind in messages.kinds.items()
        }
        for row, time_s in enumerate(messages.time_s.tolist()):
            stamp = max(0, round(1e9 * time_s))
            for topic, message in messages.of(row, stamp):
                data = store.serialize_cdr(message, messages.kinds[topic])
                writer.write(connections[topic], stamp, data)
    # Without them no reader sees a flipped bit.
    if storage == "mcap":
        write_checksums(path / f"{path.name}.mcap")
    else:
        write_checksums_of_files(path)


class _Messages:
    """The messages of each moment; ``types`` makes them."""

    kinds: dict[str, str]  #: of each topic
    time_s: Any  #: [N]

    def __init__(self, types: Any) -> None:
        self._types = types

    def of(self, row: int, stamp: int) -> list[tuple[str, Any]]:
        """(topic, message) of one moment."""
        raise NotImplementedError

    def _make(self, kind: str, **fields: Any) -> Any:
        return self._types[kind](**fields)

    def _header(self, stamp: int, frame: str) -> Any:
        sec, nanosec = divmod(stamp, 1_000_000_000)
        time = self._make("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
        return self._make("std_msgs/msg/Header", stamp=time, frame_id=frame)

    def _vector(self, x: float, y: float, z: float) -> Any:
        return self._make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def _quaternion(self, w: float, x: float, y: float, z: float) -> Any:
        return self._make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)


class _TrackMessages(_Messages):
    """Of each sample of a track that is to be trusted."""

    def __init__(self, types: Any, track: _core.Track) -> None:
        super().__init__(types)
        self.kinds = {"/pose": POSE, "/twist": TWIST}
        trusted = track.trusted
        self.time_s = track.time_s[trusted]
        self._position_m = track.position_m[trusted]
        self._quaternion_wxyz = track.quaternion_wxyz[trusted]
        self._twist = track.twist[trusted]
        self._pose_covariance = track.pose_covariance[trusted]
        self._twist_covariance = track.twist_covariance[trusted]

    def of(self, row: int, stamp: int) -> list[tuple[str, Any]]:
        x, y, z = self._position_m[row].tolist()
        vx, vy, vz, wx, wy, wz = self._twist[row].tolist()
        # ROS 2 (geometry_msgs, REP 103): about fixed axes, position first, as here.
        pose = self._make(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=self._make(
                "geometry_msgs/msg/Pose",
                position=self._make("geometry_msgs/msg/Point", x=x, y=y, z=z),
                orientation=self._quaternion(*self._quaternion_wxyz[row].tolist()),
            ),
            covariance=self._pose_covariance[row].ravel(),
        )
        twist = self._make(
            "geometry_msgs/msg/TwistWithCovariance",
            twist=self._make(
                "geometry_msgs/msg/Twist",
                linear=self._vector(vx, vy, vz),
                angular=self._vector(wx, wy, wz),
            ),
            covariance=self._twist_covariance[row].ravel(),
        )
        header = self._header(stamp, "world")
        return [
            ("/pose", self._make(POSE, header=header, pose=pose)),
            ("/twist", self._make(TWIST, header=header, twist=twist)),
        ]


_NONE = np.full(3, np.nan)


class _LogMessages(_Messages):
    """The messages of each row of a log."""

    def __init__(
        self, types: Any, log: Log, convention: _core.EulerConvention, topics: Ros2
    ) -> None:
        super().__init__(types)
        self.time_s = log.time_s
        self._log = log
        self._convention = convention
        self._topics = topics
        self._inertial = [
            (name, values)
            for name, values in (
                ("angular_velocity", log.angular_velocity_rad_s),
                ("linear_acceleration", log.specific_force_m_s2),
            )
            if values.shape[1]
        ]
        cables = log.cable_count
        self._lengths = length_joints(topics, cables)
        self._swivels = swivel_joints(topics, cables) if log.swivel_rad.shape[1] else []
        self._R_platform_sensor = rotation_from_zyx_deg(tuple(topics.mounting_deg))
        self.kinds = {topics.joint_states: JOINT_STATE}
        if log.roll_pitch_yaw_rad.shape[1] or self._inertial:
            self.kinds[topics.imu] = IMU
        if log.tension_N.shape[1]:
            self.kinds |= dict.fromkeys(topics.wrenches, WRENCH)
        if topics.setpoints and log.tension_setpoint_N.shape[1]:
            self.kinds[topics.setpoints] = JOINT_STATE

    def of(self, row: int, stamp: int) -> list[tuple[str, Any]]:
        log, topics = self._log, self._topics
        nothing = np.full(len(self._lengths), np.nan)
        lengths = log.length_m[row] if log.length_m.shape[1] else nothing
        swivels = log.swivel_rad[row] if self._swivels else np.zeros(0)
        tensions = log.tension_N[row] if log.tension_N.shape[1] else nothing
        position = np.concatenate(
            [
                topics.length_sign * lengths / topics.length_per_position_m,
                topics.swivel_sign * swivels,
            ]
        )
        names = [*self._lengths, *self._swivels]
        effort = np.full(len(names), np.nan)
        effort[: len(tensions)] = self._effort(tensions)
        messages = [(topics.joint_states, self._joints(stamp, names, position, effort))]
        attitude = log.roll_pitch_yaw_rad[row] if log.roll_pitch_yaw_rad.shape[1] else _NONE
        inertial = {name: values[row] for name, values in self._inertial}
        if any(np.isfinite(values).all() for values in (attitude, *inertial.values())):
            messages.append((topics.imu, self._imu(stamp, attitude, inertial)))
        for cable, topic in enumerate(topics.wrenches):
            if topic in self.kinds and np.isfinite(tensions[cable]):
                messages.append((topic, self._wrench(stamp, self._lengths[cable], tensions[cable])))
        if topics.setpoints in self.kinds and topics.setpoints:
            effort = self._effort(log.tension_setpoint_N[row])
            joints = self._joints(stamp, self._lengths, np.zeros(0), effort)
            messages.append((topics.setpoints, joints))
        return messages

    def _effort(self, tension_N: Any) -> Any:
        return self._topics.tension_sign * tension_N * self._topics.length_per_position_m

    def _joints(self, stamp: int, names: list[str], position: Any, effort: Any) -> Any:
        return self._make(
            JOINT_STATE,
            header=self._header(stamp, ""),
            name=names,
            position=np.asarray(position, dtype=np.float64),
            velocity=np.zeros(0),
            effort=np.asarray(effort, dtype=np.float64),
        )

    def _imu(self, stamp: int, roll_pitch_yaw_rad: Any, inertial: dict[str, Any]) -> Any:
        unknown = np.zeros(9)
        absent = np.array([-1.0, *np.zeros(8)])
        seen = bool(np.isfinite(roll_pitch_yaw_rad).all())
        rotation = _core.rotation_from_euler(
            roll_pitch_yaw_rad if seen else np.zeros(3), self._convention
        )
        w, x, y, z = quaternion_from_rotation(rotation @ self._R_platform_sensor)
        vectors = {}
        for name in ("angular_velocity", "linear_acceleration"):
            read = inertial.get(name, _NONE) @ self._R_platform_sensor
            there = bool(np.isfinite(read).all())
            vectors[name] = self._vector(*(read.tolist() if there else (0.0, 0.0, 0.0)))
            vectors[f"{name}_covariance"] = unknown if there else absent
        return self._make(
            IMU,
            header=self._header(stamp, "imu_link"),
            orientation=self._quaternion(w, x, y, z),
            orientation_covariance=unknown if seen else absent,
            **vectors,
        )

    def _wrench(self, stamp: int, joint: str, tension_N: float) -> Any:
        wrench = self._make(
            "geometry_msgs/msg/Wrench",
            force=self._vector(float(tension_N), 0.0, 0.0),
            torque=self._vector(0.0, 0.0, 0.0),
        )
        return self._make(WRENCH, header=self._header(stamp, f"{joint}_load_cell"), wrench=wrench)
