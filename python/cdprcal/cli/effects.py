"""``cdprcal effects`` and ``cdprcal explain``: the catalogue of what a model may lack."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdprcal.command import (
    EffectsOption,
    JsonOption,
    fail,
    print_json,
    reports_errors,
    robot_with_effects,
)
from cdprcal.completion import effect_files, effect_names

if TYPE_CHECKING:
    from cdprcal import _core

EFFECTS_EXAMPLE = "Example: cdprcal effects --json > effects.json"
EXPLAIN_EXAMPLE = "Example: cdprcal explain load_cell_bias"


@reports_errors
def effects(
    effects: EffectsOption = None,
    words: Annotated[
        bool, typer.Option("--words", help="List what formulas of your own may name, and add to.")
    ] = False,
    print_: Annotated[
        str,
        typer.Option(
            "--print",
            metavar="NAME",
            help="Print a file of effects that comes with cdprcal (more), to be changed.",
            autocompletion=effect_files,
        ),
    ] = "",
    json: JsonOption = False,
) -> None:
    """List the physical effects that diagnose knows, with what each is and how large usually.

    Sizes are those to expect on irma4; on other robots they grow with weight, length or tension.
    With --effects those of a file too, which is checked by it.
    """
    from cdprcal import _core
    from cdprcal.terminal import Table, answers, say

    if print_:
        _print_file(print_)
        return
    if words:
        _print_words(json=json)
        return
    catalogue = _core.effects_of(robot_with_effects("irma4", effects))
    if json:
        print_json([_document(info) for info in catalogue])
        return
    out = answers()
    say(out, f"{len(catalogue)} effects; cdprcal explain NAME says more about one")
    table = Table("effect", "usually", "what it is", text={0, 1, 2})
    for info in catalogue:
        table.add_row(
            info.name, ", ".join(_size(info, p, p.typical) for p in info.parameters), info.sentence
        )
    out.print(table)


def _print_file(name: str) -> None:
    from cdprcal import effect_files
    from cdprcal.terminal import answers

    names = effect_files.names()
    if name not in names:
        fail(f"--print: {name!r} does not come with cdprcal; give {' or '.join(names)}")
    answers().out(effect_files.text(name), highlight=False, end="")


def _print_words(*, json: bool) -> None:
    from cdprcal import _core
    from cdprcal.terminal import Table, answers, say

    known = _core.formula_words()
    if json:
        print_json(known)
        return
    out = answers()
    for title, group in (("a formula may name", "variables"), ("and adds", "targets")):
        table = Table(title, "which is" if group == "variables" else "", text={0, 1})
        for word, meaning in known[group].items():
            table.add_row(word, meaning)
        out.print(table)
    say(out, f"functions: {', '.join(known['functions'])}; + - * / ^, pi")


@reports_errors
def explain(
    effect: Annotated[
        str,
        typer.Argument(
            metavar="EFFECT",
            help="Name as diagnose and robot files have it; cdprcal effects lists them.",
            autocompletion=effect_names,
        ),
    ],
    effects: EffectsOption = None,
    json: JsonOption = False,
) -> None:
    """Say what an effect is: equation, values, usual size, what it is confused with, what to do.

    Also of what happens once (cable_slip, contact), and of faults of the configuration.
    """
    from cdprcal import _core
    from cdprcal.effect_names import infos_by_name, injectable
    from cdprcal.terminal import answers, say

    robot = robot_with_effects("irma4", effects)
    known, injected = infos_by_name(robot), injectable()
    faults = {name: row["description"] for name, row in injected.items() if name not in known}
    if effect not in known and effect not in faults:
        names = [*known, *faults]
        near = difflib.get_close_matches(effect, names, n=3)
        fail(
            f"{effect!r}: is no effect; give "
            + (f"{' or '.join(near)}, or another" if near else "one")
            + " of those that cdprcal effects lists"
        )
    if json:
        print_json(
            _documents(known[effect]) if effect in known else _of_fault(effect, faults[effect])
        )
        return
    out = answers()
    once = effect in faults or effect in {info.name for info in _core.steps_of(robot)}
    for info in known.get(effect, []):
        _print_effect(info, "value" if once else "in the robot file")
    if effect in faults:
        say(out, f"{effect}: {faults[effect]}")
        say(out, f"what to do: {_SET_RIGHT}")
    if effect in injected:
        values = ",".join(name for name, _ in injected[effect]["parameters"]) if once else "VALUES"
        say(out, f"try it: cdprcal demo --effect {effect}={values}")


_SET_RIGHT = (
    "look at what diagnose says of it, and set it right in the robot file or on the machine"
)


def _print_effect(info: _core.EffectInfo, values: str) -> None:
    """One effect for people; ``values``: the title of those it has."""
    from cdprcal import _core
    from cdprcal.terminal import Table, answers, say

    out = answers()
    say(out, f"{info.name}: {info.sentence}")
    say(out, info.equation)
    table = Table(
        values, "how many", "usually", "at least" if info.inverse else "at most", text=range(4)
    )
    for parameter in info.parameters:
        table.add_row(
            parameter.name,
            _SHAPES[parameter.shape.name],
            _size(info, parameter, parameter.typical),
            _size(info, parameter, parameter.plausible),
        )
    out.print(table)
    if info.one_sided:
        say(out, "it has one sign only")
    if info.scope == _core.EffectScope.run:
        say(out, "it differs from run to run")
    if words := _SHOWS[info.shows.name]:
        say(out, words)
    if info.on_request:
        say(out, f"it is not searched for; cdprcal diagnose --motion --fit {info.name} fits it")
    if info.confused_with:
        say(out, f"looks like: {', '.join(info.confused_with)}")
    if info.settle:
        say(out, f"to tell it from those: {info.settle}")
    if info.remedy:
        say(out, f"what to do: {info.remedy}")


_SHAPES = {
    "scalar": "one number",
    "per_cable": "one a cable",
    "vector3": "x, y, z",
    "per_cable_vector3": "x, y, z a cable",
}

_SHOWS = {
    "at_rest": "",
    "in_motion": "it shows in samples of a platform that moves",
    "in_moving_balance": "it shows where a moving platform balances: diagnose --motion",
}


def _size(info: _core.EffectInfo, parameter: _core.EffectParameter, internal: float) -> str:
    """A size in a unit for people; of a stiffness, whose inverse is what is estimated, itself."""
    from cdprcal.diagnosis.units import for_people

    value = 1.0 / internal if info.inverse else internal
    label, factor = for_people(parameter.unit, value)
    return f"{value * factor:.3g} {label}".strip()


def _documents(infos: list[_core.EffectInfo]) -> dict[str, Any]:
    """Of one name: what else it may be stands beside."""
    first, *others = map(_document, infos)
    return first | {"also": others}


def _of_fault(name: str, description: str) -> dict[str, Any]:
    return {
        "name": name,
        "sentence": description,
        "equation": "",
        "remedy": _SET_RIGHT,
        "settle": "",
        "confused_with": [],
        "one_sided": False,
        "on_request": False,
        "shows": "at_rest",
        "scope": "run",
        "formula": None,
        "parameters": [],
        "also": [],
    }


def _document(info: _core.EffectInfo) -> dict[str, Any]:
    return {
        "name": info.name,
        "sentence": info.sentence,
        "equation": info.equation,
        "remedy": info.remedy,
        "settle": info.settle,
        "confused_with": list(info.confused_with),
        "one_sided": info.one_sided,
        "on_request": info.on_request,
        "shows": info.shows.name,
        "scope": info.scope.name,
        "formula": info.formulas or None,
        "parameters": [
            {
                "name": parameter.name,
                "unit": parameter.unit,
                "shape": parameter.shape.name,
                "typical": parameter.typical,
                "plausible": parameter.plausible,
            }
            for parameter in info.parameters
        ],
        "also": [],
    }
