"""Records of an MCAP file, as far as the file goes and its checksums hold."""

from __future__ import annotations

import io as binary_io
import json
import mmap
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mcap.records import McapRecord
    from mcap.writer import Writer

MCAP_MAGIC = b"\x89MCAP0\r\n"
#: Of what a chunk unpacks to. Loggers write chunks of a megabyte or so.
MOST_CHUNK_BYTES = 64 << 20
#: As in the mcap library: a larger size is no size.
_MOST_RECORD_BYTES = 4 << 30
#: Of what all chunks of a log unpack to; see MOST_BYTES of text logs.
MOST_UNPACKED_BYTES = 1 << 30
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_HEAD = struct.Struct("<BQ")  # opcode, size of the content
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_CHUNK_HEAD = struct.Struct("<QQQII")  # times, size and CRC unpacked, length of the compression
_CHUNK_CRC = 24  # where it is
_FOOTER, _CHANNEL, _SCHEMA, _MESSAGE, _CHUNK, _ATTACHMENT, _DATA_END = 2, 4, 3, 5, 6, 9, 15


class DamagedError(Exception):
    """A record is not what it says it is."""


class CutError(Exception):
    """The file ends in the middle of a record, or before its footer."""

    def __str__(self) -> str:
        return "ends in the middle of a record"


def blocks(
    data: bytes | mmap.mmap, most: int | None = MOST_UNPACKED_BYTES
) -> Iterator[McapRecord | bytes]:
    """Every schema, channel, message and attachment outside of chunks; and the records inside of
    each chunk as bytes, together no more than ``most``. Raises CutError and DamagedError.

    Checksums are verified where the file has them, and a chunk cannot unpack to more than it
    announces. Indices are not read: whatever is wrong with them does not matter.
    """
    if data[: len(MCAP_MAGIC)] != MCAP_MAGIC:
        raise DamagedError("no MCAP")
    unpacked = 0
    for opcode, begin, end in _walk(data, len(MCAP_MAGIC)):
        if opcode == _CHUNK:
            size, compression, crc, packed = _chunk(data[begin:end])
            unpacked += size
            if size > MOST_CHUNK_BYTES or (most is not None and unpacked > most):
                raise DamagedError("too large")
            yield _unpacked(packed, compression, size, crc)
        elif opcode in (_SCHEMA, _CHANNEL, _MESSAGE, _ATTACHMENT):
            yield _record(opcode, data[begin:end])
        elif opcode == _DATA_END:
            (crc,) = struct.unpack_from("<I", data, begin) if end - begin >= 4 else (0,)
            if crc and crc != _checksum(data, begin - _HEAD.size):
                raise DamagedError("the checksum of the data does not fit")
        elif opcode == _FOOTER:
            if data[end : end + len(MCAP_MAGIC)] != MCAP_MAGIC:
                raise CutError
            return
    raise CutError


def _checksum(data: bytes | mmap.mmap, end: int) -> int:
    crc = 0
    for at in range(0, end, 1 << 20):
        crc = zlib.crc32(data[at : min(end, at + (1 << 20))], crc)
    return crc


def write_checksums(path: Path) -> None:
    """Gives every chunk of a valid file the CRC that its writer left out. Raises OSError."""
    with path.open("r+b") as stream, mmap.mmap(stream.fileno(), 0) as data:
        for opcode, begin, end in _walk(data, len(MCAP_MAGIC)):
            if opcode == _CHUNK:
                size, compression, _, packed = _chunk(data[begin:end])
                crc = zlib.crc32(_unpacked(packed, compression, size, 0))
                struct.pack_into("<I", data, begin + _CHUNK_CRC, crc)
            elif opcode == _FOOTER:
                return


def json_channel(writer: Writer, topic: str, schema: Mapping[str, Any]) -> int:
    """A channel of JSON messages in a file that is being written; its schema has a title."""
    text = json.dumps(schema).encode()
    known = writer.register_schema(schema["title"], "jsonschema", text)
    return writer.register_channel(topic, "json", known)


def records(data: bytes) -> Iterator[McapRecord]:
    """Every schema, channel, message and attachment, those inside of chunks too; as blocks."""
    for block in blocks(data):
        if isinstance(block, bytes):
            yield from inside(block)
        else:
            yield block


def inside(block: bytes) -> Iterator[McapRecord]:
    """The records of a block of bytes. Raises as blocks."""
    try:
        for opcode, begin, end in _walk(block, 0):
            if opcode in (_SCHEMA, _CHANNEL, _MESSAGE):
                yield _record(opcode, block[begin:end])
    except CutError:
        raise DamagedError("a chunk that ends in the middle of a record") from None


def readable_records(data: bytes) -> Iterator[McapRecord]:
    """Every record up to the end, or up to where the file was cut or damaged."""
    with suppress(CutError, DamagedError):
        yield from records(data)


def unpack_zstd(packed: bytes, most: int) -> bytes:
    """The content, or its first ``most`` + 1 bytes where it is longer. Raises DamagedError."""
    import zstandard

    unpacker = zstandard.ZstdDecompressor(max_window_size=MOST_CHUNK_BYTES)
    try:
        data: bytes = unpacker.stream_reader(packed, read_across_frames=True).read(most + 1)
    except zstandard.ZstdError as error:
        raise DamagedError(str(error)) from None
    return data


def _unpack_lz4(packed: bytes, most: int) -> bytes:
    import lz4.frame  # type: ignore[import-untyped]

    try:
        data: bytes = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=most + 1)
    except RuntimeError as error:
        raise DamagedError(str(error)) from None
    return data


def is_zstd(data: bytes) -> bool:
    """Whether this begins as zstd does."""
    return data.startswith(_ZSTD_MAGIC)


def _walk(data: bytes | mmap.mmap, at: int) -> Iterator[tuple[int, int, int]]:
    """(opcode, begin, end of the content) of each record."""
    while at < len(data):
        if at + _HEAD.size > len(data):
            raise CutError
        opcode, size = _HEAD.unpack_from(data, at)
        begin, at = at + _HEAD.size, at + _HEAD.size + size
        if size > _MOST_RECORD_BYTES:
            raise DamagedError("a record of impossible size")
        if at > len(data):
            raise CutError
        yield opcode, begin, at


def _record(opcode: int, content: bytes) -> McapRecord:
    from mcap.data_stream import ReadDataStream
    from mcap.records import Attachment, Channel, Message, Schema

    if opcode == _MESSAGE:
        if len(content) < _MESSAGE_HEAD.size:
            raise DamagedError("a message without its head")
        channel, sequence, log_time, publish_time = _MESSAGE_HEAD.unpack_from(content)
        return Message(
            channel_id=channel,
            log_time=log_time,
            data=content[_MESSAGE_HEAD.size :],
            publish_time=publish_time,
            sequence=sequence,
        )
    kinds: dict[int, Any] = {_CHANNEL: Channel, _SCHEMA: Schema, _ATTACHMENT: Attachment}
    try:
        record: McapRecord = kinds[opcode].read(ReadDataStream(binary_io.BytesIO(content)))
    except Exception as error:  # damaged bytes make the library fail in any way
        raise DamagedError(f"a {kinds[opcode].__name__}: {type(error).__name__}") from None
    return record


def _chunk(content: bytes) -> tuple[int, bytes, int, bytes]:
    """(size unpacked, compression, CRC, packed records)."""
    if len(content) < _CHUNK_HEAD.size:
        raise DamagedError("a chunk without its head")
    _, _, size, crc, length = _CHUNK_HEAD.unpack_from(content)
    at = _CHUNK_HEAD.size + length
    if at + 8 > len(content):
        raise DamagedError("a chunk without its head")
    compression = content[_CHUNK_HEAD.size : at]
    (packed,) = struct.unpack_from("<Q", content, at)
    if at + 8 + packed > len(content):
        raise DamagedError("a chunk that ends before its records")
    return size, compression, crc, content[at + 8 : at + 8 + packed]


def _unpacked(packed: bytes, compression: bytes, size: int, crc: int) -> bytes:
    """What is inside of a chunk; stops as soon as there is more than the chunk announces."""
    if compression == b"zstd":
        data = unpack_zstd(packed, size)
    elif compression == b"lz4":
        data = _unpack_lz4(packed, size)
    elif not compression:
        data = packed
    else:
        raise DamagedError(f"unknown compression {compression[:20].decode('latin-1')!r}")
    if len(data) != size:
        raise DamagedError("a chunk of another size than announced")
    if crc and zlib.crc32(data) != crc:
        raise DamagedError("the checksum of a chunk does not fit")
    if data[:1] == b"\0":
        raise DamagedError("zeros instead of records")
    return data
