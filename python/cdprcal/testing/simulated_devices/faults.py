"""Faults of every kind of message and device, injected into a simulated robot at some moment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import can
import numpy as np

from cdprcal.testing.simulated_devices.canopen_node import DriveNode
from cdprcal.testing.simulated_devices.mti import SimulatedPort
from cdprcal.testing.simulated_devices.object_dictionary import Key

#: What becomes of a message: other data, or None, which is nothing.
Tamper = Callable[[int, bytes], bytes | None]


@dataclass
class Fault:
    """What goes wrong from ``begin_s`` on, by the clock of the control loop.

    to_nodes, from_nodes: what happens to messages (COB-ID, data) on their way. serial: to the bytes
    of the AHRS; it may raise OSError. happen: done once. build: done at power-on already.
    """

    name: str
    begin_s: float
    to_nodes: Tamper | None = None
    from_nodes: Tamper | None = None
    serial: Callable[[bytes], bytes] | None = None
    happen: Callable[[list[DriveNode]], None] | None = None
    build: Callable[[list[DriveNode]], None] | None = None
    began: bool = field(default=False, init=False)


class Can(Protocol):
    """A CAN bus, or one with a fault on it."""

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next message, if there is one in time."""

    def send(self, message: can.Message, /) -> None:
        """Sends a message."""

    def shutdown(self) -> None:
        """Leaves the bus."""


class FaultyCan:
    """The nodes' end of a CAN bus with a fault on it."""

    def __init__(self, bus: Can, fault: Fault, now_s: Callable[[], float]) -> None:
        self._bus = bus
        self._fault = fault
        self._now_s = now_s

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next message that gets through."""
        while (message := self._bus.recv(timeout)) is not None:
            if (passed := self._passed(message, self._fault.to_nodes)) is not None:
                return passed
        return None

    def send(self, message: can.Message) -> None:
        """Sends what gets through."""
        if (passed := self._passed(message, self._fault.from_nodes)) is not None:
            self._bus.send(passed)

    def shutdown(self) -> None:
        """Leaves the bus."""
        self._bus.shutdown()

    def _passed(self, message: can.Message, tamper: Tamper | None) -> can.Message | None:
        if tamper is None or self._now_s() < self._fault.begin_s:
            return message
        data = tamper(message.arbitration_id, bytes(message.data))
        if data is None:
            return None
        return can.Message(arbitration_id=message.arbitration_id, data=data, is_extended_id=False)


class FaultyPort(SimulatedPort):
    """A simulated AHRS whose line has a fault."""

    fault: Fault | None = None
    now_s: Callable[[], float] = staticmethod(lambda: 0.0)

    def read(self, size: int = 1) -> bytes:
        data = super().read(size)
        if self.fault is None or self.fault.serial is None or self.now_s() < self.fault.begin_s:
            return data
        return self.fault.serial(data)


def _drop(*bases: int, node: int) -> Tamper:
    ids = {base + node for base in bases}
    return lambda can_id, data: None if can_id in ids else data


def _change(base: int, node: int, change: Callable[[bytes], bytes]) -> Tamper:
    return lambda can_id, data: change(data) if can_id == base + node else data


def _unplugged(data: bytes) -> bytes:
    raise OSError("device disconnected")


_TPDO = (0x180, 0x280, 0x380)
_RPDO = (0x200, 0x300)


def fault_kinds() -> dict[str, Callable[[float, int, np.random.Generator], Fault]]:
    """Makers of faults by name: (begin_s, node, random) → Fault."""

    def make(name: str, **parts: Callable[[int, np.random.Generator], object]) -> None:
        def maker(begin_s: float, node: int, random: np.random.Generator) -> Fault:
            made = {key: part(node, random) for key, part in parts.items()}
            return Fault(f"{name} of node {node}", begin_s, **made)  # type: ignore[arg-type]

        kinds[name] = maker

    kinds: dict[str, Callable[[float, int, np.random.Generator], Fault]] = {}
    everything = (*_TPDO, *_RPDO, 0x080, 0x580, 0x600, 0x700)
    make(
        "node lost",
        to_nodes=lambda n, r: _drop(*everything, node=n),
        from_nodes=lambda n, r: _drop(*everything, node=n),
    )
    for at, base in enumerate(_TPDO, start=1):
        make(f"TPDO {at} lost", from_nodes=lambda n, r, b=base: _drop(b, node=n))  # type: ignore[misc]
        make(f"TPDO {at} cut", from_nodes=lambda n, r, b=base: _change(b, n, lambda d: d[:-1]))  # type: ignore[misc]
    make("TPDO 1 garbled", from_nodes=lambda n, r: _change(0x180, n, lambda d: r.bytes(len(d))))
    for at, base in enumerate(_RPDO, start=1):
        make(f"RPDO {at} lost", to_nodes=lambda n, r, b=base: _drop(b, node=n))  # type: ignore[misc]
        make(f"RPDO {at} cut", to_nodes=lambda n, r, b=base: _change(b, n, lambda d: d[:1]))  # type: ignore[misc]
    make("SYNC lost", to_nodes=lambda n, r: lambda can_id, d: None if can_id == 0x80 else d)
    make("master's heartbeat lost", to_nodes=lambda n, r: lambda i, d: None if i == 0x77F else d)
    make("heartbeat lost", from_nodes=lambda n, r: _drop(0x700, node=n))
    make("heartbeat cut", from_nodes=lambda n, r: _change(0x700, n, lambda d: b""))
    make("heartbeat tells stopped", from_nodes=lambda n, r: _change(0x700, n, lambda d: b"\x04"))
    make("restart", happen=lambda n, r: lambda nodes: _of(nodes, n).boot())
    make("NMT stop", happen=lambda n, r: lambda nodes: _of(nodes, n).receive(0, bytes((2, n))))
    make("EMCY", happen=lambda n, r: lambda nodes: _of(nodes, n).emergency(0x2310))
    make("EMCY cut", happen=lambda n, r: lambda nodes: _of(nodes, n).send(0x80 + n, b"\x10\x23"))
    make("drive fault", happen=lambda n, r: lambda nodes: _of(nodes, n).drive.fail(0x2310))
    make("load cell dead", happen=lambda n, r: lambda nodes: _of(nodes, n).drive.break_load_cell())
    make("AHRS silent", serial=lambda n, r: lambda data: b"")
    make("AHRS garbled", serial=lambda n, r: lambda data: r.bytes(len(data)))
    make("AHRS unplugged", serial=lambda n, r: _unplugged)
    return kinds


def quirk(name: str, begin_s: float, node: int, **quirks: object) -> Fault:
    """A drive with quirks from some time on."""

    def happen(nodes: list[DriveNode]) -> None:
        for key, value in quirks.items():
            setattr(_of(nodes, node).drive.quirks, key, value)

    return Fault(f"{name} of node {node}", begin_s, happen=happen)


def without(*objects: Key, node: int) -> Callable[[list[DriveNode]], None]:
    """Builds a drive without some objects of its dictionary."""

    def build(nodes: list[DriveNode]) -> None:
        for key in objects:
            del _of(nodes, node).drive.dictionary.objects[key]

    return build


def forgetting(key: Key, node: int) -> Callable[[list[DriveNode]], None]:
    """Builds a drive that takes an object and keeps 0."""

    def build(nodes: list[DriveNode]) -> None:
        dictionary = _of(nodes, node).drive.dictionary
        dictionary.objects[key].on_write = lambda: dictionary.set(key, 0)

    return build


def _of(nodes: list[DriveNode], number: int) -> DriveNode:
    return next(node for node in nodes if node.id == number)
