"""The start-up over simulated CANopen: the same as without a bus, and safe whatever goes wrong."""

from __future__ import annotations

import io
import json
import math
import os
import re
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import can
import numpy as np
import pytest
import typer
from jsonschema import Draft202012Validator

import cdprcal
from cdprcal import Log, Robot, StartUpState
from cdprcal.acquisition import acquire, start_up_plan
from cdprcal.cli import devices
from cdprcal.hardware import BackendError
from cdprcal.hardware.connect import SessionBackend, leave_priority, take_priority
from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.cia402 import State
from cdprcal.hardware.drives.fieldbus import SimulatedClock
from cdprcal.hardware.drives.guard import Guard, torque_range
from cdprcal.hardware.drives.process_data import Image, Values
from cdprcal.hardware.session import Session, parse_session
from cdprcal.hardware.simulated import start_of
from cdprcal.io import AcquisitionInputs, load_log, open_live_log, read_inputs
from cdprcal.schemas import schema
from cdprcal.testing.simulated_devices.canopen_node import DriveNode
from cdprcal.testing.simulated_devices.connect import SimulatedSession
from cdprcal.testing.simulated_devices.faults import Fault, fault_kinds, quirk
from cdprcal.testing.simulated_devices.platform import set_plant
from conftest import Cli
from winch_bus import (
    AT_ONCE,
    EXAMPLE,
    Watched,
    WithoutBus,
    example_session,
    fine_session,
    judge,
    random_fault,
    torque_session,
    watched_run,
)

RUNS = int(os.environ.get("CDPRCAL_FAULT_RUNS", "30"))


@pytest.fixture(scope="module")
def direct(robot: Robot, plan: cdprcal.Plan, tmp_path_factory: pytest.TempPathFactory) -> Log:
    """The same start-up on the simulator without a bus, with the same seed."""
    path = tmp_path_factory.mktemp("direct") / "run.csv"
    options = cdprcal.SimulatorOptions(seed=1)
    set_plant(options, fine_session())
    backend = WithoutBus(robot, start_of(robot, plan, 1), options)
    startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
    run = acquire(startup, backend, open_live_log(path, 4, AcquisitionInputs("", "", {}), 10.0))
    assert run.state == StartUpState.done
    return load_log(path).log


@pytest.fixture(scope="module")
def wired(
    robot: Robot, plan: cdprcal.Plan, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Watched, Log]:
    """The start-up over CANopen."""
    path = tmp_path_factory.mktemp("wired") / "run.csv"
    watched = watched_run(fine_session(), robot, plan, path)
    return watched, load_log(path).log


def test_the_start_up_over_canopen_is_that_of_the_simulator(
    robot: Robot, wired: tuple[Watched, Log], direct: Log
) -> None:
    watched, log = wired
    assert watched.run.state == StartUpState.done
    assert len(watched.run.rests) == 4
    assert len(log) == len(direct)
    np.testing.assert_allclose(log.time_s, direct.time_s, atol=1e-9)
    # Commands are whole counts per second, so the plants drift apart by a few counts, and a reading
    # may be rounded to the next step: of the encoders, the load cells and a float32 quaternion.
    for name, step, steps in (
        ("length_m", 1e-6, 10),
        ("swivel_rad", 2 * np.pi / 65536, 2),
        ("tension_N", 0.01, 2),
        ("roll_pitch_yaw_rad", 1e-6, 6),
    ):
        np.testing.assert_allclose(getattr(log, name), getattr(direct, name), atol=steps * step)
    # Whether a reading counts as an outlier hangs on less than these steps: with the specified
    # noise none does.
    options = cdprcal.CalibrateOptions(noise=cdprcal.NoiseSource.specified)
    over_bus = cdprcal.calibrate(robot, log, options).result
    without = cdprcal.calibrate(robot, direct, options).result
    assert over_bus.status == without.status == cdprcal.CalibrationStatus.converged
    apart = over_bus.poses[0].position_m - without.poses[0].position_m
    assert without.covariance is not None
    deviation = np.sqrt(np.diag(without.covariance))
    assert (np.abs(apart) < 0.05 * deviation[:3]).all()
    turn_rad = cdprcal.minus(over_bus.poses[0], without.poses[0])[3:]
    assert (np.abs(turn_rad) < 0.05 * deviation[3:]).all()


def test_no_command_is_outside_the_limits_and_all_drives_end_switched_off(
    wired: tuple[Watched, Log],
) -> None:
    watched, _ = wired
    assert watched.sniffer.commands > 10_000
    assert watched.sniffer.outside == []
    assert watched.backend.tripped == ""
    assert watched.backend.simulated is not None
    states = {node.drive.state for node in watched.backend.simulated.nodes}
    assert states == {State.switch_on_disabled}


def test_torque_mode(robot: Robot, plan: cdprcal.Plan, tmp_path: Path) -> None:
    """Quantised by thousandths of the rated torque, half a newton here: its own run."""
    path = tmp_path / "run.mcap"
    watched = watched_run(torque_session(), robot, plan, path)
    assert watched.run.state == StartUpState.done, watched.run.reason
    assert watched.sniffer.outside == []
    truth = start_of(robot, plan, 1)
    result = cdprcal.calibrate(robot, load_log(path).log).result
    assert result.status == cdprcal.CalibrationStatus.converged
    assert np.isfinite(truth).all()


def test_settings_in_the_log_tell_the_devices(
    robot: Robot, plan: cdprcal.Plan, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    fault = Fault("AHRS silent", 1.5, serial=lambda data: b"")
    watched_run(example_session(), robot, plan, path, fault)
    inputs = read_inputs(path)
    assert inputs is not None
    settings = inputs.settings
    assert [drive["serial"] for drive in settings["drives"]] == [1001, 1002, 1003, 1004]
    assert settings["ahrs"]["device_id"] == "07812345"
    assert settings["session"]["rate_Hz"] == 100
    assert settings["armed"] is True


# --- faults --------------------------------------------------------------------------------------


def test_every_fault_stops_the_winches_within_two_cycles(
    robot: Robot, plan: cdprcal.Plan, tmp_path: Path
) -> None:
    """Each kind in turn, at random times, on random nodes, in both modes."""
    random = np.random.default_rng(7)
    kinds = list(fault_kinds())
    for number in range(RUNS):
        fault = random_fault(random, kinds[number % len(kinds)], 3.0)
        path = tmp_path / f"run{number}.{'csv' if number % 2 else 'mcap'}"
        session = (example_session, torque_session)[int(random.integers(2))](**AT_ONCE)
        watched = watched_run(session, robot, plan, path, fault, seed=number)
        assert judge(watched, fault) == [], f"{fault.name} at {fault.begin_s:.3f} s"
        file = load_log(path)
        assert file.findings == ()
        assert len(file.log) == watched.run.samples >= 8


def test_a_late_cycle(robot: Robot, plan: cdprcal.Plan, tmp_path: Path) -> None:
    """This computer is busy with something else for 30 ms: the drives have stopped already."""

    def dawdle(clock: SimulatedClock) -> None:
        if 2.0 <= clock.now_s() < 2.0 + 1e-3:
            clock.sleep_until(clock.now_s() + 0.03)

    session = example_session(**AT_ONCE)
    watched = watched_run(session, robot, plan, tmp_path / "run.csv", each_cycle=dawdle)
    assert watched.run.state == StartUpState.holding
    assert re.search(r"the control cycle began 2\d ms late", watched.run.reason)
    assert watched.sniffer.outside == []


def test_a_late_cycle_while_cables_are_wiggled(
    robot: Robot, plan: cdprcal.Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    backend = SimulatedSession.connect(example_session(), robot, plan, armed=True)
    sleep = SimulatedClock.sleep_until
    dawdled: list[float] = []

    def dawdle(clock: SimulatedClock, until_s: float) -> None:
        sleep(clock, until_s)
        if clock.now_s() >= 2.0 and not dawdled:
            dawdled.append(clock.now_s())
            sleep(clock, until_s + 0.03)

    monkeypatch.setattr(SimulatedClock, "sleep_until", dawdle)
    with pytest.raises(BackendError, match=r"armed: .*(began .. ms late|EMCY 0x8130)"):
        backend.read()
    assert backend.tripped
    backend.stop()


def test_a_cycle_late_by_less_than_allowed_is_none(
    robot: Robot, plan: cdprcal.Plan, tmp_path: Path
) -> None:
    def dawdle(clock: SimulatedClock) -> None:
        if 2.0 <= clock.now_s() < 2.0 + 1e-3:
            clock.sleep_until(clock.now_s() + 0.014)
        assert clock.now_s() < 4.0, "enough"

    with pytest.raises(AssertionError, match="enough"):
        watched_run(example_session(), robot, plan, tmp_path / "run.csv", each_cycle=dawdle)


def test_a_computer_that_hangs_is_missed_by_the_drives(robot: Robot, plan: cdprcal.Plan) -> None:
    """Nobody calls the backend any more: within two cycles the drives stop by themselves."""
    backend = SimulatedSession.connect(example_session(), robot, plan, armed=True)
    startup = cdprcal.StartUp(robot, start_up_plan(plan))
    for _ in range(50):
        backend.command(startup.step(backend.read()))
    assert backend.simulated is not None
    drives = [node.drive for node in backend.simulated.nodes]
    assert {drive.state for drive in drives} == {State.enabled}
    clock = backend._clock
    began_s = clock.now_s()
    while any(drive.state is State.enabled for drive in drives):
        clock.sleep_until(clock.now_s() + 1e-3)
        assert clock.now_s() - began_s < 0.021
    backend.stop()


def test_a_bus_that_fails_stops_the_robot(robot: Robot, plan: cdprcal.Plan, tmp_path: Path) -> None:
    session = example_session()
    backend = SimulatedSession.connect(session, robot, plan, armed=True)
    log = open_live_log(tmp_path / "run.csv", 4, AcquisitionInputs("", "", {}), 10.0)

    def pull_the_plug(*_: object) -> None:
        if backend._clock.now_s() > 1.5:
            backend._bus._bus.shutdown()  # type: ignore[attr-defined]

    startup = cdprcal.StartUp(robot, start_up_plan(plan))
    run = acquire(startup, backend, log, watch=pull_the_plug)
    assert run.state == StartUpState.holding
    assert "CAN bus: Cannot operate on a closed bus" in run.reason


def test_a_cable_that_slips_stops_the_robot(
    robot: Robot, plan: cdprcal.Plan, tmp_path: Path
) -> None:
    options = cdprcal.SimulatorOptions(
        seed=1, effects=[cdprcal.parse_injected_effect("slack=2.0,2,0.5")]
    )
    backend = SimulatedSession.connect(example_session(), robot, plan, options, armed=True)
    log = open_live_log(tmp_path / "run.csv", 4, AcquisitionInputs("", "", {}), 10.0)
    run = acquire(cdprcal.StartUp(robot, start_up_plan(plan)), backend, log)
    assert run.state == StartUpState.holding
    assert re.search(r"node 2 \(cable 2\): moved by \+50\d\.\d mm where", run.reason)


def sensors_apart() -> Session:
    """Load cells of cables 1 and 2 on node 20, all swivel encoders on node 21, 16 bits each."""
    text = EXAMPLE.read_text()
    for cable in (1, 2):
        before = (
            'object: "0x2401:01", type: int32, counts_per_N: 1000, valid_counts: [-50000, 600000]'
        )
        after = f'object: "0x6401:0{cable}", type: int16, counts_per_N: 50, node: 20'
        assert before in text
        text = text.replace(before, after, 1)
    for cable in range(1, 5):
        before = 'object: "0x60E4:02", type: int32, counts_per_turn: 1048576'
        after = f'object: "0x6004:0{cable}", type: uint16, counts_per_turn: 65536, node: 21'
        assert before in text
        text = text.replace(before, after, 1)
    return parse_session(text.replace("channel: irma4", "channel: test-apart"), "session")


def test_sensors_on_nodes_of_their_own(robot: Robot, plan: cdprcal.Plan, tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    watched = watched_run(sensors_apart(), robot, plan, path)
    assert watched.run.state == StartUpState.done, watched.run.reason
    # Encoders of a single turn wrap around; what is logged does not.
    assert np.abs(np.diff(load_log(path).log.swivel_rad, axis=0)).max() < 0.5


@pytest.mark.parametrize(("node", "words"), [(20, "load cell"), (21, "swivel encoder")])
def test_a_sensor_node_that_is_lost(
    node: int, words: str, robot: Robot, plan: cdprcal.Plan, tmp_path: Path
) -> None:
    lost = Fault(
        f"node lost of node {node}",
        2.0,
        from_nodes=lambda can_id, data: None if can_id & 0x7F == node else data,
    )
    watched = watched_run(sensors_apart(), robot, plan, tmp_path / "run.csv", lost)
    assert judge(watched, lost) == []
    assert f"the {words} does not answer" in watched.run.reason


# --- arming --------------------------------------------------------------------------------------


def test_a_dry_run_reads_and_never_tells_a_drive_anything(robot: Robot, plan: cdprcal.Plan) -> None:
    session = example_session()
    from winch_bus import Sniffer

    backend = SimulatedSession.connect(session, robot, plan, armed=False)
    sniffer = Sniffer(session, backend._clock.now_s)
    command = cdprcal.StartUp(robot, start_up_plan(plan)).step(backend.read())
    tensions = []
    for _ in range(100):
        backend.command(command)
        tensions.append(backend.read().tension_N)
    assert backend.simulated is not None
    assert {n.drive.state for n in backend.simulated.nodes} == {State.switch_on_disabled}
    backend.stop()
    sniffer.close()
    assert sniffer.commands == sniffer.enabling == 0
    assert len(sniffer.sync_s) > 100
    assert np.ptp(tensions, axis=0).min() > 0.0  # it is alive


def test_drives_without_brakes_hold_the_platform(robot: Robot, plan: cdprcal.Plan) -> None:
    session = example_session(**{"brakes: true": "brakes: false"})
    backend = SimulatedSession.connect(session, robot, plan, armed=True)
    for _ in range(20):
        backend.read()
    backend.stop()
    assert backend.simulated is not None
    assert {node.drive.state for node in backend.simulated.nodes} == {State.quick_stop}


def test_drives_that_hold_the_platform_do_so_until_they_are_enabled(
    robot: Robot, plan: cdprcal.Plan
) -> None:
    """A second run without brakes: switched off on the way, the platform would fall."""
    session = example_session(**{"brakes: true": "brakes: false"})

    def hold(nodes: list[DriveNode]) -> None:
        for node in nodes:
            node.drive.dictionary.set(cia402.QUICK_STOP_OPTION, cia402.QUICK_STOP_AND_STAY)
            node.drive.set_state(State.quick_stop)

    fault = Fault("held", math.inf, build=hold)
    backend = SimulatedSession.connect(session, robot, plan, armed=True, fault=fault)
    clock, simulated = backend._clock, backend.simulated
    assert isinstance(clock, SimulatedClock)
    assert simulated is not None
    seen: set[State] = set()
    clock.idle.append(lambda: seen.update(node.drive.state for node in simulated.nodes))
    seen.update(node.drive.state for node in simulated.nodes)
    backend.read()
    assert seen == {State.quick_stop, State.enabled}
    backend.stop()
    assert {node.drive.state for node in simulated.nodes} == {State.quick_stop}


def test_a_fault_from_before_is_reset_and_noted(robot: Robot, plan: cdprcal.Plan) -> None:
    fault = Fault("fault before arming", 0.0, happen=lambda nodes: nodes[2].drive.fail(0x7305))
    backend = SimulatedSession.connect(example_session(), robot, plan, armed=True, fault=fault)
    backend.read()
    assert backend.notes == [
        "node 3 (cable 3): remembers the errors 0x7305, newest first",
        "node 3 (cable 3): fault 0x7305 was reset",
    ]
    assert {winch.state for winch in backend.winches} == {State.enabled}
    backend.stop()


def test_what_was_said_before_arming_is_noted(robot: Robot, plan: cdprcal.Plan) -> None:
    backend = SimulatedSession.connect(example_session(), robot, plan, armed=True)
    assert backend.simulated is not None
    backend.simulated.nodes[1].emergency(0x8120)
    backend.read()
    assert backend.notes == [
        "said before arming: node 2 (cable 2): EMCY 0x8120, error register 0x01"
    ]
    backend.stop()


def test_a_drive_that_somebody_else_moves_is_left_alone(robot: Robot, plan: cdprcal.Plan) -> None:
    fault = Fault("moving", 0.0, happen=lambda nodes: nodes[3].drive.set_state(State.enabled))
    with pytest.raises(BackendError, match=r"node 4 \(cable 4\): is in operation enabled already"):
        SimulatedSession.connect(example_session(), robot, plan, armed=True, fault=fault)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"node: 3": "node: 33"}, r"node 33 \(cable 3\): read of 0x1000:00: no answer; check its"),
        ({"node: 2\n": "node: 2\n    serial_number: 7\n"}, r"node 2 \(cable 2\): has the serial "
         r"number 1002, the session says 7"),
    ],
)  # fmt: skip
def test_what_is_wired_otherwise_is_refused(
    change: dict[str, str], words: str, robot: Robot, plan: cdprcal.Plan
) -> None:
    # The simulated drives are wired as the example says, whatever the session does.
    session = example_session(**change)
    right = example_session()
    wrong = session.model_copy(update={"bus": right.bus})
    clock = SimulatedClock()
    from cdprcal.hardware.drives.backend import FieldbusBackend
    from cdprcal.hardware.drives.canopen_bus import CanopenFieldbus, open_can_bus
    from cdprcal.testing.simulated_devices.robot import SimulatedRobotOnCan

    assert right.bus.type == "canopen"
    simulated = SimulatedRobotOnCan(
        right, robot, start_of(robot, plan, 1), cdprcal.SimulatorOptions(), open_can_bus(right.bus)
    )
    clock.idle.append(simulated.process)
    bus = CanopenFieldbus(wrong, clock)
    with pytest.raises(BackendError, match=words):
        FieldbusBackend(wrong, robot, bus, None, clock, armed=True)
    simulated.close()


def answers(abort: int, index: int) -> Callable[[int, bytes], bytes]:
    """SDO responses about an object become aborts."""

    def tamper(can_id: int, data: bytes) -> bytes:
        if can_id & 0x780 == 0x580 and int.from_bytes(data[1:3], "little") == index:
            return b"\x80" + data[1:4] + abort.to_bytes(4, "little")
        return data

    return tamper


@pytest.mark.parametrize(
    ("tamper", "words"),
    [
        (answers(0x06010002, 0x6085), "write of 0x6085:00 refused"),
        (answers(0x06020000, 0x605A), "write of 0x605A:00 refused"),
        (answers(0x08000000, 0x1A00), "write of 0x1A00:00 refused"),
        (lambda i, d: None if i & 0x780 == 0x580 else d, "0x1000:00: no answer"),
        (lambda i, d: d[:2] if i & 0x780 == 0x580 else d, "0x1000:00"),
        (lambda i, d: b"\xff" * 8 if i & 0x780 == 0x580 else d, "0x1000:00"),
        (lambda i, d: None if i & 0x780 == 0x180 else d, "does not send its process data"),
    ],
)
def test_nodes_that_do_not_obey_while_they_are_set_up(
    tamper: Callable[[int, bytes], bytes | None],
    words: str,
    robot: Robot,
    plan: cdprcal.Plan,
) -> None:
    fault = Fault("set-up", 0.0, from_nodes=tamper)
    with pytest.raises(BackendError, match=words):
        SimulatedSession.connect(example_session(), robot, plan, armed=True, fault=fault)


def test_a_drive_without_abort_option_is_noted(robot: Robot, plan: cdprcal.Plan) -> None:
    fault = Fault("set-up", 0.0, from_nodes=answers(0x06020000, 0x6007))
    backend = SimulatedSession.connect(example_session(), robot, plan, armed=True, fault=fault)
    backend.stop()
    assert len(backend.notes) == 4
    assert "has no object 0x6007" in backend.notes[0]


@pytest.mark.parametrize("brakes", ["true", "false"])
def test_a_drive_that_does_not_obey_is_stopped_by_silence(
    brakes: str, robot: Robot, plan: cdprcal.Plan
) -> None:
    """Three cycles of quick stops that one drive does not hear: NMT stop, and no heartbeat."""
    session = example_session(**{"brakes: true": f"brakes: {brakes}"})
    deaf = quirk("deaf", 0.5, 2, deaf=True)
    backend = SimulatedSession.connect(session, robot, plan, armed=True, fault=deaf)
    for _ in range(60):
        backend.read()
    assert backend.simulated is not None
    drive = backend.simulated.nodes[1].drive
    heard: list[int] = []
    take = backend.simulated.take

    def listen(message: can.Message) -> None:
        heard.append(message.arbitration_id)
        take(message)

    backend.simulated.take = listen  # type: ignore[method-assign]
    assert drive.state is State.enabled
    began_s = backend._clock.now_s()
    backend.stop()
    assert drive.state is not State.enabled
    assert heard.count(0x77F) == 3  # and then no more
    assert heard.count(0) >= 4  # NMT
    assert backend._clock.now_s() - began_s < 0.05


def test_a_silent_ahrs_is_said_before_anything_moves(robot: Robot, plan: cdprcal.Plan) -> None:
    fault = Fault("AHRS", 0.0, serial=lambda data: b"")
    with pytest.raises(BackendError, match="AHRS on simulated: does not answer"):
        SimulatedSession.connect(example_session(), robot, plan, armed=True, fault=fault)


def test_session_and_robot_must_fit(robot: Robot, plan: cdprcal.Plan) -> None:
    for change, words in (
        ({"robot: irma4": "robot: irma8"}, "is of robot irma8, not of irma4"),
        ({"[10, 420]": "[30, 420]"}, r"limits\.tension_N\[#1\]: 30 N must be 0 to 20"),
    ):
        with pytest.raises(cdprcal.InputError, match=words):
            SimulatedSession.connect(example_session(**change), robot, plan, armed=True)


def test_a_drive_that_does_not_enable_is_said_in_the_log(
    robot: Robot, plan: cdprcal.Plan, tmp_path: Path
) -> None:
    path = tmp_path / "run.csv"
    fault = Fault("deaf", 0.0, to_nodes=lambda i, data: None if i == 0x203 else data)
    watched = watched_run(example_session(), robot, plan, path, fault)
    words = "node 3 (cable 3): does not become switched on; it says: switch on disabled"
    assert watched.run.state == StartUpState.holding
    assert words in watched.run.reason
    assert words in path.read_text()
    assert watched.backend.simulated is not None
    assert State.enabled not in {node.drive.state for node in watched.backend.simulated.nodes}


def test_real_time_priority_is_taken_and_given_back() -> None:
    """Where this user may; threads that are started meanwhile do not have it."""
    before = os.sched_getscheduler(0)
    said = take_priority()
    try:
        if said:
            assert "without real-time priority" in said
            assert os.sched_getscheduler(0) == before
        else:
            assert os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO
            others: list[int] = []
            thread = threading.Thread(target=lambda: others.append(os.sched_getscheduler(0)))
            thread.start()
            thread.join()
            assert others == [os.SCHED_OTHER]
    finally:
        leave_priority()
    assert os.sched_getscheduler(0) == os.SCHED_OTHER


# --- the last layer ------------------------------------------------------------------------------


class Recorded:
    """A bus that keeps what is sent."""

    def __init__(self) -> None:
        self.sent: list[dict[int, Values]] = []

    def send(self, outputs: Image) -> None:
        self.sent.append({node: dict(values) for node, values in outputs.items()})

    exchange = send


def output(velocity: int, torque: int = 0, word: int = cia402.ENABLE_OPERATION) -> Values:
    return {
        cia402.CONTROLWORD: word,
        cia402.MODE: cia402.CSV,
        cia402.TARGET_VELOCITY: velocity,
        cia402.TARGET_TORQUE: torque,
    }


def test_the_guard_cuts_what_is_too_much() -> None:
    bus, session = Recorded(), torque_session()
    guard = Guard(bus, session, armed=True)  # type: ignore[arg-type]
    guard.measured({1: 100.0, 2: 100.0})
    guard.send({1: output(10**9, -(2**15)), 2: output(10**9, -(2**15))})
    low, high = torque_range(session.winches[0], session)
    assert (low, high) == (-875, -21)  # 420 and 10 N at 0.05 m, 10:1, 2.4 Nm: -875.0, -20.8
    assert bus.sent[-1][1] == output(4_000_000, low)
    # The second winch counts the other way round: 10 N is 20.8, 420 N 875.
    assert bus.sent[-1][2] == output(4_000_000, 21)


@pytest.mark.parametrize(
    ("tension_N", "reel_in", "pay_out"),
    [(100.0, -5, 5), (420.0, 0, 5), (500.0, 0, 5), (10.0, -5, 0), (0.0, -5, 0), (math.nan, 0, 0)],
)
def test_a_cable_at_a_limit_is_only_moved_back(
    tension_N: float, reel_in: int, pay_out: int
) -> None:
    bus = Recorded()
    guard = Guard(bus, example_session(), armed=True)  # type: ignore[arg-type]
    guard.measured({1: tension_N, 2: tension_N})
    guard.send({1: output(-5), 2: output(5)})  # sign 1 and -1: both reel in
    assert [values[cia402.TARGET_VELOCITY] for values in bus.sent[-1].values()] == [
        reel_in,
        -reel_in,
    ]
    guard.send({1: output(5), 2: output(-5)})
    assert [values[cia402.TARGET_VELOCITY] for values in bus.sent[-1].values()] == [
        pay_out,
        -pay_out,
    ]


def test_once_tripped_only_quick_stops_pass() -> None:
    bus = Recorded()
    guard = Guard(bus, example_session(), armed=True)  # type: ignore[arg-type]
    guard.measured({1: 100.0})
    guard.send({1: output(5)})
    guard.trip("first")
    guard.trip("second")
    guard.send({1: output(5)})
    assert guard.reason == "first"
    words = [sent[1][cia402.CONTROLWORD] for sent in bus.sent]
    assert words == [cia402.ENABLE_OPERATION, cia402.QUICK_STOP, cia402.QUICK_STOP]
    assert bus.sent[-1][1][cia402.TARGET_VELOCITY] == 0


# --- the command ---------------------------------------------------------------------------------


def test_acquire_over_canopen_calibrates(cli: Cli, plan_path: Path, tmp_path: Path) -> None:
    log, truth = tmp_path / "run.mcap", tmp_path / "truth.json"
    ran = cli("acquire", "irma4", plan_path, "--backend", "canopen", "--session", EXAMPLE,
              "--seed", 3, "--quick", "-o", log, "--truth", truth, "--json")  # fmt: skip
    assert ran.document()["state"] == "done"
    found = cli("calibrate", "irma4", log, "--json").document()["initial_pose"]["position_m"]
    true = json.loads(truth.read_text())["poses"][0]["position_m"]
    assert np.linalg.norm(np.subtract(found, true)) < 2e-3  # the cables stretch by up to 1 mm


def test_dry_run_command(cli: Cli, plan_path: Path, tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    arguments = ("acquire", "irma4", plan_path, "--backend", "canopen", "--session", EXAMPLE,
                 "--dry-run", "--seconds", 1, "-o", log)  # fmt: skip
    ran = cli(*arguments, "--json")
    document = ran.document()
    Draft202012Validator(schema("acquire-dry-run")).validate(document)
    assert document["state"] == "dry_run"
    assert [row["state"] for row in document["winches"]] == ["switch on disabled"] * 4
    assert len(document["roll_pitch_yaw_rad"]) == 3
    assert "no drive was enabled" in ran.stderr
    assert not log.exists()


def test_wrong_use_of_acquire(cli: Cli, plan_path: Path, tmp_path: Path) -> None:
    log, session = tmp_path / "run.mcap", tmp_path / "session.yaml"
    session.write_text(EXAMPLE.read_text().replace("cable: 4", "cable: 9"))
    real = tmp_path / "real.yaml"
    text = EXAMPLE.read_text().replace("simulated: {}", "").replace("port: simulated", "port: x")
    real.write_text(text.replace("interface: virtual", "interface: socketcan"))
    for arguments, code, words in (
        (("--backend", "canopen"), 2, "needs --session FILE"),
        (("--session", EXAMPLE), 2, "need --backend canopen"),
        (("--arm",), 2, "need --backend canopen"),
        (("--backend", "ethercat", "--session", EXAMPLE), 2, "is of bus.type canopen"),
        (("--backend", "canopen", "--session", session), 2, r"session\.yaml:\d+:\d+: winches"),
        (("--backend", "canopen", "--session", tmp_path / "no"), 2, "cannot be read"),
        (("--backend", "canopen", "--session", real, "--effect", "mass=1"), 2, "--effect: is for"),
        (("--backend", "canopen", "--session", real), 1, "CAN bus socketcan irma4: cannot be open"),
        (("--backend", "canopen", "--session", EXAMPLE, "--dry-run", "--seconds", "0"), 2, "above"),
    ):
        ran = cli("acquire", "irma4", plan_path, "-o", log, *arguments)
        assert ran.code == code, ran.stderr
        assert re.search(words, ran.stderr), ran.stderr
        assert "Traceback" not in ran.stderr
        assert not log.exists()


@pytest.mark.parametrize(
    ("terminal", "answer", "yes", "code"),
    [
        (True, "y\n", False, None),
        (True, "n\n", False, 1),
        (True, "\n", False, 1),
        (False, "", False, 2),
        (False, "", True, None),
        (True, "", True, None),
    ],
)
def test_limits_of_a_real_robot_are_confirmed(
    terminal: bool, answer: str, yes: bool, code: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At a terminal by the operator, in a script by --yes; else nothing moves, and the bus ends."""
    stopped = []
    real = SessionBackend.__new__(SessionBackend)
    monkeypatch.setattr(SessionBackend, "stop", lambda self: stopped.append(self))
    stdin = io.StringIO(answer)
    monkeypatch.setattr(stdin, "isatty", lambda: terminal)
    monkeypatch.setattr(sys, "stdin", stdin)
    if code is None:
        devices.confirm(real, yes=yes)
    else:
        with pytest.raises(typer.Exit) as ended:
            devices.confirm(real, yes=yes)
        assert ended.value.exit_code == code
    assert stopped == ([] if code is None else [real])


def test_the_operator_stops_a_robot_that_is_being_armed(
    robot: Robot, plan: cdprcal.Plan, tmp_path: Path
) -> None:
    """In the first read, while cables are wiggled; the run ends as any that the operator stops."""
    backend = SimulatedSession.connect(example_session(), robot, plan, armed=True)
    begin_s = backend._clock.now_s()
    startup = cdprcal.StartUp(robot, start_up_plan(plan))
    log = open_live_log(tmp_path / "run.csv", 4, AcquisitionInputs("", "", {}), 10.0)
    run = acquire(startup, backend, log, stop=lambda: backend._clock.now_s() > begin_s + 1.5)
    assert run.state == cdprcal.StartUpState.holding
    assert run.reason == "stopped by the operator"
    assert 1.5 < backend._clock.now_s() - begin_s < 2.0


def test_simulated_drives_need_no_confirmation(robot: Robot, plan: cdprcal.Plan) -> None:
    backend = SimulatedSession.connect(example_session(), robot, plan, armed=True)
    devices.confirm(backend, yes=False)
    backend.stop()


def test_no_bus_is_left_open() -> None:
    """Of all the runs above: every end has left its channel."""
    from can.interfaces import virtual

    assert not [name for name in virtual.channels if str(name).startswith("test-")]
    assert can.__version__
