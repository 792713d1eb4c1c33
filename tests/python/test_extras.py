"""A base installation is small, and an import light; what is missing is named by its extra, before
any work."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from cdprcal._core import InputError
from cdprcal.extras import EXTRAS, Extra, missing, need
from cdprcal.io.log_file import load_log
from cdprcal.io.save import save_log
from scripts import executed

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
#: Module → distribution, where it is called otherwise.
DISTRIBUTIONS = {"can": "python-can", "serial": "pyserial"}
WITHOUT = """
import sys
from importlib.machinery import PathFinder

class Without:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Without())
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name: None if name in {names!r} else found(name)
from cdprcal.__main__ import main
main()
"""


def names(requirements: list[str]) -> set[str]:
    return {re.split(r"[<>=\[]", requirement)[0] for requirement in requirements}


def test_a_base_installation_is_small() -> None:
    assert len(PROJECT["dependencies"]) <= 8
    assert not names(PROJECT["dependencies"]) & {*EXTRAS, *DISTRIBUTIONS.values()}


@pytest.mark.parametrize("module", EXTRAS)
def test_every_extra_that_is_named_has_what_is_missing(module: str) -> None:
    extra = EXTRAS[module]
    optional = PROJECT["optional-dependencies"]
    assert DISTRIBUTIONS.get(module, module) in names(optional[extra.name])


def test_what_is_needed_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    need("numpy")
    monkeypatch.setitem(EXTRAS, "no_such_thing", Extra("plots", "pictures", "say it"))
    with pytest.raises(InputError, match=r"^pictures need no_such_thing: .*\[plots\]', or say it$"):
        need("numpy", "no_such_thing")
    with pytest.raises(InputError, match=r"^run\.mat: pictures need no_such_thing: "):
        need("no_such_thing", of="run.mat")
    assert missing("serial") == "serial ports need serial: pip install 'cdprcal[xsens]'"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bare")
    for words in (["generate", "irma4", "-o", "run.csv"], ["plan", "irma4", "-o", "plan.csv"]):
        assert bare(path, *words).returncode == 0
    save_log(load_log(path / "run.csv").log, path / "run.mcap")
    (path / "run.mat").write_bytes(b"MATLAB 5.0 MAT-file".ljust(128))
    (path / "run.parquet").write_bytes(b"PAR1")
    return path


def bare(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """A command without any of the extras."""
    return executed(
        [sys.executable, "-c", WITHOUT.format(names=set(EXTRAS)), *words],
        cwd=folder,
        env=dict(os.environ),
    )


@pytest.mark.parametrize(
    "words",
    ["check irma4 run.csv", "calibrate irma4 run.csv -o result.json", "diagnose irma4 run.csv",
     "acquire irma4 plan.csv -o a.csv", "schema calibrate", "effects"],
)  # fmt: skip
def test_what_most_need_works_without(words: str, folder: Path) -> None:
    ran = bare(folder, *words.split())
    assert ran.returncode == 0, ran.stderr


def test_the_demo_tells_its_story_without_pictures(folder: Path) -> None:
    ran = bare(folder, "demo")
    assert ran.returncode == 0, ran.stderr
    assert "found: centre_of_mass" in ran.stdout
    assert "for pictures and a report: pip install 'cdprcal[report]'" in ran.stdout
    made = {path.name for path in (folder / "cdprcal-demo").iterdir()}
    assert made == {"plan.csv", "run.csv", "faulty.csv"}


SESSION = ROOT / "examples" / "canopen-simulated.yaml"


@pytest.mark.parametrize(
    ("words", "extra"),
    [
        ("plan irma4 -o p2.csv --plot p.png", "plots"),
        ("report irma4 run.csv -o r.html", "report"),
        ("calibrate irma4 run.mcap", "mcap"),
        ("acquire irma4 plan.csv -o b.mcap", "mcap"),
        ("generate irma4 -o b.mcap", "mcap"),
        ("export irma4 run.csv -o bag", "ros2"),
        ("explore irma4 run.csv", "report"),
        ("check irma4 run.mat --propose map.yaml", "mat"),
        ("check irma4 run.parquet --propose map.yaml", "arrow"),
        (f"acquire irma4 plan.csv --backend canopen --session {SESSION} -o b.csv", "canopen"),
    ],
)
def test_what_few_need_names_its_extra(words: str, extra: str, folder: Path) -> None:
    ran = bare(folder, *words.split())
    assert ran.returncode == 2
    assert re.fullmatch(
        rf"(….*\n)*cdprcal: .* need \w+: pip install 'cdprcal\[{extra}\]'(, or .*)?\n", ran.stderr
    ), ran.stderr


HEAVY = (
    "canopen",
    "jinja2",
    "jsonschema",
    "matplotlib",
    "mcap",
    "plotly",
    "pydantic",
    "rich",
    "rosbags",
    "ruamel",
    "scipy",
    "typer",
)


@pytest.mark.parametrize(
    ("code", "allowed"),
    [
        ("import cdprcal", ()),
        ("import cdprcal; cdprcal.load_robot('irma4')", ("numpy",)),
        ("import cdprcal.io", ("numpy",)),
        ("import cdprcal.cli", ("typer", "rich")),
    ],
)
def test_what_an_import_brings_in(code: str, allowed: tuple[str, ...]) -> None:
    shown = "import sys; print(*{name.split('.')[0] for name in sys.modules})"
    ran = executed([sys.executable, "-c", f"{code}\n{shown}"], check=True)
    loaded = set(ran.stdout.split())
    assert not loaded & ({*HEAVY, "numpy"} - set(allowed))


def test_libraries_of_solvers_that_are_never_chosen_are_not_loaded() -> None:
    """Debian's static Ceres would bring in ATLAS and SuiteSparse; see cmake/Dependencies.cmake."""
    from cdprcal import _core

    if _core.library_versions()["Ceres"] >= "2.2":
        pytest.skip("another Ceres than the one whose solvers are left out")
    shown = "import cdprcal._core; print(open('/proc/self/maps').read())"
    ran = executed([sys.executable, "-c", shown], check=True)
    assert "libnlopt" in ran.stdout
    for library in ("liblapack", "libatlas", "libcholmod", "libgfortran.so"):
        assert library not in ran.stdout
