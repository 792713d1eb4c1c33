"""How soon ``acquire --diagnose`` ends a run, and whether what it then names is right.

    python tests/studies/settling.py --count 24

Each robot has one of two effects that are easily taken for each other, at one to two typical
sizes; with ``--two`` a second one of another pair besides. The run goes through a random order of
a 3 x 3 x 3 grid. Right: every hidden effect is named, or is among the rivals of what is named where
these cannot be told apart from inside, and nothing else. Robot time is compared with that of the
whole plan.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))

import numpy as np

import cdprcal
from cdprcal.acquisition import Guide, acquire, start_up_options, start_up_plan
from cdprcal.hardware.simulated import SimulatedBackend
from cdprcal.io import AcquisitionInputs, open_live_log
from robots import drawn_effect

PAIRS = (
    ("mass", "external_force"),
    ("pulley_friction", "bending_hysteresis"),
    ("ahrs_misalignment", "centre_of_mass"),
    ("load_cell_bias", "load_cell_gain"),
    ("transmission_ratio", "frame_anchors"),
    ("yaw_drift", "magnetic_disturbance"),
)


@cache
def plan() -> tuple[cdprcal.Robot, cdprcal.Plan]:
    robot = cdprcal.load_robot("irma4")
    order = cdprcal.VisitingOrder.random
    return robot, cdprcal.make_plan(robot, grid=(3, 3, 3), order=order, visits=1).plan


def try_one(two: bool, seed: int) -> tuple[str, str, str, bool, float]:
    """Effect, what was named, why the run ended, whether it is right, share of the plan's time."""
    robot, the_plan = plan()
    rng = np.random.default_rng(seed)
    name = PAIRS[seed % len(PAIRS)][rng.integers(2)]
    effects = [drawn_effect(rng, name, (1.0, 2.0))]
    if two:
        others = [n for pair in PAIRS if name not in pair for n in pair]
        effects.append(drawn_effect(rng, str(rng.choice(others)), (1.0, 2.0)))
    startup = cdprcal.StartUp(
        robot, start_up_plan(the_plan, quick=True), start_up_options(the_plan)
    )
    whole_s = float(startup.planned_duration_s)
    backend = SimulatedBackend.somewhere(
        robot,
        the_plan,
        cdprcal.SimulatorOptions(seed=seed, effects=effects),
        velocity_limit_m_s=startup.velocity_limit_m_s,
    )
    guide = Guide(robot, the_plan, startup, diagnoses=True, quick=True)

    def watch(command: cdprcal.StartUpCommand, sample: cdprcal.RobotSample, logged: bool) -> None:
        guide.step(command, sample, logged)

    with tempfile.TemporaryDirectory() as folder:
        inputs = AcquisitionInputs(cdprcal.to_yaml(robot), cdprcal.format_plan(the_plan), {})
        log = open_live_log(Path(folder) / "run.csv", 4, inputs, 10.0)
        run = acquire(startup, backend, log, watch=watch)
        guide.close()
    told = guide.estimates[-1].told if guide.estimates else None
    named = {n: set(rivals) for n, _, rivals in told.effects} if told else {}
    hidden = {effect.name for effect in effects}
    said = [{n, *rivals} for n, rivals in named.items()]
    right = all(any(name in one for one in said) for name in hidden)
    right = right and all(one & hidden for one in said)
    text = "; ".join(f"{n} ({', '.join(sorted(r))})" if r else n for n, r in named.items())
    return (
        " + ".join(sorted(hidden)),
        text or "nothing",
        guide.settled or run.reason,
        right,
        run.duration_s / whole_s,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--two", action="store_true", help="a second effect, of another pair")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    results = []
    with ProcessPoolExecutor(options.workers) as pool:
        seeds = range(options.first_seed, options.first_seed + options.count)
        for name, said, why, is_right, share in pool.map(partial(try_one, options.two), seeds):
            results.append((is_right, share))
            print(
                f"{name:40} {share:4.0%} {'right' if is_right else 'WRONG':6} {said}; {why}",
                flush=True,
            )
    right = sum(r for r, _ in results) / len(results)
    median = float(np.median([s for _, s in results]))
    print(f"{len(results)} robots: {right:.0%} right; median robot time {median:.0%} of the plan's")


if __name__ == "__main__":
    main()
