"""A measurement plan for people."""

from __future__ import annotations

import math
from typing import Any

from rich.text import Text

from cdprcal.terminal import Table, answers, counted, degrees, fixed, say, scaled

_MOST_STOPS = 60
_MOST_ROWS = 12  # of the comparison


def print_plan(document: dict[str, Any], *, verbose: bool = False) -> None:
    """What accuracy the plan promises and in what time; where and when, at which tensions.

    ``verbose``: all stops of a long plan, all rows of a comparison.
    """
    out = answers()
    deviation = document["predicted_standard_deviation"]
    say(out, promise(document["measured_count"], document["duration_s"], deviation))
    say(
        out,
        "1 σ, root sum of squares over the axes, each rest read once, with the sigma of the robot "
        "file",
    )
    say(out, f"box {box_text(document['box'])} m: {document['box_origin']}")
    say(out, _order_text(document))
    out.print(_stops_table(document, verbose=verbose))
    more = len(document["poses"]) - _MOST_STOPS
    if more > 0 and not verbose:
        say(out, f"and {more} more: --verbose")
    if document["comparison"] is not None:
        _print_comparison(document["comparison"], document["candidates"], verbose=verbose)


def promise(measured: int, duration_s: float, deviation: dict[str, Any]) -> Text:
    """How many poses in what time give the initial pose how well; ``deviation`` as in --json."""
    minutes, seconds = divmod(round(duration_s), 60)
    run = f"{counted(measured, 'measured pose')}, {minutes} min {seconds} s"
    position, rotation = _norms(deviation)
    if position is None or rotation is None:
        return Text(
            f"{run}: the initial pose would not be observable from these poses: add poses",
            style="yellow",
        )
    return Text(
        f"{run}: initial pose to ± {1e3 * position:.1f} mm, ± {math.degrees(rotation):.2f}°",
        style="bold",
    )


def _metres(value: float) -> str:
    return fixed(round(value, 3) + 0.0, 3)  # no -0.000


def box_text(box: dict[str, Any]) -> str:
    """'[-0.4, 0.4] × [-0.4, 0.4] × [0.6, 1.2]'."""
    sides = zip(box["lower_m"], box["upper_m"], strict=True)
    return " × ".join(f"[{low:.4g}, {high:.4g}]" for low, high in sides)


def _stops_table(document: dict[str, Any], *, verbose: bool) -> Table:
    cables = len(document["start_tension_N"])
    tensions = [f"τ{i + 1} [N]" for i in range(cables)]
    headers = ("stop", "x [m]", "y [m]", "z [m]", *tensions, "move [s]", "rest [s]", "swing [Hz]")
    table = Table(*headers, "", text={len(headers)})
    start = document["start_pose"]["position_m"]
    table.add_row(
        "start",
        *(_metres(value) for value in start),
        *(fixed(value, 1) for value in document["start_tension_N"]),
        "",
        fixed(document["start_dwell_s"], 1),
        "",
        "",
    )
    for i, stop in enumerate(document["poses"][: None if verbose else _MOST_STOPS]):
        swing = min(stop["constant_tension_frequencies_hz"], default=None)
        table.add_row(
            str(i + 1),
            *(_metres(value) for value in stop["position_m"]),
            *(fixed(value, 1) for value in stop["tension_N"]),
            fixed(stop["transition_s"], 1),
            fixed(stop["dwell_s"], 1),
            fixed(swing, 2),
            "" if stop["measured"] else "passed",
        )
    return table


def _order_text(document: dict[str, Any]) -> str:
    approach = document["approach"]
    if approach is not None:
        return (
            f"random order: {approach['both']} of {approach['possible']} pairs of a pose and a "
            "cable are approached both paying out and reeling in"
        )
    if document["order_is_optimal"]:
        return "order: no other takes less time"
    return "order: short; whether it is the shortest was not proved"


def _print_comparison(comparison: dict[str, Any], candidates: int, *, verbose: bool) -> None:
    out = answers()
    say(
        out,
        "poses chosen by observability (D-optimal) against the grid: predicted accuracy of the "
        "initial pose (1 σ)",
    )
    table = Table("poses", "", "position [mm]", "rotation [deg]", "", text={1, 4})
    needed = comparison["poses_needed"]
    rows = comparison["optimal"]
    for row in rows:
        short = len(rows) > _MOST_ROWS and not verbose
        if short and row["poses"] not in {1, 2, 3, needed, len(rows)}:
            continue
        mark = "as good as the grid" if row["poses"] == needed else ""
        _comparison_row(table, row["poses"], "chosen", row["standard_deviation"], mark)
    _comparison_row(
        table, comparison["grid_poses"], "grid", comparison["grid_standard_deviation"], ""
    )
    out.print(table)
    poses = comparison["grid_poses"]
    say(
        out,
        f"{needed} of the {candidates} poses that can be reached in {comparison['chosen_from']} do "
        f"the work of {poses} in the grid: {poses - needed} fewer"
        if needed is not None
        else f"the grid's {poses} poses are more accurate than the {len(comparison['optimal'])} "
        "chosen; ask for more with --optimal",
    )


def _comparison_row(
    table: Table, poses: int, kind: str, deviation: dict[str, Any], mark: str
) -> None:
    position, rotation = _norms(deviation)
    table.add_row(
        str(poses), kind, fixed(scaled(position, 1e3), 2), fixed(degrees(rotation), 3), mark
    )


def _norms(deviation: dict[str, Any]) -> tuple[float | None, float | None]:
    """Root sum of squares over the axes; None when it is not observable."""
    lists = deviation["position_m"], deviation["rotation_rad"]
    if any(value is None or not math.isfinite(value) for values in lists for value in values):
        return None, None
    return math.hypot(*lists[0]), math.hypot(*lists[1])
