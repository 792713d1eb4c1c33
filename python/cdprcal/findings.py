"""What is remarkable about a log: one finding a fact, with its place and what to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

Severity = Literal["error", "warning", "info"]


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing found in a log.

    ``error``: the log cannot be trusted as it is; ``warning``: it can be used, with care;
    ``info``: worth knowing. ``line`` counts from 1; times are the log's own, in seconds.
    """

    severity: Severity
    code: str
    message: str
    remedy: str
    line: int | None = None
    time_s: float | None = None
    end_s: float | None = None
    channel: str | None = None

    def as_dict(self) -> dict[str, Any]:
        """The finding as plain data, absent places as None."""
        return {
            "severity": self.severity,
            "code": self.code,
            "message": self.message,
            "remedy": self.remedy,
            "line": self.line,
            "time_s": self.time_s,
            "end_s": self.end_s,
            "channel": self.channel,
        }
