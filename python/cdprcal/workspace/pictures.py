"""A picture of a static workspace: its surface, and two cuts with the margin to the limits."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal.pictures import draw_box, new_figure, save_figure
from cdprcal.workspace.document import plane_area_m2

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_BOX, _PULLEY, _SURFACE = "#c44e52", "#333333", "#8fb3d9"
_OUTSIDE = {
    _core.PointStatus.infeasible: ("#f3cdb4", "beyond the tension limits"),
    _core.PointStatus.unstable: ("#d3bfe3", "unstable"),
    _core.PointStatus.no_equilibrium: ("#cfcfcf", "no equilibrium"),
    _core.PointStatus.obstructed: ("#b9cfa8", "something in the way"),
}
_FINEST = 30.0  # triangles in the picture along the longest side of the workspace, about


def write_workspace_picture(
    workspace: _core.Workspace, shape: _core.AlphaShape, path: Path
) -> None:
    """Writes draw_workspace(…). Raises InputError when the file cannot be written."""
    save_figure(draw_workspace(workspace, shape), path)


def draw_workspace(workspace: _core.Workspace, shape: _core.AlphaShape) -> Figure:
    """The surface in space; a horizontal and a vertical cut through the middle.

    Of a planar platform its plane alone.
    """
    figure = new_figure(13.0, 4.9)
    parts = figure.subfigures(1, 2, width_ratios=(1.0, 1.7), wspace=0.04, squeeze=False)
    left, right = parts.ravel()
    inscribed = _core.largest_inscribed_box(workspace)
    _draw_surface(left.add_subplot(projection="3d"), workspace, shape.mesh, inscribed)
    margins = _margins(workspace)
    middle = _middle(workspace, inscribed)
    plane = plane_area_m2(workspace, shape)
    flat = [n for n in range(3) if workspace.grid.count[n] == 1]
    normals = [2, 1] if plane is None else flat
    cuts = right.subplots(1, len(normals), squeeze=False).ravel()
    for axes, normal in zip(cuts, normals, strict=True):
        image = _draw_cut(axes, workspace, margins, middle, normal, inscribed)
    right.colorbar(image, ax=cuts, label="margin to the tension limits [N]", shrink=0.85)
    handles = [handle for axes in cuts for handle in axes.get_legend_handles_labels()[0]]
    labelled = {str(handle.get_label()): handle for handle in handles}
    right.legend(
        labelled.values(), labelled.keys(), loc="outside lower center", ncols=5, fontsize=8
    )
    size = f"{shape.volume_m3:.3g} m³" if plane is None else f"{plane:.3g} m²"
    part = "" if workspace.complete else " (interrupted: a part of it)"
    figure.suptitle(f"{workspace.robot.name}: static workspace, {size}{part}", fontsize=11)
    return figure


def _draw_surface(axes: Any, workspace: _core.Workspace, mesh: _core.Mesh, box: Any) -> None:
    """In three dimensions matplotlib is not typed."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    triangles = _thinned(mesh)
    axes.add_collection3d(
        Poly3DCollection(triangles, facecolors=_SURFACE, shade=True, alpha=0.75, linewidth=0)
    )
    pulleys = _pulleys(workspace)
    axes.plot(*pulleys.T, "s", color=_PULLEY, markersize=4)
    if box is not None:
        corners = np.array([box.lower_m, box.upper_m])
        ends = list(itertools.product((0, 1), repeat=3))
        for a, b in itertools.combinations(ends, 2):
            if sum(i != j for i, j in zip(a, b, strict=True)) == 1:
                edge = np.array([[corners[c[k], k] for k in range(3)] for c in (a, b)])
                axes.plot(*edge.T, color=_BOX, linewidth=1.1)
    points = np.vstack([triangles.reshape(-1, 3), pulleys])
    low, high = points.min(axis=0), points.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    axes.view_init(elev=18, azim=-62)
    for name, extent in zip("xyz", high - low, strict=True):
        getattr(axes, f"set_{name}label")(f"{name} [m]", fontsize=8)
        if extent < 0.1 * (high - low).max():  # no room for numbers
            getattr(axes, f"set_{name}ticks")([])
    axes.tick_params(labelsize=7)


def _thinned(mesh: _core.Mesh) -> Array:
    """Triangles [f, 3, 3], vertices merged on a lattice where the mesh is finer than a picture."""
    vertices = mesh.vertices_m
    low = vertices.min(axis=0)
    cell = float((vertices.max(axis=0) - low).max()) / _FINEST
    _, of_vertex, count = np.unique(
        np.round((vertices - low) / cell), axis=0, return_inverse=True, return_counts=True
    )
    of_vertex = of_vertex.reshape(-1)
    total = np.stack([np.bincount(of_vertex, column) for column in vertices.T], axis=1)
    faces = of_vertex[mesh.faces]
    whole = (
        (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    )
    thinned: Array = (total / count[:, None])[faces[whole]]
    return thinned


def _margins(workspace: _core.Workspace) -> Array:
    """Distance of the closest tension to its limit [n_z, n_y, n_x]; NaN outside."""
    margins = np.full(workspace.status.shape, np.nan)
    low, high = workspace.robot.tension_limits_N
    tension = workspace.tension_N
    index = np.round((workspace.inside_m - workspace.grid.origin_m) / workspace.grid.step_m)
    x, y, z = index.astype(int).T
    margins[z, y, x] = np.minimum(tension - low, high - tension).min(axis=1)
    return margins


def _middle(workspace: _core.Workspace, box: _core.Box | None) -> list[int]:
    """Grid indices (x, y, z) through which to cut: the box's middle, or the points' mean."""
    at = workspace.inside_m.mean(axis=0) if box is None else 0.5 * (box.lower_m + box.upper_m)
    grid = workspace.grid
    index = np.round((at - grid.origin_m) / grid.step_m).astype(int)
    return [int(i) for i in np.clip(index, 0, np.array(grid.count) - 1)]


def _draw_cut(
    axes: Axes,
    workspace: _core.Workspace,
    margins: Array,
    middle: list[int],
    normal: int,
    box: _core.Box | None,
) -> Any:
    """The grid's plane through the middle, perpendicular to world axis `normal`."""
    from matplotlib.colors import ListedColormap

    across, up = [axis for axis in range(3) if axis != normal]
    grid = workspace.grid
    plane = tuple(middle[axis] if axis == normal else slice(None) for axis in (2, 1, 0))
    half = 0.5 * grid.step_m
    last = grid.origin_m + grid.step_m * (np.array(grid.count) - 1)
    extent = (
        grid.origin_m[across] - half, last[across] + half,
        grid.origin_m[up] - half, last[up] + half,
    )  # fmt: skip
    status = workspace.status[plane]
    for kind, (colour, label) in _OUTSIDE.items():
        here = np.ma.masked_not_equal(status, int(kind))
        axes.imshow(here, ListedColormap([colour]), origin="lower", extent=extent)
        if here.count():
            axes.plot([], [], "s", color=colour, markersize=9, label=label)
    image = axes.imshow(
        margins[plane],
        "viridis",
        origin="lower",
        extent=extent,
        vmin=0.0,
        vmax=float(np.nanmax(margins)),
    )
    pulleys = _pulleys(workspace)
    axes.plot(pulleys[:, across], pulleys[:, up], "s", color=_PULLEY, markersize=5, label="pulleys")
    if box is not None:
        style = {"edgecolor": _BOX, "linewidth": 1.4, "label": "largest inscribed box"}
        draw_box(axes, box, across, up, **style)
    at = float(grid.origin_m[normal] + grid.step_m * middle[normal])
    axes.set_title(f"cut at {'xyz'[normal]} = {at:.3g} m", fontsize=10)
    axes.set_xlabel(f"{'xyz'[across]} [m]", fontsize=9)
    axes.set_ylabel(f"{'xyz'[up]} [m]", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.margins(0.05)
    return image


def _pulleys(workspace: _core.Workspace) -> Array:
    return np.array([cable.pulley.position_m for cable in workspace.robot.cables])
