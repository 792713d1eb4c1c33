"""Memory of a diagnosis grows with the number of poses, not with its square."""

from __future__ import annotations

import sys

from scripts import executed

_DIAGNOSE = """
import re, sys
from pathlib import Path
from cdprcal import _core

def peak_kB():  # of this program alone: ru_maxrss begins with what the parent had
    return int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1])

robot, poses = _core.load_robot("irma4"), int(sys.argv[1])
grid = list(_core.default_setpoints(robot, 3, 3, 3))
way = [*range(27), *range(25, 0, -1)]
options = _core.SyntheticLogOptions(noise=_core.reading_noise(robot.sigma, 0.2))
log = _core.synthetic_log(robot, [grid[way[i % 52]] for i in range(poses)], options).log
before = peak_kB()
_core.diagnose(robot, [log])
print(peak_kB() - before)
"""


def grown_kB(poses: int) -> int:
    ran = executed([sys.executable, "-c", _DIAGNOSE, str(poses)], check=True)
    return int(ran.stdout)


def test_memory_is_linear_in_poses() -> None:
    # Four times the poses: 4 times as much where it is linear, 16 times where it is quadratic.
    few_kB, many_kB = grown_kB(128), grown_kB(512)
    assert few_kB > 0
    assert many_kB < 8 * few_kB
