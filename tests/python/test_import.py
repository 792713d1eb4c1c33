"""``import cdprcal`` brings in numpy at most; ``cdprcal --help`` only typer."""

from __future__ import annotations

import subprocess
import sys

import pytest

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
    ran = subprocess.run(
        [sys.executable, "-c", f"{code}\n{shown}"], capture_output=True, text=True, check=True
    )
    loaded = set(ran.stdout.split())
    assert not loaded & ({*HEAVY, "numpy"} - set(allowed))


def test_libraries_of_solvers_that_are_never_chosen_are_not_loaded() -> None:
    """Debian's static Ceres would bring in ATLAS and SuiteSparse; see cmake/Dependencies.cmake."""
    from cdprcal import _core

    if _core.library_versions()["Ceres"] >= "2.2":
        pytest.skip("another Ceres than the one whose solvers are left out")
    shown = "import cdprcal._core; print(open('/proc/self/maps').read())"
    ran = subprocess.run([sys.executable, "-c", shown], capture_output=True, text=True, check=True)
    assert "libnlopt" in ran.stdout
    for library in ("liblapack", "libatlas", "libcholmod", "libgfortran.so"):
        assert library not in ran.stdout
