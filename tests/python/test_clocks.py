"""The clock of real devices, and the priority that a control loop asks for."""

from __future__ import annotations

import os
import threading
import time

import can
import pytest

from cdprcal.hardware.connect import leave_priority, take_priority
from cdprcal.hardware.drives.fieldbus import RealClock, SimulatedClock


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
