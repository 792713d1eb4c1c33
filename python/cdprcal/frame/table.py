"""A frame for people."""

from __future__ import annotations

from typing import Any

from rich.text import Text

from cdprcal.terminal import Table, answers, counted, fixed, measured, say


def print_frame(document: dict[str, Any], *, verbose: bool = False) -> None:
    """Where the pulleys are, what lengths are wrong by, and what neither is known by."""
    out = answers()
    good = document["status"] == "converged"
    say(out, Text(f"{document['status']}: {document['reason']}", style="bold" if good else "red"))
    if document["rms_m"] is not None:
        say(out, _fit(document))
    if document["anchors_m"]:
        table = Table("pulley", "x [m]", "y [m]", "z [m]", "σ x, y, z [mm]")
        pairs = zip(document["anchors_m"], document["anchors_sigma_m"], strict=True)
        for i, (place, sigma) in enumerate(pairs, start=1):
            shown = ", ".join(fixed(1e3 * s, 2) for s in sigma)
            table.add_row(str(i), *(fixed(x, 4) for x in place), shown)
        out.print(table)
    for line in _estimates(document):
        say(out, line)
    if left := document["left_out"]:
        say(out, f"left out {counted(len(left), 'pose')}: {', '.join(_left_out(p) for p in left)}")
    for text in document["not_determined"]:
        say(out, f"not determined: {text}")
    for text in document["next"] if verbose or not good else document["next"][:1]:
        say(out, f"would tell more: {text}")


def _fit(document: dict[str, Any]) -> str:
    parts = [
        f"lengths close to {1e3 * document['rms_m']:.2f} mm rms at "
        f"{counted(document['poses'], 'pose')}"
    ]
    if document["held_out_rms_m"] is not None:
        parts.append(f"{1e3 * document['held_out_rms_m']:.2f} mm at poses held out")
    if document["lack_of_fit"] and document["lack_of_fit"] > 1.05:
        parts.append(
            f"residuals of neighbouring poses hang together: σ are {document['lack_of_fit']:.1f} "
            "times those of independent readings"
        )
    return "; ".join(parts)


def _estimates(document: dict[str, Any]) -> list[str]:
    lines = []
    offsets = document["offset_m"]
    for i, offset in enumerate(offsets, start=1):
        what = "all lengths read" if len(offsets) == 1 else f"length {i} reads"
        lines.append(f"offset: {what} too much by {_value(offset, 1e3, 'mm')}")
    for i, scale in enumerate(document["own_scale"], start=1):
        text = _value(scale, 1e2, "%")
        lines.append(f"scale: length {i} reads too much by {text} beside the mean of all")
    for key, what, factor, unit in (
        ("scale", "scale: lengths read too much by", 1e2, "%"),
        ("stiffness_N", "stiffness of the cables (EA):", 1e-3, "kN"),
        ("off_plane_m", "belts run outside the plane by", 1e3, "mm"),
        ("weight_N", "weight of the platform by the tensions:", 1.0, "N"),
    ):
        if document[key] is not None:
            lines.append(f"{what} {_value(document[key], factor, unit)}")
    return lines


def _value(estimate: dict[str, float | None], factor: float, unit: str) -> str:
    value, sigma = estimate["value"], estimate["sigma"]
    if value is None:
        return "nothing that can be told"
    if sigma is None:
        return f"{fixed(factor * value, 2)} {unit}"
    return f"{' ± '.join(measured(factor * value, factor * sigma, sign=''))} {unit}"


def _left_out(pose: dict[str, Any]) -> str:
    where = f"{pose['sample']} of log {pose['log']}"
    if pose["cable"] is None:
        return where
    return f"{where} (cable {pose['cable']} is off by {1e3 * pose['error_m']:.0f} mm)"
