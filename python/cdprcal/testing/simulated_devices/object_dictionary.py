"""The object dictionary and SDO server (CiA 301 §7.2.4) of a simulated node."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

Key = tuple[int, int]

_ABORT_TOGGLE = 0x05030000
_ABORT_COMMAND = 0x05040001
_ABORT_READ_ONLY = 0x06010002
_ABORT_NO_OBJECT = 0x06020000
_ABORT_LENGTH = 0x06070010


@dataclass
class Object:
    """One entry, little-endian. on_write is called after it was written."""

    data: bytes
    writable: bool = False
    on_write: Callable[[], None] | None = None


class ObjectDictionary:
    """Entries by (index, subindex), with integers to read and write."""

    def __init__(self) -> None:
        self.objects: dict[Key, Object] = {}

    def add(
        self,
        key: Key,
        value: int,
        size: int,
        *,
        writable: bool = False,
        on_write: Callable[[], None] | None = None,
    ) -> None:
        """Adds an integer of ``size`` bytes."""
        data = (value & ((1 << 8 * size) - 1)).to_bytes(size, "little")
        self.objects[key] = Object(data, writable, on_write)

    def get(self, key: Key, *, signed: bool = False) -> int:
        """An integer."""
        return int.from_bytes(self.objects[key].data, "little", signed=signed)

    def set(self, key: Key, value: int) -> None:
        """Sets an integer, from within the device."""
        entry = self.objects[key]
        size = len(entry.data)
        entry.data = (value & ((1 << 8 * size) - 1)).to_bytes(size, "little")

    def mapped(self, mapping: int) -> list[tuple[Key, int]]:
        """(object, bytes) of the entries that a mapping of process data names."""
        entries = [self.get((mapping, at)) for at in range(1, self.get((mapping, 0)) + 1)]
        return [((e >> 16, e >> 8 & 0xFF), (e & 0xFF) // 8) for e in entries]

    def write(self, key: Key, data: bytes) -> int:
        """Writes from outside; an abort code, or 0."""
        entry = self.objects.get(key)
        if entry is None:
            return _ABORT_NO_OBJECT
        if not entry.writable:
            return _ABORT_READ_ONLY
        if len(data) != len(entry.data):
            return _ABORT_LENGTH
        entry.data = bytes(data)
        if entry.on_write is not None:
            entry.on_write()
        return 0


class SdoServer:
    """Answers SDO requests: expedited, and segmented for objects of more than four bytes."""

    def __init__(self, dictionary: ObjectDictionary) -> None:
        self._dictionary = dictionary
        self._left = b""  # of a segmented upload
        self._toggle = 0

    def answer(self, request: bytes) -> bytes | None:
        """The response to a request of eight bytes; None to what is none."""
        if len(request) != 8:
            return None
        command = request[0]
        index, subindex = struct.unpack_from("<HB", request, 1)
        kind = command >> 5
        if kind == 2:
            return self._upload((index, subindex))
        if kind == 3:
            return self._segment(command)
        if kind == 1:
            return self._download(command, (index, subindex), request[4:])
        if kind == 4:
            return None  # the client gave up
        return _abort((index, subindex), _ABORT_COMMAND)

    def _upload(self, key: Key) -> bytes:
        entry = self._dictionary.objects.get(key)
        if entry is None:
            return _abort(key, _ABORT_NO_OBJECT)
        size = len(entry.data)
        if size <= 4:
            head = struct.pack("<BHB", 0x43 | (4 - size) << 2, *key)
            return head + entry.data.ljust(4, b"\0")
        self._left, self._toggle = entry.data, 0
        return struct.pack("<BHBI", 0x41, *key, size)

    def _segment(self, command: int) -> bytes:
        if (command >> 4 & 1) != self._toggle:
            return _abort((0, 0), _ABORT_TOGGLE)
        part, self._left = self._left[:7], self._left[7:]
        head = self._toggle << 4 | (7 - len(part)) << 1 | (not self._left)
        self._toggle ^= 1
        return bytes([head]) + part.ljust(7, b"\0")

    def _download(self, command: int, key: Key, data: bytes) -> bytes:
        if not command & 0x02:  # no object here is longer than four bytes and writable
            return _abort(key, _ABORT_LENGTH)
        size = 4 - (command >> 2 & 3) if command & 0x01 else 4
        if code := self._dictionary.write(key, data[:size]):
            return _abort(key, code)
        return struct.pack("<BHBI", 0x60, *key, 0)


def _abort(key: Key, code: int) -> bytes:
    return struct.pack("<BHBI", 0x80, *key, code)
