"""Every --json and every result file is what the shipped schemas say, and nothing more."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from typer.main import get_command

import cdprcal
from cdprcal.cli import app
from cdprcal.io import save_log
from cdprcal.mapping import parse_map
from cdprcal.schemas import DOCUMENTS, schema
from conftest import Cli, changed


def validate(name: str, document: Any) -> None:
    errors = sorted(Draft202012Validator(schema(name)).iter_errors(document), key=str)
    assert not errors, "\n".join(f"{error.json_path}: {error.message}" for error in errors[:5])


@pytest.mark.parametrize("name", DOCUMENTS)
def test_the_schemas_are_schemas(name: str) -> None:
    whole = schema(name)
    Draft202012Validator.check_schema(whole)
    # Complete in itself: every reference leads somewhere.
    for reference in json.dumps(whole).split('"$ref": "#/$defs/')[1:]:
        assert reference.partition('"')[0] in whole["$defs"]
    assert not Draft202012Validator(whole).is_valid({})


def test_every_command_with_json_has_a_schema() -> None:
    commands = get_command(app).commands  # type: ignore[attr-defined]
    with_json = {
        name
        for name, command in commands.items()
        if any("--json" in option.opts for option in command.params)
    }
    assert with_json <= set(DOCUMENTS)
    assert {"calibrate", "diagnose", "plan", "workspace", "check", "acquire"} <= with_json


@pytest.mark.parametrize(
    "options",
    [(), ("--method", "kinematic"), ("--formulation", "paper"), ("--at", "2,10,18,26")],
)
def test_calibrate(cli: Cli, log_path: Path, tmp_path: Path, options: tuple[str, ...]) -> None:
    path = tmp_path / "result.json"
    ran = cli("calibrate", "irma4", log_path, "--json", "-o", path, *options)
    validate("calibrate", json.loads(ran.stdout))
    validate("calibrate-result", json.loads(path.read_text()))
    assert not Draft202012Validator(schema("calibrate")).is_valid(json.loads(path.read_text()))


def test_calibrate_without_a_pose(cli: Cli, log: cdprcal.Log, tmp_path: Path) -> None:
    poor = changed(log, swivel_rad=None, tension_N=None)
    cdprcal.write_log(poor, str(tmp_path / "poor.csv"))
    arguments = ("--json", "--method", "kinematic", "--at", "1,10")
    validate("calibrate", cli("calibrate", "irma4", tmp_path / "poor.csv", *arguments).document(1))


def test_diagnose_and_repeat(cli: Cli, log: cdprcal.Log, tmp_path: Path) -> None:
    tension_N = log.tension_N + np.array([6.0, -5.0, 4.0, -8.0])
    # Signs turned over and a bias: a discrete fault and an effect.
    log = changed(log, tension_N=tension_N, swivel_rad=-log.swivel_rad)
    cdprcal.write_log(log, str(tmp_path / "run.csv"))
    path = tmp_path / "result.json"
    ran = cli("diagnose", "irma4", tmp_path / "run.csv", "--json", "--result", path)
    document = json.loads(ran.stdout)
    assert [effect["name"] for effect in document["effects"]] == ["swivel_sign", "load_cell_bias"]
    validate("diagnose", document)
    validate("diagnose-result", json.loads(path.read_text()))
    document = cli("repeat", path, "--json").document()
    validate("repeat", document)
    validate("diagnose", document["again"])


def test_diagnose_with_absolute_sensors(cli: Cli, tmp_path: Path) -> None:
    """A drum that pays out more than it counts, beside lasers and a tracker that do not."""
    robot = cdprcal.load_robot("irma4")
    options = cdprcal.SyntheticLogOptions(
        dwell_s=3.0, move_s=3.0, noise=cdprcal.reading_noise(robot.sigma, 0.2, absolute=True)
    )
    made = cdprcal.synthetic_log(robot, cdprcal.default_setpoints(robot, 2, 2, 2), options)
    length_m = made.log.length_m.copy()
    length_m[:, 1] *= 1.01
    log = tmp_path / "absolute.csv"
    save_log(changed(made.log, length_m=length_m), log)
    document = cli("diagnose", "irma4", log, "--json").document()
    validate("diagnose", document)
    assert [effect["name"] for effect in document["effects"]] == ["transmission_ratio"]
    absolute = {"absolute_yaw_rad", "direct_length_m", "position_m"}
    assert absolute <= set(document["ripple"])
    assert absolute <= {gap["channel"] for gap in document["gap"]}
    assert all(absolute <= set(residual) for residual in document["residuals"]["after"])
    ran = cli("diagnose", "irma4", log)
    assert "whole length" in " ".join(ran.stdout.split())
    ran = cli("report", "irma4", log, "-o", tmp_path / "page.html")
    assert ran.code == 0, ran.stderr
    assert "whole length" in (tmp_path / "page.html").read_text()


def test_plan_acquire_check_and_truth(cli: Cli, tmp_path: Path) -> None:
    plan, log, truth = (tmp_path / name for name in ("plan.csv", "run.csv", "truth.json"))
    ran = cli("plan", "irma4", "-o", plan, "--grid", "2x1x1", "--json")
    validate("plan", json.loads(ran.stdout))
    arguments = ("--quick", "--truth", truth, "--json")
    validate("acquire", cli("acquire", "irma4", plan, "-o", log, *arguments).document())
    validate("truth", json.loads(truth.read_text()))
    validate("check", json.loads(cli("check", "irma4", log, "--json").stdout))
    validate("check", json.loads(cli("check", "ring3", "--json").stdout))


@pytest.mark.parametrize("shape", ["as a log", "marks", "no time", "attitude alone"])
def test_a_proposed_map(
    cli: Cli, log: cdprcal.Log, log_path: Path, tmp_path: Path, shape: str
) -> None:
    the_map = tmp_path / "map.yaml"
    header, *rows = log_path.read_text().splitlines()
    if shape == "marks":
        rows = [
            f"{row.split(',')[0]},-999,{row.split(',', 2)[2]}" if i % 50 == 9 else row
            for i, row in enumerate(rows)
        ]
    elif shape == "no time":
        header, rows = header.split(",", 1)[1], [row.split(",", 1)[1] for row in rows]
    elif shape == "attitude alone":
        at = header.split(",").index("roll_rad")
        header, *rows = (",".join(row.split(",")[at : at + 3]) for row in (header, *rows))
    log_path.write_text("\n".join([header, *rows, ""]))
    ran = cli("check", "irma4", log_path, "--propose", the_map, "--json")
    document = json.loads(ran.stdout)
    validate("check", document)
    assert (document["log"], document["map"]) == (str(log_path), str(the_map))
    assert document["trusted"] == (ran.code == 0) == (shape in ("as a log", "marks"))
    assert bool(document["lacks"]) == (shape == "attitude alone")
    held = parse_map(the_map.read_text(), "map.yaml")
    assert held.missing == (document["missing"] or {"values": []})["values"]
    assert held.time.rate_Hz == document["rate_Hz"]
    for line in document["channels"]:
        group = held.channels[line["name"]]
        assert (line["columns"], line["unit"]) == (group.columns, group.unit)
        assert f"# {line['sure']}: {line['why']}" in the_map.read_text()


def test_plan_with_a_comparison_and_a_random_order(cli: Cli) -> None:
    ran = cli("plan", "irma4", "--optimal", "2", "--box", "-0.2,-0.2,0.7:0.2,0.2,1", "--json")
    document = json.loads(ran.stdout)
    validate("plan", document)
    assert document["comparison"] is not None
    document = json.loads(cli("plan", "irma4", "--order", "random", "--json").stdout)
    validate("plan", document)
    assert document["approach"] is not None


def test_workspace(cli: Cli) -> None:
    arguments = ("--step-m", "0.2", "--section-m", "0.8", "--probe", "0,0,0.9", "--probe", "9,9,9")
    validate("workspace", cli("workspace", "irma4", "--json", *arguments).document())


def test_effects_and_the_words_of_formulas(cli: Cli) -> None:
    validate("effects", json.loads(cli("effects", "--json").stdout))
    validate("effects-words", json.loads(cli("effects", "--words", "--json").stdout))


def test_the_command_prints_them(cli: Cli) -> None:
    assert cli("schema").stdout.split() == list(DOCUMENTS)
    assert json.loads(cli("schema", "check").stdout) == schema("check")
    ran = cli("schema", "nothing")
    assert (ran.code, ran.stdout) == (2, "")
    assert "give one of acquire, acquire-dry-run, calibrate" in ran.stderr
