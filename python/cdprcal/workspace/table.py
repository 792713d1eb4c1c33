"""A static workspace for people."""

from __future__ import annotations

import math
from typing import Any

from rich.text import Text

from cdprcal.planning.table import box_text
from cdprcal.terminal import Table, answers, counted, fixed, say


def print_workspace(document: dict[str, Any]) -> None:
    """Volume, largest box, what bounds it, sections and probed points."""
    out = answers()
    say(
        out,
        Text(f"volume {document['volume_m3']:.4g} m³", style="bold")
        + Text(
            f", surface {document['area_m2']:.4g} m² ({len(document['faces'])} triangles, "
            f"{'watertight' if document['watertight'] else 'not watertight'}, "
            f"{counted(document['components'], 'piece')}, alpha "
            f"{math.sqrt(document['alpha_m2']):.3g} m)"
        ),
    )
    if not document["complete"]:
        text = "not the whole workspace: this part was found until the search was interrupted"
        say(out, Text(text, style="yellow"))
    inscribed = document["box"]
    if inscribed is None:
        say(out, "no grid cell lies inside: take a smaller step")
    else:
        say(out, f"largest inscribed box {box_text(inscribed)} m, {_volume(inscribed):.4g} m³")
    size = document["points"]
    say(
        out,
        f"searched {box_text(document['searched_box'])} m in steps of "
        f"{1e3 * document['step_m']:g} mm: "
        f"{document['points_inside']} of {sum(size.values())} points inside, "
        f"{size['infeasible']} beyond the tension limits, {size['unstable']} unstable, "
        f"{size['no_equilibrium']} without equilibrium, "
        + (f"{size['obstructed']} with something in the way, " if size["obstructed"] else "")
        + f"{size['untested']} out of reach of any point inside",
    )
    if document["sections"]:
        table = Table("height [m]", "area [m²]", "outlines")
        for section in document["sections"]:
            table.add_row(
                f"{section['height_m']:g}",
                fixed(section["area_m2"], 4),
                str(len(section["polygons"])),
            )
        out.print(table)
    if document["probes"]:
        out.print(_probes_table(document["probes"]))


def _volume(box: dict[str, Any]) -> float:
    sides: list[tuple[float, float]] = list(zip(box["lower_m"], box["upper_m"], strict=True))
    return math.prod(high - low for low, high in sides)


def _probes_table(probes: list[dict[str, Any]]) -> Table:
    tensions = max(len(probe["tension_N"] or []) for probe in probes)
    headers = [f"τ{i + 1} [N]" for i in range(tensions)]
    table = Table(
        "x [m]", "y [m]", "z [m]", "", *headers, "margin [N]", "stiffness [N/m]", text={3}, keys=3
    )
    for probe in probes:
        tension = probe["tension_N"] or [None] * tensions
        table.add_row(
            *(f"{value:g}" for value in probe["position_m"]),
            probe["status"] if probe["status"] != "found" else "inside",
            *(fixed(value, 1) for value in tension),
            fixed(probe["margin_N"], 1),
            fixed(probe["stiffness_N_m"]["locked_lengths"], 1),
        )
    return table
