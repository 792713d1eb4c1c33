"""Logs in MCAP: damage to the container, and to the JSON inside."""

from __future__ import annotations

import io
import json
import struct
from typing import Any

from malformed.case import Case, Change, cut, flip, only

MAGIC = b"\x89MCAP0\r\n"


def _written(*messages: Any, topic: str = "/cdprcal/sample", encoding: str = "json") -> bytes:
    """An MCAP file of these messages, JSON unless they are bytes."""
    from mcap.writer import Writer

    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=1 << 16)
    writer.start(profile="", library="cdprcal")
    schema = writer.register_schema("cdprcal.Sample", "jsonschema", b"{}")
    channel = writer.register_channel(topic, encoding, schema)
    for number, message in enumerate(messages):
        data = message if isinstance(message, bytes) else json.dumps(message).encode()
        writer.add_message(channel, number, data, number, number)
    writer.finish()  # type: ignore[no-untyped-call]
    return stream.getvalue()


def _of(name: str, *messages: Any, words: str, said: bool = False, **how: str) -> Case:
    return Case("mcap", name, lambda data: _written(*messages, **how), words, said=said)


def _mcap(name: str, change: Change, words: str, said: bool = False, big: bool = False) -> Case:
    return Case("mcap", name, change, words, said=said, big=big)


def _record(opcode: int, length: int, content: bytes = b"") -> bytes:
    return bytes([opcode]) + struct.pack("<Q", length) + content


def chunk(compression: bytes, size: int, records: bytes) -> bytes:
    """A chunk that says its records have ``size`` bytes when they are unpacked."""
    content = struct.pack("<QQQI", 0, 1, size, 0) + struct.pack("<I", len(compression))
    content += compression + struct.pack("<Q", len(records)) + records
    return MAGIC + _record(6, len(content), content)


def zeros_packed(kind: str) -> bytes:
    """A gigabyte of zeros in a hundred kilobytes or so."""
    if kind == "zstd":
        import zstandard

        packer = zstandard.ZstdCompressor().compressobj()
        parts = [packer.compress(bytes(1 << 20)) for _ in range(1024)] + [packer.flush()]
    else:
        import lz4.frame  # type: ignore[import-untyped]

        packer = lz4.frame.LZ4FrameCompressor()
        parts = [packer.begin()]
        parts += [packer.compress(bytes(1 << 20)) for _ in range(1024)] + [packer.flush()]
    return b"".join(parts)


def _zeros_compressed(kind: str) -> bytes:
    """A chunk of them."""
    return chunk(kind.encode(), 1 << 30, zeros_packed(kind))


GOOD = {"time_s": 0.0, "length_1_m": 1.0}
VALUES = {
    "text": ("1.5", "length_1_m: .*'1.5'"),
    "true": (True, "length_1_m: .*'True'"),
    "a list": ([1.5], "length_1_m: .*'\\[1.5\\]'"),
    "an object": ({"m": 1.5}, "length_1_m: "),
    "infinite": (float("inf"), "length_1_m: .*'inf'"),
    "a whole number of 400 digits": (10**400, "length_1_m"),
    "a whole number of 5,000 digits": (b'{"time_s": 1, "length_1_m": %s}' % (b"7" * 5000), "."),
}

CASES = (
    *(
        _of(
            f"a value is {name}",
            GOOD,
            value if isinstance(value, bytes) else {"time_s": 1.0, "length_1_m": value},
            words=f": message 2.*{words}",
        )
        for name, (value, words) in VALUES.items()
    ),
    _of("time is text", GOOD, {"time_s": "1", "length_1_m": 1}, words=": message 2.*time_s"),
    _of("time is NaN", GOOD, {"time_s": float("nan"), "length_1_m": 1}, words="message 2.*time_s"),
    _of("time is missing", GOOD, {"length_1_m": 1}, words=": message 2.*time_s: is missing"),
    _of("time is null", GOOD, {"time_s": None, "length_1_m": 1}, words=": message 2.*time_s"),
    _of("no columns", {"time_s": 0.0, "speed": 1}, words="no JSON messages with canonical"),
    _of("lengths in mm", {"time_s": 0.0, "length_1_mm": 1}, words="no JSON messages"),
    _of("no messages", words="no JSON messages"),
    _of("not JSON", GOOD, b"{'time_s': 1}", words=": message 2: is not JSON"),
    _of("JSON cut", GOOD, b'{"time_s": 1, "length_1', words=": message 2: is not JSON"),
    _of("JSON not UTF-8", GOOD, b'{"time_s": 1, "l\xff": 2}', words=": message 2: is not JSON"),
    _of("JSON nested deeply", GOOD, b"[" * 100_000, words=": message 2: is not JSON"),
    _of("lists instead of objects", [0.0, 1.0], [1.0, 1.0], words="no JSON messages"),
    _of("another encoding", GOOD, words="no JSON messages", encoding="cdr"),
    _mcap("the magic alone", only(MAGIC), "no JSON messages"),
    _mcap("half the magic", only(MAGIC[:5]), r":\d+: "),
    _mcap("cut in the header", lambda data: data[:20], "no JSON messages"),
    _mcap("cut in the first chunk", lambda data: data[:600], "no JSON messages"),
    _mcap("cut in the middle", cut(0.5), "the file ends in the middle", said=True),
    _mcap("cut in the footer", lambda data: data[:-20], "the file ends|truncated|$", said=True),
    _mcap("a bit in a chunk", flip(0.3), "the file is damaged|no JSON", said=True),
    _mcap("a bit in the first chunk", flip(0.03), "damaged|no JSON|UTF", said=True),
    _mcap("a record of 2^63 bytes", only(MAGIC + _record(1, 1 << 63)), "no JSON messages"),
    _mcap("a record of a terabyte", only(MAGIC + _record(5, 1 << 40, b"x")), "no JSON messages"),
    _mcap("unknown records", only(MAGIC + _record(200, 4, b"abcd") * 100), "no JSON messages"),
    _mcap("an unknown compression", only(chunk(b"rar", 10, b"0123456789")), "no JSON messages"),
    _mcap("zstd that is none", only(chunk(b"zstd", 10, b"0123456789")), "no JSON messages"),
    _mcap("zeros after the magic", only(MAGIC + bytes(10_000)), "no JSON messages"),
    _mcap(
        "a gigabyte in zstd",
        lambda data: _zeros_compressed("zstd"),
        "no JSON messages|large",
        big=True,
    ),
    _mcap(
        "a gigabyte in lz4",
        lambda data: _zeros_compressed("lz4"),
        "no JSON messages|large",
        big=True,
    ),
    _mcap("a chunk that says a terabyte", only(chunk(b"", 1 << 40, b"0123")), "no JSON messages"),
    _mcap(
        "a chunk that says a terabyte in zstd",
        only(chunk(b"zstd", 1 << 40, b"0123")),
        "no JSON messages",
    ),
)
