"""What diagnose makes of pulls that the catalogue's equations are not: springs to a post; of loads
that shift; and of what parts the first rest from all others: brakes that let go, and platforms that
stand on something.

``python tests/studies/pulls.py [--count 6]`` prints for each robot and pull how many were named,
what else was, and the largest error of a coordinate of the initial pose in its σ, that of any log
and of those that `diagnose` explains. A post stands at random beside the robot; its spring has a
natural length, pulls off the centre of mass, and is as stiff as pulls by a share of the weight.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import cdprcal

ROBOTS = ("ring3", "irma4", "ring5", "posts8")
#: Of the weight, what the spring pulls by at the middle of the set-points.
SHARES = (0.03, 0.1)


def spring_to_a_post(
    robot: cdprcal.Robot, plan: cdprcal.StartUpPlan, share: float, rng: np.random.Generator
) -> tuple[cdprcal.Robot, cdprcal.InjectedEffect]:
    """The robot with the effect ``post`` as text: in the plant, but not in the catalogue."""
    places = np.array([pulley_of(cable) for cable in robot.cables])
    middle, reach = places.mean(axis=0), np.ptp(places, axis=0).max()
    turn = rng.uniform(0.0, 2.0 * np.pi)
    post = middle + reach * np.array([np.cos(turn), np.sin(turn), rng.uniform(-0.5, 0.5)])
    anchors = np.array([np.asarray(cable.platform_anchor_m) for cable in robot.cables])
    arm = anchors.std() * rng.standard_normal(3)
    natural_m = rng.uniform(0.3, 0.6) * reach
    stiffness_N_m = share * robot.weight_N / (reach - natural_m)
    to_post = [f"({p:.6f} - {axis}_m)" for p, axis in zip(post, "xyz", strict=True)]
    distance = "sqrt(" + " + ".join(f"{t} ^ 2" for t in to_post) + ")"
    force = [f"stiffness_N_m * (1 - {natural_m:.6f} / {distance}) * {t}" for t in to_post]
    adds = {f"force_{axis}_N": f for axis, f in zip("xyz", force, strict=True)}
    for k, axis in enumerate("xyz"):
        i, j = (k + 1) % 3, (k + 2) % 3
        adds[f"moment_{axis}_Nm"] = f"{arm[i]:.6f} * {force[j]} - {arm[j]:.6f} * {force[i]}"
    text = "effect_definitions:\n  - name: post\n    scope: run\n    parameters:\n"
    text += "      stiffness_N_m: {typical: 1, plausible: 1000}\n    adds:\n"
    text += "".join(f"      {to}: {formula}\n" for to, formula in adds.items())
    hidden = cdprcal.with_effect_definitions(robot, text, "post.yaml")
    return hidden, cdprcal.InjectedEffect("post", [stiffness_N_m])


def pulley_of(cable: cdprcal.Cable) -> NDArray[np.float64]:
    return np.asarray(cable.pulley.position_m)


@dataclass(frozen=True)
class Hidden:
    """What a start-up has that the catalogue's equations are not."""

    wanted: str  #: its name, where it has one
    robot: cdprcal.Robot
    effects: tuple[cdprcal.InjectedEffect, ...] = ()
    readings: Callable[[cdprcal.Log, NDArray[np.bool_]], cdprcal.Log] | None = None
    """The log as it is read; True marks the samples before the first move."""


Make = Callable[[cdprcal.Robot, cdprcal.StartUpPlan, np.random.Generator], Hidden]


def spring(share: float) -> Make:
    def make(robot: cdprcal.Robot, plan: cdprcal.StartUpPlan, rng: np.random.Generator) -> Hidden:
        hidden, effect = spring_to_a_post(robot, plan, share, rng)
        return Hidden("umbilical", hidden, (effect,))

    return make


def load_shift(robot: cdprcal.Robot, plan: cdprcal.StartUpPlan, rng: np.random.Generator) -> Hidden:
    shift = 0.15 * cdprcal.characteristic_length_m(robot) * rng.standard_normal(3)
    mass_kg = 0.1 * robot.platform.mass_kg * rng.standard_normal()
    values = [rng.uniform(20.0, 90.0), mass_kg, *shift]
    return Hidden("load_shift", robot, (cdprcal.InjectedEffect("load_shift", values),))


def brakes(robot: cdprcal.Robot, plan: cdprcal.StartUpPlan, rng: np.random.Generator) -> Hidden:
    """All cables slip as the brakes let go, and the encoders do not see it."""
    slip_m = 0.002 * np.ptp([pulley_of(cable) for cable in robot.cables], axis=0).max()
    slips_m = slip_m * rng.uniform(0.5, 1.5, len(robot.cables))

    def readings(log: cdprcal.Log, first: NDArray[np.bool_]) -> cdprcal.Log:
        return changed(log, length_m=log.length_m - np.outer(~first, slips_m))

    return Hidden("cable_slip", robot, readings=readings)


def stand(robot: cdprcal.Robot, plan: cdprcal.StartUpPlan, rng: np.random.Generator) -> Hidden:
    """The cables carry less than the platform weighs until it is lifted off what it stands on."""
    carried = rng.uniform(0.7, 0.95, len(robot.cables))

    def readings(log: cdprcal.Log, first: NDArray[np.bool_]) -> cdprcal.Log:
        return changed(log, tension_N=log.tension_N * np.where(first[:, None], carried, 1.0))

    return Hidden("contact", robot, readings=readings)


def changed(log: cdprcal.Log, **arrays: NDArray[np.float64]) -> cdprcal.Log:
    names = ("length_m", "swivel_rad", "tension_N", "tension_setpoint_N", "roll_pitch_yaw_rad")
    kept = {name: getattr(log, name) for name in names}
    return cdprcal.Log(time_s=log.time_s, source=log.source, **kept | arrays)


def before_the_first_move(run: cdprcal.StartUpRun) -> NDArray[np.bool_]:
    position_m = np.array([truth.pose.position_m for truth in run.truth])
    moved_m = np.linalg.norm(position_m - position_m[0], axis=1)
    first: NDArray[np.bool_] = np.logical_and.accumulate(moved_m < 5e-3)
    return first


CASES: dict[str, Make] = {
    **{f"spring to a post, {share:.0%} of the weight": spring(share) for share in SHARES},
    "load shift": load_shift,
    "brakes that let go": brakes,
    "stands on something": stand,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=6, help="start-ups for each")
    count = parser.parse_args().count
    print("| robot | hidden | named | also | largest error, of those explained [σ] |")
    print("|---|---|---|---|---|")
    for name in ROBOTS:
        robot = cdprcal.load_robot(name)
        plan = cdprcal.StartUpPlan(cdprcal.default_setpoints(robot, 3, 3, 2))
        for what, make in CASES.items():
            right, also, largest, explained = 0, Counter[str](), 0.0, 0.0
            for seed in range(count):
                hidden = make(robot, plan, np.random.default_rng([seed, len(robot.cables)]))
                options = cdprcal.SimulatorOptions(seed=seed)
                run = cdprcal.simulate_startup(
                    hidden.robot, plan, simulator=options, effects=hidden.effects, log_rate_Hz=10.0
                )
                log = run.log
                if hidden.readings:
                    log = hidden.readings(log, before_the_first_move(run))
                found = cdprcal.diagnose(robot, [log])
                names = [e.info.name for e in found.effects]
                right += hidden.wanted in names
                also.update(n for n in names if n != hidden.wanted)
                error = np.asarray(cdprcal.minus(run.truth[0].pose, found.initial_pose_after))
                off = float(np.abs(error / np.sqrt(np.diag(found.covariance_after))).max())
                largest = max(largest, off)
                if found.verdict != cdprcal.Verdict.unexplained:
                    explained = max(explained, off)
            beside = ", ".join(f"{n} × {k}" for n, k in also.most_common())
            print(
                f"| {name} | {what} | {right} of {count} | {beside} "
                f"| {largest:.1f}, {explained:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
