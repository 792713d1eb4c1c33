"""One robot over time, log by log: as plain data, for people, and as a picture."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.text import Text

from cdprcal import _core
from cdprcal.diagnosis.document import value_shape
from cdprcal.diagnosis.plots import CABLES, OTHER
from cdprcal.diagnosis.table import place_of
from cdprcal.diagnosis.units import for_people
from cdprcal.pictures import new_figure
from cdprcal.results import number, numbers, pose_as_dict
from cdprcal.terminal import Table, answers, measured, say, scaled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def comparison_as_dict(found: _core.Comparison, robot: _core.Robot) -> dict[str, Any]:
    """The document of ``compare --json``: NaN and absent become None."""
    rows = [_number(n, robot.cable_count) for n in found.numbers]
    moved = [row for row in rows if row["moved"]]
    return {
        "reason": _reason(rows, moved),
        "logs": list(found.logs),
        "faults": [fault.text for fault in found.faults],
        "numbers": rows,
        "initial_poses": [
            pose_as_dict(pose, robot.euler_convention) | {"covariance": numbers(covariance)}
            for pose, covariance in zip(found.initial_pose, found.covariance, strict=True)
        ],
        "not_settled": list(found.not_settled),
        "complete": found.complete,
    }


def _reason(rows: list[dict[str, Any]], moved: list[dict[str, Any]]) -> str:
    if not rows:
        return "these logs show no effect that could have moved"
    if not moved:
        return f"none of {len(rows)} numbers moved more than chance moves it"
    names = dict.fromkeys(row["effect"] for row in moved)
    return f"{len(moved)} of {len(rows)} numbers moved: {', '.join(names)}"


def _number(found: _core.ComparedNumber, cables: int) -> dict[str, Any]:
    parameter = found.info.parameters[found.parameter]
    shape = value_shape(parameter.shape, cables)
    index = tuple(int(i) for i in np.unravel_index(found.entry, shape)) if shape else ()
    return {
        "effect": found.info.name,
        "parameter": parameter.name,
        "of": place_of(parameter.shape, index, len(index)),
        "unit": parameter.unit,
        "values": numbers(found.values),
        "standard_deviation": numbers(found.standard_deviation),
        "chi_square": number(found.chi_square),
        "p_value": number(found.p_value),
        "moved": found.moved,
        "from_log": found.from_log or None,
        "step": number(found.step),
        "step_deviation": number(found.step_deviation),
    }


def print_comparison(document: dict[str, Any], *, verbose: bool = False) -> None:
    """The document of ``compare``: what moved, and each number log by log.

    ``verbose``: also the numbers that stayed.
    """
    out = answers()
    moved = [row for row in document["numbers"] if row["moved"]]
    say(out, Text(document["reason"], style="bold red" if moved else "bold green"))
    for row in moved:
        say(out, _moved_line(row, document["logs"]))
    for name in document["not_settled"]:
        say(out, Text(f"{name}: not all effects could be fitted to it", style="yellow"))
    shown = document["numbers"] if verbose else moved
    if not shown:
        if document["numbers"]:
            say(out, f"{len(document['numbers'])} numbers stayed (--verbose lists them)")
        return
    table = Table("effect", "of", "", *document["logs"], "moved", text={0, 1, 2}, keys=2)
    for row in shown:
        label, factor = _unit(row)
        cells = [
            _with_sigma(value, sigma, factor)
            for value, sigma in zip(row["values"], row["standard_deviation"], strict=True)
        ]
        table.add_row(
            row["effect"],
            _of(row),
            label,
            *cells,
            f"{_sigmas(row):.1f} σ" if row["moved"] else "",
        )
    out.print(table)
    if not verbose and len(shown) < len(document["numbers"]):
        say(out, f"{len(document['numbers']) - len(shown)} numbers stayed (--verbose lists them)")


def _unit(row: dict[str, Any]) -> tuple[str, float]:
    values = [abs(value) for value in row["values"] if value is not None]
    return for_people(row["unit"], max(values, default=0.0))


def _with_sigma(value: float | None, sigma: float | None, factor: float) -> str:
    if value is None:
        return "–"
    return " ± ".join(measured(scaled(value, factor), scaled(sigma, factor)))


def _of(row: dict[str, Any]) -> str:
    return f"{row['parameter']} {row['of']}".strip()


def _sigmas(row: dict[str, Any]) -> float:
    return float(abs(row["step"] / row["step_deviation"]))


def _moved_line(row: dict[str, Any], logs: list[str]) -> str:
    label, factor = _unit(row)
    after = row["from_log"] - 1
    return (
        f"{row['effect']} {_of(row)}: {_with_sigma(row['step'], row['step_deviation'], factor)} "
        f"{label} ({_sigmas(row):.1f} σ) between "
        f"{logs[after - 1]} and {logs[after]}"
    )


def draw_comparison(document: dict[str, Any]) -> Figure:
    """Each parameter's numbers log by log with their σ; each that moved in a colour of its own.

    document: with one number at least.
    """
    panels: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in document["numbers"]:
        panels.setdefault((row["effect"], row["parameter"]), []).append(row)
    logs = document["logs"]
    figure = new_figure(1.6 + 0.9 * max(3, len(logs)), 0.6 + 1.9 * len(panels))
    for place, ((effect, parameter), rows) in enumerate(panels.items()):
        axes = figure.add_subplot(len(panels), 1, place + 1)
        largest = max(rows, key=lambda row: max((abs(v) for v in row["values"] if v), default=0.0))
        label, factor = _unit(largest)
        looks = itertools.cycle(zip(CABLES, "osD^v<>P", strict=True))
        for k, row in enumerate(rows):
            colour, symbol = next(looks) if row["moved"] else (OTHER, "o")
            axes.errorbar(
                np.arange(len(logs)) + 0.5 * (k + 0.5) / len(rows) - 0.25,
                factor * np.array(row["values"], dtype=float),
                factor * np.array(row["standard_deviation"], dtype=float),
                fmt=f"{symbol}-",
                markersize=4,
                linewidth=1.4 if row["moved"] else 0.6,
                capsize=2,
                color=colour,
                label=(row["of"] or parameter) if row["moved"] else None,
            )
        axes.axhline(0.0, color="black", linewidth=0.5)
        axes.set_title(f"{effect}: {parameter}", fontsize=9)
        axes.set_ylabel(label, fontsize=8)
        axes.tick_params(labelsize=7)
        axes.set_xticks(range(len(logs)), logs if place == len(panels) - 1 else [""] * len(logs))
        if not all(row["moved"] for row in rows):
            axes.plot([], [], "o-", color=OTHER, markersize=4, linewidth=0.6, label="not moved")
        axes.legend(fontsize=7)
    return figure
