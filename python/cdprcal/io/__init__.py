"""Log files: canonical CSV, MCAP and raw robot logs, told apart by content."""

from cdprcal.io.log_file import LogFile, LogFormat, load_log, load_run, sniff_format
from cdprcal.io.save import save_log

__all__ = ["LogFile", "LogFormat", "load_log", "load_run", "save_log", "sniff_format"]
