"""A smooth function of the place that nobody wrote down, beside an effect: do the intervals hold?

    python tests/studies/discrepancy.py --count 24

A random function (six waves) of 6 mm, 2.3° or 8 N is added to every component of one channel, and
the centre of mass is off. Errors that stay the same over a rest are added to every channel.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from hidden_laws import REST_SIGMA, off, plan_of, with_rest_errors

import cdprcal

AMPLITUDE = {"length_m": 6e-3, "swivel_rad": 0.04, "tension_N": 8.0}
OFFSET_M = (0.02, -0.015, 0.03)


def try_one(job: tuple[int, int]) -> tuple[str, list[str], float, list[float]]:
    """Verdict, names, squared Mahalanobis distance of the initial pose, z of the offset."""
    poses, seed = job
    robot, plan = plan_of("irma4", poses)
    field = list(AMPLITUDE)[seed % len(AMPLITUDE)]
    rng = np.random.default_rng([seed, 77])
    hidden = "centre_of_mass=" + ",".join(map(str, OFFSET_M))
    run = cdprcal.simulate_startup(robot, plan, seed=seed, effects=[hidden])
    place_m = np.array([pose.position_m for pose in run.poses])
    read = {name: np.array(getattr(run.log, name)) for name in REST_SIGMA}
    for column in range(read[field].shape[1]):
        wave, phase = 2.0 * rng.standard_normal((6, 3)), rng.uniform(0, 6.3, 6)
        size = rng.standard_normal(6) * AMPLITUDE[field] / np.sqrt(3)
        read[field][:, column] += np.cos(place_m @ wave.T + phase) @ size
    log = with_rest_errors(run, read, rng, f"field-{seed}")
    found = cdprcal.diagnose(robot, [log])
    away = off(found.initial_pose_after, run.poses[0])
    squares = float(away @ np.linalg.solve(np.array(found.covariance_after), away))
    z = [
        value
        for effect in found.effects
        if effect.info.name == "centre_of_mass"
        for value in (np.array(effect.values) - OFFSET_M) / effect.standard_deviation
    ]
    return found.verdict.name, [e.info.name for e in found.effects], squares, z


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.count)
    jobs = [(poses, seed) for poses in (8, 27) for seed in seeds]
    poses_in: dict[str, list[bool]] = defaultdict(list)
    values_in: dict[str, list[bool]] = defaultdict(list)
    with ProcessPoolExecutor(options.workers) as pool:
        for (poses, seed), (verdict, names, squares, z) in zip(
            jobs, pool.map(try_one, jobs), strict=True
        ):
            print(f"{poses:3} {seed:4} {verdict:12} {squares:6.1f} {', '.join(names)}", flush=True)
            key = f"{verdict}, {poses} poses"
            poses_in[key].append(squares < 12.59)  # 95 % of χ² with six degrees of freedom
            values_in[key] += [abs(value) < 1.96 for value in z]
    for key, inside in poses_in.items():
        print(
            f"{key}: pose in 95 % in {sum(inside)} of {len(inside)}, "
            f"offset in {sum(values_in[key])} of {len(values_in[key])}"
        )


if __name__ == "__main__":
    main()
