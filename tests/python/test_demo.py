"""``cdprcal demo``: the first thing a user runs."""

from __future__ import annotations

import io
import json
import re
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console

import cdprcal
from cdprcal.demo.folder import _DRAWN, _LOGS, PLAN
from cdprcal.demo.story import HIDDEN, METHODS, Error, Hidden
from cdprcal.demo.table import methods_table, verdict
from cdprcal.io import read_inputs
from conftest import Cli, few
from test_schemas import validate

PICTURES = {"tensions", "path", "methods", "residuals", "gap", "ranking", "held_out"}


def test_the_story_ends_well_within_thirty_seconds(cli: Cli, tmp_path: Path) -> None:
    folder = tmp_path / "demo"
    began = time.process_time()  # how busy the machine is with other things does not matter
    ran = cli("demo", "-o", folder, "--json")
    assert time.process_time() - began < 30.0
    document = ran.document()
    validate("demo", document)
    assert document["acquisition"]["state"] == "done"
    assert document["acquisition"]["rests"] == 9
    assert document["acquisition"]["duration_s"] < 80.0  # the paper: 128 s
    rows = {(row["method"], row["formulation"]): row for row in document["methods"]}
    assert rows.keys() == {(method, formulation) for _, method, formulation in METHODS}
    for row in rows.values():
        assert row["status"] == "converged"
        assert row["error"]["position_m"] < 0.01
        assert row["solve_time_s"] < 1.0
    assert rows["unified", "full"]["error"]["position_m"] < 2e-3
    assert rows["unified", "full"]["error"]["rotation_rad"] < 1e-3
    # What was hidden is named, and the pose gets better for it.
    hidden = document["hidden"]
    assert hidden["effect"] == HIDDEN[1]
    assert hidden["found"] == ["centre_of_mass"]
    assert hidden["error_before"]["position_m"] > 0.01
    assert hidden["error_after"]["position_m"] < 2e-3
    for words in ("wakes up", "position [mm]", "eq. 20", "found: centre_of_mass", "trial a"):
        assert words in ran.stderr
    for name in PICTURES:
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "report.html").read_text().startswith("<!doctype html>")
    assert "report.html" in ran.stderr
    inputs = read_inputs(folder / "faulty.csv")
    assert inputs is not None
    assert inputs.settings["effects"] == [HIDDEN[1]]
    # The logs are there to go on with.
    assert cli("check", "irma4", folder / "run.csv").code == 0
    again = cli("demo", "-o", folder, "--json")  # over its own files
    assert again.code == 0


def test_what_a_demonstration_did_not_write_stays(cli: Cli, tmp_path: Path) -> None:
    """Refused before anything is written; what it wrote itself it replaces."""

    def refused(name: str) -> None:
        before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
        cli("demo", "-o", tmp_path).refused(f"{name}: exists already", "--force")
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before

    for name in ("report.html", "gap.png", "faulty.csv"):
        (tmp_path / name).write_text("<!doctype html> of my own")
        refused(name)
        (tmp_path / name).unlink()
    plan, run = tmp_path / "plan.csv", tmp_path / "run.csv"
    assert cli("plan", "irma4", "-o", plan).code == 0
    refused("plan.csv")
    assert cli("acquire", "irma4", plan, "--quick", "-o", run).code == 0
    refused("run.csv")
    acquired = run.read_bytes()
    assert cli("demo", "-o", tmp_path, "--force").code == 0
    assert run.read_bytes() != acquired
    assert {path.name for path in tmp_path.iterdir()} <= {PLAN, *_LOGS, *_DRAWN}
    # A picture of somebody's own among them stays, too.
    (tmp_path / "gap.png").write_text("of my own")
    refused("gap.png")


@pytest.mark.parametrize("robot_name", few(["ring5", "ring3"]))
def test_other_robots_can_be_shown_too(robot_name: str, cli: Cli, tmp_path: Path) -> None:
    ran = cli("demo", robot_name, "--effect", "cable_sag=0.06", "-o", tmp_path, "--json")
    document = json.loads(ran.stdout)
    assert [row["status"] for row in document["methods"]] == ["converged"] * len(METHODS)
    assert document["methods"][-1]["error"]["position_m"] < 5e-3
    assert cdprcal.load_robot(robot_name).cable_count == int(robot_name[-1])
    assert ran.code in (0, 1)


def test_wrong_use_is_said(cli: Cli, tmp_path: Path) -> None:
    for arguments, words in (
        (("--effect", "gravity=1"), "effect 'gravity': not known"),
        (("--effect", "load_cell_bias=1,2"), "2 values do not fit 4 cables"),
        (("nobody",), "nobody"),
        (("-o", tmp_path / "file" / "x"), "cannot be made"),
    ):
        (tmp_path / "file").touch()
        cli("demo", "-o", tmp_path / "out", *arguments).refused(words)


@pytest.mark.parametrize(
    ("found", "rivals", "words", "style"),
    [
        (["mass"], [], "found: mass", "green"),
        (["tilt"], ["mass"], "found: tilt, which these poses cannot tell from it", "yellow"),
        (["tilt"], ["force"], "found: tilt", "red"),
        ([], [], "found: nothing", "red"),
    ],
)
def test_the_verdict_says_whether_it_was_found(
    found: list[str], rivals: list[str], words: str, style: str
) -> None:
    effects = [SimpleNamespace(info=SimpleNamespace(name=name), rivals=rivals) for name in found]
    diagnosis: Any = SimpleNamespace(effects=effects)
    error = Error(1e-3, 1e-3, 1e-3)
    run: Any = None
    said = verdict(Hidden("mass=0.8", run, diagnosis, error, error))
    assert said.plain == words
    assert style in str(said.style)


def test_a_method_that_does_not_converge_is_shown_with_its_reason() -> None:
    result = SimpleNamespace(status=cdprcal.CalibrationStatus.not_converged, solve_time_s=0.002)
    row: Any = SimpleNamespace(
        label="τlσε",
        method="unified",
        formulation="full",
        calibration=SimpleNamespace(result=result),
        duration_s=60.0,
        poses=9,
        error=None,
    )
    out = Console(file=io.StringIO(), width=120)
    out.print(methods_table([row]))
    text = out.file.getvalue()  # type: ignore[attr-defined]
    assert re.search(r"τlσε \(not_converged\) +1\.00 +9 +– +– +– +2\.0 ms", text)
