"""A static workspace as plain data: the document of ``workspace --json``."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.planning.document import box_as_dict
from cdprcal.results import number, numbers


def workspace_as_dict(
    workspace: _core.Workspace,
    shape: _core.AlphaShape,
    *,
    heights_m: list[float] | None = None,
    probes_m: list[list[float]] | None = None,
) -> dict[str, Any]:
    """``box`` is the largest one inside (or None), ``searched_box`` where was searched.

    ``plane_area_m2`` is of planar platforms, whose shape is drawn as a slab one step thick.
    ``complete`` is False when the search was interrupted: everything is a lower bound then.
    """
    inscribed = _core.largest_inscribed_box(workspace)
    grid = workspace.grid
    status = np.bincount(workspace.status.ravel(), minlength=len(_core.PointStatus))
    return {
        "robot": workspace.robot.name,
        "complete": workspace.complete,
        "volume_m3": number(shape.volume_m3),
        "area_m2": number(shape.mesh.area_m2),
        "plane_area_m2": plane_area_m2(workspace, shape),
        "points_tested": workspace.points_tested,
        "points_inside": workspace.points_inside,
        "points": {s.name: int(status[s]) for s in _core.PointStatus},
        "box": None if inscribed is None else box_as_dict(inscribed),
        "searched_box": box_as_dict(grid.box),
        "step_m": grid.step_m,
        "vertices": numbers(shape.mesh.vertices_m),
        "faces": shape.mesh.faces.tolist(),
        "alpha_m2": number(shape.alpha_m2),
        "components": shape.components,
        "watertight": shape.watertight,
        "sections": [_section(shape.mesh, height) for height in heights_m or []],
        "probes": [_probe(workspace, shape.mesh, position) for position in probes_m or []],
    }


def is_planar(robot: _core.Robot) -> bool:
    """Whether the platform stays in a plane."""
    return robot.platform.motion_plane_normal is not None


def plane_area_m2(workspace: _core.Workspace, shape: _core.AlphaShape) -> float | None:
    """Of a planar platform, whose shape is a slab one step thick; None of any other."""
    return shape.volume_m3 / workspace.grid.step_m if is_planar(workspace.robot) else None


def _section(mesh: _core.Mesh, height_m: float) -> dict[str, Any]:
    """Outer polygons run counter-clockwise, holes clockwise: signed areas add up."""
    polygons = mesh.cross_section(height_m)
    return {
        "height_m": height_m,
        "area_m2": sum(_area(polygon) for polygon in polygons),
        "polygons": [numbers(polygon) for polygon in polygons],
    }


def _area(polygon: Any) -> float:
    x, y = polygon[:, 0], polygon[:, 1]
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def _probe(workspace: _core.Workspace, mesh: _core.Mesh, position_m: list[float]) -> dict[str, Any]:
    found = _core.probe(workspace, position_m)
    return {
        "position_m": position_m,
        "inside": mesh.contains(position_m),
        "status": found.status.name,
        "reason": found.reason,
        "rotation": None if found.pose is None else numbers(found.pose.rotation),
        "tension_N": None if found.pose is None else numbers(found.tension_N),
        "margin_N": number(found.margin_N),
        "stiffness_N_m": {
            "locked_lengths": number(found.stability.locked_lengths_N_m),
            "constant_tensions": number(found.stability.constant_tensions_N_m),
        },
    }


def round_step_m(box: _core.Box, points: float) -> float:
    """The step of a grid of about so many points in a box, to two digits.

    As many along each side, fewer in all, in the flat box of a planar platform.
    """
    return float(f"{max(_core.even_step_m(box, points), 1e-4):.2g}")
