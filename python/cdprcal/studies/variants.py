"""Robots that differ from one in a few values of its file."""

from __future__ import annotations

import io
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from cdprcal import _core
from cdprcal._core import InputError, Robot

_AXES = {"x": 0, "y": 1, "z": 2}


def vary(robot: Robot, changes: Mapping[str, float]) -> Robot:
    """The robot with values of its file set to others, each named by where it stands.

    ``platform.mass_kg``; ``platform.centre_of_mass_m.z``; ``cables.2.pulley.radius_m`` (cables
    count from 1); ``cables.*.pulley.radius_m`` is all cables. Raises InputError naming the value
    that is not there, or what the robot file's own checks say.
    """
    from ruamel.yaml import YAML

    yaml = YAML()
    document = yaml.load(_core.to_yaml(robot))
    for name, value in changes.items():
        for holder, key in _places(document, name.split("."), name):
            holder[key] = value
    text = io.StringIO()
    yaml.dump(document, text)
    return _core.parse_robot(text.getvalue(), f"{robot.name} with {_words(changes)}")


def variants(
    robot: Robot, values: Mapping[str, Sequence[float]]
) -> list[tuple[dict[str, float], Robot]]:
    """(changes, robot) of every combination of the values; see ``vary``."""
    names = list(values)
    combinations = [
        dict(zip(names, chosen, strict=True)) for chosen in itertools.product(*values.values())
    ]
    return [(changes, vary(robot, changes)) for changes in combinations]


def _words(changes: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in changes.items()) or "no change"


def _places(at: Any, path: list[str], name: str) -> list[tuple[Any, Any]]:
    """(container, key) of every number that the path names."""
    key, rest = path[0], path[1:]
    keys: list[Any]
    if isinstance(at, dict):
        keys = [key] if key in at else []
        known = ", ".join(str(k) for k in at)
    elif isinstance(at, list):
        keys = _indices(at, key)
        known = "x, y, z" if _is_vector(at) else f"1 to {len(at)}, or * for all"
    else:
        raise InputError(
            f"{name}: is no value of a robot file: nothing is inside {at}; leave it out"
        )
    if not keys:
        raise InputError(f"{name}: the robot file has no {key!r} there; known are {known}")
    if rest:
        return [place for k in keys for place in _places(at[k], rest, name)]
    for k in keys:
        if isinstance(at[k], bool) or not isinstance(at[k], int | float):
            raise InputError(f"{name}: is not one number; name what is inside it as well")
    return [(at, k) for k in keys]


def _is_vector(at: list[Any]) -> bool:
    return len(at) == len(_AXES) and all(isinstance(v, int | float) for v in at)


def _indices(at: list[Any], key: str) -> list[Any]:
    if _is_vector(at):
        return [_AXES[key]] if key in _AXES else []
    if key == "*":
        return list(range(len(at)))
    return [int(key) - 1] if key.isdecimal() and 1 <= int(key) <= len(at) else []
