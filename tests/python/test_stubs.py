"""The checked-in type stubs say what the module really offers."""

from __future__ import annotations

import ast
import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

import cdprcal
from cdprcal import _core

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    pytest.importorskip("pybind11_stubgen")
    spec = importlib.util.spec_from_file_location("stubs", ROOT / "bindings" / "stubs.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


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
