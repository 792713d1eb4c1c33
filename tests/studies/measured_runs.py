"""What the diagnosis makes of two measured logs of one robot: the page docs/measured_runs.md.

    python tests/studies/measured_runs.py sc_8_final.log sc_27_medium_a.log -o docs/measured_runs.md

The logs are those of the data set that the paper cites, raw. Each is diagnosed by itself; then what
was found in one is frozen, and the other is looked at with nothing of it fitted but its poses and
offsets. Writes the page and its picture beside it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from cdprcal import _core
from cdprcal.diagnosis import diagnosis_as_dict
from cdprcal.diagnosis.plots import CABLES
from cdprcal.diagnosis.table import value_rows
from cdprcal.io import load_run

_LABELS = {
    "length_m": ("length", "mm", 1e3),
    "swivel_rad": ("swivel", "°", 180.0 / np.pi),
    "roll_pitch_rad": ("roll, pitch", "°", 180.0 / np.pi),
    "yaw_rad": ("yaw", "°", 180.0 / np.pi),
    "tension_N": ("tension", "N", 1.0),
}


def diagnosed(robot: _core.Robot, *paths: Path) -> _core.Diagnosis:
    """The diagnosis of logs together, with progress on stderr left out."""
    return _core.diagnose(robot, [load_run(str(path), robot).log for path in paths])


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


Number = tuple[float, float]


def agreement(a: _core.Diagnosis, b: _core.Diagnosis) -> list[tuple[str, Number, Number, str]]:
    """Numbers of the effects that both found, each with its σ, and their unit."""
    of_a, of_b = (
        {effect["name"]: effect for effect in diagnosis_as_dict(d, d.corrected)["effects"]}
        for d in (a, b)
    )
    rows = []
    for name in of_a:
        if name not in of_b or of_a[name]["p_value"] is None:
            continue  # a fault of the readings has words, and no σ
        for x, y in zip(value_rows(of_a[name]), value_rows(of_b[name]), strict=True):
            of_x, of_y = (float(x[1]), float(x[2])), (float(y[1]), float(y[2]))
            rows.append((f"{name} {x[0]}".strip(), of_x, of_y, x[3]))
    return rows


def draw(a: _core.Diagnosis, b: _core.Diagnosis, names: tuple[str, str], path: Path) -> None:
    """Held-out residuals step by step, and below them the same numbers from both logs."""
    rows = agreement(a, b)
    figure = Figure(figsize=(8.4, 4.4 + 0.19 * len(rows)), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(3.6, 0.6 + 0.19 * len(rows)))
    for place, (diagnosis, name) in enumerate(zip((a, b), names, strict=True)):
        axes = figure.add_subplot(grid[0, place])
        steps = list(dict.fromkeys(g.after_effect for g in diagnosis.gap))
        for channel, colour, symbol in zip(_LABELS, CABLES, "osD^v", strict=False):
            label, unit, factor = _LABELS[channel]
            held = [factor * gap_of(diagnosis, s)[channel][1] for s in steps]
            (line,) = axes.plot(range(len(steps)), held, color=colour, label=f"{label} [{unit}]")
            line.set(marker=symbol, markersize=4, linewidth=1.2)
        axes.set_yscale("log")
        labels = [f"+ {s}" if s else "as given" for s in steps]
        axes.set_xticks(range(len(steps)), labels, rotation=40, ha="right")
        axes.tick_params(labelsize=8)
        axes.set_title(name, fontsize=10)
        axes.grid(axis="y", linewidth=0.4, color="#e3e7eb")
        if place == 0:
            axes.set_ylabel("rms on poses held out", fontsize=9)
            lines = axes.get_legend_handles_labels()
    figure.legend(*lines, loc="outside upper center", ncols=5, fontsize=9, frameon=False)
    axes = figure.add_subplot(grid[1, :])
    for k, (_, x, y, _unit) in enumerate(rows):
        scale = max(abs(x[0]), abs(y[0]))
        for (value, sigma), shift, colour, symbol in (
            (x, 0.17, CABLES[0], "o"),
            (y, -0.17, CABLES[1], "D"),
        ):
            place_y, half = k + shift, 1.96 * sigma / scale
            axes.plot([value / scale - half, value / scale + half], [place_y] * 2, color=colour)
            axes.plot(value / scale, place_y, symbol, color=colour, markersize=4)
    for name, colour, symbol in zip(names, CABLES, "oD", strict=False):
        axes.plot([], [], symbol, linestyle="-", color=colour, markersize=4, label=name)
    texts = [f"{what}: {max(x[0], y[0], key=abs):+.3g} {unit}" for what, x, y, unit in rows]
    axes.set_yticks(range(len(rows)), texts, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(-3.0, 3.0)  # what is hardly known reaches beyond
    axes.axvline(0.0, color="#1f2933", linewidth=0.6)
    axes.grid(axis="x", linewidth=0.4, color="#e3e7eb")
    axes.tick_params(axis="x", labelsize=8)
    axes.set_xlabel("value ± 95 %, in sizes of the larger, which is on the left", fontsize=9)
    axes.legend(fontsize=8, loc="upper left")
    figure.savefig(path, dpi=100, format="png")


def story(title: str, diagnosis: _core.Diagnosis) -> list[str]:
    """What was found, in which order, and what it left over."""
    out = [f"## {title}", ""]
    out.append(f"Verdict: {diagnosis.verdict.name}; {diagnosis.model.pose_count} poses at rest.")
    out.append("")
    out += [f"1. {f.name}: {f.text}" for f in diagnosis.faults]
    out += [
        f"1. {e.info.name} ({e.log_evidence:.0f} nats, p = {e.p_value:.3f})"
        + (f": `{e.info.equation}`, a formula and no name" if e.described else "")
        + (f"; these poses do not tell it from {', '.join(e.rivals)}" if e.rivals else "")
        for e in diagnosis.effects
    ]
    out.append("")
    steps = list(dict.fromkeys(g.after_effect for g in diagnosis.gap))
    out += gap_table([(s or "before", gap_of(diagnosis, s)) for s in steps])
    out.append("")
    for left in diagnosis.unexplained:
        _, unit, factor = _LABELS[next(c for c in _LABELS if c.rsplit("_", 1)[0] == left.channel)]
        out.append(
            f"Unexplained: {left.channel}, {left.rms * factor:.2f} {unit} rms, depends on "
            f"{left.depends_on}."
        )
    position, rotation = moved(diagnosis)
    out += [f"The initial pose moved by {position:.1f} mm and {rotation:.2f}°.", ""]
    return out


def numbers(diagnosis: _core.Diagnosis) -> list[str]:
    """The values of the effects, a row each."""
    out = ["| | value |", "|---|---|"]
    for effect in diagnosis_as_dict(diagnosis, diagnosis.corrected)["effects"]:
        if effect["p_value"] is None:
            continue
        for what, value, sigma, unit in value_rows(effect):
            name = f"{effect['name']} {what}".strip()
            out.append(f"| {name} [{unit}] | {float(value):+.2f} ± {float(sigma):.2f} |")
    return [*out, ""]


def page(logs: tuple[Path, Path], picture: Path) -> list[str]:
    """The Markdown page."""
    robot = _core.load_robot("irma4")
    a, b = (diagnosed(robot, log) for log in logs)
    both_logs = diagnosed(robot, *logs)
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
        out += story(name, diagnosis)
    out += ["## The same numbers from both", "", f"| | {names[0]} | {names[1]} | apart [σ] |"]
    out.append("|---|---|---|---|")
    squares = []
    for what, x, y, unit in agreement(a, b):
        apart = abs(x[0] - y[0]) / np.hypot(x[1], y[1])
        both = f"{x[0]:+.2f} ± {x[1]:.2f} | {y[0]:+.2f} ± {y[1]:.2f}"
        out.append(f"| {what} [{unit}] | {both} | {apart:.1f} |")
        squares.append(apart**2)
    out += ["", f"χ² a number: {np.mean(squares):.2f}.", ""]
    out += story("Both together", both_logs) + numbers(both_logs)
    out += ["## Found in one, frozen, tried on the other", ""]
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
