"""How fine a workspace is looked at when nobody says."""

from __future__ import annotations

from cdprcal import _core


def round_step_m(box: _core.Box, points: float) -> float:
    """The step of a grid of about so many points in a box, to two digits.

    As many along each side, fewer in all, in the flat box of a planar platform.
    """
    return float(f"{max(_core.even_step_m(box, points), 1e-4):.2g}")
