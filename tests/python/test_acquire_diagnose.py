"""``acquire --diagnose``: the evidence grows rest by rest, and the run ends when it has told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import cdprcal
from cdprcal.acquisition import Guide, start_up_options, start_up_plan
from cdprcal.acquisition.told import Told, settled, told_by
from cdprcal.io.events import told_in
from conftest import Cli


def told(
    *effects: tuple[str, float, tuple[str, ...]],
    verdict: str = "explained",
    within_reach: bool = False,
) -> Told:
    return Told(verdict, (), effects, {}, within_reach)


def test_it_is_settled_when_the_same_is_said_three_times_without_a_rival() -> None:
    bias = told(("load_cell_bias", 40.0, ()))
    assert settled([bias] * 2) == ""
    assert "no rival is left" in settled([bias] * 3)
    assert settled([bias, told(("mass", 40.0, ())), bias]) == ""
    assert settled([told(("load_cell_bias", 4.0, ()))] * 9) == ""


def test_it_is_not_settled_while_another_effect_begins_to_show() -> None:
    bias = told(("load_cell_bias", 40.0, ()))
    assert settled([bias, bias, replace(bias, suspect="yaw_drift")]) == ""
    assert settled([bias, replace(bias, suspect="yaw_drift"), bias]) != ""


def test_rivals_get_more_rests_and_nothing_found_gets_all() -> None:
    tied = told(("mass", 90.0, ("load_cell_gain",)), within_reach=True)
    assert settled([tied] * 5) == ""
    assert "told nothing more apart" in settled([tied] * 6)
    for_ever = told(("mass", 90.0, ("external_force",)))
    assert settled([for_ever] * 2) == ""
    assert "no stop of the plan" in settled([for_ever] * 3)
    assert settled([told(verdict="consistent")] * 20) == ""
    assert settled([told(("mass", 90.0, ()), verdict="unexplained")] * 20) == ""
    assert settled([]) == ""


@pytest.fixture
def plan(cli: Cli, tmp_path: Path) -> Path:
    path = tmp_path / "plan.csv"
    assert cli("plan", "irma4", "--order", "random", "-o", path).code == 0
    return path


def test_a_run_ends_when_the_effect_is_known(cli: Cli, plan: Path, tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    hidden = ("--effect", "load_cell_bias=6,-5,14,-8", "--seed", "3")
    ran = cli("acquire", "irma4", plan, *hidden, "--quick", "--diagnose", "--json", "-o", log)
    document = ran.document()
    assert "no rival is left" in document["settled"]
    last = document["estimates"][-1]["diagnosis"]
    assert [effect["name"] for effect in last["effects"]] == ["load_cell_bias"]
    assert len(document["rests"]) < 17
    assert "load_cell_bias" in cli("diagnose", "irma4", log).stdout.splitlines()[0]
    page = tmp_path / "report.html"
    assert cli("report", "irma4", log, "-o", page).code == 0
    text = page.read_text()
    assert '"told-0"' in text
    assert text.count("explained: load_cell_bias (") == len(told_in(log)) >= 3


def test_events_of_others_are_no_diagnoses(tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    log.write_text(
        '# event| {"time_s": 1, "estimate": {"diagnosis": 3}}\n'
        '# event| {"time_s": 2, "estimate": {"diagnosis": {"verdict": "explained"}}}\n'
        '# event| {"time_s": 3, "estimate": {}}\n'
    )
    assert told_in(log) == ()


def test_a_clean_robot_goes_through_its_plan(cli: Cli, plan: Path, tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    ran = cli("acquire", "irma4", plan, "--seed", 3, "--quick", "--diagnose", "-o", log)
    assert ran.code == 0, ran.stderr
    assert "17 of 17 set-points measured" in ran.stdout
    assert "consistent: no effect found" in ran.stdout
    assert "next: cdprcal diagnose irma4" in ran.stdout


def test_it_goes_where_rivals_come_apart(robot: cdprcal.Robot) -> None:
    plan = cdprcal.make_plan(robot, order=cdprcal.VisitingOrder.random).plan
    startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True), start_up_options(plan))
    guide = Guide(robot, plan, startup, diagnoses=True, quick=True)
    stops = [i for i, stop in enumerate(plan.poses) if stop.measured]
    chosen = guide._telling(stops[:2], {stops[5]: 4.0, stops[9]: 0.5})
    assert chosen is not None
    assert chosen.stop == stops[5]
    # Worth nothing more: on in the plan's order.
    onward = guide._telling(stops[:2], {})
    assert onward is not None
    assert onward.stop == stops[2]
    assert guide._telling(stops, {}) is None


def test_stops_are_worth_what_they_tell_between_rivals(robot: cdprcal.Robot) -> None:
    plan = cdprcal.make_plan(robot, order=cdprcal.VisitingOrder.random).plan
    run = cdprcal.simulate_startup(robot, plan, effects=["mass=0.8"], seed=4)
    left = {i: stop for i, stop in enumerate(plan.poses) if stop.measured}
    heavy = told_by(robot, run.log, left)
    assert heavy is not None
    assert heavy.rivals
    assert set(heavy.worth) == set(left)
    # What pulls straight down does so everywhere.
    assert not heavy.within_reach
    assert not any(heavy.worth.values())
    assert told_by(robot, run.log).worth == {}  # type: ignore[union-attr]
    with pytest.raises(cdprcal.InputError, match="give the place of one in effects"):
        cdprcal.separation_by_stops(cdprcal.diagnose(robot, [run.log]), 9, "mass", [], [])
