"""What can be named: effects, what happens once, faults of the configuration."""

from __future__ import annotations

from typing import Any

from cdprcal import _core


def infos_by_name(robot: _core.Robot) -> dict[str, list[_core.EffectInfo]]:
    """Effects of a robot, and what happens once to it, of which several may have one name."""
    out: dict[str, list[_core.EffectInfo]] = {}
    for info in (*_core.effects_of(robot), *_core.steps_of(robot)):
        out.setdefault(info.name, []).append(info)
    return out


def injectable() -> dict[str, dict[str, Any]]:
    """What can be put into a simulated machine and is found again: rows of injectable_effects()."""
    return {row["name"]: row for row in _core.injectable_effects() if not row["generator_only"]}
