"""A still picture of the robot in space, for browsers that cannot draw it: no WebGL, no scripts."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np

from cdprcal.pictures import new_figure

_WIDTH_IN, _HEIGHT_IN, _DOTS_PER_INCH = 9.0, 6.2, 100
#: Plotly's line widths and marker sizes are in pixels, matplotlib's in points.
_POINTS_A_PIXEL = 0.5
_MARKERS = {"circle": "o", "circle-open": "o", "diamond": "D", "square": "s"}


def still_picture(figure: dict[str, Any]) -> str:
    """The scene as plotly would first show it, as a PNG in a data URL.

    figure: of ``scene``. What is drawn is its traces, so that both show the same.
    """
    picture = new_figure(_WIDTH_IN, _HEIGHT_IN)
    axes: Any = picture.add_subplot(projection="3d")
    for trace in figure["data"]:
        _draw(axes, trace)
    eye = [figure["layout"]["scene"]["camera"]["eye"][a] for a in "xyz"]
    elevation = np.degrees(np.arctan2(eye[2], np.hypot(eye[0], eye[1])))
    axes.view_init(elev=elevation, azim=np.degrees(np.arctan2(eye[1], eye[0])))
    axes.set_aspect("equal")
    for name in "xyz":
        getattr(axes, f"set_{name}label")(f"{name} [m]", fontsize=8)
        getattr(axes, f"{name}axis").pane.set_visible(False)
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=5)
    axes.legend(fontsize=8, loc="lower center", ncols=4, frameon=False, bbox_to_anchor=(0.5, -0.08))
    file = io.BytesIO()
    picture.savefig(file, dpi=_DOTS_PER_INCH, format="png")
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"


def _draw(axes: Any, trace: dict[str, Any]) -> None:
    x, y, z = (np.array(trace[name], dtype=float) for name in "xyz")
    label = trace["name"] if trace.get("showlegend", True) and trace["name"] else None
    if trace["type"] == "mesh3d":
        faces = np.stack([trace[name] for name in "ijk"], axis=-1)
        style = {"color": trace["color"], "alpha": trace["opacity"], "linewidth": 0.0}
        axes.plot_trisurf(x, y, z, triangles=faces, label=label, **style)
    elif trace["type"] == "surface":
        colour = trace["colorscale"][0][1]
        axes.plot_surface(x, y, z, color=colour, alpha=trace["opacity"], label=label, shade=False)
    elif trace["mode"] == "lines":
        line = trace["line"]
        width = line["width"] * _POINTS_A_PIXEL
        axes.plot(x, y, z, color=line["color"], linewidth=width, label=label)
    else:
        marker = trace["marker"]
        symbol = marker["symbol"]
        full = "none" if symbol.endswith("-open") else marker["color"]
        axes.plot(
            x,
            y,
            z,
            _MARKERS[symbol],
            color=marker["color"],
            markerfacecolor=full,
            markersize=marker["size"],
            label=label,
        )
        for text, *place in zip(trace.get("text", []), x, y, z, strict=False):
            if "text" in trace["mode"]:
                axes.text(*place, f"{text}\n", fontsize=9, ha="center", va="bottom")
