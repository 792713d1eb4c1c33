"""From power-on to a log: the start-up procedure on any robot, logged while it runs."""

from cdprcal.acquisition.guide import Estimate, Guide, parse_accuracy
from cdprcal.acquisition.pose_guard import PoseGuard
from cdprcal.acquisition.procedure import Acquired, PowerOn, acquire, start_up_options
from cdprcal.planning.start_up import start_up_plan

__all__ = [
    "Acquired",
    "Estimate",
    "Guide",
    "PoseGuard",
    "PowerOn",
    "acquire",
    "parse_accuracy",
    "start_up_options",
    "start_up_plan",
]
