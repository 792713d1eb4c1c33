"""What there is to look up and to complete: effects, explain, template --from, values in shells."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import jsonschema
import pytest

import cdprcal
from cdprcal import _core
from cdprcal.completion import paths
from cdprcal.schemas import schema
from conftest import Cli
from scripts import executed

NAMES = [info.name for info in cdprcal.effect_catalogue()]


def test_effects_lists_the_catalogue(cli: Cli) -> None:
    ran = cli("effects")
    assert (ran.code, ran.stderr) == (0, "")
    assert ran.stdout.startswith(f"{len(NAMES)} effects")
    assert all(f"\n{name} " in ran.stdout for name in NAMES)
    document = json.loads(cli("effects", "--json").stdout)
    assert [effect["name"] for effect in document] == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_explain_says_all_about_one(cli: Cli, name: str) -> None:
    info = next(info for info in cdprcal.effect_catalogue() if info.name == name)
    ran = cli("explain", name)
    assert ran.code == 0
    assert ran.stdout.startswith(f"{name}: {info.sentence}\n{info.equation}\n")
    for parameter in info.parameters:
        assert parameter.name in ran.stdout
    assert info.remedy in ran.stdout
    assert all(rival in ran.stdout for rival in info.confused_with)
    assert json.loads(cli("explain", name, "--json").stdout)["equation"] == info.equation


@pytest.mark.parametrize(
    "name", ["cable_slip", "load_shift", "load_cell_shift", "swivel_shift", "ahrs_shift", "contact"]
)
def test_explain_knows_what_happens_once(cli: Cli, name: str) -> None:
    infos = [info for info in _core.steps_of(cdprcal.load_robot("irma4")) if info.name == name]
    assert infos
    said = cli("explain", name).stdout
    document = json.loads(cli("explain", name, "--json").stdout)
    jsonschema.validate(document, schema("explain"))
    for info, held in zip(infos, (document, *document["also"]), strict=True):
        for words in (info.sentence, info.equation, info.remedy):
            assert words in " ".join(said.split())
        assert (held["sentence"], held["remedy"]) == (info.sentence, info.remedy)
        shapes = [parameter.shape.name for parameter in info.parameters]
        assert [parameter["shape"] for parameter in held["parameters"]] == shapes
    assert ("try it: cdprcal demo --effect" in said) == (name != "contact")
    assert f"{name}=time_s," in said or name == "contact"


@pytest.mark.parametrize("name", ["euler_convention", "tension_offset", "slack"])
def test_explain_knows_faults_of_the_configuration(cli: Cli, name: str) -> None:
    row = next(row for row in _core.injectable_effects() if row["name"] == name)
    assert cli("explain", name).stdout.startswith(f"{name}: {row['description']}\n")
    document = json.loads(cli("explain", name, "--json").stdout)
    jsonschema.validate(document, schema("explain"))
    assert document["sentence"] == row["description"]


def test_everything_that_diagnose_names_can_be_explained(cli: Cli) -> None:
    for row in _core.injectable_effects():
        assert cli("explain", row["name"]).code == (2 if row["generator_only"] else 0), row["name"]


def test_sizes_are_those_of_the_catalogue(cli: Cli) -> None:
    """A stiffness is estimated by its inverse: the largest effect is the least stiffness."""
    said = cli("explain", "cable_elasticity").stdout
    assert "100 kN" in said
    assert "at least" in said
    assert "at most" in cli("explain", "mass").stdout


def test_an_effect_that_is_none_is_answered_by_those_like_it(cli: Cli) -> None:
    cli("explain", "load_cell_bia").refused("give load_cell_bias or ")


def test_a_template_from_another_robot_is_that_robot(cli: Cli, tmp_path: Path) -> None:
    path, copy = tmp_path / "mine.yaml", tmp_path / "copy.yaml"
    assert cli("template", "--from", "irma4", "-o", path).code == 0
    mine, irma4 = cdprcal.load_robot(str(path)), cdprcal.load_robot("irma4")
    assert mine.name == "mine"
    text = cdprcal.to_yaml(mine).replace('name: "mine"', 'name: "irma4"')
    assert text == cdprcal.to_yaml(irma4)
    path.write_text(path.read_text() + "# weighed on Monday\n")
    assert cli("template", "--from", path, "-o", copy).code == 0
    assert "# weighed on Monday" in copy.read_text()
    assert cdprcal.load_robot(str(copy)).name == "copy"
    assert cli("check", copy).code == 0
    for arguments, words in (
        (("--from", "nobody", "-o", tmp_path / "x.yaml"), "nobody"),
        (("--from", "irma4", "--cables", 4, "-o", tmp_path / "x.yaml"), "leave out --cables"),
        (("--from", "irma4", "-o", copy), "exists already"),
    ):
        cli("template", *arguments).refused(words)


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        (
            "cdprcal explain load_cell_",
            {"load_cell_bias", "load_cell_gain", "load_cell_drift", "load_cell_shift"},
        ),
        ("cdprcal check irm", {"irma4"}),
        ("cdprcal check my", {"my.yaml"}),
        ("cdprcal calibrate irma4 run.csv --method s", {"static"}),
        ("cdprcal plan irma4 --order ", {"least-time", "random"}),
        ("cdprcal demo --effect mas", {"mass="}),
        ("cdprcal demo --effect load_cell_s", {"load_cell_shift="}),
        ("cdprcal demo --effect conta", set()),
    ],
)
def test_shells_are_told_values(tmp_path: Path, typed: str, offered: set[str]) -> None:
    (tmp_path / "my.yaml").touch()
    (tmp_path / "my.csv").touch()
    words = typed.split(" ")
    environment = os.environ | {
        "_CDPRCAL_COMPLETE": "complete_bash",
        "COMP_WORDS": typed,
        "COMP_CWORD": str(len(words) - 1),
    }
    program = "from cdprcal.cli import app; app(prog_name='cdprcal')"
    ran = executed([sys.executable, "-c", program], cwd=tmp_path, env=environment, timeout=60)
    assert set(ran.stdout.split()) == offered, ran.stderr


def test_paths_complete_within_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "a.yaml").touch()
    (tmp_path / ".hidden.yaml").touch()
    monkeypatch.chdir(tmp_path)
    assert paths("", (".yaml",)) == ["robots/"]
    assert paths("robots/", (".yaml",)) == ["robots/a.yaml"]
    assert paths(f"{tmp_path}/rob", (".yaml",)) == [f"{tmp_path}/robots/"]
    assert paths("none/", (".yaml",)) == []
