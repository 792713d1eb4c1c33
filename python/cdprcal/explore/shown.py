"""What the page shows of a fit, as plain data for JSON; texts are ready to be read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from cdprcal import _core
from cdprcal._core import Diagnosis, Log, Robot
from cdprcal.diagnosis import diagnosis_as_dict
from cdprcal.diagnosis.plots import AFTER, OTHER, Fit, Panel, gap_panels, residual_panels
from cdprcal.diagnosis.table import headline, pose_rows, unexplained_line, value_rows
from cdprcal.results import number
from cdprcal.terminal import fixed


def shown(
    diagnosis: Diagnosis, robot: Robot, logs: Sequence[str], searched: bool, of: Sequence[Log]
) -> dict[str, Any]:
    """Effects, residuals by channel, their rms, the initial pose: as given and as fitted.

    ``logs``: the names of those that it is ``of``. ``searched``: the effects are those that the
    diagnosis found.
    """
    document = diagnosis_as_dict(diagnosis, robot, logs=of)
    found = [effect for effect in document["effects"] if effect["p_value"] is not None]
    faults = [effect for effect in document["effects"] if effect["p_value"] is None]
    return {
        "said": headline(document).plain if searched else "",
        "searched": searched,
        "logs": list(logs),
        "effects": _effects(diagnosis, found),
        "evidence": sum(effect["log_evidence"] or 0.0 for effect in found),
        "faults": [effect["sentence"] for effect in faults],
        "notes": [
            *(unexplained_line(left) for left in document["unexplained"]),
            *(f"{r['name']}: {r['reason']}" for r in document["rejected"] if not searched),
        ],
        "rms": _rms(document),
        "pose": [list(row) for row in pose_rows(document)],
        "channels": _channels(document, logs),
    }


def _effects(diagnosis: Diagnosis, found: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Those in the model, in their order; then all that rests can show, the likeliest first.

    Of one that is not in the model the evidence is a scan's: what it would add, without a refit.
    """
    catalogue = {info.name: info for info in _core.effects_of(diagnosis.corrected)}
    rows = [
        {
            "name": effect["name"],
            "on": True,
            "evidence": number(effect["log_evidence"]),
            "values": [list(row) for row in value_rows(effect)],
            "rivals": effect["rivals"],
        }
        for effect in found
    ]
    inside = {effect["name"] for effect in found}
    rows += [
        {
            "name": score.name,
            "on": False,
            "evidence": number(score.log_evidence),
            "values": [],
            "rivals": [],
        }
        for score in _core.scan(diagnosis.model)
        if score.name not in inside
    ]
    # A slip is of one moment: it is found, and cannot be chosen by name.
    return [
        {**row, "sentence": catalogue[row["name"]].sentence}
        for row in rows
        if row["name"] in catalogue
    ]


def _rms(document: dict[str, Any]) -> list[dict[str, Any]]:
    """Of each channel: before any effect, now, now on poses that were held out; and the ripple."""
    rows = []
    for panel in gap_panels(document):
        held_out, fitted = panel.series
        rows.append(
            {
                "channel": panel.quantity,
                "given": fixed(number(fitted.y[0]), 3),
                "now": fixed(number(fitted.y[-1]), 3),
                "held_out": fixed(number(held_out.y[-1]), 3),
                "ripple": fixed(panel.ripple, 3),
            }
        )
    return rows


def _channels(document: dict[str, Any], logs: Sequence[str]) -> list[dict[str, Any]]:
    """Residuals over the run, a row of panels in one: points of each log, as given and now."""
    both = document["residuals"]
    shapes = [(which, run) for which in ("before", "after") for run in range(len(logs))]
    fits = [
        Fit(
            f"{which} {logs[run]}",
            AFTER if which == "after" else OTHER,
            "circle",
            [r for r in both[which] if r["run"] == run],
        )
        for which, run in shapes
    ]
    rows: dict[int, list[Panel]] = {}
    for panel in residual_panels(fits, document["ripple"]):
        rows.setdefault(panel.row, []).append(panel)
    return [
        {
            "quantity": panels[0].quantity,
            "ripple": panels[0].ripple,
            "largest": max(panel.largest for panel in panels),
            "series": [
                {
                    "part": panel.title,
                    "colour": panel.column,
                    "now": which == "after",
                    "log": run,
                    "x": [_finite(x) for x in series.x],
                    "y": [_finite(y) for y in series.y],
                }
                for panel in panels
                for (which, run), series in zip(shapes, panel.series, strict=True)
            ],
        }
        for panels in rows.values()
    ]


def _finite(value: float) -> float | None:
    return round(value, 6) if math.isfinite(value) else None
