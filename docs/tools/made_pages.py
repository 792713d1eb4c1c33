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
_WANTED = re.compile(r"<!-- bindings: ([\w ]+) -->")
_BOUND = re.compile(
    r"(?:py::(?:class_|native_enum|exception|register_\w+)<[^;(]*?>\s*(?:\w+\s*)?\(\s*module\s*,"
    r"|module\.def\()\s*\"(\w+)\""
)


def bound_names(stage: str) -> list[str]:
    """Names that bindings/STAGE.cpp adds to the module, in its order, each once."""
    source = (ROOT / "bindings" / f"{stage}.cpp").read_text(encoding="utf-8")
    return list(dict.fromkeys(_BOUND.findall(source)))


def on_page_markdown(markdown: str, **context: Any) -> str:
    """Called by MkDocs for every page."""

    def entries(match: re.Match[str]) -> str:
        names = [name for stage in match[1].split() for name in bound_names(stage)]
        return "\n\n".join(f"::: cdprcal._core.{name}" for name in names)

    return errors.fill(_WANTED.sub(entries, markdown))
