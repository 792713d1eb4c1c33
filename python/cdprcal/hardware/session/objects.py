"""Entries of an object dictionary as a session file names them: ``0x2401:01``, ``int32``."""

from __future__ import annotations

import re
from typing import Literal, NamedTuple

#: Integer types that an object in a PDO can have.
IntegerType = Literal["int8", "uint8", "int16", "uint16", "int32", "uint32"]

_OBJECT = re.compile(r"0x([0-9a-fA-F]{1,4}):(?:0x)?([0-9a-fA-F]{1,2})")


class ObjectType(NamedTuple):
    """Width and sign of an integer object."""

    bits: int
    signed: bool

    @property
    def range(self) -> tuple[int, int]:
        """Smallest and largest value."""
        if self.signed:
            return -(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1
        return 0, (1 << self.bits) - 1


def object_type(name: IntegerType) -> ObjectType:
    """Width and sign by the type's name."""
    return ObjectType(int(name.lstrip("uint")), not name.startswith("u"))


def parse_object(text: str) -> tuple[int, int]:
    """(index, subindex) of ``0x2401:01``, both hexadecimal. Raises ValueError."""
    match = _OBJECT.fullmatch(text)
    if match is None:
        raise ValueError("write an object as 0xINDEX:SUBINDEX, both hexadecimal, as '0x2401:01'")
    return int(match[1], 16), int(match[2], 16)
