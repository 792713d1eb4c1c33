"""Which commands read a kind of file, and how they are called on one."""

from __future__ import annotations

from pathlib import Path

from malformed.case import EXAMPLES, Case, Valid


def commands(case: Case, path: Path, out: Path, valid: Valid) -> list[list[str]]:
    """Command lines that read the file at ``path`` and would write to ``out``."""
    found = _commands(case, path, out, valid)
    return [words for words in found if not case.command or words[0] == case.command]


def _commands(case: Case, path: Path, out: Path, valid: Valid) -> list[list[str]]:
    run, plan = str(valid.folder / "run.csv"), str(valid.folder / "plan.csv")
    file, to = str(path), str(out)
    if case.kind == "robot":
        return [
            ["check", file],
            ["calibrate", file, run, "-o", to],
            ["plan", file, "-o", to],
            ["workspace", file, "-o", to],
        ]
    if case.kind in ("csv", "raw", "mcap"):
        tolerant = [["check", "irma4", file], ["import", file, "-o", to + ".csv"]]
        if case.big and case.said:
            tolerant = tolerant[1:]
        strict = [["calibrate", "irma4", file, "--json", "-o", to]]
        strict += [["diagnose", "irma4", file, "-o", to]]
        return tolerant if case.said else [*tolerant, *strict]
    if case.kind == "bag":
        return [["import", file, "--robot", "irma4", "-o", to + ".csv"]]
    if case.kind == "plan":
        return [["acquire", "irma4", file, "-o", to + ".csv"]]
    if case.kind == "session":
        return [
            ["export", "irma4", run, "--session", file, "-o", to],
            ["acquire", "irma4", plan, "--backend", "canopen", "--session", file, "-o", to],
        ]
    if case.kind == "result":
        return [["repeat", file], ["report", file, "-o", to + ".html"]]
    simulated = str(EXAMPLES / "canopen-simulated.yaml")
    return [
        ["check", file],
        ["check", "irma4", file],
        ["calibrate", "irma4", file, "-o", to],
        ["diagnose", "irma4", file, "-o", to],
        ["import", file, "-o", to + ".csv"],
        ["acquire", "irma4", file, "-o", to + ".csv"],
        ["acquire", "irma4", plan, "--backend", "canopen", "--session", file, "-o", to + ".csv"],
        ["export", "irma4", file, "--session", simulated, "-o", to],
        ["repeat", file],
        ["report", file, run, "-o", to + ".html"],
        ["replay", file],
    ]
