"""Start-ups whose readings came through low-passes that no estimator was told of.

``python tests/studies/low_passes.py [--count 3]`` prints, for each filter and the channels behind
it, how many rests of eight are found, the largest stated σ of the position and the largest error of
a coordinate of the initial pose in its σ.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy import signal

import cdprcal

RATE_HZ = 100.0
BEHIND = {
    "attitude": ("roll_pitch_yaw_rad",),
    "tensions": ("tension_N",),
    "all": ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"),
}


def filters() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Numerators and denominators by name."""
    out = {}
    for cut_off_Hz in (20.0, 5.0, 2.0):
        for order in (1, 2, 4):
            name = f"Butterworth of order {order}, {cut_off_Hz:g} Hz"
            out[name] = signal.butter(order, cut_off_Hz, fs=RATE_HZ)
        width = round(0.44 * RATE_HZ / cut_off_Hz)
        out[f"mean of {width} rows"] = np.ones(width) / width, np.ones(1)
    return out


def filtered(log: cdprcal.Log, numbers: tuple[np.ndarray, np.ndarray], behind: str) -> cdprcal.Log:
    """The log with these channels behind a filter that had settled at the first reading."""
    settled = signal.lfilter_zi(*numbers)
    held = {name: np.array(getattr(log, name)) for name in BEHIND["all"]}
    for name in BEHIND[behind]:
        columns = held[name].T
        held[name] = np.column_stack(
            [signal.lfilter(*numbers, c, zi=settled * c[0])[0] for c in columns]
        )
    return cdprcal.Log(time_s=np.array(log.time_s), source=log.source, **held)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=3, help="start-ups for each")
    count = parser.parse_args().count
    robot = cdprcal.load_robot("irma4")
    noise = cdprcal.reading_noise(robot.sigma, 0.3)
    print("| filter | behind it | rests of 8 | σ [mm] | largest error [σ] |\n|---|---|---|---|---|")
    for name, numbers in filters().items():
        for behind in BEHIND:
            rests, sigma_mm, off = [], [], []
            for seed in range(1, count + 1):
                options = cdprcal.SyntheticLogOptions(rate_Hz=RATE_HZ, seed=seed, noise=noise)
                made = cdprcal.synthetic_log(
                    robot, cdprcal.default_setpoints(robot, 2, 2, 2), options
                )
                log = filtered(made.log, numbers, behind)
                rests.append(len(cdprcal.detect_equilibria(log)))
                found = cdprcal.calibrate(robot, log)
                sigma = np.array(found.result.standard_deviation)
                error = cdprcal.minus(found.result.poses[0], made.poses[0])
                sigma_mm.append(1e3 * sigma[:3].max())
                off.append(np.abs(error / sigma).max())
            print(
                f"| {name} | {behind} | {min(rests)} | {max(sigma_mm):.2g} | {max(off):.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
