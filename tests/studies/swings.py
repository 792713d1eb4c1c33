"""What ``diagnose --motion`` names on MuJoCo's logs that never rest, and how fast these swing.

    python tests/studies/swings.py --count 6

Polygon robots of 5 and 4 cables are hauled round a circle while they swing, with nothing or one
effect hidden or their sensors' map wrong; those of 3 and 4 swing with locked winches, and some of
them are pushed by hand. Plant and noise are those of ``tests/python/mujoco_swing.py``. A log in
which a cable goes slack is left out and counted.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path

import mujoco
import numpy as np

import cdprcal
from cdprcal import _core
from cdprcal.studies import add_worker_options, spread, workers_of

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))
from mujoco_swing import MISREAD, Hidden, late, misread, swing
from robots import polygon_robot

#: When a hand pushes those that are pushed.
PUSHED_S = ((4.0, 7.0), (12.0, 15.0))
#: Rows by which the attitude comes late: 80 ms.
LATE_ROWS = 8
HIDDEN = (
    "none", "mass", "load_cell_bias", "centre_of_mass", "ahrs_misalignment", "sensor_delay",
    *MISREAD,
)  # fmt: skip


def hidden_of(name: str, cables: int) -> Hidden:
    if name == "mass":
        return Hidden(mass_kg=0.6)
    if name == "load_cell_bias":
        return Hidden(bias_N=np.array([5.0, -4.0, 0.0, 3.0, -5.0])[:cables])
    if name == "centre_of_mass":
        return Hidden(centre_of_mass_m=np.array([0.01, 0.008, 0.0]))
    if name == "ahrs_misalignment":
        return Hidden(misalignment_rad=np.array([0.02, -0.015, 0.0]))
    return Hidden()


def diagnosed(cables: int, name: str, seed: int) -> tuple[str, float, float] | None:
    """How it ended, error of the initial pose [mm], and the largest over its sigma."""
    robot = polygon_robot(cables, pulley_radius_m=0.0)
    try:
        run = swing(mujoco, robot, hidden_of(name, cables), seed=seed, duration_s=20.0, kick=0.15)
    except AssertionError:
        return None
    if name == "sensor_delay":
        run = late(run, LATE_ROWS)
    log = misread(run, name) if name in MISREAD else run.log
    found = cdprcal.diagnose(robot, log, motion=True)
    names = [effect.info.name for effect in found.effects]
    names += [fault.name for fault in found.faults]
    among = {rival for effect in found.effects for rival in effect.rivals}
    if not names:
        ended = "no name"
    elif names == [name]:
        ended = "named alone"
    elif name in names:
        ended = "named, with others"
    elif name in among:
        ended = "among rivals"
    else:
        ended = "accused" if name == "none" else "named wrongly"
    error = cdprcal.minus(found.initial_pose_after, run.poses[0])
    sigma = np.sqrt(np.diag(found.covariance_after))
    return ended, 1e3 * float(np.linalg.norm(error[:3])), float(np.max(np.abs(error) / sigma))


@dataclass
class Locked:
    """What a log with locked winches says: frequencies of its modes, measured over modelled; the
    times in which it is said to be pushed; error of the initial pose over its sigma."""

    ratios: list[float]
    pushed_s: list[tuple[float, float]]
    worst_sigmas: float


def locked(cables: int, pushed: bool, seed: int) -> Locked | None:
    robot = polygon_robot(cables, pulley_radius_m=0.0)
    hidden = Hidden(pushed_s=PUSHED_S) if pushed else None
    try:
        run = swing(mujoco, robot, hidden, seed=seed, duration_s=20.0, haul_m=0.0, kick=0.15)
    except AssertionError:
        return None
    found = _core.calibrate_in_motion(robot, run.log)
    ratios = [m.measured_hz / m.model_hz for m in found.swings if np.isfinite(m.measured_hz)]
    result = found.calibration.result
    error = np.abs(cdprcal.minus(result.poses[0], run.poses[0])) / result.standard_deviation
    pushes = [(push.begin_s, push.end_s) for push in found.pushes]
    return Locked(ratios, pushes, float(np.max(error)))


def met(found: list[tuple[float, float]], true: tuple[float, float]) -> bool:
    """Whether what was found covers half of a push."""
    begin, end = true
    covered = sum(max(0.0, min(end, e) - max(begin, b)) for b, e in found)
    return covered > 0.5 * (end - begin)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=6)
    parser.add_argument("--first-seed", type=int, default=801)
    add_worker_options(parser)
    parser.add_argument("--hidden", nargs="*", choices=HIDDEN, default=HIDDEN)
    parser.add_argument("--no-locked", action="store_true", help="only those that are hauled")
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.count)
    workers = workers_of(options)
    for cables, name in product((5, 4), options.hidden):
        results = spread(partial(diagnosed, cables, name), seeds, workers)
        rows = [row for row in results if row]
        ended = Counter(row[0] for row in rows)
        said = ", ".join(f"{count} {how}" for how, count in ended.most_common())
        print(f"{cables} cables, {name}: {said}; {len(results) - len(rows)} slack", flush=True)
        if rows:
            error_mm, worst = np.median([row[1:] for row in rows], axis=0)
            beyond = sum(row[2] > 4.0 for row in rows)
            print(f"  {error_mm:.2f} mm, {worst:.1f} sigma; beyond 4 sigma: {beyond}")
    for cables, pushed in () if options.no_locked else ((3, False), (4, False), (3, True)):
        runs = [run for run in spread(partial(locked, cables, pushed), seeds, workers) if run]
        sigmas = np.array([run.worst_sigmas for run in runs])
        logs = sum(bool(run.pushed_s) for run in runs)
        print(
            f"{cables} cables locked{', pushed' if pushed else ''}: pushes in {logs} of "
            f"{len(runs)} logs; pose {np.median(sigmas):.1f} sigma off in the median, "
            f"{sigmas.max():.1f} at worst"
        )
        if pushed:
            hits = [met(run.pushed_s, true) for run in runs for true in PUSHED_S]
            print(f"  found: {sum(hits)} of {len(hits)} pushes", flush=True)
            continue
        off = np.abs(np.array([ratio for run in runs for ratio in run.ratios]) - 1.0)
        print(
            f"  {len(off)} modes, median {100 * np.median(off):.2f} % off, at most "
            f"{100 * off.max():.2f} %",
            flush=True,
        )


if __name__ == "__main__":
    main()
