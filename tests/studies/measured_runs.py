"""What the diagnosis makes of two measured logs of one robot: the page docs/measured_runs.md.

    python tests/studies/measured_runs.py sc_8_final.log sc_27_medium_a.log -o docs/measured_runs.md

The logs are those of the data set that the paper cites, raw. Each is diagnosed by itself; then what
was found in one is frozen, and the other is looked at with nothing of it fitted but its poses and
offsets. Writes the page and its picture beside it.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdprcal import _core
from cdprcal.io import load_run

_LABELS = {
    "length_m": ("length", "mm", 1e3),
    "swivel_rad": ("swivel", "°", 180.0 / np.pi),
    "roll_pitch_rad": ("roll, pitch", "°", 180.0 / np.pi),
    "yaw_rad": ("yaw", "°", 180.0 / np.pi),
    "tension_N": ("tension", "N", 1.0),
}
_UNITS = {"1": ("%", 100.0), "m": ("mm", 1e3), "rad": ("°", 180.0 / np.pi), "s": ("ms", 1e3)}


def diagnosed(robot: _core.Robot, path: Path) -> _core.Diagnosis:
    """The diagnosis of one log, with progress on stderr left out."""
    return _core.diagnose(robot, [load_run(str(path), robot).log])


def gap_of(diagnosis: _core.Diagnosis, step: str) -> dict[str, tuple[float, float]]:
    """(fitted, held out) by channel after a step; "" is before any effect."""
    return {
        g.channel: (g.train_rms, g.held_out_rms) for g in diagnosis.gap if g.after_effect == step
    }


def gap_row(gap: dict[str, tuple[float, float]]) -> str:
    """Cells of a table, one a channel."""
    cells = []
    for channel in _LABELS:
        _, _, factor = _LABELS[channel]
        fitted, held = gap[channel]
        cells.append(f"{fitted * factor:.2f} / {held * factor:.2f}")
    return " | ".join(cells)


def gap_table(rows: list[tuple[str, dict[str, tuple[float, float]]]]) -> list[str]:
    """Markdown of gaps after steps: rms fitted / held out."""
    heads = [f"{_LABELS[c][0]} [{_LABELS[c][1]}]" for c in _LABELS]
    out = ["| | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    return out + [f"| {name} | {gap_row(gap)} |" for name, gap in rows]


def values_of(effect: _core.NamedEffect) -> list[tuple[str, float, float, str]]:
    """(what, value, σ, unit) of each number of an effect, for people."""
    out: list[tuple[str, float, float, str]] = []
    at = 0
    parameters = effect.info.parameters
    for index, parameter in enumerate(parameters):
        # The robots at hand have several numbers in an effect's last parameter only.
        count = len(effect.values) - at if index == len(parameters) - 1 else 1
        unit, factor = _UNITS.get(parameter.unit, (parameter.unit, 1.0))
        for k in range(count):
            where = f", cable {k + 1}" if count > 1 else ""
            out.append(
                (
                    f"{effect.info.name}{where}",
                    factor * effect.values[at + k],
                    factor * effect.standard_deviation[at + k],
                    unit,
                )
            )
        at += count
    return out


def agreement(a: _core.Diagnosis, b: _core.Diagnosis) -> list[tuple[str, Any, Any, str]]:
    """Numbers of the effects that both found."""
    of_b = {e.info.name: e for e in b.effects}
    rows = []
    for effect in a.effects:
        if effect.info.name not in of_b:
            continue
        both = zip(values_of(effect), values_of(of_b[effect.info.name]), strict=True)
        rows += [(x[0], x[1:3], y[1:3], x[3]) for x, y in both]
    return rows


def draw(a: _core.Diagnosis, b: _core.Diagnosis, names: tuple[str, str], path: Path) -> None:
    """Held-out residuals step by step, and the same numbers from both logs."""
    figure = Figure(figsize=(10.0, 3.6), layout="constrained")
    for place, (diagnosis, name) in enumerate(zip((a, b), names, strict=True), start=1):
        axes = figure.add_subplot(1, 3, place)
        steps = list(dict.fromkeys(g.after_effect for g in diagnosis.gap))
        for channel in _LABELS:
            label, unit, factor = _LABELS[channel]
            held = [factor * gap_of(diagnosis, s)[channel][1] for s in steps]
            axes.plot(range(len(steps)), held, drawstyle="steps-mid", marker=".", linewidth=1.0)
            axes.annotate(f"{label} [{unit}]", (0.0, held[0]), fontsize=7, va="bottom")
        axes.set_yscale("log")
        axes.set_xticks(range(len(steps)), [s or "before" for s in steps], rotation=35, ha="right")
        axes.tick_params(labelsize=7)
        axes.set_title(f"{name}: rms on held-out poses", fontsize=9)
    axes = figure.add_subplot(1, 3, 3)
    rows = agreement(a, b)
    for k, (_, x, y, _unit) in enumerate(rows):
        scale = max(abs(x[0]), abs(y[0]))
        for (value, sigma), shift, colour in ((x, 0.15, "C0"), (y, -0.15, "C1")):
            axes.errorbar(
                value / scale, k + shift, xerr=1.96 * sigma / scale, fmt=".", color=colour, lw=1.0
            )
    for name, colour in zip(names, ("C0", "C1"), strict=True):
        axes.plot([], [], ".-", color=colour, label=name)
    axes.legend(fontsize=6)
    axes.set_yticks(range(len(rows)), [f"{r[0]} [{r[3]}]" for r in rows], fontsize=6)
    axes.invert_yaxis()
    axes.axvline(0.0, color="black", linewidth=0.5)
    axes.tick_params(axis="x", labelsize=7)
    axes.set_title("same numbers from both logs, 95 %\n(each line by its own scale)", fontsize=9)
    figure.savefig(path, dpi=80, format="png")


def page(logs: tuple[Path, Path], picture: Path) -> list[str]:
    """The Markdown page."""
    robot = _core.load_robot("irma4")
    a, b = (diagnosed(robot, log) for log in logs)
    names = (logs[0].name, logs[1].name)
    draw(a, b, names, picture)
    out = [
        "# Two measured logs",
        "",
        "Two raw logs of the paper's robot, from the data set that the paper cites, diagnosed with "
        "the built-in robot file `irma4`: nothing corrected beforehand, nothing told. This page is "
        "made by `python tests/studies/measured_runs.py LOG LOG -o docs/measured_runs.md`.",
        "",
        f"![Residuals step by step, and the numbers of both logs]({picture.name})",
        "",
    ]
    for diagnosis, name in zip((a, b), names, strict=True):
        out += [f"## {name}", ""]
        out.append(
            f"Verdict: {diagnosis.verdict.name}; {diagnosis.model.pose_count} poses at rest."
        )
        out.append("")
        found = [f"{f.name}: {f.text}" for f in diagnosis.faults]
        out += [f"1. {text}" for text in found]
        out += [
            f"1. {e.info.name} ({e.log_evidence:.0f} nats, p = {e.p_value:.3f})"
            + (f"; these poses do not tell it from {', '.join(e.rivals)}" if e.rivals else "")
            for e in diagnosis.effects
        ]
        out.append("")
        steps = list(dict.fromkeys(g.after_effect for g in diagnosis.gap))
        out += gap_table([(s or "before", gap_of(diagnosis, s)) for s in steps])
        out.append("")
        for left in diagnosis.unexplained:
            _, unit, factor = _LABELS[
                next(c for c in _LABELS if c.rsplit("_", 1)[0] == left.channel)
            ]
            out.append(
                f"Unexplained: {left.channel}, {left.rms * factor:.2f} {unit} rms, depends on "
                f"{left.depends_on}."
            )
        position, rotation = moved(diagnosis)
        out += [f"The initial pose moved by {position:.1f} mm and {rotation:.2f}°.", ""]
    out += ["## The same numbers from both", "", f"| | {names[0]} | {names[1]} | apart [σ] |"]
    out.append("|---|---|---|---|")
    for what, x, y, unit in agreement(a, b):
        apart = abs(x[0] - y[0]) / np.hypot(x[1], y[1])
        both = f"{x[0]:+.2f} ± {x[1]:.2f} | {y[0]:+.2f} ± {y[1]:.2f}"
        out.append(f"| {what} [{unit}] | {both} | {apart:.1f} |")
    out += ["", "## Found in one, frozen, tried on the other", ""]
    out.append(
        "The corrected robot file of one log, and the other log with nothing fitted but poses and "
        "offsets. Rows: as the robot file says; with the other log's findings."
    )
    out.append("")
    for one, other, name in ((a, logs[1], names[1]), (b, logs[0], names[0])):
        frozen = diagnosed(_core.parse_robot(_core.to_yaml(one.corrected), "frozen"), other)
        signs_only = b if other == logs[1] else a
        out += [f"{name}:", ""]
        out += gap_table(
            [
                ("signs set right only", gap_of(signs_only, "")),
                ("frozen", gap_of(frozen, "")),
            ]
        )
        out.append("")
    return out


def moved(diagnosis: _core.Diagnosis) -> tuple[float, float]:
    """How far the findings moved the initial pose [mm, °]."""
    before, after = diagnosis.initial_pose_before, diagnosis.initial_pose_after
    position = float(np.linalg.norm(after.position_m - before.position_m))
    return 1e3 * position, float(np.degrees(_core.rotation_distance_rad(before, after)))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", type=Path, nargs=2, metavar="LOG")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="PAGE.md")
    options = parser.parse_args()
    first, second = options.logs
    text = page((first, second), options.output.with_suffix(".png"))
    options.output.write_text("\n".join(text).rstrip() + "\n")


if __name__ == "__main__":
    main()
