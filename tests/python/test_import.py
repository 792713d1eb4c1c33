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
