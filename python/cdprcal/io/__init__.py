"""Log files: canonical CSV, MCAP and raw robot logs, told apart by content."""

from cdprcal.io.acquisition_inputs import AcquisitionInputs, read_inputs
from cdprcal.io.live_log import LiveLog, open_live_log
from cdprcal.io.loaded import LogFile, LogFormat
from cdprcal.io.log_file import load_log, load_run, sniff_format
from cdprcal.io.save import save_log

__all__ = [
    "AcquisitionInputs",
    "LiveLog",
    "LogFile",
    "LogFormat",
    "load_log",
    "load_run",
    "open_live_log",
    "read_inputs",
    "save_log",
    "sniff_format",
]
