"""What a robot's physics says of a proposed map: directions, orders and units.

Of all signs of lengths, swivels and attitude, and of the units that are possible, those are
proposed with which the readings agree best, if they do so by more than chance would. Signs can
stand in for another order of the cables, and for what no sign is: what explains the readings about
as well is said, and what it concerns is but a guess. So is what agrees best and does not agree.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.mapping.apply import apply_map
from cdprcal.mapping.document import GROUPS, QUATERNIONS
from cdprcal.mapping.proposal import PER_CABLE, Line, Proposal
from cdprcal.mapping.units import UNITS, factor

#: One explanation is better than another from here on [nat]: as everywhere in this project.
_EVIDENCE = 3.0
#: All orders of so many cables are tried; of more those in which they follow one another.
_MOST_ORDERED = 4
#: From one row to the next, for rests to be seen [s].
_ENOUGH_S = 0.1
#: What a factor may be off one of a unit's by, rounded as it may be.
_SAME_UNIT = 1e-3
#: The lines that a fault is of; of a unit in the order of its factors.
_LINES_OF_FAULT = {
    "length_sign": ("lengths",),
    "swivel_sign": ("swivels",),
    "attitude_sign": ("attitude",),
    "length_unit": ("lengths",),
    "tension_unit": ("tensions",),
    "angle_unit": ("swivels", "attitude"),
}


@dataclass(frozen=True)
class _Explanation:
    """Lines, and the robot, with which readings may agree."""

    proposal: Proposal
    robot: _core.Robot
    words: str = ""
    cost: float = math.inf
    agrees: bool = False


def by_physics(proposal: Proposal, robot: _core.Robot) -> Proposal:
    """Turns over, reorders, and takes in other units, what agrees better with the robot's physics
    so; says which it tried. Where nothing says how large a unit is, physics says nothing either."""
    if not {"lengths", "tensions"} & {line.name for line in proposal.lines}:
        return proposal
    if unknown := {line.name for line in proposal.lines if not line.has_scale}:
        unknown |= {line.name for line in proposal.lines if line.rivals}
        return _guesses(proposal, "not tried on the robot, for want of a unit", unknown)
    given, proposal = proposal, _thinned(proposal, robot)
    best, by_units = _best_of_signs(proposal, robot)
    if not math.isfinite(best.cost):
        return _guesses(given, "no pose agrees with it")
    found = best.proposal
    taken = tuple(line.unit for line in found.lines)
    for units, other in by_units.items():
        if units != taken and other < best.cost + _EVIDENCE:
            differ = {
                line.name for line, u in zip(found.lines, units, strict=True) if u != line.unit
            }
            found = _guesses(found, "physics agrees with another unit as well", differ)
    weighed = _weighed(replace(best, proposal=found), proposal, robot)
    return replace(weighed, raw=given.raw, rate_Hz=given.rate_Hz)


def _thinned(proposal: Proposal, robot: _core.Robot) -> Proposal:
    """With as many rows as show what rests: a map is tried a hundred times and more."""
    columns = proposal.raw.columns
    one_clock = all(column.time_s is None for column in columns.values())
    if not one_clock or len({len(column.values) for column in columns.values()}) != 1:
        return proposal
    try:
        steps_s = np.diff(_log(proposal, robot).time_s)
    except InputError:
        return proposal
    each = int(_ENOUGH_S / np.median(steps_s)) if len(steps_s) else 1
    if each < 2:
        return proposal
    raw = proposal.raw
    thinned = replace(
        raw,
        columns={
            name: replace(column, values=column.values[::each]) for name, column in columns.items()
        },
        line=None if raw.line is None else raw.line[::each],
    )
    rate_Hz = None if proposal.rate_Hz is None else proposal.rate_Hz / each
    return replace(proposal, raw=thinned, rate_Hz=rate_Hz)


def _weighed(best: _Explanation, given: Proposal, robot: _core.Robot) -> Proposal:
    """The best by signs, held against what else may be: another order, and what no sign is."""
    as_read = _unturned(best.proposal, given)
    turned = _differing(best.proposal, as_read)
    signs = (
        f"sign {list(line.sign)} of the {line.name}"
        for line in best.proposal.lines
        if line.name in turned
    )
    best = replace(best, words=" and ".join(signs) or "the columns as they stand")
    others = []
    if turned:
        others = [*_reordered(as_read, robot), *_set_right(as_read, robot)]
    if "attitude" in turned:
        others += _other_conventions(as_read, robot)
    if not best.agrees:
        others += _set_right(best.proposal, robot)
    others = [
        _fitted(other)
        for other in others
        if other.robot is not robot or _differing(other.proposal, best.proposal)
    ]
    others.sort(key=lambda other: other.cost)
    as_good = [other for other in others if other.cost < others[0].cost + _EVIDENCE]
    # Of several that agree as well the one that changes least.
    others = sorted(as_good, key=lambda other: _changes(other.proposal, as_read))[:1]
    chosen = min([best, *others], key=lambda e: e.cost + (0.0 if e is best else _EVIDENCE))
    out = chosen.proposal
    changed = _differing(out, as_read)
    if chosen is not best:
        why = f"{chosen.words}: see that it is so"
        return _guesses(out, why, changed or {"attitude"})  # by a convention, which is the robot's
    if others and others[0].cost < best.cost + _EVIDENCE:
        why = f"or {others[0].words}, which agrees as well: see which it is"
        return _guesses(out, why, changed | _differing(out, others[0].proposal))
    if not best.agrees:
        why = "so it agrees best, but not well: see what calibrate and diagnose say of it"
        return _guesses(out, why, changed)
    return out


def _unturned(proposal: Proposal, given: Proposal) -> Proposal:
    """The same with the signs of another."""
    lines = zip(proposal.lines, given.lines, strict=True)
    return replace(
        proposal, lines=tuple(replace(line, sign=g.sign, why=g.why) for line, g in lines)
    )


def _changes(
    one: Proposal, other: Proposal, of: tuple[str, ...] = ("columns", "sign", "unit")
) -> int:
    """How many columns, signs and units of ``one`` the other does not have there."""
    return sum(
        mine != its
        for a, b in zip(one.lines, other.lines, strict=True)
        for what in of
        for mine, its in zip(_entries(a, what), _entries(b, what), strict=True)
    )


def _entries(line: Line, of: str) -> tuple[object, ...]:
    held = getattr(line, of)
    return held if isinstance(held, tuple) else (held,)


def _differing(one: Proposal, other: Proposal) -> set[str]:
    """The lines that are not the same in columns, signs or units."""
    return {
        a.name
        for a, b in zip(one.lines, other.lines, strict=True)
        if (a.columns, a.sign, a.unit) != (b.columns, b.sign, b.unit)
    }


def _guesses(proposal: Proposal, why: str, names: set[str] | None = None) -> Proposal:
    """Lines (of ``names``, or all) as mere guesses, and why."""
    lines = tuple(
        replace(line, sure="guess", why=f"{line.why}; {why}")
        if names is None or line.name in names
        else line
        for line in proposal.lines
    )
    return replace(proposal, lines=lines)


# Signs and units.


def _best_of_signs(
    proposal: Proposal, robot: _core.Robot
) -> tuple[_Explanation, dict[tuple[str | float, ...], float]]:
    """The signs and units that agree best, of several that agree as well those that change least;
    and the lowest cost with each choice of units."""
    by_units: dict[tuple[str | float, ...], float] = {}
    tried = []
    for lines in itertools.product(*map(_alternatives, proposal.lines)):
        tried.append(_fitted(_Explanation(replace(proposal, lines=lines), robot)))
        units = tuple(line.unit for line in lines)
        by_units[units] = min(tried[-1].cost, by_units.get(units, math.inf))
    least = min(by_units.values())
    if not math.isfinite(least):
        return tried[0], by_units
    as_good = [other for other in tried if other.cost < least + _EVIDENCE]
    best = min(as_good, key=lambda e: (_changes(e.proposal, proposal, ("sign",)), e.cost))
    as_they_stand = _Explanation(_unturned(best.proposal, proposal), robot)
    if _differing(best.proposal, as_they_stand.proposal):
        # One start may have missed the pose that the columns as they stand agree with.
        most = _core.CalibrateOptions().most_starts
        again, best = _fitted(as_they_stand, most), _fitted(best, most)
        if again.agrees and again.cost < best.cost + _EVIDENCE:
            best = again
    return best, by_units


def _alternatives(line: Line) -> list[Line]:
    """A line as it stands, then with other signs (of lengths, swivels, roll and pitch, yaw) and in
    the other units that it may have."""
    turns: list[tuple[int, ...]] = [(1,) * len(line.sign)]
    if line.name in ("lengths", "swivels"):
        turns.append((-1,) * len(line.sign))
    elif line.name == "attitude" and line.unit not in QUATERNIONS:
        turns = list(itertools.product((1, -1), repeat=3))
    out = []
    for unit, turn in itertools.product((line.unit, *line.rivals), turns):
        sign = tuple(s * t for s, t in zip(line.sign, turn, strict=True))
        why = line.why
        if sign != line.sign:
            why += "; sign by the robot's physics"
        if unit != line.unit:
            why += f"; but {unit} by the robot's physics"
        out.append(replace(line, unit=unit, sign=sign, why=why))
    return out


# Orders, and what else may be wrong.


def _reordered(as_read: Proposal, robot: _core.Robot) -> Iterator[_Explanation]:
    """The columns as they stand, of cables in another order."""
    for order in _orders(robot.cable_count):
        lines = tuple(_in_order(line, order) for line in as_read.lines)
        if lines != as_read.lines:
            words = f"the columns of cables {' '.join(str(i + 1) for i in order)} in this order"
            yield _Explanation(replace(as_read, lines=lines), robot, words)


def _orders(cables: int) -> Iterator[Sequence[int]]:
    if cables <= _MOST_ORDERED:
        yield from itertools.permutations(range(cables))
        return
    for first, step in itertools.product(range(cables), (1, -1)):
        yield [(first + step * i) % cables for i in range(cables)]


def _in_order(line: Line, order: Sequence[int]) -> Line:
    """A line of each cable's columns, read on others."""
    if line.name not in PER_CABLE:
        return line
    columns = tuple(line.columns[i] for i in order)
    return replace(line, columns=columns, sign=tuple(line.sign[i] for i in order))


def _other_conventions(as_read: Proposal, robot: _core.Robot) -> Iterator[_Explanation]:
    """The columns as they stand, of an AHRS that speaks otherwise than the robot file says."""
    for convention in _core.EulerConvention:
        if convention != robot.euler_convention:
            yield _Explanation(as_read, *_speaking(convention, robot))


def _speaking(convention: _core.EulerConvention, robot: _core.Robot) -> tuple[_core.Robot, str]:
    """A robot whose AHRS speaks so, and what to do about it."""
    key = "euler_convention: "
    text = _core.to_yaml(robot).replace(key + robot.euler_convention.name, key + convention.name)
    robot = _core.parse_robot(text, robot.name)
    return robot, f"the attitude in {convention.name}: correct euler_convention in the robot file"


def _set_right(proposal: Proposal, robot: _core.Robot) -> Iterator[_Explanation]:
    """Without what is wrong by ``find_discrete_faults``; nothing where it finds nothing."""
    try:
        faults = _core.find_discrete_faults(robot, _log(proposal, robot))
    except InputError:
        return
    lines = proposal.lines
    words = []
    for fault in faults:
        said = fault.text
        if fault.convention is not None:
            robot, said = _speaking(fault.convention, robot)
        words.append(said)
        lines = tuple(_without(line, fault) for line in lines)
    if faults:
        yield _Explanation(replace(proposal, lines=lines), robot, " and ".join(words))


def _without(line: Line, fault: _core.DiscreteFault) -> Line:
    """A line that sets a fault right."""
    if fault.parameter == "order":
        own = {"tensions": fault.tension_order, "swivels": fault.swivel_order}
        order = own.get(line.name) or fault.values
        return _in_order(line, [int(channel) - 1 for channel in order])
    concerned = _LINES_OF_FAULT.get(fault.name, ())
    if line.name not in concerned or line.unit in QUATERNIONS:
        return line
    if fault.parameter == "sign":
        sign = tuple(s * int(v) for s, v in zip(line.sign, fault.values, strict=True))
        return replace(line, sign=sign)
    dimension = GROUPS[line.name].unit
    off = fault.values[concerned.index(line.name)]
    if off == 1.0:
        return line
    scale = off * (factor(dimension, line.unit) or 1.0)
    units = UNITS[dimension]
    near = min(units, key=lambda unit: abs(units[unit] / scale - 1.0))
    return replace(line, unit=near if abs(units[near] / scale - 1.0) < _SAME_UNIT else scale)


# How well readings agree.


def _log(proposal: Proposal, robot: _core.Robot) -> _core.Log:
    return apply_map(proposal.raw, proposal.map(), "the proposed map", robot).log


def _fitted(tried: _Explanation, starts: int = 1) -> _Explanation:
    """With minus ln of the likelihood of the readings at rest as the file has them, noise taken
    from the residuals, but for a constant; infinite where there is no pose that agrees with them at
    all. They agree as they are where residuals are within what the sensors' sigma allow."""
    proposal, robot = tried.proposal, tried.robot
    held = any(line.name == "tensions" for line in proposal.lines)
    options = _core.CalibrateOptions(
        method=_core.Method.statics if held else _core.Method.kinematic,
        noise=_core.NoiseSource.specified,
        most_starts=starts,
    )
    try:
        found = _core.calibrate(robot, _log(proposal, robot), options).result
    except InputError:
        return tried
    if not len(found.poses):
        return tried
    rms = found.residual_rms
    units = {line.name: line.unit for line in proposal.lines}
    one_m = factor("m", units.get("lengths", "m")) or 1.0
    total = -robot.cable_count * len(found.poses) * math.log(one_m)
    for field, width in (
        ("length_m", robot.cable_count),
        ("swivel_rad", robot.cable_count),
        ("roll_pitch_rad", 2),
        ("yaw_rad", 1),
        ("wrench_force_N", 3),
        ("wrench_moment_Nm", 3),
    ):
        value = getattr(rms, field)
        if value is not None and math.isfinite(value) and value > 0.0:
            total += width * len(found.poses) * math.log(value)
    agrees = found.status == _core.CalibrationStatus.converged
    return replace(tried, cost=total, agrees=agrees)
