"""A report: one HTML page that holds everything about a start-up, and needs nothing else."""

from cdprcal.report.page import render, write_report
from cdprcal.report.subject import (
    Subject,
    subject_of_diagnosis,
    subject_of_logs,
    subject_of_results,
)

__all__ = [
    "Subject",
    "render",
    "subject_of_diagnosis",
    "subject_of_logs",
    "subject_of_results",
    "write_report",
]
