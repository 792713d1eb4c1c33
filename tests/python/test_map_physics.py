"""What a robot's physics says of a proposed map: signs that are none are not taken for sure."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal import Log, Robot
from cdprcal.mapping import Proposal, propose_file
from conftest import Cli, changed

PER_CABLE = ("length_m", "swivel_rad", "tension_N")


def proposed(log: Log, robot: Robot, folder: Path) -> Proposal:
    path = folder / "raw.csv"
    cdprcal.write_log(log, str(path))
    header, rest = path.read_text().split("\n", 1)
    path.write_text(f"{header.replace('_s,', ' [s],', 1)}\n{rest}")  # no canonical log
    return propose_file(path, robot)


def columns(proposal: Proposal, name: str) -> str:
    line = next(line for line in proposal.lines if line.name == name)
    return " ".join(re.findall(r"_(\d)_", " ".join(line.columns)))


def line_of(proposal: Proposal, name: str) -> tuple[tuple[int, ...], str]:
    line = next(line for line in proposal.lines if line.name == name)
    return line.sign, line.sure


def in_order(log: Log, order: list[int]) -> Log:
    """A log whose columns hold the cables in this order."""
    return changed(log, **{name: getattr(log, name)[:, order] for name in PER_CABLE})


@pytest.mark.parametrize("order", [[2, 3, 0, 1], [3, 0, 1, 2], [0, 2, 1, 3]])
def test_another_order_is_not_hidden_behind_signs(
    log: Log, robot: Robot, tmp_path: Path, order: list[int]
) -> None:
    """From the opposite corner, shifted by one, two exchanged: of the first, attitude [-1, -1, 1]
    looks much alike, a metre and a half away."""
    proposal = proposed(in_order(log, order), robot, tmp_path)
    right = " ".join(str(1 + order.index(cable)) for cable in range(4))
    for name in ("lengths", "swivels", "tensions"):
        assert (columns(proposal, name), line_of(proposal, name)) == (right, ((1,) * 4, "guess"))
    assert line_of(proposal, "attitude")[0] == (1, 1, 1)


def test_signs_that_another_order_explains_as_well_are_a_guess(
    log: Log, robot: Robot, tmp_path: Path
) -> None:
    """Without swivels the robot and its mirror image read alike."""
    without = changed(in_order(log, [3, 2, 1, 0]), swivel_rad=None)
    proposal = proposed(without, robot, tmp_path)
    assert all(line.sure == "guess" for line in proposal.lines)
    assert "4 3 2 1" in proposal.text()


def test_signs_alone_are_set_right_and_sure(log: Log, robot: Robot, tmp_path: Path) -> None:
    """Drums that count the other way, and load cells that pull."""
    log = changed(log, length_m=-log.length_m, tension_N=-log.tension_N)
    proposal = proposed(log, robot, tmp_path)
    assert line_of(proposal, "lengths") == ((-1,) * 4, "sure")
    assert line_of(proposal, "tensions") == ((-1,) * 4, "sure")
    assert line_of(proposal, "attitude") == ((1, 1, 1), "sure")


@pytest.mark.parametrize(("field", "name"), [("length_m", "lengths"), ("swivel_rad", "swivels")])
def test_one_sensor_that_counts_backwards_is_found(
    log: Log, robot: Robot, tmp_path: Path, field: str, name: str
) -> None:
    values = getattr(log, field) * [1.0, 1.0, -1.0, 1.0]
    proposal = proposed(changed(log, **{field: values}), robot, tmp_path)
    assert line_of(proposal, name) == ((1, 1, -1, 1), "guess")
    assert line_of(proposal, "attitude")[0] == (1, 1, 1)


def test_load_cells_in_another_order_are_found(log: Log, robot: Robot, tmp_path: Path) -> None:
    """As far as the robot file knows how good they are."""
    yaml, count = re.subn(r"tension_N: 10\b", "tension_N: 0.5", cdprcal.to_yaml(robot))
    assert count == 1
    swapped = changed(log, tension_N=log.tension_N[:, [2, 1, 0, 3]])
    proposal = proposed(swapped, cdprcal.parse_robot(yaml, "better"), tmp_path)
    assert columns(proposal, "tensions") == "3 2 1 4"
    assert columns(proposal, "lengths") == "1 2 3 4"


def test_another_convention_is_no_sign(robot: Robot, tmp_path: Path) -> None:
    speaking = "euler_convention: "
    yaml = cdprcal.to_yaml(robot).replace(f"{speaking}XYZ", f"{speaking}ZYX")
    options = cdprcal.SyntheticLogOptions(noise=cdprcal.reading_noise(robot.sigma, 0.05), seed=7)
    made = cdprcal.synthetic_log(
        cdprcal.parse_robot(yaml, "zyx"), cdprcal.default_setpoints(robot, 2, 2, 2), options
    )
    lines = proposed(made.log, robot, tmp_path).lines
    told = next(line for line in lines if line.name == "attitude")
    assert (told.sign, told.sure) == ((1, 1, 1), "guess")
    assert "in ZYX: correct euler_convention in the robot file" in told.why


def test_what_agrees_with_no_map_is_but_a_guess(log: Log, robot: Robot, tmp_path: Path) -> None:
    """An AHRS upside down: no signs of its angles are right."""
    angles = log.roll_pitch_yaw_rad + np.array([np.pi, 0.0, 0.0])
    proposal = proposed(changed(log, roll_pitch_yaw_rad=angles), robot, tmp_path)
    assert line_of(proposal, "attitude")[1] == "guess"


def test_inches_and_pounds_are_weighed(log: Log, robot: Robot, tmp_path: Path) -> None:
    header = ["t", *(f"L{i}" for i in range(1, 5)), *(f"F{i}" for i in range(1, 5))]
    header += ["roll [deg]", "pitch [deg]", "yaw [deg]"]
    readings = (
        log.length_m / 0.0254,
        log.tension_N / 4.4482216,
        np.degrees(log.roll_pitch_yaw_rad),
    )
    values = np.column_stack((log.time_s, *readings))
    rows = [",".join(f"{value:.6f}" for value in row) for row in values]
    (tmp_path / "raw.csv").write_text("\n".join([",".join(header), *rows, ""]))
    units = {line.name: line.unit for line in propose_file(tmp_path / "raw.csv", robot).lines}
    assert (units["lengths"], units["tensions"]) == ("in", "lbf")


def test_a_unit_that_was_not_tried_is_a_guess(log: Log, robot: Robot, tmp_path: Path) -> None:
    """Counts of encoders: no unit of lengths fits, so physics has not weighed the load cells."""
    header = ["t", *(f"enc{i}" for i in range(1, 5)), *(f"F{i}" for i in range(1, 5))]
    values = np.column_stack((log.time_s, 1e5 * log.length_m, log.tension_N / 9.80665))
    rows = [",".join(f"{value:.6f}" for value in row) for row in values]
    (tmp_path / "raw.csv").write_text("\n".join([",".join(header), *rows, ""]))
    proposal = propose_file(tmp_path / "raw.csv", robot)
    assert {line.name: line.sure for line in proposal.lines} == {
        "lengths": "guess",
        "tensions": "guess",
    }


def test_what_check_says_of_a_log_is_said_where_there_is_no_pose(
    cli: Cli, log: Log, tmp_path: Path
) -> None:
    pulled = changed(log, tension_N=-log.tension_N)
    cdprcal.write_log(pulled, str(tmp_path / "run.csv"))
    ran = cli("calibrate", "irma4", tmp_path / "run.csv")
    assert ran.code == 1
    assert "a cable cannot push" in " ".join(ran.stderr.split())


def test_a_report_takes_a_map(cli: Cli, log: Log, robot: Robot, tmp_path: Path) -> None:
    the_map, page = tmp_path / "map.yaml", tmp_path / "page.html"
    the_map.write_text(proposed(log, robot, tmp_path).text())
    ran = cli("report", "irma4", tmp_path / "raw.csv", "--map", the_map, "-o", page)
    assert ran.code == 0, ran
    assert f"--map {the_map}" in page.read_text(encoding="utf-8")


IN_DEGREES = {
    "all": ("swivel_rad", "roll_pitch_yaw_rad"),
    "swivels": ("swivel_rad",),
    "attitude": ("roll_pitch_yaw_rad",),
}


@pytest.mark.parametrize("which", IN_DEGREES)
@pytest.mark.parametrize("zeroed", [False, True], ids=["far", "near_zero"])
def test_degrees_that_are_called_radians_are_found(
    log: Log, robot: Robot, tmp_path: Path, which: str, zeroed: bool
) -> None:
    """By their size; near zero, as encoders are that were zeroed on the way, by physics."""
    given = log
    if zeroed:
        yaw_rad = given.roll_pitch_yaw_rad[:, 2]
        given = changed(
            given,
            swivel_rad=given.swivel_rad - np.median(given.swivel_rad, axis=0),
            roll_pitch_yaw_rad=given.roll_pitch_yaw_rad - [0.0, 0.0, np.median(yaw_rad)],
        )
    log = changed(given, **{name: np.degrees(getattr(given, name)) for name in IN_DEGREES[which]})
    proposal = proposed(log, robot, tmp_path)
    for name, field in (("swivels", "swivel_rad"), ("attitude", "roll_pitch_yaw_rad")):
        line = next(line for line in proposal.lines if line.name == name)
        is_wrong = field in IN_DEGREES[which]
        assert (line.unit, line.sure == "guess") == ("deg" if is_wrong else "rad", is_wrong)
        assert line.sign == (1,) * len(line.columns)
    assert columns(proposal, "lengths") == "1 2 3 4"
