"""Session files: YAML 1.2 to a Session, or one message with file:line:column."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError

from cdprcal._core import InputError
from cdprcal.hardware.session.model import Session
from cdprcal.io.files import read_bytes, shown_path

#: The JSON schema of session files, for editors; beside this module in an installation.
SCHEMA_FILE = "session.schema.json"
#: Eight winches with comments have a tenth of it; the reader takes a second for it.
_MOST_BYTES = 64 << 10
_MOST_NESTED = 50


def load_session(path: str | Path) -> Session:
    """Reads a session file. Raises InputError 'file:line:column: …'."""
    path = Path(path)
    try:
        text = read_bytes(path, _MOST_BYTES).decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{shown_path(path)}: is not UTF-8 text; save it as such") from None
    return parse_session(text, shown_path(path))


def parse_session(text: str, source: str) -> Session:
    """A session from YAML text; ``source`` is its name in messages. Raises InputError."""
    _refuse_deep_nesting(text, source)
    try:
        document = YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f":{mark.line + 1}:{mark.column + 1}" if mark is not None else ""
        raise InputError(f"{source}{place}: {_one_line(str(error.problem))}") from None
    except Exception as error:  # some damage makes the library fail in other ways
        said = _one_line(str(error))[:200]
        raise InputError(f"{source}: is not YAML: {said}; see docs/hardware.md") from None
    if not isinstance(document, CommentedMap):
        raise InputError(f"{source}:1:1: a session file is a map; see docs/hardware.md")
    try:
        return Session.model_validate(_plain(document, {}))
    except _HoldsItselfError:
        raise InputError(
            f"{source}:1:1: something holds itself, by an alias (*); write it out"
        ) from None
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = _where(first)
        line, column = _place(document, where, missing=first["type"] == "missing",
                              key=first["type"] == "extra_forbidden")  # fmt: skip
        raise InputError(f"{source}:{line}:{column}: {_message(first, where)}") from None


def schema_text() -> str:
    """The JSON schema as it is shipped."""
    schema = Session.model_json_schema() | {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "cdprcal session",
    }
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def shipped_schema() -> str:
    """The schema file of this installation."""
    return (resources.files("cdprcal.hardware.session") / SCHEMA_FILE).read_text("utf-8")


class _HoldsItselfError(Exception):
    pass


def _refuse_deep_nesting(text: str, source: str) -> None:
    """Before the reader, which takes seconds to find out."""
    depth = 0
    for number, line in enumerate(text.split("\n"), start=1):
        for at, char in enumerate(line, start=1):
            depth += (char in "[{") - (char in "]}")
            if depth > _MOST_NESTED:
                raise InputError(
                    f"{source}:{number}:{at}: nested too deeply for a session file; see "
                    "docs/hardware.md"
                )


def _plain(node: Any, known: dict[int, Any]) -> Any:
    """Without the reader's own types, which strict models do not take.

    ``known``: nodes by identity. What an alias repeats stays one object, however often; what holds
    itself raises.
    """
    if isinstance(node, dict | list):
        if id(node) not in known:
            known[id(node)] = _HoldsItselfError
            known[id(node)] = (
                {_plain(key, known): _plain(value, known) for key, value in node.items()}
                if isinstance(node, dict)
                else [_plain(value, known) for value in node]
            )
        if known[id(node)] is _HoldsItselfError:
            raise _HoldsItselfError
        return known[id(node)]
    if isinstance(node, bool) or node is None:
        return node
    for kind in (int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node


def _where(error: Any) -> tuple[str | int, ...]:
    """Path of the field that an error is about."""
    if error["type"] != "session":
        return tuple(error["loc"])
    steps = error["ctx"]["where"].split(".")
    return tuple(int(step) if step.isdigit() else step for step in steps)


def _place(
    document: CommentedMap, where: Sequence[str | int], *, missing: bool, key: bool
) -> tuple[int, int]:
    """Line and column, from 1, of a field, or of what lacks it."""
    node: Any = document
    place = (document.lc.line, document.lc.col)
    steps = list(where[:-1] if missing else where)
    for depth, step in enumerate(steps):
        last = depth == len(steps) - 1
        if isinstance(node, CommentedMap) and step in node:
            place = node.lc.key(step) if last and key else node.lc.value(step)
            node = node[step]
        elif isinstance(node, CommentedSeq) and isinstance(step, int) and 0 <= step < len(node):
            place = node.lc.item(step)
            node = node[step]
        # Else it is no field but a step of the model's own, as the tag of a union.
    return place[0] + 1, place[1] + 1


def _message(error: Any, place: Sequence[str | int]) -> str:
    where = _dotted(place)
    said = str(error["msg"]).removeprefix("Value error, ")
    kind = error["type"]
    if kind == "extra_forbidden":
        return f"{where}: is not known here"
    if kind == "missing":
        return f"{where}: is missing"
    said = _one_line(said[:1].lower() + said[1:])
    if kind == "session":
        return f"{where}: {said}"
    value = error.get("input")
    if isinstance(value, (str, bool)) or (isinstance(value, int | float) and math.isfinite(value)):
        said += f", not {str(value)[:40]!r}"
    return f"{where}: {said}" if where else said


def _dotted(where: Sequence[str | int]) -> str:
    text = ""
    for step in where:
        if step in ("canopen", "ethercat"):
            continue  # the tag of a union
        text += f"[#{step + 1}]" if isinstance(step, int) else f".{step}"
    return text.lstrip(".")


def _one_line(text: str) -> str:
    return " ".join(text.split())


__all__ = ["SCHEMA_FILE", "load_session", "parse_session", "schema_text", "shipped_schema"]
