"""Studies of the winches and the AHRS: faults, timing, garbage.

    python tests/studies/hardware.py faults --runs 200     # injected at random times
    python tests/studies/hardware.py same --seeds 10       # over CANopen as on the simulator
    python tests/studies/hardware.py frames --count 1000000
    python tests/studies/hardware.py jitter                # of this machine, at 100 Hz
    python tests/studies/hardware.py jitter --table        # … 100 to 1000 Hz, also stalled
    python tests/studies/hardware.py fuzz --seconds 300    # needs: pip install atheris

Each prints what it measured on stdout and ends with exit code 1 when a requirement is not met.
"""

from __future__ import annotations

import argparse
import os
import pty
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))

import cdprcal
from cdprcal.acquisition import Guide, acquire, start_up_plan
from cdprcal.acquisition import monitor as monitor_module
from cdprcal.acquisition.beside import Beside, LogBeside
from cdprcal.acquisition.monitor import Monitor
from cdprcal.hardware.connect import leave_priority, take_priority
from cdprcal.hardware.drives.backend import FieldbusBackend
from cdprcal.hardware.drives.canopen_bus import CanopenFieldbus, open_can_bus
from cdprcal.hardware.drives.fieldbus import RealClock
from cdprcal.hardware.session import CanopenBus
from cdprcal.hardware.simulated import start_of
from cdprcal.hardware.xsens import measurement as mt
from cdprcal.hardware.xsens.device import XsensMti
from cdprcal.hardware.xsens.frames import FrameReader
from cdprcal.io import AcquisitionInputs, load_log, open_live_log
from cdprcal.testing.simulated_devices.faults import fault_kinds
from cdprcal.testing.simulated_devices.mti import SimulatedPort
from cdprcal.testing.simulated_devices.platform import set_plant
from cdprcal.testing.simulated_devices.robot import SimulatedRobotOnCan
from test_xsens import PACKET, mutated
from winch_bus import (
    WithoutBus,
    example_session,
    fine_session,
    judge,
    random_fault,
    small_plan,
    torque_session,
    watched_run,
)

NO_INPUTS = AcquisitionInputs("", "", {})


def faults(runs: int, seed: int) -> bool:
    """Each kind of fault in turn, at random times of the whole start-up, on random nodes."""
    robot = cdprcal.load_robot("irma4")
    plan = small_plan(robot)
    random = np.random.default_rng(seed)
    kinds = list(fault_kinds())
    cycles: Counter[str] = Counter()
    commands, wrong = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(runs):
            fault = random_fault(random, kinds[number % len(kinds)], 24.0)
            session = (example_session, torque_session)[int(random.integers(2))]()
            path = Path(folder) / f"{number}.{('csv', 'mcap')[number % 2]}"
            watched = watched_run(session, robot, plan, path, fault, seed=number)
            problems = judge(watched, fault)
            if len(load_log(path).log) != watched.run.samples:
                problems.append("the log is not whole")
            commands += watched.sniffer.commands
            kind = fault.name.rsplit(" of node", 1)[0]
            cycles[kind] = max(cycles[kind], watched.cycles)
            wrong += bool(problems)
            if problems:
                print(f"{fault.name} at {fault.begin_s:.3f} s, {session.mode}: {problems}")
    for kind, most in cycles.items():
        print(f"{kind:28} off within {most} cycles")
    print(f"{runs} runs, {commands} commands on the bus: {wrong} runs not as they must be")
    return not wrong


def same(seeds: int) -> bool:
    """How far estimates over CANopen are from those of the simulator without a bus."""
    robot = cdprcal.load_robot("irma4")
    plan = small_plan(robot)
    worst_m = worst_share = 0.0
    for seed in range(seeds):
        with tempfile.TemporaryDirectory() as folder:
            wired, direct = Path(folder) / "wired.csv", Path(folder) / "direct.csv"
            watched_run(fine_session(), robot, plan, wired, seed=seed)
            options = cdprcal.SimulatorOptions(seed=seed)
            set_plant(options, example_session())
            backend = WithoutBus(robot, start_of(robot, plan, seed), options)
            startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
            acquire(startup, backend, open_live_log(direct, 4, NO_INPUTS, 10.0))
            a = cdprcal.calibrate(robot, load_log(wired).log).result
            b = cdprcal.calibrate(robot, load_log(direct).log).result
        assert b.covariance is not None
        apart = np.abs(cdprcal.minus(a.poses[0], b.poses[0]))
        share = float((apart / np.sqrt(np.diag(b.covariance))).max())
        worst_share = max(worst_share, share)
        worst_m = max(worst_m, float(np.linalg.norm(apart[:3])))
        um, urad = (1e6 * np.linalg.norm(part) for part in (apart[:3], apart[3:]))
        print(f"seed {seed}: {um:.1f} µm, {urad:.1f} µrad, {share:.3f} standard deviations")
    print(f"worst: {1e6 * worst_m:.1f} µm, {worst_share:.3f} standard deviations")
    # The coarsest step, the swivel encoder's, is 0.07 of its noise; whether a reading counts as an
    # outlier may hang on less.
    return worst_share < 0.2


def frames(count: int) -> bool:
    """Random and mutated frames: no exception; and the rate of whole ones."""
    random = np.random.default_rng(1)
    reader, parsed, found = FrameReader(), 0, 0
    for number, packet in enumerate(mutated(random, count)):
        for frame in reader.feed(packet if number % 4 else random.bytes(40)):
            found += 1
            measurement = mt.parse(frame.data)
            if measurement is not None and mt.rotation_enu_sensor(measurement) is not None:
                parsed += 1
    print(f"{count} frames, {found} with a right checksum, {parsed} attitudes, no exception")
    data = PACKET * 1000
    rates = []
    for _ in range(20):
        began = time.perf_counter()
        whole = [mt.parse(frame.data) for frame in FrameReader().feed(data)]
        rates.append(len(whole) / (time.perf_counter() - began))
    print(f"{np.median(rates):.0f} frames per second (median of {len(rates)} times 1000)")
    return bool(np.median(rates) > 1e5)


_STREAMS: list[Any] = []  # kept: see jitter_table


class StalledDisk:
    """A log that stands still for a second at every tenth row, and at last is full."""

    def __init__(self) -> None:
        self._rows = 0

    def sample(self, *_: Any) -> None:
        self._rows += 1
        if self._rows % 10 == 0:
            time.sleep(1.0)

    def event(self, _event: Any) -> None: ...

    def close(self) -> None:
        raise OSError(28, "No space left on device")


def jitter_table(seconds: float) -> bool:
    """A row a rate: as it is, and with a terminal that nobody reads and a disk that stands still.

    Stalled as before there was a thread beside the control loop is not measured: it never ends.
    """
    print("| rate [Hz] | | cycles | late, 99 % [ms] | 99.9 % | worst | ended |")
    print("|---|---|---|---|---|---|---|")
    for rate_Hz in (100, 250, 500, 1000):
        for stalled in (False, True):
            jitter(seconds, rate_Hz, stalled=stalled, row=True)
    sys.stdout.flush()
    os._exit(0)  # closing a terminal that nobody reads would wait for ever


def jitter(seconds: float, rate_Hz: int, *, stalled: bool = False, row: bool = False) -> bool:
    """How late cycles begin on this machine, by its own clock; simulated nodes in a thread."""
    robot = cdprcal.load_robot("irma4")
    plan = small_plan(robot)
    session = example_session(**{"rate_Hz: 100\n": f"rate_Hz: {rate_Hz}\n"})
    # As little as may be stops the run: what would have is what is measured.
    late_s = 11.0 / rate_Hz
    safety = session.safety.model_copy(update={"late_s": late_s, "missed_cycles": 10})
    assert session.ahrs is not None
    ahrs = session.ahrs.model_copy(update={"stale_s": 0.35})
    session = session.model_copy(update={"safety": safety, "simulated": None, "ahrs": ahrs})
    assert isinstance(session.bus, CanopenBus)
    assert session.ahrs is not None
    port = SimulatedPort(session.ahrs)
    simulated_session = session.model_copy(update={"simulated": example_session().simulated})
    options = cdprcal.SimulatorOptions(seed=1)
    start = start_of(robot, plan, 1)
    can_bus = open_can_bus(session.bus)
    simulated = SimulatedRobotOnCan(simulated_session, robot, start, options, can_bus, port.device)
    clock, done = RealClock(), threading.Event()
    began_s = clock.now_s()

    def serve() -> None:
        while not done.is_set():
            message = can_bus.recv(0.05)
            if message is not None:
                simulated.advance(clock.now_s() - began_s)
                simulated.take(message)

    thread = threading.Thread(target=serve)
    thread.start()
    said = take_priority() or "with real-time priority, as acquire has it"
    if not row:
        print(said)
    late: list[float] = []
    answers: list[float] = []
    try:
        attitude = XsensMti(port, session.ahrs)
        backend = FieldbusBackend(
            session, robot, CanopenFieldbus(session, clock), attitude, clock, armed=True
        )
        startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
        # All that runs beside the control loop in cdprcal acquire.
        guide = Guide(robot, plan, startup, asked=None, quick=True, background=True)
        read, command = backend.read, backend.command

        def timed_read() -> cdprcal.RobotSample:
            sample = read()
            late.append(sample.time_s - len(late) / rate_Hz)
            answers.append(clock.now_s())
            return sample

        def timed_command(wanted: cdprcal.StartUpCommand) -> None:
            command(wanted)
            answers[-1] = clock.now_s() - answers[-1]

        _other, here = pty.openpty()  # nobody reads the other end
        _STREAMS.append(
            stream := os.fdopen(here if stalled else os.open(os.devnull, os.O_WRONLY), "w")
        )
        monitor_module.__dict__["notes"] = lambda: Console(
            file=stream, force_terminal=True, width=100
        )
        monitor = Monitor(robot, plan, "run.mcap", beside=Beside("terminal"))

        def watch(*now: Any) -> None:
            monitor.show(now[0], now[1], guide.step(*now))
            if stalled:
                monitor.tell("x" * 200)  # fills what the terminal takes at once

        backend.read = timed_read  # type: ignore[method-assign]
        backend.command = timed_command  # type: ignore[method-assign, assignment]
        with tempfile.TemporaryDirectory() as folder, monitor:
            log = (
                StalledDisk()
                if stalled
                else open_live_log(Path(folder) / "run.mcap", 4, NO_INPUTS, 10.0)
            )
            run = acquire(
                startup,
                backend,
                LogBeside(log),
                stop=lambda: len(late) >= seconds * rate_Hz,
                watch=watch,
            )
        guide.close()
    finally:
        leave_priority()
        done.set()
        thread.join()
        simulated.close()
    if row:
        p = 1e3 * np.percentile(late or [np.nan], [99, 99.9, 100])
        what = "terminal and disk stalled" if stalled else "as it is"
        print(
            f"| {rate_Hz} | {what} | {len(late)} | {p[0]:.2f} | {p[1]:.2f} | {p[2]:.2f} | "
            f"{run.reason or 'as asked'} |",
            flush=True,
        )
        return True
    work = answers[:-1]
    for name, values in (("cycle begins late", late), ("answer takes", work)):
        p = 1e3 * np.percentile(values, [50, 99, 99.9, 100])
        print(f"{name}: median {p[0]:.2f} ms, 99 % {p[1]:.2f}, 99.9 % {p[2]:.2f}, worst {p[3]:.2f}")
    print(f"{len(late)} cycles at {rate_Hz} Hz with 4 nodes; {run.reason or 'to its end'}")
    return True


def fuzz(seconds: int) -> bool:
    """Coverage-guided: any bytes through the frame reader and the parser."""
    import atheris

    with atheris.instrument_imports():
        import importlib

        from cdprcal.hardware.xsens import frames as frames_module

        importlib.reload(frames_module)
        importlib.reload(mt)

    def one(data: bytes) -> None:
        reader = frames_module.FrameReader()
        half = len(data) // 2
        for frame in reader.feed(data[:half]) + reader.feed(data[half:]):
            measurement = mt.parse(frame.data)
            if measurement is not None:
                mt.rotation_enu_sensor(measurement)
        measurement = mt.parse(data)
        if measurement is not None:
            mt.rotation_enu_sensor(measurement)

    with tempfile.TemporaryDirectory() as corpus:
        for number, packet in enumerate(mutated(np.random.default_rng(0), 50)):
            (Path(corpus) / str(number)).write_bytes(packet)
        atheris.Setup(
            [sys.argv[0], corpus, f"-max_total_time={seconds}", "-print_final_stats=1",
             "-max_len=600"], one)  # fmt: skip
        atheris.Fuzz()  # ends the process: 0 when nothing was found
    return True


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    studies = parser.add_subparsers(dest="study", required=True)
    one = studies.add_parser("faults")
    one.add_argument("--runs", type=int, default=200)
    one.add_argument("--seed", type=int, default=1)
    studies.add_parser("same").add_argument("--seeds", type=int, default=10)
    studies.add_parser("frames").add_argument("--count", type=int, default=1_000_000)
    one = studies.add_parser("jitter")
    one.add_argument("--seconds", type=float, default=30.0)
    one.add_argument("--rate", type=int, default=100)
    one.add_argument("--table", action="store_true")
    studies.add_parser("fuzz").add_argument("--seconds", type=int, default=300)
    chosen = parser.parse_args()
    fine = {
        "faults": lambda: faults(chosen.runs, chosen.seed),
        "same": lambda: same(chosen.seeds),
        "frames": lambda: frames(chosen.count),
        "jitter": lambda: (
            jitter_table(chosen.seconds) if chosen.table else jitter(chosen.seconds, chosen.rate)
        ),
        "fuzz": lambda: fuzz(chosen.seconds),
    }[chosen.study]()
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
