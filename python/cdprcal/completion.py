"""Values that shells complete: robots, effects, and the words of an option."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer


def one_of(words: str, *names: str, help: str) -> Any:
    """An option whose value is one of some words: 'unified|static|kinematic'."""

    def complete(incomplete: str) -> list[str]:
        return [word for word in words.split("|") if word.startswith(incomplete)]

    return typer.Option(*names, metavar=words, autocompletion=complete, help=help)


def robot_names(incomplete: str) -> list[str]:
    """Built-in robots, and the YAML files and folders that begin so."""
    from cdprcal._core import builtin_robot_names

    return [
        *(name for name in builtin_robot_names() if name.startswith(incomplete)),
        *paths(incomplete, (".yaml", ".yml")),
    ]


def effect_files(incomplete: str) -> list[str]:
    """Files of effects that come with the package."""
    from cdprcal.effect_files import names

    return [name for name in names() if name.startswith(incomplete)]


def effect_names(incomplete: str) -> list[str]:
    """What diagnose names: effects of the catalogue, what happens once, faults."""
    from cdprcal._core import load_robot
    from cdprcal.effect_names import infos_by_name, injectable

    names = dict.fromkeys([*infos_by_name(load_robot("irma4")), *injectable()])
    return [name for name in names if name.startswith(incomplete)]


def effect_file_names(incomplete: str) -> list[str]:
    """Files of effects that come with the package, and the YAML files that begin so."""
    return [*effect_files(incomplete), *paths(incomplete, (".yaml", ".yml"))]


def injected_effects(incomplete: str) -> list[str]:
    """What a simulated machine can have, with the = that its values come after."""
    from cdprcal.effect_names import injectable

    return [f"{name}=" for name in injectable() if name.startswith(incomplete)]


def paths(incomplete: str, endings: tuple[str, ...]) -> list[str]:
    """Files with one of the endings, and folders, that begin so."""
    folder, _, begin = incomplete.rpartition("/")
    try:
        found = sorted(Path(f"{folder}/" if folder or incomplete[:1] == "/" else ".").iterdir())
    except OSError:
        return []
    lead = f"{folder}/" if "/" in incomplete else ""
    return [
        f"{lead}{path.name}{'/' if path.is_dir() else ''}"
        for path in found
        if path.name.startswith(begin)
        and not (path.name.startswith(".") and not begin)
        and (path.is_dir() or path.suffix in endings)
    ]
