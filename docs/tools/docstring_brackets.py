"""Docstrings say "[3] [m]", which Markdown would take for a link: brackets are escaped."""

from __future__ import annotations

import re
from typing import Any

import griffe

_CODE_OR_BRACKET = re.compile(r"(``[^`]+``|`[^`]+`)|\[")


class DocstringBrackets(griffe.Extension):
    """Escapes every ``[`` of every docstring that is not inside code."""

    def on_instance(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        if obj.docstring is not None:
            value = obj.docstring.value
            obj.docstring.value = _CODE_OR_BRACKET.sub(lambda m: m[1] or r"\[", value)
