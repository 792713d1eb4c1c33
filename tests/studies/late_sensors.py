"""Tracks of simulated start-ups in which sensors come late.

``python tests/studies/late_sensors.py [--count 2]`` prints, for each robot, rate and delay, the
share of samples that are trusted, the largest error of a coordinate of their poses in its σ, that
of all poses, and what is said of a sensor.
"""

from __future__ import annotations

import argparse
import re

import numpy as np

import cdprcal

DELAYS_S: tuple[dict[str, float], ...] = (
    {},
    {"roll_pitch_rad": 0.03},
    {"roll_pitch_rad": 0.1},
    {"roll_pitch_rad": 0.25},
    {"length_m": 0.03},
    {"swivel_rad": 0.05},
    {"length_m": 0.05, "swivel_rad": 0.05},
)


def tracked(
    name: str, rate_Hz: float, delays_s: dict[str, float], seed: int
) -> tuple[float, float, float, str]:
    """Share that is trusted, largest error of those and of all [σ], and what is said."""
    robot = cdprcal.load_robot(name)
    options = cdprcal.SimulatorOptions(seed=seed)
    for sensor, delay_s in delays_s.items():
        getattr(options.sensors, sensor).delay_s = delay_s
    run = cdprcal.simulate_startup(
        robot,
        cdprcal.StartUpPlan(cdprcal.default_setpoints(robot, 2, 2, 2)),
        simulator=options,
        log_rate_Hz=rate_Hz,
    )
    track = cdprcal.track(robot, run.log)
    errors, said = [], ""
    for i, truth in enumerate(run.truth):
        sample = track[i]
        sigma = np.sqrt(np.diag(sample.pose_covariance))
        errors.append(float(np.abs(cdprcal.minus(truth.pose, sample.pose) / sigma).max()))
        found = re.search(r"the readings of the (.* than the others)", sample.reason)
        said = found[1] if found else said
    trusted = np.asarray(track.trusted)
    largest = np.max(np.array(errors)[trusted], initial=0.0)
    return float(trusted.mean()), float(largest), max(errors), said


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2, help="start-ups for each")
    count = parser.parse_args().count
    print("| robot | rate | late | trusted | largest error of those, of all [σ] | said |")
    print("|---|---|---|---|---|---|")
    for name in ("irma4", "ring3", "ring5"):
        for rate_Hz in (20.0, 100.0):
            for delays_s in DELAYS_S:
                runs = [tracked(name, rate_Hz, delays_s, seed) for seed in range(1, count + 1)]
                late = ", ".join(f"{key} {1e3 * delay:.0f} ms" for key, delay in delays_s.items())
                shares = ", ".join(f"{run[0]:.0%}" for run in runs)
                print(
                    f"| {name} | {rate_Hz:g} Hz | {late or 'none'} | {shares} | "
                    f"{max(run[1] for run in runs):.1f}, {max(run[2] for run in runs):.1f} | "
                    f"{'; '.join(run[3] for run in runs if run[3])} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
