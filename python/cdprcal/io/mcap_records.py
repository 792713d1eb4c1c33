"""Records of an MCAP file, as far as the file goes and its checksums hold."""

from __future__ import annotations

import io as binary_io
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mcap.records import Chunk, McapRecord

#: Of what a chunk unpacks to. Loggers write chunks of a megabyte or so.
_MOST_CHUNK_BYTES = 64 << 20
#: Of what all chunks of a log unpack to; see MOST_BYTES of text logs.
_MOST_BYTES = 1 << 30


class DamagedError(Exception):
    """A chunk is not what it says it is."""


def records(data: bytes) -> Iterator[McapRecord]:
    """Every record, those inside of chunks too. Raises anything where the file is damaged.

    Checksums are verified, and a chunk cannot unpack to more than it announces.
    """
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader, breakup_chunk

    reader = StreamReader(
        binary_io.BytesIO(data),
        emit_chunks=True,
        validate_crcs=True,
        record_size_limit=len(data),
    )
    unpacked = 0
    for record in reader.records:
        if not isinstance(record, Chunk):
            yield record
            continue
        unpacked += record.uncompressed_size
        if record.uncompressed_size > _MOST_CHUNK_BYTES or unpacked > _MOST_BYTES:
            raise DamagedError("too large")
        record.data, record.compression = _unpacked(record), ""
        yield from breakup_chunk(record, validate_crc=True)


def readable_records(data: bytes) -> Iterator[McapRecord]:
    """Every record up to the end, or up to where the file was cut or damaged."""
    found = records(data)
    while True:
        try:
            record = next(found, None)
        except Exception:  # cut or damaged: whatever the library makes of it
            return
        if record is None:
            return
        yield record


def _unpacked(chunk: Chunk) -> bytes:
    """What is inside; stops as soon as there is more than the chunk announces."""
    size = chunk.uncompressed_size
    data: bytes
    if chunk.compression == "zstd":
        import zstandard

        unpacker = zstandard.ZstdDecompressor(max_window_size=_MOST_CHUNK_BYTES)
        data = unpacker.stream_reader(chunk.data).read(size + 1)
    elif chunk.compression == "lz4":
        import lz4.frame  # type: ignore[import-untyped]

        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    elif not chunk.compression:
        data = chunk.data
    else:
        raise DamagedError(f"unknown compression {chunk.compression[:20]!r}")
    if len(data) != size:
        raise DamagedError("a chunk of another size than announced")
    if data[:1] == b"\0":
        raise DamagedError("zeros instead of records")
    return data
