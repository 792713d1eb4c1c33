"""The EtherCAT master's side, with a library that fails as pysoem can: every failure has words.

What slaves do when all is well is in test_winch_ethercat.py, on a segment of software slaves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from cdprcal.hardware import BackendError
from cdprcal.hardware.drives import ethercat_bus
from cdprcal.hardware.drives.canopen_bus import NoSuchObjectError
from cdprcal.hardware.drives.ethercat_bus import EthercatFieldbus
from cdprcal.hardware.drives.process_data import layouts
from cdprcal.hardware.session import Session
from winch_bus import ethercat_session, example_session

PREOP, SAFEOP, OP = 2, 4, 8


class SdoError(Exception):
    def __init__(self, abort_code: int, desc: str) -> None:
        self.abort_code = abort_code
        self.desc = desc


class WkcError(Exception):
    pass


class Slave:
    """Keeps what it is told; ``fails``: what its mailbox raises."""

    def __init__(self) -> None:
        self.state = PREOP
        self.al_status = 0x1B
        self.input = b""
        self.output = b""
        self.written: list[tuple[int, int, bytes]] = []
        self.fails: Exception | None = None
        self.watchdog_ms: float | None = None
        self.lost = 0  # how many frames of its watchdog get lost
        self.sync: tuple[bool, int] | None = None
        self.on_emergency: list[Callable[[Any], None]] = []

    def add_emergency_callback(self, callback: Callable[[Any], None]) -> None:
        self.on_emergency.append(callback)

    def sdo_read(self, index: int, subindex: int) -> bytes:
        if self.fails:
            raise self.fails
        return bytes([index & 0xFF, subindex])

    def sdo_write(self, index: int, subindex: int, data: bytes) -> None:
        if self.fails:
            raise self.fails
        self.written.append((index, subindex, data))

    def set_watchdog(self, kind: str, value_ms: float) -> None:
        if self.fails:
            raise self.fails
        assert kind == "processdata"
        if self.lost:
            self.lost -= 1
            raise WkcError
        self.watchdog_ms = value_ms

    def dc_sync(self, on: bool, period_ns: int) -> None:
        self.sync = on, period_ns


class Master:
    """A segment of slaves that follow their master, unless told otherwise."""

    found = 4

    def __init__(self) -> None:
        self.slaves: list[Slave] = []
        self.state = PREOP
        self.reached = {PREOP, SAFEOP, OP}
        self.expected_wkc = 12
        self.wkc = 12
        self.fails: dict[str, Exception] = {}
        self.closed = 0

    def _may(self, what: str) -> None:
        if what in self.fails:
            raise self.fails[what]

    def open(self, interface: str) -> None:
        self.slaves = [Slave() for _ in range(self.found)]

    def config_init(self) -> int:
        return self.found

    def config_map(self) -> None:
        self._may("map")
        for slave in self.slaves:
            slave.input = bytes(64)

    def write_state(self) -> None:
        self._may("state")
        if self.state in self.reached:
            for slave in self.slaves:
                slave.state = self.state

    def state_check(self, state: int, timeout_us: int) -> int:
        return min(slave.state for slave in self.slaves)

    def read_state(self) -> None:
        self._may("state")

    def send_processdata(self) -> None:
        self._may("send")

    def receive_processdata(self, timeout_us: int) -> int:
        return self.wkc

    def close(self) -> None:
        self.closed += 1
        self._may("close")


@pytest.fixture
def session() -> Session:
    return ethercat_session("eth0, sync0: true")


@pytest.fixture
def soem(monkeypatch: pytest.MonkeyPatch) -> Any:
    made = SimpleNamespace(
        Master=Master,
        SdoError=SdoError,
        WkcError=WkcError,
        PREOP_STATE=PREOP,
        SAFEOP_STATE=SAFEOP,
        OP_STATE=OP,
        al_status_code_to_string=lambda code: f"status 0x{code:04X}",
    )
    monkeypatch.setattr(ethercat_bus, "_pysoem", lambda: made)
    monkeypatch.setattr(Master, "found", 4)
    return made


@pytest.fixture
def bus(soem: Any, session: Session) -> Iterator[EthercatFieldbus]:
    made = EthercatFieldbus(session)
    yield made
    made.close()  # or the bus is held for the next test


def master_of(bus: EthercatFieldbus) -> Master:
    master: Master = bus._master
    return master


def configured(bus: EthercatFieldbus, session: Session, *, outputs: bool = True) -> Master:
    """Slaves that send as many bytes as were mapped."""
    master = master_of(bus)
    sizes = {part.node: sum(entry.bits for entry in part.inputs) // 8 for part in layouts(session)}

    def config_map() -> None:
        for node, slave in enumerate(master.slaves, start=1):
            slave.input = bytes(sizes[node])

    master.config_map = config_map  # type: ignore[method-assign]
    bus.configure(layouts(session), outputs=outputs)
    return master


def test_a_session_of_another_bus_is_a_mistake_of_the_program(soem: Any) -> None:
    with pytest.raises(TypeError, match="must be ethercat"):
        EthercatFieldbus(example_session())


def test_a_segment_without_slaves(
    soem: Any, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Master, "found", 0)
    with pytest.raises(BackendError, match="EtherCAT eth0: no slave answers; check their power"):
        EthercatFieldbus(session)


def test_objects(bus: EthercatFieldbus) -> None:
    assert bus.sdo_read(2, 0x1018, 4) == b"\x18\x04"
    bus.sdo_write(2, 0x605A, 0, b"\x02\x00")
    assert master_of(bus).slaves[1].written == [(0x605A, 0, b"\x02\x00")]


@pytest.mark.parametrize(
    ("fails", "kind", "words"),
    [
        (SdoError(0x06020000, "no object"), NoSuchObjectError, r"refused: no object \(0x06020000"),
        (SdoError(0x06090011, "no subindex"), NoSuchObjectError, "refused: no subindex"),
        (SdoError(0x08000022, "wrong state"), BackendError, r"wrong state \(0x08000022\); look it"),
        (WkcError(), BackendError, r"no answer \(WkcError\); check its power and wiring"),
    ],
)
def test_objects_that_cannot_be_had(
    bus: EthercatFieldbus, fails: Exception, kind: type[Exception], words: str
) -> None:
    master_of(bus).slaves[2].fails = fails
    with pytest.raises(kind, match=rf"node 3 \(cable 3\): read of 0x6041:00.*{words}") as told:
        bus.sdo_read(3, 0x6041, 0)
    assert type(told.value) is kind
    with pytest.raises(kind, match=rf"node 3 \(cable 3\): write of 0x6040:00.*{words}"):
        bus.sdo_write(3, 0x6040, 0, b"\0\0")


def test_a_position_beyond_the_segment(bus: EthercatFieldbus) -> None:
    with pytest.raises(BackendError, match="node 9: the segment has 4 slaves, and no such pos"):
        bus.sdo_read(9, 0x1000, 0)


def test_process_data_and_distributed_clocks_are_set_up(
    bus: EthercatFieldbus, session: Session
) -> None:
    master = configured(bus, session)
    for slave in master.slaves:
        assert slave.state == SAFEOP
        assert slave.sync == (True, 10_000_000)
        assert (0x1C12, 0, b"\1") in slave.written  # outputs are assigned
    bus.watch_us(on=True)
    assert {slave.state for slave in master.slaves} == {OP}
    # Two cycles of silence: one that may be missed, and the one after.
    assert [slave.watchdog_ms for slave in master.slaves] == [20.0] * 4
    bus.watch_us(on=False)
    assert [slave.watchdog_ms for slave in master.slaves] == [0.0] * 4
    assert bus.faults() == []


def test_a_dry_run_assigns_no_outputs_and_sets_no_watchdog(
    bus: EthercatFieldbus, session: Session
) -> None:
    master = configured(bus, session, outputs=False)
    bus.watch_us(on=True)
    for slave in master.slaves:
        assert slave.state == SAFEOP
        assert (0x1C12, 0, b"\1") not in slave.written


def test_data_that_cannot_be_mapped(bus: EthercatFieldbus, session: Session) -> None:
    master_of(bus).fails["map"] = WkcError("too much\n data")
    with pytest.raises(BackendError, match="cannot be mapped: too much data; check the session's"):
        bus.configure(layouts(session), outputs=True)


def test_a_slave_whose_data_cannot_be_changed(bus: EthercatFieldbus, session: Session) -> None:
    with pytest.raises(BackendError, match=r"node 1 \(cable 1\): sends 64 bytes where \d+ were"):
        bus.configure(layouts(session), outputs=True)


def test_a_slave_that_stays_behind_is_named(bus: EthercatFieldbus, session: Session) -> None:
    master = configured(bus, session)
    master.reached = set()

    def only_two() -> None:
        for slave in master.slaves[:1] + master.slaves[2:]:
            slave.state = OP

    master.write_state = only_two  # type: ignore[method-assign]
    words = r"node 2 \(cable 2\): does not become OPERATIONAL: status 0x001B; look it up"
    with pytest.raises(BackendError, match=words):
        bus.watch_us(on=True)


def test_a_segment_that_stays_behind_as_a_whole(bus: EthercatFieldbus, session: Session) -> None:
    master = configured(bus, session)
    master.state_check = lambda state, timeout_us: SAFEOP  # type: ignore[method-assign]
    with pytest.raises(BackendError, match="the segment does not become OPERATIONAL; check the"):
        bus.watch_us(on=True)


def test_a_watchdog_that_is_refused(bus: EthercatFieldbus, session: Session) -> None:
    master = configured(bus, session)
    master.slaves[3].fails = SdoError(0x06010002, "read only")
    with pytest.raises(BackendError, match=r"node 4 .*process-data watchdog refused: read only"):
        bus.watch_us(on=True)


@pytest.mark.parametrize("lost", [1, 3])
def test_a_lost_frame_does_not_end_the_setting_of_a_watchdog(
    lost: int, bus: EthercatFieldbus, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    slave = configured(bus, session).slaves[2]
    slave.lost = lost
    bus.watch_us(on=True)
    assert (slave.watchdog_ms, slave.lost) == (20.0, 0)
    monkeypatch.setattr(ethercat_bus, "_STATE_TIMEOUT_US", 10_000)
    slave.lost = 1 << 60  # it has gone
    with pytest.raises(BackendError, match=r"node 3 .*process-data watchdog: no answer"):
        bus.watch_us(on=False)


def test_a_cable_that_is_pulled(bus: EthercatFieldbus, session: Session) -> None:
    master = configured(bus, session)
    bus.watch_us(on=True)
    image = bus.exchange({})
    assert image.keys() == {1, 2, 3, 4}
    # Fewer answers than expected, and one slave has left operation: its data is old.
    master.wkc = 9
    master.slaves[1].state = SAFEOP
    assert bus.exchange({}).keys() == {1, 3, 4}
    # None admits it, and the states cannot be read: nobody's data counts.
    master.slaves[1].state = OP
    master.fails["state"] = WkcError()
    assert bus.exchange({}).keys() == set()
    master.fails["send"] = OSError(100, "Network is down")
    with pytest.raises(BackendError, match=r"EtherCAT: OSError: .*Network is down; check the int"):
        bus.exchange({})


def test_closing_is_for_good_and_never_raises(bus: EthercatFieldbus, session: Session) -> None:
    master = configured(bus, session)
    master.fails |= {"state": WkcError(), "close": WkcError()}
    bus.close()
    bus.close()
    assert master.closed == 1
    with pytest.raises(BackendError, match="the bus is closed; connect again"):
        bus.exchange({})
    with pytest.raises(BackendError, match="the bus is closed; connect again"):
        bus.sdo_read(1, 0x1000, 0)


@pytest.mark.parametrize("stop", [True, False])
def test_closing_may_leave_the_slaves_as_they_are(
    bus: EthercatFieldbus, session: Session, stop: bool
) -> None:
    master = configured(bus, session)
    bus.watch_us(on=True)
    bus.close(stop=stop)
    assert {slave.state for slave in master.slaves} == {PREOP if stop else OP}


def test_what_a_drive_says_by_itself_is_kept_until_it_is_asked_for(
    bus: EthercatFieldbus, session: Session
) -> None:
    master = configured(bus, session)
    for node, slave in enumerate(master.slaves, start=1):
        for callback in slave.on_emergency:
            callback(SimpleNamespace(error_code=0x8611, error_reg=0x20, slave_pos=node))
            callback(SimpleNamespace(error_code=0x0000, error_reg=0x00, slave_pos=node))  # over
    said = bus.faults()
    assert len(said) == len({part.node for part in layouts(session)})
    assert all("EMCY 0x8611, error register 0x20" in text for text in said)
    assert bus.faults() == []
