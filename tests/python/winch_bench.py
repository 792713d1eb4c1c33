"""Simulated drives on a bench: no bus, no platform, and a log of what they were told."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import cdprcal
from cdprcal.hardware import BackendError
from cdprcal.hardware.backend import Attitude
from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.backend import FieldbusBackend
from cdprcal.hardware.drives.canopen_bus import NoSuchObjectError
from cdprcal.hardware.drives.fieldbus import SimulatedClock
from cdprcal.hardware.drives.process_data import Entry, Image, Key, Layout, Values
from cdprcal.hardware.session import Session
from cdprcal.testing.simulated_devices.drive import SimulatedDrive


class Bench:
    """A fieldbus whose drives obey at once; each holds 100 N, or what ``pulls`` says.

    pulls: tensions [N] by the cable that each has paid out [m].
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.drives = {winch.node: SimulatedDrive(winch) for winch in session.winches}
        self.paid_out_m = dict.fromkeys(self.drives, 0.0)
        self.pulls: Callable[[list[float]], list[float]] = lambda out_m: [100.0] * len(out_m)
        self.holds_N: dict[int, float] = {}  #: by the motors' torque, where that is another tension
        self.written: dict[int, list[tuple[Key, int, int]]] = {node: [] for node in self.drives}
        self.cycles: list[dict[int, Values]] = []  #: outputs of each
        self.sent: list[dict[int, Values]] = []  #: between cycles
        self.each_cycle: Callable[[], None] = lambda: None
        self.silent: set[int] = set()
        self.complaints: list[str] = []
        self.without_timer: list[int] = []
        self.outputs: bool | None = None  #: whether any can ever come
        self.watched: bool | None = None
        self.broken = ""
        self.abandoned = 0
        self.ends: list[bool] = []  #: with a stop?
        self._inputs: dict[int, tuple[Entry, ...]] = {}

    def sdo_read(self, node: int, index: int, subindex: int) -> bytes:
        objects = self.drives[node].dictionary.objects
        if (index, subindex) not in objects:
            raise NoSuchObjectError(f"node {node} has no 0x{index:04X}:{subindex:02X}")
        return objects[index, subindex].data

    def sdo_write(self, node: int, index: int, subindex: int, data: bytes) -> None:
        key = index, subindex
        if key not in self.drives[node].dictionary.objects:
            raise NoSuchObjectError(f"node {node} has no 0x{index:04X}:{subindex:02X}")
        assert self.drives[node].dictionary.write(key, data) == 0
        self.written[node].append((key, int.from_bytes(data, "little"), len(data)))

    def configure(self, layouts: Sequence[Layout], *, outputs: bool) -> None:
        self._inputs = {layout.node: layout.inputs for layout in layouts}
        self.outputs = outputs

    def watch_us(self, *, on: bool) -> list[int]:
        self.watched = on
        return self.without_timer

    def exchange(self, outputs: Image) -> Image:
        self._take(outputs, self.cycles)
        self.each_cycle()
        for node, drive in self.drives.items():
            if drive.state.powered:  # else the brake holds it
                drive.step(self.session.period_s)
            self.paid_out_m[node] += drive.velocity_m_s * self.session.period_s
        tensions_N = self.pulls(list(self.paid_out_m.values()))
        for (node, drive), tension_N in zip(self.drives.items(), tensions_N, strict=True):
            held_N = self.holds_N.get(node, tension_N)
            drive.sense(2.0 + self.paid_out_m[node], 0.0, tension_N, held_N)
        return {node: self._said(node) for node in self.drives if node not in self.silent}

    def send(self, outputs: Image) -> None:
        self._take(outputs, self.sent)

    def abandon(self) -> None:
        self.abandoned += 1

    def faults(self) -> list[str]:
        found, self.complaints = self.complaints, []
        return found

    def close(self, *, stop: bool = True) -> None:
        self.ends.append(stop)

    def words(self, node: int = 1) -> list[int]:
        """Controlwords of each cycle."""
        return [outputs[node][cia402.CONTROLWORD] for outputs in self.cycles if outputs]

    def _take(self, outputs: Image, log: list[dict[int, Values]]) -> None:
        if self.broken:
            raise BackendError(self.broken)
        log.append({node: dict(values) for node, values in outputs.items()})
        for node, values in outputs.items():
            dictionary = self.drives[node].dictionary
            for key, value in sorted(values.items(), reverse=True):  # controlword last
                size = len(dictionary.objects[key].data)
                dictionary.write(key, (value & ((1 << 8 * size) - 1)).to_bytes(size, "little"))

    def _said(self, node: int) -> Values:
        dictionary = self.drives[node].dictionary
        return {it.key: dictionary.get(it.key, signed=it.signed) for it in self._inputs[node]}


class Level:
    """An AHRS that is level; it speaks from ``begins_s`` on, until ``ends_s``."""

    def __init__(self, begins_s: float = 0.0, ends_s: float = 1e9) -> None:
        self._begins_s, self._ends_s = begins_s, ends_s
        self.closed = 0

    @property
    def settings(self) -> dict[str, object]:
        return {"device_id": "level"}

    def poll(self, now_s: float) -> Attitude | None:
        if not self._begins_s <= now_s:
            return None
        return Attitude(np.eye(3), now_s) if now_s < self._ends_s else None

    def close(self) -> None:
        self.closed += 1


def four(value: float) -> NDArray[np.float64]:
    """The same for every cable."""
    return np.full(4, value)


@dataclass
class Command:
    """What the procedure wants, as ``StartUpCommand`` says it."""

    locked: bool = False
    state: cdprcal.StartUpState = cdprcal.StartUpState.moving
    velocity_m_s: NDArray[np.float64] = field(default_factory=lambda: four(0.0))
    tension_setpoint_N: NDArray[np.float64] = field(default_factory=lambda: four(100.0))
    by_tension: list[bool] = field(default_factory=lambda: [True] * 4)


class OnBench:
    """A backend on a bench, or on one that is made of a session."""

    def __init__(
        self,
        bench: Bench | Session,
        robot: cdprcal.Robot,
        *,
        armed: bool = True,
        ahrs: Level | None = None,
        clock: SimulatedClock | None = None,
    ) -> None:
        self.bench = bench if isinstance(bench, Bench) else Bench(bench)
        session = self.bench.session
        self.ahrs = ahrs or Level()
        self.clock = clock or SimulatedClock()
        self.backend = FieldbusBackend(
            session, robot, self.bench, self.ahrs, self.clock, armed=armed
        )

    def read(self, cycles: int = 1) -> cdprcal.RobotSample:
        """The last of some samples; nothing is wrong in those before."""
        for _ in range(cycles - 1):
            assert self.backend.read().drive_error == ""
        return self.backend.read()

    def command(self, wanted: Command | None = None) -> None:
        """Tells what the procedure wants."""
        self.backend.command(wanted or Command())  # type: ignore[arg-type]
