"""The sensor that docs/extend/sensor.md adds for show: few files, and it compiles and works."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "extend" / "sensor.md").read_text(encoding="utf-8")
SECTION = PAGE.split("\n## A sensor inside the estimator\n", 1)[1]
CHANGES = re.findall(r"`(\S+)`:\n\n```diff\n(.*?)```", SECTION, re.DOTALL)
PROGRAM = Path(__file__).with_name("show_channel.cpp")
#: What it takes to read a log, to evaluate a pose and to write its rows.
SOURCES = (
    *("geometry/euler", "geometry/pose", "kinematics/cable", "kinematics/platform", "statistics"),
    *("model/sensors", "readings/equilibrium_detection", "readings/log", "readings/log_columns"),
    *("readings/fresh", "readings/log_checks", "readings/odd_readings", "readings/signal"),
    *("readings/measurement", "readings/noise", "effects/pose_evaluation"),
    *("text", "text_file", "singular_values"),
    *("statics/inertial_wrench", "statics/wrench", "estimation/row_batch", "lanes/processor"),
)


def changed(text: str, diff: str) -> str:
    """The text with the changes of one block; @@ alone in a line parts them."""
    for hunk in diff.split("@@\n"):
        lines = hunk.splitlines(keepends=True)
        before = "".join(line[1:] for line in lines if line[0] in " -")
        after = "".join(line[1:] for line in lines if line[0] in " +")
        assert text.count(before) == 1, f"not there, or not once:\n{before}"
        text = text.replace(before, after)
    return text


def test_it_touches_few_files() -> None:
    listed = re.findall(r"^\| `([^`]+)` \|", SECTION, re.MULTILINE)
    assert {name for name, _ in CHANGES} < set(listed)
    assert len(listed) <= 6
    assert all((ROOT / name).is_file() for name in listed)


def test_what_the_page_says_compiles_and_works(tmp_path: Path) -> None:
    compiler = shutil.which("g++")
    eigen = Path("/usr/include/eigen3")
    if compiler is None or not eigen.is_dir():
        pytest.skip("needs g++ and Eigen")
    for name, diff in CHANGES:
        path = tmp_path / Path(name).relative_to("cpp")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(changed((ROOT / name).read_text(encoding="utf-8"), diff), encoding="utf-8")
    folders = (tmp_path / "cdprcal", ROOT / "cpp" / "cdprcal")
    sources = [
        next(path for folder in folders if (path := folder / f"{name}.cpp").is_file())
        for name in SOURCES
    ]
    program = tmp_path / "show"
    # Together, so that what nearly all of them include is compiled once.
    together = tmp_path / "together.cpp"
    together.write_text("".join(f'#include "{path}"\n' for path in (*sources, PROGRAM)), "utf-8")
    command = [compiler, "-std=c++20", "-O0", f"-I{tmp_path}", f"-I{ROOT / 'cpp'}"]
    command += ["-isystem", str(eigen), str(together), "-o", str(program)]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr[-3000:]
    shown = subprocess.run([program], capture_output=True, text=True, check=False)
    assert shown.returncode == 0, shown.stdout + shown.stderr
