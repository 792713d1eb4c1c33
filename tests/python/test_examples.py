"""The examples: every pair prints the same in Python and in C++, and the notebook's story holds."""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path
from typing import Any

import pytest

from scripts import executed

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("0*.py"))
#: Results of a solver whose threads add numbers in another order each time: in their own units.
SOLVED = {
    "position_m": 2e-4,
    "sigma_mm": 0.02,
    "error_mm_deg": 0.05,
    "values_mm": 0.05,
    "before_mm": 0.3,
    "after_mm": 0.05,
}
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


def printed(command: list[str], folder: Path) -> list[tuple[str, str]]:
    """The lines of a program as (what, values)."""
    done = executed(command, cwd=folder, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = [line.partition(": ") for line in done.stdout.splitlines()]
    return [(what, values) for what, _, values in lines]


def test_examples_come_in_pairs() -> None:
    assert [path.stem for path in EXAMPLES] == [
        path.stem for path in sorted((ROOT / "examples").glob("0*.cpp"))
    ]
    numbers = [path.name[:2] for path in EXAMPLES]
    assert numbers == [f"{i:02d}" for i in range(1, len(EXAMPLES) + 1)]
    text = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    assert all(f"({path.name})" in text for path in EXAMPLES)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_both_languages_print_the_same(path: Path, tmp_path: Path) -> None:
    python = printed([sys.executable, str(path)], tmp_path)
    assert python
    folder = os.environ.get("CDPRCAL_BIN")
    if folder is None:
        pytest.skip("no C++ programs: set CDPRCAL_BIN to the build's bin/")
    program = Path(folder) / "examples" / path.stem
    if not program.exists():
        pytest.skip(f"{program} is not built")
    cpp = printed([str(program)], tmp_path)
    assert [what for what, _ in cpp] == [what for what, _ in python]
    for (what, ours), (_, theirs) in zip(python, cpp, strict=True):
        a, b = ([float(number) for number in NUMBER.findall(text)] for text in (ours, theirs))
        # The last digit that is printed may be rounded the other way.
        digits = max((len(n.partition(".")[2]) for n in NUMBER.findall(ours)), default=0)
        assert a == pytest.approx(b, rel=1e-9, abs=SOLVED.get(what, 1.01 * 10.0**-digits)), what


def test_the_story_of_the_notebook_holds() -> None:
    path = ROOT / "examples" / "diagnosis_story.ipynb"
    notebook = json.loads(path.read_text(encoding="utf-8"))
    names: dict[str, Any] = {}
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(cells) > 5
    for cell in cells:
        exec(compile("".join(cell["source"]), str(path), "exec"), names)
    assert names["after_m"] < 0.2 * names["before_m"]
    defined = [c for c in cells if any(line.startswith("def ") for line in c["source"])]
    assert defined == [], "what a story needs, cdprcal has"
