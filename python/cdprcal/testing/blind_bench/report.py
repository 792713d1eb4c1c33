"""The Markdown page of a study."""

from __future__ import annotations

import json
from pathlib import Path

from cdprcal.testing.blind_bench.family_table import family_table
from cdprcal.testing.blind_bench.score import Line, Scores, score


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
