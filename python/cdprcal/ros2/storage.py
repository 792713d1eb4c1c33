"""What a rosbag2 stores: messages in MCAP or SQLite, in one file or in a folder with metadata.

Nothing can unpack to more than is allowed, and whatever checks the storage has are made: the
checksums of MCAP (``ros2 bag record`` and ``cdprcal export`` write them), the structure of SQLite.
SQLite has none: ``cdprcal export`` puts the SHA-256 of its files into the metadata, and without one
a flipped bit inside of a reading cannot be seen.
"""

from __future__ import annotations

import hashlib
import mmap
import sqlite3
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePath
from typing import Any

from cdprcal._core import InputError
from cdprcal.io.files import begins_with, in_words, reason
from cdprcal.io.mcap_records import (
    MCAP_MAGIC,
    MOST_CHUNK_BYTES,
    blocks,
    inside,
    is_zstd,
    unpack_zstd,
)

SQLITE_MAGIC = b"SQLite format 3\0"
_NEWEST_VERSION = 9
#: Key of custom_data in the metadata: before the name of a file, what its SHA-256 is.
_CHECKSUM = "cdprcal.sha256."
#: Of metadata.yaml: a hundred topics have a tenth of it.
_MOST_METADATA = 1 << 20
_MOST_MESSAGE = MOST_CHUNK_BYTES  # unpacked
#: Of a file that is packed as a whole, over its packed size. Readings have noise: ten or twenty.
_MOST_RATIO = 100
#: Of all messages that are used: a day of joint states at 20 Hz.
_MOST_USED = 1 << 30


class StorageError(Exception):
    """What is stored is damaged, or none of these."""


@contextmanager
def damage_named(name: str, said: Callable[[Exception], str]) -> Iterator[None]:
    """Raises InputError for all that reading a bag raises; ``said``: of what the libraries do."""
    try:
        yield
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {reason(error)}") from None
    except Exception as error:  # damaged bytes make the libraries fail in any way
        raise InputError(
            f"{name}: is no whole ROS 2 bag{said(error)}; repair one that was cut with "
            "`ros2 bag reindex` or `mcap recover`"
        ) from None


def messages(
    path: Path, wanted: Mapping[str, str], topics: dict[str, str]
) -> Iterator[tuple[str, int, bytes]]:
    """(topic, recorded [ns], CDR) of every message whose topic is ``wanted``.

    ``topics`` is filled with the type of every topic that is seen, also of those that are not
    wanted. Raises StorageError, OSError, or what the libraries make of damaged bytes.
    """
    used = 0
    for file in _files(path) if path.is_dir() else [path]:
        for topic, recorded, data in _of_file(file, wanted, topics):
            message = unpack_zstd(data, _MOST_MESSAGE) if is_zstd(data) else data
            used += len(message)
            if len(message) > _MOST_MESSAGE or used > _MOST_USED:
                raise StorageError("more than any log; split it")
            yield topic, recorded, message


def _files(folder: Path) -> list[Path]:
    """The files that the metadata names."""
    from ruamel.yaml import YAML

    text = begins_with(folder / "metadata.yaml", _MOST_METADATA + 1)
    if len(text) > _MOST_METADATA:
        raise StorageError(f"its metadata.yaml is over {in_words(_MOST_METADATA)}")
    document: Any = YAML(typ="safe").load(text)
    try:
        about = document["rosbag2_bagfile_information"]
        version, storage, names = (
            about[key] for key in ("version", "storage_identifier", "relative_file_paths")
        )
        files = [folder / PurePath(name).name for name in names]
    except (KeyError, TypeError):
        raise StorageError("its metadata.yaml does not say what files it has") from None
    if not isinstance(version, int) or version > _NEWEST_VERSION:
        raise StorageError(f"is of version {version!r}; known are those up to {_NEWEST_VERSION}")
    if storage not in ("mcap", "sqlite3"):
        raise StorageError(f"its storage is {storage!r}, neither mcap nor sqlite3")
    if gone := [file.name for file in files if not file.is_file()]:
        raise StorageError(f"{gone[0]} is missing")
    noted = about.get("custom_data")
    for file in files:
        wanted = noted.get(_CHECKSUM + file.name) if isinstance(noted, dict) else None
        if wanted is not None and wanted != _sha256(file):
            raise StorageError(f"the checksum of {file.name} does not fit")
    return files


def write_checksums_of_files(folder: Path) -> None:
    """Puts the SHA-256 of the files of a bag that is whole into its metadata. Raises OSError."""
    from ruamel.yaml import YAML

    yaml, path = YAML(), folder / "metadata.yaml"
    document: Any = yaml.load(path)
    about = document["rosbag2_bagfile_information"]
    about["custom_data"] = (about.get("custom_data") or {}) | {
        _CHECKSUM + name: _sha256(folder / name) for name in about["relative_file_paths"]
    }
    with path.open("w", encoding="utf-8") as stream:
        yaml.dump(document, stream)


def is_protected(path: Path) -> bool:
    """Whether a flipped bit is noticed: everywhere but in SQLite without a SHA-256 beside it."""
    folder = path if path.is_dir() else path.parent
    files = _files(path) if path.is_dir() else [path]
    if not any(file.suffix == ".db3" for file in files):
        return True
    noted = begins_with(folder / "metadata.yaml", _MOST_METADATA) if path.is_dir() else b""
    return _CHECKSUM.encode() in noted


def _sha256(file: Path) -> str:
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _of_file(
    file: Path, wanted: Mapping[str, str], topics: dict[str, str]
) -> Iterator[tuple[str, int, bytes]]:
    head = begins_with(file, 16)
    if is_zstd(head):
        with tempfile.NamedTemporaryFile(prefix="cdprcal-") as whole:
            _unpack(file, whole)
            yield from _of_storage(Path(whole.name), wanted, topics)
    else:
        yield from _of_storage(file, wanted, topics)


def _unpack(file: Path, target: Any) -> None:
    import zstandard

    size, most = 0, max(MOST_CHUNK_BYTES, _MOST_RATIO * file.stat().st_size)
    with file.open("rb") as packed:
        unpacker = zstandard.ZstdDecompressor(max_window_size=MOST_CHUNK_BYTES)
        with unpacker.stream_reader(packed, read_across_frames=True) as stream:
            while part := stream.read(1 << 20):
                size += len(part)
                if size > most:
                    raise StorageError(f"{file.name} unpacks to far more than any log")
                target.write(part)
    target.flush()


def _of_storage(
    file: Path, wanted: Mapping[str, str], topics: dict[str, str]
) -> Iterator[tuple[str, int, bytes]]:
    head = begins_with(file, 16)
    if head.startswith(MCAP_MAGIC):
        return _of_mcap(file, wanted, topics)
    if head.startswith(SQLITE_MAGIC):
        return _of_sqlite(file, wanted, topics)
    raise StorageError(f"{file.name} is neither MCAP nor SQLite")


def _of_mcap(
    file: Path, wanted: Mapping[str, str], topics: dict[str, str]
) -> Iterator[tuple[str, int, bytes]]:
    from mcap.records import Channel, Message, Schema

    schemas: dict[int, str] = {}
    channels: dict[int, str] = {}
    with file.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        for block in blocks(data, most=None):
            for record in inside(block) if isinstance(block, bytes) else [block]:
                if isinstance(record, Message):
                    topic = channels.get(record.channel_id, "")
                    if topic in wanted:
                        yield topic, record.log_time, record.data
                elif isinstance(record, Schema):
                    schemas[record.id] = record.name
                elif isinstance(record, Channel):
                    if record.message_encoding != "cdr":
                        continue
                    channels[record.id] = record.topic
                    topics[record.topic] = schemas.get(record.schema_id, "of no type")


def _of_sqlite(
    file: Path, wanted: Mapping[str, str], topics: dict[str, str]
) -> Iterator[tuple[str, int, bytes]]:
    database = sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
    try:
        tables = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN (?, ?)"
        if database.execute(tables, ("messages", "topics")).fetchone() != (2,):
            raise StorageError("has no tables messages and topics")
        (found,) = database.execute("PRAGMA integrity_check(1)").fetchone()
        if found != "ok":
            raise StorageError(f"SQLite finds: {found}")
        ids: dict[int, str] = {}
        for key, topic, kind, form in database.execute(
            "SELECT id, name, type, serialization_format FROM topics"
        ):
            if form == "cdr" and isinstance(topic, str) and isinstance(kind, str):
                topics[topic] = kind
                if topic in wanted:
                    ids[key] = topic
        for key, recorded, data in database.execute(
            "SELECT topic_id, timestamp, data FROM messages ORDER BY id"
        ):
            if key in ids:
                if not isinstance(data, bytes) or not isinstance(recorded, int):
                    raise StorageError("a message is no bytes with a time")
                yield ids[key], recorded, data
    finally:
        database.close()
