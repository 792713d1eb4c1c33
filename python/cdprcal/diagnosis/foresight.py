"""What a planned run would say of effects: sizes that show, look-alikes, places to add."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal.diagnosis.table import believable, shown_size
from cdprcal.planning.start_up import stops_of
from cdprcal.results import number, numbers
from cdprcal.terminal import Table, answers, say

#: Imitated to this share an effect cannot be told from the other, as in ``diagnose``.
ALIKE = _core.DiagnoseOptions().rival_share
#: Places that are tried, along the sides of a box wider than the plan's by this factor.
_SIDES, _WIDER = (3, 3, 3), 1.3
#: A place is worth its time when the effects asked for show at sizes smaller by this share.
_LEAST_GAIN = 0.1
#: Of the rests' readings while places are compared, in the robot file's σ: the mean of a rest. With
#: more, what no place shows by itself would look hopeless from the start.
_NOISE = 0.1
#: Of what no believable size shows, in typical sizes; what is smaller than this is small enough.
_HOPELESS, _ENOUGH = 100.0, 0.01


def foresight_as_dict(robot: _core.Robot, plan: _core.Plan) -> dict[str, Any]:
    """The key ``diagnose`` of ``plan --diagnose --json``."""
    seen = _foreseen(robot, *stops_of(plan))
    return {
        "poses": seen.poses,
        "effects": [
            {
                "name": effect.info.name,
                "detectable": number(effect.detectable),
                "imitated": {
                    other: number(share)
                    for other, share in zip(seen.names, effect.imitated, strict=True)
                    if other != effect.info.name
                },
            }
            for effect in seen.effects
        ],
    }


def positions_that_show(
    robot: _core.Robot,
    plan: _core.Plan,
    box: _core.Box,
    asked: Sequence[str],
    most: int = 6,
    progress: Callable[[str, float], object] = lambda stage, share: None,
) -> list[NDArray[np.float64]]:
    """Where to measure besides, so that these effects show at smaller sizes and look less alike.

    One place after the other, each the one that then helps most, visited twice; none where no place
    helps. Places are positions [3] [m]. Raises InputError for a name that rest cannot show.
    """
    tensions_N, poses = stops_of(plan)
    offered = _places(robot, box)
    chosen: list[NDArray[np.float64]] = []
    least = _badness(robot, tensions_N, poses, asked)
    while len(chosen) < most and offered:
        tried = []
        for k, (pose, tension_N) in enumerate(offered):
            progress("places that show more", (len(chosen) + k / len(offered)) / most)
            # Twice, with another stop between: drifts and directions of motion show by returning.
            tried.append(
                _badness(
                    robot,
                    [*tensions_N, tension_N, tensions_N[0], tension_N],
                    [*poses, pose, poses[0], pose],
                    asked,
                )
            )
        best = int(np.argmin(tried))
        if not tried[best] < least - _LEAST_GAIN * len(asked):
            break
        pose, tension_N = offered.pop(best)
        tensions_N = [*tensions_N, tension_N, tensions_N[0], tension_N]
        poses = [*poses, pose, poses[0], pose]
        least = tried[best]
        chosen.append(np.asarray(pose.position_m))
    return chosen


def print_foresight(document: dict[str, Any], robot: _core.Robot) -> None:
    """Each effect: the size from which four of five would be found, and what would look like it."""
    out = answers()
    infos = {info.name: info for info in _core.effects_of(robot)}
    added = document.get("added_positions_m")
    if added is not None:
        where = ", ".join("(" + ", ".join(f"{x:.2f}" for x in place) + ") m" for place in added)
        asked = ", ".join(document["asked"])
        say(
            out,
            f"added for {asked}: {where}"
            if added
            else f"no place in reach would tell more of {asked}",
        )
    say(out, f"what {document['poses']} rests with the robot file's sigma would show")
    before = document.get("detectable_without", {})
    columns = ["effect", "found from", "of its usual size", "would look like"]
    table = Table(
        *columns[:3], *(["without"] if before else []), columns[3], text={0, 1, 4 if before else 3}
    )
    for row in document["effects"]:
        size = row["detectable"]
        seen = size is not None and believable(infos[row["name"]], size)
        alike = [name for name, share in row["imitated"].items() if share and share > ALIKE]
        without = before.get(row["name"])
        table.add_row(
            row["name"],
            shown_size(infos[row["name"]], size, robot) if seen else "no believable size",
            f"{size:.2g}" if seen else "",
            *([f"{without:.2g}" if without is not None else ""] if before else []),
            ", ".join(alike),
        )
    out.print(table)


def with_added(
    document: dict[str, Any],
    robot: _core.Robot,
    without: _core.Plan,
    asked: Sequence[str],
    added: Sequence[NDArray[np.float64]],
) -> dict[str, Any]:
    """``foresight_as_dict`` of a plan to which places were added, with what was before."""
    seen = _foreseen(robot, *stops_of(without), asked)
    return document | {
        "asked": list(asked),
        "added_positions_m": [numbers(place) for place in added],
        "detectable_without": {e.info.name: number(e.detectable) for e in seen.effects},
    }


def _foreseen(
    robot: _core.Robot,
    tensions_N: Sequence[NDArray[np.float64]],
    poses: Sequence[_core.Pose],
    of: Sequence[str] = (),
    noise: float = 1.0,
) -> _core.Foresight:
    held = _core.holds_orientation(robot)
    stops = list(poses) if held else []
    return _core.foresee(robot, list(tensions_N), stops, noise=noise, of=list(of))


def _badness(
    robot: _core.Robot,
    tensions_N: Sequence[NDArray[np.float64]],
    poses: Sequence[_core.Pose],
    asked: Sequence[str],
) -> float:
    """Logarithms of the sizes that show, and how far others imitate beyond what is told apart."""
    seen = _foreseen(robot, tensions_N, poses, asked, _NOISE)
    total = 0.0
    for effect in seen.effects:
        size = effect.detectable if math.isfinite(effect.detectable) else _HOPELESS
        total += math.log(min(max(size, _ENOUGH), _HOPELESS))
        total += sum(
            (share - ALIKE) / (1.0 - ALIKE)
            for name, share in zip(seen.names, effect.imitated, strict=True)
            if name != effect.info.name and share > ALIKE
        )
    return total


def _places(robot: _core.Robot, box: _core.Box) -> list[tuple[_core.Pose, NDArray[np.float64]]]:
    """Equilibria on a grid about a box, within the limits of the tensions."""
    lower, upper = np.asarray(box.lower_m), np.asarray(box.upper_m)
    middle, half = 0.5 * (lower + upper), 0.5 * _WIDER * (upper - lower)
    axes = [np.linspace(-1.0, 1.0, count) for count in _SIDES]
    at = [middle + half * np.array(x) for x in np.stack(np.meshgrid(*axes), -1).reshape(-1, 3)]
    out = []
    for place in at:
        there = _core.inverse(robot, place)
        if there.status == _core.EquilibriumStatus.found and there.pose is not None:
            out.append((there.pose, there.tension_N))
    return out
