"""The Markdown page of a study: families side by side, then scores and every failure of each."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from cdprcal.testing.blind_bench.families import FAMILIES
from cdprcal.testing.blind_bench.score import (
    INTERVAL,
    Line,
    Rate,
    Scores,
    detected,
    hidden_names,
    intervals,
    rate,
    reported,
    right_names,
    score,
)


def read_lines(path: Path) -> list[Line]:
    """The cases of a study's file; a line cut short by an interruption is passed over."""
    lines = []
    for text in path.read_text().splitlines():
        try:
            lines.append(json.loads(text))
        except json.JSONDecodeError:
            continue
    return lines


def markdown(files: list[Path]) -> str:
    """Families side by side; then a section a file: scores, confusion, sizes, every failure."""
    studies = [lines for path in files if (lines := read_lines(path))]
    parts = ["# Blind test bench", ""]
    parts += [*family_table([line for lines in studies for line in lines]), ""]
    parts += [
        "Silently wrong: a coordinate of the initial pose more than 4 stated σ off, and neither an "
        "exit code nor a word says so.",
        "",
    ]
    for lines in studies:
        first = lines[0]
        title = f"{first['setting'].replace('_', ', ')} ({first['split']}, seed {first['seed']})"
        parts += _section(title, score(lines))
    return "\n".join(parts) + "\n"


def _section(title: str, s: Scores) -> list[str]:
    out = [f"## {title}", ""]
    out += [", ".join(f"{count} {what}" for what, count in sorted(s.counts.items())), ""]
    out += ["| measure | value |", "|---|---|"]
    out += [f"| {name} | {value} |" for name, value in s.rates.items()]
    out += [f"| {name} | {value:.3g} |" for name, value in s.numbers.items()]
    out += ["", "Hidden → named first:", "", "| hidden | named |", "|---|---|"]
    for truth in sorted({t for t, _ in s.confusion}):
        row = sorted(
            ((n, c) for (t, n), c in s.confusion.items() if t == truth), key=lambda x: -x[1]
        )
        out.append(f"| {truth} | {', '.join(f'{n} {c}' for n, c in row)} |")
    out += ["", "Detection by size in typical sizes, and 95 % intervals that cover the truth:", ""]
    out += ["| effect | 0.7–1 | 1–1.4 | 1.4–2 | intervals |", "|---|---|---|---|---|"]
    for effect in sorted({e for e, _ in s.by_size}):
        cells = [f"{r.hits}/{r.trials}" for (e, _), r in s.by_size.items() if e == effect]
        covered = s.coverage[effect]
        out.append(f"| {effect} | {' | '.join(cells)} | {covered.hits}/{covered.trials} |")
    out += ["", f"Failures ({len(s.failures)}):", ""]
    out += [f"- {text}" for text in s.failures]
    return [*out, ""]


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
