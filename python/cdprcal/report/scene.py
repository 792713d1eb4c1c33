"""The robot in three dimensions: workspace, cables, platform, poses, uncertainty."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal.diagnosis.plots import AFTER, BEFORE, CABLES
from cdprcal.report.figures import INK, MUTED, Figure, layout, rounded
from cdprcal.workspace import round_step_m
from cdprcal.workspace.document import plane_area_m2

Array = NDArray[np.float64]

_WORKSPACE_POINTS = 12_000
#: Poses that the slider goes through, at most.
MOST_SHOWN = 60
_ARC_POINTS, _CIRCLE_POINTS = 6, 19
#: χ² of three degrees of freedom that 95 % stay below.
_CHI_SQUARE_95 = 7.814728
#: Of the robot's own size: how large the uncertainty ellipsoid is drawn at least.
_ELLIPSOID_SHARE = 0.06
#: The box around the scene, of what is drawn in it, and its thinnest side of its longest.
_ROOM, _THINNEST = 1.04, 0.1


def scene(robot: _core.Robot, document: dict[str, Any], workspace: _core.Mesh | None) -> Figure:
    """Plotly's figure, and ``poses``: what moves with the slider, by pose.

    document: of ``calibrate --json``, with at least one pose.
    """
    poses = [_core.Pose(p["position_m"], p["rotation"]) for p in document["poses"]]
    kinds = [p["kind"] for p in document["poses"]]
    shown = [i for i, kind in enumerate(kinds) if i == 0 or kind == "static"][:MOST_SHOWN]
    moving = [_moving(robot, poses[i]) for i in shown]
    data = [] if workspace is None else [_workspace(workspace)]
    data += _fixed(robot)
    first = len(data)
    data += _cables(moving[0])
    data += _platform(moving[0])
    last = len(data)
    data += _poses(document, kinds)
    data += _ellipsoid(robot, document)
    figure_layout = layout(
        620,
        scene=_box(data, moving),
        legend={"orientation": "h", "x": 0.5, "xanchor": "center", "y": 0, "yanchor": "top"},
    )
    figure_layout["margin"] = {"l": 0, "r": 0, "t": 0, "b": 0}
    return {
        "data": data,
        "layout": figure_layout,
        "moving": {
            "traces": list(range(first, last)),
            "poses": moving,
            "labels": [_label(i, document["poses"][i], robot) for i in shown],
        },
    }


def _box(data: list[dict[str, Any]], moving: list[dict[str, Any]]) -> dict[str, Any]:
    """Axes to one scale around all that is drawn at any pose, the longest side 1.

    ``eye`` is a direction: report.js goes as far back as the page's shape asks for.
    """
    lines = [[trace[a] for a in "xyz"] for trace in data]
    lines += [line for at in moving for line in (*at["cables"], at["pulleys"], at["edges"])]
    sides = [np.concatenate([np.ravel(line[k]).astype(float) for line in lines]) for k in range(3)]
    low, high = np.nanmin(sides, axis=1), np.nanmax(sides, axis=1)
    longest = float((high - low).max()) or 1.0
    # A side that is thin or nil still has room for its axis.
    half = np.maximum(0.5 * _ROOM * (high - low), 0.5 * _THINNEST * longest)
    middle = 0.5 * (low + high)
    share = half / half.max()
    return {
        "aspectmode": "manual",
        "aspectratio": dict(zip("xyz", rounded(share), strict=True)),
        "camera": {"eye": {"x": 1.0, "y": -1.3, "z": 0.5}, "center": {"x": 0, "y": 0, "z": 0}},
        **{
            f"{a}axis": _scene_axis(a)
            | {
                "range": rounded([middle[k] - half[k], middle[k] + half[k]]),
                "nticks": max(2, round(6 * share[k])),
            }
            for k, a in enumerate("xyz")
        },
    }


def workspace_mesh(robot: _core.Robot) -> tuple[_core.Mesh | None, str]:
    """The static workspace's boundary, and when there is none, why."""
    if robot.cable_count < 3 and not _core.holds_orientation(robot):
        return None, f"The static workspace is not computed for {robot.cable_count} cables"
    box = _core.workspace_box(robot)
    step_m = round_step_m(box, _WORKSPACE_POINTS)
    workspace = _core.compute_workspace(robot, box=box, step_m=step_m)
    if not workspace.points_inside:
        return None, _core.explain_empty(workspace)
    shape = _core.workspace_shape(workspace)
    plane = plane_area_m2(workspace, shape)
    size = f"{shape.volume_m3:.2f} m³" if plane is None else f"{plane:.2f} m², shown one step thick"
    return shape.mesh, f"Static workspace {size}, drawn from a grid of {step_m:g} m"


def magnification(robot: _core.Robot, document: dict[str, Any]) -> float:
    """How many times too large the ellipsoid is drawn: 1, 2, 5, 10 … so that it can be seen."""
    radii, _ = _axes_95(document)
    if radii is None:
        return 1.0
    wanted = _ELLIPSOID_SHARE * _size_m(robot) / float(radii.max())
    if wanted <= 1.0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(wanted))
    return float(max(step for step in (1, 2, 5) if step * decade <= wanted) * decade)


def _size_m(robot: _core.Robot) -> float:
    """Half the diagonal of the pulleys' box, or 1 m for a single pulley."""
    pulleys = np.array([cable.pulley.position_m for cable in robot.cables])
    size = 0.5 * float(np.linalg.norm(np.ptp(pulleys, axis=0)))
    return size or 1.0


def _axes_95(document: dict[str, Any]) -> tuple[Array | None, Array]:
    """Half axes [3] [m] of the 95 % ellipsoid of the initial position, and their directions."""
    if document["covariance"] is None:
        return None, np.eye(3)
    covariance = np.array(document["covariance"], dtype=float)[:3, :3]
    values, vectors = np.linalg.eigh(covariance)
    if not np.isfinite(values).all() or values.max() <= 0:
        return None, np.eye(3)
    return np.sqrt(_CHI_SQUARE_95 * np.maximum(values, 0)), vectors


def _moving(robot: _core.Robot, pose: _core.Pose) -> dict[str, Any]:
    """Points of cables, pulleys and platform at one pose, with None between pieces."""
    state = _core.platform_state(robot, pose)
    cables, circles = [], []
    for i, cable in enumerate(robot.cables):
        leaves = state.cable[i]
        anchor = pose.position_m + state.anchor_arm_m[i]
        pulley, radius = cable.pulley, cable.pulley.radius_m
        if leaves.status != _core.CableStatus.ok:
            cables.append(np.array([pulley.position_m, anchor]))
            continue
        centre = pulley.position_m + radius * leaves.radial
        around = [radius * _on_circle(leaves, pulley, angle) for angle in _arc(leaves, pulley)]
        cables.append(np.array([*(centre + p for p in around), anchor]))
        angles = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_POINTS)
        circles.append(
            np.array([centre + radius * _on_circle(leaves, pulley, angle) for angle in angles])
        )
    anchors = pose.position_m + state.anchor_arm_m
    return {
        "cables": [_columns(line) for line in cables],
        "pulleys": _columns(_joined(circles)),
        "anchors": _columns(anchors),
        "edges": _columns(_joined(_edges(anchors, pose.position_m))),
        "centre": _columns(np.array([pose.position_m + state.centre_of_mass_arm_m])),
    }


def _on_circle(leaves: _core.CableState, pulley: _core.Pulley, angle_rad: float) -> Array:
    """Unit vector from the pulley's centre, in its plane; 0 points away from D."""
    point: Array = np.cos(angle_rad) * leaves.radial + np.sin(angle_rad) * pulley.swivel_axis
    return point


def _arc(leaves: _core.CableState, pulley: _core.Pulley) -> Array:
    """Angles from D (at ±π) to where the cable leaves, the way round that eq. 5 counts."""
    end = math.atan2(
        float(leaves.contact @ pulley.swivel_axis), float(leaves.contact @ leaves.radial)
    )
    if pulley.radius_m == 0.0:
        return np.array([math.pi])
    sweep = (leaves.length_m - leaves.free_length_m) / pulley.radius_m
    start = min((math.pi, -math.pi), key=lambda angle: abs(abs(end - angle) - sweep))
    return np.linspace(start, end, _ARC_POINTS)


def _edges(anchors: Array, origin: Array) -> list[Array]:
    """Outline of the anchors as seen from above them, and spokes to the platform's origin."""
    outline = []
    if len(anchors) > 2:
        centre = anchors.mean(axis=0)
        _, _, axes = np.linalg.svd(anchors - centre)
        flat = (anchors - centre) @ axes[:2].T
        order = np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))
        outline = [anchors[[*order, order[0]]]]
    return outline + [np.array([origin, anchor]) for anchor in anchors]


def _workspace(mesh: _core.Mesh) -> dict[str, Any]:
    x, y, z = _columns(mesh.vertices_m, 3)
    i, j, k = mesh.faces.T.tolist()
    return {
        "type": "mesh3d",
        "x": x,
        "y": y,
        "z": z,
        "i": i,
        "j": j,
        "k": k,
        "name": "static workspace",
        "showlegend": True,
        "color": "#8fa6bd",
        "opacity": 0.13,
        "hoverinfo": "skip",
        "lighting": {"ambient": 0.75, "diffuse": 0.4, "specular": 0.0},
    }


def _fixed(robot: _core.Robot) -> list[dict[str, Any]]:
    positions = np.array([cable.pulley.position_m for cable in robot.cables])
    pulleys = _markers(_columns(positions), "pulleys", INK, "square", 3.5)
    return [
        pulleys
        | {
            "mode": "markers+text",
            "text": [str(i + 1) for i in range(robot.cable_count)],
            "textposition": "top center",
            "textfont": {"size": 14, "color": INK},
            "hovertemplate": "pulley %{text}<br>%{x:.3f}, %{y:.3f}, %{z:.3f} m<extra></extra>",
        }
    ]


def _cables(at: dict[str, Any]) -> list[dict[str, Any]]:
    traces = [
        _line(line, f"cable {i + 1}", CABLES[i % 8], 5)
        | {"hovertemplate": f"cable {i + 1}<extra></extra>", "showlegend": False}
        for i, line in enumerate(at["cables"])
    ]
    pulleys = _line(at["pulleys"], "", INK, 4) | {"hoverinfo": "skip", "showlegend": False}
    return [*traces, pulleys]


def _platform(at: dict[str, Any]) -> list[dict[str, Any]]:
    said = "centre of mass<br>%{x:.4f}, %{y:.4f}, %{z:.4f} m<extra></extra>"
    return [
        _line(at["edges"], "platform", INK, 5) | {"hoverinfo": "skip"},
        _markers(at["centre"], "centre of mass", INK, "diamond", 5) | {"hovertemplate": said},
    ]


def _poses(document: dict[str, Any], kinds: list[str]) -> list[dict[str, Any]]:
    rows = document["poses"]
    traces = []
    for kind, label, colour, symbol, size in (
        ("static", "poses at rest", AFTER, "circle", 4.5),
        ("kinematic", "poses in motion", MUTED, "circle-open", 2.5),
    ):
        own = [row for i, row in enumerate(rows) if i and kinds[i] == kind]
        if own:
            traces.append(_visited(own, label, colour, symbol, size))
    return [*traces, _visited(rows[:1], "initial pose", BEFORE, "diamond", 6)]


def _visited(
    rows: list[dict[str, Any]], label: str, colour: str, symbol: str, size: float
) -> dict[str, Any]:
    places = _columns(np.array([row["position_m"] for row in rows]))
    return _markers(places, label, colour, symbol, size) | {
        "text": [f"{row['time_s']:.1f} s" for row in rows],
        "hovertemplate": "%{text}<br>%{x:.4f}, %{y:.4f}, %{z:.4f} m<extra></extra>",
    }


def _ellipsoid(robot: _core.Robot, document: dict[str, Any]) -> list[dict[str, Any]]:
    """95 % ellipsoid of the initial position, drawn larger than it is, and says so."""
    radii, directions = _axes_95(document)
    if radii is None:
        return []
    times = magnification(robot, document)
    u, v = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 25), np.linspace(0.0, np.pi, 13))
    ball = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1)
    points = (ball * (times * radii)) @ directions.T + np.array(document["poses"][0]["position_m"])
    x, y, z = (points[..., i].round(5).tolist() for i in range(3))
    label = "95 % ellipsoid" if times == 1.0 else f"95 % ellipsoid, × {times:g}"
    half_mm = ", ".join(f"{1e3 * r:.2g}" for r in sorted(radii, reverse=True))
    return [
        {
            "type": "surface",
            "x": x,
            "y": y,
            "z": z,
            "surfacecolor": np.zeros_like(points[..., 0]).tolist(),
            "colorscale": [[0, BEFORE], [1, BEFORE]],
            "showscale": False,
            "showlegend": True,
            "opacity": 0.35,
            "name": label,
            "hovertemplate": f"{label}<br>half axes {half_mm} mm<extra></extra>",
            "contours": {a: {"highlight": False} for a in "xyz"},
        }
    ]


def _points(columns: list[list[Any]], mode: str, name: str) -> dict[str, Any]:
    places = dict(zip("xyz", columns, strict=True))
    return {"type": "scatter3d", **places, "mode": mode, "name": name}


def _line(columns: list[list[Any]], name: str, colour: str, width: float) -> dict[str, Any]:
    return _points(columns, "lines", name) | {"line": {"color": colour, "width": width}}


def _markers(
    columns: list[list[Any]], name: str, colour: str, symbol: str, size: float
) -> dict[str, Any]:
    marker = {"size": size, "color": colour, "symbol": symbol}
    return _points(columns, "markers", name) | {"marker": marker}


def _scene_axis(name: str) -> dict[str, Any]:
    return {
        "title": {"text": f"{name} [m]", "font": {"size": 12, "color": MUTED}},
        "showbackground": False,
        "gridcolor": "#e3e7eb",
        "zerolinecolor": "#cfd6dd",
        "tickfont": {"size": 11, "color": MUTED},
        "showspikes": False,
    }


def _label(index: int, pose: dict[str, Any], robot: _core.Robot) -> str:
    """What the slider says of a pose."""
    x, y, z = pose["position_m"]
    roll, pitch, yaw = np.rad2deg(
        _core.euler_from_rotation(pose["rotation"], robot.euler_convention)
    )
    name = "initial pose" if index == 0 else f"pose {index}"
    return (
        f"{name}, {pose['time_s']:.1f} s: x {x:z.4f}, y {y:z.4f}, z {z:z.4f} m; "
        f"roll {roll:z.2f}, pitch {pitch:z.2f}, yaw {yaw:z.2f}°"
    ).replace("-", "\N{MINUS SIGN}")


def _joined(pieces: list[Array]) -> Array:
    """Pieces of lines one after the other, NaN between them."""
    gap = np.full((1, 3), np.nan)
    parts = [part for piece in pieces for part in (piece, gap)]
    return np.concatenate(parts) if parts else np.zeros((0, 3))


def _columns(points: Array, digits: int = 4) -> list[list[Any]]:
    return [rounded(points[:, i], digits) for i in range(3)]
