"""A rosbag2 (a folder, or one file of MCAP or SQLite) as a canonical log.

A row is a joint state; IMU and wrenches are those nearest in time, if they are no further than half
their own or the joint states' period. Stamps of the messages count, else those of the recorder.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import InputError, Log
from cdprcal.findings import Finding
from cdprcal.hardware.session import Ros2
from cdprcal.hardware.xsens.measurement import rotation_from_quaternion, rotation_from_zyx_deg
from cdprcal.io.files import begins_with, shown_path, shown_text
from cdprcal.io.loaded import LogFile
from cdprcal.io.mcap_records import MCAP_MAGIC, CutError, DamagedError
from cdprcal.ros2.storage import SQLITE_MAGIC, StorageError, damage_named, is_protected, messages
from cdprcal.ros2.topics import JOINT_STATE, length_joints, swivel_joints, wanted_types
from cdprcal.sensors import MOST_CABLES, feels_gravity

Floats = NDArray[np.float64]
Messages = dict[str, list[tuple[int, Any]]]


def is_bag(path: Path) -> bool:
    """Whether this is a ROS 2 bag: a folder with metadata, or a file of its own with CDR."""
    if (path / "metadata.yaml").is_file():
        return True
    head = begins_with(path, 4096)
    if head.startswith(SQLITE_MAGIC):
        return True
    # The header's profile follows the magic, an opcode and two lengths.
    return head.startswith(MCAP_MAGIC) and head[21:25] == b"ros2"


def load_bag(
    path: str | Path, topics: Ros2 | None = None, convention: _core.EulerConvention | None = None
) -> LogFile:
    """Reads a bag.

    topics: the session's map, else the defaults. convention: how roll, pitch and yaw are to be
    written, the robot's; needed when there is an orientation. Raises InputError naming bag and
    topic.
    """
    path = Path(path)
    name = shown_path(path)
    topics = topics or Ros2.model_validate({})
    read, there = _read(path, name, topics)
    findings = _absent(read, there, topics, name)
    if not is_protected(path):
        findings.append(
            Finding(
                severity="info",
                code="no_checksum",
                message="the bag is SQLite without checksums: a damaged reading would go unnoticed",
                remedy="record with the storage mcap, as ROS 2 does by itself since Iron",
            )
        )
    joints = read.get(topics.joint_states, [])
    if not joints:
        raise InputError(
            f"{name}: no {JOINT_STATE} on {topics.joint_states}; it holds {there}: name the topics "
            "under ros2 in a session file and give it with --session"
        )
    joints = _forward(joints, findings)
    stamps = np.array([stamp for stamp, _ in joints], dtype=np.int64)
    time_s = (stamps - stamps[0]) / 1e9
    cables = _cable_count(joints[0][1], topics, name)
    length_names = length_joints(topics, cables)
    length_m = topics.length_sign * topics.length_per_position_m * _joint_values(
        joints, length_names, "position"
    )  # fmt: skip
    swivel_rad = topics.swivel_sign * _joint_values(
        joints, swivel_joints(topics, cables), "position"
    )
    attitude = _attitude(read.get(topics.imu, []), topics, convention, stamps, name)
    log = Log(
        time_s=time_s,
        length_m=length_m,
        swivel_rad=_if_any(swivel_rad),
        tension_N=_if_any(_tensions(read, joints, topics, cables, stamps)),
        tension_setpoint_N=_if_any(_setpoints(read, topics, cables, stamps)),
        roll_pitch_yaw_rad=None if attitude is None else _if_any(attitude),
        **_inertial(read.get(topics.imu, []), topics, stamps, findings),
        source=name,
    )
    return LogFile(path, "mcap", log, tuple(findings))


def _absent(read: Messages, there: str, topics: Ros2, name: str) -> list[Finding]:
    """Topics that a session names, and nothing is on. Raises InputError for those of sensors."""
    named = [*topics.wrenches]
    if "imu" in topics.model_fields_set and topics.imu:
        named.append(topics.imu)
    for topic in named:
        if topic not in read:
            raise InputError(
                f"{name}: nothing on {topic}, which the session names; it holds {there}: correct "
                "the name under ros2, or leave it out"
            )
    named_setpoints = "setpoints" in topics.model_fields_set and topics.setpoints
    if not named_setpoints or topics.setpoints in read:
        return []
    return [
        Finding(
            severity="warning",
            code="no_setpoints",
            message=f"nothing on {topics.setpoints}, which the session names; there are {there}",
            remedy="correct ros2.setpoints if the bag has them: they say how long a rest was held",
        )
    ]


def _read(path: Path, name: str, topics: Ros2) -> tuple[Messages, str]:
    """(stamp [ns], message) by topic, and what topics there are, for people."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    wanted = wanted_types(topics)
    read: Messages = {}
    types: dict[str, str] = {}
    topic = ""

    def said(error: Exception) -> str:
        where = f" after a message on {shown_text(topic)}" if topic else ""
        known = isinstance(error, StorageError | DamagedError | CutError)
        parts = ("" if known else type(error).__name__, shown_text(str(error)))
        return f"{where} ({': '.join(filter(None, parts))})"

    with damage_named(name, said):
        for topic, recorded, data in messages(path, wanted, types):
            kind = wanted[topic]
            if types[topic] != kind:
                raise InputError(
                    f"{name}: {topic} is {shown_text(types[topic])}, and must be {kind}"
                )
            message: Any = store.deserialize_cdr(data, kind)
            stamp = message.header.stamp
            taken = stamp.sec * 1_000_000_000 + stamp.nanosec
            read.setdefault(topic, []).append((taken or recorded, message))
    return read, _listed(sorted(types)) or "nothing"


def _listed(names: list[str]) -> str:
    """The first of what is there."""
    return ", ".join(shown_text(name, 40) for name in names[:20])


def _forward(joints: list[tuple[int, Any]], findings: list[Finding]) -> list[tuple[int, Any]]:
    """Joint states in the order of their stamps, each stamp once."""
    kept = []
    last = -1
    for stamp, message in sorted(joints, key=lambda entry: entry[0]):
        if stamp > last:
            kept.append((stamp, message))
            last = stamp
    if len(kept) < len(joints):
        findings.append(
            Finding(
                severity="warning",
                code="same_time",
                message=f"{len(joints) - len(kept)} joint states have the stamp of another",
                remedy="the first of each is used; see that one node alone publishes the topic",
            )
        )
    return kept


def _cable_count(message: Any, topics: Ros2, name: str) -> int:
    if topics.length_joints:
        if missing := [joint for joint in topics.length_joints if joint not in message.name]:
            raise InputError(
                f"{name}: {topics.joint_states} has no joint {missing[0]!r}; it has "
                f"{_listed(message.name)}: name them under ros2 in a session file"
            )
        return len(topics.length_joints)
    count = 0
    while count < MOST_CABLES and f"cable_{count + 1}" in message.name:
        count += 1
    if not count:
        raise InputError(
            f"{name}: {topics.joint_states} has the joints {_listed(message.name) or 'none'}, "
            "not cable_1 …: name them under ros2.length_joints in a session file"
        )
    return count


def _joint_values(joints: list[tuple[int, Any]], names: list[str], field: str) -> Floats:
    """[N, n] of a field; NaN where a message does not have the joint."""
    values = np.full((len(joints), len(names)), np.nan)
    known: dict[tuple[str, ...], list[int]] = {}
    for row, (_, message) in enumerate(joints):
        key = tuple(message.name)
        if key not in known:
            known[key] = [key.index(name) if name in key else -1 for name in names]
        given = getattr(message, field)
        for column, at in enumerate(known[key]):
            if 0 <= at < len(given):
                values[row, column] = given[at]
    return values


def _tensions(
    read: Messages, joints: list[tuple[int, Any]], topics: Ros2, cables: int, stamps: Any
) -> Floats:
    if not topics.wrenches:
        # By virtual work: the effort of a joint is the tension times the cable a unit of position.
        effort = _joint_values(joints, length_joints(topics, cables), "effort")
        return topics.tension_sign * effort / topics.length_per_position_m
    columns = []
    for topic in topics.wrenches:

        def norm(message: Any) -> list[float]:
            force = message.wrench.force
            return [math.sqrt(force.x**2 + force.y**2 + force.z**2)]

        columns.append(_nearest(read.get(topic, []), stamps, 1, norm))
    return np.hstack(columns)


def _setpoints(read: Messages, topics: Ros2, cables: int, stamps: Any) -> Floats:
    names = length_joints(topics, cables)

    def effort(message: Any) -> list[float]:
        values = _joint_values([(0, message)], names, "effort")[0]
        scaled: list[float] = (topics.tension_sign * values / topics.length_per_position_m).tolist()
        return scaled

    found = read.get(topics.setpoints, []) if topics.setpoints else []
    return _nearest(found, stamps, len(names), effort)


def _attitude(
    imu: list[tuple[int, Any]],
    topics: Ros2,
    convention: _core.EulerConvention | None,
    stamps: Any,
    name: str,
) -> Floats | None:
    if not imu:
        return None
    if convention is None:
        raise InputError(
            f"{name}: has orientations on {topics.imu}: give --robot, whose Euler convention says "
            "how roll, pitch and yaw are to be written"
        )
    chosen = convention
    mounting = rotation_from_zyx_deg(tuple(topics.mounting_deg)).T

    def angles(message: Any) -> list[float]:
        q = message.orientation
        quaternion = (q.w, q.x, q.y, q.z)
        absent = message.orientation_covariance[0] == -1.0
        if absent or not abs(math.hypot(*quaternion) - 1.0) < 0.01:
            return [math.nan] * 3
        rotation = rotation_from_quaternion(quaternion) @ mounting
        found: list[float] = _core.euler_from_rotation(rotation, chosen).tolist()
        return found

    return _nearest(imu, stamps, 3, angles)


def _inertial(
    imu: list[tuple[int, Any]],
    topics: Ros2,
    stamps: NDArray[np.int64],
    findings: list[Finding],
) -> dict[str, Floats | None]:
    """What an inertial unit reads, in platform axes.

    A covariance that begins with -1 says that there is none (sensor_msgs/Imu), and so do numbers
    that never change, as drivers leave what they do not have.
    """
    R_platform_sensor = rotation_from_zyx_deg(tuple(topics.mounting_deg))

    def column(field: str) -> Floats | None:
        def values(message: Any) -> list[float]:
            vector = getattr(message, field)
            if getattr(message, f"{field}_covariance")[0] == -1.0:
                return [math.nan] * 3
            turned = R_platform_sensor @ np.array([vector.x, vector.y, vector.z])
            return [float(v) for v in turned]

        found = _nearest(imu, stamps, 3, values)
        read = found[np.isfinite(found).all(axis=1)]
        return found if len(read) > 1 and np.ptp(read, axis=0).any() else None

    force = column("linear_acceleration")
    if force is not None and not feels_gravity(force):
        findings.append(
            Finding(
                severity="warning",
                code="no_gravity",
                message=f"the linear acceleration on {topics.imu} is "
                f"{np.nanmedian(np.linalg.norm(force, axis=1)):.3g} m/s2 in the middle, without "
                "gravity, and is left out",
                remedy="publish what the accelerometer reads (REP 145), gravity included",
            )
        )
        force = None
    return {"specific_force_m_s2": force, "angular_velocity_rad_s": column("angular_velocity")}


def _nearest(
    messages: list[tuple[int, Any]],
    stamps: NDArray[np.int64],
    width: int,
    values_of: Callable[[Any], list[float]],
) -> Floats:
    """[N, width] of the message nearest to each stamp; NaN where there is none close enough."""
    table = np.full((len(stamps), width), np.nan)
    if not messages:
        return table
    messages = sorted(messages, key=lambda entry: entry[0])
    times = np.array([stamp for stamp, _ in messages], dtype=np.int64)
    values = np.array([values_of(message) for _, message in messages])
    after = np.clip(np.searchsorted(times, stamps), 0, len(times) - 1)
    before = np.maximum(after - 1, 0)
    at = np.where(np.abs(times[before] - stamps) <= np.abs(times[after] - stamps), before, after)
    periods = [float(np.median(np.diff(t))) for t in (times, stamps) if len(t) > 1]
    close = np.abs(times[at] - stamps) <= 0.5 * max(periods, default=0.0)
    table[close] = values[at[close]]
    return table


def _if_any(values: Floats) -> Floats | None:
    return values if np.isfinite(values).any() else None
