"""The canonical log as MCAP: one JSON message a sample, its keys the canonical column names.

A file that was cut (a crash, a full disk) is read up to where it ends.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Channel, McapRecord, Message
from mcap.writer import Writer
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import InputError, Log
from cdprcal.findings import Finding
from cdprcal.io.files import shown_path, shown_text
from cdprcal.io.loaded import LogFile
from cdprcal.io.mcap_records import CutError, DamagedError, blocks, inside, json_channel
from cdprcal.sensors import LOG_GROUPS, columns_of

TOPIC = "/cdprcal/sample"
_JSON = "json"
#: Small chunks: a file that is cut loses at most this much (uncompressed bytes).
_CHUNK_BYTES = 32 * 1024
#: What is read one a cable, and how its columns look; then what is of the platform.
_PER_CABLE = {
    field: re.compile(f"{group.name}_([1-8])_{group.unit}")
    for field, group in LOG_GROUPS.items()
    if group.is_per_cable
}
_PLATFORM = {
    field: columns_of(group, 0) for field, group in LOG_GROUPS.items() if not group.is_per_cable
}
#: JSON channels that are read chunk by chunk: who has more has them by accident, and telling the
#: chunks of each of them would take as long as reading message by message, every time.
_MOST_PLAIN_CHANNELS = 64
_PLATFORM_NAMES = frozenset(name for names in _PLATFORM.values() for name in names)

Floats = NDArray[np.float64]


def write_mcap_log(
    log: Log, path: Path, also: Callable[[Writer], None] = lambda writer: None
) -> None:
    """Writes a log as MCAP; log_time is time_s in nanoseconds, the message has time_s itself.

    ``also`` writes what else is to be in the file.
    """
    names, table = _table(log)
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=_CHUNK_BYTES)
        writer.start(profile="", library="cdprcal")
        channel = json_channel(writer, TOPIC, sample_schema(names))
        for sequence, (time_s, row) in enumerate(
            zip(log.time_s.tolist(), table.tolist(), strict=True)
        ):
            sample = {"time_s": time_s} | {
                name: value for name, value in zip(names, row, strict=True) if math.isfinite(value)
            }
            stamp = max(0, round(time_s * 1e9))
            writer.add_message(channel, stamp, json.dumps(sample).encode(), stamp, sequence)
        also(writer)
        writer.finish()  # type: ignore[no-untyped-call]


@dataclass(frozen=True)
class _Rows:
    """Some messages in the order of the file; ``present``: which have the key."""

    names: list[str]
    values: Floats  # [N, K]
    present: NDArray[np.bool_]  # [N, K]


def parse_mcap_log(data: bytes, path: Path) -> LogFile:
    """Reads every JSON message that carries canonical columns; messages of one time are one sample.

    Raises InputError naming the file and message when a value is no number or nothing is there.
    """
    name = shown_path(path)
    findings: list[Finding] = []
    parts = [part for part in _parts(data, name, findings) if len(part.values)]
    if not parts:
        raise InputError(
            f"{name}: holds no JSON messages with canonical log columns "
            "(time_s, length_1_m, …, roll_rad, …); turn a ROS 2 bag into a log with cdprcal import"
        )
    time_s, columns = _merged(parts)

    def table(names: list[str] | tuple[str, ...]) -> Floats:
        absent = np.full(len(time_s), np.nan)
        return np.column_stack([columns.get(key, absent) for key in names])

    # A sensor that never answered has no key: the other groups know how many cables there are.
    places = [place for key in columns if (place := _group_of(key))]
    cables = max((cable for _, cable in places), default=0)
    groups: dict[str, Any] = dict.fromkeys(LOG_GROUPS)
    for group in {group for group, _ in places}:
        groups[group] = table(columns_of(LOG_GROUPS[group], cables))
    for group, names in _PLATFORM.items():
        if columns.keys() & set(names):
            groups[group] = table(names)
    log = Log(time_s=time_s, **groups, source=name)
    return LogFile(path, "mcap", log, tuple(findings))


def _merged(parts: list[_Rows]) -> tuple[Floats, dict[str, Floats]]:
    """Increasing times, and by column the value that each sample was given last."""
    rows = sum(len(part.values) for part in parts)
    names = dict.fromkeys(key for part in parts for key in part.names)
    columns = {key: np.full(rows, np.nan) for key in names}
    given = {key: np.zeros(rows, dtype=np.bool_) for key in columns}
    begin = 0
    for part in parts:
        here = slice(begin, begin + len(part.values))
        for place, key in enumerate(part.names):
            columns[key][here] = part.values[:, place]
            given[key][here] = part.present[:, place]
        begin = here.stop
    time = columns.pop("time_s")
    order = np.argsort(time, kind="stable")
    time = time[order]
    first = np.flatnonzero(np.diff(time, prepend=np.nan) != 0.0)
    found: dict[str, Floats] = {}
    for key, values in columns.items():
        if not given[key].any():
            continue
        values = values[order]
        if len(first) < rows:
            # Of the messages of one sample, the last that has the key.
            last = np.where(given[key][order], np.arange(rows), -1)
            last = np.maximum.reduceat(last, first)
            values = np.where(last >= first, values[np.maximum(last, 0)], np.nan)
        found[key] = values
    return time[first], found


def _parts(data: bytes, name: str, findings: list[Finding]) -> Iterator[_Rows]:
    """The canonical columns of every JSON message, as far as the file goes."""
    reader = _Messages(name)
    try:
        for block in blocks(data):
            rows = reader.plain(block)
            if rows is None:
                reader.read(block)
            else:
                yield reader.taken()
                yield rows
    except CutError as error:
        findings.append(_cut(reader.number, str(error)))
    except DamagedError as error:
        findings.append(_cut(reader.number, f"is damaged ({shown_text(str(error))})"))
    yield reader.taken()


class _Messages:
    """Reads blocks of records; ``number`` counts the messages."""

    def __init__(self, name: str) -> None:
        self.number = 0
        self._name = name
        self._channels: dict[int, Channel] = {}
        self._topics: dict[int, str] = {}  # as messages show them
        self._json_channels: dict[int, None] = {}  # in the order of the file
        self._samples: list[dict[str, float]] = []

    def plain(self, block: McapRecord | bytes) -> _Rows | None:
        """The rows of a chunk in which nothing is wrong and nothing new; None: read it message by
        message, which finds out what is."""
        known = self._json_channels
        if not 0 < len(known) <= _MOST_PLAIN_CHANNELS or not isinstance(block, bytes):
            return None
        read = _core.plain_json_messages(block, list(known))
        if read is None:
            return None
        count, names, values, present = read
        columns = [at for at, key in enumerate(names) if key == "time_s" or _is_column(key)]
        if len(columns) < len(names):
            names = [names[at] for at in columns]
            values, present = values[:, columns], present[:, columns]
        is_time = np.array([key == "time_s" for key in names], dtype=np.bool_)
        is_sample = present[:, ~is_time].any(axis=1)
        if not is_sample.all():
            values, present = values[is_sample], present[is_sample]
        if len(values) and not (is_time.any() and np.isfinite(values[:, is_time]).all()):
            return None
        self.number += count
        return _Rows(names, values, present)

    def read(self, block: McapRecord | bytes) -> None:
        """Reads record by record. Raises InputError for a message that cannot be used."""
        for record in inside(block) if isinstance(block, bytes) else [block]:
            if isinstance(record, Channel):
                self._channels[record.id] = record
                if record.message_encoding == _JSON:
                    self._json_channels[record.id] = None
                else:
                    self._json_channels.pop(record.id, None)
                self._topics[record.id] = shown_text(record.topic)
            elif isinstance(record, Message):
                self.number += 1
                channel = self._channels.get(record.channel_id)
                if channel is not None and channel.message_encoding == _JSON:
                    place = f"{self._name}: message {self.number}"
                    message = _decoded(record, place)
                    sample = _sample(message, f"{place} on {self._topics[channel.id]}")
                    if sample:
                        self._samples.append(sample)

    def taken(self) -> _Rows:
        """What was read record by record since the last time."""
        samples, self._samples = self._samples, []
        return _rows_of(samples)


def _rows_of(samples: list[dict[str, float]]) -> _Rows:
    names = list(dict.fromkeys(key for sample in samples for key in sample))
    shape = (len(samples), len(names))
    # None is an absent key, and NaN as a number.
    values = np.array([[sample.get(key) for key in names] for sample in samples], dtype=np.float64)
    present = np.ones(shape, dtype=np.bool_)
    if any(len(sample) < len(names) for sample in samples):
        present[:] = [[key in sample for key in names] for sample in samples]
    return _Rows(names, values.reshape(shape), present)


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
        if key != "time_s" and not _is_column(key):
            continue
        plain = type(value) is float and abs(value) != math.inf
        sample[key] = value if plain else _number(value, f"{place}: {key}")
    if sample.keys() <= {"time_s"}:
        return {}
    if not math.isfinite(sample.get("time_s", math.nan)):
        raise InputError(f"{place}: time_s: is missing: every sample needs its time")
    return sample


def _number(value: Any, place: str) -> float:
    try:
        if value is None:
            return math.nan
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError
        number = float(value)  # a whole number may be beyond double precision
        if math.isinf(number):
            raise ValueError
    except (ValueError, OverflowError):
        raise InputError(
            f"{place}: must be a finite number or null, not {str(value)[:40]!r}"
        ) from None
    return number


@lru_cache(maxsize=1024)
def _is_column(key: str) -> bool:
    return key in _PLATFORM_NAMES or _group_of(key) is not None


@lru_cache(maxsize=1024)
def _group_of(key: str) -> tuple[str, int] | None:
    for group, pattern in _PER_CABLE.items():
        if match := pattern.fullmatch(key):
            return group, int(match[1])
    return None


def _table(log: Log) -> tuple[list[str], Floats]:
    """Canonical column names without time_s, and their values [N, columns]."""
    names: list[str] = []
    values: list[Floats] = []
    for group in (*_PER_CABLE, *_PLATFORM):
        matrix: Floats = getattr(log, group)
        if matrix.shape[1]:
            names += columns_of(LOG_GROUPS[group], matrix.shape[1])
        values.append(matrix)
    return names, np.hstack(values)


def sample_schema(names: list[str]) -> dict[str, Any]:
    """JSON schema of a sample with these columns beside time_s."""
    properties = {"time_s": {"type": "number", "description": "seconds"}}
    properties |= {name: {"type": "number"} for name in names}
    return {
        "title": "cdprcal.Sample",
        "description": "One sample of a cable robot's own sensors; a missing key is an absent "
        "reading. Lengths, swivels and yaw carry unknown constant offsets.",
        "type": "object",
        "properties": properties,
        "required": ["time_s"],
    }
