"""The CANopen half of a simulated node: SDO server, PDOs, SYNC, NMT, heartbeats, EMCY.

Written on its own, beside ``canopen``, which speaks for the other end.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import Protocol

from cdprcal.testing.simulated_devices.drive import HEARTBEAT_ERROR, SimulatedDrive
from cdprcal.testing.simulated_devices.object_dictionary import (
    ObjectDictionary,
    SdoServer,
)

_OFF = 1 << 31
_PRE_OPERATIONAL, _OPERATIONAL, _STOPPED, _BOOT = 127, 5, 4, 0
_PDOS = 4
_PDO_LENGTH, _RPDO_TIMEOUT = 0x8210, 0x8250  # CiA 301 table 26


class Device(Protocol):
    """What is behind a node."""

    dictionary: ObjectDictionary

    @property
    def node(self) -> int:
        """Its number."""

    def connection_lost(self) -> None:
        """The master has fallen silent, or has left operation."""


class CanopenNode:
    """A device on the bus."""

    def __init__(self, device: Device, send: Callable[[int, bytes], None]) -> None:
        self.device = device
        self.id = device.node
        self.nmt_state = _PRE_OPERATIONAL
        self.send = send  #: puts a message (COB-ID, data) on the bus
        self._sdo = SdoServer(device.dictionary)
        self._now_s = 0.0
        self._beat_s = math.inf  # when its next heartbeat is due
        self._heard_s = math.nan  # when the master's last came
        self._rpdo_s = [math.nan] * _PDOS
        self._add_communication()

    def _add_communication(self) -> None:
        dictionary = self.device.dictionary
        dictionary.add((0x1016, 1), 0, 4, writable=True)
        dictionary.add((0x1017, 0), 0, 2, writable=True, on_write=self._set_heartbeat)
        for number in range(_PDOS):
            for base, mapping in ((0x1400, 0x1600), (0x1800, 0x1A00)):
                dictionary.add((base + number, 1), _OFF, 4, writable=True)
                dictionary.add((base + number, 2), 255, 1, writable=True)
                dictionary.add((base + number, 5), 0, 2, writable=True)
                dictionary.add((mapping + number, 0), 0, 1, writable=True)
                for at in range(1, 9):
                    dictionary.add((mapping + number, at), 0, 4, writable=True)

    @property
    def listens(self) -> bool:
        """Whether it takes any PDO."""
        cobs = [self.device.dictionary.get((0x1400 + number, 1)) for number in range(_PDOS)]
        return any(not cob & _OFF for cob in cobs)

    def boot(self) -> None:
        """Power-on: the boot-up message."""
        self.nmt_state = _PRE_OPERATIONAL
        self.send(0x700 + self.id, bytes([_BOOT]))

    def receive(self, can_id: int, data: bytes) -> None:
        """A message on the bus; most are not for this node."""
        if can_id == 0:
            self._command(data)
        elif can_id == 0x600 + self.id and self.nmt_state != _STOPPED:
            if (answer := self._sdo.answer(data)) is not None:
                self.send(0x580 + self.id, answer)
        elif can_id == self._watched_id():
            self._heard_s = self._now_s
        elif self.nmt_state == _OPERATIONAL:
            self._take_rpdo(can_id, data)

    def sync(self) -> None:
        """Sends the PDOs that go with SYNC; sensors have been read."""
        if self.nmt_state != _OPERATIONAL:
            return
        dictionary = self.device.dictionary
        for number in range(_PDOS):
            cob = dictionary.get((0x1800 + number, 1))
            if not cob & _OFF and dictionary.get((0x1800 + number, 2)) == 1:
                keys = dictionary.mapped(0x1A00 + number)
                data = b"".join(dictionary.objects[key].data[:size] for key, size in keys)
                self.send(cob & 0x7FF, data)

    def advance(self, now_s: float) -> None:
        """Time goes on: heartbeats, and the watch on the master's."""
        self._now_s = now_s
        if now_s >= self._beat_s - 1e-9:
            self.send(0x700 + self.id, bytes([self.nmt_state]))
            self._beat_s += self._period_s()
        limit_s = 1e-3 * (self.device.dictionary.get((0x1016, 1)) & 0xFFFF)
        if limit_s and now_s - self._heard_s >= limit_s - 1e-9:
            self._heard_s = math.nan  # once
            self._lose_connection(HEARTBEAT_ERROR)
        for number, came_s in enumerate(self._rpdo_s):
            if (0x1400 + number, 5) not in self.device.dictionary.objects:
                continue
            limit_s = 1e-3 * self.device.dictionary.get((0x1400 + number, 5))
            if limit_s and now_s - came_s >= limit_s - 1e-9:
                self._rpdo_s[number] = math.nan
                self._lose_connection(_RPDO_TIMEOUT)

    def emergency(self, code: int) -> None:
        """Sends an EMCY."""
        register = self.device.dictionary.get((0x1001, 0)) | 1
        self.send(0x80 + self.id, struct.pack("<HB5x", code, register))

    def _lose_connection(self, code: int) -> None:
        self.emergency(code)
        self.device.connection_lost()

    def _watched_id(self) -> int:
        node = self.device.dictionary.get((0x1016, 1)) >> 16
        return 0x700 + node if node else -1

    def _period_s(self) -> float:
        return 1e-3 * self.device.dictionary.get((0x1017, 0))

    def _set_heartbeat(self) -> None:
        period_s = self._period_s()
        self._beat_s = self._now_s + period_s if period_s else math.inf

    def _command(self, data: bytes) -> None:
        if len(data) != 2 or data[1] not in (0, self.id):
            return
        states = {1: _OPERATIONAL, 2: _STOPPED, 128: _PRE_OPERATIONAL}
        if data[0] in states:
            leaves = self.nmt_state == _OPERATIONAL and data[0] != 1
            self.nmt_state = states[data[0]]
            if leaves:
                self.device.connection_lost()
        elif data[0] in (129, 130):
            self.device.connection_lost()
            self.boot()

    def _take_rpdo(self, can_id: int, data: bytes) -> None:
        dictionary = self.device.dictionary
        for number in range(_PDOS):
            if dictionary.get((0x1400 + number, 1)) != can_id:
                continue
            keys = dictionary.mapped(0x1600 + number)
            if len(data) < sum(size for _, size in keys):
                self.emergency(_PDO_LENGTH)
                return
            self._rpdo_s[number] = self._now_s
            at = 0
            for key, size in keys:
                dictionary.write(key, data[at : at + size])
                at += size


class DriveNode(CanopenNode):
    """A drive on the bus."""

    def __init__(self, drive: SimulatedDrive, send: Callable[[int, bytes], None]) -> None:
        super().__init__(drive, send)
        self.drive = drive
