"""JSON from files that anybody may have changed: strictly read, checked against its schema."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from typing import Any

from cdprcal._core import InputError

#: Values in a document: a hundred thousand poses have five million.
_MOST_VALUES = 8_000_000


def parse_json(data: bytes, name: str) -> Any:
    """A JSON document. Raises InputError for what is none, for keys that are given twice, numbers
    beyond double precision, NaN and infinities, and nesting beyond reason.
    """
    if data.count(b",") + data.count(b"[") + data.count(b"{") > _MOST_VALUES:
        raise InputError(
            f"{name}: holds over {_MOST_VALUES // 1_000_000} million values; give a result file"
        )
    try:
        return json.loads(
            data,
            object_pairs_hook=_without_duplicates,
            parse_constant=_refused,
            parse_float=_finite,
            parse_int=_whole,
        )
    except json.JSONDecodeError as error:
        raise InputError(
            f"{name}:{error.lineno}:{error.colno}: is no JSON ({error.msg.lower()}); give a result "
            "file"
        ) from None
    except UnicodeDecodeError as error:
        raise InputError(
            f"{name}: is no JSON: not UTF-8 at byte {error.start}; give a result file"
        ) from None
    except ValueError as error:
        raise InputError(f"{name}: is no JSON ({error}); give a result file") from None
    except RecursionError:
        raise InputError(f"{name}: is no JSON: nested too deeply; give a result file") from None


def require_schema(document: Any, schema_name: str, name: str) -> None:
    """Raises InputError 'file: field: …' for the first thing that is not as the schema says."""
    from jsonschema import Draft202012Validator
    from jsonschema.exceptions import best_match

    from cdprcal.schemas import schema

    wanted = schema(schema_name)
    # A choice that the document has made already: what is wrong then has one reason, not several.
    choices = wanted["$defs"].get("inputs", {}).get("oneOf", [])
    for choice in choices:
        if choice["properties"]["command"]["const"] == document["inputs"]["command"]:
            wanted["properties"]["inputs"] = choice
    error = best_match(Draft202012Validator(wanted).iter_errors(document))
    if error is not None:
        where = dotted(error.absolute_path)
        said = " ".join(error.message.split())
        if len(said) > 200:
            said = f"{said[:100]} … {said[-80:]}"
        raise InputError(
            f"{name}: is damaged: {where + ': ' if where else ''}{said}; write it anew (cdprcal "
            f"schema {schema_name} says what belongs there)"
        )


def dotted(path: Iterable[str | int]) -> str:
    """('poses', 0, 'time_s') → 'poses[#1].time_s'."""
    text = ""
    for step in path:
        text += f"[#{step + 1}]" if isinstance(step, int) else f".{step}"
    return text.lstrip(".")


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    document = dict(pairs)
    if len(document) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {twice[:40]!r} is given twice")
    return document


def _refused(text: str) -> float:
    raise ValueError(f"{text} is no number of JSON")


def _finite(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise ValueError(f"{text[:40]} is beyond double precision")
    return value


def _whole(text: str) -> int:
    if len(text) > 15:
        raise ValueError(f"{text[:40]} has more digits than a double")
    return int(text)
