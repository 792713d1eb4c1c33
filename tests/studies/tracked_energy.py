"""Energy of a platform with locked winches, as an optical tracker saw it.

    python tests/studies/tracked_energy.py ROBOT TRACKER

Cables of constant length do no work, and what holds a platform back takes energy away: a swing that
gains some is pushed. TRACKER is a CSV of time_s, x_mm, y_mm, z_mm, angle_1, angle_2, angle_3 [rad]
(Rz(angle_3) Ry(angle_2) Rx(angle_1)) at an even rate. Printed: every time in which the energy,
averaged over a second, rises by more than a tenth of its range, with what it gains.
"""

import argparse
from itertools import pairwise

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, filtfilt, find_peaks
from scipy.spatial.transform import Rotation

import cdprcal

LOW_PASS_HZ = 8.0  # of differences of positions; the platform swings at 2
WINDOW_S = 1.0
LEAST_SHARE = 0.1


def energy_J(robot: cdprcal.Robot, path: np.ndarray) -> np.ndarray:
    """Kinetic and potential energy [J] of a tracked path, averaged, above its least."""
    step_s = float(np.median(np.diff(path["time_s"])))
    smooth = butter(2, LOW_PASS_HZ * 2.0 * step_s)
    position_m = 1e-3 * np.column_stack([path[f"{axis}_mm"] for axis in "xyz"])
    angles_rad = np.column_stack([path[f"angle_{k}"] for k in (1, 2, 3)])
    rotation = Rotation.from_euler("xyz", filtfilt(*smooth, angles_rad, axis=0))
    platform = robot.platform
    centre_m = filtfilt(*smooth, position_m, axis=0) + rotation.apply(platform.centre_of_mass_m)
    velocity_m_s = np.gradient(centre_m, step_s, axis=0)
    turned = rotation[:-1].inv() * rotation[1:]
    rate_rad_s = np.vstack([turned.as_rotvec(), np.zeros(3)]) / step_s  # in platform axes
    turning = np.einsum("ni,ij,nj->n", rate_rad_s, platform.inertia_kg_m2, rate_rad_s)
    kinetic = 0.5 * (platform.mass_kg * (velocity_m_s**2).sum(axis=1) + turning)
    energy = kinetic + platform.mass_kg * robot.gravity_m_s2 * centre_m[:, 2]
    mean: np.ndarray = uniform_filter1d(energy, round(WINDOW_S / step_s))
    mean -= mean.min()
    return mean


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n", maxsplit=1)[0])
    parser.add_argument("robot")
    parser.add_argument("tracker")
    options = parser.parse_args()
    path = np.genfromtxt(options.tracker, delimiter=",", names=True)
    time_s = path["time_s"]
    energy = energy_J(cdprcal.load_robot(options.robot), path)
    # The end counts as a peak where the energy still rises.
    peaks, _ = find_peaks(np.append(energy, 0.0), prominence=LEAST_SHARE * energy.max())
    for last, peak in pairwise([0, *peaks]):
        begin = last + int(np.argmin(energy[last:peak]))
        print(
            f"{time_s[begin]:.1f} to {time_s[peak]:.1f} s: {energy[begin]:.2f} to "
            f"{energy[peak]:.2f} J"
        )
    print(f"largest {energy.max():.2f} J")


if __name__ == "__main__":
    main()
