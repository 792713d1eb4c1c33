"""What may be wrong before a robot is armed: it is stopped or refused, and the cause is named."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import cdprcal
from winch_bus import small_plan
from winch_hazards import ALL, MODES, Hazard, attempt


@pytest.fixture(scope="module")
def plan(robot: cdprcal.Robot) -> cdprcal.Plan:
    return small_plan(robot)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("hazard", ALL, ids=lambda hazard: hazard.name)
def test_hazards(
    hazard: Hazard, mode: str, robot: cdprcal.Robot, plan: cdprcal.Plan, tmp_path: Path
) -> None:
    stopped = attempt(hazard, mode, robot, plan, tmp_path / "run.csv")
    assert re.search(hazard.cause, stopped.reason), stopped.reason
    if stopped.watched is not None:
        assert stopped.watched.run.state == cdprcal.StartUpState.holding
        assert stopped.watched.over_s <= 0.05
        assert stopped.watched.sniffer.outside == []
