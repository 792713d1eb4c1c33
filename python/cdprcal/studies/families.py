"""Families of robots: the static workspace, or the plan, of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal._core import Robot
from cdprcal.studies.variants import variants
from cdprcal.studies.workers import Workers, spread

Variant = tuple[dict[str, float], Robot]


@dataclass(frozen=True)
class WorkspaceRow:
    """The static workspace of one robot; NaN and None where nothing is inside."""

    changes: dict[str, float]
    points_inside: int
    volume_m3: float
    box: tuple[tuple[float, ...], tuple[float, ...]] | None  #: largest inside: two corners [m]


@dataclass(frozen=True)
class PlanRow:
    """The plan of one robot; NaN where there is none, and the reason."""

    changes: dict[str, float]
    status: str
    reason: str
    poses: int
    duration_s: float
    position_sigma_m: float  #: predicted, of the initial pose
    rotation_sigma_rad: float


def workspaces(
    robot: Robot,
    values: Mapping[str, Sequence[float]],
    *,
    step_m: float = 0.05,
    workers: Workers | None = None,
    **options: Any,
) -> list[WorkspaceRow]:
    """The workspace of every combination of values (see ``vary``), in their order.

    ``options`` are those of ``compute_workspace``. Raises InputError as these do.
    """
    work = partial(_workspace, step_m=step_m, options=options)
    return spread(work, variants(robot, values), workers)


def _workspace(variant: Variant, step_m: float, options: dict[str, Any]) -> WorkspaceRow:
    changes, robot = variant
    # One thread: the others have a robot of their own.
    found = _core.compute_workspace(robot, step_m=step_m, threads=1, **options)
    if found.points_inside == 0:
        return WorkspaceRow(changes, 0, 0.0, None)
    box = _core.largest_inscribed_box(found)
    corners = None if box is None else (tuple(box.lower_m.tolist()), tuple(box.upper_m.tolist()))
    return WorkspaceRow(
        changes, found.points_inside, _core.workspace_shape(found).volume_m3, corners
    )


def plans(
    robot: Robot,
    values: Mapping[str, Sequence[float]],
    *,
    workers: Workers | None = None,
    **options: Any,
) -> list[PlanRow]:
    """The plan of every combination of values (see ``vary``), in their order.

    ``options`` are those of ``make_plan``. A plan that cannot be made is a row with its reason.
    """
    return spread(partial(_plan, options=options), variants(robot, values), workers)


def _plan(variant: Variant, options: dict[str, Any]) -> PlanRow:
    changes, robot = variant
    made = _core.make_plan(robot, threads=1, **options)
    if made.status != _core.PlanStatus.planned:
        nothing = float("nan")
        return PlanRow(changes, made.status.name, made.reason, 0, nothing, nothing, nothing)
    plan = made.plan
    sigma = np.asarray(plan.predicted_standard_deviation)
    return PlanRow(
        changes,
        made.status.name,
        made.reason,
        len(plan.poses),
        plan.duration_s,
        float(np.linalg.norm(sigma[:3])),
        float(np.linalg.norm(sigma[3:])),
    )
