"""A short version of tests/studies/startup.py; the long one is run by hand."""

from __future__ import annotations

from pathlib import Path

import interrupted
import numpy as np
import pytest
import startup

import cdprcal
from cdprcal.io import load_run


@pytest.mark.parametrize("name", ["irma4", "ring3", "ring5"])
def test_random_starts_end_well(name: str) -> None:
    robot = cdprcal.load_robot(name)
    corners = startup.BOXES[name]
    plan = startup.planned(robot, box=None if corners is None else cdprcal.Box(*corners))
    for start in startup.random_starts(robot, plan, range(1, 5)):
        assert not start.problems, f"seed {start.seed}"
        assert len(start.run.rests) == 9  # tau_0 and eight poses
        assert start.run.log.time_s[-1] <= startup.DURATION_LIMIT_S
        assert start.pose_m < 5e-3


def test_six_of_the_authors_poses_are_rests_and_two_are_in_motion(
    robot: cdprcal.Robot, shared_data: Path
) -> None:
    """Which of the poses picked by hand in trial a are rests, and how fast the others move."""
    import json

    log = load_run(shared_data / "irma4" / "trial_a.csv", robot).log
    picked = json.loads((shared_data / "irma4" / "trial_a.json").read_text())["times_s"]
    found = cdprcal.detect_equilibria(log, cdprcal.segments(log)[-1], robot.sigma)
    at_rest = [any(e.begin_s - 0.05 <= t <= e.end_s for e in found) for t in picked]
    assert at_rest == [True, True, True, True, False, True, False, True]
    speeds = []
    for time_s in picked:
        rows = np.abs(log.time_s - time_s) < 0.55
        slope = np.polyfit(log.time_s[rows], log.length_m[rows], 1)[0]
        speeds.append(float(np.abs(slope).max()))
    # The fifth: a cable at over 100 mm/s; the seventh: one that still creeps into its rest.
    assert speeds[4] > 0.1
    assert 0.005 < speeds[6] < 0.02
    after = [e for e in found if 0.0 < e.begin_s - picked[6] < 2.0]
    assert len(after) == 1


def test_every_plateau_of_the_long_measured_run_is_found(
    robot: cdprcal.Robot, shared_data: Path
) -> None:
    """Where the set-points of sc_27 stand still for two seconds, a rest is found."""
    log = load_run(shared_data / "irma4" / "sc_27_medium_a.log", robot).log
    run = cdprcal.segments(log)[-1]
    found = cdprcal.detect_equilibria(log, run, robot.sigma)
    wanted = log.tension_setpoint_N
    plateaus = []
    first = run.begin
    for row in range(run.begin + 1, run.end + 1):
        if row == run.end or np.abs(wanted[row] - wanted[first]).max() > 1e-6:
            if log.time_s[row - 1] - log.time_s[first] >= 2.0:
                plateaus.append((log.time_s[first], log.time_s[row - 1]))
            first = row
    assert len(plateaus) == 26
    for begin_s, end_s in plateaus:
        assert any(e.begin_s < end_s and e.end_s > begin_s for e in found), begin_s


def test_nothing_is_caught_by_cables_when_a_run_is_stopped_in_mid_motion(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert interrupted.main(["--robot", "irma4", "--robot", "ring5", "--moments", "2"]) == 0
    assert capsys.readouterr().out.count("operator") == 2
    robot = cdprcal.load_robot("irma4")
    plan = cdprcal.make_plan(robot).plan
    soft, quick = (
        interrupted.interrupted(robot, plan, 0.5, seed=1, trusted=trusted)
        for trusted in (True, False)
    )
    assert soft.after_N[0] > 0.5 * robot.tension_limits_N[0]
    assert quick.took_s <= 0.2 < soft.took_s
