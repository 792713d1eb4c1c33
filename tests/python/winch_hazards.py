"""What may be wrong with a robot before it is armed, and what must come of it.

One table for the tests and for ``tests/studies/hazards.py``, which measures it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cdprcal
from cdprcal._core import InputError
from cdprcal.hardware import BackendError
from cdprcal.hardware.session import Session
from cdprcal.testing.simulated_devices.canopen_node import DriveNode
from cdprcal.testing.simulated_devices.faults import Fault, forgetting, quirk, without
from winch_bus import EXAMPLE, Watched, example_session, watched_run

MODES = ("velocity", "torque")


def session_in(mode: str, change: Callable[[str], str] = lambda text: text) -> Session:
    """The example in a mode, its text changed."""
    text = EXAMPLE.read_text()
    changed = change(text)
    return example_session(**{"mode: velocity": f"mode: {mode}"} | _pairs(text, changed))


def _pairs(text: str, changed: str) -> dict[str, str]:
    lines = zip(text.splitlines(), changed.splitlines(), strict=True)
    return {old: new for old, new in lines if old != new}


@dataclass(frozen=True)
class Hazard:
    """fault: with the drives. wrong: what the session says instead of what is true. cause: words
    that the reason must have."""

    name: str
    cause: str
    fault: Callable[[], Fault] | None = None
    wrong: Callable[[str], str] = lambda text: text


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

ALL = (*ARMING, *RUNNING, *LOST)


@dataclass(frozen=True)
class Stopped:
    """What came of a hazard. watched: None when it was refused before anything moved."""

    reason: str
    watched: Watched | None


def attempt(
    hazard: Hazard, mode: str, robot: cdprcal.Robot, plan: cdprcal.Plan, path: Path
) -> Stopped:
    """A start-up under a hazard."""
    wired = session_in(mode)
    session = session_in(mode, hazard.wrong).model_copy(update={"bus": wired.bus})
    fault = hazard.fault() if hazard.fault is not None else None
    try:
        watched = watched_run(session, robot, plan, path, fault, wired=wired)
    except (BackendError, InputError) as error:
        return Stopped(str(error), None)
    return Stopped(watched.run.reason, watched)
