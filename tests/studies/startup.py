"""Studies of the start-up procedure on simulated robots, and of equilibrium detection on logs.

    python tests/studies/startup.py starts --count 100        # random power-on poses
    python tests/studies/startup.py durations                 # 8 poses, robots of 3, 4 and 5 cables
    python tests/studies/startup.py equilibria irma4 LOG…     # rests in a log, with their times

Each prints a table on stdout and ends with exit code 1 when a requirement is not met.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import cdprcal
from cdprcal.acquisition import start_up_plan
from cdprcal.studies import Workers, add_worker_options, spread, workers_of

POSITION_LIMIT_M, ROTATION_LIMIT_RAD = 1e-3, np.radians(0.1)
DURATION_LIMIT_S = 80.0


@dataclass(frozen=True)
class Start:
    """One simulated start-up from a random power-on pose."""

    seed: int
    run: cdprcal.StartUpRun
    limits_N: tuple[float, float]
    online_m: float  # worst of the rests that the procedure measured
    online_rad: float
    detected: int  # equilibria that detect_equilibria finds in the log
    detected_m: float  # worst of these
    detected_rad: float
    calibration: cdprcal.Calibration
    pose_m: float  # error of the calibrated initial pose
    pose_rad: float

    @property
    def problems(self) -> list[str]:
        """What is not as required."""
        run = self.run
        checks = {
            f"ended {run.state.name}: {run.reason}": run.state == cdprcal.StartUpState.done,
            "commanded outside the limits": self.limits_N[0] <= run.min_setpoint_N
            and run.max_setpoint_N <= self.limits_N[1],
            "a measured rest is off": self.online_m < POSITION_LIMIT_M
            and self.online_rad < ROTATION_LIMIT_RAD,
            "a detected equilibrium is off": self.detected_m < POSITION_LIMIT_M
            and self.detected_rad < ROTATION_LIMIT_RAD,
            "a set-point was not detected": self.detected >= len(run.rests),
            "calibration did not converge": self.calibration.result.status
            == cdprcal.CalibrationStatus.converged,
        }
        return [name for name, fine in checks.items() if not fine]


def box_of(plan: cdprcal.Plan) -> cdprcal.Box:
    """The box that the poses of a plan span."""
    positions = np.array([plan.start_pose.position_m, *(s.pose.position_m for s in plan.poses)])
    return cdprcal.Box(positions.min(axis=0), positions.max(axis=0))


def planned(robot: cdprcal.Robot, **options: Any) -> cdprcal.Plan:
    """The plan that ``cdprcal plan`` makes."""
    result = cdprcal.make_plan(robot, **options)
    if result.status != cdprcal.PlanStatus.planned:
        raise SystemExit(f"{robot.name}: {result.reason}")
    return result.plan


def off_equilibrium(
    robot: cdprcal.Robot,
    run: cdprcal.StartUpRun,
    plan: cdprcal.StartUpPlan,
    rows: cdprcal.SampleRange,
) -> tuple[float, float]:
    """How far the platform truly was, on average over some rows of the log, from the equilibrium.

    Of the set-point that the rows belong to: the direct problem's. (m, rad)
    """
    middle = (rows.begin + rows.end) // 2
    wanted_N = run.log.tension_setpoint_N[middle]
    poses = run.poses[rows.begin : rows.end]
    rest = cdprcal.direct_from_tensions(robot, wanted_N, poses[0])
    assert rest.pose is not None, rest.reason
    mean = np.mean([cdprcal.minus(pose, rest.pose) for pose in poses], axis=0)
    return float(np.linalg.norm(mean[:3])), float(np.linalg.norm(mean[3:]))


def random_starts(
    robot: cdprcal.Robot, plan: cdprcal.Plan, seeds: range, *, quick: bool = True
) -> Iterator[Start]:
    """Start-ups with the simulator's default noise, from poses drawn from the plan's box."""
    box = box_of(plan)
    visits = start_up_plan(plan, quick=quick)
    for seed in seeds:
        start = cdprcal.random_start(robot, box, seed)
        assert start is not None
        run = cdprcal.simulate_startup(
            robot,
            visits,
            simulator=cdprcal.SimulatorOptions(seed=seed),
            initial_tension_N=start.tension_N,
        )
        online = [off_equilibrium(robot, run, visits, rows) for rows in run.rest_rows]
        # Before the first set-point is reached the tensions at power-on are held: a rest as well.
        found = cdprcal.detect_equilibria(run.log, sigma=robot.sigma)
        begin_s = run.rests[0].begin_s if run.rests else np.inf
        at_setpoints = [e for e in found if e.end_s > begin_s]
        offline = [off_equilibrium(robot, run, visits, e.samples) for e in at_setpoints]
        calibration = cdprcal.calibrate(robot, run.log)
        poses = calibration.result.poses
        error = cdprcal.minus(poses[0], run.poses[0]) if poses else np.full(6, np.nan)
        yield Start(
            seed,
            run,
            (robot.tension_limits_N[0], robot.tension_limits_N[1]),
            max((m for m, _ in online), default=np.nan),
            max((rad for _, rad in online), default=np.nan),
            len(at_setpoints),
            max((m for m, _ in offline), default=np.nan),
            max((rad for _, rad in offline), default=np.nan),
            calibration,
            float(np.linalg.norm(error[:3])),
            float(np.linalg.norm(error[3:])),
        )


@dataclass(frozen=True)
class Row:
    """A Start in numbers, which travel from one process to another."""

    problems: list[str]
    values: tuple[float, ...]
    low_N: float
    high_N: float


def one_start(seed: int, robot_name: str, plan_text: str) -> Row:
    robot = cdprcal.load_robot(robot_name)
    plan = cdprcal.parse_plan(plan_text, "plan")
    (start,) = random_starts(robot, plan, range(seed, seed + 1))
    return Row(
        start.problems,
        (
            1e3 * start.online_m,
            float(np.degrees(start.online_rad)),
            1e3 * start.detected_m,
            float(np.degrees(start.detected_rad)),
            1e3 * start.pose_m,
            float(np.degrees(start.pose_rad)),
            float(start.run.log.time_s[-1]),
        ),
        start.run.min_setpoint_N,
        start.run.max_setpoint_N,
    )


def study_starts(robot_name: str, count: int, workers: Workers) -> int:
    robot = cdprcal.load_robot(robot_name)
    text = cdprcal.format_plan(planned(robot))
    worst = dict.fromkeys(
        ("rest_mm", "rest_deg", "found_mm", "found_deg", "pose_mm", "pose_deg", "time_s"), 0.0
    )
    pose_mm = []
    failures = 0
    low_N, high_N = np.inf, -np.inf
    seeds = range(1, count + 1)
    rows = spread(partial(one_start, robot_name=robot_name, plan_text=text), seeds, workers)
    for seed, row in zip(seeds, rows, strict=True):
        for problem in row.problems:
            print(f"seed {seed}: {problem}")
        failures += bool(row.problems)
        worst = {k: max(w, v) for (k, w), v in zip(worst.items(), row.values, strict=True)}
        pose_mm.append(row.values[list(worst).index("pose_mm")])
        low_N = min(low_N, row.low_N)
        high_N = max(high_N, row.high_N)
    print(f"{robot.name}: {count} random starts, {failures} with a problem")
    print(f"commanded tensions {low_N:.1f} to {high_N:.1f} N, limits {robot.tension_limits_N}")
    print(f"measured rests: worst {worst['rest_mm']:.3f} mm, {worst['rest_deg']:.4f} deg")
    print(f"detected in the log: worst {worst['found_mm']:.3f} mm, {worst['found_deg']:.4f} deg")
    print(
        f"initial pose: median {np.median(pose_mm):.2f} mm, worst {worst['pose_mm']:.2f} mm, "
        f"{worst['pose_deg']:.3f} deg"
    )
    print(f"longest run {worst['time_s']:.1f} s of robot time")
    return failures


#: Robots of 4, 3 and 5 cables; the grid is the paper's for irma4, in proportion for the others.
BOXES = {
    "irma4": None,
    "ring3": ([-0.17, -0.17, 0.65], [0.17, 0.17, 0.95]),
    "ring5": ([-0.17, -0.17, 0.65], [0.17, 0.17, 0.95]),
}


def durations(seeds: range) -> Iterator[tuple[str, str, int, float, Start]]:
    """(robot, poses, set-points measured, robot time, run) for each robot, plan and seed."""
    for name, corners in BOXES.items():
        robot = cdprcal.load_robot(name)
        boxes: dict[str, cdprcal.Box | None] = {"default box": None}
        if corners is not None:
            boxes["0.34 × 0.34 × 0.3 m"] = cdprcal.Box(*corners)
        for label, box in boxes.items():
            plan = planned(robot, box=box)
            for start in random_starts(robot, plan, seeds):
                run = start.run
                yield name, label, len(run.rests), float(run.log.time_s[-1]), start


def study_durations(count: int) -> int:
    failures = 0
    rows: dict[tuple[str, str], list[tuple[int, float, Start]]] = {}
    for name, label, rests, time_s, start in durations(range(1, count + 1)):
        rows.setdefault((name, label), []).append((rests, time_s, start))
    for (name, label), runs in rows.items():
        longest = max(time_s for _, time_s, _ in runs)
        accurate = sorted(1e3 * start.pose_m for *_, start in runs)
        problems = [p for *_, start in runs for p in start.problems]
        failures += bool(problems)
        print(
            f"{name} ({label}): {runs[0][0]} set-points with tau_0, longest of {count} "
            f"{longest:.1f} s, initial pose median {accurate[len(accurate) // 2]:.2f} mm, worst "
            f"{accurate[-1]:.2f} mm {'; '.join(problems)}"
        )
    return failures


def study_equilibria(robot_name: str, logs: list[str]) -> int:
    from cdprcal.io import load_run

    robot = cdprcal.load_robot(robot_name)
    for path in logs:
        log = load_run(path, robot).log
        run = cdprcal.segments(log)[-1]
        found = cdprcal.detect_equilibria(log, run, robot.sigma)
        print(f"{path}: {len(found)} rests in the run of {log.time_s[run.end - 1]:.1f} s")
        for e in found:
            rest = cdprcal.equilibrium_mean(log, e.samples)
            sigma = np.sqrt(np.diag(rest.covariance))
            n = robot.cable_count
            tension_N = ", ".join(
                f"{mean:.1f} ± {s:.1f}"
                for mean, s in zip(rest.mean[2 * n : 3 * n], sigma[2 * n : 3 * n], strict=True)
            )
            print(
                f"  {e.begin_s:8.2f} to {e.end_s:8.2f} s: {tension_N} N, "
                f"lengths ± {1e3 * sigma[:n].max():.2f} mm"
            )
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="study", required=True)
    starts = commands.add_parser("starts")
    starts.add_argument("--robot", default="irma4")
    starts.add_argument("--count", type=int, default=100)
    add_worker_options(starts)
    times = commands.add_parser("durations")
    times.add_argument("--count", type=int, default=5)
    rests = commands.add_parser("equilibria")
    rests.add_argument("robot")
    rests.add_argument("logs", nargs="+")
    arguments = parser.parse_args()
    if arguments.study == "starts":
        failures = study_starts(arguments.robot, arguments.count, workers_of(arguments))
    elif arguments.study == "durations":
        failures = study_durations(arguments.count)
    else:
        failures = study_equilibria(arguments.robot, arguments.logs)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
