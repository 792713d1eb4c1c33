"""MCAP with JSON messages of any topics and keys, as flat columns: '/winches.length.1'."""

from __future__ import annotations

from pathlib import Path

from cdprcal._core import InputError
from cdprcal.io.files import read_bytes, shown_path, shown_text
from cdprcal.mapping.bag import Messages
from cdprcal.mapping.json_lines import flat_row, parsed
from cdprcal.mapping.raw import RawTable


def read_mcap_json(path: Path) -> RawTable:
    """Reads every JSON message that is an object and holds numbers, at its log time; as topics of a
    bag. Raises InputError where there is none, or the file is not whole."""
    from mcap.records import Channel, Message

    from cdprcal.io.mcap_records import CutError, DamagedError, records

    name = shown_path(path)
    channels: dict[int, Channel] = {}
    taken = Messages()
    try:
        for record in records(read_bytes(path)):
            if isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message) and record.channel_id in channels:
                channel = channels[record.channel_id]
                if channel.message_encoding == "json":
                    taken.add(channel.topic, record.log_time, _numbers(record.data))
    except (CutError, DamagedError) as error:
        raise InputError(
            f"{name}: is no whole MCAP file ({shown_text(str(error))}); repair it with "
            "`mcap recover`"
        ) from None
    columns = taken.columns()
    if not columns:
        listed = {f"{c.topic} ({c.message_encoding})": None for c in channels.values()}
        there = shown_text(", ".join(sorted(listed)), 300) or "nothing"
        raise InputError(
            f"{name}: holds no JSON messages with numbers; write its messages as JSON, as a ROS 2 "
            f"bag or as CSV. It holds {there}"
        )
    return RawTable(path, "bag", columns)


def _numbers(data: bytes) -> dict[str, float]:
    """The numbers of a message by name; none of one that is no object."""
    held = parsed(data)
    flat = flat_row(held) if isinstance(held, dict) else {}
    return {f".{key}": value for key, value in flat.items() if isinstance(value, float)}
