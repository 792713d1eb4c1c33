"""A CAN bus without a bus: what the master says is kept, and simulated drives answer at once."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import can

from cdprcal.hardware.drives.canopen_bus import CanopenFieldbus
from cdprcal.hardware.drives.fieldbus import SimulatedClock
from cdprcal.hardware.drives.process_data import Layout, layouts
from cdprcal.hardware.session import Session
from cdprcal.testing.simulated_devices.canopen_node import DriveNode
from cdprcal.testing.simulated_devices.drive import SimulatedDrive

#: COB-ID and data.
Said = tuple[int, bytes]


class Wire(can.BusABC):
    """The end of a bus that the master has; ``say`` is the other one."""

    def __init__(self) -> None:
        super().__init__("wire")
        self.said: list[Said] = []  #: by the master
        self.answer: Callable[[int, bytes], None] = lambda can_id, data: None
        self.broken = False
        self.waiting: deque[can.Message] = deque()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """The master says something."""
        if self.broken or self._is_shutdown:
            raise can.CanOperationError("broken")
        self.said.append((msg.arbitration_id, bytes(msg.data)))
        self.answer(msg.arbitration_id, bytes(msg.data))

    def say(self, can_id: int, data: bytes = b"", **kind: bool) -> None:
        """Somebody else says something."""
        kind = {"is_extended_id": False} | kind
        self.waiting.append(can.Message(arbitration_id=can_id, data=data, **kind))

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self.broken:
            raise can.CanOperationError("broken")
        return self.waiting.popleft() if self.waiting else None, True


class Wired:
    """The master of a session on a wire, its drives, and their time."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.clock = SimulatedClock()
        self.wire = Wire()
        self.nodes = [DriveNode(SimulatedDrive(winch), self.wire.say) for winch in session.winches]
        self.silent: set[int] = set()  #: COB-IDs of answers that get lost
        for node in self.nodes:
            node.send = self._send
        self.wire.answer = self._answer
        self.clock.advance.append(self._advance)
        self.master = CanopenFieldbus(session, self.clock, self.wire)

    def __enter__(self) -> Wired:
        return self

    def __exit__(self, *_: object) -> None:
        self.master.close()

    def start(self, *, outputs: bool = True, of: Sequence[Layout] | None = None) -> Wired:
        """Process data runs; what was said for that is forgotten."""
        self.master.configure(layouts(self.session) if of is None else of, outputs=outputs)
        self.wire.said.clear()
        return self

    def said(self, *bases: int) -> list[Said]:
        """What the master said by COB-IDs of some kinds."""
        return [(can_id, data) for can_id, data in self.wire.said if can_id & 0x780 in bases]

    def written(self, node: int) -> list[tuple[int, int, int, int]]:
        """What the master wrote to a node's dictionary: index, subindex, value, bytes."""
        found = []
        for can_id, data in self.wire.said:
            if can_id == 0x600 + node and data[0] >> 5 == 1:
                size = 4 - (data[0] >> 2 & 3)
                value = int.from_bytes(data[4 : 4 + size], "little")
                found.append((int.from_bytes(data[1:3], "little"), data[3], value, size))
        return found

    def _send(self, can_id: int, data: bytes) -> None:
        if can_id not in self.silent:
            self.wire.say(can_id, data)

    def _answer(self, can_id: int, data: bytes) -> None:
        for node in self.nodes:
            if can_id == 0x80:
                node.sync()
            else:
                node.receive(can_id, data)

    def _advance(self, now_s: float) -> None:
        for node in self.nodes:
            node.advance(now_s)
