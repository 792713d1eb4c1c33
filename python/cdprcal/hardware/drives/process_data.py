"""What goes to and fro every cycle: integer objects, packed into PDOs, the same for every bus."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from cdprcal.hardware.drives import cia402
from cdprcal.hardware.session import Session, Winch
from cdprcal.hardware.session.objects import ObjectType, object_type, parse_object

Key = tuple[int, int]
#: Values of one node by object.
Values = dict[Key, int]
#: Values of all nodes; a node that did not answer in time is absent.
Image = Mapping[int, Values]

_PDO_BITS = 64


@dataclass(frozen=True)
class Entry:
    """An object in a PDO."""

    key: Key
    bits: int
    signed: bool

    @property
    def mapping(self) -> int:
        """As objects 0x1600 and 0x1A00 want it: index, subindex, bits."""
        return self.key[0] << 16 | self.key[1] << 8 | self.bits

    @property
    def range(self) -> tuple[int, int]:
        """Smallest and largest value."""
        return ObjectType(self.bits, self.signed).range


@dataclass(frozen=True)
class Layout:
    """The process data of one node: outputs to it, inputs from it."""

    node: int
    outputs: tuple[Entry, ...]
    inputs: tuple[Entry, ...]


#: To a drive. The mode goes along, so that it can be changed without a pause.
DRIVE_OUTPUTS = (
    Entry(cia402.CONTROLWORD, 16, False),
    Entry(cia402.MODE, 8, True),
    Entry(cia402.TARGET_VELOCITY, 32, True),
    Entry(cia402.TARGET_TORQUE, 16, True),
)
#: From a drive; then its sensors.
DRIVE_INPUTS = (
    Entry(cia402.STATUSWORD, 16, False),
    Entry(cia402.MODE_DISPLAY, 8, True),
    Entry(cia402.ERROR_CODE, 16, False),
    Entry(cia402.POSITION, 32, True),
)


#: From a drive with a torque section, beside its error code: there is room in its first PDO.
TORQUE_INPUT = Entry(cia402.TORQUE, 16, True)


def drive_inputs(winch: Winch) -> tuple[Entry, ...]:
    """What a drive sends of itself."""
    if winch.torque is None:
        return DRIVE_INPUTS
    return (*DRIVE_INPUTS[:-1], TORQUE_INPUT, DRIVE_INPUTS[-1])


def layouts(session: Session) -> list[Layout]:
    """The process data of all nodes of a session, winches first."""
    sensors: dict[int, list[Entry]] = {}
    for winch in session.winches:
        sensors.setdefault(winch.node, [])
        for node, entry in _sensor_entries(winch):
            if entry not in sensors.setdefault(node, []):
                sensors[node].append(entry)
    drives = {winch.node: drive_inputs(winch) for winch in session.winches}
    return [
        Layout(
            node,
            DRIVE_OUTPUTS if node in drives else (),
            (*drives.get(node, ()), *entries),
        )
        for node, entries in sensors.items()
    ]


def _sensor_entries(winch: Winch) -> Iterable[tuple[int, Entry]]:
    for sensor in (winch.load_cell, winch.swivel):
        if sensor is not None:
            kind = object_type(sensor.type)
            entry = Entry(parse_object(sensor.object), kind.bits, kind.signed)
            yield sensor.node or winch.node, entry


def split_into_pdos(entries: Sequence[Entry]) -> list[list[Entry]]:
    """Entries in order, as many in a PDO as fit."""
    pdos: list[list[Entry]] = []
    room = 0
    for entry in entries:
        if entry.bits > room:
            pdos.append([])
            room = _PDO_BITS
        pdos[-1].append(entry)
        room -= entry.bits
    return pdos


def pack(entries: Iterable[Entry], values: Mapping[Key, int]) -> bytes:
    """Little-endian bytes; a value beyond its type is cut to the nearest that fits."""
    data = b""
    for entry in entries:
        low, high = entry.range
        value = min(max(values[entry.key], low), high)
        data += value.to_bytes(entry.bits // 8, "little", signed=entry.signed)
    return data


def unpack(entries: Iterable[Entry], data: bytes) -> Values | None:
    """Values by object; None when the data is not as long as the entries."""
    values: Values = {}
    at = 0
    for entry in entries:
        size = entry.bits // 8
        values[entry.key] = int.from_bytes(data[at : at + size], "little", signed=entry.signed)
        at += size
    return values if at == len(data) else None
