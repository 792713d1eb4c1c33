"""The structure that ARCHITECTURE.md describes is the structure of the code."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")


def folders_in_order(heading: str) -> list[str]:
    """The first column of the table under a heading, from the lowest folder to the highest."""
    section = PAGE.split(f"\n## `{heading}`", 1)[1].split("\n## ", 1)[0]
    return re.findall(r"^\| `([a-z_0-9]+)` \|", section, re.MULTILINE)


def includes() -> Iterator[tuple[Path, str, str]]:
    """(file, its folder, folder that it includes); files beside the folders have the folder ''."""
    source = ROOT / "cpp" / "cdprcal"
    for path in sorted((*source.rglob("*.hpp"), *source.rglob("*.cpp"))):
        own = path.relative_to(source).parts
        for name in re.findall(r'#include "cdprcal/([^"]+)"', path.read_text(encoding="utf-8")):
            other = Path(name).parts
            yield (
                path.relative_to(ROOT),
                own[0] if len(own) > 1 else "",
                other[0] if len(other) > 1 else "",
            )


def test_the_page_names_every_folder_and_no_other() -> None:
    named = folders_in_order("cpp/cdprcal")
    there = {path.parent.name for path in (ROOT / "cpp" / "cdprcal").glob("*/*.cpp")}
    assert len(named) == len(set(named))
    assert set(named) == there


def test_no_include_runs_up() -> None:
    order = {"": -1, **{name: i for i, name in enumerate(folders_in_order("cpp/cdprcal"))}}
    up = [
        f"{path}: {folder or 'beside the folders'} -> {included}"
        for path, folder, included in includes()
        if order[included] > order[folder]
    ]
    assert up == []
    assert len(order) > 10, "the page's table was not read"


PYTHON = ROOT / "python"


def modules() -> dict[str, Path]:
    """Every module of cdprcal by its dotted name; a package goes by its own."""
    found = {}
    for path in sorted((PYTHON / "cdprcal").rglob("*.py")):
        parts = path.relative_to(PYTHON).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported_names(source: str, known: dict[str, Path]) -> set[str]:
    """Modules of cdprcal that a source imports: at its top, in functions, for types only."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, "give the whole name, as everywhere here"
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            modules = {name for name in whole if name in known or name == "cdprcal._core"}
            names |= modules | ({str(node.module)} if whole - modules else set())
    return {name for name in names if name.split(".")[0] == "cdprcal"}


def imports() -> dict[str, set[str]]:
    """Module → modules that it imports."""
    known = modules()
    return {
        name: imported_names(path.read_text(encoding="utf-8"), known)
        for name, path in known.items()
    }


def package_of(module: str) -> str:
    """'cdprcal.io.files' → 'io'; the package itself, which only passes names on, is 'cdprcal'."""
    return [*module.split("."), "cdprcal"][1]


def edges_up(graph: dict[str, set[str]], order: list[str]) -> list[str]:
    """Imports of what comes later in an order of packages."""
    return [
        f"{module} -> {other}"
        for module, others in graph.items()
        for other in sorted(others)
        if order.index(package_of(other)) > order.index(package_of(module))
    ]


def test_the_page_names_every_package_and_no_other() -> None:
    named = folders_in_order("python/cdprcal")
    assert len(named) == len(set(named))
    assert set(named) == {package_of(module) for module in modules()} | {"_core"}


def test_no_import_runs_up() -> None:
    graph = imports()
    assert edges_up(graph, folders_in_order("python/cdprcal")) == []
    assert len(graph["cdprcal.cli.acquire"]) > 10, "imports in functions were not read"


def test_no_modules_import_one_another_in_a_circle() -> None:
    TopologicalSorter(imports()).prepare()


def test_an_import_that_runs_up_or_round_would_be_found() -> None:
    known = modules()
    lazy = "def f():\n    from cdprcal.cli import app\n"
    typed = "if TYPE_CHECKING:\n    from cdprcal import _core, report\n"
    assert imported_names(lazy, known) == {"cdprcal.cli"}
    assert imported_names(typed, known) == {"cdprcal._core", "cdprcal.report"}
    graph = imports()
    graph["cdprcal.io.files"] |= {"cdprcal.cli", "cdprcal.io.log_file"}
    up = edges_up(graph, folders_in_order("python/cdprcal"))
    assert up == ["cdprcal.io.files -> cdprcal.cli"]
    with pytest.raises(CycleError):
        TopologicalSorter(graph).prepare()


def test_code_asks_an_effect_for_properties_never_for_its_name() -> None:
    library = ROOT / "cpp" / "cdprcal"
    table = (library / "simulator" / "plant_effects.cpp").read_text(encoding="utf-8")
    # What a gate finds in a log has words of its own, three of them the same.
    names = set(re.findall(r'^      \{"(\w+)",', table, re.MULTILINE)) - {
        "slack",
        "outlier",
        "oscillation",
    }
    assert len(names) > 30, "the plant's table was not read"
    asked = re.compile(rf'(?:[!=]=|starts_with\(|rfind\() *"(?:{"|".join(names)})"')
    sources = [
        *library.rglob("*.[ch]pp"),
        *(ROOT / "bindings").glob("*.cpp"),
        *(ROOT / "python" / "cdprcal").rglob("*.py"),
    ]
    found = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in sources
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if asked.search(line)
    ]
    assert found == []
