"""JSON schemas of what ``--json`` prints and of result files (draft 2020-12), shipped as data."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

from cdprcal._core import InputError
from cdprcal.sensors import ABSOLUTE

#: Definitions that are whole documents; the others are parts of them.
DOCUMENTS = (
    "acquire",
    "acquire-dry-run",
    "calibrate",
    "calibrate-result",
    "check",
    "demo",
    "diagnose",
    "diagnose-result",
    "effects",
    "effects-words",
    "explain",
    "compare",
    "geometry",
    "plan",
    "repeat",
    "track",
    "truth",
    "workspace",
)


def schema(name: str) -> dict[str, Any]:
    """The schema of one document, complete in itself. Raises InputError naming the choices."""
    if name not in DOCUMENTS:
        raise InputError(f"no schema {name!r}; give one of {', '.join(DOCUMENTS)}")
    text = resources.files(__name__).joinpath("documents.schema.json").read_text(encoding="utf-8")
    everything = json.loads(text, object_hook=_with_absolute)
    definitions: dict[str, Any] = everything["$defs"]
    needed = _reachable(definitions, name)
    root = dict(definitions[name])
    return {
        "$schema": everything["$schema"],
        "title": f"cdprcal {name}",
        **root,
        "$defs": {key: definitions[key] for key in sorted(needed)},
    }


def _with_absolute(part: dict[str, Any]) -> dict[str, Any]:
    """A part of a schema; where its comment says so, with the properties of absolute sensors."""
    kind = part.get("$comment")
    if kind in ("absolute: rms", "absolute: residual"):
        del part["$comment"]
        for channel in ABSOLUTE.values():
            sensor = channel.sensor
            one: dict[str, Any] = {"type": ["number", "null"]}
            if kind == "absolute: rms":
                part["properties"][channel.rms_field] = {"type": "number"}
            elif sensor.is_per_cable:
                part["properties"][sensor.field] = {"$ref": "#/$defs/per_cable"}
            else:
                width = sensor.columns_of(0)
                many = {"type": "array", "items": one, "minItems": width, "maxItems": width}
                about = {"description": f"[{sensor.unit}]; absent where nothing reads it."}
                part["properties"][sensor.field] = (one if width == 1 else many) | about
    return part


def _reachable(definitions: dict[str, Any], name: str) -> set[str]:
    """Names of the definitions that one refers to, directly or not; without itself."""
    found: set[str] = set()
    waiting = [definitions[name]]
    while waiting:
        part = waiting.pop()
        if isinstance(part, list):
            waiting += part
        elif isinstance(part, dict):
            reference = part.get("$ref")
            if isinstance(reference, str):
                key = reference.rpartition("/")[2]
                if key not in found:
                    found.add(key)
                    waiting.append(definitions[key])
            waiting += part.values()
    return found
