"""Laws outside the catalogue, hidden in logs: is what the diagnosis writes down the law?

    python tests/studies/hidden_laws.py --count 28                  # 27 poses, irma4
    python tests/studies/hidden_laws.py --count 28 --poses 8
    python tests/studies/hidden_laws.py --count 28 --one            # of one cable alone
    python tests/studies/hidden_laws.py --count 24 --law ahrs_across --law one_cell_jumps
    python tests/studies/hidden_laws.py --count 50 --clean          # nothing hidden

A robot is started up in the simulator; then a law changes its readings, here, by code that the
estimator does not have. Errors that stay the same over a rest are added to every channel. Half of
the laws are not of the forms that the search tries. Counted: the right channel and variable, names
of the catalogue where there is none, the excess of the residuals' sum of squares that a formula
takes off poses it was not fitted on, and what becomes of the initial pose.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import cdprcal

Floats = NDArray[np.float64]
#: Of errors that come anew at every rest: m, rad, N, rad.
REST_SIGMA = {"length_m": 3e-4, "swivel_rad": 1.5e-3, "tension_N": 0.5, "roll_pitch_yaw_rad": 2e-3}

SIGMAS = (*list(REST_SIGMA.values())[:3], REST_SIGMA["roll_pitch_yaw_rad"], 2e-3)


@dataclass
class World:
    """What there is to depend on, sample by sample; readings before anything was hidden."""

    time_s: Floats
    position_m: Floats
    length_m: Floats
    swivel_rad: Floats
    tension_N: Floats
    attitude_rad: Floats

    @property
    def direction(self) -> Floats:
        """+1 after paying out, -1 after hauling in, a cable: the sign of the last millimetres."""
        out = np.zeros_like(self.length_m)
        at, s = self.length_m[0].copy(), np.zeros(self.length_m.shape[1])
        for row, length in enumerate(self.length_m):
            s = np.clip(s + (length - at) / 1e-3, -1.0, 1.0)
            at = length
            out[row] = s
        return out


Law = Callable[[World, np.random.Generator], Floats]


def _around(x: Floats) -> Floats:
    return np.asarray((x - x.mean()) / (x.std() or 1.0))


def drum_runs_out(w: World, rng: np.random.Generator) -> Floats:
    around_m, phase = rng.uniform(0.15, 0.5), rng.uniform(0, 6.3)
    return rng.uniform(2e-3, 5e-3) * np.sin(2 * np.pi * w.length_m / around_m + phase)


def drum_polygon(w: World, rng: np.random.Generator) -> Floats:
    saw = w.length_m / rng.uniform(0.3, 0.6) + rng.uniform()
    return rng.uniform(3e-3, 6e-3) * (2 * np.abs(2 * (saw - np.floor(saw + 0.5))) - 1)


def drum_layers(w: World, rng: np.random.Generator) -> Floats:
    x = w.length_m - w.length_m.min()
    return np.asarray(rng.uniform(3e-3, 8e-3) * (x / x.max()) ** 2 * 2)


def gear_backlash(w: World, rng: np.random.Generator) -> Floats:
    return rng.uniform(1.5e-3, 3e-3) * w.direction


def cable_stiffens(w: World, rng: np.random.Generator) -> Floats:
    return -rng.uniform(6e-3, 12e-3) * (1 - np.exp(-w.tension_N / 60.0))


def swivel_off_centre(w: World, rng: np.random.Generator) -> Floats:
    n = w.swivel_rad.shape[1]
    size, phase = rng.uniform(0.02, 0.05, n), rng.uniform(0, 6.3, n)
    return size * np.sin(w.swivel_rad + phase)


def swivel_sticks_at_stop(w: World, rng: np.random.Generator) -> Floats:
    a = w.swivel_rad
    beyond = np.maximum(np.abs(a) - np.quantile(np.abs(a), 0.5), 0.0)
    return np.asarray(rng.uniform(0.1, 0.2) * beyond)


def cells_bend(w: World, rng: np.random.Generator) -> Floats:
    return np.asarray(rng.uniform(4e-4, 1e-3) * (w.tension_N - 60.0) ** 2)


def cells_saturate(w: World, rng: np.random.Generator) -> Floats:
    return rng.uniform(5.0, 9.0) * np.tanh((w.tension_N - np.median(w.tension_N)) / 15.0)


def cells_warm_up(w: World, rng: np.random.Generator) -> Floats:
    n = w.tension_N.shape[1]
    tau_s = rng.uniform(0.1, 0.4) * w.time_s[-1]
    risen = 1 - np.exp(-w.time_s / tau_s)
    return np.asarray(rng.uniform(4.0, 9.0, n) * risen[:, None])


def cells_feel_swivel(w: World, rng: np.random.Generator) -> Floats:
    return np.asarray(rng.uniform(15.0, 30.0) * np.sin(w.swivel_rad) ** 2)


def ahrs_scale(w: World, rng: np.random.Generator) -> Floats:
    out = np.zeros_like(w.attitude_rad)
    out[:, rng.integers(2)] = rng.choice([-1, 1]) * rng.uniform(0.15, 0.3)
    return out * w.attitude_rad


def ahrs_across(w: World, rng: np.random.Generator) -> Floats:
    """Roll reads a share of pitch, or the other way round: axes that are not square."""
    out = np.zeros_like(w.attitude_rad)
    to = rng.integers(2)
    out[:, to] = rng.choice([-1, 1]) * rng.uniform(0.05, 0.12) * w.attitude_rad[:, 1 - to]
    return out


def ahrs_leans_with_height(w: World, rng: np.random.Generator) -> Floats:
    out = np.zeros_like(w.attitude_rad)
    z = w.position_m[:, 2]
    out[:, rng.integers(2)] = rng.uniform(0.02, 0.04) * np.tanh(_around(z))
    return out


def iron_near_compass(w: World, rng: np.random.Generator) -> Floats:
    out = np.zeros_like(w.attitude_rad)
    at = w.position_m.mean(axis=0) + np.array([rng.choice([-1, 1]) * 1.2, 0.0, 0.0])
    r = np.linalg.norm(w.position_m - at, axis=1)
    out[:, 2] = rng.uniform(0.1, 0.2) / r**3
    return out


def _of_one(law: Law) -> Law:
    """The same law, but of one cable: what it does to the others is not there."""

    def of_one(w: World, rng: np.random.Generator) -> Floats:
        values = law(w, rng)
        out = np.zeros_like(values)
        chosen = rng.integers(values.shape[1])
        out[:, chosen] = values[:, chosen]
        return out

    return of_one


def cable_grows(w: World, rng: np.random.Generator) -> Floats:
    risen = 1 - np.exp(-w.time_s / (rng.uniform(0.3, 0.8) * w.time_s[-1]))
    return np.asarray(rng.uniform(4e-3, 9e-3) * risen[:, None] * np.ones_like(w.length_m))


def encoder_jumps(w: World, rng: np.random.Generator) -> Floats:
    later = w.time_s > rng.uniform(0.25, 0.75) * w.time_s[-1]
    return np.asarray(rng.uniform(3e-3, 9e-3) * later[:, None] * np.ones_like(w.length_m))


def cells_clip(w: World, rng: np.random.Generator) -> Floats:
    """Cells read no more than the range of their amplifiers."""
    most_N = np.quantile(w.tension_N, rng.uniform(0.6, 0.9), axis=0)
    return np.asarray(np.minimum(most_N - w.tension_N, 0.0))


def cells_jump(w: World, rng: np.random.Generator) -> Floats:
    later = w.time_s > rng.uniform(0.25, 0.75) * w.time_s[-1]
    return np.asarray(rng.uniform(5.0, 10.0) * later[:, None] * np.ones_like(w.tension_N))


def cells_cross_talk(w: World, rng: np.random.Generator) -> Floats:
    out = np.zeros_like(w.tension_N)
    to, of = rng.choice(w.tension_N.shape[1], 2, replace=False)
    out[:, to] = rng.choice([-1, 1]) * rng.uniform(0.08, 0.2) * w.tension_N[:, of]
    return out


#: Names of the catalogue that say the same, or all but its curvature.
ALIKE = {
    "swivel_off_centre": {"swivel_scale"},
    "iron_near_compass": {"magnetic_disturbance"},
    "ahrs_scale": {"attitude_scale"},
    "cable_stiffens": {"cable_elasticity"},
    "one_swivel_off_centre": {"swivel_scale"},
    "one_encoder_jumps": {"cable_slip"},
    "one_cell_clips": {"load_cell_shift"},
    "one_cell_jumps": {"load_cell_shift"},
}
#: Law, field, what it depends on (any of these is right), whether the search has its form.
LAWS: dict[str, tuple[Law, str, tuple[str, ...], bool]] = {
    "drum_runs_out": (drum_runs_out, "length_m", ("length",), True),
    "drum_polygon": (drum_polygon, "length_m", ("length",), False),
    "drum_layers": (drum_layers, "length_m", ("length",), True),
    "gear_backlash": (gear_backlash, "length_m", ("direction",), True),
    "cable_stiffens": (cable_stiffens, "length_m", ("tension",), False),
    "swivel_off_centre": (swivel_off_centre, "swivel_rad", ("swivel",), True),
    "swivel_sticks_at_stop": (swivel_sticks_at_stop, "swivel_rad", ("swivel",), False),
    "cells_bend": (cells_bend, "tension_N", ("tension",), True),
    "cells_saturate": (cells_saturate, "tension_N", ("tension",), False),
    "cells_warm_up": (cells_warm_up, "tension_N", ("time",), True),
    "cells_feel_swivel": (cells_feel_swivel, "tension_N", ("swivel",), False),
    "ahrs_scale": (ahrs_scale, "roll_pitch_yaw_rad", ("roll", "pitch"), True),
    "ahrs_across": (ahrs_across, "roll_pitch_yaw_rad", ("roll", "pitch"), True),
    "ahrs_leans_with_height": (ahrs_leans_with_height, "roll_pitch_yaw_rad", ("z",), False),
    "iron_near_compass": (iron_near_compass, "roll_pitch_yaw_rad", ("x", "y", "z"), False),
}
#: What goes wrong on one cable alone.
LAWS_OF_ONE: dict[str, tuple[Law, str, tuple[str, ...], bool]] = {
    "one_drum_runs_out": (_of_one(drum_runs_out), "length_m", ("length",), True),
    "one_cable_grows": (_of_one(cable_grows), "length_m", ("time",), True),
    "one_encoder_jumps": (_of_one(encoder_jumps), "length_m", ("time",), False),
    "one_swivel_off_centre": (_of_one(swivel_off_centre), "swivel_rad", ("swivel",), True),
    "one_cell_bends": (_of_one(cells_bend), "tension_N", ("tension",), True),
    "one_cell_warms_up": (_of_one(cells_warm_up), "tension_N", ("time",), True),
    "one_cell_clips": (_of_one(cells_clip), "tension_N", ("tension", "time"), False),
    "one_cell_jumps": (_of_one(cells_jump), "tension_N", ("time",), False),
    "cells_cross_talk": (cells_cross_talk, "tension_N", ("tension", "x", "y", "z"), False),
}
CHANNELS = {
    "length_m": ("length",),
    "swivel_rad": ("swivel",),
    "tension_N": ("tension",),
    "roll_pitch_yaw_rad": ("roll", "pitch", "yaw"),
}


def law_of(name: str) -> tuple[Law, str, tuple[str, ...], bool]:
    return (LAWS | LAWS_OF_ONE)[name]


@cache
def plan_of(robot: str, poses: int) -> tuple[cdprcal.Robot, Any]:
    the_robot = cdprcal.load_robot(robot)
    grid = (3, 3, 3) if poses >= 27 else (2, 2, 2)
    result = cdprcal.make_plan(the_robot, grid=grid)
    if result.status != cdprcal.PlanStatus.planned:
        raise SystemExit(f"{robot}: no plan: {result.reason}")
    return the_robot, result.plan


def with_rest_errors(
    run: cdprcal.StartUpRun, read: dict[str, Floats], rng: np.random.Generator, source: str
) -> cdprcal.Log:
    """The log of a run whose sensors read this, with errors that stay the same over a rest."""
    time_s = np.array(run.log.time_s)
    for field, sigma in REST_SIGMA.items():
        for rest in run.rests:
            rows = (time_s >= rest.begin_s) & (time_s <= rest.end_s)
            read[field][rows] += sigma * rng.standard_normal(read[field].shape[1])
    setpoint_N = np.array(run.log.tension_setpoint_N)
    return cdprcal.Log(time_s=time_s, source=source, tension_setpoint_N=setpoint_N, **read)


def hidden_log(
    robot: str, poses: int, law: str, seed: int, run_seed: int | None = None
) -> tuple[cdprcal.Log, Any]:
    """A log with a law in it ('' for none), and the true initial pose.

    ``run_seed``: of another run of the same machine.
    """
    the_robot, plan = plan_of(robot, poses)
    rng = np.random.default_rng([seed, poses])
    run_seed = seed if run_seed is None else run_seed
    run = cdprcal.simulate_startup(the_robot, plan, seed=run_seed)
    fields = ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
    read = {field: np.array(getattr(run.log, field)) for field in fields}
    states = [cdprcal.platform_state(the_robot, pose) for pose in run.poses]
    world = World(
        np.array(run.log.time_s),
        np.array([pose.position_m for pose in run.poses]),
        np.array([state.length_m for state in states]),
        np.array([state.swivel_rad for state in states]),
        read["tension_N"].copy(),
        np.array(
            [
                cdprcal.euler_from_rotation(pose.rotation, the_robot.euler_convention)
                for pose in run.poses
            ]
        ),
    )
    if law:
        make, field, _, _ = law_of(law)
        read[field] += make(world, rng)
    rng = np.random.default_rng([run_seed, poses, 1])
    return with_rest_errors(run, read, rng, f"{law or 'clean'}-{seed}"), run.poses[0]


@dataclass
class Found:
    law: str
    seed: int
    verdict: str
    names: list[str]
    formulas: list[str]
    left: list[str]
    right: bool
    misnamed: bool
    excess_gone: float | None
    off_before: float
    off_after: float
    z_after: float


def off(pose: cdprcal.Pose, truth: cdprcal.Pose) -> Floats:
    turn = cdprcal.log_so3(pose.rotation @ truth.rotation.T)
    return np.concatenate([pose.position_m - truth.position_m, turn])


def misfit(robot: cdprcal.Robot, log: cdprcal.Log) -> float:
    """χ² of a log with what the robot file knows, all channels alike, by the rest errors."""
    options = cdprcal.DiagnoseOptions()
    options.effects = []
    gap = cdprcal.diagnose(robot, [log], options).gap
    sigma = dict(zip(("length", "swivel", "tension", "roll", "yaw"), SIGMAS, strict=True))
    of = {row.channel: row.train_rms for row in gap}
    return sum(
        (rms / next(s for name, s in sigma.items() if channel.startswith(name))) ** 2
        for channel, rms in of.items()
    )


def excess_gone(robot: str, poses: int, law: str, seed: int, d: cdprcal.Diagnosis) -> float:
    """Of what the law adds to χ² of another run, the share that the corrected robot takes off."""
    the_robot, _ = plan_of(robot, poses)
    other = seed + 50_000
    log, _ = hidden_log(robot, poses, law, seed, other)
    clean, _ = hidden_log(robot, poses, "", seed, other)
    before, least = misfit(the_robot, log), misfit(the_robot, clean)
    return (before - misfit(d.corrected, log)) / (before - least)


def try_one(robot: str, poses: int, job: tuple[str, int]) -> Found:
    law, seed = job
    log, truth = hidden_log(robot, poses, law, seed)
    the_robot, _ = plan_of(robot, poses)
    d = cdprcal.diagnose(the_robot, [log])
    described = [e for e in d.effects if e.described]
    names = [e.info.name for e in d.effects if not e.described] + [f.name for f in d.faults]
    right = False
    if law:
        _, field, on, _ = law_of(law)
        said = [e.info.name.split("_by_") for e in described]
        right = any(
            channel in CHANNELS[field] and any(v in rest.split("_") for v in on)
            for channel, rest in said
        ) or bool(ALIKE.get(law, set()) & set(names))
    gone = excess_gone(robot, poses, law, seed, d) if described and law else None
    e0, e1 = off(d.initial_pose_before, truth), off(d.initial_pose_after, truth)
    z = float(np.sqrt(e1 @ np.linalg.solve(np.array(d.covariance_after), e1)))
    return Found(
        law,
        seed,
        d.verdict.name,
        names,
        [f"{e.info.name}: {e.info.equation}" for e in described],
        [f"{u.channel}~{u.depends_on}" for u in d.unexplained],
        right,
        bool(set(names) - ALIKE.get(law, set())),
        gone,
        1e3 * float(np.linalg.norm(e0[:3])),
        1e3 * float(np.linalg.norm(e1[:3])),
        z,
    )


def jobs(count: int, first_seed: int, names: Sequence[str]) -> Iterator[tuple[str, int]]:
    for k in range(count):
        yield names[k % len(names)], first_seed + k


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=28)
    parser.add_argument("--poses", type=int, default=27, choices=(8, 27))
    parser.add_argument("--robot", default="irma4")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--clean", action="store_true")
    parser.add_argument("--one", action="store_true", help="laws of one cable alone")
    parser.add_argument("--law", action="append", choices=[*LAWS, *LAWS_OF_ONE], help="only this")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    work = partial(try_one, options.robot, options.poses)
    of_all = LAWS_OF_ONE if options.one else LAWS
    names = [""] if options.clean else options.law or [*of_all]
    todo = list(jobs(options.count, options.first_seed, names))
    results: list[Found] = []
    with ProcessPoolExecutor(options.workers) as pool:
        for found in pool.map(work, todo):
            results.append(found)
            if options.json:
                print(json.dumps(asdict(found)), flush=True)
                continue
            print(
                f"{found.law or 'clean':24}{found.seed:4} {found.verdict:12} "
                f"{'right' if found.right else '-':6}{','.join(found.names) or '-':22} "
                f"{found.off_before:6.1f} -> {found.off_after:6.1f} mm, "
                f"{found.z_after:4.1f} sigma"
                f"{'' if found.excess_gone is None else f', {found.excess_gone:.0%} gone'}; "
                f"{'; '.join(found.formulas) or '-'} | left {', '.join(found.left) or '-'}",
                flush=True,
            )

    def share(which: list[bool]) -> float:
        return sum(which) / max(1, len(results))

    gone = [r.excess_gone for r in results if r.excess_gone is not None]
    if gone:
        print(
            f"of {len(gone)} described, four fifths of the excess chi2 of another run gone in "
            f"{sum(g >= 0.8 for g in gone) / len(gone):.0%}, median {np.median(gone):.0%}"
        )
    print(
        f"{len(results)} logs: right {share([r.right for r in results]):.0%}, misnamed "
        f"{share([r.misnamed for r in results]):.0%}, consistent "
        f"{share([r.verdict == 'consistent' for r in results]):.0%}, unexplained "
        f"{share([r.verdict == 'unexplained' for r in results]):.0%}, described "
        f"{share([r.verdict == 'described' for r in results]):.0%}; pose halved or within 2 sigma "
        f"{share([r.off_after < 0.5 * r.off_before or r.z_after < 4.1 for r in results]):.0%}"
    )


if __name__ == "__main__":
    main()
