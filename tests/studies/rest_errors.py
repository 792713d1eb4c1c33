"""Errors that stay over a rest, and over the ways to it and from it: does σ of the pose hold?

    python tests/studies/rest_errors.py --count 40
    python tests/studies/rest_errors.py --count 40 --worse 8 --diagnose

Synthetic runs of eight rests; every reading of a rest, and of the halves of the ways beside it, is
off by the same, in so many σ of the robot file. ``--worse 10``: one column of a sensor (``--of``)
is so many times worse than the others. ``--diagnose``: instead of σ, whether it says which that is,
and what it takes it for.
"""

from __future__ import annotations

import argparse

import numpy as np

import cdprcal
from cdprcal import _core

DWELL_S, MOVE_S = 4.0, 3.0


def run_of(
    robot: cdprcal.Robot, seed: int, size: float, worse: float, of: str
) -> tuple[cdprcal.Log, cdprcal.Pose, int]:
    """A log with errors over rests, the true initial pose, and the worse column."""
    rng = np.random.default_rng([seed, 5])
    options = cdprcal.SyntheticLogOptions(
        noise=cdprcal.reading_noise(robot.sigma, 0.02), seed=seed + 1, dwell_s=DWELL_S,
        move_s=MOVE_S,
    )  # fmt: skip
    made = cdprcal.synthetic_log(robot, cdprcal.default_setpoints(robot, 2, 2, 2), options)
    log, sigma = made.log, robot.sigma
    sigmas = {
        "length_m": sigma.length_m,
        "swivel_rad": sigma.swivel_rad,
        "tension_N": sigma.tension_N,
        "roll_pitch_yaw_rad": sigma.attitude_rad,
    }
    bad = 0
    rest = np.floor((log.time_s - log.time_s[0] + 0.5 * MOVE_S) / (DWELL_S + MOVE_S)).astype(int)
    read = {}
    for field, own in sigmas.items():
        values = np.array(getattr(log, field))
        each = np.full(values.shape[1], size * own)
        if field == of:
            bad = int(rng.integers(values.shape[1]))
            each[bad] *= worse
        read[field] = values + (rng.standard_normal((rest.max() + 1, values.shape[1])) * each)[rest]
    return cdprcal.Log(time_s=log.time_s, source=f"run {seed}", **read), made.poses[0], bad


def diagnosed(robot: cdprcal.Robot, size: float, options: argparse.Namespace) -> str:
    """How often the worse column is named, and what logs are taken for instead."""
    named = others = accused = refused = 0
    group, _, unit = options.of.partition("_")
    for seed in range(options.count):
        log, _, bad = run_of(robot, seed, size, options.worse, options.of)
        try:
            found = cdprcal.diagnose(robot, [log])
        except cdprcal.InputError:  # no pose to begin with
            refused += 1
            continue
        own = [errors.column for errors in found.own_errors]
        named += f"{group}_{bad + 1}_{unit}" in own
        others += any(column != f"{group}_{bad + 1}_{unit}" for column in own)
        accused += bool(found.effects or found.faults)
    return (
        f"the worse one named in {named} of {options.count}, another in {others}; "
        f"an effect, fault or formula in {accused}; refused {refused}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--worse", type=float, default=1.0)
    parser.add_argument(
        "--of", default="tension_N", choices=("length_m", "swivel_rad", "tension_N")
    )
    parser.add_argument("--diagnose", action="store_true")
    options = parser.parse_args()
    for name in ("posts8", "ring3", "irma4"):
        robot = cdprcal.load_robot(name)
        for size in (0.1, 1.0):
            if options.diagnose:
                told = diagnosed(robot, size, options)
                print(f"{name:8}{size:5g} sigma over rests: {told}", flush=True)
                continue
            off = []
            for seed in range(options.count):
                log, truth, _ = run_of(robot, seed, size, options.worse, options.of)
                result = _core.calibrate(robot, log).result
                converged = result.status == _core.CalibrationStatus.converged
                if converged and result.initial_pose is not None:
                    error = np.asarray(_core.minus(result.initial_pose, truth))
                    off.append(np.abs(error) / np.asarray(result.standard_deviation))
            z = np.array(off)
            print(
                f"{name:8}{size:5g} sigma over rests: {len(z)} of {options.count} poses, "
                f"{(z < 1.96).mean():.1%} of the coordinates within 95 %, "
                f"{(z.max(axis=1) > 4.0).sum()} beyond 4 sigma, at most {z.max():.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
