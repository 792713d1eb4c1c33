"""Our speed beside that of others, on the same data, in one run: one table.

    python tests/studies/peers.py                   # minutes
    python tests/studies/peers.py --sizes 8 27 128 --json peers.json

Calibrations of simulated 4-cable start-ups by SciPy (least_squares with our analytic Jacobian,
dense and sparse), CasADi (IPOPT, and Gauss-Newton with its own sparse factorisation, by CasADi's
virtual machine and compiled for this processor) and GTSAM (Levenberg-Marquardt over custom
factors), and equilibria by SciPy's fsolve. CasADi and GTSAM come with
pip install 'cdprcal[peers]'; who is not there is named.

Everybody starts from the same guess on one thread; whatever can be prepared once (CasADi's
expressions, GTSAM's graph) is not timed. Times are of the processor, since a busy machine would
spoil those of the clock: medians of rounds in which all take turns. 'callbacks' is the share of a
peer's time that it spends in our residuals and Jacobians, called through Python: what remains is
its own. Exit code 1 when anybody comes to another minimum than we do.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import peers_equilibria as equilibria
from peers_data import SETPOINTS_N, Case, Outcome, make_case, ours

import cdprcal

OURS = "cdprcal"
EXPLAINED = "cdprcal, explained"  # and says which readings see the initial pose
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
#: Poses up to which a solver is tried: beyond, one round takes minutes or gigabytes.
MOST_POSES = {
    "SciPy, dense": 128,
    "SciPy, sparse": 10000,
    "CasADi IPOPT": 1000,
    "CasADi, compiled": 128,
    "GTSAM": 1000,
}
PACKAGES = {"SciPy": "scipy", "CasADi": "casadi", "GTSAM": "gtsam"}
TARGETS = {"SciPy": 100.0, "the best other peer": 20.0}


@dataclass(frozen=True)
class Row:
    """One solver on one problem."""

    problem: str
    poses: int
    solver: str
    iterations: int
    time_s: float
    ratio: float
    callback_share: float = 0.0
    agrees: bool = True

    @property
    def us_a_pose_and_iteration(self) -> float:
        return 1e6 * self.time_s / (self.poses * max(1, self.iterations))


def prepared(solver: str, case: Case) -> Callable[[], Outcome]:
    """What is timed of a solver; raises ImportError when it is not installed."""
    if solver == OURS:
        return lambda: ours(case)
    if solver == EXPLAINED:
        return lambda: ours(case, cdprcal.SolveOptions(explain=True))
    if solver.startswith("SciPy"):
        import peers_scipy

        return peers_scipy.ScipyCalibration(case, sparse=solver.endswith("sparse")).solve
    if solver.startswith("CasADi"):
        import peers_casadi

        kinds: dict[str, Callable[[Case], Any]] = {
            "CasADi IPOPT": peers_casadi.Ipopt,
            "CasADi Gauss-Newton": peers_casadi.GaussNewton,
            "CasADi, compiled": peers_casadi.CompiledGaussNewton,
        }
        solve: Callable[[], Outcome] = kinds[solver](case).solve
        return solve
    import peers_gtsam

    return peers_gtsam.GtsamCalibration(case).solve


SOLVERS = (
    OURS,
    EXPLAINED,
    "SciPy, dense",
    "SciPy, sparse",
    "CasADi IPOPT",
    "CasADi Gauss-Newton",
    "CasADi, compiled",
    "GTSAM",
)


def missing(solver: str) -> str:
    """Why a solver cannot take part; empty when it can."""
    package = next((p for name, p in PACKAGES.items() if solver.startswith(name)), None)
    if package is None or find_spec(package) is not None:
        return ""
    return f"{solver} is not installed (pip install {package})"


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    begin = time.process_time()
    result = work()
    return time.process_time() - begin, result


def repeated(work: Callable[[], Any], least_s: float = 0.02) -> Callable[[], tuple[float, Any]]:
    """Time of one call, from as many calls as take `least_s` together."""
    once, _ = timed(work)  # warm
    once, _ = timed(work)
    count = max(1, int(least_s / max(once, 1e-6)))

    def measure() -> tuple[float, Any]:
        elapsed, result = timed(lambda: [work() for _ in range(count)][-1])
        return elapsed / count, result

    return measure


def take_turns(work: dict[str, Callable[[], Any]], rounds: int) -> dict[str, tuple[float, Any]]:
    """(median time, result) by name."""
    measures = {name: repeated(one) for name, one in work.items()}
    times: dict[str, list[float]] = {name: [] for name in work}
    results: dict[str, Any] = {}
    for _ in range(rounds):
        for name, measure in measures.items():
            elapsed, results[name] = measure()
            times[name].append(elapsed)
    return {name: (statistics.median(times[name]), results[name]) for name in work}


def agree(a: Outcome, b: Outcome) -> bool:
    """The same cost to 1e-6 of it and the same initial pose to 1 um, 1 urad."""
    apart = np.abs(cdprcal.minus(a.initial_pose, b.initial_pose)).max()
    return bool(abs(a.cost - b.cost) <= 1e-6 * b.cost and apart < 1e-6)


def calibrations(
    poses: int, tensions: bool, rounds: int, left_out: list[str], solvers: Sequence[str] = SOLVERS
) -> list[Row]:
    """One row a solver. What does not take part is added to `left_out`, with the reason."""
    case = make_case(poses, tensions)
    problem = f"{poses} poses, {'with' if tensions else 'without'} tensions"
    work = {}
    for solver in solvers:
        if reason := missing(solver):
            left_out.append(reason)
        elif poses > MOST_POSES.get(solver, poses):
            left_out.append(f"{solver}: only up to {MOST_POSES[solver]} poses")
        else:
            work[solver] = prepared(solver, case)
    found = take_turns(work, rounds)
    our_time, reference = found[OURS]
    return [
        Row(
            problem,
            poses,
            solver,
            outcome.iterations,
            time_s,
            time_s / our_time,
            outcome.callback_share,
            agree(outcome, reference),
        )
        for solver, (time_s, outcome) in found.items()
    ]


def all_equilibria(points: int, rounds: int, left_out: list[str]) -> list[Row]:
    if reason := missing("SciPy fsolve"):
        left_out.append(reason)
        return []
    robot = cdprcal.load_robot("irma4")
    by_hand = equilibria.NumpyRobot(robot)
    positions = equilibria.line(points)
    starts = equilibria.direct_starts(robot, SETPOINTS_N)
    rows = []
    inverse = take_turns(
        {
            OURS: lambda: equilibria.inverse_by_cdprcal(robot, positions),
            "SciPy fsolve": lambda: equilibria.inverse_by_fsolve(by_hand, positions),
        },
        rounds,
    )
    direct = take_turns(
        {
            OURS: lambda: equilibria.direct_by_cdprcal(robot, starts),
            "SciPy fsolve": lambda: equilibria.direct_by_fsolve(by_hand, starts),
        },
        rounds,
    )
    same_tensions = np.allclose(inverse[OURS][1], inverse["SciPy fsolve"][1], rtol=1e-6)
    same_poses = all(
        np.abs(cdprcal.minus(a, b)).max() < 1e-6
        for a, b in zip(direct[OURS][1], direct["SciPy fsolve"][1], strict=True)
    )
    for name, found, count, same in (
        ("inverse problem", inverse, points, same_tensions),
        ("direct problem", direct, len(starts), same_poses),
    ):
        rows += [
            Row(f"{name}, {count} points", count, s, 1, t, t / found[OURS][0], 0.0, bool(same))
            for s, (t, _) in found.items()
        ]
    return rows


def show(rows: Sequence[Row]) -> None:
    print("| problem | solver | iterations | ms | µs per pose and iteration | × ours | callbacks |")
    print("|---|---|---|---|---|---|---|")
    problem = ""
    for row in rows:
        first = "" if row.problem == problem else row.problem
        problem = row.problem
        is_equilibrium = "problem" in row.problem
        print(
            f"| {first} | {row.solver} | {'' if is_equilibrium else row.iterations} "
            f"| {1e3 * row.time_s:.3f} | {row.us_a_pose_and_iteration:.3g} "
            f"| {'' if row.solver == OURS else f'{row.ratio:.3g}'} "
            f"| {f'{100 * row.callback_share:.0f} %' if row.callback_share > 0 else ''} |"
            + ("" if row.agrees else " ANOTHER MINIMUM")
        )


def show_targets(rows: Sequence[Row]) -> None:
    """The least ratio of each problem against the targets, peers at their best."""
    for problem in dict.fromkeys(row.problem for row in rows):
        theirs = [
            r
            for r in rows
            if r.problem == problem and r.solver not in (OURS, EXPLAINED) and r.agrees
        ]
        for name, wanted in TARGETS.items():
            of_scipy = name == "SciPy"
            ratios = [r for r in theirs if r.solver.startswith("SciPy") == of_scipy]
            if not ratios:
                continue
            best = min(ratios, key=lambda r: r.ratio)
            verdict = "reached" if best.ratio >= wanted else "not reached"
            print(
                f"{problem}: {best.solver} takes {best.ratio:.3g} times as long as we do; "
                f"target {wanted:g}: {verdict}"
            )


def versions() -> dict[str, str]:
    out = {}
    for package in ("cdprcal", "numpy", *PACKAGES.values()):
        try:
            out[package] = version(package)
        except PackageNotFoundError:
            out[package] = "not installed"
    return out


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", type=int, nargs="+", default=[8, 27, 128, 1000, 10000])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--points", type=int, default=200, help="of the inverse problem")
    parser.add_argument("--json", type=Path, help="also write the rows to this file")
    given = parser.parse_args()
    if any(os.environ.get(name) != value for name, value in ONE_THREAD.items()):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **ONE_THREAD})
    left_out: list[str] = []
    rows: list[Row] = []
    for poses in given.sizes:
        for tensions in (False, True):
            print(f"{poses} poses, tensions: {tensions} …", file=sys.stderr)
            rows += calibrations(poses, tensions, given.rounds, left_out)
    rows += all_equilibria(given.points, given.rounds, left_out)
    show(rows)
    print()
    show_targets(rows)
    print()
    for reason in dict.fromkeys(left_out):
        print(f"left out: {reason}")
    print(", ".join(f"{name} {number}" for name, number in versions().items()))
    if given.json:
        held = {"versions": versions(), "left_out": left_out, "rows": [asdict(r) for r in rows]}
        given.json.write_text(json.dumps(held, indent=1) + "\n")
    return 0 if all(row.agrees for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
