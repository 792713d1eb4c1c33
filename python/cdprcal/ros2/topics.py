"""Which topic and joint holds which channel, by the ``ros2`` section of a session file."""

from __future__ import annotations

from cdprcal.hardware.session import Ros2

JOINT_STATE = "sensor_msgs/msg/JointState"
IMU = "sensor_msgs/msg/Imu"
WRENCH = "geometry_msgs/msg/WrenchStamped"
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
TWIST = "geometry_msgs/msg/TwistWithCovarianceStamped"


def length_joints(topics: Ros2, cables: int) -> list[str]:
    """Joints whose position is a cable's length, by cable."""
    return topics.length_joints or [f"cable_{i}" for i in range(1, cables + 1)]


def swivel_joints(topics: Ros2, cables: int) -> list[str]:
    """Joints whose position is a swivel angle, by cable."""
    return topics.swivel_joints or [f"swivel_{i}" for i in range(1, cables + 1)]


def wanted_types(topics: Ros2) -> dict[str, str]:
    """Message type by topic."""
    types = {topics.joint_states: JOINT_STATE, topics.imu: IMU}
    types |= dict.fromkeys(topics.wrenches, WRENCH)
    if topics.setpoints:
        types[topics.setpoints] = JOINT_STATE
    types.pop("", None)
    return types
