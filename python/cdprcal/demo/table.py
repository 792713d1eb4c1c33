"""A demonstration for people, and as plain data."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.text import Text

from cdprcal import _core
from cdprcal.demo.story import PAPER_ROWS, Error, Hidden, Row, Run
from cdprcal.results import number
from cdprcal.terminal import Table, degrees, fixed, scaled

#: eps_p and eps_r of paper Table III; the third is how the paper measures eps_r, its eq. 20.
_ERRORS = ("position [mm]", "rotation [deg]", "eq. 20 [deg]")


def methods_table(rows: list[Row]) -> Table:
    """As paper Table III: t_sc, k, eps_p, eps_r; and the time of the solver alone."""
    headers = ("method", "run [min]", "poses", *_ERRORS, "solved in")
    table = Table(*headers, text={0})
    for row in rows:
        result = row.calibration.result
        converged = result.status == _core.CalibrationStatus.converged
        table.add_row(
            row.label if converged else f"{row.label} ({result.status.name})",
            _minutes(row.duration_s),
            str(row.poses),
            *_errors(row.error),
            f"{1e3 * result.solve_time_s:5.1f} ms",
        )
    for label, duration_s, poses, position_mm, rotation, difference_deg in PAPER_ROWS:
        table.add_row(
            label,
            _minutes(duration_s),
            str(poses),
            fixed(position_mm, 1),
            fixed(rotation, 2),
            fixed(difference_deg, 2),
            "",
            style="dim",
        )
    return table


def hidden_table(hidden: Hidden) -> Table:
    """What the diagnosis did to the initial pose."""
    table = Table("initial pose", *_ERRORS, text={0})
    table.add_row("without what was found", *_errors(hidden.before))
    table.add_row("with it", *_errors(hidden.after))
    return table


def headline(rows: list[Row]) -> Text:
    """How well the best-informed method found the initial pose."""
    error = rows[-1].error
    if error is None:
        return Text("the initial pose was not found", style="bold red")
    return Text(
        f"initial pose found to {1e3 * error.position_m:.2f} mm and "
        f"{fixed(degrees(error.rotation_rad), 3)}° of the truth",
        style="bold green",
    )


def verdict(hidden: Hidden) -> Text:
    """Whether the diagnosis found what was hidden."""
    found = ", ".join(effect.info.name for effect in hidden.diagnosis.effects) or "nothing"
    if hidden.named:
        return Text(f"found: {found}", style="bold green")
    if hidden.among_rivals:
        return Text(f"found: {found}, which these poses cannot tell from it", style="yellow")
    return Text(f"found: {found}", style="bold red")


def demo_as_dict(run: Run, rows: list[Row], hidden: Hidden) -> dict[str, Any]:
    """The document of ``demo --json``."""
    return {
        "acquisition": {
            "log": str(run.path),
            "state": run.acquired.state.name,
            "duration_s": run.acquired.duration_s,
            "rests": len(run.acquired.rests),
        },
        "methods": [
            {
                "method": row.method,
                "formulation": row.formulation,
                "status": row.calibration.result.status.name,
                "duration_s": row.duration_s,
                "solve_time_s": row.calibration.result.solve_time_s,
                "poses": row.poses,
                "error": _error(row.error),
            }
            for row in rows
        ],
        "hidden": {
            "effect": hidden.effect,
            "log": str(hidden.run.path),
            "verdict": hidden.diagnosis.verdict.name,
            "found": [effect.info.name for effect in hidden.diagnosis.effects],
            "rivals": sorted({r for effect in hidden.diagnosis.effects for r in effect.rivals}),
            "error_before": _error(hidden.before),
            "error_after": _error(hidden.after),
        },
    }


def _error(error: Error | None) -> dict[str, float | None] | None:
    if error is None:
        return None
    return {
        "position_m": number(error.position_m),
        "rotation_rad": number(error.rotation_rad),
        "angle_difference_rad": number(error.angle_difference_rad),
    }


def _errors(error: Error | None) -> tuple[str, str, str]:
    if error is None:
        return ("–", "–", "–")
    position_mm = scaled(error.position_m, 1e3)
    return (
        fixed(position_mm, 2),
        fixed(degrees(error.rotation_rad), 3),
        fixed(degrees(error.angle_difference_rad), 3),
    )


def _minutes(seconds: float) -> str:
    return f"{np.round(seconds / 60.0, 2):.2f}"
