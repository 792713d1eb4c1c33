"""Every subset of the seven sensors, on robots of two to eight cables: what the default solves.

    python tests/studies/sensor_subsets.py --seeds 1      # 889 logs
    python tests/studies/sensor_subsets.py --seeds 5 --first-seed 101

A log is a list of rests of a robot drawn at random, with the readings of one subset. It is
calibrated by the default method and by the two single ones. Counted: logs that a single method
solves and the default does not, logs that the default solves worse (a pose twice as uncertain),
and logs on which a pose without a caveat is beyond what its covariance allows. Exit code 1 when
there is one of the first or third kind.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import chain, combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

import cdprcal
from cdprcal import Log, Pose, Robot
from cdprcal.trust import caveats_of

Floats = NDArray[np.float64]
SENSORS = (
    "length",
    "swivel",
    "tension",
    "roll_pitch_yaw",
    "absolute_yaw",
    "direct_length",
    "position",
)
SIGMA = cdprcal.SensorSigma(
    length_m=1e-3,
    swivel_rad=3e-3,
    attitude_rad=5e-3,
    tension_N=0.5,
    absolute_yaw_rad=1e-2,
    direct_length_m=1e-3,
    position_m=1e-3,
)
RESTS = 12
#: How often chance may be beyond it: noise known from so few readings has long tails (F).
CHANCE = 1e-5


def subsets() -> list[tuple[str, ...]]:
    """All 127, the smallest first."""
    sizes = (combinations(SENSORS, size) for size in range(1, len(SENSORS) + 1))
    return list(chain.from_iterable(sizes))


def drawn_robot(random: np.random.Generator, cables: int) -> Robot:
    """Pulleys around a hall of about 2 m, their swivel axes upright; no two numbers alike."""
    made = []
    for k in range(cables):
        angle = 2.0 * np.pi * (k + random.uniform(-0.25, 0.25)) / cables
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        place = random.uniform(0.9, 1.2) * out + [0.0, 0.0, random.uniform(1.6, 2.0)]
        anchor = random.uniform(0.08, 0.16) * out + [0.0, 0.0, random.uniform(-0.05, 0.2)]
        pulley = cdprcal.Pulley(
            radius_m=random.uniform(0.01, 0.04),
            position_m=place,
            x_axis=-out,
            swivel_axis=[0.0, 0.0, -1.0],
        )
        made.append(cdprcal.Cable(pulley=pulley, platform_anchor_m=anchor))
    platform = cdprcal.Platform(
        mass_kg=random.uniform(5.0, 15.0),
        centre_of_mass_m=random.uniform([-0.02, -0.02, -0.1], [0.02, 0.02, -0.02]),
        inertia_kg_m2=np.diag([0.1, 0.12, 0.15]),
    )
    return Robot(
        name=f"drawn{cables}",
        platform=platform,
        cables=made,
        tension_limits_N=[1.0, 1000.0],
        sigma=SIGMA,
    )


def rests(random: np.random.Generator, robot: Robot) -> list[tuple[Pose, Floats]]:
    """Equilibria that spread over the hall, and the tensions that hold them."""
    n = robot.cable_count
    weight_N = robot.platform.mass_kg * robot.gravity_m_s2
    found: list[tuple[Pose, Floats]] = []
    for _ in range(1000):
        share = 2.5 / n * random.uniform(0.35, 1.1)
        tension_N = weight_N * share * random.uniform(0.75, 1.3, size=n)
        at = cdprcal.direct_from_tensions(robot, tension_N)
        if at.status == cdprcal.EquilibriumStatus.found and at.pose is not None:
            found.append((at.pose, tension_N))
        if len(found) == RESTS:
            return found
    raise AssertionError(f"{robot.name}: no rests")


def read(random: np.random.Generator, robot: Robot, subset: tuple[str, ...]) -> tuple[Log, Pose]:
    """A log of rests and the true initial pose."""
    n = robot.cable_count
    held = rests(random, robot)
    states = [cdprcal.platform_state(robot, pose) for pose, _ in held]
    angles = np.array(
        [cdprcal.euler_from_rotation(s.rotation, robot.euler_convention) for s in states]
    )
    lengths = np.array([s.length_m for s in states])

    def noisy(values: Floats, sigma: float) -> Floats:
        return values + sigma * random.normal(size=values.shape)

    groups: dict[str, Any] = {
        "length_m": noisy(lengths, SIGMA.length_m) + random.uniform(-1.0, 1.0, size=n),
        "swivel_rad": noisy(np.array([s.swivel_rad for s in states]), SIGMA.swivel_rad)
        + random.uniform(-1.0, 1.0, size=n),
        "tension_N": noisy(np.array([t for _, t in held]), SIGMA.tension_N),
        "roll_pitch_yaw_rad": noisy(angles, SIGMA.attitude_rad)
        + np.array([0.0, 0.0, random.uniform(-1.0, 1.0)]),
        "absolute_yaw_rad": noisy(angles[:, 2:], SIGMA.absolute_yaw_rad),
        "direct_length_m": noisy(lengths, SIGMA.direct_length_m),
        "position_m": noisy(np.array([p.position_m for p, _ in held]), SIGMA.position_m),
    }
    chosen = {k: v for k, v in groups.items() if k.rsplit("_", 1)[0] in subset}
    return Log(time_s=10.0 * np.arange(len(held)), **chosen), held[0][0]


@dataclass
class Outcome:
    """What the methods made of one log: deviations of the pose [m], or None where refused."""

    cables: int
    subset: tuple[str, ...]
    seed: int
    sigma_m: dict[str, float | None]
    squares: dict[str, float]  #: error² over what chance allows, of those that claim a pose
    reasons: dict[str, str]

    @property
    def singles(self) -> list[float]:
        """Of the single methods that solved it."""
        return [s for m in ("static", "kinematic") if (s := self.sigma_m[m]) is not None]

    @property
    def is_missed(self) -> bool:
        """Solved by a single method only."""
        return self.sigma_m["unified"] is None and bool(self.singles)

    @property
    def is_worse(self) -> bool:
        """The default knows the pose half as well as a single method."""
        own = self.sigma_m["unified"]
        return own is not None and bool(self.singles) and own > 2.0 * min(self.singles)

    @property
    def wrong(self) -> list[str]:
        """The methods whose pose is beyond its covariance."""
        return [m for m, squares in self.squares.items() if squares > 1.0]

    def in_words(self) -> str:
        """What is remarkable about it; empty: nothing."""
        what = [*(["missed"] if self.is_missed else []), *(["worse"] if self.is_worse else [])]
        what += [f"{method} wrong" for method in self.wrong]
        if not what:
            return ""
        log = f"{self.cables} cables, seed {self.seed}, {'+'.join(self.subset)}: {', '.join(what)}"
        return f"{log}\n    {self.sigma_m} {self.squares}\n    {self.reasons['unified']}"


def outcome(job: tuple[int, tuple[str, ...], int]) -> Outcome:
    """One log, by all methods."""
    cables, subset, seed = job
    random = np.random.default_rng([seed, cables, SENSORS.index(subset[0]), len(subset)])
    robot = drawn_robot(random, cables)
    log, truth = read(random, robot, subset)
    out = Outcome(cables, subset, seed, {}, {}, {})
    for method in ("unified", "static", "kinematic"):
        out.sigma_m[method] = None
        try:
            calibration = cdprcal.calibrate(robot, log, method=method)
        except cdprcal.InputError as error:
            out.reasons[method] = str(error)
            continue
        result = calibration.result
        out.reasons[method] = result.reason
        if result.status != cdprcal.CalibrationStatus.converged:
            continue
        covariance = result.covariance
        assert covariance is not None
        out.sigma_m[method] = float(np.sqrt(np.trace(covariance[:3, :3])))
        if caveats_of(calibration):
            continue  # exit code 3: said, not silent
        off = cdprcal.minus(result.poses[0], truth)
        freedom = max(1, result.residual_count - result.parameter_count)
        allowed = 6.0 * float(stats.f.ppf(1.0 - CHANCE, 6, freedom))
        out.squares[method] = float(off @ np.linalg.solve(covariance, off)) / allowed
    return out


def jobs(cables: range, seeds: range) -> Iterator[tuple[int, tuple[str, ...], int]]:
    """All of them."""
    for seed in seeds:
        for n in cables:
            for subset in subsets():
                yield n, subset, seed


def main() -> int:
    """Prints the table; 1 where something is missed or wrong."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=None)
    asked = parser.parse_args()
    seeds = range(asked.first_seed, asked.first_seed + asked.seeds)
    counts: dict[int, Counter[str]] = defaultdict(Counter)
    with ProcessPoolExecutor(asked.workers) as pool:
        for found in pool.map(outcome, jobs(range(2, 9), seeds), chunksize=8):
            count = counts[found.cables]
            count["logs"] += 1
            count["solved"] += found.sigma_m["unified"] is not None
            count["missed"] += found.is_missed
            count["worse"] += found.is_worse
            count["wrong"] += bool(found.wrong)
            if words := found.in_words():
                print(words)
    print(f"{'cables':>6} {'logs':>6} {'solved':>6} {'missed':>6} {'worse':>6} {'wrong':>6}")
    for cables, count in sorted(counts.items()):
        names = ("logs", "solved", "missed", "worse", "wrong")
        print(f"{cables:>6} " + " ".join(f"{count[name]:>6}" for name in names))
    return int(any(count["missed"] or count["wrong"] for count in counts.values()))


if __name__ == "__main__":
    sys.exit(main())
