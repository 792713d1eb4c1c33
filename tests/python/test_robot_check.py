"""``cdprcal template`` and ``cdprcal check ROBOT``: from blanks to a robot file to be used."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal.check import check_robot
from cdprcal.robot_template import BLANK, robot_template
from conftest import Cli

PLACE = re.compile(r":(\d+):(\d+): ")


def answers(robot: cdprcal.Robot) -> list[float]:
    """What goes into the blanks of a template, in their order."""
    platform = robot.platform
    values = [platform.mass_kg, *platform.centre_of_mass_m, *np.diag(platform.inertia_kg_m2)]
    for cable in robot.cables:
        pulley = cable.pulley
        values += [pulley.radius_m, *pulley.position_m, *pulley.x_axis, *pulley.swivel_axis]
        values += [*cable.platform_anchor_m]
    return [float(value) for value in (*values, *robot.tension_limits_N)]


@pytest.mark.parametrize("robot_name", ["irma4", "ring3"])
def test_check_walks_through_the_template(cli: Cli, robot_name: str, tmp_path: Path) -> None:
    robot = cdprcal.load_robot(robot_name)
    path = tmp_path / "mine.yaml"
    assert cli("template", "--cables", robot.cable_count, "-o", path).code == 0
    for value in answers(robot):
        ran = cli("check", path)
        assert ran.code == 2
        match = PLACE.search(ran.stderr)
        assert match is not None, ran.stderr
        assert BLANK in ran.stderr
        lines = path.read_text().splitlines(keepends=True)
        row, column = int(match[1]) - 1, int(match[2]) - 1
        # A list of numbers is named by its first blank or by its own place.
        at = lines[row].index(BLANK, column)
        lines[row] = lines[row][:at] + repr(value) + lines[row][at + len(BLANK) :]
        path.write_text("".join(lines))
    assert cli("check", path, "--json").document()["cables"] == robot.cable_count
    filled = cdprcal.load_robot(str(path))
    for mine, theirs in zip(filled.cables, robot.cables, strict=True):
        np.testing.assert_allclose(mine.pulley.axes_world, theirs.pulley.axes_world, atol=1e-9)


@pytest.mark.parametrize(
    ("robot_name", "said"),
    [
        ("irma4", "lengths 10 mm, swivels 1°, attitude 2°, tensions 10 N"),
        ("belts4", "lengths 10 mm, tensions 10 N"),
    ],
)
def test_default_sigma_is_told_of_what_a_robot_can_have(robot_name: str, said: str) -> None:
    text, _, sensors = cdprcal.builtin_robot_yaml(robot_name).partition("  sigma:")
    sensors = sensors.partition("\n")[2]
    (found,) = check_robot(
        cdprcal.parse_robot(f"{text}  sigma: {{}}\n{sensors}", "a.yaml")
    ).findings
    assert found.code == "default_sigma"
    assert found.message.endswith(f"(eq. 18): {said}")
    own = cdprcal.parse_robot(f"{text}  sigma: {{direct_length_m: 0.001}}\n{sensors}", "a.yaml")
    assert check_robot(own).findings == ()


def test_a_template_is_not_written_over_a_file(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("mine")
    cli("template", "-o", path).refused("exists already")
    assert path.read_text() == "mine"
    assert robot_template("a", 8).count("platform_anchor_m") == 8


def test_a_centre_of_mass_in_millimetres_is_named(cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    text = cdprcal.builtin_robot_yaml("irma4")
    path.write_text(text.replace("[0, 0, 0.173]", "[0, 0, 173]"))
    ran = cli("check", path)
    assert ran.code == 1, ran
    assert "error: the centre of mass is 172.7 m from the nearest anchor" in ran.stdout


@pytest.mark.parametrize("robot_name", ["irma4", "ring3", "ring5", "posts8"])
def test_the_built_in_robots_have_nothing_but_remarks(cli: Cli, robot_name: str) -> None:
    ran = cli("check", robot_name, "--json")
    document = ran.document()
    assert {finding["severity"] for finding in document["findings"]} == {"info"}
    assert len(document["findings"]) == 1
    assert document["workspace_m3"] > 0.5


@pytest.mark.parametrize(
    ("old", "new", "code", "exit_code"),
    [
        ("position_m: [1.065,", "position_m: [1065,", "too_large", 1),
        ("tension_limits_N: [20, 400]", "tension_limits_N: [1, 20]", "no_workspace", 1),
        ("x_axis: [0, 0, -1]", "x_axis: [0, 0, 1]", "swivel_zero", 0),
        ("position_m: [1.066, 1.155,", "position_m: [1.065, -1.155,", "pulleys_coincide", 0),
        (
            "tension_limits_N:",
            "length_limits_m: [300, 4500]\ntension_limits_N:",
            "length_limits",
            1,
        ),
        (
            "tension_limits_N:",
            "effects:\n" + 2 * "  - {name: mass, mass_error_kg: 0.1}\n" + "tension_limits_N:",
            "effect_repeated",
            0,
        ),
        (
            "[[0.18396, 0, 0], [0, 0.11545, 0], [0, 0, 0.18643]]",
            "[[184, 0, 0], [0, 115, 0], [0, 0, 186]]",
            "large_inertia",
            0,
        ),
        ("anchor_m: [0.075,", "anchor_m: [75,", "platform_larger_than_frame", 1),
        ("radius_m: 0.03", "radius_m: 30", "large_pulley", 1),
    ],
)
def test_slips_of_unit_and_sign_are_seen(
    cli: Cli, old: str, new: str, code: str, exit_code: int, tmp_path: Path
) -> None:
    text = cdprcal.builtin_robot_yaml("irma4")
    assert old in text
    (tmp_path / "slip.yaml").write_text(text.replace(old, new))
    ran = cli("check", tmp_path / "slip.yaml", "--json")
    assert code in {finding["code"] for finding in json.loads(ran.stdout)["findings"]}
    assert ran.code == exit_code


@pytest.mark.parametrize(
    "line",
    [
        "floor_m: 5",
        "keep_out: [{lower_m: [-9, -9, -9], upper_m: [9, 9, 9]}]",
        "length_limits_m: [6, 9]",
    ],
)
def test_what_is_in_the_way_everywhere_is_named(cli: Cli, line: str, tmp_path: Path) -> None:
    (tmp_path / "shut.yaml").write_text(f"{cdprcal.builtin_robot_yaml('irma4')}{line}\n")
    ran = cli("check", tmp_path / "shut.yaml", "--json")
    (finding,) = (f for f in ran.document(1)["findings"] if f["code"] == "no_workspace")
    assert f"something is in the way; check {line.partition(':')[0]}, then " in finding["message"]


@pytest.mark.parametrize(("name", "code"), [("hang4", 1), ("belts4", 1), ("posts8", 0)])
def test_only_what_can_turn_may_hang_in_another_orientation(
    cli: Cli, name: str, code: int, tmp_path: Path
) -> None:
    """Lengths hold all three in one orientation; of a point there is no other to look in."""
    text = cdprcal.builtin_robot_yaml(name).replace("floor_m: 0\n", "")
    (tmp_path / "shut.yaml").write_text(f"{text}floor_m: 50\n")
    ran = cli("check", tmp_path / "shut.yaml", "--json")
    (finding,) = (f for f in json.loads(ran.stdout)["findings"] if f["code"] == "no_workspace")
    assert ran.code == code
    assert finding["severity"] == ("error" if code else "warning")
    assert ("--orientation" in finding["remedy"]) == (code == 0)


def test_a_point_needs_no_inertia(cli: Cli, tmp_path: Path) -> None:
    corners = ([0, 0, 2], [3, 0, 2], [3, 0, 0], [0, 0, 0])
    pulleys = "".join(f"  - pulley: {{radius_m: 0, position_m: {at}}}\n" for at in corners)
    (tmp_path / "belts.yaml").write_text(
        "name: belts\nplatform: {mass_kg: 8, motion: 2T, motion_plane_normal: [0, 1, 0]}\n"
        f"cables:\n{pulleys}tension_limits_N: [5, 400]\n"
    )
    ran = cli("check", tmp_path / "belts.yaml", "--json")
    codes = {finding["code"] for finding in ran.document()["findings"]}
    assert "large_inertia" not in codes


@pytest.mark.parametrize("count", [1, 2])
def test_other_numbers_of_cables_are_checked_as_far_as_can_be(count: int) -> None:
    from cdprcal.check import check_robot

    four = cdprcal.load_robot("irma4")
    cables = [four.cables[i % 4] for i in range(count)]
    robot = cdprcal.Robot(
        name="other", platform=four.platform, cables=cables, tension_limits_N=[1, 500]
    )
    report = check_robot(robot)
    assert "workspace_not_computed" in {finding.code for finding in report.findings}
    assert report.workspace_m3 is None
