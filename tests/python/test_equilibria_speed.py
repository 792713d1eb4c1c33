"""The inverse problem beside scipy.optimize.fsolve: the same points, both warm-started.

pytest tests/python/test_equilibria_speed.py --benchmark-columns=min,median,rounds
"""

from __future__ import annotations

import time
from typing import Any

import pytest
from peers_equilibria import NumpyRobot, inverse_by_cdprcal, inverse_by_fsolve, line

import cdprcal

POINTS = 200
LINE = line(POINTS)


@pytest.mark.alone
@pytest.mark.benchmark(group=f"inverse problem, {POINTS} points")
def test_cdprcal(benchmark: Any, robot: cdprcal.Robot) -> None:
    assert benchmark.pedantic(inverse_by_cdprcal, (robot, LINE), rounds=20).shape == (POINTS, 4)


@pytest.mark.alone
@pytest.mark.benchmark(group=f"inverse problem, {POINTS} points")
def test_fsolve(benchmark: Any, robot: cdprcal.Robot) -> None:
    pytest.importorskip("scipy", reason="SciPy is not installed (the test extra has it)")
    theirs = benchmark.pedantic(inverse_by_fsolve, (NumpyRobot(robot), LINE), rounds=3)
    elapsed_s = []
    for _ in range(10):  # the least: the machine may be busy
        started = time.perf_counter()
        ours = inverse_by_cdprcal(robot, LINE)
        elapsed_s.append(time.perf_counter() - started)
    assert ours == pytest.approx(theirs, rel=1e-6)
    if benchmark.stats is not None:  # with --benchmark-disable nothing was timed
        assert benchmark.stats["min"] > 20.0 * min(elapsed_s)
