"""What all pictures share: figures without a window system, files written all or nothing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdprcal.extras import need
from cdprcal.io.files import atomic_output
from cdprcal.io.replacing import MAKER, check_ending

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cdprcal._core import Box

_DOTS_PER_INCH = 130


def new_figure(width_in: float, height_in: float) -> Figure:
    """Without pyplot: no window system, no state that outlives the picture."""
    need("matplotlib")
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), layout="constrained")


def draw_box(axes: Axes, box: Box, across: int, up: int, **style: Any) -> None:
    """The outline of a box, seen along the world axis that is neither of these two."""
    from matplotlib.patches import Rectangle

    low, size = box.lower_m, box.upper_m - box.lower_m
    axes.add_patch(Rectangle((low[across], low[up]), size[across], size[up], fill=False, **style))


def save_figure(figure: Figure, path: Path) -> None:
    """Writes in the format of the name. Raises InputError when that cannot be."""
    import matplotlib

    check_ending(path, "picture")
    kind = path.suffix[1:].lower()
    # One figure is one file: neither the day nor a draw of names goes into it. Who made it does.
    undated = {
        "png": {"Software": MAKER},
        "pdf": {"Creator": MAKER, "CreationDate": None},
        "svg": {"Creator": MAKER, "Date": None},
    }.get(kind)
    with matplotlib.rc_context({"svg.hashsalt": "cdprcal"}), atomic_output(path) as temporary:
        figure.savefig(temporary, dpi=_DOTS_PER_INCH, format=kind, metadata=undated)
