"""What a diagnosis of the log so far says while the robot runs, and whether more would be said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from cdprcal import _core

#: Evidence for an effect that a few more rests will not take away [nat].
_DECISIVE = 10.0
#: Rests in a row that must say the same; where rivals remain, more of them.
_SAME, _SAME_WITH_RIVALS = 3, 6
#: Verdicts that name or describe something.
_FOUND = {_core.Verdict.explained.name, _core.Verdict.described.name}


@dataclass(frozen=True)
class Told:
    """A diagnosis after some rests."""

    verdict: str
    faults: tuple[str, ...]
    effects: tuple[tuple[str, float, tuple[str, ...]], ...]  #: name, evidence [nat], rivals

    @property
    def names(self) -> frozenset[str]:
        return frozenset((*self.faults, *(name for name, _, _ in self.effects)))

    @property
    def rivals(self) -> frozenset[tuple[str, tuple[str, ...]]]:
        return frozenset((name, rivals) for name, _, rivals in self.effects if rivals)

    def as_event(self) -> dict[str, Any]:
        """For the log and ``--json``."""
        return {
            "verdict": self.verdict,
            "faults": list(self.faults),
            "effects": [
                {"name": name, "log_evidence": evidence, "rivals": list(rivals)}
                for name, evidence, rivals in self.effects
            ],
        }

    def __str__(self) -> str:
        said = [*self.faults]
        for name, evidence, rivals in self.effects:
            alike = f", or {', '.join(rivals)}" if rivals else ""
            said.append(f"{name} ({evidence:.0f} nats{alike})")
        return f"{self.verdict}: {'; '.join(said) or 'no effect found'}"


def told_by(robot: _core.Robot, log: _core.Log) -> Told | None:
    """The diagnosis of a log so far; None where it cannot be diagnosed yet."""
    try:
        found = _core.diagnose(robot, [log])
    except _core.InputError:  # no rest that counts, for one
        return None
    return Told(
        found.verdict.name,
        tuple(fault.name for fault in found.faults),
        tuple((e.info.name, float(e.log_evidence), tuple(e.rivals)) for e in found.effects),
    )


def settled(told: Sequence[Told]) -> str:
    """Why more rests would not change the answer; empty: they may.

    Something was found, with decisive evidence, and the last rests say the same. A robot with which
    nothing is wrong goes on to the end of its plan: the smaller an effect, the later it shows.
    """
    if not told or told[-1].verdict not in _FOUND:
        return ""
    last = told[-1]
    weakest = min((evidence for _, evidence, _ in last.effects), default=_DECISIVE)
    wanted = _SAME_WITH_RIVALS if last.rivals else _SAME
    recent = told[-wanted:]
    if len(recent) < wanted or weakest < _DECISIVE:
        return ""
    if any((t.names, t.rivals) != (last.names, last.rivals) for t in recent):
        return ""
    if last.rivals:
        return f"{wanted} rests in a row told nothing more apart"
    return f"{wanted} rests in a row named the same, and no rival is left"
