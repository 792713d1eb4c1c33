"""What the ways between the rests know of the initial pose, without any rest but the first.

    python tests/studies/transitions.py LOG LOG …

Logs of a real robot (irma4): each is diagnosed, and the corrected robot file calibrates it whole.
Then all rests but the first, and a second around each, are taken out of the log (no readings, so
that nothing is lost by counting), and what is left is calibrated: by geometry alone, as the default
does, and with the balance in motion. Printed: how far each is from the whole log's answer, and its
sigma along the worst axis.
"""

from __future__ import annotations

import argparse

import numpy as np

import cdprcal
from cdprcal import _core
from cdprcal.io import load_log

AROUND_S = 1.2
GROUPS = ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")


def without_rests(log: cdprcal.Log, rests: list[_core.Equilibrium]) -> cdprcal.Log:
    out = np.zeros(len(log), dtype=bool)
    for rest in rests[1:]:
        out |= (log.time_s > rest.begin_s - AROUND_S) & (log.time_s < rest.end_s + AROUND_S)
    kept = {group: np.where(out[:, None], np.nan, getattr(log, group)) for group in GROUPS}
    return cdprcal.Log(time_s=log.time_s, source=log.source, **kept)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="+")
    options = parser.parse_args()
    for path in options.logs:
        log = load_log(path).log
        robot = _core.diagnose(cdprcal.load_robot("irma4"), [log]).corrected
        whole = _core.calibrate(robot, log)
        known = whole.result.poses[0]
        moving = without_rests(log, whole.equilibria)

        answers = {
            "whole log": whole,
            "ways: geometry": cdprcal.calibrate(robot, moving, method="kinematic"),
            "ways: as calibrate does": cdprcal.calibrate(robot, moving),
            "ways: balance in motion": _core.calibrate_in_motion(robot, moving).calibration,
        }
        print(f"{path}: {len(whole.equilibria)} rests")
        for name, calibration in answers.items():
            result = calibration.result
            if result.covariance is None:
                print(f"  {name:24} {result.status.name}")
                continue
            off = cdprcal.minus(result.poses[0], known)
            sigma = [
                np.sqrt(np.linalg.eigvalsh(result.covariance[k : k + 3, k : k + 3])[-1])
                for k in (0, 3)
            ]
            print(
                f"  {name:24} off by {1e3 * np.linalg.norm(off[:3]):6.2f} mm, "
                f"{np.degrees(np.linalg.norm(off[3:])):.3f} deg; sigma {1e3 * sigma[0]:6.2f} mm, "
                f"{np.degrees(sigma[1]):.3f} deg"
            )


if __name__ == "__main__":
    main()
