"""The platform stays in the plan's corridor, whatever the load cells say."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal import _core
from cdprcal.acquisition import Estimate, PoseGuard
from cdprcal.acquisition.remedies import remedy_for
from cdprcal.hardware.simulated import SimulatedBackend
from cdprcal.testing.altered import altered
from conftest import Cli
from guarded import start_up
from robots import small_plan

#: Low and slack: where a load cell's offset of 3 N is worth 0.2 m of height.
LOW = [[0.2, 0.2, 0.25], [-0.2, -0.2, 0.3], [0.2, -0.2, 1.2], [-0.3, 0.2, 0.2]]
LYING = ["load_cell_bias=3,3,3,3", "pulley_friction=0.03"]


def injected(texts: list[str]) -> list[cdprcal.InjectedEffect]:
    return [cdprcal.parse_injected_effect(text) for text in texts]


@pytest.fixture(scope="module")
def low_plan(robot: cdprcal.Robot) -> cdprcal.Plan:
    result = cdprcal.make_plan(robot, positions_m=[np.array(p) for p in LOW])
    assert result.status == cdprcal.PlanStatus.planned, result.reason
    return result.plan


def test_a_platform_that_is_led_away_is_stopped(
    robot: cdprcal.Robot, low_plan: cdprcal.Plan, tmp_path: Path
) -> None:
    free = start_up(robot, low_plan, tmp_path / "free.csv", injected(LYING), 2.0)
    assert free.run.state == cdprcal.StartUpState.done
    assert free.lowest_m < 0.05  # planned were 0.2 m and more
    held = start_up(robot, low_plan, tmp_path / "held.csv", injected(LYING), 0.1)
    assert held.run.state == cdprcal.StartUpState.holding
    said = re.search(
        r"leaves the plan's corridor: z = (\S+) ± (\S+) m, at the end of a stop from here (\S+) m, "
        r"where (0\.09\d) to 1\.300 m",
        held.run.reason,
    )
    assert said, held.run.reason
    now_m, _, end_m, least_m = map(float, said.groups())
    assert end_m <= least_m <= now_m  # both are said: that it is still inside, and why it stops
    assert held.excess_m < 0.02
    assert held.lowest_m > free.lowest_m


def test_the_floor(robot: cdprcal.Robot, low_plan: cdprcal.Plan, tmp_path: Path) -> None:
    held = start_up(robot, low_plan, tmp_path / "run.csv", injected(LYING), 2.0, 0.15)
    assert held.run.state == cdprcal.StartUpState.holding
    assert re.search(r"too close to the floor: .* and 0\.150 m is the limit", held.run.reason)
    assert held.lowest_m > 0.15 - 0.05


@pytest.mark.parametrize(
    ("effects", "seed"),
    [([], 1), (["load_cell_bias=4,-4,4,-4"], 2), (["pulley_friction=0.03", "mass=0.5"], 3)],
)
def test_nobody_is_stopped_within_the_corridor_and_the_sigma_is_honest(
    effects: list[str], seed: int, robot: cdprcal.Robot, tmp_path: Path
) -> None:
    path = tmp_path / "run.csv"
    ended = start_up(robot, small_plan(robot), path, injected(effects), 0.1, 0.0, seed=seed)
    assert ended.run.state == cdprcal.StartUpState.done, ended.run.reason
    assert 0.0 < ended.worst_sigmas < 3.0


def test_without_an_estimate_nothing_is_known(robot: cdprcal.Robot) -> None:
    plan = small_plan(robot)
    guard = PoseGuard(robot, plan, 0.0, 0.0)
    backend = SimulatedBackend.somewhere(robot, plan, cdprcal.SimulatorOptions(seed=1))
    assert guard.look(backend.read()) == ""
    assert guard.position_m is None


@pytest.mark.parametrize(
    ("margin_m", "floor_m", "words"),
    [
        (-0.1, 0.0, r"corridor: -0\.1 m must be 0 to 2\.3"),
        (math.nan, 0.0, "corridor: nan m must be"),
        (math.inf, 0.0, "corridor: inf m must be"),
        (2.4, 0.0, r"corridor: 2\.4 m must be"),
        (0.1, math.nan, "floor: nan m must be a height"),
        (0.1, math.inf, "floor: inf m must be a height"),
    ],
)
def test_what_guards_nothing_is_refused(
    margin_m: float, floor_m: float, words: str, robot: cdprcal.Robot
) -> None:
    with pytest.raises(cdprcal.InputError, match=words):
        PoseGuard(robot, small_plan(robot), margin_m, floor_m)


def test_a_floor_that_the_plan_goes_below_is_refused(
    robot: cdprcal.Robot, low_plan: cdprcal.Plan, cli: Cli, tmp_path: Path
) -> None:
    """By the platform's lowest point, at stops and between them; nothing has moved then."""
    points = np.array([[0, 0, 0], *(c.platform_anchor_m for c in robot.cables)])
    poses = [low_plan.start_pose, *(stop.pose for stop in low_plan.poses)]
    poses += [pose for _, pose in ways(robot, low_plan)]
    lowest_m = min(float((p.position_m + points @ p.rotation.T)[:, 2].min()) for p in poses)
    PoseGuard(robot, low_plan, 0.1, lowest_m - 1e-6)
    with pytest.raises(cdprcal.InputError, match=r"floor: .* is above z = .* plan higher poses"):
        PoseGuard(robot, low_plan, 0.1, lowest_m + 1e-6)
    plan, log = tmp_path / "plan.csv", tmp_path / "run.csv"
    plan.write_text(cdprcal.format_plan(low_plan))
    ran = cli("acquire", "irma4", plan, "-o", log, "--floor-m", "1.2")
    ran.refused("floor: 1.2 m is above z = 0.")
    assert not log.exists()


def test_both_reasons_have_a_remedy() -> None:
    corridor = remedy_for("the platform leaves the plan's corridor: z = …")
    # Load cells that lie, an encoder that counts backwards, an AHRS askew: all lead away.
    assert all(word in corridor for word in ("load cells", "encoders", "AHRS", "--corridor-m"))
    assert "--floor-m" in remedy_for("the platform comes too close to the floor: its …")


def test_the_command(cli: Cli, low_plan: cdprcal.Plan, tmp_path: Path) -> None:
    plan, log = tmp_path / "plan.csv", tmp_path / "run.csv"
    plan.write_text(cdprcal.format_plan(low_plan))
    effects = [word for text in LYING for word in ("--effect", text)]
    ran = cli("acquire", "irma4", plan, "--quick", "-o", log, "--json", *effects)
    assert "leaves the plan's corridor: z" in ran.document(1)["reason"]
    for corridor in ("-1", "nan"):
        ran = cli("acquire", "irma4", plan, "-o", tmp_path / "no.csv", f"--corridor-m={corridor}")
        ran.refused(f"corridor: {corridor} m must be 0 to 2.31 m")
        assert ran.stderr.endswith("; give a --corridor-m within that\n")


# --- the tracking itself, on exact readings ------------------------------------------------------

YAW_RAD = 0.7  # of the AHRS's own north


def readings(robot: cdprcal.Robot, pose: cdprcal.Pose, time_s: float) -> cdprcal.RobotSample:
    """What sensors say at a pose: relative lengths, swivels and yaw."""
    state = cdprcal.platform_state(robot, pose)
    sample = cdprcal.RobotSample(time_s=time_s)
    sample.length_m = state.length_m + np.array([3.0, -1.0, 0.5, 2.0])
    sample.swivel_rad = state.swivel_rad + np.array([0.3, -0.2, 0.1, 0.4])
    angles = cdprcal.euler_from_rotation(pose.rotation, robot.euler_convention)
    sample.roll_pitch_yaw_rad = angles + np.array([0.0, 0.0, YAW_RAD])
    return sample


def without_swivels(sample: cdprcal.RobotSample) -> None:
    sample.swivel_rad = np.empty(0)


def without_attitude(sample: cdprcal.RobotSample) -> None:
    sample.roll_pitch_yaw_rad = np.full(3, math.nan)


def with_half_an_attitude(sample: cdprcal.RobotSample) -> None:
    sample.roll_pitch_yaw_rad = np.array([math.nan, *sample.roll_pitch_yaw_rad[1:]])


def without_a_cable(sample: cdprcal.RobotSample) -> None:
    sample.length_m = np.array([*sample.length_m[:3], math.nan])


def untouched(sample: cdprcal.RobotSample) -> None:
    pass


def known(pose: cdprcal.Pose | None, covariance: np.ndarray | None) -> Estimate:
    return Estimate(0.0, 1, "converged", "", 0.0, 0.0, "", pose, covariance, False)


def tracked(
    robot: cdprcal.Robot, *, deviation_m: float = 1e-6, margin_m: float = 1.0
) -> tuple[PoseGuard, cdprcal.Pose]:
    """A guard that knows the initial pose, which is that of τ0."""
    plan = small_plan(robot)
    guard = PoseGuard(robot, plan, margin_m)
    guard.look(readings(robot, plan.start_pose, 0.0))
    guard.learn(known(plan.start_pose, deviation_m**2 * np.eye(6)))
    return guard, plan.start_pose


@pytest.mark.parametrize(
    "first", [untouched, without_swivels, without_attitude, with_half_an_attitude]
)
@pytest.mark.parametrize(
    "then",
    [untouched, without_swivels, without_attitude, without_a_cable, with_half_an_attitude],
)
def test_it_follows_by_whatever_sensors_there_are(
    first: Callable[[cdprcal.RobotSample], None],
    then: Callable[[cdprcal.RobotSample], None],
    robot: cdprcal.Robot,
) -> None:
    """Half a second of translation and rotation, exact readings: to a tenth of a millimetre."""
    plan = small_plan(robot)
    guard = PoseGuard(robot, plan, 1.0)
    pose = cdprcal.plus(plan.start_pose, np.array([0, 0, 0, 0, 0, 0.3]))
    begin = readings(robot, pose, 0.0)
    first(begin)
    guard.look(begin)
    guard.learn(known(pose, 1e-12 * np.eye(6)))
    for k in range(1, 26):
        pose = cdprcal.plus(pose, np.array([0.004, -0.003, 0.002, 0.004, -0.003, 0.006]))
        sample = readings(robot, pose, 0.02 * k)
        then(sample)
        assert guard.look(sample) == ""
    no_swivels = without_swivels in (first, then)
    no_attitude = {first, then} & {without_attitude, with_half_an_attitude}
    if no_swivels and no_attitude:
        assert guard.position_m is None  # four lengths for six unknowns
    else:
        assert guard.position_m is not None
        np.testing.assert_allclose(guard.position_m, pose.position_m, atol=1e-4)


def test_swivels_that_pass_half_a_turn_move_nothing(robot: cdprcal.Robot) -> None:
    """Encoders that wrap, one that counts turns: the platform is where it was."""
    guard, begin = tracked(robot)
    moved = cdprcal.plus(begin, np.array([0.004, -0.003, 0.002, 0, 0, 0]))
    for k, turns in enumerate(([0, 0, 0, 0], [1, 0, 0, -1], [0, 1, -2, 0]), 1):
        sample = readings(robot, moved, 0.02 * k)
        sample.swivel_rad = sample.swivel_rad + 2.0 * math.pi * np.array(turns)
        assert guard.look(sample) == ""
        assert guard.position_m is not None
        np.testing.assert_allclose(guard.position_m, moved.position_m, atol=1e-4)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_robot_whose_swivels_pass_half_a_turn_is_not_stopped(seed: int, tmp_path: Path) -> None:
    hang4 = cdprcal.load_robot("hang4")
    plan = cdprcal.make_plan(hang4).plan
    ended = start_up(hang4, plan, tmp_path / "run.csv", [], 0.1, seed=seed)
    assert ended.run.state == cdprcal.StartUpState.done, ended.run.reason


@pytest.mark.parametrize("unknown", [range(6), range(3), [3], [4], [5]])
def test_its_sigma_is_that_of_the_estimate_and_of_the_readings_since(
    unknown: Sequence[int], robot: cdprcal.Robot
) -> None:
    """Error propagation written out: HᵀH δ = Hᵀ (H0 δ0 + ε), attitude absolute but for yaw, small
    angles."""
    guard, begin = tracked(robot)
    initial = np.zeros((6, 6))
    initial[unknown, unknown] = 0.003**2
    guard.learn(known(begin, initial))
    pose = cdprcal.plus(begin, np.array([0.02, 0.01, -0.02, 0.02, 0.03, 0.02]))
    guard.look(readings(robot, pose, 0.02))
    sigma = robot.sigma

    def rows(at: cdprcal.Pose, absolute: bool) -> np.ndarray:
        state = cdprcal.platform_state(robot, at)
        attitude = np.zeros((3, 6))
        attitude[2, 5] = 1.0
        if absolute:
            attitude[:, 3:] = np.eye(3)
        return np.vstack([
            cdprcal.length_jacobian(state) / sigma.length_m,
            cdprcal.swivel_jacobian(state) / sigma.swivel_rad,
            attitude / sigma.attitude_rad,
        ])  # fmt: skip

    now, then = rows(pose, True), rows(begin, False)
    inverse = np.linalg.inv(now.T @ now)
    passed_on = inverse @ now.T @ then
    covariance = passed_on @ initial @ passed_on.T + inverse
    np.testing.assert_allclose(guard.sigma_m, np.sqrt(np.diag(covariance)[:3]), rtol=1e-3)


# --- the corridor --------------------------------------------------------------------------------


def ways(robot: cdprcal.Robot, plan: cdprcal.Plan) -> list[tuple[np.ndarray, cdprcal.Pose]]:
    """Tensions between the stops of a plan, in eighths, and the pose that they hold."""
    stops = [(plan.start_pose, plan.start_tension_N), *((s.pose, s.tension_N) for s in plan.poses)]
    found = []
    for (pose, from_N), (_, to_N) in itertools.pairwise(stops):
        at = pose
        for k in range(1, 8):
            tension_N = (1.0 - k / 8.0) * from_N + k / 8.0 * to_N
            held = cdprcal.direct_from_tensions(robot, tension_N, at).pose
            assert held is not None
            at = held
            found.append((tension_N, held))
    return found


def test_the_corridor_spans_what_is_passed_on_the_way(
    robot: cdprcal.Robot, low_plan: cdprcal.Plan
) -> None:
    guard = PoseGuard(robot, low_plan, 0.1)
    stops_m = np.array(
        [low_plan.start_pose.position_m, *(s.pose.position_m for s in low_plan.poses)]
    )
    all_m = np.vstack([stops_m, *(pose.position_m for _, pose in ways(robot, low_plan))])
    np.testing.assert_allclose(guard.lower_m, all_m.min(axis=0), atol=1e-6)
    np.testing.assert_allclose(guard.upper_m, all_m.max(axis=0), atol=1e-6)
    assert (guard.lower_m < stops_m.min(axis=0) - 0.003).any()  # the stops alone would not do


@pytest.mark.parametrize("fails", ["pose", "status"])
def test_a_way_that_leads_nowhere_ends_there(
    fails: str, robot: cdprcal.Robot, low_plan: cdprcal.Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every third pose on the way cannot be found: the rest of that way is not looked at."""
    stops_m = [low_plan.start_pose.position_m, *(s.pose.position_m for s in low_plan.poses)]
    seen_m = [pose.position_m for k, (_, pose) in enumerate(ways(robot, low_plan)) if k % 7 < 2]
    real, calls = cdprcal.direct_from_tensions, itertools.count(1)

    def sometimes(*arguments: Any) -> Any:
        found = real(*arguments)
        if next(calls) % 3:
            return found
        assert found.pose is not None
        away = cdprcal.plus(found.pose, np.array([9.0, 9.0, -9.0, 0, 0, 0]))
        lost = {"pose": (None, found.status), "status": (away, _core.EquilibriumStatus.not_found)}
        return SimpleNamespace(**dict(zip(("pose", "status"), lost[fails], strict=True)))

    monkeypatch.setattr(_core, "direct_from_tensions", sometimes)
    guard = PoseGuard(robot, low_plan, 0.1)
    all_m = np.array([*stops_m, *seen_m])
    np.testing.assert_allclose(guard.lower_m, all_m.min(axis=0), atol=1e-6)
    np.testing.assert_allclose(guard.upper_m, all_m.max(axis=0), atol=1e-6)


def test_a_margin_may_be_as_wide_as_the_frame_and_no_wider(robot: cdprcal.Robot) -> None:
    pulleys_m = np.array([cable.pulley.position_m for cable in robot.cables])
    most_m = float(np.ptp(pulleys_m, axis=0).max())
    plan = small_plan(robot)
    for margin_m in (0.0, most_m):
        PoseGuard(robot, plan, margin_m)
    with pytest.raises(cdprcal.InputError, match="what the pulleys span"):
        PoseGuard(robot, plan, most_m * (1.0 + 1e-9))


def test_the_margin_grows_with_the_ways(robot: cdprcal.Robot) -> None:
    """A robot ten times as large goes ten times as far, and swings past its stops in proportion."""
    plan = small_plan(robot)
    assert PoseGuard(robot, plan).margin_m == 0.1
    yaml = cdprcal.to_yaml(robot)
    large = cdprcal.parse_robot(
        re.sub(
            r"position_m: \[(.*?)\]",
            lambda m: f"position_m: [{', '.join(str(10 * float(v)) for v in m[1].split(','))}]",
            yaml,
        ),
        "large.yaml",
    )
    far = cdprcal.make_plan(large, positions_m=[np.array([2, 2, 8]), np.array([-2, -2, 8])]).plan
    places_m = [far.start_pose.position_m, *(stop.pose.position_m for stop in far.poses)]
    longest_m = max(float(np.linalg.norm(b - a)) for a, b in itertools.pairwise(places_m))
    assert longest_m > 5.0
    assert PoseGuard(large, far).margin_m == pytest.approx(0.05 * longest_m)
    assert PoseGuard(large, far, 0.1).margin_m == 0.1


def test_a_way_that_the_plan_does_not_take_is_admitted(
    robot: cdprcal.Robot, low_plan: cdprcal.Plan
) -> None:
    """Past a place that no stop is near, and back: what hangs between counts."""
    plan = small_plan(robot)
    guard = PoseGuard(robot, plan, 0.1)
    low_m, high_m = guard.lower_m, guard.upper_m
    last, aside = plan.poses[-1], low_plan.poses[1]
    passed_N = [last.tension_N, aside.tension_N, plan.poses[0].tension_N]
    at, held_m = last.pose, []
    for from_N, to_N in itertools.pairwise(passed_N):
        for share in np.arange(1, 9) / 8:
            found = cdprcal.direct_from_tensions(robot, from_N + share * (to_N - from_N), at).pose
            assert found is not None
            at = found
            held_m.append(at.position_m)
    guard.admit(last.pose, last.tension_N, cdprcal.StartUpPlan(passed_N[1:]))
    np.testing.assert_allclose(guard.lower_m, np.min([low_m, *held_m], axis=0), atol=1e-6)
    np.testing.assert_allclose(guard.upper_m, np.max([high_m, *held_m], axis=0), atol=1e-6)
    assert (guard.lower_m < low_m - 0.1).any()
    before_m = guard.lower_m
    guard.admit(last.pose, last.tension_N, cdprcal.StartUpPlan([]))  # no way
    np.testing.assert_array_equal(guard.lower_m, before_m)


def test_a_way_by_lengths_is_admitted_as_it_is_led() -> None:
    robot = cdprcal.load_robot("hang4")
    plan = cdprcal.make_plan(robot).plan
    guard = PoseGuard(robot, plan, 0.05)
    there = cdprcal.plus(plan.start_pose, np.array([0, 0, -0.9, 0, 0, 0]))
    way = cdprcal.StartUpPlan([plan.start_tension_N], pose=[there])
    guard.admit(plan.start_pose, plan.start_tension_N, way)
    assert guard.lower_m[2] == there.position_m[2]


# --- what it knows -------------------------------------------------------------------------------


def test_it_looks_fifty_times_a_second_and_no_more(robot: cdprcal.Robot) -> None:
    guard, begin = tracked(robot)
    guard.look(readings(robot, begin, 0.02))
    moved = cdprcal.plus(begin, np.array([0.001, 0, 0, 0, 0, 0]))
    for time_s, followed in ((0.03, False), (0.039, False), (0.04, True)):
        guard.look(readings(robot, moved, time_s))
        assert guard.position_m is not None
        where_m = (moved if followed else begin).position_m
        np.testing.assert_allclose(guard.position_m, where_m, atol=1e-5)


@pytest.mark.parametrize("velocity_m_s", [0.05, 0.2])
def test_it_stops_where_a_hold_still_ends_inside(velocity_m_s: float, robot: cdprcal.Robot) -> None:
    """0.1 s ahead; the box reaches to z = 1.0 m and 0.1 m of margin, σ is below a third of that."""
    guard, pose = tracked(robot, margin_m=0.1)
    for k in range(1, 1000):
        pose = cdprcal.plus(pose, np.array([0, 0, 0.02 * velocity_m_s, 0, 0, 0]))
        said = guard.look(readings(robot, pose, 0.02 * k))
        if said:
            break
    assert "leaves the plan's corridor: z = " in said
    ahead_m = 1.1 - pose.position_m[2]
    assert 0.1 * velocity_m_s - 0.02 * velocity_m_s - 1e-3 < ahead_m <= 0.1 * velocity_m_s + 1e-3


@pytest.mark.parametrize(("beyond_m", "stopped"), [(0.28, False), (0.33, True)])
def test_three_sigma_stand_in_place_of_a_smaller_margin(
    beyond_m: float, stopped: bool, robot: cdprcal.Robot
) -> None:
    """0.1 m each way, nearly as much of it along z, of which readings add a hundredth."""
    guard, begin = tracked(robot, deviation_m=0.0, margin_m=0.1)
    guard.learn(known(begin, np.diag([0.01, 0.01, 0.01, 0.0, 0.0, 0.0])))
    guard.look(readings(robot, begin, 0.02))
    share = beyond_m / (3.0 * guard.sigma_m[2]) * 0.3
    target_m = 1.0 + share / 0.3 * 3.0 * guard.sigma_m[2]
    up = np.array([0, 0, target_m - begin.position_m[2], 0, 0, 0])
    guard.learn(known(begin, np.diag([0.01, 0.01, 0.01, 0.0, 0.0, 0.0])))  # many steps, no speed
    said = guard.look(readings(robot, cdprcal.plus(begin, up), 0.04))
    assert (beyond_m > 3.0 * guard.sigma_m[2]) == stopped
    assert bool(said) == stopped


def test_what_is_no_estimate_changes_nothing(robot: cdprcal.Robot) -> None:
    plan = small_plan(robot)
    guard = PoseGuard(robot, plan, 0.1)
    guard.look(readings(robot, plan.start_pose, 0.0))
    for pose, covariance in ((None, np.eye(6)), (plan.start_pose, None), (None, None)):
        guard.learn(known(pose, covariance))
        assert guard.look(readings(robot, plan.start_pose, 0.02)) == ""
        assert guard.position_m is None
    guard.learn(replace(known(plan.start_pose, np.eye(6)), trusted=False))
    assert guard.look(readings(robot, plan.start_pose, 0.03)) == ""
    assert guard.position_m is None
    guard.learn(known(plan.start_pose, 1e-12 * np.eye(6)))
    guard.look(readings(robot, plan.start_pose, 0.02))
    assert guard.position_m is not None
    # And takes nothing away from what is known.
    for pose, covariance in ((None, np.eye(6)), (plan.start_pose, None)):
        guard.learn(known(pose, covariance))
    moved = cdprcal.plus(plan.start_pose, np.array([0.001, 0, 0, 0, 0, 0]))
    guard.look(readings(robot, moved, 0.04))
    np.testing.assert_allclose(guard.position_m, moved.position_m, atol=1e-5)
    assert (guard.sigma_m < 0.1).all()


def test_a_new_estimate_moves_the_platform_but_is_no_speed(robot: cdprcal.Robot) -> None:
    """0.5 m away at once: as a speed it would end far outside."""
    guard, begin = tracked(robot, margin_m=0.5)
    guard.look(readings(robot, begin, 0.02))
    away = cdprcal.plus(begin, np.array([0.2, 0.2, 0.2, 0, 0, 0]))
    guard.learn(known(away, 1e-12 * np.eye(6)))
    assert guard.look(readings(robot, begin, 0.04)) == ""
    assert guard.position_m is not None
    np.testing.assert_allclose(guard.position_m, away.position_m, atol=1e-4)
    assert guard.look(readings(robot, begin, 0.06)) == ""


def test_noise_of_the_place_is_no_speed(robot: cdprcal.Robot) -> None:
    """5 mm to and fro at every look, 0.05 m from the edge: from look to look that is 0.5 m/s."""
    guard, begin = tracked(robot, margin_m=0.1)
    up_m = guard.upper_m[2] + 0.05 - begin.position_m[2]
    for k in range(1, 20):
        near = cdprcal.plus(begin, np.array([0, 0, up_m + 0.005 * (-1) ** k, 0, 0, 0]))
        guard.learn(known(begin, 1e-12 * np.eye(6))) if k == 1 else None
        assert guard.look(readings(robot, near, 0.02 * k)) == ""


def test_the_floor_is_for_the_lowest_point_of_a_platform_that_tilts(robot: cdprcal.Robot) -> None:
    plan = small_plan(robot)
    # Below what the plan goes down to, so that the floor may be there.
    tilted = cdprcal.plus(plan.start_pose, np.array([0, 0, -0.2, 1.6, 0, 0]))
    points = np.array([[0, 0, 0], *(c.platform_anchor_m for c in robot.cables)])
    lowest_m = float((tilted.position_m + points @ tilted.rotation.T)[:, 2].min())
    assert lowest_m < tilted.position_m[2] - 0.05  # an anchor
    for floor_m, stopped in ((lowest_m - 1e-3, False), (lowest_m + 1e-3, True)):
        guard = PoseGuard(robot, plan, 2.0, floor_m)
        guard.look(readings(robot, tilted, 0.0))
        guard.learn(known(tilted, 1e-12 * np.eye(6)))
        assert bool(guard.look(readings(robot, tilted, 0.02))) == stopped
    guard = PoseGuard(robot, plan, 2.0)  # no floor
    guard.look(readings(robot, tilted, 0.0))
    guard.learn(known(tilted, 1e-12 * np.eye(6)))
    assert guard.look(readings(robot, tilted, 0.02)) == ""


def test_what_the_robot_file_says_is_in_the_way_stops_too(robot: cdprcal.Robot) -> None:
    plan = small_plan(robot)
    here = plan.start_pose
    box = cdprcal.Box(here.position_m - 0.02, here.position_m + 0.02)
    for around, said in (
        (cdprcal.Surroundings(keep_out=[box]), "in keep_out[#1]"),
        (cdprcal.Surroundings(floor_m=float(here.position_m[2]) + 0.5), "too close to the floor"),
        (cdprcal.Surroundings(length_limits_m=(0.0, 0.1)), "length_limits_m"),
    ):
        guard = PoseGuard(altered(robot, surroundings=around), plan, 2.0)
        guard.look(readings(robot, here, 0.0))
        guard.learn(known(here, 1e-12 * np.eye(6)))
        reason = guard.look(readings(robot, here, 0.02))
        assert said in reason
        assert remedy_for(reason)


@pytest.mark.parametrize(
    ("name", "away"), [("belts4", [0.02, 0, 0.01]), ("hang4", [0.01, 0.02, 0])]
)
def test_lengths_alone_lead_it_where_guides_hold_the_rest(name: str, away: list[float]) -> None:
    """Four lengths for two and three freedoms: the motion ends in time."""
    robot = cdprcal.load_robot(name)
    plan = cdprcal.make_plan(robot).plan
    guard = PoseGuard(robot, plan, 0.05)
    pose = plan.start_pose

    def lengths(time_s: float) -> cdprcal.RobotSample:
        sample = cdprcal.RobotSample(time_s=time_s)
        sample.length_m = cdprcal.platform_state(robot, pose).length_m - 1.0
        return sample

    guard.look(lengths(0.0))
    guard.learn(known(pose, 1e-12 * np.eye(6)))
    said = ""
    for k in range(1, 200):
        pose = cdprcal.plus(pose, np.array([*away, 0, 0, 0]))
        said = guard.look(lengths(0.02 * k))
        if said:
            break
        assert guard.position_m is not None
        np.testing.assert_allclose(guard.position_m, pose.position_m, atol=1e-4)
    assert "leaves the plan's corridor" in said
    assert (pose.position_m <= guard.upper_m + 0.05 + np.abs(away)).all()
