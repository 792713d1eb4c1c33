"""Effects as text that come with the package: hidden by the plant's own physics, and found."""

from __future__ import annotations

from pathlib import Path

import pytest

import cdprcal
from cdprcal import effect_files
from conftest import Cli

#: As the plant takes them, at two or three typical sizes.
HIDDEN = (
    "load_cell_drift_each=0.06,-0.05,0.04,-0.06",
    "load_cell_curvature=0.001,-0.0008,0.0009,-0.001",
    "load_cell_side_load=0.3",
    "load_cell_cross_talk=0.05",
    "drum_layers=0.008",
    "encoder_backlash=0.003",
    "swivel_eccentricity=0.03,-0.02,0.025,-0.03,0.02,0.03,-0.02,-0.03",
    "bent_frame_under_load=0.00005",
    "pulley_creep_under_load=0.00005",
    "iron_on_the_platform=0.15,0.1",
)


@pytest.fixture(scope="module")
def more(robot: cdprcal.Robot) -> cdprcal.Robot:
    return cdprcal.with_effect_definitions(robot, effect_files.text("more"), "more")


@pytest.fixture(scope="module")
def plan(robot: cdprcal.Robot) -> cdprcal.Plan:
    return cdprcal.make_plan(robot, order=cdprcal.VisitingOrder.random, seed=2).plan


@pytest.mark.parametrize("hidden", HIDDEN, ids=lambda hidden: hidden.partition("=")[0])
def test_what_the_plant_does_is_named(
    hidden: str, robot: cdprcal.Robot, more: cdprcal.Robot, plan: cdprcal.Plan
) -> None:
    name = hidden.partition("=")[0]
    run = cdprcal.simulate_startup(robot, plan, effects=[hidden], seed=4)
    found = cdprcal.diagnose(more, run.log)
    assert [effect.info.name for effect in found.effects] == [name]


def test_of_clean_logs_nothing_is_said(
    robot: cdprcal.Robot, more: cdprcal.Robot, plan: cdprcal.Plan
) -> None:
    for seed in (11, 12, 13):
        found = cdprcal.diagnose(more, cdprcal.simulate_startup(robot, plan, seed=seed).log)
        assert found.verdict == cdprcal.Verdict.consistent


def test_the_plants_physics_gives_way_to_a_formula_of_the_same_name(
    robot: cdprcal.Robot, plan: cdprcal.Plan
) -> None:
    text = """\
effect_definitions:
  - name: encoder_backlash
    parameters: {half_play_m: {per: cable, typical: 0.001, plausible: 0.01}}
    adds: {length_m: half_play_m * length_direction}
"""
    own = cdprcal.with_effect_definitions(robot, text, "own")
    each = "encoder_backlash=0.001,0.002,0.003,0.004"
    with pytest.raises(cdprcal.InputError, match="4 values do not fit 4 cables"):
        cdprcal.simulate_startup(robot, plan, effects=[each])
    assert cdprcal.simulate_startup(own, plan, effects=[each]).state


def test_the_file_is_printed_and_taken_by_name(cli: Cli, tmp_path: Path) -> None:
    printed = cli("effects", "--print", "more")
    assert printed.stdout == effect_files.text("more")
    mine = tmp_path / "mine.yaml"
    mine.write_text(printed.stdout)
    listed = [cli("effects", "--effects", name).stdout for name in ("more", str(mine))]
    assert listed[0] == listed[1]
    assert "encoder_backlash" in listed[0]
    cli("effects", "--print", "less").refused("give more")
