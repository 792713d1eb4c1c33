"""What tests and studies of the winches share: runs with a sniffer on the bus."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import can
import numpy as np

import cdprcal
from cdprcal.acquisition import Acquired, acquire, start_up_plan
from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.fieldbus import SimulatedClock
from cdprcal.hardware.drives.process_data import DRIVE_OUTPUTS, split_into_pdos, unpack
from cdprcal.hardware.session import CanopenBus, Session, parse_session
from cdprcal.hardware.simulated import SimulatedBackend
from cdprcal.io import AcquisitionInputs, open_live_log
from cdprcal.testing.simulated_devices.connect import SimulatedSession
from cdprcal.testing.simulated_devices.faults import Fault, fault_kinds
from robots import small_plan as small_plan

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "canopen-simulated.yaml"
_channels = itertools.count()


def session_of(text: str) -> Session:
    """The example's text, maybe changed, on a bus of its own."""
    text = text.replace("channel: irma4", f"channel: test-{next(_channels)}")
    return parse_session(text, str(EXAMPLE))


def example_session(**changes: str) -> Session:
    """The example on a bus of its own; changes: old text → new, given as old=new pairs."""
    text = EXAMPLE.read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return session_of(text)


def ethercat_session(interface: str) -> Session:
    """The example on a real bus of EtherCAT."""
    canopen = "{type: canopen, interface: virtual, channel: irma4}"
    text = EXAMPLE.read_text().replace(canopen, f"{{type: ethercat, interface: {interface}}}")
    text = text.replace("simulated: {}", "").replace("port: simulated", "port: x")
    return parse_session(text, "session")


#: For runs in which something happens at a time: they begin at once.
AT_ONCE = {"brakes: true": "brakes: true, wiggle_m: 0"}
#: Counts much finer than the sensors.
FINER = {"m: 1e7": "m: 1e8", "turn: 1048576": "turn: 1073741824"}


def torque_session(**changes: str) -> Session:
    """The example with drives in cyclic synchronous torque."""
    return example_session(**{"mode: velocity": "mode: torque"}, **changes)


def fine_session() -> Session:
    """The example with counts much finer than the sensors: the bus adds no steps of its own.

    Rest is judged by thresholds. A reading that is off by its last digit may shift a rest by a
    tenth of a second, and with it all the noise that follows.
    """
    return example_session(**FINER, **AT_ONCE)


class WithoutBus(SimulatedBackend):
    """The simulator itself, its times to the nanosecond as those of a bus.

    Whether a sample is the last in a window of a second must not hang on the last bit of its time.
    """

    def read(self) -> cdprcal.RobotSample:
        sample = super().read()
        for name in ("time_s", "drives_time_s", "attitude_time_s"):
            setattr(sample, name, round(getattr(sample, name), 9))
        return sample


@dataclass
class Sniffer:
    """Listens on the bus, and holds every command against the limits of the session."""

    session: Session
    now_s: Callable[[], float]
    commands: int = 0
    outside: list[str] = field(default_factory=list)
    sync_s: list[float] = field(default_factory=list)
    enabling: int = 0  #: controlwords that enable operation

    def __post_init__(self) -> None:
        assert isinstance(self.session.bus, CanopenBus)
        self._bus = can.Bus(interface="virtual", channel=self.session.bus.channel)
        self._winches = {winch.node: winch for winch in self.session.winches}
        self._pdos = split_into_pdos(DRIVE_OUTPUTS)

    def listen(self) -> None:
        """Takes what has been said."""
        while (message := self._bus.recv(0.0)) is not None:
            can_id = message.arbitration_id
            if can_id == 0x80:
                self.sync_s.append(self.now_s())
            elif (base := can_id & 0x780) in (0x200, 0x300):
                self._judge(can_id & 0x7F, (base - 0x200) // 0x100, bytes(message.data))

    def close(self) -> None:
        self.listen()
        self._bus.shutdown()

    def _judge(self, node: int, pdo: int, data: bytes) -> None:
        winch, limits = self._winches[node], self.session.limits
        values = unpack(self._pdos[pdo], data)
        assert values is not None
        self.commands += 1
        if cia402.CONTROLWORD in values:
            self.enabling += values[cia402.CONTROLWORD] & 0x0F == cia402.ENABLE_OPERATION
            speed_m_s = abs(values[cia402.TARGET_VELOCITY]) / winch.velocity_scale
            if speed_m_s > limits.velocity_m_s:
                self.outside.append(f"node {node}: {speed_m_s} m/s")
            if values[cia402.MODE] not in (cia402.CSV, cia402.CST):
                self.outside.append(f"node {node}: mode {values[cia402.MODE]}")
        elif winch.torque is not None:
            torque = winch.torque
            motor_Nm = -winch.sign * values[cia402.TARGET_TORQUE] / 1000 * torque.rated_torque_Nm
            tension_N = motor_Nm * torque.gear_ratio / torque.drum_radius_m
            if not limits.tension_N[0] <= tension_N <= limits.tension_N[1]:
                self.outside.append(f"node {node}: {tension_N} N")


@dataclass
class Watched:
    """A run with simulated drives, and what was seen of it from outside."""

    run: Acquired
    backend: SimulatedSession
    sniffer: Sniffer
    fault_s: float
    off_s: float  #: when the last drive left operation enabled after the fault
    cycles: int  #: control cycles that began between the fault and that
    peak_N: float  #: greatest true tension
    over_s: float  #: how long some true tension was beyond the upper limit + 10 %
    moved_m: float  #: how far the platform got from where it was at the fault or at power-on
    enabled_s: float  #: how long some drive was enabled from the fault on


def watched_run(
    session: Session,
    robot: cdprcal.Robot,
    plan: cdprcal.Plan,
    path: Path,
    fault: Fault | None = None,
    *,
    seed: int = 1,
    wired: Session | None = None,
    effects: Sequence[cdprcal.InjectedEffect] = (),
    each_cycle: Callable[[SimulatedClock], None] = lambda clock: None,
) -> Watched:
    """The start-up over simulated CANopen with a sniffer; the fault's time counts from arming."""
    startup = cdprcal.StartUp(robot, start_up_plan(plan, quick=True))
    options = cdprcal.SimulatorOptions(seed=seed, effects=list(effects))
    backend = SimulatedSession.connect(
        session, robot, plan, options, armed=True, fault=fault, wired=wired
    )
    clock, simulated = backend._clock, backend.simulated
    assert isinstance(clock, SimulatedClock)
    assert simulated is not None
    sniffer = Sniffer(session, clock.now_s)
    fault_s = fault.begin_s if fault is not None else math.inf
    off_s: list[float] = []
    enabled_s: set[float] = set()  # times of cycles

    def look(now_s: float = 0.0) -> None:
        sniffer.listen()
        enabled = any(node.drive.state is cia402.State.enabled for node in simulated.nodes)
        if enabled and clock.now_s() >= fault_s:
            enabled_s.add(round(clock.now_s(), 3))
        if not enabled and not off_s and clock.now_s() >= fault_s:
            off_s.append(clock.now_s())

    most_N = 1.1 * session.limits.tension_N[1]
    peaks = _Peaks()

    def measure(now_s: float) -> None:
        truth = simulated.truth()
        peaks.see(now_s, float(truth.tension_N.max()), most_N, truth.pose.position_m, fault_s)

    clock.idle.append(look)
    clock.advance.append(look)
    clock.advance.append(measure)
    inputs = AcquisitionInputs(cdprcal.to_yaml(robot), cdprcal.format_plan(plan), backend.settings)
    log = open_live_log(path, robot.cable_count, inputs, 10.0)
    try:
        run = acquire(startup, backend, log, watch=lambda *_: each_cycle(clock))
    finally:
        sniffer.close()
    end_s = off_s[0] if off_s else math.inf
    cycles = sum(fault_s <= t <= end_s for t in sniffer.sync_s)
    return Watched(
        run,
        backend,
        sniffer,
        fault_s,
        end_s,
        cycles,
        peaks.peak_N,
        peaks.over_s,
        peaks.moved_m,
        max(enabled_s, default=0.0) - min(enabled_s, default=0.0),
    )


class _Peaks:
    """What is kept of the true motion."""

    def __init__(self) -> None:
        self.peak_N = self.over_s = self.moved_m = self._last_s = 0.0
        self._from: np.ndarray | None = None

    def see(
        self, now_s: float, tension_N: float, most_N: float, at_m: np.ndarray, since_s: float
    ) -> None:
        self.peak_N = max(self.peak_N, tension_N)
        self.over_s += (now_s - self._last_s) * (tension_N > most_N)
        self._last_s = now_s
        if math.isfinite(since_s) and now_s < since_s:
            return
        self._from = at_m.copy() if self._from is None else self._from
        self.moved_m = max(self.moved_m, float(np.linalg.norm(at_m - self._from)))


#: Faults that show only when the next heartbeat is due, and how long that takes at most [s].
SHOW_S = {"heartbeat lost": 0.25, "heartbeat cut": 0.1, "heartbeat tells stopped": 0.1}


def random_fault(random: np.random.Generator, kind: str, latest_s: float) -> Fault:
    """A fault of a kind at a random time and node."""
    maker = fault_kinds()[kind]
    return maker(float(random.uniform(1.0, latest_s)), int(random.integers(1, 5)), random)


def judge(watched: Watched, fault: Fault) -> list[str]:
    """What did not go as it must."""
    wrong = []
    kind = fault.name.rsplit(" of node", 1)[0]
    allowed = 2 + math.ceil(100 * SHOW_S.get(kind, 0.0))
    if watched.cycles > allowed:
        wrong.append(f"{watched.cycles} cycles until the drives were off")
    if not math.isfinite(watched.off_s):
        wrong.append("the drives stayed on")
    if watched.sniffer.outside:
        wrong.append(f"outside the limits: {watched.sniffer.outside[0]}")
    if watched.run.state != cdprcal.StartUpState.holding or not watched.run.reason:
        wrong.append(f"ended {watched.run.state.name}: {watched.run.reason!r}")
    return wrong
