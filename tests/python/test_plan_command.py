"""``cdprcal plan``: its document and file, what it promises, and what it refuses."""
# mypy: disable-error-code="union-attr"
# A pose that is None fails the test by itself.

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Annotation

import cdprcal
from cdprcal.io.replacing import signed
from cdprcal.planning.pictures import draw_plan
from cdprcal.planning.table import print_plan
from conftest import Cli
from robots import altered, angle_between, polygon_robot
from test_cli_bad_input import assert_refused


def plan_of(cli: Cli, *arguments: object) -> dict[str, Any]:
    document: dict[str, Any] = cli("plan", *arguments, "--json").document()
    return document


def robot_file(robot: cdprcal.Robot, folder: Path) -> Path:
    path = folder / f"{robot.name}.yaml"
    path.write_text(cdprcal.to_yaml(robot))
    return path


def effect(name: str, **parameters: list[float]) -> cdprcal.AppliedEffect:
    return cdprcal.AppliedEffect(name=name, parameters=parameters)


def test_document(cli: Cli, robot: cdprcal.Robot) -> None:
    document = plan_of(cli, "irma4")
    assert {
        "poses",
        "start_tension_N",
        "duration_s",
        "predicted_standard_deviation",
    } <= document.keys()
    assert len(document["poses"]) == 8
    assert document["order_is_optimal"]
    total = document["start_dwell_s"]
    for pose in document["poses"]:
        assert pose["measured"]
        assert len(pose["natural_frequencies_hz"]) == 2
        assert min(pose["natural_frequencies_hz"]) > 0.0
        rest = cdprcal.direct_from_tensions(robot, pose["tension_N"])
        assert rest.pose.position_m == pytest.approx(pose["position_m"], abs=1e-6)
        assert angle_between(rest.pose.rotation, np.array(pose["rotation"])) < 1e-6
        total += pose["transition_s"] + pose["dwell_s"]
    assert document["duration_s"] == pytest.approx(total)
    deviation = document["predicted_standard_deviation"]
    assert len(deviation["position_m"]) == len(deviation["rotation_rad"]) == 3
    assert 0.0 < np.linalg.norm(deviation["position_m"]) < 0.1
    # Table II's positions, each once.
    corners = {tuple(np.round(pose["position_m"], 6)) for pose in document["poses"]}
    assert corners == {(x, y, z) for x in (-0.4, 0.4) for y in (-0.4, 0.4) for z in (0.6, 1.2)}


def test_the_file_holds_the_document_and_acquire_can_read_it(
    cli: Cli, robot: cdprcal.Robot, tmp_path: Path
) -> None:
    path = tmp_path / "plan.csv"
    document = plan_of(cli, "irma4", "-o", path, "--grid", "3x2x1")
    plan = cdprcal.read_plan(str(path))
    assert plan.robot_name == "irma4"
    assert plan.measured_count == 6
    assert plan.duration_s == pytest.approx(document["duration_s"])
    assert plan.start_tension_N == pytest.approx(document["start_tension_N"])
    for stop, pose in zip(plan.poses, document["poses"], strict=True):
        assert stop.tension_N.tolist() == pose["tension_N"]
        assert stop.transition_s == pose["transition_s"]
    assert cdprcal.verify_plan(robot, plan) == ""
    assert signed(cdprcal.format_plan(plan)) == path.read_text()


def test_random_order_visits_again_and_can_be_repeated(cli: Cli, tmp_path: Path) -> None:
    arguments = ("irma4", "--order", "random", "--visits", "3")
    first = plan_of(cli, *arguments, "--seed", 4)
    assert first == plan_of(cli, *arguments, "--seed", 4)
    other = plan_of(cli, *arguments, "--seed", 5)
    positions = [[tuple(pose["position_m"]) for pose in each["poses"]] for each in (first, other)]
    assert positions[0] != positions[1]
    assert first["measured_count"] == 24
    counts = {place: positions[0].count(place) for place in positions[0]}
    assert set(counts.values()) == {3}
    assert all(a != b for a, b in zip(positions[0], positions[0][1:], strict=False))
    assert 0 < first["approach"]["both"] <= first["approach"]["possible"]


def test_what_only_a_random_order_has_asks_for_one(cli: Cli) -> None:
    random = plan_of(cli, "irma4", "--order", "random", "--visits", "3", "--seed", "1")
    assert plan_of(cli, "irma4", "--visits", "3") == random
    assert plan_of(cli, "irma4", "--seed", "1")["measured_count"] == 16
    for option in (("--visits", "3"), ("--seed", "2"), ("--for", "mass", "--diagnose")):
        ran = cli("plan", "irma4", "--order", "least-time", *option)
        ran.refused(f"{option[0]} is for a random order: leave out --order least-time")


@pytest.mark.parametrize("grid", ["2x2x2", "3x3x3"])
def test_poses_chosen_by_observability_are_fewer(cli: Cli, grid: str) -> None:
    """Fewer poses than the grid's, as accurate in position and in rotation."""
    document = plan_of(cli, "irma4", "--optimal", 8, "--grid", grid)
    comparison = document["comparison"]
    needed = comparison["poses_needed"]
    assert needed is not None
    assert needed <= comparison["grid_poses"] // 2
    of_grid = comparison["grid_standard_deviation"]
    chosen = comparison["optimal"][needed - 1]
    assert chosen["poses"] == needed
    for key in ("position_m", "rotation_rad"):
        assert np.linalg.norm(chosen["standard_deviation"][key]) <= np.linalg.norm(of_grid[key])
    # What is promised for the chosen ones is what the estimator's information says of the plan.
    last = comparison["optimal"][-1]["standard_deviation"]
    assert document["predicted_standard_deviation"]["position_m"] == pytest.approx(
        last["position_m"]
    )


def test_positions_box_home_and_bounds_are_taken(cli: Cli) -> None:
    given = plan_of(
        cli, "irma4", "--position", "0.2,0.1,0.8", "--position", "-0.3,0,1.1", "--home", "0,0,1"
    )
    assert sorted(pose["position_m"] for pose in given["poses"]) == [
        pytest.approx([-0.3, 0.0, 1.1]),
        pytest.approx([0.2, 0.1, 0.8]),
    ]
    assert given["start_pose"]["position_m"] == pytest.approx([0.0, 0.0, 1.0])
    boxed = plan_of(cli, "irma4", "--box", "0.3,0.3,1.1:-0.3,-0.3,0.7", "--grid", "2x2x1")
    assert boxed["box"] == {"lower_m": [-0.3, -0.3, 0.7], "upper_m": [0.3, 0.3, 1.1]}
    assert {pose["position_m"][2] for pose in boxed["poses"]} == {0.9}


@pytest.mark.parametrize("count", [3, 4, 5])
def test_other_robots_get_a_box_of_their_own(cli: Cli, tmp_path: Path, count: int) -> None:
    path = robot_file(polygon_robot(count), tmp_path)
    document = plan_of(cli, path)
    assert document["measured_count"] == 8
    assert "inscribed" in document["box_origin"]
    assert all(len(pose["natural_frequencies_hz"]) == 6 - count for pose in document["poses"])
    for pose in document["poses"]:
        assert min(pose["tension_N"]) >= 4.0 + 1.0 - 1e-9, "limit and margin of one sigma"


def square_robot(path: Path) -> cdprcal.Robot:
    """Four pulleys and four anchors at the corners of squares about one axis."""
    cables = "".join(
        f"""
  - pulley:
      radius_m: 0.02
      position_m: [{1.4 * x}, {1.4 * y}, 2.4]
      x_axis: [{-x * 2**-0.5}, {-y * 2**-0.5}, 0]
      swivel_axis: [0, 0, -1]
    platform_anchor_m: [{0.12 * x}, {0.12 * y}, 0.1]"""
        for x, y in ((1, -1), (1, 1), (-1, 1), (-1, -1))
    )
    path.write_text(
        f"""name: square
platform:
  mass_kg: 12
  centre_of_mass_m: [0, 0, -0.1]
  inertia_kg_m2: [[0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.3]]
cables:{cables}
tension_limits_N: [10, 300]
""",
        encoding="utf-8",
    )
    return cdprcal.load_robot(path)


def test_a_stop_where_cables_depend_on_one_another_is_one_of_the_plan(tmp_path: Path) -> None:
    """On the axis of a symmetric robot one motion more is free; each stop has as many."""
    robot = square_robot(tmp_path / "square.yaml")
    plan = cdprcal.make_plan(robot, positions_m=[[0.0, 0.0, 1.3], [0.3, 0.2, 1.2]]).plan
    assert {len(stop.natural_frequencies_hz) for stop in plan.poses} == {2}
    cdprcal.write_plan(plan, tmp_path / "plan.csv")
    assert len(cdprcal.read_plan(tmp_path / "plan.csv").poses) == len(plan.poses)


def test_for_people(cli: Cli, tmp_path: Path) -> None:
    picture = tmp_path / "plan.png"
    ran = cli("plan", "irma4", "--optimal", 5, "--plot", picture)
    assert ran.code == 0
    assert ran.stdout.startswith("5 measured poses, ")
    for words in ("initial pose to ± ", "predicted accuracy", "fewer", "as good as the grid"):
        assert words in ran.stdout
    assert ran.stderr == f"{picture}\n"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size > 20_000


def test_numbers_of_stops_are_outside_of_the_ways_and_cover_what_is_below(
    robot: cdprcal.Robot,
) -> None:
    view = draw_plan(robot, cdprcal.make_plan(robot)).axes[0]
    middle = np.mean([line.get_xydata().mean(axis=0) for line in view.lines], axis=0)
    assert view.texts
    for text in view.texts:
        assert isinstance(text, Annotation)
        box = text.get_bbox_patch()
        assert box is not None
        assert box.get_facecolor()[:3] == (1.0, 1.0, 1.0)
        away = np.array(text.xy) - middle
        assert np.sign(text.get_position()).tolist() == np.sign(away).tolist()


def test_what_a_plan_is_not_is_said_to_people(cli: Cli, capfd: pytest.CaptureFixture[str]) -> None:
    document = json.loads(cli("plan", "irma4", "--optimal", 5, "--json").stdout)
    unseen = {"position_m": [0.001, None, 0.001], "rotation_rad": [0.01] * 3}
    grid = {"position_m": [0.003, 0.004, 0.0], "rotation_rad": [0.001] * 3}
    rows = [{"poses": n, "standard_deviation": unseen if n < 3 else grid} for n in range(1, 41)]
    comparison = document["comparison"] | {
        "poses_needed": None,
        "optimal": rows,
        "grid_standard_deviation": grid,
        "grid_poses": 27,
    }
    stop = document["poses"][0] | {"measured": False}
    changes = {
        "comparison": comparison,
        "predicted_standard_deviation": unseen,
        "poses": [stop] * 100,
        "order_is_optimal": False,
        "approach": None,
    }
    assert changes.keys() <= document.keys()
    capfd.readouterr()
    print_plan(document | changes)
    said = capfd.readouterr().out
    assert "the grid's 27 poses are more accurate than the 40 chosen; ask for more" in said
    assert re.search(r"^ *1 +chosen +– +–", said, flags=re.M)
    assert re.search(r"^ *40 +chosen +5\.00 ", said, flags=re.M)
    assert not re.search(r"^ *20 +chosen", said, flags=re.M)  # of many rows a few
    assert "would not be observable from these poses: add poses" in said
    assert "order: short; whether it is the shortest was not proved" in said
    assert re.search(r"and \d+ more: --verbose", said)
    assert "passed" in said


# Effects that the robot file lists.


def test_a_known_mass_is_planned_with(cli: Cli, robot: cdprcal.Robot, tmp_path: Path) -> None:
    listed = altered(robot, name="listed", effects=[effect("mass", mass_error_kg=[1.5])])
    platform = robot.platform
    heavier = cdprcal.Platform(
        mass_kg=platform.mass_kg + 1.5,
        centre_of_mass_m=platform.centre_of_mass_m,
        inertia_kg_m2=platform.inertia_kg_m2,
    )
    same = altered(robot, name="same", platform=heavier)
    box = ("--box", "-0.3,-0.3,0.7:0.3,0.3,1.1")
    a, b = (plan_of(cli, robot_file(r, tmp_path), *box) for r in (listed, same))
    assert [p["tension_N"] for p in a["poses"]] == [
        pytest.approx(p["tension_N"], rel=1e-9) for p in b["poses"]
    ]


def test_known_load_cell_errors_are_in_the_set_points(robot: cdprcal.Robot) -> None:
    bias, gain = np.array([5.0, -3.0, 0.0, 8.0]), np.array([0.05, -0.02, 0.0, 0.01])
    listed = altered(
        robot,
        effects=[
            effect("load_cell_bias", bias_N=bias.tolist()),
            effect("load_cell_gain", gain_error=gain.tolist()),
        ],
    )
    plain, known = cdprcal.make_plan(robot).plan, cdprcal.make_plan(listed).plan
    # Effects add up on the reading: tau = reading - bias - reading gain / (1 + gain).
    for a, b in zip(plain.poses, known.poses, strict=True):
        assert b.tension_N == pytest.approx((1.0 + gain) * (a.tension_N + bias), rel=1e-9)
        assert b.pose.position_m == pytest.approx(a.pose.position_m, abs=1e-9)
    assert cdprcal.verify_plan(listed, known) == ""
    assert cdprcal.verify_plan(robot, known) != ""


def test_with_a_known_force_the_stops_are_where_the_platform_rests(robot: cdprcal.Robot) -> None:
    force = np.array([1.0, -2.0, 1.5])
    listed = altered(robot, effects=[effect("external_force", force_N=force.tolist())])
    plan = cdprcal.make_plan(listed).plan
    assert cdprcal.verify_plan(listed, plan) == ""
    away = []
    for stop, plain in zip(plan.poses, cdprcal.make_plan(robot).plan.poses, strict=True):
        assert stop.tension_N == pytest.approx(plain.tension_N)
        away.append(np.linalg.norm(stop.pose.position_m - plain.pose.position_m))
        # Xi^T tau = f + F at the centre of mass, written out.
        state = cdprcal.platform_state(robot, stop.pose)
        arm = stop.pose.rotation @ robot.platform.centre_of_mass_m
        left = cdprcal.wrench_residual(robot, state, stop.tension_N)
        assert left == pytest.approx([*force, *np.cross(arm, force)], abs=1e-6)
    assert min(away) > 1e-3


@pytest.mark.parametrize(
    "known",
    [
        [],
        [effect("load_cell_bias", bias_N=[12.0, -8.0, 5.0, 15.0])],
        [effect("load_cell_gain", gain_error=[0.03, -0.02, 0.01, 0.05])],
        [effect("external_force", force_N=[1.5, -1.0, 2.0]), effect("mass", mass_error_kg=[0.4])],
        [effect("cable_sag", linear_density_kg_m=[0.03])],
        [effect("pulley_radius", radius_error_m=[0.0005, 0.0, -0.0003, 0.0002])],
    ],
    ids=lambda known: "+".join(each.name for each in known) or "none",
)
def test_the_simulated_robot_rests_where_the_plan_says(
    cli: Cli, robot: cdprcal.Robot, tmp_path: Path, known: list[cdprcal.AppliedEffect]
) -> None:
    """Its dynamics share nothing with planning but the robot file."""
    path = robot_file(altered(robot, name="real", effects=known), tmp_path)
    plan, log, truth = (tmp_path / name for name in ("plan.csv", "run.csv", "truth.json"))
    box = ("--box", "-0.4,-0.4,0.6:0.4,0.4,1.2", "--grid", "2x1x1")
    document = plan_of(cli, path, "-o", plan, *box)
    ran = cli("acquire", path, plan, "-o", log, "--truth", truth, "--speed", 0)
    assert ran.code == 0, ran.stderr
    been = np.array([pose["position_m"] for pose in json.loads(truth.read_text())["poses"]])
    for stop in document["poses"]:
        assert np.linalg.norm(been - stop["position_m"], axis=1).min() < 5e-4


def test_effects_of_one_run_are_left_out(robot: cdprcal.Robot) -> None:
    of_run = cdprcal.AppliedEffect(
        name="external_force", parameters={"force_N": [9.0, 0.0, 0.0]}, run="monday.csv"
    )
    listed = altered(robot, effects=[of_run])
    a, b = (cdprcal.make_plan(r).plan.poses[0].pose.position_m for r in (robot, listed))
    assert a.tolist() == b.tolist()


# Wrong use.

BAD = {
    "box outside the anchors": (["--box", "3,3,0.5:4,4,1"], ("box", "pulleys")),
    "box above the pulleys": (["--box", "-0.3,-0.3,4:0.3,0.3,5"], ("box",)),
    "flat box": (["--box", "-0.3,-0.3,0.8:0.3,0.3,0.8"], ("box",)),
    "half a box": (["--box", "-0.3,-0.3,0.8"], ("--box", "two corners")),
    "text in a box": (["--box", "a,b,c:1,1,1"], ("--box", "'a'", "must be a number")),
    "two coordinates": (["--home", "0,0"], ("--home", "has 2 numbers; give 3")),
    "grid": (["--grid", "2x2"], ("--grid", "2x2x2|2x2x3")),
    "no set-point": (["--position", "0,0,1.75"], ("no plan", r"\(0, 0, 1.75\) m")),
    "order": (["--order", "shortest"], ("shortest", "least-time")),
    "distribution": (["--distribution", "fair"], ("fair", "barycentre")),
    "lambda missing": (["--distribution", "given_lambda"], ("lambda",)),
    "margin": (["--margin-n", "500"], ("margin", "20 to 400 N")),
    "damping": (["--damping", "1.5"], ("--damping: 1.5 .*; give one above 0 and below 1",)),
    "no damping": (["--damping", "0"], ("--damping: 0 ",)),
    "speed": (["--speed-m-s", "0"], ("--speed-m-s: 0 .*; give metres per second above 0",)),
    "no speed": (["--speed-m-s", "nan"], ("--speed-m-s: nan ",)),
    "positions and a grid": (
        ["--position", "0,0,0.9", "--grid", "3x3x3"],
        ("--position .*: leave out --grid",),
    ),
    "lambda for nothing": (["--lambda", "50"], ("--lambda: barycentre", "given_lambda")),
    "optimal and positions": (["--optimal", "4", "--position", "0,0,1"], ("--position",)),
    "too many": (["--optimal", "5000"], ("set-points can be reached",)),
    "picture's format": (["--plot", "plan.bmp"], ("plan.bmp", ".png")),
    "bounds that hold nothing": (
        ["--bounds", "-0.2,-0.2,0.8:0.2,0.2,1"],
        ("no plan", "bounds|cannot be reached"),
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_wrong_use_is_refused(cli: Cli, tmp_path: Path, case: str) -> None:
    arguments, words = BAD[case]
    output = tmp_path / "plan.csv"
    assert_refused(cli("plan", "irma4", "-o", output, *arguments), *words)
    assert not list(tmp_path.iterdir()), "nothing is written"


@pytest.mark.parametrize("count", [1, 2])
def test_other_numbers_of_cables_are_refused(cli: Cli, tmp_path: Path, count: int) -> None:
    path = robot_file(polygon_robot(count), tmp_path)
    for command in ("plan", "workspace"):
        assert_refused(cli(command, path), "needs 3 cables or more", f"not {count}")


def test_limits_that_hold_nothing_are_refused(
    cli: Cli, robot: cdprcal.Robot, tmp_path: Path
) -> None:
    weak = altered(robot, name="weak", tension_limits_N=[1.0, 25.0])
    assert_refused(cli("plan", robot_file(weak, tmp_path)), "no plan", "static workspace")


def test_a_plan_of_another_robot_is_caught(robot: cdprcal.Robot) -> None:
    plan = cdprcal.make_plan(robot).plan
    with pytest.raises(cdprcal.InputError, match="cables"):
        cdprcal.verify_plan(polygon_robot(3), plan)
    assert cdprcal.verify_plan(altered(robot, gravity_m_s2=9.0), plan) != ""


def test_the_callback_can_stop_it_and_its_exceptions_come_through(robot: cdprcal.Robot) -> None:
    result = cdprcal.make_plan(robot, progress=lambda stage, share: False)
    assert result.status == cdprcal.PlanStatus.stopped

    def broken(stage: str, share: float) -> None:
        raise ZeroDivisionError(stage)

    with pytest.raises(ZeroDivisionError):
        cdprcal.make_plan(robot, progress=broken)
