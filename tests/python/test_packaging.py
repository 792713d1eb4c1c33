"""What is published: the sdist, the citation, the type stubs; and the checks of style and types."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path
from types import ModuleType

import pytest
from ruamel.yaml import YAML

import cdprcal
from cdprcal import _core
from scripts import executed, load_script

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
#: All that may be at the top of an sdist; what is new there is put in, or left out, on purpose.
TOP = {
    ".clang-format",
    ".clang-tidy",
    ".gitignore",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CITATION.cff",
    "CMakeLists.txt",
    "CMakePresets.json",
    "CONTRIBUTING.md",
    "LICENSE",
    "PKG-INFO",
    "README.md",
    "bindings",
    "cmake",
    "cpp",
    "docs",
    "examples",
    "mkdocs.yml",
    "pyproject.toml",
    "python",
    "setup",
    "tests",
    "tools",
    ".containerignore",
    "Containerfile",
    "RELEASING.md",
}
#: Tracked, but of use in the repository alone.
LEFT_OUT = {".ci/run", ".gitattributes", ".pre-commit-config.yaml"}
BUILT_OR_LOGGED = {".so", ".o", ".a", ".pyc", ".whl", ".gz", ".log", ".mcap", ".db3"}


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> dict[str, int]:
    """The sizes [bytes] of the sdist's files by their path in it."""
    pytest.importorskip("scikit_build_core", reason="no scikit-build-core: ./setup installs it")
    folder = tmp_path_factory.mktemp("sdist")
    code = "import sys; from scikit_build_core.build import build_sdist; build_sdist(sys.argv[1])"
    subprocess.run(
        [sys.executable, "-c", code, str(folder)], cwd=ROOT, check=True, capture_output=True
    )
    (path,) = folder.iterdir()
    name = f"{PROJECT['name']}-{PROJECT['version']}"
    assert path.name == f"{name}.tar.gz"
    with tarfile.open(path) as archive:
        return {
            member.name.removeprefix(f"{name}/"): member.size
            for member in archive.getmembers()
            if member.isfile()
        }


def test_sdist_holds_what_builds_and_tests_it_and_nothing_stray(sdist: dict[str, int]) -> None:
    assert {name.split("/")[0] for name in sdist} == TOP
    stray = [name for name in sdist if Path(name).suffix in BUILT_OR_LOGGED]
    assert stray == []
    assert max(sdist.values()) < 1e6, max(sdist, key=lambda name: sdist[name])
    for name in (
        "cpp/cdprcal/workspace/alpha_shape.cpp",
        "bindings/module.cpp",
        "LICENSE",
        "setup",
        "tests/fuzz/corpus/log.tar.xz",
        "tests/fuzz_python/corpus/bag.tar.xz",
    ):
        assert sdist[name] > 0


def test_sdist_holds_every_tracked_file(sdist: dict[str, int]) -> None:
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("no git checkout: nothing says which files are tracked")
    listed = executed(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=True,
    ).stdout
    wanted = {name for name in listed.split("\0") if name and (ROOT / name).exists()}
    assert set(sdist) - {"PKG-INFO"} == wanted - LEFT_OUT


def test_citation_is_of_this_software_and_of_the_paper() -> None:
    citation = YAML(typ="safe").load(ROOT / "CITATION.cff")
    assert citation["title"] == PROJECT["name"]
    assert citation["version"] == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    assert citation["type"] == "software"
    assert citation["references"][0]["doi"] in (ROOT / "README.md").read_text(encoding="utf-8")


def test_a_commit_and_ci_run_the_same_checks() -> None:
    assert "\ntools/lint " in (ROOT / "setup").read_text(encoding="utf-8")
    if not (ROOT / ".git").exists():
        pytest.skip("the hooks are of the repository alone")
    hooks = YAML(typ="safe").load(ROOT / ".pre-commit-config.yaml")["repos"][0]["hooks"]
    assert hooks[0]["entry"] == "tools/lint"
    assert "./setup --test" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


@pytest.mark.parametrize("complains", ["ruff check", "ruff format", "clang-format", "mypy", None])
def test_lint_fails_when_one_of_its_tools_complains(tmp_path: Path, complains: str | None) -> None:
    """With stand-ins for the tools, which note how they were called."""
    for name in ("ruff", "clang-format", "mypy"):
        tool = tmp_path / name
        tool.write_text(
            f'#!/bin/sh\necho "{name} $*" >>"{tmp_path}/calls"\n'
            f'case "{name} $1" in "{complains}"*) exit 1 ;; esac\n'
        )
        tool.chmod(0o755)
    environment = {**os.environ, "CDPRCAL_TOOLS": str(tmp_path)}
    done = executed([ROOT / "tools" / "lint"], env=environment)
    assert done.returncode == (0 if complains is None else 1), done.stderr
    assert complains is None or f"failed: {complains}" in done.stderr
    calls = (tmp_path / "calls").read_text().splitlines()
    assert sorted(call.split()[0] for call in calls) == ["clang-format", "mypy", "ruff", "ruff"]
    formatted = next(call for call in calls if call.startswith("clang-format"))
    for folder in (
        "cpp/cdprcal",
        "cpp/programs",
        "bindings",
        "tests/cpp",
        "tests/bench",
        "examples",
    ):
        files = [*(ROOT / folder).rglob("*.cpp"), *(ROOT / folder).rglob("*.hpp")]
        assert files
        assert all(str(path.relative_to(ROOT)) in formatted for path in files)


@pytest.mark.parametrize("name", ["setup", "tools/lint", "tools/wheel"])
def test_scripts_say_how_they_are_used(name: str) -> None:
    asked = executed([ROOT / name, "--help"], check=True)
    assert asked.stdout.startswith(f"usage: {name if '/' in name else './' + name}")
    wrong = executed([ROOT / name, "--no-such"])
    assert wrong.returncode == 2
    assert "usage:" in wrong.stderr


def test_the_wheel_is_told_for_which_python_before_anything_is_built(tmp_path: Path) -> None:
    old = tmp_path / "python2"
    old.write_text("#!/bin/sh\nexit 1\n")
    old.chmod(0o755)
    for arguments, words in (
        (("--python",), "usage:"),
        (("--python", "python0"), "--python python0: is no Python of 3.11 or newer"),
        (("--python", str(old)), "is no Python of 3.11 or newer with venv; give another"),
        (("--nonsense",), "usage:"),
        (("one.whl", "two.whl"), "usage:"),
    ):
        ran = executed([ROOT / "tools" / "wheel", *arguments])
        assert ran.returncode == 2, arguments
        assert words in ran.stderr


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    pytest.importorskip("pybind11_stubgen")
    return load_script(ROOT / "bindings" / "stubs.py")


def test_stubs_are_those_of_the_module(generator: ModuleType) -> None:
    checked_in = (ROOT / "python" / "cdprcal" / "_core.pyi").read_text(encoding="utf-8")
    made = generator.make_stubs()
    assert ast.unparse(ast.parse(checked_in)) == ast.unparse(ast.parse(made)), (
        "run: python bindings/stubs.py python/cdprcal/_core.pyi && ruff format python"
    )


def test_stubs_are_installed_beside_the_module() -> None:
    folder = Path(str(cdprcal.__file__)).parent
    assert (folder / "_core.pyi").is_file()
    assert (folder / "py.typed").is_file()


def test_everything_public_has_a_docstring() -> None:
    bare = [name for name in dir(_core) if name[0] != "_" and not getattr(_core, name).__doc__]
    assert bare == []
    # pybind11 starts a docstring with the signature; what follows must say something.
    functions = [name for name in dir(_core) if name[0] != "_" and name[0].islower()]
    silent = [
        name
        for name in functions
        if callable(getattr(_core, name)) and len(getattr(_core, name).__doc__.split("\n\n")) < 2
    ]
    assert silent == []


def test_core_names_are_available_from_the_package() -> None:
    for name in _core.__dict__:
        if not name.startswith("_"):
            assert name in dir(cdprcal)
            given = getattr(cdprcal, name)
            if name in cdprcal._CALLS:  # take paths and words, too
                assert given.__module__ == "cdprcal.calls"
            else:
                assert getattr(given, "__wrapped__", given) is getattr(_core, name)
    with pytest.raises(AttributeError, match="nonsense"):
        cdprcal.nonsense  # noqa: B018
