"""One master a bus, and answers that belong to their cycle."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator

import can
import pytest

import cdprcal
from cdprcal.hardware import BackendError
from cdprcal.hardware.drives.bus_lock import BusLock
from cdprcal.hardware.drives.canopen_bus import CanopenFieldbus, open_can_bus
from cdprcal.hardware.drives.fieldbus import SimulatedClock
from cdprcal.hardware.session import CanopenBus, EthercatBus
from cdprcal.testing.simulated_devices.connect import SimulatedSession
from winch_bus import example_session, small_plan


@pytest.fixture(scope="module")
def plan(robot: cdprcal.Robot) -> cdprcal.Plan:
    return small_plan(robot)


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
    with pytest.raises(BackendError, match=rf"another master speaks there \(0x{can_id:03X}\)"):
        CanopenFieldbus(session, clock)  # type: ignore[arg-type]
    somebody.speak()
    assert somebody.heard == 0
    # It has left the bus: the next one is refused for the same reason, not for the lock.
    with pytest.raises(BackendError, match="another master speaks"):
        CanopenFieldbus(session, clock)  # type: ignore[arg-type]


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
