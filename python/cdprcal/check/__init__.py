"""What is wrong with a log, before anyone fits it."""

from cdprcal.check.check import CheckReport, check_file, check_log

__all__ = ["CheckReport", "check_file", "check_log"]
