"""How much robot time a start-up takes that waits for no rest.

    python tests/studies/passing.py --count 20

27 set-points of built-in robots, once with a rest at each and once passed without waiting, with
the noise of eq. 18 and a fifth of it on every reading at 100 Hz. The initial pose from all rests,
and by the balance in motion from the first 15 s and from a quarter of the time that the rests took.
"""

from __future__ import annotations

import argparse
from functools import partial
from itertools import product

import numpy as np
from motion import cut, scored
from stopping import sensors

import cdprcal
from cdprcal import _core
from cdprcal.studies import add_worker_options, spread, workers_of

ROBOTS, NOISE = ("irma4", "ring3", "ring5"), (1.0, 0.2)
SHORT_S = 15.0
WAYS = ("all rests", "15 s of motion", "a quarter of the time")


def try_one(name: str, noise: float, seed: int) -> list[tuple[float, ...]]:
    """Of each way: seconds of robot time, error [mm], [deg], and the largest over its sigma."""
    robot = cdprcal.load_robot(name)
    plan = cdprcal.StartUpPlan(_core.default_setpoints(robot, 3, 3, 3))

    def run(*, wait_for_rest: bool) -> cdprcal.StartUpRun:
        return cdprcal.simulate_startup(
            robot,
            plan,
            seed=seed,
            simulator=cdprcal.SimulatorOptions(sensors=sensors(robot.sigma, noise)),
            startup=cdprcal.StartUpOptions(wait_for_rest=wait_for_rest),
            log_rate_Hz=100.0,
        )

    rests, passed = run(wait_for_rest=True), run(wait_for_rest=False)
    whole_s = float(rests.log.time_s[-1])
    of_rests = scored(_core.calibrate(robot, rests.log), rests.truth[0].pose)
    out: list[tuple[float, ...]] = [(whole_s, *of_rests)]
    for until_s in (SHORT_S, whole_s / 4):
        found = _core.calibrate_in_motion(robot, cut(passed.log, until_s)).calibration
        out.append((until_s, *scored(found, passed.truth[0].pose)))
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=901)
    add_worker_options(parser)
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.count)
    for name, noise in product(ROBOTS, NOISE):
        rows = np.array(spread(partial(try_one, name, noise), seeds, workers_of(options)))
        print(f"{name}, noise {noise:g} of eq. 18", flush=True)
        for way, found in zip(WAYS, rows.swapaxes(0, 1), strict=True):
            known = found[np.isfinite(found[:, 1])]
            seconds, mm, deg, _ = np.median(known, axis=0)
            print(
                f"  {way:21}: {seconds:5.0f} s, {mm:5.2f} mm {deg:.3f} deg (medians), "
                f"rms {np.sqrt(np.mean(known[:, 1] ** 2)):.2f} mm, "
                f"worst {known[:, 1].max():.2f} mm, {known[:, 3].max():.1f} sigma; "
                f"{len(known)} of {len(found)}"
            )


if __name__ == "__main__":
    main()
