"""YAML 1.2 files held against a strict model: the model, or one message with file:line:column."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any, Generic, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import PydanticCustomError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError

from cdprcal._core import InputError
from cdprcal.io.files import read_bytes, refuse_utf_16, shown_path
from cdprcal.io.json_document import dotted

#: Eight winches with comments have a tenth of it; the reader takes a second for it.
_MOST_BYTES = 64 << 10
_MOST_NESTED = 50

#: The types of errors that ``misplaced`` and ``unfit`` make.
_MISPLACED, _UNFIT = "misplaced", "unfit"

M = TypeVar("M", bound=BaseModel)


def misplaced(where: str, what: str) -> PydanticCustomError:
    """An error of the whole that belongs to one field, by its path ('bus.type')."""
    return PydanticCustomError(_MISPLACED, "{what}", {"what": what, "where": where})


def unfit(what: str) -> PydanticCustomError:
    """An error of a field that names the value and what to do."""
    return PydanticCustomError(_UNFIT, "{what}", {"what": what})


@dataclass(frozen=True)
class YamlKind(Generic[M]):
    """A kind of file: the model of what it holds, what people call it, and the page about it."""

    model: type[M]
    name: str  #: 'session file'
    page: str  #: 'docs/hardware.md'
    #: With more keys than ``model``, which one takes that has any of those.
    whole: type[M] | None = None

    def load(self, path: str | Path) -> M:
        """Reads a file. Raises InputError 'file:line:column: …'."""
        path = Path(path)
        data = read_bytes(path, _MOST_BYTES)
        refuse_utf_16(data, path)
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            raise InputError(f"{shown_path(path)}: is not UTF-8 text; save it as such") from None
        return self.parse(text, shown_path(path))

    def parse(self, text: str, source: str) -> M:
        """From YAML text; ``source`` is its name in messages. Raises InputError."""
        self._refuse_deep_nesting(text, source)
        try:
            document = YAML(typ="rt").load(text)
        except MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            place = f":{mark.line + 1}:{mark.column + 1}" if mark is not None else ""
            raise InputError(f"{source}{place}: {_one_line(str(error.problem))}") from None
        except Exception as error:  # some damage makes the library fail in other ways
            said = _one_line(str(error))[:200]
            raise InputError(f"{source}: is not YAML: {said}; see {self.page}") from None
        if not isinstance(document, CommentedMap):
            raise InputError(f"{source}:1:1: a {self.name} is a map; see {self.page}")
        model = self.model
        if self.whole:
            more = self.whole.model_fields.keys() - model.model_fields.keys()
            model = self.whole if more & document.keys() else model
        try:
            return model.model_validate(_plain(document, {}))
        except _HoldsItselfError:
            raise InputError(
                f"{source}:1:1: something holds itself, by an alias (*); write it out"
            ) from None
        except ValidationError as error:
            errors = error.errors(include_url=False)
            first = errors[0]
            where = _where(first)
            said = _message(first, where)
            if misspelt := _misspelt(first, errors):
                said += f", and {misspelt[-1]} is not known there; correct its name"
            elif first["type"] == "extra_forbidden":
                said += f"; use one of {', '.join(_known_beside(model, where))}"
            line, column = _place(
                document, misspelt or where,
                missing=first["type"] == "missing" and not misspelt,
                key=first["type"] == "extra_forbidden" or bool(misspelt),
            )  # fmt: skip
            raise InputError(f"{source}:{line}:{column}: {said}") from None

    def _refuse_deep_nesting(self, text: str, source: str) -> None:
        """Before the reader, which takes seconds to find out."""
        depth = 0
        for number, line in enumerate(text.split("\n"), start=1):
            for at, char in enumerate(line, start=1):
                depth += (char in "[{") - (char in "]}")
                if depth > _MOST_NESTED:
                    raise InputError(
                        f"{source}:{number}:{at}: nested too deeply for a {self.name}; see "
                        f"{self.page}"
                    )


class _HoldsItselfError(Exception):
    pass


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


def _models_in(kind: Any) -> list[type[BaseModel]]:
    """The models of an annotation: of lists, maps and unions those that they hold."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return [kind]
    return [model for part in get_args(kind) for model in _models_in(part)]


def _known_beside(model: type[BaseModel], where: Sequence[str | int]) -> list[str]:
    """Names of the keys that may stand where ``where`` does."""
    models = [model]
    for step in where[:-1]:
        fields = [one.model_fields[step] for one in models if step in one.model_fields]
        # Else it is no field but an item, or the tag of a union.
        models = [m for field in fields for m in _models_in(field.annotation)] if fields else models
    return list(dict.fromkeys(name for one in models for name in one.model_fields))


def _where(error: Any) -> tuple[str | int, ...]:
    """Path of the field that an error is about."""
    if error["type"] != _MISPLACED:
        return tuple(error["loc"])
    steps = error["ctx"]["where"].split(".")
    return tuple(int(step) if step.isdigit() else step for step in steps)


def _misspelt(missing: Any, errors: Sequence[Any]) -> tuple[str | int, ...]:
    """Path of the unknown key that may be the one that is missing beside it; empty: there is none.

    Of several the one that is most like it.
    """
    if missing["type"] != "missing":
        return ()
    *there, name = _where(missing)
    unknown = [_where(error) for error in errors if error["type"] == "extra_forbidden"]
    beside = [where for where in unknown if list(where[:-1]) == there]
    return max(
        beside,
        key=lambda where: SequenceMatcher(None, str(where[-1]), str(name)).ratio(),
        default=(),
    )


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
    said = _one_line(said if kind == _UNFIT else said[:1].lower() + said[1:])
    if kind in (_MISPLACED, _UNFIT):
        return f"{where}: {said}"
    value = error.get("input")
    if isinstance(value, (str, bool)) or (isinstance(value, int | float) and math.isfinite(value)):
        said += f", not {str(value)[:40]!r}"
    return f"{where}: {said}" if where else said


def _dotted(where: Sequence[str | int]) -> str:
    tags = ("canopen", "ethercat")  # of a union
    return dotted(step for step in where if step not in tags)


def _one_line(text: str) -> str:
    return " ".join(text.split())
