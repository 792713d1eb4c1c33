"""Frames of the Xsens MT low-level protocol, and how to find them again after garbage.

FA FF MID LEN DATA CS        CS makes the sum from FF on a multiple of 256
FA FF MID FF LENH LENL DATA CS
"""

from __future__ import annotations

from typing import NamedTuple

_PREAMBLE, _BUS_ID = 0xFA, 0xFF
_HEAD = bytes((_PREAMBLE, _BUS_ID))
_EXTENDED = 0xFF
#: No message is longer; a length beyond is no frame.
_MOST_DATA = 2048


class Frame(NamedTuple):
    """A message: its identifier and data."""

    mid: int
    data: bytes


def encode(mid: int, data: bytes = b"") -> bytes:
    """The bytes of a frame. Raises ValueError when the data is too long."""
    if len(data) > _MOST_DATA:
        raise ValueError(f"a frame holds {_MOST_DATA} bytes, not {len(data)}")
    if len(data) < _EXTENDED:
        body = bytes((_BUS_ID, mid, len(data))) + data
    else:
        body = bytes((_BUS_ID, mid, _EXTENDED)) + len(data).to_bytes(2, "big") + data
    return bytes((_PREAMBLE,)) + body + bytes((-sum(body) & 0xFF,))


class FrameReader:
    """Takes bytes as they come, gives frames; whatever is none is skipped and counted.

    Behind a frame the next is waited for, however slowly it comes. After garbage nothing is: a
    head that may be chance must not hold back a whole frame behind it.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._in_step = True  # the buffer begins where a frame ended
        self.skipped = 0  #: bytes that belong to no frame

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that are complete now, in order."""
        buffer = self._buffer
        buffer += data
        frames: list[Frame] = []
        at = 0  # up to here all is settled
        look = 0  # from here a frame is looked for
        while True:
            start = buffer.find(_HEAD, look)
            if start < 0:
                break
            size = _frame_size(buffer, start)
            if size is None:  # not all of it is here yet
                if start == at and self._in_step:
                    break
                look = start + 1
                continue
            if size and not sum(buffer[start + 1 : start + size]) & 0xFF:
                data_at = start + (4 if buffer[start + 3] != _EXTENDED else 6)
                end = start + size
                frames.append(Frame(buffer[start + 2], bytes(buffer[data_at : end - 1])))
                self.skipped += start - at
                at = look = end
                self._in_step = True
            else:
                look = start + 1
                if start == at:
                    self._in_step = False
        keep = self._unsettled(at)
        self.skipped += keep - at
        del buffer[:keep]
        return frames

    def _unsettled(self, at: int) -> int:
        """Where what may still become a frame begins."""
        buffer = self._buffer
        look = at
        while (start := buffer.find(_PREAMBLE, look)) >= 0:
            rest = len(buffer) - start
            if rest == 1 or (buffer[start + 1] == _BUS_ID and _frame_size(buffer, start) is None):
                if start > at:
                    self._in_step = False
                return start
            look = start + 1
        if len(buffer) > at:
            self._in_step = False
        return len(buffer)


def _frame_size(buffer: bytearray, start: int) -> int | None:
    """Bytes of the frame that begins here; 0: none can; None: its end is not here yet."""
    left = len(buffer) - start
    if left < 4:
        return None
    length = buffer[start + 3]
    size = length + 5
    if length == _EXTENDED:
        if left < 6:
            return None
        length = buffer[start + 4] << 8 | buffer[start + 5]
        if not _EXTENDED <= length <= _MOST_DATA:
            return 0
        size = length + 7
    return size if size <= left else None
