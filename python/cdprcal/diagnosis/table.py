"""A diagnosis for people: what was found step by step, and what it did to gap and pose."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from cdprcal import _core
from cdprcal.diagnosis.document import TRUSTED, value_shape
from cdprcal.diagnosis.plots import gap_panels, gap_steps
from cdprcal.diagnosis.units import GAP_CHANNELS, for_people
from cdprcal.results import number
from cdprcal.sensors import CHANNELS
from cdprcal.terminal import Table, answers, degrees, fixed, measured, say, scaled, summed_up

_STYLE = {
    "consistent": "bold green",
    "explained": "bold cyan",
    "described": "bold cyan",
    "unexplained": "bold red",
    "undetermined": "bold yellow",
}

#: More than so many times its ripple is no chance.
_STANDS_OUT = 3.0
#: What a contradiction depends on, in the core's words.
_NOTHING = "nothing that was tried"
#: Channel without its unit → unit for people, factor to it.
_OF_CHANNEL = {c.name: GAP_CHANNELS[c.rms_field][1:] for c in CHANNELS.values()}
_OF_CHANNEL["tension"] = _OF_CHANNEL["balance"]
LEFT_OVER = "within the sigma of the robot file, but more than the readings ripple at rest, is left"


def print_diagnosis(document: dict[str, Any], *, verbose: bool = False) -> None:
    """The document of ``diagnose``: verdict, effects with values, the gap, the pose, what next.

    ``verbose``: also each reading that was left out, what was looked at and rejected, and what
    these logs cannot show.
    """
    out = answers()
    verdict = document["verdict"]
    say(out, headline(document))
    say(out, document["reason"])
    for line in summed_up(document["left_out"], verbose=verbose):
        say(out, Text(f"left out: {line}", style="yellow"))
    for left in document["unexplained"]:
        say(out, Text(unexplained_line(left), style="red"))
    if document["effects"]:
        say(out, "what was missing, in the order found")
        out.print(_effects_table(document["effects"]))
        _print_sentences(out, document["effects"])
    say(out, "gap: rms on the poses fitted / on poses held out")
    out.print(_gap_table(document))
    say(out, "initial pose: without and with what was found")
    out.print(_pose_table(document))
    if verdict in TRUSTED and (rest := left_over(document)):
        say(out, f"{LEFT_OVER}: {'; '.join(rest)}")
    _print_lists(out, document, verbose=verbose)
    for text in document["next"]:
        say(out, Text("next: ", style="bold") + Text(text, style="none"))


def headline(document: dict[str, Any]) -> Text:
    """The verdict and the names: 'explained: load_cell_bias, pulley_friction'."""
    verdict = document["verdict"]
    names = ", ".join(dict.fromkeys(effect["name"] for effect in document["effects"]))
    left = ", ".join(dict.fromkeys(left["channel"] for left in document["unexplained"]))
    said = names or "no effect found"
    if left:
        said += f"; left unexplained: {left}"
    return Text(verdict, style=_STYLE[verdict]) + Text(f": {said}", style="none")


def _print_lists(out: Console, document: dict[str, Any], *, verbose: bool) -> None:
    """What the logs do not show and what was rejected: how many, or ``verbose``, which."""
    blind = blind_spots(document)
    rejected = unique((r["name"], r["reason"]) for r in document["rejected"])
    if not verbose:
        counts = []
        if blind:
            counts.append(f"{len(blind)} could be there unseen")
        if rejected:
            counts.append(f"{len(rejected)} looked at and rejected")
        if counts:
            say(out, f"other effects: {', '.join(counts)} (--verbose lists them)")
        return
    if blind:
        say(out, f"this log does not show: {'; '.join(blind)}")
    if rejected:
        say(out, "looked at and rejected")
        table = Table("effect", "because", text={0, 1})
        for name, reason in rejected:
            table.add_row(name, reason)
        out.print(table)


def blind_spots(document: dict[str, Any]) -> list[str]:
    """Effects that could be there at their typical size unseen, and the size that would show."""
    accepted = {effect["name"] for effect in document["effects"]}
    robot = _core.parse_robot(document["corrected"], "corrected")
    catalogue = {info.name: info for info in _core.effects_of(robot)}
    lines = []
    for entry in document["identifiability"]:
        name, size = entry["name"], entry["detectable_after"] or entry["detectable"]
        if name in accepted or (size is not None and size <= 1.0):
            continue
        if size is None:
            lines.append(f"{name} of any size")
            continue
        if not believable(catalogue[name], size):
            lines.append(f"{name} of any believable size")
            continue
        side = "above" if catalogue[name].inverse else "below"
        value = shown_size(catalogue[name], size, robot)
        lines.append(f"{name} {side} {value} ({size:.2g} × its typical size)")
    return lines


def shown_size(info: _core.EffectInfo, size: float, robot: _core.Robot) -> str:
    """So many typical sizes of an effect on a robot, in a unit for people."""
    parameter = info.parameters[0]
    value = size * parameter.typical * parameter.times_reference(robot)
    # Of a stiffness the typical size is that of its inverse.
    value = 1.0 / value if info.inverse else value
    label, factor = for_people(parameter.unit, value)
    return f"{value * factor:.3g} {label}".strip()


def believable(info: _core.EffectInfo, size: float) -> bool:
    """Whether an effect may be so many times its typical size; else its number means nothing."""
    return any(size * p.typical <= p.plausible for p in info.parameters)


def unique(pairs: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """The last word on each name, in the order of the first."""
    return list(dict(pairs).items())


def _effects_table(effects: list[dict[str, Any]]) -> Table:
    rivals = ["rivals"] if any(effect["rivals"] for effect in effects) else []
    headers = ("step", "effect", "of", "value", "± σ", "", "evidence [nat]", "p", *rivals)
    table = Table(*headers, text={1, 2, 5, 8}, keys=3)
    for step, effect in enumerate(effects, 1):
        statistics = [
            fixed(effect["log_evidence"], 1),
            "–" if effect["p_value"] is None else f"{effect['p_value']:.3f}",
            *([", ".join(effect["rivals"])] if rivals else []),
        ]
        for row, (where, value, deviation, unit) in enumerate(value_rows(effect)):
            first = row == 0
            table.add_row(
                str(step) if first else "",
                effect["name"] if first else "",
                where,
                value,
                deviation,
                unit,
                *(statistics if first else [""] * len(statistics)),
            )
    return table


def value_rows(effect: dict[str, Any]) -> Iterator[tuple[str, str, str, str]]:
    """Where, value, its deviation and unit, number by number."""
    units = effect["units"]
    for name, nested in effect["parameters"].items():
        if name not in units:  # a discrete fault
            parts = nested if isinstance(nested, list) else [nested]
            yield (
                name,
                " ".join(f"{p:g}" if isinstance(p, float) else str(p) for p in parts),
                "",
                "",
            )
            continue
        unit = units[name]
        values = np.array(nested, dtype=float)
        shape = _core.ParameterShape.__members__[effect["shapes"][name]]
        deviations = np.array(effect["standard_deviation"][name], dtype=float)
        label, factor = for_people(unit, float(np.nanmax(np.abs(values), initial=0.0)))
        several = len(effect["parameters"]) > 1
        for index in np.ndindex(values.shape):
            where = place_of(shape, index, values.ndim)
            yield (
                f"{name} {where}".strip() if several else where,
                *measured(factor * values.item(index), factor * deviations.item(index)),
                label,
            )


def place_of(shape: _core.ParameterShape, index: tuple[int, ...], dimensions: int) -> str:
    """'cable 2', 'y', 'cable 2, y'; with 'log 1' in front where each log has its own."""
    own = len(value_shape(shape, cables=1))
    parts = [f"log {index[0] + 1}"] if dimensions > own else []
    index = index[dimensions - own :]
    if shape == _core.ParameterShape.vector3:
        parts.append("xyz"[index[0]])
    elif index:
        parts.append(f"cable {index[0] + 1}")
        parts += ["xyz"[i] for i in index[1:]]
    return ", ".join(parts)


def _print_sentences(out: Console, effects: list[dict[str, Any]]) -> None:
    for effect in effects:
        line = f"{effect['name']}: {effect['sentence']}"
        say(out, f"{line}; {effect['remedy']}" if effect["remedy"] else line)


def _gap_table(document: dict[str, Any]) -> Table:
    panels = gap_panels(document)
    table = Table("", *(panel.quantity for panel in panels), text={0})
    for i, step in enumerate(gap_steps(document)):
        both = ([number(series.y[i]) for series in reversed(panel.series)] for panel in panels)
        table.add_row(step, *(" / ".join(fixed(value, 3) for value in pair) for pair in both))
    return table


def _pose_table(document: dict[str, Any]) -> Table:
    table = Table("", "before", "± σ", "after", "± σ", "moved", "", text={6})
    for row in pose_rows(document):
        table.add_row(*row)
    return table


def pose_rows(document: dict[str, Any]) -> Iterator[tuple[str, str, str, str, str, str, str]]:
    """Of x to yaw: name, before, its deviation, after, its deviation, how far it moved, unit."""
    before, after = document["initial_pose_before"], document["initial_pose_after"]
    sigma_before, sigma_after = (
        np.sqrt(np.diag(np.array(document[key], dtype=float)))
        for key in ("covariance_before", "covariance_after")
    )
    for i, name in enumerate(("x", "y", "z", "roll", "pitch", "yaw")):
        angle = i >= 3
        key = "euler_rad" if angle else "position_m"
        a, b = before[key][i % 3], after[key][i % 3]
        shown = degrees if angle else _millimetres
        move = (b - a + np.pi) % (2 * np.pi) - np.pi if angle else b - a
        yield (
            name,
            fixed(shown(a), 2),
            fixed(shown(float(sigma_before[i])), 2),
            fixed(shown(b), 2),
            fixed(shown(float(sigma_after[i])), 2),
            fixed(shown(float(move)), 2),
            "°" if angle else "mm",
        )


def _millimetres(value: float | None) -> float | None:
    return scaled(value, 1e3)


def left_over(document: dict[str, Any]) -> list[str]:
    """Channels whose rests disagree with the final model far more than their readings ripple.

    Below what the sigma of the robot file allows, so that the verdict may be good all the same.
    """
    last = document["gap"][-1]["after_effect"] if document["gap"] else None
    lines = []
    for entry in document["gap"]:
        ripple, rms = document["ripple"].get(entry["channel"]), entry["train_rms"]
        if entry["after_effect"] != last or not ripple or rms is None:
            continue
        if rms > _STANDS_OUT * ripple:
            name, unit, factor = GAP_CHANNELS[entry["channel"]]
            lines.append(f"{name} {rms * factor:.2g} {unit} (they ripple by {ripple * factor:.2g})")
    return lines


def unexplained_line(left: dict[str, Any]) -> str:
    label, factor = _OF_CHANNEL[left["channel"]]
    # What merely contradicts the robot file is held against that; what depends on something,
    # against the readings.
    against = (
        "the sigma of the robot file is"
        if left["depends_on"] == _NOTHING
        else "the readings themselves ripple by"
    )
    return (
        f"unexplained: {left['channel']}, rms {fixed(scaled(left['rms'], factor), 3)} {label} "
        f"where {against} {fixed(scaled(left['sigma'], factor), 3)} {label}; it depends on "
        f"{left['depends_on']}" + (f", on cable {left['cable']} alone" if left.get("cable") else "")
    )
