"""What becomes of hazards: peak tension, motion, and how long a drive was enabled.

    python tests/studies/hazards.py            # all, in both modes

Prints a table on stdout; exit code 1 when one does not end as it must: stopped or refused, its
cause named, no true tension above the limit + 10 % for more than 50 ms.
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))

import cdprcal
from winch_bus import small_plan
from winch_hazards import ALL, Hazard, attempt

LONGEST_OVER_S = 0.05


def measure(hazard: Hazard, mode: str, robot: cdprcal.Robot, plan: cdprcal.Plan) -> bool:
    """Runs it and prints a row."""
    with tempfile.TemporaryDirectory() as folder:
        stopped = attempt(hazard, mode, robot, plan, Path(folder) / "run.csv")
    watched, named = stopped.watched, bool(re.search(hazard.cause, stopped.reason))
    if watched is None:
        print(f"| {hazard.name} | {mode} | – | – | – | – | refused: {stopped.reason} |", flush=True)
        return named
    reason = stopped.reason or f"none: it ended {watched.run.state.name}"
    print(
        f"| {hazard.name} | {mode} | {watched.peak_N:.0f} | {1e3 * watched.over_s:.0f} | "
        f"{1e3 * watched.moved_m:.0f} | {watched.enabled_s:.2f} | {reason} |",
        flush=True,
    )
    return named and watched.over_s <= LONGEST_OVER_S


def main() -> int:
    robot = cdprcal.load_robot("irma4")
    plan = small_plan(robot)
    print(
        "| hazard | mode | peak [N] | beyond the limit + 10 % [ms] | platform moved [mm] | "
        "a drive enabled [s] | reason |"
    )
    print("|---|---|---|---|---|---|---|")
    fine = [measure(hazard, mode, robot, plan) for hazard in ALL for mode in hazard.modes]
    return 0 if all(fine) else 1


if __name__ == "__main__":
    sys.exit(main())
