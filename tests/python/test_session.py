"""Session files: what they say, and what is said about wrong ones."""

from __future__ import annotations

import json
import re
import sys
from importlib.util import find_spec
from pathlib import Path

import jsonschema
import pytest
from ruamel.yaml import YAML

import cdprcal
from cdprcal.hardware.session import (
    CanopenBus,
    load_session,
    load_topics,
    parse_session,
    schema_text,
)
from cdprcal.hardware.session.file import shipped_schema
from cdprcal.hardware.session.objects import object_type, parse_object
from conftest import Cli
from robots import small_plan
from scripts import executed

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "canopen-simulated.yaml"
#: Keys of a session that bags need none of.
DEVICES = {"rate_Hz", "mode", "bus", "limits", "safety", "winches", "ahrs", "simulated"}


@pytest.fixture(scope="module")
def text() -> str:
    return EXAMPLE.read_text()


def test_example() -> None:
    session = load_session(EXAMPLE)
    assert isinstance(session.bus, CanopenBus)
    assert [winch.node for winch in session.winches] == [1, 2, 3, 4]
    assert session.winches[0].counts_per_m == 1e7
    assert session.late_s == session.period_s == 0.01
    assert session.ahrs_stale_s == pytest.approx(0.015)
    assert session.is_simulated


def test_torque_mode_needs_the_drum(text: str) -> None:
    text = re.sub(r"    torque: .*\n", "", text.replace("mode: velocity", "mode: torque"), count=1)
    with pytest.raises(cdprcal.InputError, match=r"winches\[#1\]: mode torque needs"):
        parse_session(text, "mine.yaml")


@pytest.mark.parametrize("text", ["", "[]", "4", "a: [", "\t", "{}", "&a [*a]", "? [1]: 2"])
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(cdprcal.InputError, match=r"mine\.yaml"):
        parse_session(text, "mine.yaml")


def test_absent_file(tmp_path: Path) -> None:
    with pytest.raises(cdprcal.InputError, match="cannot be read"):
        load_session(tmp_path / "none.yaml")


def test_shipped_schema_is_that_of_the_models() -> None:
    assert shipped_schema() == schema_text(), (
        "python -m cdprcal.hardware.session > python/cdprcal/hardware/session/session.schema.json"
    )
    assert json.loads(schema_text())["title"] == "cdprcal session"


@pytest.mark.parametrize(
    ("without", "fits"),
    [((), True), (DEVICES, True), (DEVICES - {"rate_Hz"}, False), ({"bus"}, False)],
    ids=["whole", "topics alone", "a rate but no devices", "no bus"],
)
def test_the_schema_asks_for_devices_where_the_reader_does(
    tmp_path: Path, without: set[str], fits: bool
) -> None:
    document = YAML(typ="safe").load(EXAMPLE.read_text()) | {"rate_Hz": 100.0}
    document = {key: value for key, value in document.items() if key not in without}
    validator = jsonschema.Draft202012Validator(json.loads(schema_text()))
    assert validator.is_valid(document) == fits
    path = tmp_path / "session.yaml"
    with path.open("w") as stream:
        YAML(typ="safe").dump(document, stream)
    if fits:
        load_topics(path)
    else:
        with pytest.raises(cdprcal.InputError, match="is missing"):
            load_topics(path)


def test_objects() -> None:
    assert parse_object("0x2401:01") == (0x2401, 1)
    assert parse_object("0x60e4:0x0A") == (0x60E4, 10)
    assert object_type("int16").range == (-32768, 32767)
    assert object_type("uint32").range == (0, 2**32 - 1)


@pytest.mark.parametrize("module", ["can", "canopen", "msgpack", "rosbags", "serial"])
def test_what_the_hardware_needs_is_installed(module: str) -> None:
    assert find_spec(module), f"{module} is not installed: run ./setup"


def test_the_module_prints_the_schema() -> None:
    ran = executed([sys.executable, "-m", "cdprcal.hardware.session"], check=True)
    assert ran.stdout == schema_text()
    assert ran.stderr == ""


def test_the_session_that_a_template_is_can_be_tried(
    cli: Cli, robot: cdprcal.Robot, tmp_path: Path
) -> None:
    path, plan = tmp_path / "session.yaml", tmp_path / "plan.csv"
    ran = cli("template", "--session", "-o", path)
    assert ran.code == 0, ran.stderr
    assert f"--session {path} -o run.mcap" in ran.stdout
    schema = path.read_text().partition("$schema=")[2].partition("\n")[0]
    assert json.loads(Path(schema).read_text())["title"] == "cdprcal session"
    cdprcal.write_plan(small_plan(robot), str(plan))
    ran = cli("acquire", "irma4", plan, "--backend", "canopen", "--session", path, "--dry-run",
              "--seconds", 1, "-o", tmp_path / "run.csv")  # fmt: skip
    assert ran.code == 0, ran.stderr
    assert cli("template", "--session", "-o", path).code == 2
    ran = cli("template", "--session", "--cables", 3, "-o", tmp_path / "other.yaml")
    assert "--session: is no robot file; leave out --from and --cables" in ran.stderr
