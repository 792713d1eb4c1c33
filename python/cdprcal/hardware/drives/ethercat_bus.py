"""EtherCAT with CoE by ``pysoem``: the same objects and state machine as over CANopen.

A dry run maps no outputs and stays in SAFE-OPERATIONAL, in which slaves send inputs and take no
outputs: the standard's own way. Slaves stop by their process-data watchdog when this computer falls
silent.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Sequence
from typing import Any

from cdprcal.extras import need
from cdprcal.hardware.backend import BackendError
from cdprcal.hardware.drives.bus_lock import BusLock
from cdprcal.hardware.drives.canopen_bus import NoSuchObjectError
from cdprcal.hardware.drives.fieldbus import NO_SUCH_OBJECT, in_a_line, node_name
from cdprcal.hardware.drives.process_data import (
    Entry,
    Image,
    Layout,
    Values,
    pack,
    unpack,
)
from cdprcal.hardware.session import EthercatBus, Session

_OUTPUT_MAPPING, _INPUT_MAPPING = 0x1600, 0x1A00
_OUTPUT_ASSIGNMENT, _INPUT_ASSIGNMENT = 0x1C12, 0x1C13
_STATE_TIMEOUT_US = 2_000_000
_SHARE = 0.6  # of the cycle in which the frame must be back


class EthercatFieldbus:
    """The slaves of a session; ``node`` is the position in the segment, from 1.

    answer_s: how long a frame may be under way; 0.6 of a cycle if left out. Raises InputError when
    the extra ``ethercat`` is not installed, BackendError when the segment cannot be opened.
    """

    def __init__(self, session: Session, *, answer_s: float | None = None) -> None:
        if not isinstance(session.bus, EthercatBus):
            raise TypeError("session.bus must be ethercat")
        self._session = session
        self._answer_us = round(1e6 * (answer_s or _SHARE * session.period_s))
        self._soem = _pysoem()
        self._layouts: dict[int, Layout] = {}
        self._outputs: dict[int, Values] = {}
        self._inputs: Image = {}
        self._commanded = False  # outputs are taken
        self._lock = BusLock(session.bus)
        self._master: Any = self._soem.Master()
        self._master.always_release_gil = True
        self._faults: list[str] = []
        self._abandoned = False
        self._turn = 0  # whose mailbox is looked into next
        try:
            self._master.open(session.bus.interface)
            if self._master.config_init() <= 0:
                raise BackendError(
                    f"EtherCAT {session.bus.interface}: no slave answers; check "
                    "their power and the wiring"
                )
        except BackendError:
            self.close()
            raise
        except Exception as error:  # the library has an exception for every step
            self._master = None
            self._lock.release()
            raise BackendError(
                f"EtherCAT {session.bus.interface}: cannot be opened: {in_a_line(error)}; it needs "
                "root or CAP_NET_RAW, and an interface of that name"
            ) from None

    # --- objects ---------------------------------------------------------------------------------

    def sdo_read(self, node: int, index: int, subindex: int) -> bytes:
        try:
            return bytes(self._slave(node).sdo_read(index, subindex))
        except Exception as error:
            raise self._error(node, f"read of 0x{index:04X}:{subindex:02X}", error) from None

    def sdo_write(self, node: int, index: int, subindex: int, data: bytes) -> None:
        try:
            self._slave(node).sdo_write(index, subindex, data)
        except Exception as error:
            raise self._error(node, f"write of 0x{index:04X}:{subindex:02X}", error) from None

    def _slave(self, node: int) -> Any:
        if self._master is None:
            raise BackendError("the bus is closed; connect again")
        slaves = self._master.slaves
        if node > len(slaves):
            raise BackendError(
                f"{self._name(node)}: the segment has {len(slaves)} slaves, and no such position; "
                "correct node in the session, or check the wiring"
            )
        return slaves[node - 1]

    def _error(self, node: int, what: str, error: Exception) -> BackendError:
        if isinstance(error, BackendError):
            return error
        place = f"{self._name(node)}: {what}"
        if isinstance(error, self._soem.SdoError):
            missing = error.abort_code in NO_SUCH_OBJECT
            kind = NoSuchObjectError if missing else BackendError
            return kind(
                f"{place} refused: {error.desc} (0x{error.abort_code:08X}); look it up in "
                "its manual"
            )
        return BackendError(
            f"{place}: no answer ({type(error).__name__}); check its power and wiring"
        )

    # --- start -----------------------------------------------------------------------------------

    def configure(self, layouts: Sequence[Layout], *, outputs: bool) -> None:
        for layout in layouts:
            self._map(layout if outputs else Layout(layout.node, (), layout.inputs))
        try:
            self._master.config_map()
        except Exception as error:
            raise BackendError(
                f"EtherCAT: process data cannot be mapped: {in_a_line(error)}; check the "
                "session's objects against the slave's manual"
            ) from None
        for layout in layouts:
            slave = self._slave(layout.node)
            wanted = sum(entry.bits for entry in layout.inputs) // 8
            if len(slave.input) != wanted:
                raise BackendError(
                    f"{self._name(layout.node)}: sends {len(slave.input)} bytes where "
                    f"{wanted} were mapped: its process data cannot be changed; take out what the "
                    "session need not read"
                )
            if isinstance(self._session.bus, EthercatBus) and self._session.bus.sync0:
                slave.dc_sync(True, round(1e9 * self._session.period_s))
            self._layouts[layout.node] = layout
        for layout in layouts:
            self._slave(layout.node).add_emergency_callback(self._on_emergency)
        self._enter(self._soem.SAFEOP_STATE, "SAFE-OPERATIONAL")
        if outputs:
            # Drives want valid outputs before they become operational, which is when they watch.
            self._outputs = {
                layout.node: {entry.key: 0 for entry in layout.outputs} for layout in layouts
            }

    def _map(self, layout: Layout) -> None:
        node = layout.node
        pairs: tuple[tuple[int, int, tuple[Entry, ...]], ...] = (
            (_OUTPUT_ASSIGNMENT, _OUTPUT_MAPPING, layout.outputs),
            (_INPUT_ASSIGNMENT, _INPUT_MAPPING, layout.inputs),
        )
        for assignment, mapping, entries in pairs:
            self.sdo_write(node, assignment, 0, b"\0")
            if not entries:
                continue
            self.sdo_write(node, mapping, 0, b"\0")
            for at, entry in enumerate(entries, start=1):
                self.sdo_write(node, mapping, at, entry.mapping.to_bytes(4, "little"))
            self.sdo_write(node, mapping, 0, bytes([len(entries)]))
            self.sdo_write(node, assignment, 1, mapping.to_bytes(2, "little"))
            self.sdo_write(node, assignment, 0, b"\1")

    def _enter(self, state: int, name: str) -> None:
        self._master.state = state
        self._master.write_state()
        tries = 20  # slaves enter operation while process data comes and goes
        while self._master.state_check(state, _STATE_TIMEOUT_US // tries) != state:
            self._cycle()
            tries -= 1
            if tries > 0:
                continue
            self._master.read_state()
            for node in self._layouts:
                slave = self._slave(node)
                if slave.state != state:
                    why = self._soem.al_status_code_to_string(slave.al_status)
                    raise BackendError(
                        f"{self._name(node)}: does not become {name}: {why}; look "
                        "it up in its manual"
                    )
            raise BackendError(
                f"EtherCAT: the segment does not become {name}; check the slaves' power and wiring"
            )

    def watch_us(self, *, on: bool) -> list[int]:
        """Slaves watch the process data while they are operational: from here on, if on."""
        cycles = self._session.safety.missed_cycles + 1
        watch_ms = 1e3 * cycles * self._session.period_s if on else 0.0
        for node, layout in self._layouts.items():
            if not layout.outputs:
                continue
            try:
                self._watch_process_data(node, watch_ms)
            except Exception as error:
                raise self._error(node, "process-data watchdog", error) from None
        if on and self._outputs and not self._commanded:
            self._cycle()
            self._enter(self._soem.OP_STATE, "OPERATIONAL")
            self._commanded = True
        return []  # what is watched is the commands themselves

    def _watch_process_data(self, node: int, watch_ms: float) -> None:
        # The library gives these registers 4 ms, and no setting for more: a frame may get lost.
        until_s = time.monotonic() + 1e-6 * _STATE_TIMEOUT_US
        while True:
            try:
                self._slave(node).set_watchdog("processdata", watch_ms)
                return
            except self._soem.WkcError:
                if time.monotonic() > until_s:
                    raise

    # --- cycle -----------------------------------------------------------------------------------

    def exchange(self, outputs: Image) -> Image:
        self.send(outputs)
        self._look_into_mailbox()
        return self._inputs

    def abandon(self) -> None:
        if self._abandoned or self._master is None:
            return
        self._abandoned = True
        with contextlib.suppress(Exception):  # silence is enough: their watchdog stops them
            self._master.state = self._soem.SAFEOP_STATE
            self._master.write_state()

    def _look_into_mailbox(self) -> None:
        """For an EMCY of one slave a cycle: process data does not carry them."""
        nodes = list(self._layouts)
        node = nodes[self._turn % len(nodes)]
        self._turn += 1
        with contextlib.suppress(Exception):  # who does not answer is seen by its process data
            self._slave(node).mbx_receive()

    def _on_emergency(self, emergency: Any) -> None:
        if emergency.error_code & 0xFF00:
            self._faults.append(
                f"{self._name(emergency.slave_pos)}: EMCY 0x{emergency.error_code:04X}, error "
                f"register 0x{emergency.error_reg:02X}"
            )

    def send(self, outputs: Image) -> None:
        self._outputs |= outputs
        self._inputs = self._cycle()

    def _cycle(self) -> dict[int, Values]:
        if self._master is None:
            raise BackendError("the bus is closed; connect again")
        if self._abandoned:
            return {}
        for node, values in self._outputs.items():
            if layout := self._layouts.get(node):
                self._slave(node).output = pack(layout.outputs, values)
        try:
            self._master.send_processdata()
            came = self._master.receive_processdata(self._answer_us)
        except Exception as error:
            raise BackendError(
                f"EtherCAT: {type(error).__name__}: {error}; check the interface and the cable"
            ) from None
        # Slaves that take no outputs now need not count them.
        wanted = self._master.expected_wkc if self._commanded else len(self._layouts)
        silent = self._silent() if came < wanted else set()
        image: dict[int, Values] = {}
        for node, layout in self._layouts.items():
            read = unpack(layout.inputs, bytes(self._slave(node).input))
            if node not in silent and read is not None:
                image[node] = read
        return image

    def _silent(self) -> set[int]:
        """Whose data is not among what came: who has left its state; all, if nobody admits it."""
        with contextlib.suppress(Exception):
            self._master.read_state()
        states = {node: self._slave(node).state for node in self._layouts}
        best = max(states.values(), default=0)
        gone = {node for node, state in states.items() if state != best}
        return gone or set(self._layouts)

    def faults(self) -> list[str]:
        faults, self._faults = self._faults, []
        return faults

    def close(self, *, stop: bool = True) -> None:
        self._lock.release()
        master, self._master = self._master, None
        if master is None:
            return
        with contextlib.suppress(Exception):
            if stop:
                master.state = self._soem.PREOP_STATE
                master.write_state()
        with contextlib.suppress(Exception):
            master.close()

    def _name(self, node: int) -> str:
        return node_name(self._session, node)


def _pysoem() -> Any:
    need("pysoem", of="bus.type ethercat")
    import pysoem  # type: ignore[import-untyped,import-not-found,unused-ignore]

    return pysoem
