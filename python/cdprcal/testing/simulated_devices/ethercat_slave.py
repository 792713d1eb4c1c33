"""The EtherCAT half of a simulated drive: a slave controller's registers, EEPROM, mailbox, FMMUs.

What ETG.1000 asks of a slave with CoE and without distributed clocks, as far as a master uses it.
"""

from __future__ import annotations

import struct

from cdprcal.testing.simulated_devices.drive import SimulatedDrive
from cdprcal.testing.simulated_devices.object_dictionary import Key, SdoServer

ETHERTYPE = 0x88A4
# Commands of a datagram.
_NOP, _APRD, _APWR, _APRW, _FPRD, _FPWR, _FPRW, _BRD, _BWR, _BRW, _LRD, _LWR, _LRW = range(13)
# Registers.
_STATION, _DL_STATUS, _AL_CONTROL, _AL_STATUS, _AL_CODE = 0x10, 0x110, 0x120, 0x130, 0x134
_WATCHDOG_DIVIDER, _WATCHDOG_TIME = 0x400, 0x420
_EEPROM_CONTROL, _EEPROM_ADDRESS, _EEPROM_DATA = 0x502, 0x504, 0x508
_FMMU, _SM = 0x600, 0x800
_SM_STATUS = 5  # of a sync manager's eight bytes
_MAILBOX_FULL = 0x08

_PRE_OPERATIONAL, _SAFE_OPERATIONAL, _OPERATIONAL = 2, 4, 8
_ERROR = 0x10
_WATCHDOG_EXPIRED = 0x001B

_RECEIVE, _SEND, _MAILBOX_SIZE = 0x1000, 0x1080, 0x80
_OUTPUTS, _INPUTS = 0x1100, 0x1180
_COE, _EMERGENCY, _SDO_REQUEST, _SDO_RESPONSE = 3, 1, 2, 3


class EthercatSlave:
    """One slave of a segment. last: nobody is behind it."""

    def __init__(self, drive: SimulatedDrive, *, last: bool) -> None:
        self.drive = drive
        self._memory = bytearray(0x2000)
        self._put(0x0000, 0x11, 1)  # type of controller
        self._put(0x0004, 8, 1)  # FMMUs
        self._put(0x0005, 8, 1)  # sync managers
        self._put(_DL_STATUS, 0x0200 if last else 0x0A00, 2)  # ports with somebody behind
        self._put(_AL_STATUS, 1, 2)
        self._put(_WATCHDOG_DIVIDER, 2498, 2)
        self._put(_WATCHDOG_TIME, 1000, 2)
        self._eeprom = _eeprom(drive)
        self._sdo = SdoServer(drive.dictionary)
        self._counter = 0
        self._now_s = self._written_s = 0.0
        dictionary = drive.dictionary
        for at, kind in enumerate((1, 2, 3, 4), start=1):  # sync managers: mailboxes, outputs, ins
            dictionary.add((0x1C00, at), kind, 1)
        dictionary.add((0x1C00, 0), 4, 1)
        for assignment, mapping in ((0x1C12, 0x1600), (0x1C13, 0x1A00)):
            dictionary.add((assignment, 0), 0, 1, writable=True)
            dictionary.add((assignment, 1), 0, 2, writable=True)
            dictionary.add((mapping, 0), 0, 1, writable=True)
            for at in range(1, 17):
                dictionary.add((mapping, at), 0, 4, writable=True)

    @property
    def operational(self) -> bool:
        """Whether it takes outputs."""
        return self._state == _OPERATIONAL

    @property
    def listens(self) -> bool:
        """Whether outputs are mapped."""
        return bool(self._mapped(0x1C12))

    def refresh_inputs(self) -> None:
        """Puts the drive's objects where the next frame reads them."""
        dictionary = self.drive.dictionary
        data = b"".join(dictionary.objects[key].data[:size] for key, size in self._mapped(0x1C13))
        self._memory[_INPUTS : _INPUTS + len(data)] = data

    def advance(self, now_s: float) -> None:
        """Time goes on: the watchdog of the process data."""
        self._now_s = now_s
        unit_s = (self._get(_WATCHDOG_DIVIDER, 2) + 2) * 40e-9
        limit_s = unit_s * self._get(_WATCHDOG_TIME, 2)
        if self.operational and limit_s and now_s - self._written_s >= limit_s - 1e-9:
            self._put(_AL_STATUS, _SAFE_OPERATIONAL | _ERROR, 2)
            self._put(_AL_CODE, _WATCHDOG_EXPIRED, 2)
            self.drive.connection_lost()

    # --- datagrams -------------------------------------------------------------------------------

    def datagram(self, command: int, address: bytes, data: bytearray) -> tuple[bytes, int]:
        """What it makes of a datagram: (address, how much the working counter grows)."""
        if _LRD <= command <= _LRW:
            return address, self._logical(command, int.from_bytes(address, "little"), data)
        node, register = struct.unpack("<HH", address)
        mine = True
        if command in (_APRD, _APWR, _APRW):
            mine = node == 0
            address = struct.pack("<HH", (node + 1) & 0xFFFF, register)
        elif command in (_FPRD, _FPWR, _FPRW):
            mine = node == self._get(_STATION, 2)
        elif command in (_BRD, _BWR, _BRW):
            address = struct.pack("<HH", (node + 1) & 0xFFFF, register)
        else:
            mine = False
        if not mine:
            return address, 0
        count = 0
        before = bytes(data)
        if command in (_APRD, _APRW, _FPRD, _FPRW, _BRD, _BRW):
            here = self._read(register, len(data))
            broadcast = command in (_BRD, _BRW)
            data[:] = bytes(a | b for a, b in zip(data, here, strict=True)) if broadcast else here
            count += 1
        if command in (_APWR, _APRW, _FPWR, _FPRW, _BWR, _BRW):
            self._write(register, before)
            count += 1 if command in (_APWR, _FPWR, _BWR) else 2
        return address, count

    def _logical(self, command: int, address: int, data: bytearray) -> int:
        count = 0
        for at in range(8):
            entry = self._memory[_FMMU + 16 * at : _FMMU + 16 * at + 16]
            start, size, _, _, physical, _, kind, active = struct.unpack("<IHBBHBBB", entry[:13])
            low, high = max(start, address), min(start + size, address + len(data))
            if not active & 1 or low >= high:
                continue
            here, there = physical + low - start, low - address
            if kind & 2 and command in (_LWR, _LRW) and self.operational:
                self._memory[here : here + high - low] = data[there : there + high - low]
                self._take_outputs()
                count += 2 if command == _LRW else 1
            if kind & 1 and command in (_LRD, _LRW) and self._state >= _SAFE_OPERATIONAL:
                data[there : there + high - low] = self._memory[here : here + high - low]
                count += 1
        return count

    def _take_outputs(self) -> None:
        at = _OUTPUTS
        for key, size in self._mapped(0x1C12):
            self.drive.dictionary.write(key, bytes(self._memory[at : at + size]))
            at += size
        self._written_s = self._now_s

    # --- registers -------------------------------------------------------------------------------

    @property
    def _state(self) -> int:
        return self._get(_AL_STATUS, 2) & 0x0F

    def _get(self, register: int, size: int) -> int:
        return int.from_bytes(self._memory[register : register + size], "little")

    def _put(self, register: int, value: int, size: int) -> None:
        self._memory[register : register + size] = value.to_bytes(size, "little")

    def _read(self, register: int, size: int) -> bytes:
        data = bytes(self._memory[register : register + size]).ljust(size, b"\0")
        if register <= _SEND + _MAILBOX_SIZE - 1 < register + size:  # its last byte was taken
            self._memory[_SM + 8 + _SM_STATUS] &= ~_MAILBOX_FULL & 0xFF
        return data

    def _write(self, register: int, data: bytes) -> None:
        self._memory[register : register + len(data)] = data
        end = register + len(data)
        if register <= _AL_CONTROL < end:
            self._control(self._get(_AL_CONTROL, 2))
        elif register <= _EEPROM_CONTROL < end:
            self._read_eeprom()
        elif register <= _RECEIVE + _MAILBOX_SIZE - 1 < end:
            self._answer(bytes(self._memory[_RECEIVE : _RECEIVE + _MAILBOX_SIZE]))

    def _control(self, word: int) -> None:
        wanted, now = word & 0x0F, self._state
        if wanted == now or wanted in (1, 2, 4, 8):
            if now == _OPERATIONAL != wanted:
                self.drive.connection_lost()
            self._put(_AL_STATUS, wanted, 2)
            self._put(_AL_CODE, 0, 2)
            self._written_s = self._now_s

    def _read_eeprom(self) -> None:
        if self._get(_EEPROM_CONTROL, 2) & 0x0700 == 0x0100:
            at = 2 * self._get(_EEPROM_ADDRESS, 2)
            self._memory[_EEPROM_DATA : _EEPROM_DATA + 4] = self._eeprom[at : at + 4].ljust(
                4, b"\xff"
            )
        self._put(_EEPROM_CONTROL, 0, 2)

    def _answer(self, mail: bytes) -> None:
        size, _, _, kind = struct.unpack_from("<HHBB", mail)
        service = struct.unpack_from("<H", mail, 6)[0] >> 12
        if kind & 0x0F != _COE or service != _SDO_REQUEST or size < 10:
            return
        answer = self._sdo.answer(mail[8:16])
        if answer is None:
            return
        if answer[0] == 0x41:  # all at once: a mailbox has room
            index, subindex = struct.unpack_from("<HB", answer, 1)
            answer += self.drive.dictionary.objects[(index, subindex)].data
        self._mail(_SDO_RESPONSE, answer)

    def emergency(self, code: int) -> None:
        """Puts an EMCY where the master reads its mail."""
        register = self.drive.dictionary.get((0x1001, 0)) | 1
        self._mail(_EMERGENCY, struct.pack("<HB5x", code, register))

    def _mail(self, service: int, content: bytes) -> None:
        self._counter = self._counter % 7 + 1
        body = struct.pack("<H", service << 12) + content
        head = struct.pack("<HHBB", len(body), 0, 0, self._counter << 4 | _COE)
        self._memory[_SEND : _SEND + _MAILBOX_SIZE] = (head + body).ljust(_MAILBOX_SIZE, b"\0")
        self._memory[_SM + 8 + _SM_STATUS] |= _MAILBOX_FULL

    def _mapped(self, assignment: int) -> list[tuple[Key, int]]:
        """(object, bytes) of the entries that are assigned."""
        dictionary = self.drive.dictionary
        numbers = range(1, dictionary.get((assignment, 0)) + 1)
        mappings = [dictionary.get((assignment, number)) for number in numbers]
        return [entry for mapping in mappings for entry in dictionary.mapped(mapping)]


def process_frame(slaves: list[EthercatSlave], frame: bytes) -> bytes:
    """A frame on its way through all slaves."""
    out = bytearray(frame)
    at, more = 16, True
    while more:
        command = out[at]
        size_and_flags = struct.unpack_from("<H", out, at + 6)[0]
        size, more = size_and_flags & 0x07FF, bool(size_and_flags & 0x8000)
        data = out[at + 10 : at + 10 + size]
        address = bytes(out[at + 2 : at + 6])
        counter = struct.unpack_from("<H", out, at + 10 + size)[0]
        for slave in slaves:
            address, grown = slave.datagram(command, address, data)
            counter += grown
        out[at + 2 : at + 6] = address
        out[at + 10 : at + 10 + size] = data
        struct.pack_into("<H", out, at + 10 + size, counter & 0xFFFF)
        at += 12 + size
    out[6] |= 0x02  # a processed frame has a local source address
    return bytes(out)


def _eeprom(drive: SimulatedDrive) -> bytes:
    """Slave information (ETG.2010): identity, mailboxes, categories."""
    words = bytearray(0x80)
    identity = [drive.dictionary.get((0x1018, subindex)) for subindex in (1, 2, 3, 4)]
    struct.pack_into("<IIII", words, 0x10, *identity)
    struct.pack_into("<HHHH", words, 0x30, _RECEIVE, _MAILBOX_SIZE, _SEND, _MAILBOX_SIZE)
    struct.pack_into("<H", words, 0x38, 0x0004)  # CoE
    general = bytearray(32)
    general[5] = 0x0D  # CoE: SDO, PDO assignment and configuration
    managers = struct.pack("<HHBBBB", _RECEIVE, _MAILBOX_SIZE, 0x26, 0, 1, 1)
    managers += struct.pack("<HHBBBB", _SEND, _MAILBOX_SIZE, 0x22, 0, 1, 2)
    managers += struct.pack("<HHBBBB", _OUTPUTS, 0, 0x64, 0, 0, 3)
    managers += struct.pack("<HHBBBB", _INPUTS, 0, 0x20, 0, 0, 4)
    categories = b""
    for kind, content in ((30, bytes(general)), (40, b"\1\2\3\0"), (41, managers)):
        categories += struct.pack("<HH", kind, len(content) // 2) + content
    return bytes(words) + categories + b"\xff\xff"
