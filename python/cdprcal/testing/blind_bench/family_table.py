"""Families of cases side by side: what a diagnosis must not do, and what it should."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from cdprcal.testing.blind_bench.families import FAMILIES
from cdprcal.testing.blind_bench.score import (
    INTERVAL,
    Line,
    Rate,
    detected,
    hidden_names,
    intervals,
    rate,
    reported,
    right_names,
)

#: A coordinate of the initial pose that is off by more σ than this, without a word, is silently
#: wrong: by chance one coordinate of six is in 0.04 % of the cases.
_SILENT_SIGMA = 4.0
#: Kinds of cases in which something was hidden that has a name.
_NAMEABLE = ("one", "two", "configuration", "configuration_one")


def _far_off(off_sigma: list[float | None]) -> bool:
    """In the coordinate that is furthest off."""
    return any(off is None or abs(off) > _SILENT_SIGMA for off in off_sigma)


def silently_wrong(line: Line) -> bool:
    """The diagnosis gave a pose that is far off, exit code 0 and no word about it."""
    found = line["found"]
    spoke = found["verdict"] in ("unexplained", "undetermined")
    return not spoke and _far_off(found["off_sigma"])


def calibration_silently_wrong(line: Line) -> bool:
    """`calibrate` gave a pose that is far off, converged and without a word of misfit."""
    calibrated = line["calibrated"]
    return (
        calibrated["status"] == "converged"
        and not calibrated["warned"]
        and _far_off(calibrated["off_sigma"])
    )


def _named_or_rival(line: Line) -> bool:
    faults = {f["name"] for f in line["found"]["faults"]}
    return set(hidden_names(line)) <= reported(line) | faults


def _pose_covered(lines: list[Line]) -> Rate:
    """Of all coordinates of the initial poses, where the verdict does not warn of them."""
    return rate(
        [
            off is not None and abs(off) <= INTERVAL
            for line in lines
            if line["found"]["verdict"] not in ("unexplained", "undetermined")
            for off in line["found"]["off_sigma"]
        ]
    )


def _of_kinds(lines: list[Line], kinds: tuple[str, ...]) -> list[Line]:
    return [line for line in lines if line["case"]["kind"] in kinds]


#: Heading → rate over the diagnosed cases of a family.
COLUMNS: dict[str, Callable[[list[Line]], Rate]] = {
    "clean accused": lambda x: rate([detected(y) for y in _of_kinds(x, ("clean",))]),
    "silently wrong": lambda x: rate([silently_wrong(y) for y in x]),
    "pose in 95 %": _pose_covered,
    "effects in 95 %": lambda x: rate([i for y in x for i in intervals(y)]),
    "named, nothing else": lambda x: rate([right_names(y) for y in _of_kinds(x, _NAMEABLE)]),
    "named, or a rival": lambda x: rate([_named_or_rival(y) for y in _of_kinds(x, _NAMEABLE)]),
    "unexplained": lambda x: rate([y["found"]["verdict"] == "unexplained" for y in x]),
    "undetermined": lambda x: rate([y["found"]["verdict"] == "undetermined" for y in x]),
}


def family_table(lines: list[Line]) -> list[str]:
    """Markdown: one row a family and number of poses, and all of them together."""
    heads = ["family", "cases", "not simulated", "refused", *COLUMNS, "`calibrate` silently wrong"]
    out = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    studies: dict[str, list[Line]] = {}
    for family in FAMILIES:
        for line in lines:
            if line["family"] == family:
                poses = line["setting"].split("-")[0]
                studies.setdefault(f"{family}, {poses} poses", []).append(line)
    out += [_row(name, study) for name, study in studies.items()]
    if len(studies) > 1:
        out.append(_row("all", lines))
    return out


def _row(name: str, lines: list[Line]) -> str:
    diagnosed = [line for line in lines if line["status"] == "diagnosed"]
    calibrated = rate([calibration_silently_wrong(x) for x in lines if "calibrated" in x])
    cells = [_short(of(diagnosed)) for of in COLUMNS.values()]
    statuses = Counter(line["status"] for line in lines)
    counts = [len(lines), statuses["not_simulated"], statuses["refused"]]
    cells = [name, *map(str, counts), *cells, _short(calibrated)]
    return f"| {' | '.join(cells)} |"


def _short(of: Rate) -> str:
    return f"{of.hits}/{of.trials}" + (f" ({100 * of.value:.0f} %)" if of.trials else "")
