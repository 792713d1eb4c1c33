"""Events of an acquired log: changes of state, and whatever else was noted while it ran."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdprcal.io.files import read_bytes
from cdprcal.io.log_file import readable_format
from cdprcal.io.mcap_records import json_channel, readable_records

if TYPE_CHECKING:
    from mcap.writer import Writer

Event = Mapping[str, Any]

EVENT_TOPIC = "/cdprcal/event"
_EVENT_SCHEMA = {
    "title": "cdprcal.Event",
    "description": "A change of state of the start-up procedure.",
    "type": "object",
    "properties": {
        "time_s": {"type": "number", "description": "seconds"},
        "state": {"type": "string"},
        "setpoint": {"type": "integer", "description": "from 1, the first is tau_0"},
        "reason": {"type": "string", "description": "why the robot was stopped"},
        "estimate": {"type": "object", "description": "of the initial pose, after a rest; SI"},
    },
    "required": ["time_s", "state"],
}
_MARK = b"# event| "


def read_events(path: str | Path) -> list[dict[str, Any]]:
    """Events in the order of their times, each with ``time_s``; none in logs of other origin.

    Logs that were cut are read as far as they go. Raises InputError when the file cannot be read.
    """
    data = read_bytes(Path(path))
    kind = readable_format(data, path)
    texts = _mcap(data) if kind == "mcap" else _csv(data) if kind == "csv" else []
    events = []
    for text in texts:
        try:
            event = json.loads(text)
        except ValueError:
            continue  # the line that was being written when the program was killed
        if isinstance(event, dict) and isinstance(event.get("time_s"), int | float):
            events.append(event)
    return sorted(events, key=lambda event: float(event["time_s"]))


def as_comment(event: Event) -> bytes:
    """An event as a line of a CSV log."""
    return _MARK + json.dumps(event, allow_nan=False).encode() + b"\n"


def event_channel(writer: Writer) -> int:
    """The channel of events in an MCAP file that is being written."""
    return json_channel(writer, EVENT_TOPIC, _EVENT_SCHEMA)


def add_events(writer: Writer, events: Iterable[Event]) -> None:
    """Writes events, each at its ``time_s``."""
    channel = event_channel(writer)
    for number, event in enumerate(events):
        stamp = max(0, round(event["time_s"] * 1e9))
        data = json.dumps(event, allow_nan=False).encode()
        writer.add_message(channel, stamp, data, stamp, number)


def told_in(path: str | Path) -> tuple[dict[str, Any], ...]:
    """The diagnoses that ``acquire --diagnose`` made after rests, each with its ``time_s``."""
    return tuple(told for event in read_events(path) if (told := _told(event)))


def _told(event: dict[str, Any]) -> dict[str, Any] | None:
    """None where an event has no diagnosis, or somebody else's."""
    try:
        told = event["estimate"]["diagnosis"]
        return {
            "time_s": float(event["time_s"]),
            "verdict": str(told["verdict"]),
            "faults": [str(name) for name in told["faults"]],
            "effects": [
                {
                    "name": str(effect["name"]),
                    "log_evidence": float(effect["log_evidence"]),
                    "rivals": [str(name) for name in effect["rivals"]],
                }
                for effect in told["effects"]
            ],
        }
    except (KeyError, TypeError, ValueError):
        return None


def _csv(data: bytes) -> list[bytes]:
    return [line[len(_MARK) :] for line in data.split(b"\n") if line.startswith(_MARK)]


def _mcap(data: bytes) -> list[bytes]:
    from mcap.records import Channel, Message

    topics: dict[int, str] = {}
    found: list[bytes] = []
    for record in readable_records(data):
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Message) and topics.get(record.channel_id) == EVENT_TOPIC:
            found.append(record.data)
    return found
