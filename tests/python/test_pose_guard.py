"""The platform stays in the plan's corridor, whatever the load cells say."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal.acquisition import Acquired, Guide, PoseGuard, acquire, start_up_plan
from cdprcal.acquisition.remedies import remedy_for
from cdprcal.hardware.simulated import SimulatedBackend
from cdprcal.io import AcquisitionInputs, open_live_log
from conftest import Ran
from winch_bus import small_plan

#: Low and slack: where a load cell's offset of 3 N is worth 0.2 m of height.
LOW = [[0.2, 0.2, 0.25], [-0.2, -0.2, 0.3], [0.2, -0.2, 1.2], [-0.3, 0.2, 0.2]]
LYING = ["load_cell_bias=3,3,3,3", "pulley_friction=0.03"]


@pytest.fixture(scope="module")
def low_plan(robot: cdprcal.Robot) -> cdprcal.Plan:
    result = cdprcal.make_plan(robot, positions_m=[np.array(p) for p in LOW])
    assert result.status == cdprcal.PlanStatus.planned, result.reason
    return result.plan


@dataclass
class Ended:
    run: Acquired
    lowest_m: float  #: truly, of the platform's point
    worst_sigmas: float  #: of the estimate in motion
    excess_m: float  #: beyond the corridor, truly


def start_up(
    robot: cdprcal.Robot,
    plan: cdprcal.Plan,
    path: Path,
    effects: list[str],
    margin_m: float,
    floor_m: float = -math.inf,
    *,
    seed: int = 1,
) -> Ended:
    options = cdprcal.SimulatorOptions(
        seed=seed, effects=[cdprcal.parse_injected_effect(text) for text in effects]
    )
    backend = SimulatedBackend.somewhere(robot, plan, options)
    startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
    guide = Guide(robot, plan, startup)
    guard = PoseGuard(robot, plan, margin_m, floor_m)
    places = np.array([plan.start_pose.position_m, *(p.pose.position_m for p in plan.poses)])
    lower, upper = places.min(axis=0) - margin_m, places.max(axis=0) + margin_m
    ended = Ended(None, math.inf, 0.0, -math.inf)  # type: ignore[arg-type]

    def watch(command: cdprcal.StartUpCommand, sample: cdprcal.RobotSample, logged: bool) -> None:
        estimate = guide.step(command, sample, logged)
        if estimate is not None:
            guard.learn(estimate)
        true_m = backend.truth().pose.position_m
        ended.lowest_m = min(ended.lowest_m, true_m[2])
        if guard.position_m is not None:
            ended.excess_m = max(ended.excess_m, float(np.max([lower - true_m, true_m - upper])))
            off = np.abs(guard.position_m - true_m) / guard.sigma_m
            ended.worst_sigmas = max(ended.worst_sigmas, float(off.max()))

    log = open_live_log(path, 4, AcquisitionInputs("", "", {}), 10.0)
    ended.run = acquire(startup, backend, log, watch=watch, guard=guard.look)
    return ended


def test_a_platform_that_is_led_away_is_stopped(
    robot: cdprcal.Robot, low_plan: cdprcal.Plan, tmp_path: Path
) -> None:
    free = start_up(robot, low_plan, tmp_path / "free.csv", LYING, 2.0)
    assert free.run.state == cdprcal.StartUpState.done
    assert free.lowest_m < 0.05  # planned were 0.2 m and more
    held = start_up(robot, low_plan, tmp_path / "held.csv", LYING, 0.1)
    assert held.run.state == cdprcal.StartUpState.holding
    said = re.search(
        r"leaves the plan's corridor: z = (\S+) ± (\S+) m, where 0\.100 to 1\.300 m",
        held.run.reason,
    )
    assert said, held.run.reason
    assert held.excess_m < 3.0 * float(said[2]) + 0.02
    assert held.lowest_m > free.lowest_m


def test_the_floor(robot: cdprcal.Robot, low_plan: cdprcal.Plan, tmp_path: Path) -> None:
    held = start_up(robot, low_plan, tmp_path / "run.csv", LYING, 2.0, 0.15)
    assert held.run.state == cdprcal.StartUpState.holding
    assert re.search(r"too close to the floor: .* and 0\.150 m is the limit", held.run.reason)
    assert held.lowest_m > 0.15 - 0.05


@pytest.mark.parametrize(
    ("effects", "seed"),
    [([], 1), (["load_cell_bias=4,-4,4,-4"], 2), (["pulley_friction=0.03", "mass=0.5"], 3)],
)
def test_nobody_is_stopped_within_the_corridor_and_the_sigma_is_honest(
    effects: list[str], seed: int, robot: cdprcal.Robot, tmp_path: Path
) -> None:
    path = tmp_path / "run.csv"
    ended = start_up(robot, small_plan(robot), path, effects, 0.1, 0.0, seed=seed)
    assert ended.run.state == cdprcal.StartUpState.done, ended.run.reason
    assert 0.0 < ended.worst_sigmas < 3.0


def test_without_an_estimate_nothing_is_known(robot: cdprcal.Robot) -> None:
    plan = small_plan(robot)
    guard = PoseGuard(robot, plan, 0.0, 10.0)
    backend = SimulatedBackend.somewhere(robot, plan, cdprcal.SimulatorOptions(seed=1))
    assert guard.look(backend.read()) == ""
    assert guard.position_m is None


@pytest.mark.parametrize(
    ("margin_m", "floor_m", "words"),
    [
        (-0.1, 0.0, r"corridor: -0\.1 m must be 0 to 2\.3"),
        (math.nan, 0.0, "corridor: nan m must be"),
        (math.inf, 0.0, "corridor: inf m must be"),
        (2.4, 0.0, r"corridor: 2\.4 m must be"),
        (0.1, math.nan, "floor: nan m must be a height"),
        (0.1, math.inf, "floor: inf m must be a height"),
    ],
)
def test_what_guards_nothing_is_refused(
    margin_m: float, floor_m: float, words: str, robot: cdprcal.Robot
) -> None:
    with pytest.raises(cdprcal.InputError, match=words):
        PoseGuard(robot, small_plan(robot), margin_m, floor_m)


def test_both_reasons_have_a_remedy() -> None:
    assert "--corridor-m" in remedy_for("the platform leaves the plan's corridor: z = …")
    assert "--floor-m" in remedy_for("the platform comes too close to the floor: its …")


def test_the_command(cli: Callable[..., Ran], low_plan: cdprcal.Plan, tmp_path: Path) -> None:
    plan, log = tmp_path / "plan.csv", tmp_path / "run.csv"
    plan.write_text(cdprcal.format_plan(low_plan))
    effects = [word for text in LYING for word in ("--effect", text)]
    ran = cli("acquire", "irma4", plan, "--quick", "-o", log, "--json", *effects)
    assert ran.code == 1
    assert "leaves the plan's corridor: z" in json.loads(ran.stdout)["reason"]
    ran = cli("acquire", "irma4", plan, "-o", log, "--quick", "--corridor-m", "-1")
    assert ran.code == 2
