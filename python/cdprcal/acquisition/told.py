"""What a diagnosis of the log so far says while the robot runs, and whether more would be said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from cdprcal import _core
from cdprcal.diagnosis.document import in_words

#: Evidence for an effect that a few more rests will not take away [nat].
_DECISIVE = 10.0
#: Rests in a row that must say the same; where stops should have told rivals apart, more of them.
_SAME, _SAME_WITH_RIVALS = 3, 6
#: Verdicts that name or describe something.
_FOUND = {_core.Verdict.explained.name, _core.Verdict.described.name}


@dataclass(frozen=True)
class Told:
    """A diagnosis after some rests."""

    verdict: str
    faults: tuple[str, ...]
    effects: tuple[tuple[str, float, tuple[str, ...]], ...]  #: name, evidence [nat], rivals
    #: Of the stops that are left, by their place in the plan: nats expected between rivals
    worth: Mapping[int, float] = field(default_factory=dict)
    within_reach: bool = False  #: all of them together would tell some of the rivals apart
    suspect: str = ""  #: an effect that was not found, but is more probable than its absence

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
        return in_words(self.as_event())


def told_by(
    robot: _core.Robot,
    log: _core.Log,
    left: Mapping[int, _core.PlannedPose] | None = None,
    *,
    in_motion: bool = False,
) -> Told | None:
    """The diagnosis of a log so far; None where it cannot be diagnosed yet.

    ``left``: the stops that the run may still go to, by their place in the plan. ``in_motion``:
    what is read between the rests counts, too.
    """
    try:
        found = _core.diagnose(robot, [log], _core.DiagnoseOptions(motion=in_motion))
    except _core.InputError:  # no rest that counts, for one
        return None
    worth, within_reach = _worth_of(found, left or {})
    return Told(
        found.verdict.name,
        tuple(fault.name for fault in found.faults),
        tuple((e.info.name, float(e.log_evidence), tuple(e.rivals)) for e in found.effects),
        worth,
        within_reach,
        _suspect_of(found),
    )


def _suspect_of(found: _core.Diagnosis) -> str:
    """Of the effects that were not found, the likeliest, where it has any evidence."""
    best = next(iter(_core.scan(found.model)), None)
    return "" if best is None or best.log_evidence <= 0.0 else best.name


def _worth_of(
    found: _core.Diagnosis, left: Mapping[int, _core.PlannedPose]
) -> tuple[dict[int, float], bool]:
    """What each stop would tell between rivals [nat], and whether all would tell some apart."""
    worth = dict.fromkeys(left, 0.0)
    within_reach = False
    poses = [stop.pose for stop in left.values()]
    tensions_N = [stop.tension_N for stop in left.values()]
    for k, effect in enumerate(found.effects if left else []):
        for rival in () if effect.where else effect.rivals:  # what happened once is over
            told = _core.separation_by_stops(found, k, rival, poses, tensions_N)
            if not told.apart_with_all:
                continue
            within_reach = True
            for stop, nats in zip(left, told.nats_with, strict=True):
                worth[stop] += max(0.0, nats - told.nats)
    return worth, within_reach


def settled(told: Sequence[Told], stops: str = "rests") -> str:
    """Why more rests (``stops`` in words) would not change the answer; empty: they may.

    Something was found, with decisive evidence, the last rests say the same, nothing else begins
    to show, and the stops that are left would not tell its rivals apart. A robot with which nothing
    is wrong goes on to the end of its plan: the smaller an effect, the later it shows.
    """
    if not told or told[-1].verdict not in _FOUND:
        return ""
    last = told[-1]
    weakest = min((evidence for _, evidence, _ in last.effects), default=_DECISIVE)
    wanted = _SAME_WITH_RIVALS if last.within_reach else _SAME
    recent = told[-wanted:]
    if len(recent) < wanted or weakest < _DECISIVE:
        return ""
    if any((t.names, t.rivals) != (last.names, last.rivals) for t in recent):
        return ""
    if last.suspect:
        return ""  # it may be there too
    if last.rivals:
        return (
            f"{wanted} {stops} in a row told nothing more apart"
            if last.within_reach
            else "no stop of the plan would tell the rivals apart"
        )
    return f"{wanted} {stops} in a row named the same, and no rival is left"
