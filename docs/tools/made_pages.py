"""Fills pages from the sources when the site is built, so that nothing added there is forgotten.

``<!-- bindings: geometry model -->`` becomes what these files of bindings/ bind; errors.py makes
the table of errors.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))
import errors

ROOT = Path(__file__).resolve().parents[2]
_OUTSIDE = re.compile(r"(?<!!)\[([^\]]*)\]\((\.\./[^)#]+)\)")
_WANTED = re.compile(r"<!-- bindings: ([\w ]+) -->")
_BOUND = re.compile(
    r"(?:(?:py::(?:class_|native_enum|exception|register_\w+)|WordEnum)<[^;(]*?>\s*(?:\w+\s*)?\(\s*module\s*,"
    r"|module\.def\()\s*\"(\w+)\""
)


def bound_names(stage: str) -> list[str]:
    """Names that bindings/STAGE.cpp adds to the module, in its order, each once."""
    source = (ROOT / "bindings" / f"{stage}.cpp").read_text(encoding="utf-8")
    return list(dict.fromkeys(_BOUND.findall(source)))


def named_outside(markdown: str, folder: Path) -> str:
    """Links to files of the source become their names; dead ones stay, and fail the build."""

    def name(match: re.Match[str]) -> str:
        target = (folder / match[2]).resolve()
        if not target.exists() or target.is_relative_to(ROOT / "docs"):
            return match[0]
        path = f"`{target.relative_to(ROOT)}`"
        return path if match[1].strip("`") in path else f"{match[1]} ({path})"

    return _OUTSIDE.sub(name, markdown)


def on_page_markdown(markdown: str, *, page: Any, **context: Any) -> str:
    """Called by MkDocs for every page."""
    markdown = named_outside(markdown, Path(page.file.abs_src_path).parent)

    def entries(match: re.Match[str]) -> str:
        names = [name for stage in match[1].split() for name in bound_names(stage)]
        return "\n\n".join(f"::: cdprcal._core.{name}" for name in names)

    return errors.fill(_WANTED.sub(entries, markdown))
