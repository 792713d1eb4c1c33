"""Session files: YAML 1.2 to a Session, or one message with file:line:column."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path

from cdprcal.hardware.session.model import Session, TopicMap
from cdprcal.strict_yaml import YamlKind

#: The JSON schema of session files, for editors; beside this module in an installation.
SCHEMA_FILE = "session.schema.json"
_KIND = YamlKind(Session, "session file", "docs/hardware.md")
_TOPICS = YamlKind(TopicMap, "session file", "docs/ros2.md", whole=Session)


def load_session(path: str | Path) -> Session:
    """Reads a session file. Raises InputError 'file:line:column: …'."""
    return _KIND.load(path)


def load_topics(path: str | Path) -> TopicMap:
    """What bags need of a session file, which may have no more. Raises InputError as load_session
    does, of a file with devices for these too."""
    return _TOPICS.load(path)


def parse_session(text: str, source: str) -> Session:
    """A session from YAML text; ``source`` is its name in messages. Raises InputError."""
    return _KIND.parse(text, source)


def schema_text() -> str:
    """The JSON schema as it is shipped.

    As for load_topics, only a file of devices must have all that moving a robot needs.
    """
    schema = Session.model_json_schema()
    of_devices = [name for name in schema["properties"] if name not in TopicMap.model_fields]
    needed = [name for name in schema["required"] if name in of_devices]
    schema |= {
        "required": [name for name in schema["required"] if name not in needed],
        "dependentRequired": dict.fromkeys(of_devices, needed),
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "cdprcal session",
    }
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def example_text() -> str:
    """A whole session: irma4 with simulated drives. Its first line names this schema's file."""
    here = resources.files("cdprcal.hardware.session")
    text = (here / "canopen-simulated.yaml").read_text("utf-8")
    return text.replace(f"$schema={SCHEMA_FILE}", f"$schema={here / SCHEMA_FILE}", 1)


def shipped_schema() -> str:
    """The schema file of this installation."""
    return (resources.files("cdprcal.hardware.session") / SCHEMA_FILE).read_text("utf-8")


__all__ = [
    "SCHEMA_FILE",
    "example_text",
    "load_session",
    "load_topics",
    "parse_session",
    "schema_text",
    "shipped_schema",
]
