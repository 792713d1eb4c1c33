"""300 files that no command may trust, each derived from a valid one by a named change.

``CASES`` is the list; ``make(case, folder, valid)`` writes one. Nothing is random: the same names,
the same files. test_malformed.py says what every command must make of them.
"""

from __future__ import annotations

from malformed import bags, csv_logs, mcap_logs, paths, plans, raw_logs, results, robots, sessions
from malformed.case import Case, Valid, make, make_valid

CASES: tuple[Case, ...] = (
    *robots.CASES,
    *csv_logs.CASES,
    *raw_logs.CASES,
    *mcap_logs.CASES,
    *bags.CASES,
    *plans.CASES,
    *sessions.CASES,
    *results.CASES,
    *paths.CASES,
)

__all__ = ["CASES", "Case", "Valid", "make", "make_valid"]
