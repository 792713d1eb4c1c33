"""Records of an MCAP file, as far as the file goes."""

from __future__ import annotations

import io as binary_io
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mcap.records import McapRecord


def readable_records(data: bytes) -> Iterator[McapRecord]:
    """Every record up to the end, or up to where the file was cut or damaged."""
    from mcap.stream_reader import StreamReader

    records = iter(StreamReader(binary_io.BytesIO(data), record_size_limit=len(data)).records)
    while True:
        try:
            record = next(records, None)
        except Exception:  # cut or damaged: whatever the library makes of it
            return
        if record is None:
            return
        yield record
