"""What `cdprcal calibrate` makes of logs and robot files with a mistake in them.

    python tests/studies/edits.py --runs 500 --seed 1      # while tuning
    python tests/studies/edits.py --runs 2000 --seed 1001  # to judge: seeds from 1001 on

A log of one of several robots is simulated, one thing in it or in the robot file is made wrong (in
a fifth of the cases two), and the command is run on both. Counted: runs that end with exit code 0
although the pose is more than 5σ (Mahalanobis) or 50 mm from the truth; and, of logs and files that
nobody touched, how many end with 0. Exit code 1 when more than 0.3 % are silently beyond 5σ or one
is beyond 50 mm. No threshold of the package may be chosen by what seeds from 1001 on show.
"""

from __future__ import annotations

import argparse
import io
import json
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML
from typer.testing import CliRunner

import cdprcal
from cdprcal.cli import app
from cdprcal.io import save_log
from cdprcal.testing.blind_bench.machines import Machine, draw_machine

Floats = NDArray[np.float64]
MOST_SIGMA, MOST_M, MOST_SHARE = 5.0, 0.05, 0.003
#: Robots and runs that are edited again and again, by seed.
BASES = 60
#: Euler orders, as a robot file names them.
ORDERS = tuple(cdprcal.EulerConvention.__members__)


@dataclass
class Subject:
    """What an edit may change: readings by group, times, and the robot file as a document."""

    readings: dict[str, Floats]
    time_s: Floats
    file: dict[str, Any]
    robot: cdprcal.Robot  #: the true one
    pose: cdprcal.Pose  #: true, of the platform frame that the file means
    rng: np.random.Generator
    said: list[str] = field(default_factory=list)

    def cable(self) -> int:
        return int(self.rng.integers(self.robot.cable_count))

    def factor(self) -> float:
        """From slightly wrong to ridiculous."""
        return float(self.rng.choice([0.5, 0.9, 0.97, 0.99, 1.003, 1.01, 1.03, 1.1, 2.0]))

    def size_m(self) -> float:
        """How large the frame is."""
        points = np.array([cable.pulley.position_m for cable in self.robot.cables])
        return float(np.max(np.linalg.norm(points[:, None] - points[None], axis=-1)))


@dataclass(frozen=True)
class Base:
    """A robot, its log without a mistake, and where it hung first."""

    robot: cdprcal.Robot
    log: cdprcal.Log
    pose: cdprcal.Pose


@cache
def base(number: int) -> Base:
    """Simulated run: robot, rests, noise, sensors and whether its winches rub, all drawn."""
    rng = np.random.default_rng([number, 77])
    built_in = ("irma4", "irma4", "ring3", "ring5", "posts8")
    for _ in range(50):
        try:
            if rng.random() < 0.6:
                robot = cdprcal.load_robot(str(rng.choice(built_in)))
                visited = list(cdprcal.default_setpoints(robot, *GRIDS[rng.integers(len(GRIDS))]))
            else:
                machine: Machine = draw_machine(rng)
                robot, visited = machine.robot(), machine.setpoints(8)
            noise = float(rng.choice([0.05, 0.1, 0.3, 1.0]))
            options = cdprcal.SyntheticLogOptions(
                noise=cdprcal.reading_noise(robot.sigma, noise),
                seed=int(rng.integers(2**31)),
                dwell_s=4.0,
                move_s=4.0,
            )
            made = cdprcal.synthetic_log(robot, visited, options)
        except cdprcal.InputError:
            continue
        kept = {
            group: getattr(made.log, group)
            for group in ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
        }
        missing = rng.random()
        if missing < 0.2:
            del kept["swivel_rad"]
        elif missing < 0.3:
            del kept["tension_N"]
        log = cdprcal.Log(time_s=made.log.time_s, source=f"base {number}", **kept)
        return Base(robot, log, made.poses[0])
    raise RuntimeError(f"base {number}: no robot could be visited")


GRIDS = ((2, 2, 1), (2, 2, 2), (3, 2, 2), (3, 3, 2))

Edit = Callable[[Subject], str]


def _scaled(group: str, one: bool) -> Edit:
    def edit(subject: Subject) -> str:
        factor, cable = subject.factor(), subject.cable()
        readings = subject.readings[group]
        readings[:, cable if one else slice(None)] *= factor
        return f"{group} ×{factor:g}" + (f" of cable {cable + 1}" if one else "")

    return edit


def _negated(group: str, one: bool) -> Edit:
    def edit(subject: Subject) -> str:
        cable = subject.cable()
        subject.readings[group][:, cable if one else slice(None)] *= -1.0
        return f"{group} negated" + (f" of cable {cable + 1}" if one else "")

    return edit


def _in_unit(group: str, factor: float, name: str) -> Edit:
    def edit(subject: Subject) -> str:
        subject.readings[group] *= factor
        return f"{group} in {name}"

    return edit


def _swapped(*groups: str) -> Edit:
    def edit(subject: Subject) -> str:
        a, b = subject.rng.choice(subject.robot.cable_count, size=2, replace=False)
        for group in groups:
            if group in subject.readings:
                subject.readings[group][:, [a, b]] = subject.readings[group][:, [b, a]]
        return f"{' and '.join(groups)}: cables {a + 1} and {b + 1} swapped"

    return edit


def _rolled(subject: Subject) -> str:
    by = int(subject.rng.integers(1, subject.robot.cable_count))
    groups = [g for g in ("length_m", "swivel_rad", "tension_N") if g in subject.readings]
    for group in groups:
        subject.readings[group] = np.roll(subject.readings[group], by, axis=1)
    return f"all cables counted from {by + 1}"


def _attitude(*signs: float) -> Edit:
    def edit(subject: Subject) -> str:
        subject.readings["roll_pitch_yaw_rad"] *= np.array(signs)
        return f"attitude times {signs}"

    return edit


def _roll_pitch_swapped(subject: Subject) -> str:
    angles = subject.readings["roll_pitch_yaw_rad"]
    angles[:, [0, 1]] = angles[:, [1, 0]]
    return "roll and pitch swapped"


def _mounted(axis: int | None) -> Edit:
    """The attitude sensor is turned on the platform: about one axis of it, or by right angles."""

    def edit(subject: Subject) -> str:
        convention = subject.robot.euler_convention
        degrees = float(subject.rng.choice([0.5, 1.0, 2.0, 5.0])) if axis is not None else 90.0
        turn_rad = np.zeros(3)
        turn_rad[2 if axis is None else axis] = np.radians(degrees) * subject.rng.choice([-1, 1])
        turn = cdprcal.Pose.from_euler([0, 0, 0], turn_rad, cdprcal.EulerConvention.XYZ).rotation
        angles = subject.readings["roll_pitch_yaw_rad"]
        for row in range(len(angles)):
            pose = cdprcal.Pose.from_euler([0, 0, 0], angles[row], convention)
            angles[row] = cdprcal.Pose([0, 0, 0], pose.rotation @ turn).euler_rad(convention)
        return f"attitude sensor turned {degrees:g}° about {'xyz'[2 if axis is None else axis]}"

    return edit


def _added(group: str, sizes: Sequence[float]) -> Edit:
    def edit(subject: Subject) -> str:
        size = float(subject.rng.choice(sizes)) * float(subject.rng.choice([-1.0, 1.0]))
        column = subject.cable() if group == "tension_N" else int(subject.rng.integers(2))
        if group == "tension_N":
            size *= subject.robot.weight_N / subject.robot.cable_count
        subject.readings[group][:, column] += size
        return f"{group} {column + 1} shifted by {size:.3g}"

    return edit


def _slips(subject: Subject) -> str:
    cable, size = subject.cable(), float(subject.rng.choice([0.003, 0.01, 0.05]))
    at = int(subject.rng.uniform(0.2, 0.8) * len(subject.time_s))
    subject.readings["length_m"][at:, cable] += size * subject.size_m()
    return f"cable {cable + 1} slips {size * subject.size_m():.3g} m at {subject.time_s[at]:.0f} s"


def _stuck(group: str) -> Edit:
    def edit(subject: Subject) -> str:
        cable = subject.cable()
        readings = subject.readings[group]
        readings[:, cable % readings.shape[1]] = readings[0, cable % readings.shape[1]]
        return f"{group} {cable + 1} stuck"

    return edit


def _late(group: str) -> Edit:
    def edit(subject: Subject) -> str:
        rows = int(subject.rng.choice([2, 5, 10]))
        readings = subject.readings[group]
        readings[rows:] = readings[:-rows].copy()
        return f"{group} {rows} rows late"

    return edit


def _drifts(subject: Subject) -> str:
    degrees = float(subject.rng.choice([1.0, 5.0, 20.0]))
    angles = subject.readings["roll_pitch_yaw_rad"]
    angles[:, 2] += np.radians(degrees) * np.linspace(0.0, 1.0, len(angles))
    return f"yaw drifts {degrees:g}°"


def _milliseconds(subject: Subject) -> str:
    subject.time_s *= 1000.0
    return "time in milliseconds"


def _pulley(key: str) -> Edit:
    def edit(subject: Subject) -> str:
        cables = subject.file["cables"]
        chosen = [subject.cable()] if subject.rng.random() < 0.5 else range(len(cables))
        factor = float(subject.rng.choice([0.0, 0.5, 1.3, 2.0]))
        for cable in chosen:
            cables[cable]["pulley"][key] *= factor
        return f"pulley {key} ×{factor:g} of {len(list(chosen))} cables"

    return edit


def _moved_point(place: str, shares: Sequence[float]) -> Edit:
    def edit(subject: Subject) -> str:
        cable, axis = subject.cable(), int(subject.rng.integers(3))
        by = float(subject.rng.choice(shares)) * subject.size_m() * subject.rng.choice([-1, 1])
        point = _points(subject.file)[place][cable]
        point[axis] = float(point[axis] + by)
        return f"{place} of cable {cable + 1} moved {by:.3g} m along {'xyz'[axis]}"

    return edit


def _scaled_points(place: str, one_axis: bool) -> Edit:
    def edit(subject: Subject) -> str:
        factor, axis = subject.factor(), int(subject.rng.integers(3))
        points = _points(subject.file)[place]
        middle = np.mean(points, axis=0)  # about the origin the frame would move as a whole, too
        for point in points:
            for i in range(3):
                if not one_axis or i == axis:
                    point[i] = float(middle[i] + factor * (point[i] - middle[i]))
        return f"{place}s ×{factor:g}" + (f" along {'xyz'[axis]}" if one_axis else "")

    return edit


def _swapped_points(place: str) -> Edit:
    def edit(subject: Subject) -> str:
        a, b = subject.rng.choice(subject.robot.cable_count, size=2, replace=False)
        points = _points(subject.file)[place]
        points[a][:], points[b][:] = list(points[b]), list(points[a])
        return f"{place}s {a + 1} and {b + 1} swapped"

    return edit


def _sign_of_point(place: str) -> Edit:
    def edit(subject: Subject) -> str:
        cable, axis = subject.cable(), int(subject.rng.integers(3))
        point = _points(subject.file)[place][cable]
        point[axis] = -float(point[axis])
        return f"{place} {cable + 1}: {'xyz'[axis]} negated"

    return edit


def _all_shifted(place: str) -> Edit:
    def edit(subject: Subject) -> str:
        axis = int(subject.rng.integers(3))
        by = float(subject.rng.choice([0.003, 0.01, 0.05])) * subject.size_m()
        for point in _points(subject.file)[place]:
            point[axis] = float(point[axis] + by)
        # Anchors as measured from another point are of the frame there: its mass centre is wrong.
        pose = subject.pose
        subject.pose = cdprcal.Pose(
            pose.position_m - by * np.asarray(pose.rotation)[:, axis], pose.rotation
        )
        return f"all {place}s shifted {by:.3g} m along {'xyz'[axis]}"

    return edit


def _points(file: dict[str, Any]) -> dict[str, list[list[float]]]:
    return {
        "pulley": [cable["pulley"]["position_m"] for cable in file["cables"]],
        "anchor": [cable["platform_anchor_m"] for cable in file["cables"]],
    }


def _axis(key: str) -> Edit:
    def edit(subject: Subject) -> str:
        cables = subject.file["cables"]
        chosen = [subject.cable()] if subject.rng.random() < 0.5 else range(len(cables))
        for cable in chosen:
            pulley = cables[cable]["pulley"]
            pulley[key] = [-float(v) for v in pulley[key]]
        return f"{key} turned over of {len(list(chosen))} cables"

    return edit


def _mass(subject: Subject) -> str:
    factor = subject.factor()
    subject.file["platform"]["mass_kg"] *= factor
    return f"mass ×{factor:g}"


def _centre(subject: Subject) -> str:
    axis, by = int(subject.rng.integers(3)), float(subject.rng.choice([0.005, 0.02, 0.1]))
    centre = subject.file["platform"]["centre_of_mass_m"]
    centre[axis] = float(centre[axis] + by * subject.size_m() / 3.0)
    return f"centre of mass moved along {'xyz'[axis]}"


def _centre_turned_over(subject: Subject) -> str:
    centre = subject.file["platform"]["centre_of_mass_m"]
    centre[:] = [-float(v) for v in centre]
    return "centre of mass negated"


def _order(subject: Subject) -> str:
    order = str(subject.rng.choice(ORDERS))
    subject.file["sensors"]["euler_convention"] = order
    return f"euler_convention {order}"


def _sigma(subject: Subject) -> str:
    factor = float(subject.rng.choice([0.05, 0.2, 5.0, 20.0]))
    sigma = subject.file["sensors"]["sigma"]
    for key in sigma:
        sigma[key] = float(sigma[key] * factor)
    return f"sigma ×{factor:g}"


_DEGREES = 180.0 / np.pi
L, S, T, A = "length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"
#: Name of a kind → what it needs of the log, and the edit. Kinds are drawn evenly.
KINDS: dict[str, tuple[tuple[str, ...], Edit]] = {
    "lengths scaled": ((L,), _scaled(L, one=False)),
    "one length scaled": ((L,), _scaled(L, one=True)),
    "lengths negated": ((L,), _negated(L, one=False)),
    "one length negated": ((L,), _negated(L, one=True)),
    "lengths in mm": ((L,), _in_unit(L, 1e3, "mm")),
    "lengths in inches": ((L,), _in_unit(L, 1 / 0.0254, "inches")),
    "lengths swapped": ((L,), _swapped(L)),
    "length stuck": ((L,), _stuck(L)),
    "lengths late": ((L,), _late(L)),
    "cable slips": ((L,), _slips),
    "swivels negated": ((S,), _negated(S, one=False)),
    "one swivel negated": ((S,), _negated(S, one=True)),
    "swivels in degrees": ((S,), _in_unit(S, _DEGREES, "degrees")),
    "swivels scaled": ((S,), _scaled(S, one=False)),
    "swivels swapped": ((S,), _swapped(S)),
    "swivel stuck": ((S,), _stuck(S)),
    "tensions negated": ((T,), _negated(T, one=False)),
    "tensions scaled": ((T,), _scaled(T, one=False)),
    "one tension scaled": ((T,), _scaled(T, one=True)),
    "tensions in kgf": ((T,), _in_unit(T, 1 / 9.80665, "kgf")),
    "tensions in lbf": ((T,), _in_unit(T, 1 / 4.4482216152605, "lbf")),
    "tension shifted": ((T,), _added(T, (0.02, 0.1, 0.3))),
    "tensions swapped": ((T,), _swapped(T)),
    "tension stuck": ((T,), _stuck(T)),
    "cables swapped": ((L,), _swapped(L, S, T)),
    "winches swapped": ((L,), _swapped(L, S)),
    "cables counted on": ((L,), _rolled),
    "roll negated": ((A,), _attitude(-1, 1, 1)),
    "pitch negated": ((A,), _attitude(1, -1, 1)),
    "roll and pitch negated": ((A,), _attitude(-1, -1, 1)),
    "yaw negated": ((A,), _attitude(1, 1, -1)),
    "attitude negated": ((A,), _attitude(-1, -1, -1)),
    "attitude in degrees": ((A,), _in_unit(A, _DEGREES, "degrees")),
    "roll and pitch swapped": ((A,), _roll_pitch_swapped),
    "attitude mounted off in roll": ((A,), _mounted(0)),
    "attitude mounted off in pitch": ((A,), _mounted(1)),
    "attitude mounted off in yaw": ((A,), _mounted(2)),
    "attitude mounted at a right angle": ((A,), _mounted(None)),
    "attitude shifted": ((A,), _added(A, (0.5 / _DEGREES, 2 / _DEGREES, 10 / _DEGREES))),
    "attitude late": ((A,), _late(A)),
    "yaw drifts": ((A,), _drifts),
    "time in ms": ((), _milliseconds),
    "pulley radius": ((), _pulley("radius_m")),
    "pulley moved": ((), _moved_point("pulley", (0.003, 0.01, 0.1))),
    "pulleys scaled": ((), _scaled_points("pulley", one_axis=False)),
    "pulleys stretched": ((), _scaled_points("pulley", one_axis=True)),
    "pulleys swapped": ((), _swapped_points("pulley")),
    "sign of a pulley": ((), _sign_of_point("pulley")),
    "anchor moved": ((), _moved_point("anchor", (0.002, 0.01, 0.05))),
    "anchors scaled": ((), _scaled_points("anchor", one_axis=False)),
    "anchors swapped": ((), _swapped_points("anchor")),
    "sign of an anchor": ((), _sign_of_point("anchor")),
    "anchors shifted": ((), _all_shifted("anchor")),
    "swivel axis": ((), _axis("swivel_axis")),
    "x axis": ((), _axis("x_axis")),
    "mass": ((), _mass),
    "centre of mass": ((), _centre),
    "centre of mass negated": ((), _centre_turned_over),
    "euler convention": ((), _order),
    "sigma": ((), _sigma),
}
#: Share of cases that nobody touched, and of those with two edits.
UNTOUCHED, TWO = 0.1, 0.2


@dataclass(frozen=True)
class Outcome:
    """How one run ended."""

    number: int
    kinds: tuple[str, ...]
    said: str
    code: int
    error_m: float = 0.0
    in_sigma: float = 0.0
    sigma_m: float = 0.0
    reason: str = ""

    @property
    def wrong(self) -> bool:
        return self.in_sigma > MOST_SIGMA or self.error_m > MOST_M


def run(number: int, seed: int) -> Outcome:
    """Draws one case, runs the command on it."""
    rng = np.random.default_rng([seed, number])
    # Judging seeds have robots and runs of their own.
    of = base(BASES * seed + int(rng.integers(BASES)))
    readings = {
        group: np.array(getattr(of.log, group))
        for group in (L, S, T, A)
        if getattr(of.log, group).size
    }
    file = YAML(typ="safe").load(cdprcal.to_yaml(of.robot))
    subject = Subject(readings, np.array(of.log.time_s), file, of.robot, of.pose, rng)
    drawn = rng.random()
    wanted = 0 if drawn < UNTOUCHED else 2 if drawn < UNTOUCHED + TWO else 1
    possible = [kind for kind, (needs, _) in KINDS.items() if set(needs) <= set(readings)]
    kinds = tuple(str(kind) for kind in rng.choice(possible, size=wanted, replace=False))
    said = "; ".join(KINDS[kind][1](subject) for kind in kinds)
    with tempfile.TemporaryDirectory() as folder:
        robot, log = Path(folder) / "robot.yaml", Path(folder) / "run.csv"
        text = io.StringIO()
        YAML().dump(subject.file, text)
        robot.write_text(text.getvalue(), encoding="utf-8")
        try:
            save_log(
                cdprcal.Log(time_s=subject.time_s, source="edited", **subject.readings), str(log)
            )
        except cdprcal.InputError as error:  # what no log can be is refused as it is read, too
            return Outcome(number, kinds, said, 2, reason=str(error))
        ran = CliRunner().invoke(app, ["calibrate", str(robot), str(log), "--json"])
    if not ran.stdout.strip():
        return Outcome(number, kinds, said, ran.exit_code, reason=ran.stderr)
    return _judged(
        Outcome(number, kinds, said, ran.exit_code), json.loads(ran.stdout), subject.pose
    )


def _judged(outcome: Outcome, document: dict[str, Any], truth: cdprcal.Pose) -> Outcome:
    reason = " | ".join([document["reason"], *(c["code"] for c in document.get("caveats", []))])
    error_m = in_sigma = sigma_m = float("nan")
    if document["initial_pose"] and document["covariance"]:
        given = document["initial_pose"]
        found = cdprcal.Pose(given["position_m"], given["rotation"])
        apart = np.asarray(cdprcal.minus(found, truth))
        covariance = np.array(document["covariance"])
        error_m = float(np.linalg.norm(apart[:3]))
        in_sigma = float(np.sqrt(apart @ np.linalg.solve(covariance, apart)))
        sigma_m = float(np.sqrt(np.trace(covariance[:3, :3])))
    return Outcome(
        outcome.number,
        outcome.kinds,
        outcome.said,
        outcome.code,
        error_m,
        in_sigma,
        sigma_m,
        reason,
    )


def _one(arguments: tuple[int, int]) -> Outcome:
    return run(*arguments)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--list", action="store_true", help="every wrong pose with exit code 0")
    chosen = parser.parse_args()
    work = [(number, chosen.seed) for number in range(chosen.runs)]
    with ProcessPoolExecutor(chosen.jobs) as pool:
        outcomes = list(pool.map(_one, work, chunksize=20))
    return report(outcomes, list_all=chosen.list)


def report(outcomes: Sequence[Outcome], *, list_all: bool) -> int:
    """Prints the counts; the exit code."""
    edited = [outcome for outcome in outcomes if outcome.kinds]
    untouched = [outcome for outcome in outcomes if not outcome.kinds]
    silent = [outcome for outcome in edited if outcome.code == 0]
    wrong = [outcome for outcome in silent if outcome.wrong]
    beyond = [outcome for outcome in wrong if outcome.in_sigma > MOST_SIGMA]
    far = [outcome for outcome in wrong if outcome.error_m > MOST_M]
    codes = Counter(outcome.code for outcome in edited)
    print(f"{len(edited)} edited: exit codes {dict(sorted(codes.items()))}")
    clean = Counter(outcome.code for outcome in untouched)
    print(f"{len(untouched)} untouched: exit codes {dict(sorted(clean.items()))}")
    bad = [outcome for outcome in untouched if outcome.code == 0 and outcome.wrong]
    print(f"untouched, exit 0 and wrong: {len(bad)}")
    share = len(beyond) / max(1, len(edited))
    print(
        f"exit 0 and beyond {MOST_SIGMA:g} sigma: {len(beyond)} ({100 * share:.2f} %, at most "
        f"{100 * MOST_SHARE:g} %); beyond {1e3 * MOST_M:g} mm: {len(far)} (none)"
    )
    by_kind: dict[str, list[Outcome]] = defaultdict(list)
    for outcome in wrong:
        by_kind[" + ".join(outcome.kinds)].append(outcome)
    for kind, found in sorted(by_kind.items(), key=lambda item: -len(item[1])):
        worst = max(found, key=lambda outcome: outcome.in_sigma)
        print(
            f"  {len(found):3d} {kind}: up to {worst.in_sigma:.1f} sigma, "
            f"{1e3 * max(o.error_m for o in found):.0f} mm"
        )
    if list_all:
        for outcome in [*wrong, *(o for o in untouched if o.code)]:
            print(
                f"{outcome.number}: exit {outcome.code}, {outcome.said}: "
                f"{outcome.in_sigma:.1f} sigma, {1e3 * outcome.error_m:.1f} mm "
                f"(sigma {1e3 * outcome.sigma_m:.1f} mm): {outcome.reason}"
            )
    return 0 if share <= MOST_SHARE and not far else 1


if __name__ == "__main__":
    sys.exit(main())
