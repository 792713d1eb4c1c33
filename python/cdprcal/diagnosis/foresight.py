"""What a planned run would say of effects: the sizes that show, and which look alike."""

from __future__ import annotations

from typing import Any

from cdprcal import _core
from cdprcal.diagnosis.table import believable, shown_size
from cdprcal.results import number
from cdprcal.terminal import Table, answers, say

#: Imitated to this share an effect cannot be told from the other, as in ``diagnose``.
ALIKE = _core.DiagnoseOptions().rival_share


def foresight_as_dict(robot: _core.Robot, plan: _core.Plan) -> dict[str, Any]:
    """The key ``diagnose`` of ``plan --diagnose --json``."""
    stops = [plan.start_tension_N, *(stop.tension_N for stop in plan.poses)]
    poses = [plan.start_pose, *(stop.pose for stop in plan.poses)]
    held = _core.holds_orientation(robot)
    seen = _core.foresee(robot, stops, poses if held else [])
    names = [effect.info.name for effect in seen.effects]
    return {
        "poses": seen.poses,
        "effects": [
            {
                "name": effect.info.name,
                "detectable": number(effect.detectable),
                "imitated": {
                    other: number(share)
                    for other, share in zip(names, effect.imitated, strict=True)
                    if other != effect.info.name
                },
            }
            for effect in seen.effects
        ],
    }


def print_foresight(document: dict[str, Any], robot: _core.Robot) -> None:
    """Each effect: the size from which four of five would be found, and what would look like it."""
    out = answers()
    infos = {info.name: info for info in _core.effects_of(robot)}
    say(out, f"what {document['poses']} rests with the robot file's sigma would show")
    table = Table("effect", "found from", "of its usual size", "would look like", text={0, 1, 3})
    for row in document["effects"]:
        size = row["detectable"]
        seen = size is not None and believable(infos[row["name"]], size)
        alike = [name for name, share in row["imitated"].items() if share and share > ALIKE]
        table.add_row(
            row["name"],
            shown_size(infos[row["name"]], size, robot) if seen else "no believable size",
            f"{size:.2g}" if seen else "",
            ", ".join(alike),
        )
    out.print(table)
