"""ROS 2 bags without ROS: joint states, IMU and wrenches to canonical logs, and back; tracks."""

from cdprcal.ros2.read import is_bag, load_bag
from cdprcal.ros2.write import save_bag, save_track_bag

__all__ = ["is_bag", "load_bag", "save_bag", "save_track_bag"]
