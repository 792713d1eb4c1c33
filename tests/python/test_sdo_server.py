"""The SDO server of simulated nodes, by the bytes of CiA 301 §7.2.4."""

from __future__ import annotations

import struct

import pytest

from cdprcal.testing.simulated_devices.object_dictionary import (
    Object,
    ObjectDictionary,
    SdoServer,
)

NAME = b"a drive with a long name"


@pytest.fixture
def dictionary() -> ObjectDictionary:
    made = ObjectDictionary()
    made.add((0x6060, 0), -3, 1, writable=True)
    made.add((0x6064, 0), -100_000, 4)
    made.objects[0x1008, 0] = Object(NAME)
    return made


@pytest.fixture
def server(dictionary: ObjectDictionary) -> SdoServer:
    return SdoServer(dictionary)


def request(command: int, index: int, subindex: int = 0, data: bytes = b"") -> bytes:
    return struct.pack("<BHB", command, index, subindex) + data.ljust(4, b"\0")


def abort(answer: bytes | None) -> int:
    assert answer is not None
    assert answer[0] == 0x80
    return int.from_bytes(answer[4:], "little")


def test_short_objects_come_at_once(server: SdoServer) -> None:
    assert server.answer(request(0x40, 0x6064)) == request(
        0x43, 0x6064, 0, (-100_000).to_bytes(4, "little", signed=True)
    )
    assert server.answer(request(0x40, 0x6060)) == request(0x4F, 0x6060, 0, b"\xfd")


def test_long_objects_come_in_segments(server: SdoServer) -> None:
    begin = server.answer(request(0x40, 0x1008))
    assert begin == request(0x41, 0x1008, 0, len(NAME).to_bytes(4, "little"))
    read, toggle, last = b"", 0, False
    while not last:
        answer = server.answer(bytes([0x60 | toggle << 4]) + bytes(7))
        assert answer is not None
        assert answer[0] >> 5 == 0
        assert answer[0] >> 4 & 1 == toggle
        read += answer[1 : 8 - (answer[0] >> 1 & 7)]
        last, toggle = bool(answer[0] & 1), toggle ^ 1
    assert read == NAME


def test_a_segment_that_is_asked_for_again_is_refused(server: SdoServer) -> None:
    server.answer(request(0x40, 0x1008))
    assert server.answer(bytes([0x60]) + bytes(7)) is not None
    assert abort(server.answer(bytes([0x60]) + bytes(7))) == 0x05030000  # toggle not alternated


def test_writing(dictionary: ObjectDictionary, server: SdoServer) -> None:
    written: list[int] = []
    dictionary.objects[0x6060, 0].on_write = lambda: written.append(dictionary.get((0x6060, 0)))
    assert server.answer(request(0x2F, 0x6060, 0, b"\x09")) == request(0x60, 0x6060)
    assert written == [9]
    assert dictionary.get((0x6060, 0), signed=True) == 9
    dictionary.set((0x6060, 0), -2)
    assert dictionary.get((0x6060, 0), signed=True) == -2


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        (request(0x40, 0x7777), 0x06020000),  # no such object
        (request(0x2F, 0x7777, 0, b"\x09"), 0x06020000),
        (request(0x23, 0x6064, 0, b"\x09"), 0x06010002),  # read only
        (request(0x23, 0x6060, 0, b"\x09"), 0x06070010),  # four bytes for one
        (request(0x22, 0x6060, 0, b"\x09"), 0x06070010),  # without a size: four
        (request(0x21, 0x6060, 0, b"\x09"), 0x06070010),  # segmented
        (request(0xC0, 0x6060), 0x05040001),  # block transfer is not known here
    ],
)
def test_what_cannot_be_is_aborted(
    dictionary: ObjectDictionary, server: SdoServer, asked: bytes, code: int
) -> None:
    answer = server.answer(asked)
    assert abort(answer) == code
    assert answer is not None
    assert answer[1:4] == asked[1:4]
    assert dictionary.get((0x6060, 0), signed=True) == -3


def test_what_needs_no_answer_gets_none(server: SdoServer) -> None:
    assert server.answer(request(0x80, 0x6060)) is None  # the client's own abort
    assert server.answer(b"\x40\x60") is None
