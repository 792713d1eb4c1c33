"""A mapping file for a raw file, from names, ranges and units, with how sure each line is."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.io.files import shown_path
from cdprcal.io.log_file import refuse_cable_count
from cdprcal.io.marks import marks_in, without
from cdprcal.mapping.document import GROUPS, QUATERNIONS
from cdprcal.mapping.physics import by_physics
from cdprcal.mapping.proposal import PER_CABLE, Line, Proposal
from cdprcal.mapping.raw import Floats, RawTable
from cdprcal.mapping.read import read_raw
from cdprcal.mapping.recognise import INERTIAL, WHOLE_LENGTHS, Name, taken_apart, with_indices
from cdprcal.mapping.time_column import time_of
from cdprcal.mapping.units import UNITS, G
from cdprcal.sensors import MOST_CABLES

_AXES = ("roll", "pitch", "yaw")
#: Of an inertial unit's columns: 'acc_x', 'GyrX [deg/s]', '/imu.angular_velocity.x'.
_AXIS = re.compile(r"(?:(?<![a-z])|(?<=acc)|(?<=gyr)|(?<=gyro)|(?<=omega))([xyz])(?![a-z0-9])")
#: An underactuated platform hangs; no run tilts it further [rad].
_MOST_TILT = math.radians(60.0)
#: No swivel or axis goes on beyond it [rad].
_TURN = 2.0 * math.pi
#: Nor does a platform turn faster [rad/s].
_MOST_RATE = 2.0 * math.pi
#: What all tensions together are of the platform's weight.
_OF_WEIGHT = (0.5, 20.0)
#: ln of how much shorter or longer a travel may be than a start-up's for a unit to be tried.
_MOST_OFF = math.log(30.0)
_RAW = 1e-9


def propose(raw: RawTable, robot: _core.Robot | None = None) -> Proposal:
    """What the columns of a raw file seem to be, with a robot also by its physics. Raises
    InputError when nothing is recognised, or the cables do not match the robot's."""
    proposal = recognised(raw, robot)
    return proposal if robot is None else by_physics(proposal, robot)


def recognised(raw: RawTable, robot: _core.Robot | None) -> Proposal:
    """As ``propose``, from names, ranges and units alone."""
    read, raw = raw, _without_marks(raw)
    names = {
        key: taken_apart(key, column.unit)
        for key, column in raw.columns.items()
        if not column.repeats
    }
    names = with_indices(names)
    named = _cable_count(names)
    count = named if robot is None else robot.cable_count
    names = _one_a_cable(names, count)
    time, rate_Hz = time_of(raw, names)
    left = {key: name for key, name in names.items() if key not in time.columns}
    groups = _cable_groups(raw, left, count, robot)
    if robot is not None and named and not groups:
        refuse_cable_count(raw.path, named, robot)
    attitude = _attitude(raw, left, robot)
    inertial = [line for kind in INERTIAL if (line := _inertial(raw, left, kind)) is not None]
    found = [*groups, *([attitude] if attitude is not None else []), *inertial]
    for key in (*time.columns, *(key for line in found for key in line.columns)):
        if key in raw.columns:
            raw.readings(key)  # refuses cells that cannot be read
    found = [_with_unit(raw, names, line, robot) for line in found]
    if raw.kind == "records" and robot is not None:
        found = _records(raw, robot) or found
    if not found:
        shown = ", ".join(repr(key) for key in list(raw.columns)[:30])
        raise InputError(
            f"{shown_path(raw.path)}: no column is recognised as a cable's or an attitude's; write "
            f"a mapping file by hand (docs/your-log.md). It has {shown}"
        )
    if raw.kind == "bag":
        time = replace(time, columns=(_topic(found[0].columns[0]),), why="the topic of the lengths")
    found = [_with_repeats(raw, line) for line in found]
    return Proposal(raw, time, tuple(found), rate_Hz, _missing(read, found))


def _without_marks(raw: RawTable) -> RawTable:
    """As if cells were empty that seem to say that nothing was read."""
    columns = {
        key: replace(column, values=without(column.values, marks_in(column.values)))
        for key, column in raw.columns.items()
    }
    return replace(raw, columns=columns)


def _missing(raw: RawTable, lines: list[Line]) -> Line | None:
    """The numbers that seem to say in these lines' columns that nothing was read."""
    columns = [key for line in lines for key in line.columns if key]
    counts = {key: found for key in columns if (found := marks_in(raw.columns[key].values))}
    if not counts:
        return None
    marks = sorted({mark for found in counts.values() for mark in found})
    times = sum(sum(found.values()) for found in counts.values())
    why = f"{times} times, far from all that is read beside it"
    return Line("missing", tuple(counts), str(marks), (), "likely", why)


def _with_repeats(raw: RawTable, line: Line) -> Line:
    """A line is but a guess when the file has two columns of a name that it takes."""
    twice = [column.repeats for column in raw.columns.values() if column.repeats in line.columns]
    if not any(twice):
        return line
    why = f"the file names {', '.join(filter(None, twice))} more than once, the first is taken"
    return replace(line, sure="guess", why=f"{line.why}; {why}")


def _records(raw: RawTable, robot: _core.Robot) -> list[Line]:
    """Whole lengths, where records have a number for each cable: people write down what they read.

    The unit is the one with which the longest is nearest to the robot's size.
    """
    columns = tuple(name for name in raw.columns if name != "run")
    if len(columns) != robot.cable_count:
        return []
    size_m = _core.robot_size_m(robot)
    longest = max(float(np.nanmax(raw.columns[name].values)) for name in columns)
    if not (size_m > 0.0 and longest > 0.0):
        return []
    unit = min(UNITS["m"], key=lambda unit: abs(math.log(UNITS["m"][unit] * longest / size_m)))
    why = "a number for each cable, in the order of the robot file's; unit by the robot's size"
    return [Line(WHOLE_LENGTHS, columns, unit, (1,) * len(columns), "guess", why)]


def _topic(column: str) -> str:
    return column.partition(".")[0]


# Which columns are which.


#: What a numbered family with one column a cable is: by its unit, else by the kind of its names.
_FAMILY_OF_UNIT = {
    unit: kind
    for dimension, kind in (("m", "lengths"), ("rad", "swivels"), ("N", "tensions"))
    for unit in UNITS[dimension]
}
_FAMILY_OF_KIND = {"time": "tensions", **dict.fromkeys(_AXES, "swivels")}


def _one_a_cable(names: dict[str, Name], count: int) -> dict[str, Name]:
    """Names with the kind that numbers tell: theta_1 … theta_4 are four cables' swivels, and theta
    is the platform's pitch; T1 … T4 are tensions, and t is the time."""
    out = dict(names)
    open_kinds = {"", *_FAMILY_OF_KIND}
    for family in _alike([n for n in names.values() if n.kind in open_kinds and n.index]):
        kind = _FAMILY_OF_UNIT.get(family[0].unit or "") or _FAMILY_OF_KIND.get(family[0].kind)
        if kind and len(family) == count:
            out |= {name.text: replace(name, kind=kind) for name in family}
    return out


def _cable_groups(
    raw: RawTable, names: dict[str, Name], count: int, robot: _core.Robot | None
) -> list[Line]:
    """A line for every kind of reading that there is one of a cable."""
    lines = []
    for kind in PER_CABLE:
        candidates = [
            group
            for group in _alike([name for name in names.values() if name.kind == kind])
            if len(group) == count
        ]
        candidates = [g for g in candidates if any(_moves(raw, name) for name in g)]
        read = [g for g in candidates if kind == "tension_setpoints" or not g[0].is_asked]
        candidates = read or candidates
        if not candidates:
            continue
        best = max(candidates, key=lambda group: _fit(kind, group))
        sure = "sure" if len(candidates) == 1 else "likely"
        others = (
            ""
            if len(candidates) == 1
            else "; or " + ", ".join(group[0].text for group in candidates if group is not best)
        )
        if not read:
            sure, others = "guess", f"; which says that it was commanded, not read{others}"
        columns = tuple(name.text for name in best)
        lines.append(Line(kind, columns, "", (1,) * count, sure, f"by name{others}"))
    if not any(line.name == "lengths" for line in lines):
        lines += _by_place(raw, names, count, {line.name for line in lines}, robot)
    return lines


def _moves(raw: RawTable, name: Name) -> bool:
    """Whether a column holds readings, be it such as cannot be read ('1,817.5')."""
    column = raw.columns[name.text]
    if column.unread is not None and re.search(r"\d", column.unread[1]):
        return True
    there = column.values[np.isfinite(column.values)]
    return len(there) > 1 and float(np.ptp(there)) > 0.0


def _cable_count(names: dict[str, Name]) -> int:
    """Of the kinds that are one a cable, the most frequent number of columns alike."""
    sizes = [
        len(group)
        for kind in ("lengths", "swivels", "tensions")
        for group in _alike([name for name in names.values() if name.kind == kind])
        if 1 < len(group) <= MOST_CABLES
    ]
    return max(sorted(set(sizes)), key=sizes.count, default=0)


def _alike(names: list[Name]) -> list[list[Name]]:
    """Names that differ in a number or one word only, in the order of the cables."""
    groups: dict[str, list[Name]] = {}
    for name in names:
        groups.setdefault(name.stem if name.index else "", []).append(name)
    unnumbered = groups.pop("", [])
    numbered = [sorted(group, key=lambda name: int(name.index)) for group in groups.values()]
    by_shape: dict[tuple[str, str], list[Name]] = {}
    for name in unnumbered:  # fl, fr, rr, rl: in the order of the file
        shape = re_shape(name.text)
        by_shape.setdefault(shape, []).append(name)
    return [*numbered, *by_shape.values()]


def re_shape(text: str) -> tuple[str, str]:
    """What names of one group share when a word tells the cables apart: topic, and field."""
    topic, _, rest = text.partition(".")
    field, _, _ = rest.rpartition(".")
    if text.startswith("/"):
        # '/cell_a.force.norm' and '/cell_b.force.norm', or '/joints.position.fl' and '… .fr'.
        return ("", rest) if rest.endswith(("norm", "data")) else (topic, field)
    words = taken_apart(text)
    return ("", f"{words.kind} {words.unit}")


def _fit(kind: str, group: list[Name]) -> tuple[bool, bool, int]:
    """Which of several groups of a kind is meant rather."""
    texts = " ".join(name.text.lower() for name in group)
    right = {
        "lengths": ("length", "position", "laenge", "länge", "longueur", "lunghezza"),
        "swivels": ("swivel",),
        "tensions": ("norm", "effort", "tension", "kraft"),
    }.get(kind, ())
    return any(word in texts for word in right), group[0].unit is not None, -len(texts)


def _by_place(
    raw: RawTable,
    names: dict[str, Name],
    count: int,
    known: set[str],
    robot: _core.Robot | None,
) -> list[Line]:
    """Columns without a name that says anything: blocks of one a cable, told apart by range."""
    if robot is None or not count:
        return []
    weight_N = robot.weight_N
    free = [
        key
        for key, name in names.items()
        if not name.kind and _moves(raw, name) and raw.columns[key].unread is None
    ]
    lines: list[Line] = []
    while len(free) >= count:
        block = free[:count]
        values = np.stack([raw.columns[key].values for key in block], axis=1)
        total = float(np.nanmedian(np.abs(values).sum(axis=1)))
        positive = float(np.nanmin(values)) > 0.0
        if (
            "tensions" not in known
            and positive
            and _OF_WEIGHT[0] < total / weight_N < _OF_WEIGHT[1]
        ):
            kind, why = "tensions", "its place, and a sum as the platform's weight"
        elif "lengths" not in known:
            kind, why = "lengths", "its place: the first block of one a cable"
        elif "swivels" not in known:
            kind, why = "swivels", "its place: a further block of one a cable"
        else:
            break
        known.add(kind)
        lines.append(Line(kind, tuple(block), "", (1,) * count, "guess", why))
        free = free[count:]
    if len(free) >= 3 and not any(name.kind in (*_AXES, "quaternion") for name in names.values()):
        lines.append(
            Line("attitude", tuple(free[:3]), "", (1, 1, 1), "guess", "its place: the next three")
        )
    return lines


def _attitude(raw: RawTable, names: dict[str, Name], robot: _core.Robot | None) -> Line | None:
    names = _read_rather(names)
    parts = [[n for n in names.values() if n.kind == axis and _moves(raw, n)] for axis in _AXES]
    # A full name beats an alias: pitch is pitch, whatever theta is.
    parts = [
        [name for name in part if axis in name.text.lower()] or part
        for axis, part in zip(_AXES, parts, strict=True)
    ]
    if any(parts):
        columns = tuple(part[0].text if part else "" for part in parts)
        # A compass counts clockwise.
        left = parts[2] and any(word in columns[2].lower() for word in ("heading", "course"))
        why = "by name; a heading counts clockwise" if left else "by name"
        return Line("attitude", columns, "", (1, 1, -1 if left else 1), "sure", why)
    for family in _alike([n for n in names.values() if n.kind == "attitude" and n.index]):
        if len(family) == len(_AXES) and any(_moves(raw, name) for name in family):
            columns = tuple(name.text for name in family)
            why = "by name; in the order roll, pitch, yaw"
            return Line("attitude", columns, "", (1, 1, 1), "likely", why)
    by_axis: dict[str, str] = {}
    for name in names.values():
        if name.kind == "quaternion":
            by_axis.setdefault(name.text.rstrip("0123456789)]").lower()[-1:], name.text)
    if set("wxyz") <= set(by_axis):
        columns = tuple(by_axis[axis] for axis in "xyzw")
        return Line("attitude", columns, "quaternion_xyzw", (1,) * 4, "sure", "by name")
    return _numbered_quaternion(raw, names, robot)


def _read_rather(names: dict[str, Name]) -> dict[str, Name]:
    """Without the axes and quaternions that were commanded where there are others of the kind."""
    read = {name.kind for name in names.values() if not name.is_asked}
    return {k: name for k, name in names.items() if not (name.is_asked and name.kind in read)}


def _numbered_quaternion(
    raw: RawTable, names: dict[str, Name], robot: _core.Robot | None
) -> Line | None:
    """q0 … q3 or quat1 … quat4: four columns of one norm, w first unless physics says last."""
    of_four = [n for n in names.values() if n.index and (n.kind == "quaternion" or _is_q(n))]
    for family in _alike(of_four):
        columns = tuple(name.text for name in family)
        values = np.stack([raw.columns[key].values for key in columns], axis=1)
        norm = np.linalg.norm(values, axis=1)
        norm = norm[np.isfinite(norm)]
        if len(family) == 4 and len(norm) and norm.min() > 0.99 * norm.max() > 0.0:
            why = "by name; in the order w, x, y, z"
            sure = "guess" if robot is None else "likely"
            order = "quaternion_wxyz"
            return Line("attitude", columns, order, (1,) * 4, sure, why, ("quaternion_xyzw",))
    return None


def _is_q(name: Name) -> bool:
    return not name.kind and re.fullmatch(r"(.*_)?q_#", name.stem) is not None


def _inertial(raw: RawTable, names: dict[str, Name], kind: str) -> Line | None:
    """The three axes of an accelerometer or a gyroscope; the first that has all."""
    by_stem: dict[str, dict[str, str]] = {}
    for name in names.values():
        axis = _AXIS.search(name.text.lower())
        if name.kind == kind and axis is not None and _moves(raw, name):
            stem = name.text[: axis.start(1)] + name.text[axis.end(1) :]
            by_stem.setdefault(stem, {})[axis[1]] = name.text
    for found in by_stem.values():
        if set(found) == set("xyz"):
            columns = tuple(found[axis] for axis in "xyz")
            return Line(kind, columns, "", (1, 1, 1), "sure", "by name")
    return None


# Units.


def _with_unit(
    raw: RawTable, names: dict[str, Name], line: Line, robot: _core.Robot | None
) -> Line:
    if line.unit in QUATERNIONS:
        return line
    dimension = GROUPS[line.name].unit
    there = [key for key in line.columns if key]
    values = np.stack([raw.columns[key].values for key in there], axis=1)
    if dimension == "N" and float(np.nanmedian(values)) < 0.0:
        turned = tuple(-sign for sign in line.sign)
        line = replace(line, sign=turned, why=f"{line.why}; sign since no cable pushes")
    written = {names[key].unit or names[key].unknown for key in there} - {""}
    if dimension == "m_s2":
        written = {"g" if unit == "gf" else unit for unit in written}
    if len(written) == 1 and written < set(UNITS[dimension]):
        (unit,) = written
        if unit == "rad" and (usual := float(np.nanmax(np.nanmedian(np.abs(values), 0)))) > _TURN:
            why = f"{line.why}; rad as written, but around {usual:.3g}: see that it is degrees"
            return replace(line, unit="deg", sure="guess", why=why)
        return replace(line, unit=unit, why=f"{line.why}; unit as written")
    unit, why, has_scale, rivals = _unit_by_range(line.name, values, robot)
    if written:
        one = dimension.replace("_s", "/s")
        remedy = (
            f", which is no known unit of it: give the {one} that one is"
            if len(written) == 1
            else ": convert the columns to one unit"
        )
        why = f"in {' and '.join(sorted(written))}{remedy}"
        has_scale, rivals = False, ()
    sure = "likely" if line.sure == "sure" else line.sure
    return replace(
        line,
        unit=unit,
        sure=sure if has_scale else "guess",
        why=f"{line.why}; {why}",
        rivals=rivals,
        has_scale=has_scale,
    )


def _unit_by_range(
    kind: str, values: Floats, robot: _core.Robot | None
) -> tuple[str, str, bool, tuple[str, ...]]:
    """A unit, why, whether it may be right, and which others may be as well."""
    dimension = GROUPS[kind].unit
    if dimension == "rad":
        tilt = values[:, :2] if kind == "attitude" else values
        most = float(np.nanmax(np.abs(tilt)))
        limit = _MOST_TILT if kind == "attitude" else _TURN
        read = values[np.isfinite(values).all(axis=1)]  # other sensors may have rows between
        steps = (
            float(np.median(np.abs(np.diff(read, axis=0)).max(axis=1))) if len(read) > 1 else 0.0
        )
        # What is small enough for both: samples of a degree's tenth are no tenth of a radian.
        unit = "deg" if most > limit or steps > math.radians(10.0) else "rad"
        return unit, f"unit by range: up to {most:.3g}", True, ()
    if dimension == "N":
        total = float(np.nanmedian(np.abs(values).sum(axis=1)))
        if robot is None:
            return "N", f"nothing says the unit: together {total:.3g}; give it", False, ()
        # Cables that hang a platform carry somewhat more than its weight, never less.
        shares = {
            u: total * UNITS["N"][u] / robot.weight_N for u in ("N", "kN", "kgf", "lbf", "daN")
        }
        unit = min(shares, key=lambda u: abs(math.log(max(shares[u], _RAW) / 2.0)))
        least, most = _OF_WEIGHT
        why = f"unit by the platform's weight: together {total:.3g}, {robot.weight_N:.3g} N"
        fit = tuple(u for u, share in shares.items() if u != unit and least < share < most)
        return unit, why, least < shares[unit] < most, fit
    if dimension == "m_s2":
        size = float(np.nanmedian(np.linalg.norm(values, axis=1)))
        units = UNITS[dimension]
        unit = min(units, key=lambda u: abs(math.log(max(size * units[u], _RAW) / G)))
        return unit, f"unit by gravity: {size:.3g}", True, ()
    if dimension == "rad_s":
        most = float(np.nanmax(np.abs(values)))
        unit = "deg/s" if most > _MOST_RATE else "rad/s"
        return unit, f"unit by range: up to {most:.3g}", True, ()
    travel = float(np.nanmax(np.nanmax(values, axis=0) - np.nanmin(values, axis=0)))
    size_m = 2.0 if robot is None else _size_m(robot)
    offs = {u: _off(travel * UNITS["m"][u] / size_m) for u in ("m", "mm", "cm", "in")}
    unit = min(offs, key=lambda u: offs[u])
    off = offs[unit]
    why = f"unit by range: {travel:.3g} of travel"
    if robot is not None and off > math.log(10.0):  # further than from one unit to the next
        return unit, f"{why}, which fits no unit: give the m that one is", False, ()
    rivals = () if robot is None else tuple(u for u in offs if u != unit and offs[u] < _MOST_OFF)
    return unit, why, True, rivals


def _size_m(robot: _core.Robot) -> float:
    anchors = np.array([cable.pulley.position_m for cable in robot.cables])
    return float(np.linalg.norm(np.ptp(anchors, axis=0)))


def _off(share: float) -> float:
    """How far a travel is from what start-ups have: a third of the frame's size."""
    return abs(math.log(max(share, _RAW) * 3.0))


def propose_file(path: str | Path, robot: _core.Robot | None = None) -> Proposal:
    """As ``propose``, for a file of any kind. Raises InputError."""
    return propose(read_raw(path), robot)
