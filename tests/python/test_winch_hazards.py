"""What may be wrong before a robot is armed: it is stopped or refused, and the cause is named."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import cdprcal
from conftest import few
from winch_bus import watched_run
from winch_hazards import ALL, MODES, Hazard, attempt, session_in


@pytest.mark.parametrize("mode", few(MODES))
@pytest.mark.parametrize(
    "effect", ["load_cell_bias=16,-16,16,-16", "transmission_ratio=0.03,0.03,-0.03,0.03"]
)
def test_what_robots_have_is_no_hazard(
    effect: str, mode: str, robot: cdprcal.Robot, plan: cdprcal.Plan, tmp_path: Path
) -> None:
    """Effects as large as they are met: nobody is stopped for them."""
    hidden = [cdprcal.parse_injected_effect(effect)]
    watched = watched_run(session_in(mode), robot, plan, tmp_path / "run.csv", effects=hidden)
    assert watched.run.state == cdprcal.StartUpState.done, watched.run.reason


@pytest.mark.parametrize(
    ("hazard", "mode"),
    [pytest.param(h, mode, id=f"{h.name}, {mode}") for h in ALL for mode in h.modes],
)
def test_hazards(
    hazard: Hazard, mode: str, robot: cdprcal.Robot, plan: cdprcal.Plan, tmp_path: Path
) -> None:
    stopped = attempt(hazard, mode, robot, plan, tmp_path / "run.csv")
    assert re.search(hazard.cause, stopped.reason), stopped.reason
    if stopped.watched is not None:
        assert stopped.watched.run.state == cdprcal.StartUpState.holding
        assert stopped.watched.over_s <= 0.05
        assert stopped.watched.sniffer.outside == []
