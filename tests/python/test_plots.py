"""What the plots of a diagnosis show, of a document small enough to know the answer."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex

from cdprcal.diagnosis.pictures import (
    draw_formulas,
    draw_gap,
    draw_held_out,
    draw_ranking,
    draw_residuals,
)
from cdprcal.diagnosis.plots import fits, gap_panels, gap_steps, ranked, residual_panels
from cdprcal.pictures import new_figure, save_figure
from cdprcal.report.figures import course, ranking, staircase


def effect(name: str, *rivals: str) -> dict[str, Any]:
    return {"name": name, "p_value": 0.001, "rivals": list(rivals)}


def residual(time_s: float, length_m: list[float | None], yaw_rad: float) -> dict[str, Any]:
    return {
        "run_time_s": time_s,
        "length_m": length_m,
        "swivel_rad": [None, None],
        "tension_N": [],
        "roll_pitch_yaw_rad": [None, None, yaw_rad],
    }


DOCUMENT: dict[str, Any] = {
    "effects": [effect("mass", "load_cell_gain")],
    "ranking": [
        {"name": "mass", "log_evidence": 20.0},
        {"name": "load_cell_gain", "log_evidence": 19.0},
        {"name": "cable_sag", "log_evidence": -1.0},
        {"name": "cable_creep", "log_evidence": None},
    ],
    "gap": [
        {"after_effect": None, "channel": "tension_N", "train_rms": 8.0, "held_out_rms": 9.0},
        {"after_effect": None, "channel": "length_m", "train_rms": 0.002, "held_out_rms": 0.003},
        {"after_effect": "mass", "channel": "length_m", "train_rms": 0.001, "held_out_rms": None},
    ],
    "ripple": {"length_m": 0.0005, "swivel_rad": None},
    "residuals": {
        "before": [residual(0.0, [0.001, -0.002], 0.01), residual(5.0, [None, 0.004], 0.02)],
        "after": [residual(0.0, [0.0, -0.001], 0.01), residual(5.0, [None, 0.001], 0.02)],
    },
}


def test_residuals_are_in_the_units_of_people_and_only_of_what_was_read() -> None:
    panels = residual_panels(fits(DOCUMENT), DOCUMENT["ripple"])
    assert [(p.row, p.column, p.title) for p in panels] == [
        (0, 0, "cable 1"),
        (0, 1, "cable 2"),
        (1, 0, "roll"),
        (1, 1, "pitch"),
        (1, 2, "yaw"),
    ]
    before, after = panels[1].series
    assert (before.x, before.y) == ([0.0, 5.0], [-2.0, 4.0])
    assert after.y == [-1.0, 1.0]
    assert math.isnan(panels[0].series[0].y[1])
    assert panels[1].quantity == "length [mm]"
    assert panels[1].ripple == 0.5
    assert panels[1].largest == 4.0
    assert panels[4].series[0].y == pytest.approx([0.572958, 1.145916])
    assert panels[4].ripple is None


def test_without_effects_there_is_one_fit() -> None:
    assert [fit.label for fit in fits(DOCUMENT | {"effects": []})] == ["model as given"]


def test_the_staircase_has_the_channels_in_their_order_and_gaps_where_nothing_is() -> None:
    assert gap_steps(DOCUMENT) == ["as given", "+ mass"]
    faulty = {"effects": [effect("swivel_sign") | {"p_value": None}]}
    assert gap_steps(DOCUMENT | faulty)[0] == "faults set right"
    length, tension = gap_panels(DOCUMENT)
    held_out, fitted = length.series
    assert (held_out.label, fitted.label) == ("held out", "fitted")
    assert fitted.y == [2.0, 1.0]
    assert held_out.y[0] == 3.0
    assert math.isnan(held_out.y[1])
    assert tension.series[1].y[0] == 8.0
    assert math.isnan(tension.series[1].y[1])


def test_the_ranking_says_what_became_of_each() -> None:
    assert ranked(DOCUMENT) == [
        ("mass", 20.0, "accepted"),
        ("load_cell_gain", 19.0, "rival: cannot be told apart"),
        ("cable_sag", -1.0, "other"),
    ]
    assert len(ranked(DOCUMENT, 1)) == 1


def test_picture_and_page_draw_the_same() -> None:
    page = staircase(DOCUMENT)["data"]
    drawn = [
        patch for axes in draw_gap(DOCUMENT).axes for patch in axes.patches if patch.get_label()
    ]
    assert [patch.get_label() for patch in drawn] == [trace["name"] for trace in page]
    colours = [to_hex(patch.get_edgecolor()).lower() for patch in drawn]
    assert colours == [trace["line"]["color"].lower() for trace in page]
    assert len(draw_residuals(DOCUMENT).axes) == 5
    names = [text.get_text() for text in draw_ranking(DOCUMENT).axes[0].get_yticklabels()]
    assert names[:3] == ["cable_sag", "load_cell_gain", "mass"]


def test_bars_of_rivals_are_filled_below_their_hatching() -> None:
    figure = ranking(DOCUMENT)
    assert figure is not None
    fills = {bar["name"]: bar["marker"]["pattern"].get("fillmode") for bar in figure["data"]}
    assert fills == {"accepted": None, "rival: cannot be told apart": "overlay", "other": None}


def test_what_is_drawn_over_a_logarithm_are_points() -> None:
    held_out = {"held_out": {"before": 20.0, "after": 7.0}}
    figure = draw_held_out(DOCUMENT | {"effects": [effect("mass") | held_out]})
    axes = figure.axes[1]
    assert not axes.patches
    assert {line.get_label(): np.asarray(line.get_ydata()).tolist() for line in axes.lines} == {
        "without": [20.0],
        "with": [7.0],
    }


def test_a_formulas_axes_say_what_they_are() -> None:
    points = [{"cable": 1, "x": 40.0, "read": 2.0, "added": 1.5}]
    drawn = course({"course": {"to": "tension_N", "variable": "tension_N", "points": points}})
    titles = [drawn["layout"][axis]["title"]["text"] for axis in ("xaxis", "yaxis")]
    assert titles == ["tension [N]", "tension, read minus model [N]"]


def test_no_line_is_drawn_between_the_poses_of_a_law() -> None:
    """A sine of fewer poses than a period has is no zigzag."""
    points = [{"cable": 1, "x": x, "read": 2.0, "added": 1.5} for x in (3.0, 1.0, 2.0)]
    law = {"to": "tension_N", "variable": "tension_N", "points": points}
    drawn = {"course": law, "formula": {"tension_N": "a * tension_N"}}
    (axes,) = draw_formulas({"effects": [drawn]}).axes
    lines = {str(line.get_linestyle()) for line in axes.lines if np.size(line.get_xdata()) == 3}
    assert lines == {"None"}
    assert {trace["mode"] for trace in course(drawn)["data"]} == {"markers"}


def test_the_legend_of_the_residuals_lies_on_no_panel() -> None:
    figure = draw_residuals(DOCUMENT)
    assert [axes.get_legend() for axes in figure.axes] == [None] * 5
    (legend,) = figure.legends
    figure.draw_without_rendering()
    place = legend.get_window_extent()
    panels = [axes.get_tightbbox() for axes in figure.axes]
    assert not any(panel is None or place.overlaps(panel) for panel in panels)


@pytest.mark.parametrize("kind", ["svg", "pdf", "png"])
def test_a_picture_drawn_twice_is_the_same_file(tmp_path: Path, kind: str) -> None:
    drawn = []
    for number in (1, 2):
        figure = new_figure(3.0, 2.0)
        figure.subplots().plot([0.0, 1.0], [0.0, 1.0], label="a line")
        path = tmp_path / f"{number}.{kind}"
        save_figure(figure, path)
        drawn.append(path.read_bytes())
        time.sleep(1.1)  # of what has a date, it is another
    assert drawn[0] == drawn[1]
