"""How well ``track`` knows the platform, and what ``calibrate --motion`` adds to short runs.

    python tests/studies/motion.py --count 10

Start-ups of built-in robots with the simulated sensors (x1) and with twelve times their noise
(about eq. 18), some with a hidden effect, some with an inertial unit (+unit). Tracked: share of
samples within 1.96 sigma, errors of pose and twist, time a sample. Calibrated from the first
seconds: by the rests alone, and with the balance in motion; the whole run beside it.
"""

from __future__ import annotations

import argparse
import time
from functools import partial

import numpy as np

import cdprcal
from cdprcal import _core
from cdprcal.sensors import LOG_GROUPS
from cdprcal.studies import add_worker_options, spread, workers_of

#: Robot (+unit: with an inertial one), rate of the log [Hz], noise over the simulated sensors',
#: hidden effects.
Case = tuple[str, float, float, tuple[str, ...]]
CASES: tuple[Case, ...] = (
    ("irma4", 100.0, 1.0, ()),
    ("irma4", 10.0, 1.0, ()),
    ("ring3", 100.0, 1.0, ()),
    ("ring5", 100.0, 1.0, ()),
    ("irma4", 100.0, 12.0, ()),
    ("irma4", 10.0, 12.0, ()),
    ("ring3", 100.0, 12.0, ()),
    ("ring5", 100.0, 12.0, ()),
    ("irma4+unit", 100.0, 1.0, ()),
    ("irma4+unit", 10.0, 1.0, ()),
    ("ring5+unit", 100.0, 1.0, ()),
    ("irma4+unit", 100.0, 12.0, ()),
    ("irma4", 100.0, 12.0, ("mass=0.7",)),
    ("irma4", 100.0, 1.0, ("load_cell_bias=5",)),
)
SHORT_S = 15.0


def robot_of(case: Case) -> cdprcal.Robot:
    name, _, unit = case[0].partition("+")
    place = "platform:\n  inertial_unit_m: [0.08, -0.05, 0.04]\n" if unit else "platform:\n"
    text = cdprcal.builtin_robot_yaml(name).replace("platform:\n", place, 1)
    return cdprcal.parse_robot(text, name)


def run_of(robot: cdprcal.Robot, case: Case, seed: int) -> cdprcal.StartUpRun:
    _, rate_Hz, noise, effects = case
    options = cdprcal.SimulatorOptions()
    sensors = options.sensors
    for name in ("length_m", "swivel_rad", "tension_N", "roll_pitch_rad", "yaw_rad"):
        getattr(sensors, name).noise *= noise
    options.sensors = sensors
    plan = cdprcal.StartUpPlan(_core.default_setpoints(robot, 3, 3, 3))
    return cdprcal.simulate_startup(
        robot, plan, effects=list(effects), seed=seed, simulator=options, log_rate_Hz=rate_Hz
    )


def cut(log: cdprcal.Log, until_s: float) -> cdprcal.Log:
    rows = log.time_s <= log.time_s[0] + until_s
    read = {field: values for field in LOG_GROUPS if (values := getattr(log, field)).shape[1]}
    return cdprcal.Log(
        time_s=log.time_s[rows], **{field: values[rows] for field, values in read.items()}
    )


def scored(calibration: cdprcal.Calibration, truth: cdprcal.Pose) -> tuple[float, float, float]:
    """Error [mm], [deg], and the largest over its sigma; NaN without a pose."""
    if calibration.result.status != cdprcal.CalibrationStatus.converged:
        return np.nan, np.nan, np.nan
    error = cdprcal.minus(calibration.result.poses[0], truth)
    worst = np.max(np.abs(error) / calibration.result.standard_deviation)
    shift, turn = np.linalg.norm(error[:3]), np.linalg.norm(error[3:])
    return float(1e3 * shift), float(np.degrees(turn)), float(worst)


def try_one(case: Case, seed: int) -> dict[str, list[tuple[float, ...]]]:
    robot = robot_of(case)
    run = run_of(robot, case, seed)
    truths = [truth.pose for truth in run.truth]
    truth = truths[0]
    whole = _core.calibrate(robot, run.log)
    out: dict[str, list[tuple[float, ...]]] = {"whole run": [scored(whole, truth)]}
    short = cut(run.log, SHORT_S)
    out["rests"] = [scored(_core.calibrate(robot, short), truth)]
    found = _core.calibrate_in_motion(robot, short)
    out["motion"] = [scored(found.calibration, truth)]
    out["damping"] = [(found.damping_shift_1_s,)]
    if whole.result.status == cdprcal.CalibrationStatus.converged:
        began_s = time.perf_counter()
        track = _core.track(whole, run.log)
        seconds = (time.perf_counter() - began_s) / len(track)
        sigma = np.sqrt(np.diagonal(track.pose_covariance, axis1=1, axis2=2))
        error = np.array([cdprcal.minus(track[i].pose, truths[i]) for i in range(len(track))])
        trusted = track.trusted
        covered = np.abs(error[trusted]) < 1.96 * sigma[trusted]
        mm = 1e3 * np.sqrt(np.mean(np.sum(error[trusted, :3] ** 2, axis=1)))
        deg = np.degrees(np.sqrt(np.mean(np.sum(error[trusted, 3:] ** 2, axis=1))))
        twist = np.array([truth.twist for truth in run.truth])
        later = trusted & (run.log.time_s > run.log.time_s[0] + 1.0)  # a twist takes a moment
        off = (track.twist - twist)[later]
        mm_s = 1e3 * np.sqrt(np.mean(np.sum(off[:, :3] ** 2, axis=1)))
        deg_s = np.degrees(np.sqrt(np.mean(np.sum(off[:, 3:] ** 2, axis=1))))
        wild = np.mean(np.max(np.abs(error[trusted]) / sigma[trusted], axis=1) > 6.0)
        out["tracked"] = [
            (
                *(100 * covered.mean(), mm, deg, mm_s, deg_s),
                *(100 * trusted.mean(), 100 * wild, 1e6 * seconds),
            )
        ]
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=701)
    add_worker_options(parser)
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.count)
    print("tracked: covered, rms, trusted, beyond 6 sigma, median time a sample")
    print(f"calibrated from {SHORT_S:.0f} s: rms of rests, with motion; of the whole run")
    for case in CASES:
        results = spread(partial(try_one, case), seeds, workers_of(options))
        columns = {
            key: np.array([row for result in results for row in result.get(key, [])])
            for key in ("tracked", "rests", "motion", "whole run", "damping")
        }
        name, rate_Hz, noise, effects = case
        print(f"{name} {rate_Hz:g} Hz, noise x{noise:g} {' '.join(effects)}")
        mean = columns["tracked"].mean(axis=0)
        micros = np.median(columns["tracked"][:, -1])
        print(
            f"  tracked: {mean[0]:.1f} %, {mean[1]:.2f} mm {mean[2]:.3f} deg, "
            f"{mean[3]:.1f} mm/s {mean[4]:.3f} deg/s, "
            f"{mean[5]:.2f} % trusted, {mean[6]:.3f} % beyond, {micros:.1f} us"
        )
        for key in ("rests", "motion", "whole run"):
            found = columns[key][np.isfinite(columns[key][:, 0])]
            rms = np.sqrt(np.mean(found**2, axis=0))
            print(
                f"  {key:9}: {rms[0]:6.2f} mm {rms[1]:.3f} deg, {len(found)} of {len(results)} "
                f"converged, worst {found[:, 2].max():.1f} sigma"
            )
        print(f"  damping of shifts (true 1.0 1/s): {np.median(columns['damping']):.2f}")


if __name__ == "__main__":
    main()
