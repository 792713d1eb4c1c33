"""What is remarkable about a log: one finding a fact, with its place and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Literal

Severity = Literal["error", "warning", "info"]


_WORST_FIRST = ("error", "warning", "info")


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
        return asdict(self)


def worst_first(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Errors, then warnings, then the rest."""
    return tuple(sorted(findings, key=lambda finding: _WORST_FIRST.index(finding.severity)))
