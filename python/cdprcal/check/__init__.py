"""What is wrong with a robot file or a log, before anyone fits it."""

from cdprcal.check.caveats import caveats_with_log, marks, pauses
from cdprcal.check.check import CheckReport, check_file, check_log
from cdprcal.check.robot import RobotReport, check_robot

__all__ = [
    "CheckReport",
    "RobotReport",
    "caveats_with_log",
    "check_file",
    "check_log",
    "check_robot",
    "marks",
    "pauses",
]
