"""A track as a picture: position and attitude over time, with their 2 σ."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.pictures import new_figure, save_figure
from cdprcal.tracking.document import deviations

_NAMES = (("x", "y", "z"), ("roll", "pitch", "yaw"))


def draw_track(track: _core.Track, axes: Any) -> None:
    """Into two Axes, one above the other: position, and attitude."""
    time_s = track.time_s
    sigma = deviations(track.pose_covariance)
    trusted = track.trusted
    groups = (
        (track.position_m - track.position_m[0], 1e3 * sigma[:, :3], 1e3, "moved [mm]"),
        (
            np.unwrap(track.roll_pitch_yaw_rad, axis=0),
            np.degrees(sigma[:, 3:]),
            180 / np.pi,
            "attitude [deg]",
        ),
    )
    for ax, names, (values, sigmas, factor, label) in zip(axes, _NAMES, groups, strict=True):
        for i, name in enumerate(names):
            shown = np.where(trusted, factor * values[:, i], np.nan)
            (line,) = ax.plot(time_s, shown, linewidth=1.0, label=name)
            band = 2 * sigmas[:, i]
            ax.fill_between(
                time_s, shown - band, shown + band, color=line.get_color(), alpha=0.25, linewidth=0
            )
        ax.fill_between([], [], [], color="gray", alpha=0.25, linewidth=0, label="± 2 σ")
        ax.set_ylabel(label)
        # Above the lines, which may be anywhere.
        ax.legend(
            loc="lower right", bbox_to_anchor=(1, 1), ncols=4, frameon=False, borderaxespad=0.2
        )
    axes[-1].set_xlabel("time [s]")


def write_track_picture(track: _core.Track, path: Path) -> None:
    """Writes PNG, PDF or SVG. Raises InputError when that cannot be."""
    figure = new_figure(9.0, 5.5)
    draw_track(track, figure.subplots(2, sharex=True))
    save_figure(figure, path)
