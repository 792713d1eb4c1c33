"""How long an hour of log takes: canonical CSV, a raw robot log and MCAP, 100 Hz, four cables.

    python tests/studies/log_reading.py

Prints seconds of the processor (median of five) to read each, and for ``cdprcal import`` of each as
a CSV log, with the start of the program. Ends with exit code 1 when reading is above --limit.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import cdprcal
from cdprcal.io import load_log, save_log


def made_log(samples: int) -> cdprcal.Log:
    """All columns of a four-cable log, seventeen digits each, as sensors with noise have them."""
    random = np.random.default_rng(1)
    slow = np.cumsum(random.normal(size=(samples, 4)), axis=0) * 1e-4
    return cdprcal.Log(
        time_s=np.arange(samples) * 0.01,
        length_m=2.0 + slow,
        swivel_rad=slow,
        tension_N=100.0 + random.normal(size=(samples, 4)),
        tension_setpoint_N=np.round(100.0 + random.normal(size=(samples, 4)), 1),
        roll_pitch_yaw_rad=0.01 * random.normal(size=(samples, 3)),
    )


def write_raw(log: cdprcal.Log, path: Path) -> None:
    """The same as the robot itself writes it: a line a cable, and one of the attitude."""
    with path.open("w") as file:
        for k, time_s in enumerate(log.time_s):
            for cable in range(4):
                file.write(
                    f"3,{time_s:.3f},{cable},9,{int(1e5 * log.length_m[k, cable])},120,-35,"
                    f"{log.length_m[k, cable]:.6f},0.001200,{log.tension_N[k, cable]:.3f},"
                    f"{log.tension_setpoint_N[k, cable]:.3f},15218,1,"
                    f"{log.swivel_rad[k, cable]:.6f}\n"
                )
            roll, pitch, yaw = np.degrees(log.roll_pitch_yaw_rad[k])
            file.write(f"5,{time_s:.3f},{roll:.4f},{pitch:.4f},{yaw:.4f}\n")


def import_seconds(path: Path) -> float:
    """Of a process of its own; user and system."""
    times = []
    words = [sys.executable, "-m", "cdprcal", "import", str(path), "-o", str(path) + ".csv"]
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(words, check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return statistics.median(times)


def seconds(path: Path, samples: int) -> float:
    times = []
    for _ in range(5):
        begin = time.process_time()
        log = load_log(path).log
        times.append(time.process_time() - begin)
        assert len(log) == samples
    return statistics.median(times)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", type=int, default=360_000)
    parser.add_argument("--limit", type=float, default=1.0, help="seconds")
    given = parser.parse_args()
    log = made_log(given.samples)
    slow = False
    with tempfile.TemporaryDirectory() as folder:
        for name in ("hour.csv", "hour.log", "hour.mcap"):
            path = Path(folder) / name
            if path.suffix == ".log":
                write_raw(log, path)
            else:
                save_log(log, path)
            took = seconds(path, given.samples)
            slow |= took > given.limit
            size = path.stat().st_size / 1e6
            print(f"{name}: {size:.0f} MB, {took:.2f} s; imported: {import_seconds(path):.2f} s")
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main())
