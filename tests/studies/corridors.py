"""How far robots with hidden effects leave the corridor of their plan.

    python tests/studies/corridors.py --runs 200

Start-ups of irma4 in the simulator, with one to three effects of two typical sizes that nobody
knows of, through plans at random places, low and slack ones among them. From the first estimate on
the pose guard watches. Counted: what ended how, and how far the platform truly was beyond the
corridor's margin and three standard deviations of the estimate then. Exit code 1 when that is more
than 20 mm anywhere.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))

import numpy as np

import cdprcal
from cdprcal.studies import add_worker_options, stream, workers_of
from guarded import start_up
from robots import drawn_effects

MOST_M = 0.02
MARGIN_M = 0.1  #: what ``acquire`` has unless told otherwise


def drawn_plan(robot: cdprcal.Robot, random: np.random.Generator) -> cdprcal.Plan:
    """Four stops anywhere in the workspace that can be reached one from another."""
    while True:
        places = random.uniform([-0.5, -0.5, 0.15], [0.5, 0.5, 1.4], (4, 3))
        found = cdprcal.make_plan(robot, positions_m=list(places))
        if found.status == cdprcal.PlanStatus.planned:
            return found.plan


def try_one(first_seed: int, number: int) -> tuple[int, str, str, float, float]:
    """Number, what was hidden, how it ended, excess [m], worst sigmas of the estimate."""
    robot = cdprcal.load_robot("irma4")
    random = np.random.default_rng([first_seed, number])
    plan = drawn_plan(robot, random)
    hidden = drawn_effects(random, int(random.integers(1, 4)), (2.0, 2.0))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.csv"
        ended = start_up(robot, plan, path, hidden, MARGIN_M, seed=first_seed + number)
    names = " + ".join(effect.name for effect in hidden)
    how = str(ended.run.state).rpartition(".")[2]
    if ended.run.reason:
        how += f": {ended.run.reason}"
    return number, names, how, ended.excess_m, ended.worst_sigmas


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--first-seed", type=int, default=1)
    add_worker_options(parser)
    options = parser.parse_args()
    ends: Counter[str] = Counter()
    excess_m, sigmas = [], []
    runs = range(options.runs)
    for number, names, how, beyond_m, worst in stream(
        partial(try_one, options.first_seed), runs, workers_of(options)
    ):
        ends[how.partition(":")[0] + (": corridor" if "corridor" in how else "")] += 1
        excess_m.append(beyond_m)
        sigmas.append(worst)
        if beyond_m > MOST_M:
            print(f"{number}: {names}: {1e3 * beyond_m:.0f} mm beyond; {how}", flush=True)
    print(
        f"{dict(ends)}; beyond margin and 3 sigma by at most {1e3 * max(excess_m):.0f} mm; "
        f"estimate in motion off by {np.median(sigmas):.1f} sigma at worst in the median run, "
        f"{max(sigmas):.1f} in the worst"
    )
    return 1 if max(excess_m) > MOST_M else 0


if __name__ == "__main__":
    sys.exit(main())
