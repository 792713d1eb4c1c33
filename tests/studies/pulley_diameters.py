"""Robot files with pulleys of another size, diameters for radii say: named or not, and the pose.

    python tests/studies/pulley_diameters.py --count 8

Built-in robots are started up in the simulator with pulleys of another size than their file says,
or of the right one, in plans of random order.
"""

from __future__ import annotations

import argparse
from functools import partial
from itertools import product

import numpy as np

import cdprcal
from cdprcal.studies import add_worker_options, spread, workers_of

ROBOTS, FACTORS = ("irma4", "ring3", "ring5"), (1.0, 0.5, 0.7, 1.35, 2.0)
EFFECT = "pulley_diameter"


def try_one(name: str, factor: float, seed: int) -> tuple[str, list[tuple[float, float]]]:
    """What was named; error of the initial pose [mm] and the largest over sigma: calibrate's, then
    diagnose's."""
    robot = cdprcal.load_robot(name)
    plan = cdprcal.make_plan(robot, order=cdprcal.VisitingOrder.random, seed=seed).plan
    error_m = (factor - 1.0) * robot.cables[0].pulley.radius_m
    effects = [f"{EFFECT}={error_m}"] if factor != 1.0 else []
    run = cdprcal.simulate_startup(robot, plan, effects=effects, seed=seed)
    result = cdprcal.calibrate(robot, run.log).result
    found = cdprcal.diagnose(robot, run.log)
    poses = [
        (result.poses[0], result.standard_deviation),
        (found.initial_pose_after, np.sqrt(np.diag(found.covariance_after))),
    ]
    scores = []
    for pose, sigma in poses:
        error = cdprcal.minus(pose, run.truth[0].pose)
        worst = float(np.max(np.abs(error) / sigma))
        scores.append((1e3 * float(np.linalg.norm(error[:3])), worst))
    names = [fault.name for fault in found.faults] + [e.info.name for e in found.effects]
    return ", ".join(names) or "nothing", scores


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=8)
    parser.add_argument("--first-seed", type=int, default=701)
    add_worker_options(parser)
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.count)
    for name, factor in product(ROBOTS, FACTORS):
        rows = spread(partial(try_one, name, factor), seeds, workers_of(options))
        right = "nothing" if factor == 1.0 else EFFECT
        others = sorted({row[0] for row in rows} - {right})
        named = sum(row[0] == right for row in rows)
        scores = np.array([row[1] for row in rows])
        middle, worst = np.median(scores, axis=0), scores.max(axis=0)
        otherwise = f"; otherwise {' | '.join(others)}" if others else ""
        print(f"{name}, radii x{factor:g}: {right} in {named} of {len(rows)}{otherwise}")
        for who, (mm, _), (_, sigmas) in zip(("calibrate", "diagnose"), middle, worst, strict=True):
            print(f"  {who}: {mm:.2f} mm in the median, worst {sigmas:.1f} sigma", flush=True)


if __name__ == "__main__":
    main()
