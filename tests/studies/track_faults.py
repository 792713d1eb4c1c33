"""Tracks of simulated start-ups in which a reading goes wrong on the way.

``python tests/studies/track_faults.py [--count 5]`` prints, for each fault, the share of samples
that are trusted, in how many runs a pose beyond 4 σ was trusted for more than 0.3 s, and the
largest error of a coordinate of a pose that was, in its σ.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

import cdprcal
from cdprcal import _core

Groups = dict[str, NDArray[np.float64]]
Fault = Callable[[Groups, slice, int], None]


def slip(shift_m: float) -> Fault:
    """A cable slips; where the fault begins is where it does."""

    def act(groups: Groups, rows: slice, cable: int) -> None:
        groups["length_m"][rows.start :, cable] += shift_m

    return act


def stuck(group: str) -> Fault:
    """A sensor says for a second what it said last; of cables one of them."""

    def act(groups: Groups, rows: slice, cable: int) -> None:
        columns = slice(None) if group == "roll_pitch_yaw_rad" else cable
        groups[group][rows, columns] = groups[group][rows.start, columns]

    return act


def jump(group: str, column: int, angle_deg: float) -> Fault:
    """An angle counts from elsewhere from here on."""

    def act(groups: Groups, rows: slice, _cable: int) -> None:
        groups[group][rows.start :, column] += np.radians(angle_deg)

    return act


def nothing(_groups: Groups, _rows: slice, _cable: int) -> None:
    """As it was."""


FAULTS: dict[str, Fault] = {
    "none": nothing,
    "a cable slips by 4 mm": slip(4e-3),
    "a cable slips by 8 mm": slip(8e-3),
    "a cable slips by 20 mm": slip(20e-3),
    "a length sticks for 1 s": stuck("length_m"),
    "a swivel sticks for 1 s": stuck("swivel_rad"),
    "the attitude sticks for 1 s": stuck("roll_pitch_yaw_rad"),
    "yaw jumps by 6°": jump("roll_pitch_yaw_rad", 2, 6.0),
    "a swivel jumps by 5°": jump("swivel_rad", 0, 5.0),
}


def tracked(name: str, rate_Hz: float, seed: int) -> dict[str, tuple[float, float, float]]:
    """Of each fault: share that is trusted, seconds beyond 4 σ that were, largest of them [σ]."""
    robot = cdprcal.load_robot(name)
    run = cdprcal.simulate_startup(
        robot,
        cdprcal.StartUpPlan(cdprcal.default_setpoints(robot, 2, 2, 1)),
        simulator=cdprcal.SimulatorOptions(seed=seed),
        log_rate_Hz=rate_Hz,
    )
    start = cdprcal.calibrate(robot, run.log)
    random = np.random.default_rng(seed)
    begin = int(random.uniform(0.3, 0.6) * len(run.log))
    rows, cable = slice(begin, begin + round(rate_Hz)), int(random.integers(robot.cable_count))
    out = {}
    for words, fault in FAULTS.items():
        groups = {
            group: np.array(getattr(run.log, group))
            for group in ("time_s", "length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
        }
        fault(groups, rows, cable)
        track = _core.track(start, cdprcal.Log(**groups, source=words), -1)
        errors = [
            np.abs(
                cdprcal.minus(truth.pose, track[i].pose)
                / np.sqrt(np.diag(track[i].pose_covariance))
            ).max()
            for i, truth in enumerate(run.truth)
        ]
        trusted = np.array([track[i].trusted for i in range(len(track))])
        wrong = np.where(trusted, errors, 0.0)
        out[words] = (float(trusted.mean()), float((wrong > 4.0).sum()) / rate_Hz, wrong.max())
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=5, help="start-ups of each robot and rate")
    count = parser.parse_args().count
    runs = [
        tracked(name, rate_Hz, seed)
        for name in ("irma4", "ring3", "ring5")
        for rate_Hz in (50.0, 100.0)
        for seed in range(1, count + 1)
    ]
    print("| fault | trusted | beyond 4 σ for more than 0.3 s | largest [σ] |")
    print("|---|---:|---:|---:|")
    for words in FAULTS:
        trusted, wrong_s, largest = zip(*(run[words] for run in runs), strict=True)
        long = sum(s > 0.3 for s in wrong_s)
        print(f"| {words} | {np.mean(trusted):.1%} | {long} of {len(runs)} | {max(largest):.1f} |")


if __name__ == "__main__":
    main()
