"""What every reader of logs gives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cdprcal._core import Log
from cdprcal.findings import Finding

LogFormat = Literal["csv", "mcap", "raw", "mapped"]


@dataclass(frozen=True)
class LogFile:
    """A log, where it came from and what its reader noticed.

    ``line`` [N] holds the line of the file that each sample begins on, counted from 1; None where
    the format has no lines.
    """

    path: Path
    format: LogFormat
    log: Log
    findings: tuple[Finding, ...] = ()
    line: NDArray[np.int64] | None = None

    def line_of(self, sample: int) -> int | None:
        """The line on which a sample begins, if the format has lines."""
        return None if self.line is None else int(self.line[sample])
