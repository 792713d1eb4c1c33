"""Stopping when the initial pose is known well enough, on the simulated robot.

    python tests/studies/stopping.py --count 100             # eq. 18 noise on every reading
    python tests/studies/stopping.py --count 100 --noise 0.2

Each start-up is run with ``--until 5mm,0.5deg`` on a plan of 27 poses. Printed: robot time against
that of the whole plan, errors against what was asked, and how honest the standard deviations were
after every number of rests. Exit code 1 when a requirement is not met. On all cores (--jobs), or a
Dask cluster (--dask).
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.stats import chi2

import cdprcal
from cdprcal.acquisition import (
    Guide,
    acquire,
    parse_accuracy,
    start_up_options,
    start_up_plan,
)
from cdprcal.hardware.simulated import SimulatedBackend
from cdprcal.studies import Workers, add_worker_options, spread, workers_of

ASKED = "5mm,0.5deg"
#: A promise of one σ is broken beyond the bound that an error of three normal parts stays within
#: with 95 % probability.
BOUND = float(np.sqrt(chi2.ppf(0.95, 3)))


class NoLog:
    """A log that nobody reads."""

    def sample(self, sample: cdprcal.RobotSample, setpoint_N: Any) -> None: ...
    def event(self, event: Any) -> None: ...
    def close(self) -> None: ...


@dataclass(frozen=True)
class Stop:
    """How one start-up ended, and what was claimed on the way."""

    reached: bool
    reason: str
    robot_s: float
    full_s: float  #: of the whole plan
    rests: int
    position_m: float  #: error
    rotation_rad: float
    sigma_m: float
    sigma_rad: float
    #: (rests, Mahalanobis² of the error) after each rest
    honesty: tuple[tuple[int, float], ...]


def planned(name: str) -> cdprcal.Plan:
    result = cdprcal.make_plan(cdprcal.load_robot(name), grid=(3, 3, 3))
    assert result.status == cdprcal.PlanStatus.planned, result.reason
    return result.plan


def sensors(sigma: cdprcal.SensorSigma, noise: float) -> cdprcal.SensorOptions:
    """`noise` times eq. 18 on every reading, white."""

    def channel(value: float) -> cdprcal.SensorChannel:
        return cdprcal.SensorChannel(noise=noise * value, resolution=1e-6)

    attitude = channel(sigma.attitude_rad)
    return cdprcal.SensorOptions(
        length_m=channel(sigma.length_m),
        swivel_rad=channel(sigma.swivel_rad),
        tension_N=channel(sigma.tension_N),
        roll_pitch_rad=attitude,
        yaw_rad=attitude,
    )


def stopped(
    seed: int,
    noise: float,
    name: str,
    plan_text: str,
    effects: Sequence[str] = (),
    motion: bool = False,
) -> Stop:
    robot = cdprcal.load_robot(name)
    plan = cdprcal.parse_plan(plan_text, "plan")
    startup = cdprcal.StartUp(
        robot, start_up_plan(plan, quick=motion), start_up_options(plan, wait_for_rest=not motion)
    )
    asked = parse_accuracy(ASKED)
    guide = Guide(robot, plan, startup, asked=asked, quick=motion, in_motion=motion)
    options = cdprcal.SimulatorOptions(
        seed=seed,
        sensors=sensors(robot.sigma, noise),
        effects=[cdprcal.parse_injected_effect(e) for e in effects],
    )
    device = SimulatedBackend.somewhere(
        robot, plan, options, velocity_limit_m_s=startup.velocity_limit_m_s
    )
    truth = device.truth().pose
    honesty = []

    def watch(command: cdprcal.StartUpCommand, sample: cdprcal.RobotSample, logged: bool) -> None:
        estimate = guide.step(command, sample, logged)
        if estimate is not None and estimate.status == "converged":
            assert estimate.pose is not None
            assert estimate.covariance is not None
            error = cdprcal.minus(estimate.pose, truth)
            size = float(error @ np.linalg.solve(estimate.covariance, error))
            honesty.append((estimate.rests, size))

    run = acquire(startup, device, NoLog(), watch=watch, log_rate_Hz=100.0 if motion else 10.0)
    guide.close()
    last = guide.estimates[-1] if guide.estimates else None
    if last is None or last.pose is None:
        return Stop(
            False,
            run.reason or "no estimate",
            run.duration_s,
            full_s=np.nan,
            rests=0,
            position_m=np.nan,
            rotation_rad=np.nan,
            sigma_m=np.nan,
            sigma_rad=np.nan,
            honesty=(),
        )
    return Stop(
        guide.reached,
        run.reason,
        run.duration_s,
        cdprcal.StartUp(robot, start_up_plan(plan)).planned_duration_s,
        last.rests,
        float(np.linalg.norm(last.pose.position_m - truth.position_m)),
        cdprcal.rotation_distance_rad(last.pose, truth),
        last.position_sigma_m,
        last.rotation_sigma_rad,
        tuple(honesty),
    )


def study(
    count: int,
    noise: float,
    workers: Workers,
    name: str,
    effects: Sequence[str],
    motion: bool = False,
) -> list[str]:
    """Prints the tables; returns what is not as required."""
    text = cdprcal.format_plan(planned(name))  # a plan itself does not travel
    work = partial(
        stopped, noise=noise, name=name, plan_text=text, effects=tuple(effects), motion=motion
    )
    stops = spread(work, range(1, count + 1), workers)
    good = [s for s in stops if s.reached]
    asked = parse_accuracy(ASKED)
    print(
        f"{name}, {count} start-ups, noise {noise:g} of eq. 18, until {ASKED}; "
        f"{len(good)} reached it"
    )
    for seed, s in enumerate(stops, 1):
        if not s.reached:
            print(f"  seed {seed}: {s.reason or 'all stops measured'}; {s.rests} rests")
    if not good:
        return ["none reached the accuracy"]
    share = np.median([s.robot_s / s.full_s for s in good])
    print(
        f"robot time {np.median([s.robot_s for s in good]):.1f} s (median; "
        f"{max(s.robot_s for s in good):.1f} s at most) of {good[0].full_s:.1f} s: {share:.2f}; "
        f"rests {np.median([s.rests for s in good]):g} (at most {max(s.rests for s in good)})"
    )
    position = np.array([s.position_m for s in good])
    rotation = np.array([s.rotation_rad for s in good])
    print(
        f"errors rms {1e3 * np.sqrt((position**2).mean()):.2f} mm, "
        f"{np.degrees(np.sqrt((rotation**2).mean())):.3f} deg; "
        f"worst {1e3 * position.max():.2f} mm, {np.degrees(rotation.max()):.3f} deg"
    )
    broken = (position > BOUND * asked.position_m) | (rotation > BOUND * asked.rotation_rad)
    beyond = (position > asked.position_m) | (rotation > asked.rotation_rad)
    print(
        f"beyond the 95 % bound of what was asked ({BOUND:.2f} sigma): {broken.sum()} of "
        f"{len(good)}; beyond 5 mm or 0.5 deg themselves: {beyond.sum()}"
    )
    print("rests  estimates  95 % regions cover  rms Mahalanobis / sqrt(6)")
    by_rests: dict[int, list[float]] = {}
    for s in stops:
        for rests, size in s.honesty:
            by_rests.setdefault(rests, []).append(size)
    limit = chi2.ppf(0.95, 6)
    for rests, sizes in sorted(by_rests.items()):
        values = np.array(sizes)
        print(
            f"{rests:5d}  {len(values):9d}  {100 * np.mean(values < limit):16.1f} %  "
            f"{np.sqrt(values.mean() / 6):12.2f}"
        )
    problems = []
    if share > 0.5:
        problems.append(f"robot time is {share:.2f} of the whole plan's")
    if broken.mean() > 0.05:
        problems.append(f"{broken.sum()} of {len(good)} are worse than promised")
    return problems


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--noise", type=float, default=1.0, help="of eq. 18, on every reading")
    parser.add_argument("--robot", default="irma4")
    parser.add_argument("--effect", action="append", default=[], help="hidden, NAME=VALUES")
    parser.add_argument("--motion", action="store_true", help="without waiting for rests")
    add_worker_options(parser)
    given = parser.parse_args()
    started = time.monotonic()
    problems = study(
        given.count, given.noise, workers_of(given), given.robot, given.effect, given.motion
    )
    for problem in problems:
        print(f"NOT AS REQUIRED: {problem}")
    print(f"{time.monotonic() - started:.0f} s", file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
