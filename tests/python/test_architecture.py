"""The structure that ARCHITECTURE.md describes is the structure of the code."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

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
    there = {path.name for path in (ROOT / "cpp" / "cdprcal").iterdir() if path.is_dir()}
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
