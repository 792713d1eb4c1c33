"""What may be wrong with a robot before it is armed, and what must come of it.

One table for the tests and for ``tests/studies/hazards.py``, which measures it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cdprcal
from cdprcal._core import InputError
from cdprcal.hardware import BackendError
from cdprcal.hardware.session import Session
from cdprcal.testing.simulated_devices.canopen_node import DriveNode
from cdprcal.testing.simulated_devices.faults import Fault, forgetting, quirk, without
from winch_bus import EXAMPLE, Watched, session_of, watched_run

MODES = ("velocity", "torque")


def session_in(mode: str, change: Callable[[str], str] = lambda text: text) -> Session:
    """The example in a mode, its text changed."""
    return session_of(change(EXAMPLE.read_text()).replace("mode: velocity", f"mode: {mode}"))


@dataclass(frozen=True)
class Hazard:
    """fault: with the drives. wrong: what the session says instead of what is true. cause: words
    that the reason must have. modes: of operation in which it is one."""

    name: str
    cause: str
    fault: Callable[[], Fault] | None = None
    wrong: Callable[[str], str] = lambda text: text
    modes: tuple[str, ...] = MODES


def replaced(old: str, new: str, *, cables: tuple[int, ...] = ()) -> Callable[[str], str]:
    """A change of the session's text; of all cables, or of some."""

    def change(text: str) -> str:
        assert old in text
        if not cables:
            return text.replace(old, new)
        head, *winches = re.split(r"(?=  - cable: )", text)
        for cable in cables:
            winches[cable - 1] = winches[cable - 1].replace(old, new)
        return head + "".join(winches)

    return change


ARMING = (
    Hazard(
        "a drive stays in mode 1, and says so",
        r"node 3 \(cable 3\): stays in mode of operation 1",
        lambda: quirk("mode 1", 0.0, 3, stays_in_mode=1, own_velocity_m_s=-0.3),
    ),
    Hazard(
        "a drive is in mode 1, and says 9",
        r"node 3 \(cable 3\): moved by",
        lambda: quirk("mode 1", 0.0, 3, stays_in_mode=1, shows_mode=9, own_velocity_m_s=-0.3),
    ),
)


RUNNING = (
    Hazard(
        "a drive goes into mode 1 in mid-run, and says so",
        r"node 3 \(cable 3\): is in mode of operation 1",
        lambda: quirk("mode 1", 2.5, 3, stays_in_mode=1, own_velocity_m_s=-0.3),
    ),
    Hazard(
        "a drive goes into mode 1 in mid-run, and says otherwise",
        r"node 3 \(cable 3\): (moved by|is in mode)",
        lambda: quirk("mode 1", 2.5, 3, stays_in_mode=1, shows_mode=9, own_velocity_m_s=-0.3),
    ),
)


def _both(*builds: Callable[[list[DriveNode]], None]) -> Callable[[list[DriveNode]], None]:
    def build(nodes: list[DriveNode]) -> None:
        for one in builds:
            one(nodes)

    return build


_TIMERS = ((0x1400, 5), (0x1401, 5))
_ABORT_OPTION = (0x6007, 0)


def _lost(can_id: int, data: bytes) -> bytes | None:
    """Both command PDOs of node 3."""
    return None if can_id in (0x203, 0x303) else data


LOST = (
    Hazard(
        "commands get lost, with an event timer",
        r"node 3 \(cable 3\): (EMCY 0x8250|left operation enabled)",
        lambda: Fault("lost", 2.5, to_nodes=_lost),
    ),
    Hazard(
        "commands get lost, without an event timer",
        r"node 3 \(cable 3\)",
        lambda: Fault("lost", 2.5, to_nodes=_lost, build=without(*_TIMERS, node=3)),
    ),
    Hazard(
        "an event timer that keeps nothing, no 0x6007",
        r"node 3 \(cable 3\): has no event timer for its commands",
        lambda: Fault("set-up", 0.0, build=_both(forgetting(_TIMERS[1], 3),
                                                 without(_ABORT_OPTION, node=3))),
    ),
    Hazard(
        "a heartbeat consumer that keeps nothing",
        r"node 3 \(cable 3\): does not keep what its heartbeat consumer",
        lambda: Fault("set-up", 0.0, build=forgetting((0x1016, 1), 3)),
    ),
)  # fmt: skip

_SIGNS = {"\n    sign: 1": "\n    sign: -1", "\n    sign: -1": "\n    sign: 1"}


def _signs_wrong(text: str) -> str:
    return re.sub("|".join(sorted(_SIGNS, key=len, reverse=True)), lambda m: _SIGNS[m[0]], text)


def _cells_swapped(text: str) -> str:
    for cable, other in ((1, 2), (2, 1)):
        text = replaced("load_cell: {", f"load_cell: {{node: {other}, ", cables=(cable,))(text)
    return text


SESSION = (
    Hazard(
        "the drum's diameter is given as its radius",
        r"torque would hold \d+ N where .*check sign, drum_radius_m",
        wrong=replaced("drum_radius_m: 0.05", "drum_radius_m: 0.1"),
    ),
    Hazard(
        "half the drum's radius is given",
        r"torque would hold \d+ N where .*check sign, drum_radius_m",
        wrong=replaced("drum_radius_m: 0.05", "drum_radius_m: 0.025"),
    ),
    Hazard(
        "a gear of 10 is given as 1",
        r"torque would hold \d+ N where .*gear_ratio",
        wrong=replaced("gear_ratio: 10", "gear_ratio: 1"),
    ),
    Hazard(
        "one gear of 10 is given as 5",
        r"node 2 \(cable 2\): the motor's torque would hold",
        wrong=replaced("gear_ratio: 10", "gear_ratio: 5", cables=(2,)),
    ),
    Hazard(
        "all signs are reversed",
        r"torque would hold -\d+ N where .*check sign",
        wrong=_signs_wrong,
    ),
    Hazard(
        "the rated torque of another motor",
        r"its rated torque \(0x6076\) is 2\.4 Nm, the session says 1\.2",
        wrong=replaced("rated_torque_Nm: 2.4", "rated_torque_Nm: 1.2"),
    ),
    Hazard(
        "load cells show 1/2.2 of what is there (lbf for kgf)",
        r"torque would hold \d+ N where .*counts_per_N",
        wrong=replaced("counts_per_N: 1000, valid_counts: [-50000, 600000]",
                       "counts_per_N: 2200, valid_counts: [-50000, 1200000]"),
    ),
    Hazard(
        "load cells show 2.2 times what is there",
        r"torque would hold \d+ N where .*counts_per_N|beyond the limits",
        wrong=replaced("counts_per_N: 1000", "counts_per_N: 455"),
    ),
    Hazard(
        "a load cell has its sign reversed",
        r"winches\[#4\]\.load_cell at the upper tension limit and a tenth",
        wrong=replaced("type: int32, counts_per_N: 1000",
                       "type: int32, sign: -1, counts_per_N: 1000", cables=(4,)),
    ),
    Hazard(
        "counts per metre of cable 10 times too many",
        r"beyond the limits",
        wrong=replaced("counts_per_m: 1e7", "counts_per_m: 1e8"),
        modes=("velocity",),
    ),
    Hazard(
        "counts per metre of one cable 4 times too many",
        r"node 2 \(cable 2\): its tension and length answer .* counts_per_m",
        wrong=replaced("counts_per_m: 1e7", "counts_per_m: 4e7", cables=(2,)),
    ),
    Hazard(
        "the load cells of two cables are swapped",
        r"\(cable [12]\): its tension and length answer .*load cell is on this cable",
        wrong=_cells_swapped,
    ),
    Hazard(
        "velocity units 3 times too many on one drive",
        r"node 3 \(cable 3\): (moved by|its tension and length)",
        lambda: quirk("gain", 0.0, 3, gain=3.0),
        modes=("velocity",),
    ),
)  # fmt: skip

SENSORS = (
    Hazard(
        "a swivel encoder flickers by its last digit from power-on",
        r"node 3 \(cable 3\): the swivel encoder stands still",
        lambda: quirk("swivel", 0.0, 3, swivel_flickers=True),
    ),
    Hazard(
        "a swivel encoder flickers by its last digit from mid-run",
        r"node 3 \(cable 3\): the swivel encoder stands still",
        lambda: quirk("swivel", 10.5, 3, swivel_flickers=True),
    ),
    Hazard(
        "a load cell flickers by its last digit from mid-run",
        r"node 3 \(cable 3\): the load cell stands still",
        lambda: quirk("load cell", 10.5, 3, load_cell_flickers=True),
    ),
)

ALL = (*SENSORS, *ARMING, *RUNNING, *LOST, *SESSION)


@dataclass(frozen=True)
class Stopped:
    """What came of a hazard. watched: None when it was refused before anything moved."""

    reason: str
    watched: Watched | None


def attempt(
    hazard: Hazard,
    mode: str,
    robot: cdprcal.Robot,
    plan: cdprcal.Plan,
    path: Path,
    effects: Sequence[cdprcal.InjectedEffect] = (),
) -> Stopped:
    """A start-up under a hazard, of a robot that has effects that nobody knows of."""
    wired = session_in(mode)
    session = session_in(mode, hazard.wrong).model_copy(update={"bus": wired.bus})
    fault = hazard.fault() if hazard.fault is not None else Fault("by the session", 0.0)
    try:
        watched = watched_run(session, robot, plan, path, fault, wired=wired, effects=effects)
    except (BackendError, InputError) as error:
        return Stopped(str(error), None)
    return Stopped(watched.run.reason, watched)
