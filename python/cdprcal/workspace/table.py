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
    plane = document["plane_area_m2"]
    size = (
        f"volume {document['volume_m3']:.4g} m³"
        if plane is None
        else f"area {plane:.4g} m² of the plane, drawn as a slab one step thick"
    )
    say(
        out,
        Text(size, style="bold")
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
        kind, unit = ("box", "m³") if plane is None else ("rectangle", "m²")
        say(out, f"largest inscribed {kind} {box_text(inscribed)} m, {_size(inscribed):.4g} {unit}")
    points = document["points"]
    say(
        out,
        f"searched {box_text(document['searched_box'])} m in steps of "
        f"{1e3 * document['step_m']:g} mm: "
        f"{document['points_inside']} of {sum(points.values())} points inside, "
        f"{points['infeasible']} beyond the tension limits, {points['unstable']} unstable, "
        f"{points['no_equilibrium']} without equilibrium, "
        + (f"{points['obstructed']} with something in the way, " if points["obstructed"] else "")
        + f"{points['untested']} out of reach of any point inside",
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


def _size(box: dict[str, Any]) -> float:
    """Volume [m³]; of a flat one its area [m²]."""
    sides: list[tuple[float, float]] = list(zip(box["lower_m"], box["upper_m"], strict=True))
    return math.prod(high - low for low, high in sides if high > low)


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
