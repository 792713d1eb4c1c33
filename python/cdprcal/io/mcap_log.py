"""The canonical log as MCAP: one JSON message a sample, its keys the canonical column names.

A file that was cut (a crash, a full disk) is read up to where it ends.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from mcap.exceptions import EndOfFile
from mcap.records import Channel, Message
from mcap.writer import Writer
from numpy.typing import NDArray

from cdprcal._core import InputError, Log
from cdprcal.findings import Finding
from cdprcal.io.log_file import LogFile, display_name
from cdprcal.io.mcap_records import DamagedError, records

TOPIC = "/cdprcal/sample"
SAMPLE_SCHEMA = "cdprcal.Sample"
_JSON = "json"
#: Small chunks: a file that is cut loses at most this much (uncompressed bytes).
_CHUNK_BYTES = 32 * 1024
_GROUPS = {
    "length_m": re.compile(r"length_([1-8])_m"),
    "swivel_rad": re.compile(r"swivel_([1-8])_rad"),
    "tension_N": re.compile(r"tension_([1-8])_N"),
    "tension_setpoint_N": re.compile(r"tension_setpoint_([1-8])_N"),
    "direct_length_m": re.compile(r"direct_length_([1-8])_m"),
}
#: Of the platform, whatever the number of cables.
_PLATFORM = {
    "roll_pitch_yaw_rad": ("roll_rad", "pitch_rad", "yaw_rad"),
    "absolute_yaw_rad": ("absolute_yaw_rad",),
    "position_m": ("position_x_m", "position_y_m", "position_z_m"),
}
_PLATFORM_NAMES = frozenset(name for names in _PLATFORM.values() for name in names)

Floats = NDArray[np.float64]


def write_mcap_log(log: Log, path: Path) -> None:
    """Writes a log as MCAP; log_time is time_s in nanoseconds, the message has time_s itself."""
    names, table = _table(log)
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=_CHUNK_BYTES)
        writer.start(profile="", library="cdprcal")
        schema = writer.register_schema(
            SAMPLE_SCHEMA, "jsonschema", json.dumps(sample_schema(names)).encode()
        )
        channel = writer.register_channel(TOPIC, _JSON, schema)
        for sequence, (time_s, row) in enumerate(
            zip(log.time_s.tolist(), table.tolist(), strict=True)
        ):
            sample = {"time_s": time_s} | {
                name: value for name, value in zip(names, row, strict=True) if math.isfinite(value)
            }
            stamp = max(0, round(time_s * 1e9))
            writer.add_message(channel, stamp, json.dumps(sample).encode(), stamp, sequence)
        writer.finish()  # type: ignore[no-untyped-call]


def parse_mcap_log(data: bytes, path: Path) -> LogFile:
    """Reads every JSON message that carries canonical columns; messages of one time are one sample.

    Raises InputError naming the file and message when a value is no number or nothing is there.
    """
    name = display_name(path)
    findings: list[Finding] = []
    samples: dict[float, dict[str, float]] = {}
    columns: dict[str, None] = {}
    for number, topic, message in _messages(data, name, findings):
        sample = _sample(message, f"{name}: message {number} on {topic}")
        if not sample:
            continue
        time = sample.pop("time_s")
        columns.update(dict.fromkeys(sample))
        samples.setdefault(time, {}).update(sample)
    if not samples:
        raise InputError(
            f"{name}: holds no JSON messages with canonical log columns "
            "(time_s, length_1_m, …, roll_rad, …); turn a ROS 2 bag into a log with cdprcal import"
        )
    time_s = np.array(sorted(samples))
    # A sensor that never answered has no key: the other groups know how many cables there are.
    cables = max((place[1] for key in columns if (place := _group_of(key))), default=0)
    log = Log(
        time_s=time_s,
        **{group: _per_cable(samples, time_s, columns, group, cables) for group in _GROUPS},
        **{
            group: _matrix(samples, time_s, names) if columns.keys() & set(names) else None
            for group, names in _PLATFORM.items()
        },
        source=name,
    )
    return LogFile(path, "mcap", log, tuple(findings))


def _messages(
    data: bytes, name: str, findings: list[Finding]
) -> Iterator[tuple[int, str, dict[str, Any]]]:
    """(number, topic, decoded message) of every JSON object, as far as the file goes."""
    channels: dict[int, Channel] = {}
    number = 0
    found = records(data)
    while True:
        try:
            record = next(found, None)
        except EndOfFile:
            findings.append(_cut(number, "ends in the middle of a record"))
            return
        except DamagedError as error:
            findings.append(_cut(number, f"is damaged ({error})"))
            return
        except Exception as error:  # damaged bytes make the library fail in any way
            findings.append(_cut(number, f"is damaged ({type(error).__name__})"))
            return
        if record is None:
            return
        if isinstance(record, Channel):
            channels[record.id] = record
        elif isinstance(record, Message):
            number += 1
            channel = channels.get(record.channel_id)
            if channel is not None and channel.message_encoding == _JSON:
                yield number, channel.topic, _decoded(record, f"{name}: message {number}")


def _cut(number: int, what: str) -> Finding:
    return Finding(
        severity="warning",
        code="truncated",
        message=f"the file {what} after message {number}: what follows is lost",
        remedy="what was read before is used; close the log properly before power-off or copying",
    )


def _decoded(record: Message, place: str) -> dict[str, Any]:
    try:
        message = json.loads(record.data)
    except (ValueError, RecursionError):
        raise InputError(
            f"{place}: is not JSON; see docs/your-log.md for what a message holds"
        ) from None
    return message if isinstance(message, dict) else {}


def _sample(message: dict[str, Any], place: str) -> dict[str, float]:
    """The canonical columns of a message; empty when it has none."""
    sample: dict[str, float] = {}
    for key, value in message.items():
        if key != "time_s" and key not in _PLATFORM_NAMES and _group_of(key) is None:
            continue
        if value is None:
            value = math.nan
        try:
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ValueError
            number = float(value)  # a whole number may be beyond double precision
            if math.isinf(number):
                raise ValueError
        except (ValueError, OverflowError):
            raise InputError(
                f"{place}: {key}: must be a finite number or null, not {str(value)[:40]!r}"
            ) from None
        sample[key] = number
    if sample.keys() <= {"time_s"}:
        return {}
    if not math.isfinite(sample.get("time_s", math.nan)):
        raise InputError(f"{place}: time_s: is missing: every sample needs its time")
    return sample


def _group_of(key: str) -> tuple[str, int] | None:
    for group, pattern in _GROUPS.items():
        if match := pattern.fullmatch(key):
            return group, int(match[1])
    return None


def _per_cable(
    samples: dict[float, dict[str, float]],
    time_s: Floats,
    columns: dict[str, None],
    group: str,
    cables: int,
) -> Floats | None:
    if not any(place[0] == group for key in columns if (place := _group_of(key))):
        return None
    stem, unit = group.rsplit("_", 1)
    return _matrix(samples, time_s, [f"{stem}_{i + 1}_{unit}" for i in range(cables)])


def _matrix(
    samples: dict[float, dict[str, float]], time_s: Floats, names: list[str] | tuple[str, ...]
) -> Floats:
    rows = [samples[time] for time in time_s.tolist()]
    flat = np.fromiter(
        chain.from_iterable([row.get(name, math.nan) for name in names] for row in rows),
        dtype=np.float64,
        count=len(rows) * len(names),
    )
    return flat.reshape(len(rows), len(names))


def _table(log: Log) -> tuple[list[str], Floats]:
    """Canonical column names without time_s, and their values [N, columns]."""
    names: list[str] = []
    values: list[Floats] = []
    for group in _GROUPS:
        matrix: Floats = getattr(log, group)
        stem, unit = group.rsplit("_", 1)
        names += [f"{stem}_{i + 1}_{unit}" for i in range(matrix.shape[1])]
        values.append(matrix)
    for group, columns in _PLATFORM.items():
        matrix = getattr(log, group)
        if matrix.shape[1]:
            names += columns
            values.append(matrix)
    return names, np.hstack(values)


def sample_schema(names: list[str]) -> dict[str, Any]:
    """JSON schema of a sample with these columns beside time_s."""
    properties = {"time_s": {"type": "number", "description": "seconds"}}
    properties |= {name: {"type": "number"} for name in names}
    return {
        "title": SAMPLE_SCHEMA,
        "description": "One sample of a cable robot's own sensors; a missing key is an absent "
        "reading. Lengths, swivels and yaw carry unknown constant offsets.",
        "type": "object",
        "properties": properties,
        "required": ["time_s"],
    }
