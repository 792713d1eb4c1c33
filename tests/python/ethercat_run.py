"""What test_winch_ethercat.py and hazards.py run in a network of their own: prints a JSON document.

unshare -rn python tests/python/ethercat_run.py start-up|dry|hang|drive|cable|emergency|SEED

SEED: a hazard that is drawn by it, or two at once.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pysoem

import cdprcal
from cdprcal.acquisition import acquire, start_up_plan
from cdprcal.hardware import BackendError
from cdprcal.hardware.drives.backend import FieldbusBackend
from cdprcal.hardware.drives.ethercat_bus import EthercatFieldbus
from cdprcal.hardware.drives.fieldbus import SimulatedClock
from cdprcal.hardware.drives.process_data import Image
from cdprcal.hardware.session import Session, parse_session
from cdprcal.hardware.simulated import start_of
from cdprcal.hardware.xsens.device import XsensMti, open_port
from cdprcal.io import AcquisitionInputs, load_log, open_live_log
from cdprcal.testing.simulated_devices.__main__ import PtyMti
from cdprcal.testing.simulated_devices.connect import LockstepAttitude
from cdprcal.testing.simulated_devices.ethercat_robot import (
    SimulatedRobotOnEthercat,
    control_frame,
    raw_socket,
)
from robots import small_plan
from winch_bus import AT_ONCE, EXAMPLE, FINER, WithoutBus
from winch_hazards import MODES, SESSION

NO_INPUTS = AcquisitionInputs("", "", {})
OURS, THEIRS = "ec0", "ec1"
FAULT_S = 2.0
ENABLED = "operation enabled"


def make_cable() -> None:
    """A pair of interfaces in this network namespace."""
    for command in (
        ["ip", "link", "add", OURS, "type", "veth", "peer", "name", THEIRS],
        ["ip", "link", "set", OURS, "up"],
        ["ip", "link", "set", THEIRS, "up"],
    ):
        subprocess.run(command, check=True, capture_output=True)


def comparable(text: str) -> str:
    """Begins at once, its counts finer than the sensors: as winch_bus.fine_session."""
    for old, new in {**FINER, **AT_ONCE}.items():
        assert old in text
        text = text.replace(old, new)
    return text


def ethercat_session(
    folder: str, change: Callable[[str], str] = comparable, mode: str = "velocity"
) -> Session:
    text = change(EXAMPLE.read_text()).replace("mode: velocity", f"mode: {mode}")
    canopen = "bus: {type: canopen, interface: virtual, channel: irma4}"
    assert canopen in text
    text = text.replace(canopen, f"bus: {{type: ethercat, interface: {OURS}}}")
    text = text.replace("simulated: {}", "").replace("port: simulated", f"port: {folder}/mti")
    return parse_session(text, "session")


@dataclass(frozen=True)
class Drawn:
    """Something that goes wrong over EtherCAT."""

    name: str
    cause: str  #: words that the reason must have
    mode: str = "velocity"
    told: Mapping[str, Any] | None = None  #: to the simulated robot, at a time from arming on
    at_s: float = 0.0
    wrong: Callable[[str], str] = lambda text: text  #: what the session says


def drawn(seed: int) -> Drawn:
    """A fault of a drive or of the cable, a mistake in the session, or both at once."""
    random = np.random.default_rng([seed, 2])
    mode = str(random.choice(MODES))
    mistakes = [h for h in SESSION if mode in h.modes and h.fault is None]
    mistake = mistakes[int(random.integers(len(mistakes)))]
    node = int(random.integers(1, 5))
    faults = (
        (f"a drive fails, node {node}", {"fail": node - 1}, rf"node {node}\b"),
        (f"an emergency of node {node}", {"emergency": node - 1}, rf"node {node}\b"),
        ("the cable is cut", {"cut": True}, "does not answer"),
    )
    name, told, cause = faults[int(random.integers(len(faults)))]
    at_s, which = float(random.uniform(0.5, 20.0)), random.random()
    if which < 1.0 / 3.0:
        return Drawn(mistake.name, mistake.cause, mode, wrong=mistake.wrong)
    if which < 2.0 / 3.0:
        return Drawn(name, cause, mode, told, at_s)
    both = f"{mistake.name} + {name}"
    return Drawn(both, f"{mistake.cause}|{cause}", mode, told, at_s, mistake.wrong)


def simulator_options() -> cdprcal.SimulatorOptions:
    options = cdprcal.SimulatorOptions(seed=1)
    strand, winch = options.strand, options.winch
    strand.axial_stiffness_N, winch.mode = 1.5e5, cdprcal.WinchMode.velocity
    options.strand, options.winch = strand, winch
    return options


class Robot:
    """The simulated robot in a child process, and the line that its clock is told by."""

    def __init__(self, session: Session, robot: cdprcal.Robot, plan: cdprcal.Plan) -> None:
        ready, tell = os.pipe()
        self._child = os.fork()
        if self._child == 0:
            assert session.ahrs is not None
            with PtyMti(session.ahrs) as mti:
                simulated = SimulatedRobotOnEthercat(
                    session, robot, start_of(robot, plan, 1), simulator_options(), THEIRS,
                    mti.device,
                )  # fmt: skip
                os.write(tell, b"1")
                while True:
                    simulated.serve(0.002)
                    mti.serve()
        assert os.read(ready, 1)
        self._socket = raw_socket(OURS)
        self._socket.settimeout(10.0)
        self.now_s = 0.0
        self.states: list[str] = []
        self._most_N = 1.1 * session.limits.tension_N[1]
        self.peak_N = self.over_s = self._seen_s = 0.0  # of the true tensions

    def tell(self, **told: Any) -> None:
        self._socket.send(control_frame({"now_s": self.now_s, **told}))
        while True:
            frame = self._socket.recv(2048)
            if frame[6] & 0x02:
                answer = json.loads(frame[14:].rstrip(b"\0"))
                self.states = answer["states"]
                self.peak_N = max(self.peak_N, answer["tension_N"])
                self.over_s += (self.now_s - self._seen_s) * (answer["tension_N"] > self._most_N)
                self._seen_s = self.now_s
                return

    def advance(self, now_s: float) -> None:
        self.now_s = now_s
        self.tell()

    def close(self) -> None:
        os.kill(self._child, signal.SIGTERM)
        os.waitpid(self._child, 0)


class InStep(EthercatFieldbus):
    """Says when a cycle begins: commands go out between cycles too."""

    robot: Robot | None = None

    def exchange(self, outputs: Image) -> Image:
        if self.robot is not None:
            self.robot.tell(cycle=True)
        return super().exchange(outputs)


def main(what: str) -> dict[str, Any]:
    make_cable()
    # A busy machine, and slaves in Python: frames may take their time.
    for name in ("ret", "safe"):
        setattr(pysoem.settings.timeouts, name, 200_000)
    robot = cdprcal.load_robot("irma4")
    plan = small_plan(robot)
    with tempfile.TemporaryDirectory() as folder:
        if what.isdigit():
            return hazard(robot, plan, drawn(int(what)), Path(folder))
        session = ethercat_session(folder)
        assert session.ahrs is not None
        beside = Robot(session, robot, plan)
        try:
            clock = SimulatedClock()
            backend = connected(session, robot, beside, clock, armed=what != "dry")
            document: dict[str, Any] = {"drives": backend.settings["drives"]}
            if what == "dry":
                tensions = [backend.read().tension_N.tolist() for _ in range(20)]
                document["alive"] = bool(np.ptp(tensions, axis=0).min() > 0.0)
                backend.stop()
            elif what == "hang":
                hang(robot, plan, backend, beside, clock, document)
            else:
                start_up(robot, plan, backend, beside, clock, what, Path(folder), document)
            beside.tell()
            document["states"] = beside.states
        finally:
            beside.close()
    return document


def connected(
    session: Session, robot: cdprcal.Robot, beside: Robot, clock: SimulatedClock, *, armed: bool
) -> FieldbusBackend:
    assert session.ahrs is not None
    clock.advance.append(beside.advance)
    bus = InStep(session, answer_s=2.0)
    bus.robot = beside
    attitude = LockstepAttitude(
        XsensMti(open_port(session.ahrs), session.ahrs), session.period_s, 2.0
    )
    return FieldbusBackend(session, robot, bus, attitude, clock, armed=armed)


def struck(
    backend: FieldbusBackend,
    beside: Robot,
    clock: SimulatedClock,
    told: Mapping[str, Any],
    due: Callable[[cdprcal.RobotSample], bool],
    off_after_s: list[float],
) -> Callable[[Any, cdprcal.RobotSample, bool], None]:
    """What ``acquire`` shall call: tells the robot once, when due; nothing where nothing is told.

    off_after_s: takes how long after that the last drive was off.
    """
    began: list[float] = []

    def watch(command: Any, sample: cdprcal.RobotSample, logged: bool) -> None:
        if told and not began and due(sample):
            began.append(clock.now_s())
            if "cut" in told:
                backend._bus._answer_us = 2000  # type: ignore[attr-defined]  # none ever comes
            beside.tell(**told)

    def look(now_s: float) -> None:
        if began and not off_after_s and ENABLED not in beside.states:
            off_after_s.append(now_s - began[0])

    clock.advance.append(look)
    return watch


def hazard(robot: cdprcal.Robot, plan: cdprcal.Plan, drawn: Drawn, folder: Path) -> dict[str, Any]:
    """How a start-up ends under what was drawn."""
    wired = ethercat_session(str(folder), lambda text: text, drawn.mode)
    session = ethercat_session(str(folder), drawn.wrong, drawn.mode)
    beside = Robot(wired, robot, plan)
    document: dict[str, Any] = {"name": drawn.name, "mode": drawn.mode, "state": "refused"}
    log = folder / "run.csv"
    off: list[float] = []
    clock = SimulatedClock()
    try:
        backend = connected(session, robot, beside, clock, armed=True)
        at_s = clock.now_s() + drawn.at_s
        watch = struck(
            backend, beside, clock, drawn.told or {}, lambda _: clock.now_s() >= at_s, off
        )
        startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
        run = acquire(startup, backend, open_live_log(log, 4, NO_INPUTS, 10.0), watch=watch)
        document |= {"state": run.state.name, "reason": run.reason}
        document["whole"] = not load_log(log).findings
    except (BackendError, cdprcal.InputError) as error:
        document["reason"] = str(error)
    finally:
        beside.close()
    named = bool(re.search(drawn.cause, document["reason"]))
    document |= {"named": named, "off_after_s": off}
    return document | {"peak_N": beside.peak_N, "over_s": beside.over_s}


def hang(
    robot: cdprcal.Robot,
    plan: cdprcal.Plan,
    backend: FieldbusBackend,
    beside: Robot,
    clock: SimulatedClock,
    document: dict[str, Any],
) -> None:
    """Nobody calls the backend any more."""
    startup = cdprcal.StartUp(robot, start_up_plan(plan))
    for _ in range(20):
        backend.command(startup.step(backend.read()))
    document["before"] = beside.states
    began_s = clock.now_s()
    while ENABLED in beside.states and clock.now_s() < began_s + 1.0:
        clock.sleep_until(clock.now_s() + 1e-3)
    document["off_after_s"] = clock.now_s() - began_s
    backend.stop()


def start_up(
    robot: cdprcal.Robot,
    plan: cdprcal.Plan,
    backend: FieldbusBackend,
    beside: Robot,
    clock: SimulatedClock,
    what: str,
    folder: Path,
    document: dict[str, Any],
) -> None:
    """The procedure, with a fault or to its end; then compared with the simulator's own."""
    told: dict[str, dict[str, Any]] = {
        "drive": {"fail": 2},
        "cable": {"cut": True},
        "emergency": {"emergency": 1},
    }
    off: list[float] = []
    watch = struck(
        backend, beside, clock, told.get(what, {}), lambda sample: sample.time_s >= FAULT_S, off
    )
    wired, direct = folder / "wired.csv", folder / "direct.csv"
    startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
    run = acquire(startup, backend, open_live_log(wired, 4, NO_INPUTS, 10.0), watch=watch)
    document |= {"state": run.state.name, "reason": run.reason, "off_after_s": off}
    if what != "start-up":
        return
    startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
    other = WithoutBus(robot, start_of(robot, plan, 1), simulator_options())
    acquire(startup, other, open_live_log(direct, 4, NO_INPUTS, 10.0))
    a, b = load_log(wired).log, load_log(direct).log
    document["rows"] = [len(a), len(b)]
    if len(a) == len(b):
        document["apart"] = {
            name: float(np.abs(getattr(a, name) - getattr(b, name)).max())
            for name in ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
        }


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1])))
