"""ROS 2 bags without ROS: joint states, IMU and wrenches to canonical logs, and back."""

from cdprcal.ros2.read import is_bag, load_bag
from cdprcal.ros2.write import save_bag

__all__ = ["is_bag", "load_bag", "save_bag"]
