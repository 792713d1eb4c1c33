"""CANopen (CiA 301) by ``canopen`` and ``python-can``: SDO, PDO, SYNC, NMT, heartbeat, EMCY.

One thread: messages are taken off the bus where they are waited for. So is the heartbeat of this
computer sent, by the control loop itself; a loop that hangs is silent, and the drives stop.
"""

from __future__ import annotations

import contextlib
import math
import struct
from collections.abc import Callable, Sequence
from typing import Any

import can
import canopen
from canopen.sdo.client import SdoClient
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from cdprcal.hardware.backend import BackendError
from cdprcal.hardware.drives.bus_lock import BusLock
from cdprcal.hardware.drives.fieldbus import NO_SUCH_OBJECT, Clock, in_a_line, node_name
from cdprcal.hardware.drives.process_data import (
    Entry,
    Image,
    Layout,
    Values,
    pack,
    split_into_pdos,
    unpack,
)
from cdprcal.hardware.session import CanopenBus, Session

_SDO_TIMEOUT_S = 0.5
#: Share of the cycle in which the answers to SYNC must come; the rest is for the next command.
_ANSWER_SHARE = 0.6
HEARTBEATS_MISSED = 2.5  #: in a row, of a node, are a stop
_OFF = 1 << 31  # bit of a PDO's COB-ID: not used
_OPERATIONAL = 5
_STATES = {0: "restarted", 4: "stopped", 5: "operational", 127: "pre-operational"}

_LISTEN_S = 0.5  # for another master: several cycles of the slowest
_NMT, _SYNC, _SDO, _HEARTBEAT = 0x000, 0x080, 0x600, 0x700
#: COB-IDs of the predefined connection set, of PDO 1 to 4.
_TPDO = (0x180, 0x280, 0x380, 0x480)
_RPDO = (0x200, 0x300, 0x400, 0x500)


class RefusedError(BackendError):
    """A node answers that it will not."""


class NoSuchObjectError(RefusedError):
    """A node's dictionary does not have an object."""


class _PumpedSdo(SdoClient):
    """An SDO client that takes messages off the bus itself while it waits."""

    RESPONSE_TIMEOUT = 0.0
    MAX_RETRIES = 1

    def __init__(self, node: int, await_: Callable[[Callable[[], bool]], None]) -> None:
        dictionary = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
        super().__init__(_SDO + node, 0x580 + node, dictionary)  # type: ignore[no-untyped-call]
        self._await = await_

    def read_response(self) -> Any:
        self._await(lambda: not self.responses.empty())
        return super().read_response()  # type: ignore[no-untyped-call]


class _Node:
    """What is known of one node."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.outputs = split_into_pdos(layout.outputs)
        self.inputs = split_into_pdos(layout.inputs)
        self.fresh: list[Values | None] = [None] * len(self.inputs)
        self.heard_s: float  # since it was started
        self.lost = False


class CanopenFieldbus:
    """The nodes of a session on a CAN bus. Raises BackendError when the bus cannot be opened."""

    def __init__(self, session: Session, clock: Clock, bus: can.BusABC | None = None) -> None:
        if not isinstance(session.bus, CanopenBus):
            raise TypeError("session.bus must be canopen")
        self._session = session
        self._settings = session.bus
        self._clock = clock
        self._lock = BusLock(session.bus)
        try:
            self._bus: can.BusABC | None = bus or open_can_bus(session.bus)
        except BaseException:
            self._lock.release()
            raise
        # Without connect(): its thread would receive behind the control loop's back.
        self._network = canopen.Network(self._bus)
        self._sdo: dict[int, SdoClient] = {}
        self._nodes: dict[int, _Node] = {}
        self._faults: list[str] = []
        self._abandoned = False
        try:
            self._hear_others()
        except BaseException:
            self.close()
            raise

    def _hear_others(self) -> None:
        """Raises BackendError when another master speaks on the bus, before this one does."""
        nodes = {winch.node for winch in self._session.winches}
        others = {_NMT, _SYNC, _HEARTBEAT + self._settings.master_node}
        others |= {base + node for base in (*_RPDO, _SDO) for node in nodes}
        here = self._settings.interface == "virtual" and self._session.is_simulated
        until_s = self._clock.now_s() + (0.0 if here else _LISTEN_S)
        while (message := self._received(until_s)) is not None:
            if message.arbitration_id in others and not message.is_error_frame:
                raise BackendError(
                    f"CAN bus {self._settings.channel}: another master speaks there "
                    f"(0x{message.arbitration_id:03X}); end it first"
                )
            if self._clock.now_s() >= until_s:
                return

    # --- objects ---------------------------------------------------------------------------------

    def sdo_read(self, node: int, index: int, subindex: int) -> bytes:
        def read(client: SdoClient) -> bytes:
            return bytes(client.upload(index, subindex))

        return self._transfer(node, index, subindex, "read", read)

    def sdo_write(self, node: int, index: int, subindex: int, data: bytes) -> None:
        def write(client: SdoClient) -> bytes:
            client.download(index, subindex, data)
            return b""

        self._transfer(node, index, subindex, "write", write)

    def _transfer(
        self, node: int, index: int, subindex: int, verb: str, call: Callable[[SdoClient], bytes]
    ) -> bytes:
        place = f"{self._name(node)}: {verb} of 0x{index:04X}:{subindex:02X}"
        try:
            return call(self._client(node))
        except SdoAbortedError as error:
            kind = NoSuchObjectError if error.code in NO_SUCH_OBJECT else RefusedError
            raise kind(f"{place} refused: {str(error).lower()}") from None
        except SdoCommunicationError:
            raise BackendError(
                f"{place}: no answer; check its power, its node number and the wiring of the bus"
            ) from None
        except (can.CanError, OSError, struct.error) as error:
            raise BackendError(f"{place}: {error}; look it up in its manual") from None

    def _client(self, node: int) -> SdoClient:
        if node not in self._sdo:
            client = _PumpedSdo(node, self._await_response)
            client.network = self._network
            self._network.subscribe(client.tx_cobid, client.on_response)
            self._sdo[node] = client
        return self._sdo[node]

    def _await_response(self, came: Callable[[], bool]) -> None:
        self._pump(came, self._clock.now_s() + _SDO_TIMEOUT_S)

    # --- start -----------------------------------------------------------------------------------

    def configure(self, layouts: Sequence[Layout], *, outputs: bool) -> None:
        for layout in layouts:
            self._nmt(layout.node, 128)  # pre-operational: PDOs may be changed
        for layout in layouts:
            node = _Node(layout)
            self._map(node, outputs)
            if not outputs:
                node.outputs = []
            period_ms = round(1e3 * self._session.safety.heartbeat_s)
            self.sdo_write(layout.node, 0x1017, 0, period_ms.to_bytes(2, "little"))
            self._nodes[layout.node] = node
            self._network.subscribe(0x80 + layout.node, self._on_emcy)
            self._network.subscribe(_HEARTBEAT + layout.node, self._on_heartbeat)
            for number in range(len(node.inputs)):
                self._network.subscribe(_TPDO[number] + layout.node, self._on_tpdo)
        for layout in layouts:
            self._nmt(layout.node, 1)
            self._nodes[layout.node].heard_s = self._clock.now_s()
        self._faults.clear()

    def _map(self, node: _Node, outputs: bool) -> None:
        name = self._name(node.layout.node)
        if len(node.inputs) > len(_TPDO) or len(node.outputs) > len(_RPDO):
            raise BackendError(
                f"{name}: has more process data than four PDOs hold; take some out of the session"
            )
        at_once = 255 if self._settings.outputs == "at_once" else 1
        for number in range(len(_TPDO)):
            entries = node.inputs[number] if number < len(node.inputs) else []
            self._map_pdo(node, 0x1800 + number, 0x1A00 + number, _TPDO[number], 1, entries)
            entries = node.outputs[number] if outputs and number < len(node.outputs) else []
            self._map_pdo(node, 0x1400 + number, 0x1600 + number, _RPDO[number], at_once, entries)

    def _map_pdo(
        self, node: _Node, setting: int, mapping: int, base: int, kind: int, entries: list[Entry]
    ) -> None:
        """CiA 301 §7.5.2.36: invalid, empty, filled, counted, valid. Empty ones stay invalid."""
        number = node.layout.node
        cob = base + number

        def write(index: int, subindex: int, value: int, size: int) -> None:
            self.sdo_write(number, index, subindex, value.to_bytes(size, "little"))

        try:
            write(setting, 1, cob | _OFF, 4)
        except NoSuchObjectError:
            if entries:
                raise
            return  # a node need not have four PDOs
        if not entries:
            return
        write(setting, 2, kind, 1)
        write(mapping, 0, 0, 1)
        for at, entry in enumerate(entries, start=1):
            write(mapping, at, entry.mapping, 4)
        write(mapping, 0, len(entries), 1)
        write(setting, 1, cob, 4)

    def watch_us(self, *, on: bool) -> list[int]:
        consumer = self._settings.master_node << 16 | self.watch_ms if on else 0
        without_timer = []
        for number, node in self._nodes.items():
            if not node.outputs:
                continue
            if not self._set(number, 0x1016, 1, consumer, 4):
                raise BackendError(
                    f"{self._name(number)}: does not keep what its heartbeat consumer (0x1016:01) "
                    "is told; look it up in its manual"
                )
            # Commands that stay away while the heartbeat comes: the event timer of the PDO.
            timer = self.watch_ms if on else 0
            kept = [self._timer(number, 0x1400 + at, timer) for at in range(len(node.outputs))]
            if not all(kept):
                without_timer.append(number)
        return without_timer

    def _timer(self, node: int, setting: int, time_ms: int) -> bool:
        try:
            return self._set(node, setting, 5, time_ms, 2)
        except RefusedError:
            return False

    def _set(self, node: int, index: int, subindex: int, value: int, size: int) -> bool:
        """Writes an object; whether it reads so afterwards."""
        data = value.to_bytes(size, "little")
        self.sdo_write(node, index, subindex, data)
        return self.sdo_read(node, index, subindex)[:size] == data

    @property
    def watch_ms(self) -> int:
        """How long this computer may be silent until the drives stop by themselves."""
        cycles = self._session.safety.missed_cycles + 1
        return math.ceil(1e3 * cycles * self._session.period_s)

    # --- cycle -----------------------------------------------------------------------------------

    def exchange(self, outputs: Image) -> Image:
        began_s = self._clock.now_s()
        # What comes too late for its cycle must not pass for an answer in the next.
        while (late := self._received()) is not None:
            self._take(late)
        for node in self._nodes.values():
            node.fresh = [None] * len(node.inputs)
        if not self._abandoned:
            self.send(outputs)
            self._send(_HEARTBEAT + self._settings.master_node, bytes([_OPERATIONAL]))
        self._send(_SYNC, b"")
        self._pump(self._all_fresh, began_s + _ANSWER_SHARE * self._session.period_s)
        self._judge_heartbeats()
        image: dict[int, Values] = {}
        for number, node in self._nodes.items():
            values: Values = {}
            for part in node.fresh:
                if part is None:
                    break
                values |= part
            else:
                image[number] = values
        return image

    def send(self, outputs: Image) -> None:
        for number, values in outputs.items():
            for at, entries in enumerate(self._nodes[number].outputs):
                self._send(_RPDO[at] + number, pack(entries, values))

    def abandon(self) -> None:
        if self._abandoned:
            return
        self._abandoned = True
        for number, node in self._nodes.items():
            if node.outputs:
                self._nmt(number, 2)

    def faults(self) -> list[str]:
        faults, self._faults = self._faults, []
        return faults

    def close(self, *, stop: bool = True) -> None:
        self._lock.release()
        bus, self._bus = self._bus, None
        if bus is None:
            return
        try:
            if stop:
                for number in self._nodes:
                    self._nmt(number, 128)
        except BackendError:
            pass  # the bus is gone: the drives miss the heartbeat
        with contextlib.suppress(can.CanError, OSError):
            bus.shutdown()

    def _all_fresh(self) -> bool:
        return all(part is not None for node in self._nodes.values() for part in node.fresh)

    def _judge_heartbeats(self) -> None:
        limit_s = HEARTBEATS_MISSED * self._session.safety.heartbeat_s
        for number, node in self._nodes.items():
            if not node.lost and self._clock.now_s() - node.heard_s > limit_s:
                node.lost = True
                self._faults.append(f"{self._name(number)}: its heartbeat is lost")

    # --- messages --------------------------------------------------------------------------------

    def _pump(self, done: Callable[[], bool], until_s: float) -> None:
        """Takes messages off the bus until ``done`` or the time is over."""
        while not done() and (message := self._received(until_s)) is not None:
            self._take(message)

    def _received(self, until_s: float | None = None) -> can.Message | None:
        """The next message; without ``until_s`` only if it is there already."""
        if self._bus is None:
            raise BackendError("the bus is closed; connect again")
        try:
            if until_s is None:
                return self._bus.recv(0.0)
            return self._clock.receive(self._bus, until_s)
        except (can.CanError, OSError) as error:
            raise _bus_error(error) from None

    def _take(self, message: can.Message) -> None:
        if message.is_error_frame:
            self._faults.append("CAN bus: error frame; look at cables, termination and bit rate")
        elif not message.is_remote_frame and not message.is_extended_id:
            data = bytearray(message.data)
            try:
                self._network.notify(message.arbitration_id, data, message.timestamp)
            except (struct.error, IndexError, ValueError):
                self._faults.append(f"CAN bus: 0x{message.arbitration_id:03X} is malformed")

    def _on_tpdo(self, can_id: int, data: bytearray, timestamp: float) -> None:
        number, at = can_id & 0x7F, _TPDO.index(can_id & 0x780)
        node = self._nodes[number]
        values = unpack(node.inputs[at], bytes(data))
        if values is None:
            self._faults.append(f"{self._name(number)}: TPDO {at + 1} has {len(data)} bytes")
        else:
            node.fresh[at] = values

    def _on_emcy(self, can_id: int, data: bytearray, timestamp: float) -> None:
        code, register = struct.unpack_from("<HB", data)
        if code & 0xFF00 and not self._abandoned:
            self._faults.append(
                f"{self._name(can_id & 0x7F)}: EMCY 0x{code:04X}, error register 0x{register:02X}"
            )

    def _on_heartbeat(self, can_id: int, data: bytearray, timestamp: float) -> None:
        number = can_id & 0x7F
        state = data[0] & 0x7F
        self._nodes[number].heard_s = self._clock.now_s()
        if state != _OPERATIONAL and not self._abandoned:
            what = _STATES.get(state, f"in NMT state {state}")
            self._faults.append(f"{self._name(number)}: is {what}")

    def _nmt(self, node: int, command: int) -> None:
        self._send(_NMT, bytes([command, node]))

    def _send(self, can_id: int, data: bytes) -> None:
        try:
            self._network.send_message(can_id, data)
        except (can.CanError, OSError) as error:
            raise _bus_error(error) from None

    def _name(self, node: int) -> str:
        return node_name(self._session, node)


def _bus_error(error: Exception) -> BackendError:
    return BackendError(f"CAN bus: {error}; check that the interface is up and the bus terminated")


def open_can_bus(settings: CanopenBus) -> can.BusABC:
    """A bus by python-can. Raises BackendError."""
    options: dict[str, Any] = {"bitrate": settings.bitrate_bit_s}
    channel = settings.channel
    if settings.interface == "udp_multicast":
        options = {"hop_limit": 0}  # not beyond this machine
        # Sockets of one port hear all its groups: two busses at a time need two ports.
        group, _, port = channel.partition(":")
        if port.isdecimal():
            channel, options["port"] = group, int(port)
    elif settings.interface == "virtual":
        options = {}
    try:
        return can.Bus(interface=settings.interface, channel=channel, **options)
    except Exception as error:  # every interface fails in its own way
        raise BackendError(
            f"CAN bus {settings.interface} {settings.channel}: cannot be opened: "
            f"{in_a_line(error)}; check bus.interface and bus.channel, and that the interface is up"
        ) from None
