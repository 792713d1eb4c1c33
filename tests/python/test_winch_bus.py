"""One master a bus, what it says there, and answers that belong to their cycle; the clock of real
devices, and the priority that a control loop asks for."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import can
import pytest

import cdprcal
from cdprcal.hardware import BackendError
from cdprcal.hardware.connect import leave_priority, take_priority
from cdprcal.hardware.drives.bus_lock import BusLock
from cdprcal.hardware.drives.canopen_bus import (
    CanopenFieldbus,
    NoSuchObjectError,
    RefusedError,
    open_can_bus,
)
from cdprcal.hardware.drives.fieldbus import RealClock, SimulatedClock
from cdprcal.hardware.drives.process_data import Entry, Layout, Values, layouts
from cdprcal.hardware.session import CanopenBus, EthercatBus
from cdprcal.testing.simulated_devices.connect import SimulatedSession
from winch_bus import example_session
from winch_wire import Wire, Wired

CAN0 = CanopenBus(type="canopen", interface="socketcan", channel=f"can-{os.getpid()}")
ETH1 = EthercatBus(type="ethercat", interface=f"eth-{os.getpid()}")


@pytest.mark.parametrize("bus", [CAN0, ETH1], ids=["canopen", "ethercat"])
def test_a_bus_has_one_master(bus: CanopenBus | EthercatBus) -> None:
    first = BusLock(bus)
    with pytest.raises(BackendError, match="another program on this computer moves a robot"):
        BusLock(bus)
    first.release()
    first.release()
    BusLock(bus).release()


def test_another_bus_is_another_one() -> None:
    locks = [BusLock(bus) for bus in (CAN0, ETH1, CAN0.model_copy(update={"channel": "can-x"}))]
    for lock in locks:
        lock.release()


def test_a_program_that_is_killed_holds_nothing() -> None:
    code = (
        "from cdprcal.hardware.drives.bus_lock import BusLock\n"
        "from cdprcal.hardware.session import EthercatBus\n"
        f"lock = BusLock(EthercatBus(type='ethercat', interface={ETH1.interface!r}))\n"
        "print('held', flush=True)\ninput()\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"held\n"
        with pytest.raises(BackendError, match="end it first"):
            BusLock(ETH1)
        other.kill()
        other.wait()
    BusLock(ETH1).release()


def test_a_virtual_bus_is_in_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two programs may each simulate a robot on a bus of the same name; one may not do so twice."""
    virtual = CAN0.model_copy(update={"interface": "virtual"})
    here, real = BusLock(virtual), BusLock(CAN0)
    with pytest.raises(BackendError, match="end it first"):
        BusLock(virtual)
    monkeypatch.setattr(os, "getpid", lambda: -1)
    BusLock(virtual).release()
    with pytest.raises(BackendError, match="end it first"):
        BusLock(CAN0)
    here.release()
    real.release()


def test_a_second_acquire_is_refused_and_disturbs_nobody(
    robot: cdprcal.Robot, plan: cdprcal.Plan
) -> None:
    session = example_session()
    backend = SimulatedSession.connect(session, robot, plan, armed=True)
    for _ in range(20):
        backend.read()
    with pytest.raises(BackendError, match="another program"):
        CanopenFieldbus(session, SimulatedClock())
    for _ in range(20):
        backend.read()
    assert backend.tripped == ""
    backend.stop()
    # And afterwards it is free again.
    again = SimulatedSession.connect(session, robot, plan, armed=False)
    again.stop()


class Foreign:
    """Somebody else on the bus, who says one thing whenever there is time."""

    def __init__(self, settings: CanopenBus, can_id: int) -> None:
        self._bus = open_can_bus(settings)
        self._id = can_id
        self.heard = 0

    def speak(self) -> None:
        while self._bus.recv(0.0) is not None:
            self.heard += 1
        self._bus.send(can.Message(arbitration_id=self._id, data=b"\1\0", is_extended_id=False))

    def close(self) -> None:
        self._bus.shutdown()


@pytest.fixture(params=[0x000, 0x080, 0x203, 0x304, 0x601, 0x77F, 0x701, 0x181])
def foreign(request: pytest.FixtureRequest) -> Iterator[tuple[int, Foreign, CanopenFieldbus]]:
    session = example_session()
    assert isinstance(session.bus, CanopenBus)
    somebody = Foreign(session.bus, request.param)
    yield request.param, somebody, session  # type: ignore[misc]
    somebody.close()


def test_foreign_masters_are_heard_before_anything_is_said(
    foreign: tuple[int, Foreign, object],
) -> None:
    """By what only masters say: NMT, SYNC, commands, SDO requests, this master's heartbeat."""
    can_id, somebody, session = foreign
    clock = SimulatedClock()
    clock.idle.append(somebody.speak)
    if can_id in (0x701, 0x181):  # a node's own heartbeat and inputs
        CanopenFieldbus(session, clock).close()  # type: ignore[arg-type]
        return
    words = rf"another master speaks there \(0x{can_id:03X}\)"
    with pytest.raises(BackendError, match=words) as refused:
        CanopenFieldbus(session, clock)  # type: ignore[arg-type]
    somebody.speak()
    assert somebody.heard == 0
    # It has left the bus: the next one is refused for the same reason, not for the lock.
    with pytest.raises(BackendError, match="another master speaks"):
        CanopenFieldbus(session, clock)  # type: ignore[arg-type]
    assert refused.tb  # which would hold what was not given back


def test_a_late_answer_is_not_that_of_the_next_cycle(
    robot: cdprcal.Robot, plan: cdprcal.Plan
) -> None:
    """Else all readings are a cycle old from then on."""
    session = example_session()
    assert isinstance(session.bus, CanopenBus)
    backend = SimulatedSession.connect(session, robot, plan, armed=True)
    backend.read()
    last = backend.winches[3]  # whose swivel encoder is what the cycle waits for to the end
    before = last.swivel_counts
    assert before is not None
    other = open_can_bus(session.bus)
    late = (before + 10_000).to_bytes(4, "little", signed=True)
    other.send(can.Message(arbitration_id=0x384, data=late, is_extended_id=False))
    backend.read()
    assert last.swivel_counts == pytest.approx(before, abs=1000)
    assert last.swivel_missed == 0
    other.shutdown()
    backend.stop()


# --- set-up of the nodes -------------------------------------------------------------------------

_OFF = 0x80000000


def off(number: int, base: int) -> tuple[int, int, int, int]:
    """A PDO of node 3 that is not used."""
    kind, at = (0x1800, number) if base & 0x80 else (0x1400, number)
    return kind + at, 1, _OFF | base + 3, 4


def pdo(number: int, base: int, kind: int, *mapped: int) -> list[tuple[int, int, int, int]]:
    """CiA 301 §7.5.2.36: invalid, its type, empty, filled, counted, valid."""
    setting, mapping = (0x1800, 0x1A00) if base & 0x80 else (0x1400, 0x1600)
    setting, mapping = setting + number, mapping + number
    return [
        (setting, 1, _OFF | base + 3, 4),
        (setting, 2, kind, 1),
        (mapping, 0, 0, 1),
        *((mapping, at, entry, 4) for at, entry in enumerate(mapped, start=1)),
        (mapping, 0, len(mapped), 1),
        (setting, 1, base + 3, 4),
    ]


IN_1 = pdo(0, 0x180, 1, 0x60410010, 0x60610008, 0x603F0010, 0x60770010)
IN_2 = pdo(1, 0x280, 1, 0x60640020, 0x24010120)
IN_3 = pdo(2, 0x380, 1, 0x60E40220)


def outputs_of(kind: int) -> list[list[tuple[int, int, int, int]]]:
    return [
        pdo(0, 0x200, kind, 0x60400010, 0x60600008, 0x60FF0020),
        pdo(1, 0x300, kind, 0x60710010),
    ]


@pytest.mark.parametrize(
    ("outputs", "setting", "kind"),
    [(True, "", 255), (True, ", outputs: next_sync", 1), (False, "", 0)],
)
def test_process_data_is_mapped_as_the_standard_wants_it(
    outputs: bool, setting: str, kind: int
) -> None:
    """With SYNC from the nodes, at once to them. In a dry run nothing can ever reach a drive."""
    session = example_session(**{"channel: irma4": f"channel: irma4{setting}"})
    with Wired(session) as bus:
        bus.master.configure(layouts(session), outputs=outputs)
        out = outputs_of(kind) if outputs else [[off(0, 0x200)], [off(1, 0x300)]]
        assert bus.written(3) == [
            *IN_1, *out[0], *IN_2, *out[1], *IN_3, off(2, 0x400), off(3, 0x480), off(3, 0x500),
            (0x1017, 0, 100, 2),
        ]  # fmt: skip
        # All are pre-operational before the first is told anything, and started after the last.
        nmt = [(0, bytes((128, node))) for node in range(1, 5)]
        assert bus.wire.said[:4] == nmt
        assert bus.wire.said[-4:] == [(0, bytes((1, node))) for node in range(1, 5)]
        assert len(bus.said(0)) == 8
        assert bus.master.faults() == []


def entries(count: int) -> tuple[Entry, ...]:
    return tuple(Entry((0x2000, at), 32, True) for at in range(count))


@pytest.mark.parametrize("both", [(8, 8), (9, 0), (0, 9)])
def test_a_node_has_four_pdos_to_and_four_from_it(both: tuple[int, int]) -> None:
    """Of two entries each."""
    with Wired(example_session()) as bus:
        layout = Layout(3, entries(both[0]), entries(both[1]))
        if both == (8, 8):
            bus.master.configure([layout], outputs=True)
            for base in (0x180, 0x200, 0x280, 0x300, 0x380, 0x400, 0x480, 0x500):
                number, index = (base - 0x180) // 0x100, 0x1800 if base & 0x80 else 0x1400
                assert (index + number, 1, base + 3, 4) in bus.written(3)
        else:
            with pytest.raises(
                BackendError, match=r"node 3 \(cable 3\): has more process data than"
            ):
                bus.master.configure([layout], outputs=True)


def test_a_node_need_only_have_the_pdos_that_are_used() -> None:
    for missing, fine in ((0x1803, True), (0x1402, True), (0x1802, False), (0x1401, False)):
        with Wired(example_session()) as bus:
            del bus.nodes[2].device.dictionary.objects[missing, 1]
            if fine:
                bus.start()
            else:
                with pytest.raises(NoSuchObjectError, match=f"node 3 .* of 0x{missing:04X}:01"):
                    bus.start()


@pytest.mark.parametrize(
    ("rate_Hz", "missed", "time_ms"), [(100, 1, 20), (100, 2, 30), (300, 1, 7), (1000, 3, 4)]
)
def test_drives_watch_the_masters_heartbeat_and_its_commands(
    rate_Hz: int, missed: int, time_ms: int
) -> None:
    """For missed_cycles + 1 cycles, in whole milliseconds."""
    changes = {"\nrate_Hz: 100": f"\nrate_Hz: {rate_Hz}",
               "brakes: true": f"brakes: true, missed_cycles: {missed}",
               "channel: irma4": "channel: irma4, master_node: 126"}  # fmt: skip
    with Wired(example_session(**changes)).start() as bus:
        for on, watched in ((True, 126 << 16 | time_ms), (False, 0)):
            bus.wire.said.clear()
            assert bus.master.watch_us(on=on) == []
            timer = time_ms if on else 0
            assert bus.written(2) == [
                (0x1016, 1, watched, 4), (0x1400, 5, timer, 2), (0x1401, 5, timer, 2),
            ]  # fmt: skip


def test_who_takes_no_commands_need_not_watch_anybody() -> None:
    with Wired(example_session()) as bus:
        bus.start(of=[Layout(2, (), entries(1)), Layout(3, entries(1), entries(1))])
        bus.master.watch_us(on=True)
        assert bus.written(2) == []
        assert bus.written(3) != []
    with Wired(example_session()).start(outputs=False) as bus:
        bus.master.watch_us(on=True)
        assert bus.wire.said == []


@pytest.mark.parametrize("at", [0x1400, 0x1401])
def test_who_does_not_notice_that_commands_stay_away_is_named(at: int) -> None:
    for build in ("none", "forgets", "refuses"):
        with Wired(example_session()).start() as bus:
            dictionary = bus.nodes[1].device.dictionary
            timer = dictionary.objects[at, 5]
            if build == "none":
                del dictionary.objects[at, 5]
            elif build == "forgets":
                timer.on_write = lambda: dictionary.set((at, 5), 0)  # noqa: B023
            else:
                timer.writable = False
            assert bus.master.watch_us(on=True) == [2]


def test_who_does_not_watch_the_heartbeat_is_refused() -> None:
    with Wired(example_session()).start() as bus:
        dictionary = bus.nodes[3].device.dictionary
        dictionary.objects[0x1016, 1].on_write = lambda: dictionary.set((0x1016, 1), 0)
        with pytest.raises(
            BackendError, match=r"node 4 \(cable 4\): does not keep what its heartb"
        ):
            bus.master.watch_us(on=True)


# --- objects -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("code", "error"),
    [
        (0x06020000, NoSuchObjectError),  # no such object
        (0x06090011, NoSuchObjectError),  # no such subindex
        (0x06010002, RefusedError),  # read only
        (0x08000022, RefusedError),  # not in this state
    ],
)
def test_what_a_node_refuses(code: int, error: type[BackendError]) -> None:
    with Wired(example_session()) as bus:
        bus.silent.add(0x583)

        def abort(can_id: int, data: bytes) -> None:
            bus.wire.say(0x583, b"\x80" + data[1:4] + code.to_bytes(4, "little"))

        bus.wire.answer = abort
        with pytest.raises(error, match=r"node 3 \(cable 3\): read of 0x2401:01 refused") as found:
            bus.master.sdo_read(3, 0x2401, 1)
        assert type(found.value) is error
        with pytest.raises(error, match=r"node 3 \(cable 3\): write of 0x2401:01 refused"):
            bus.master.sdo_write(3, 0x2401, 1, bytes(4))


def test_objects_are_read_and_written() -> None:
    with Wired(example_session()) as bus:
        assert bus.master.sdo_read(2, 0x1018, 4) == (1002).to_bytes(4, "little")
        assert bus.master.sdo_read(2, 0x1008, 0) == b"cdprcal simulated CiA-402 drive"
        bus.master.sdo_write(2, 0x605A, 0, b"\6\0")
        assert bus.nodes[1].device.dictionary.get((0x605A, 0)) == 6
        assert bus.nodes[0].device.dictionary.get((0x605A, 0)) == 2


def test_who_does_not_answer_is_given_half_a_second_and_asked_once() -> None:
    """Of the control loop's time alone; a write that is repeated might be done twice."""
    with Wired(example_session()) as bus:
        bus.silent.add(0x583)
        began = time.monotonic()
        with pytest.raises(
            BackendError, match=r"node 3 \(cable 3\): write of 0x605A:00: no answer"
        ):
            bus.master.sdo_write(3, 0x605A, 0, b"\2\0")
        assert time.monotonic() - began < 0.5
        assert bus.clock.now_s() == pytest.approx(0.5)
        assert len(bus.written(3)) == 1
        with pytest.raises(BackendError, match="node 20: read of 0x1000:00: no answer"):
            bus.master.sdo_read(20, 0x1000, 0)


def test_what_comes_while_an_answer_is_waited_for_is_not_lost() -> None:
    with Wired(example_session()).start() as bus:
        bus.wire.say(0x82, b"\x10\x23\1")
        bus.master.sdo_read(3, 0x1000, 0)
        assert bus.master.faults() == ["node 2 (cable 2): EMCY 0x2310, error register 0x01"]


# --- cycles --------------------------------------------------------------------------------------

COMMAND: Values = {(0x6040, 0): 0x0F, (0x6060, 0): 9, (0x60FF, 0): -2, (0x6071, 0): 258}
COMMAND_SAID = [
    (0x202, b"\x0f\0\x09\xfe\xff\xff\xff"),
    (0x302, b"\2\1"),
]  # fmt: skip


def test_a_cycle_is_commands_heartbeat_sync_and_answers() -> None:
    session = example_session(**{"channel: irma4": "channel: irma4, master_node: 126"})
    with Wired(session).start() as bus:
        bus.nodes[1].device.dictionary.set((0x6064, 0), -7)
        image = bus.master.exchange({2: COMMAND})
        assert bus.wire.said == [*COMMAND_SAID, (0x77E, b"\5"), (0x80, b"")]
        assert set(image) == {1, 2, 3, 4}
        assert image[2][0x6064, 0] == -7
        assert set(image[2]) == {(0x6041, 0), (0x6061, 0), (0x603F, 0), (0x6077, 0), (0x6064, 0),
                                 (0x2401, 1), (0x60E4, 2)}  # fmt: skip
        assert bus.clock.now_s() == 0.0  # all were there
        bus.wire.said.clear()
        bus.master.send({2: COMMAND})
        assert bus.wire.said == COMMAND_SAID


def test_a_dry_run_says_sync_and_its_heartbeat_alone() -> None:
    with Wired(example_session()).start(outputs=False) as bus:
        assert set(bus.master.exchange({})) == {1, 2, 3, 4}
        assert bus.wire.said == [(0x77F, b"\5"), (0x80, b"")]


@pytest.mark.parametrize("lost", [0x183, 0x283, 0x383])
def test_who_does_not_say_all_in_time_has_said_nothing(lost: int) -> None:
    """And a good third of the cycle is left for the next command."""
    with Wired(example_session()).start() as bus:
        bus.master.exchange({})
        bus.silent.add(lost)
        for cycle in range(1, 4):
            assert set(bus.master.exchange({})) == {1, 2, 4}
            assert 0.005 * cycle <= bus.clock.now_s() <= 0.0065 * cycle
        bus.silent.clear()
        assert set(bus.master.exchange({})) == {1, 2, 3, 4}


def test_answers_may_come_until_then() -> None:
    """Whatever comes before them."""
    with Wired(example_session()).start() as bus:
        answer, waiting = bus.wire.answer, bus.wire.waiting
        bus.wire.answer = lambda can_id, data: None

        def late(now_s: float) -> None:
            if now_s >= 0.006 - 1e-9:
                answer(0x80, b"")
                waiting.rotate(2)

        bus.clock.advance.append(late)
        assert set(bus.master.exchange({})) == {1, 2, 3, 4}


def test_who_does_not_obey_is_left_to_itself() -> None:
    """NMT stop to all drives, once; no command and no heartbeat any more, and no complaints."""
    with Wired(example_session()) as bus:
        sensor = Layout(4, (), (Entry((0x2401, 1), 32, True),))
        bus.start(of=[*layouts(bus.session)[:3], sensor])
        bus.master.abandon()
        assert bus.wire.said == [(0, bytes((2, node))) for node in (1, 2, 3)]
        bus.wire.said.clear()
        bus.master.abandon()
        assert bus.wire.said == []
        bus.wire.say(0x83, b"\x30\x81\1")
        bus.wire.say(0x703, b"\4")
        assert set(bus.master.exchange({2: COMMAND})) <= {4}
        assert bus.wire.said == [(0x80, b"")]
        assert bus.master.faults() == []


def test_the_end_of_a_bus() -> None:
    """Nodes are left pre-operational, or as they are; then it may be opened again."""
    for stop in (True, False):
        session = example_session()
        bus = Wired(session).start()
        if stop:
            bus.master.close()
        else:
            bus.master.close(stop=False)
        bus.master.close()
        assert bus.wire.said == [(0, bytes((128, node))) for node in range(1, 5)] * stop
        assert bus.wire._is_shutdown
        with pytest.raises(BackendError, match="the bus is closed; connect again"):
            bus.master.exchange({})
        with pytest.raises(BackendError, match="CAN bus"):
            bus.master.send({2: COMMAND})
        Wired(session).master.close()


def test_a_bus_that_breaks_is_an_error_that_says_so() -> None:
    bus = Wired(example_session()).start()
    bus.wire.broken = True
    with pytest.raises(BackendError, match="CAN bus: broken; check that the interface is up"):
        bus.master.exchange({})
    with pytest.raises(BackendError, match="CAN bus: broken; check that the interface is up"):
        bus.master.send({2: COMMAND})
    with pytest.raises(BackendError, match=r"node 2 \(cable 2\): read of 0x1000:00: broken; look"):
        bus.master.sdo_read(2, 0x1000, 0)
    bus.master.close()
    with pytest.raises(BackendError, match="closed; connect again"):
        bus.master.exchange({})


def test_a_bus_that_breaks_while_others_are_listened_for() -> None:
    session = example_session()
    wire = Wire()
    wire.broken = True
    for _ in range(2):  # and whoever comes next may have it
        with pytest.raises(BackendError, match="CAN bus: broken"):
            CanopenFieldbus(session, SimulatedClock(), wire)


# --- what nodes complain of ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("can_id", "data", "said"),
    [
        (0x82, b"\x10\x23\x81\0\0\0\0\0", "node 2 (cable 2): EMCY 0x2310, error register 0x81"),
        (0x81, b"\x00\x01\0\0\0\0\0\0", "node 1 (cable 1): EMCY 0x0100, error register 0x00"),
        (0x82, b"\x00\x00\0\0\0\0\0\0", ""),  # the error is gone
        (0x82, b"\x01\x00\0\0\0\0\0\0", ""),
        (0x82, b"\x10\x23", "CAN bus: 0x082 is malformed"),
        (0x8F, b"\x10\x23\x81\0\0\0\0\0", ""),  # nobody of this session
        (0x702, b"\x05", ""),
        (0x702, b"\x85", ""),  # bit 7 belongs to node guarding
        (0x702, b"\x00", "node 2 (cable 2): is restarted"),
        (0x702, b"\x04", "node 2 (cable 2): is stopped"),
        (0x702, b"\x7f", "node 2 (cable 2): is pre-operational"),
        (0x702, b"\x06", "node 2 (cable 2): is in NMT state 6"),
        (0x702, b"", "CAN bus: 0x702 is malformed"),
        (0x282, b"\0" * 3, "node 2 (cable 2): TPDO 2 has 3 bytes"),
        (0x282, b"\0" * 8, ""),
    ],
)
def test_what_nodes_say_is_a_fault_or_none(can_id: int, data: bytes, said: str) -> None:
    with Wired(example_session()).start() as bus:
        bus.wire.say(can_id, data)
        bus.master.exchange({})
        assert bus.master.faults() == ([said] if said else [])
        assert bus.master.faults() == []
        # Frames of other kinds are nobody's.
        for kind in ("is_remote_frame", "is_extended_id"):
            bus.wire.say(can_id, b"" if kind == "is_remote_frame" else data, **{kind: True})
        bus.master.exchange({})
        assert bus.master.faults() == []


def test_an_error_frame_is_a_fault_from_the_start_on() -> None:
    with Wired(example_session()) as bus:
        bus.wire.say(0, is_error_frame=True)
        bus.start()  # whoever is plugged in may disturb
        assert bus.master.faults() == []
        bus.wire.say(0, is_error_frame=True)
        bus.master.exchange({})
        said = bus.master.faults()
        assert said == ["CAN bus: error frame; look at cables, termination and bit rate"]


def test_two_and_a_half_heartbeats_may_be_missing() -> None:
    """Of 100 ms, since a node was started or was last heard; said once."""
    with Wired(example_session()) as bus:
        bus.clock.sleep_until(5.0)
        bus.start()
        bus.silent.add(0x703)
        said: list[tuple[int, list[str]]] = []
        for cycle in range(60):
            bus.clock.sleep_until(5.0 + 0.0101 * cycle)
            if cycle == 20:
                bus.wire.say(0x703, b"\5")
            bus.master.exchange({})
            if faults := bus.master.faults():
                said.append((cycle, faults))
        # Heard in cycle 20; what was said once is not said again.
        assert said == [(45, ["node 3 (cable 3): its heartbeat is lost"])]


# --- opening -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("interface", "channel", "opened"),
    [
        ("socketcan", "can0", {"channel": "can0", "bitrate": 500_000}),
        ("virtual", "irma4", {"channel": "irma4"}),
        ("udp_multicast", "239.0.0.1", {"channel": "239.0.0.1", "hop_limit": 0}),
        ("udp_multicast", "239.0.0.1:43200",
         {"channel": "239.0.0.1", "hop_limit": 0, "port": 43200}),
        ("udp_multicast", "ff15::7:1", {"channel": "ff15::7:1", "hop_limit": 0}),
        ("udp_multicast", "239.0.0.1:x", {"channel": "239.0.0.1:x", "hop_limit": 0}),
        ("udp_multicast", "43200", {"channel": "43200", "hop_limit": 0}),
    ],
)  # fmt: skip
def test_how_a_bus_is_opened(
    interface: str, channel: str, opened: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is simulated does not leave this machine."""
    asked: list[dict[str, object]] = []
    monkeypatch.setattr(can, "Bus", lambda **options: asked.append(options))
    settings = CanopenBus(
        type="canopen", interface=interface, channel=channel, bitrate_bit_s=500_000
    )
    open_can_bus(settings)
    assert asked == [{"interface": interface} | opened]


def test_a_bus_that_cannot_be_opened_is_free_again() -> None:
    session = example_session(**{"interface: virtual": "interface: nobody-has-this",
                                 "port: simulated": "port: x", "simulated: {}": ""})  # fmt: skip
    refused = []  # a traceback would hold what was not given back
    for _ in range(2):
        with pytest.raises(BackendError, match=r"nobody-has-this test-\d+: cannot be opened") as it:
            CanopenFieldbus(session, SimulatedClock())
        refused.append(it)


def test_another_kind_of_bus_is_a_mistake_of_the_program() -> None:
    session = example_session().model_copy(update={"bus": ETH1})
    with pytest.raises(TypeError, match="canopen"):
        CanopenFieldbus(session, SimulatedClock())


@pytest.mark.parametrize(
    ("interface", "real", "listens_s"),
    [("virtual", False, 0.0), ("virtual", True, 0.5), ("udp_multicast", False, 0.5)],
)
def test_others_are_listened_for_half_a_second(
    interface: str, real: bool, listens_s: float
) -> None:
    """Only simulated drives in this process can have no other master."""
    changes = {"interface: virtual": f"interface: {interface}", "port: simulated": "port: x"}
    session = example_session(**changes, **({"simulated: {}": ""} if real else {}))
    clock = SimulatedClock()
    wire = Wire()
    wire.say(0, is_error_frame=True)  # not NMT
    wire.say(0x701, b"\5")
    CanopenFieldbus(session, clock, wire).close()
    assert clock.now_s() == listens_s
    # A node that talks on and on does not hold it up, nor hide a master.

    def talk(now_s: float) -> None:
        for _ in range(9):
            wire.say(0x701, b"\5")

    clock.advance.append(talk)
    CanopenFieldbus(session, clock, wire).close()
    assert clock.now_s() == 2.0 * listens_s
    wire.waiting.clear()
    wire.say(0x701, b"\5")
    wire.say(0x80)
    if listens_s:
        with pytest.raises(BackendError, match=r"another master speaks there \(0x080\)"):
            CanopenFieldbus(session, clock, wire)


def test_the_real_clock_sleeps_until_a_time_and_not_at_all_until_one_that_has_passed() -> None:
    clock = RealClock()
    began_s = clock.now_s()
    clock.sleep_until(began_s + 0.05)
    assert clock.now_s() >= began_s + 0.05
    before_s = time.thread_time()
    clock.sleep_until(began_s - 100.0)
    assert time.thread_time() - before_s < 0.05


def test_the_real_clock_waits_for_a_message_and_no_longer_than_it_may() -> None:
    clock = RealClock()
    here = can.Bus(interface="virtual", channel="test-clock")
    there = can.Bus(interface="virtual", channel="test-clock")
    try:
        began_s = clock.now_s()
        assert clock.receive(here, began_s + 0.05) is None
        assert clock.now_s() >= began_s + 0.05
        message = can.Message(arbitration_id=0x181, data=b"abc", is_extended_id=False)
        timer = threading.Timer(0.05, there.send, (message,))
        timer.start()
        received = clock.receive(here, clock.now_s() + 30.0)
        timer.join()
        assert received is not None
        assert received.arbitration_id == 0x181
        there.send(message)
        assert clock.receive(here, clock.now_s() - 1.0) is not None  # one that is there already
    finally:
        here.shutdown()
        there.shutdown()


def test_a_simulated_clock_may_be_told_how_fast_to_go() -> None:
    clock = SimulatedClock(speed=20.0)
    began_s = time.monotonic()
    told: list[float] = []
    clock.advance.append(told.append)
    clock.sleep_until(2.0)
    assert time.monotonic() - began_s >= 0.099
    assert clock.now_s() == 2.0
    clock.sleep_until(1.0)  # never backwards
    assert clock.now_s() == 2.0
    assert told == [2.0]


def test_priority_that_is_refused_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    said = take_priority()
    assert "runs without real-time priority (operation not permitted)" in said
    assert "limits.conf" in said
    leave_priority()  # what was never taken


def test_a_system_without_priorities_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "sched_setscheduler")
    assert "no real-time priority" in take_priority()
    leave_priority()
