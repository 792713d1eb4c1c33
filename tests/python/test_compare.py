"""``cdprcal compare``: what moved from log to log is seen, and nothing else."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import cdprcal
from cdprcal.diagnosis.comparison import draw_comparison
from conftest import Cli


@pytest.fixture(scope="module")
def logs(robot: cdprcal.Robot, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Three runs; before the last the third load cell was bent; the friction was there before."""
    folder = tmp_path_factory.mktemp("logs")
    plan = cdprcal.make_plan(robot, order=cdprcal.VisitingOrder.random).plan
    paths = []
    for day, bias in enumerate(("6,-5,4,-8", "6,-5,4,-8", "6,-5,19,-8")):
        effects = [f"load_cell_bias={bias}", "pulley_friction=0.04"]
        run = cdprcal.simulate_startup(robot, plan, effects=effects, seed=11 + day)
        paths.append(folder / f"day{day + 1}.csv")
        cdprcal.write_log(run.log, str(paths[-1]))
    return paths


def test_one_cell_moved_by_so_much_before_the_last_run(cli: Cli, logs: list[Path]) -> None:
    document = cli("compare", "irma4", *logs, "--json").document()
    moved = [row for row in document["numbers"] if row["moved"]]
    assert [(row["effect"], row["of"]) for row in moved] == [("load_cell_bias", "cable 3")]
    (row,) = moved
    assert row["from_log"] == 3
    assert abs(row["step"] - 15.0) < 4.0 * row["step_deviation"]
    assert len(document["initial_poses"]) == 3
    friction = {row["effect"] for row in document["numbers"]} - {"load_cell_bias"}
    assert friction in ({"pulley_friction"}, {"bending_hysteresis"})  # its rival at these poses


def test_people_read_which_when_and_how_much(cli: Cli, logs: list[Path], tmp_path: Path) -> None:
    picture = tmp_path / "moved.png"
    ran = cli("compare", "irma4", *logs, "--plot", picture)
    assert ran.code == 0, ran.stderr
    first, second, *_ = ran.stdout.splitlines()
    assert first.startswith("1 of ")
    assert "load_cell_bias" in first
    assert second.startswith("load_cell_bias bias_N cable 3: +1")
    assert second.endswith("between day2.csv and day3.csv")
    assert picture.stat().st_size > 10_000


def test_numbers_that_moved_are_told_apart_in_the_picture() -> None:
    def row(parameter: str, of: str, unit: str, moved: bool) -> dict[str, object]:
        return {
            "effect": "made",
            "parameter": parameter,
            "of": of,
            "unit": unit,
            "values": [1.0, 2.0],
            "standard_deviation": [0.1, None],
            "moved": moved,
        }

    cells = [row("bias_N", f"cable {k}", "N", k < 3) for k in (1, 2, 3, 4)]
    document = {"logs": ["a.csv", "b.csv"], "numbers": [*cells, row("share", "", "1", False)]}
    figure = draw_comparison(document)
    forces, share = figure.axes
    legend = forces.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        "not moved",
        "cable 1",
        "cable 2",
    ]
    colours = [container[0].get_color() for container in forces.containers]
    assert len(set(colours)) == 3
    assert colours[2] == colours[3]
    assert (forces.get_title(), share.get_title()) == ("made: bias_N", "made: share")


def test_nothing_moved_is_said_so(cli: Cli, logs: list[Path]) -> None:
    ran = cli("compare", "irma4", *logs[:2], "--json")
    document = json.loads(ran.stdout)
    assert not any(row["moved"] for row in document["numbers"])
    assert document["reason"].startswith("none of ")


def test_without_a_number_there_is_no_picture(cli: Cli, tmp_path: Path) -> None:
    for seed in ("2", "3"):
        assert cli("generate", "irma4", "--seed", seed, "-o", tmp_path / f"{seed}.csv").code == 0
    picture = tmp_path / "moved.png"
    ran = cli("compare", "irma4", tmp_path / "2.csv", tmp_path / "3.csv", "--plot", picture)
    assert ran.code == 0, ran.stderr
    assert "these logs show no effect" in ran.stdout
    assert "moved.png: not written, as there is no number to draw" in ran.stderr
    assert not picture.exists()


def test_one_log_is_no_comparison(cli: Cli, logs: list[Path]) -> None:
    cli("compare", "irma4", logs[0]).refused("needs two logs at least")
    with pytest.raises(cdprcal.InputError, match="needs two logs"):
        cdprcal.compare(cdprcal.load_robot("irma4"), [])
