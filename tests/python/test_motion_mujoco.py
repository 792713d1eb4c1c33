"""A platform that never rests, moved by MuJoCo: nothing of the plant is the package's own."""

from __future__ import annotations

import json
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal import _core
from conftest import Cli, few, samples_of
from mujoco_swing import MISREAD, Hidden, Swing, late, misread, swing
from robots import polygon_robot

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed (the test extra has it)")

ROBOT = polygon_robot(5, pulley_radius_m=0.0)


#: Several tests ask for the same swing; none changes its log.
swung = cache(partial(swing, mujoco, ROBOT))


@pytest.fixture(scope="module")
def hauled() -> Swing:
    """Round a circle of 60 mm, swinging by 2 degrees of yaw at 1.5 Hz."""
    return swung(seed=1, duration_s=15.0)


@pytest.fixture(scope="module")
def found(hauled: Swing) -> cdprcal.Calibration:
    return cdprcal.calibrate(ROBOT, hauled.log, motion=True)


def test_its_initial_pose_is_found(hauled: Swing, found: cdprcal.Calibration) -> None:
    assert not found.equilibria, "it never rests"
    assert found.result.status == cdprcal.CalibrationStatus.converged
    assert found.kinematic_poses > 50
    error = cdprcal.minus(found.result.poses[0], hauled.poses[0])
    assert np.all(np.abs(error) < 4.0 * found.result.standard_deviation)
    assert np.linalg.norm(error[:3]) < 0.02


def test_the_balance_in_motion_tells_what_its_moving_readings_leave_open(
    hauled: Swing, found: cdprcal.Calibration
) -> None:
    plain = _core.calibrate(ROBOT, hauled.log).result
    assert plain.status == cdprcal.CalibrationStatus.unobservable
    assert np.all(found.result.standard_deviation[:3] < 0.001)


def test_what_effects_may_do_widens_its_pose_and_does_not_move_it() -> None:
    run = swung(seed=802, duration_s=20.0, kick=0.15)
    allowed = cdprcal.calibrate(ROBOT, run.log, motion=True).result
    fitted = _core.calibrate_in_motion(
        ROBOT, run.log, _core.CalibrateOptions(allow_for_effects=False)
    ).calibration.result
    error = cdprcal.minus(allowed.poses[0], run.poses[0])
    assert np.linalg.norm(error[:3]) < 0.003
    assert np.linalg.norm(cdprcal.minus(allowed.poses[0], fitted.poses[0])[:3]) < 1e-4
    assert np.all(allowed.standard_deviation >= fitted.standard_deviation)
    assert np.all(np.abs(error) < 4.0 * allowed.standard_deviation)


def test_a_vague_start_is_no_reason_to_lag_behind() -> None:
    """What is not known of the start lasts; what swings is motion. Five seconds tell little of the
    start, yet the platform turns as it does."""
    run = swing(mujoco, ROBOT, seed=0, duration_s=5.0)
    vague = _core.calibrate_in_motion(ROBOT, run.log).calibration
    track = _core.track(vague, run.log)
    time_s = track.time_s
    rotations = np.array([pose.rotation for pose in run.poses])
    # Angular velocity about the vertical: R(t+h) R(t-h)' over 2 h.
    steps = rotations[2:] @ rotations[:-2].transpose(0, 2, 1)
    true_rad_s = steps[:, 1, 0] / (time_s[2:] - time_s[:-2])
    late = time_s[1:-1] > 0.5
    error = (track.twist[1:-1, 5] - true_rad_s)[late]
    assert np.sqrt(np.mean(error**2)) < 0.5 * np.sqrt(np.mean(true_rad_s[late] ** 2))


@pytest.mark.parametrize("cables", few([3, 4]))
def test_locked_winches_let_it_swing_as_fast_as_the_model_says(cables: int) -> None:
    robot = polygon_robot(cables, pulley_radius_m=0.0)
    run = swing(mujoco, robot, seed=2, duration_s=20.0, haul_m=0.0, kick=0.15)
    modes = _core.calibrate_in_motion(robot, run.log).swings
    measured = [mode for mode in modes if np.isfinite(mode.measured_hz)]
    assert len(modes) == 6 - cables
    assert len(measured) >= 2
    for mode in measured:
        assert abs(mode.measured_hz / mode.model_hz - 1.0) < 0.02


def test_a_hand_that_pushes_is_noticed_and_what_it_does_left_out() -> None:
    robot = polygon_robot(3, pulley_radius_m=0.0)
    times_s = ((4.0, 7.0), (12.0, 15.0))
    hidden = Hidden(pushed_s=times_s)
    run = swing(mujoco, robot, hidden, seed=803, duration_s=20.0, haul_m=0.0, kick=0.15)
    found = _core.calibrate_in_motion(robot, run.log)
    assert len(found.pushes) == 2
    for push, (begin_s, end_s) in zip(found.pushes, times_s, strict=True):
        assert abs(push.begin_s - begin_s) < 1.5
        assert abs(push.end_s - end_s) < 1.5
        assert push.after_J > 2.0 * push.before_J
    result = found.calibration.result
    assert "something pushes the platform at" in result.reason
    error = cdprcal.minus(result.poses[0], run.poses[0])
    assert np.all(np.abs(error) < 4.0 * result.standard_deviation)
    diagnosis = cdprcal.diagnose(robot, run.log, motion=True)
    assert not diagnosis.effects
    assert any("something pushes it there" in text for text in diagnosis.gated)
    alone = swing(mujoco, robot, seed=803, duration_s=20.0, haul_m=0.0, kick=0.15)
    assert not _core.calibrate_in_motion(robot, alone.log).pushes


HIDDEN = {
    "mass": Hidden(mass_kg=0.6),
    "load_cell_bias": Hidden(bias_N=np.array([5.0, -4.0, 0.0, 3.0, -5.0])),
    "centre_of_mass": Hidden(centre_of_mass_m=np.array([0.01, 0.008, 0.0])),
    "ahrs_misalignment": Hidden(misalignment_rad=np.array([0.02, -0.015, 0.0])),
}


@pytest.mark.parametrize("name", few(HIDDEN, kept=2))
def test_what_is_hidden_is_named_though_it_never_rests(name: str) -> None:
    run = swing(mujoco, ROBOT, HIDDEN[name], seed=2, duration_s=20.0, kick=0.15)
    found = cdprcal.diagnose(ROBOT, run.log, motion=True)
    assert name in [n for e in found.effects for n in (e.info.name, *e.rivals)]
    error = cdprcal.minus(found.initial_pose_after, run.poses[0])
    assert np.all(np.abs(error) < 4.0 * np.sqrt(np.diag(found.covariance_after)))


FINE = cdprcal.SensorSigma(length_m=3e-4, swivel_rad=2e-3, attitude_rad=3e-3, tension_N=0.6)


@pytest.mark.parametrize("of_nothing", [False, True])
def test_load_cells_that_no_motion_agrees_with_are_not_passed_over(*, of_nothing: bool) -> None:
    """A third more weight, or readings of something else: geometry alone, which agrees with itself,
    is no consistent model."""
    robot = polygon_robot(4, pulley_radius_m=0.0, sigma=FINE)
    hidden = Hidden() if of_nothing else Hidden(mass_kg=4.0)
    run = swing(mujoco, robot, hidden, seed=803, duration_s=20.0, kick=0.15)
    log = run.log
    if of_nothing:
        tension_N = np.random.default_rng(1).uniform(10.0, 60.0, log.tension_N.shape)
        log = cdprcal.Log(
            time_s=log.time_s,
            length_m=log.length_m,
            swivel_rad=log.swivel_rad,
            tension_N=tension_N,
            roll_pitch_yaw_rad=log.roll_pitch_yaw_rad,
        )
    contradicted = _core.calibrate_in_motion(robot, log)
    assert not contradicted.in_motion
    found = cdprcal.diagnose(robot, log, motion=True)
    if of_nothing:
        assert found.verdict == cdprcal.Verdict.unexplained
    else:
        assert "mass" in [n for e in found.effects for n in (e.info.name, *e.rivals)]
    error = cdprcal.minus(found.initial_pose_after, run.poses[0])
    assert np.all(np.abs(error) < 4.0 * np.sqrt(np.diag(found.covariance_after)))


@pytest.mark.parametrize(
    "what", few([name for name in MISREAD if name != "euler_convention"], kept=2)
)
@pytest.mark.parametrize("cables", few([4, 5]))
def test_a_wrong_map_of_its_sensors_is_named(what: str, cables: int) -> None:
    robot = polygon_robot(cables, pulley_radius_m=0.0)
    run = swing(mujoco, robot, seed=803, duration_s=20.0, kick=0.15)
    found = cdprcal.diagnose(robot, misread(run, what), motion=True)
    assert [fault.name for fault in found.faults] == [what]
    assert not found.effects
    error = cdprcal.minus(found.initial_pose_after, run.poses[0])
    assert np.linalg.norm(error[:3]) < 0.003


def test_the_order_of_its_angles_is_named() -> None:
    """Off by the product of two tilts of some degrees: less than many an effect."""
    run = swung(seed=802, duration_s=20.0, kick=0.15)
    found = cdprcal.diagnose(ROBOT, misread(run, "euler_convention"), motion=True)
    assert [fault.name for fault in found.faults] == ["euler_convention"]
    assert not found.effects


@pytest.mark.parametrize("seed", few([815, 2, 1, 819]))
def test_a_clean_log_that_never_rests_accuses_nobody(seed: int) -> None:
    run = swung(seed=seed, duration_s=20.0, kick=0.15)
    found = cdprcal.diagnose(ROBOT, run.log, motion=True)
    assert not found.effects
    assert found.verdict == cdprcal.Verdict.consistent


@pytest.mark.parametrize("seed", few([2, 4]))
def test_the_noise_of_a_free_swing_is_no_misfit(seed: int) -> None:
    run = swing(mujoco, ROBOT, seed=seed, duration_s=15.0, haul_m=0.0)
    found = cdprcal.calibrate(ROBOT, run.log, motion=True)
    assert not found.result.lacks_something
    assert "misfit" not in [caveat.code for caveat in found.caveats]


@pytest.mark.parametrize("seed", few([2, 4, 5]))
def test_the_noise_of_a_free_swing_is_no_hysteresis(seed: int) -> None:
    """Where a swivel hardly turns, which way it does is a matter of its own noise."""
    run = swing(mujoco, ROBOT, seed=seed, duration_s=15.0, haul_m=0.0)
    found = cdprcal.diagnose(ROBOT, run.log, motion=True)
    assert found.verdict == cdprcal.Verdict.consistent
    assert not found.effects


@pytest.mark.parametrize("seed", few([4, 1]))
def test_the_bias_of_an_accelerometer_is_no_force(seed: int) -> None:
    """No rest tells it; it is half of what the robot file says that it may be."""
    place_m = np.array([0.05, -0.03, 0.1])
    place = f"platform:\n  inertial_unit_m: {place_m.tolist()}\n"
    robot = cdprcal.parse_robot(
        cdprcal.to_yaml(ROBOT).replace("platform:\n", place, 1), "robot.yaml"
    )
    run = swing(mujoco, robot, seed=seed, duration_s=20.0, kick=0.15)
    at_m = np.array([pose.position_m + pose.rotation @ place_m for pose in run.poses])
    felt = np.gradient(np.gradient(at_m, run.log.time_s, axis=0), run.log.time_s, axis=0)
    felt[:, 2] += robot.gravity_m_s2
    specific = np.array([p.rotation.T @ f for p, f in zip(run.poses, felt, strict=True)])
    noise = 0.1 * np.random.default_rng(seed).standard_normal(specific.shape)
    log = cdprcal.Log(
        time_s=run.log.time_s,
        length_m=run.log.length_m,
        swivel_rad=run.log.swivel_rad,
        tension_N=run.log.tension_N,
        roll_pitch_yaw_rad=run.log.roll_pitch_yaw_rad,
        specific_force_m_s2=specific + noise + [0.1, -0.12, 0.05],
    )
    found = cdprcal.diagnose(robot, log, motion=True)
    assert not found.effects
    start = cdprcal.calibrate(robot, log, motion=True).result
    error = cdprcal.minus(start.poses[0], run.poses[0])
    assert np.all(np.abs(error) < 4.0 * start.standard_deviation)
    assert np.all(start.standard_deviation[:3] < 1e-3)


DELAYS = {
    "sensor_delay": "roll_pitch_yaw_rad",
    "length_delay": "length_m",
    "swivel_delay": "swivel_rad",
    "tension_delay": "tension_N",
}


@pytest.mark.parametrize(
    ("name", "cables", "seed", "rows", "haul_m"),
    few(
        [
            ("sensor_delay", 5, 1, 6, 0.06),
            ("length_delay", 5, 2, 8, 0.06),
            ("swivel_delay", 4, 4, 8, 0.0),
            ("tension_delay", 4, 4, 8, 0.0),
            ("sensor_delay", 5, 2, 10, 0.06),
            ("swivel_delay", 5, 1, 10, 0.06),
        ],
        kept=len(DELAYS),
    ),
)
def test_a_sensor_that_comes_late_is_read_when_it_comes(
    name: str, cables: int, seed: int, rows: int, haul_m: float
) -> None:
    """By up to half a period of the swing over six: its rate alone does not say where it was."""
    robot = polygon_robot(cables, pulley_radius_m=0.0)
    run = late(swing(mujoco, robot, seed=seed, duration_s=15.0, haul_m=haul_m), rows, DELAYS[name])
    start = cdprcal.calibrate(robot, run.log, motion=True).result
    assert name in start.reason
    error = cdprcal.minus(start.poses[0], run.poses[0])
    assert np.all(np.abs(error) < 4.0 * start.standard_deviation)
    found = cdprcal.diagnose(robot, run.log, motion=True)
    assert [effect.info.name for effect in found.effects] == [name]
    assert found.effects[0].values[0] == pytest.approx(0.01 * rows, abs=0.02)
    error = cdprcal.minus(found.initial_pose_after, run.poses[0])
    assert np.all(np.abs(error) < 4.0 * np.sqrt(np.diag(found.covariance_after)))


def test_noise_in_accelerations_makes_no_inertia_smaller() -> None:
    """Where the platform hardly turns about two axes, all that is seen of them is noise."""
    z = []
    for seed in (31, 34, 37):
        run = swing(mujoco, ROBOT, seed=seed, duration_s=15.0, haul_m=0.0)
        for name in ("inertia", "centre_of_mass"):
            options = cdprcal.DiagnoseOptions(effects=[name])
            for effect in cdprcal.diagnose(ROBOT, run.log, options, motion=True).effects:
                z += list(np.ravel(effect.values / effect.standard_deviation))
    assert np.sqrt(np.mean(np.square(z))) < 1.6
    assert np.max(np.abs(z)) < 4.0


def test_a_known_delay_is_tracked_from_the_first_sample_on() -> None:
    """In motion. As the samples come, nothing is read ahead, and the rate is not known at first."""
    rows = 8
    run = late(swing(mujoco, ROBOT, seed=2, duration_s=10.0), rows)
    known = f"effects: [{{name: sensor_delay, delay_s: {0.01 * rows}}}]\n"
    robot = cdprcal.parse_robot(cdprcal.to_yaml(ROBOT) + known, "robot.yaml")
    track = cdprcal.track(robot, run.log, motion=True)
    assert track.trusted.all()
    tracker = cdprcal.Tracker(cdprcal.calibrate(robot, run.log, motion=True))
    streamed = samples_of(run.log)
    for i, pose in enumerate(run.poses):
        samples = [track[i]]
        if i < 10:
            samples.append(tracker.add(next(streamed)))
        for now in samples:
            error = cdprcal.minus(now.pose, pose)
            assert np.all(np.abs(error) < 4.0 * np.sqrt(np.diag(now.pose_covariance)))


@pytest.mark.parametrize(("cables", "seed"), few([(3, 6), (4, 2), (3, 4)]))
def test_a_track_that_begins_in_motion_is_as_good_from_the_start(cables: int, seed: int) -> None:
    """How the platform swings is not known then: neither its twist nor how that changes."""
    robot = polygon_robot(cables, pulley_radius_m=0.0)
    run = swing(mujoco, robot, seed=seed, duration_s=6.0, haul_m=0.0, kick=0.6)
    track = cdprcal.track(robot, run.log, motion=True)
    assert track.trusted.all()
    for i in range(50):
        error = cdprcal.minus(track[i].pose, run.poses[i])
        assert np.all(np.abs(error) < 3.0 * np.sqrt(np.diag(track.pose_covariance[i])))


@pytest.mark.parametrize("gap_s", [0.3, 1.0, 1.7])
def test_a_silence_in_a_swing_is_not_gone_through_blindly(gap_s: float) -> None:
    """A platform that swings turns back in it: going on as before leads metres away."""
    robot = polygon_robot(4, pulley_radius_m=0.0)
    run = swing(mujoco, robot, seed=2, duration_s=8.0, haul_m=0.0, kick=0.6)
    log, time_s = run.log, run.log.time_s
    kept = np.flatnonzero((time_s <= 4.0) | (time_s >= 4.0 + gap_s))
    cut = cdprcal.Log(
        time_s=time_s[kept], source="cut", length_m=log.length_m[kept],
        swivel_rad=log.swivel_rad[kept], tension_N=log.tension_N[kept],
        roll_pitch_yaw_rad=log.roll_pitch_yaw_rad[kept],
    )  # fmt: skip
    track = cdprcal.track(robot, cut, motion=True)
    assert track.trusted.mean() > 0.95
    for i in np.flatnonzero(track.trusted):
        error = np.abs(cdprcal.minus(track[int(i)].pose, run.poses[kept[i]]))
        assert np.all(error < 4.0 * np.sqrt(np.diag(track.pose_covariance[i])))


@pytest.mark.parametrize(("seed", "duration_s"), few([(2, 5.0), (802, 10.0)]))
def test_a_track_knows_angles_no_better_than_its_start_does(seed: int, duration_s: float) -> None:
    """An AHRS that is askew by less than the log shows reads the same error at every sample."""
    hidden = Hidden(misalignment_rad=np.array([0.005, -0.004, 0.0]))
    run = swing(mujoco, ROBOT, hidden, seed=seed, duration_s=duration_s, kick=0.15)
    track = cdprcal.track(ROBOT, run.log, motion=True)
    assert track.trusted.all()
    for i in range(0, len(track), 50):
        error = cdprcal.minus(track[i].pose, run.poses[i])
        assert np.all(np.abs(error) < 4.0 * np.sqrt(np.diag(track.pose_covariance[i])))


def test_the_command_diagnoses_it_and_repeats_itself(
    cli: Cli, hauled: Swing, tmp_path: Path
) -> None:
    robot, log, result = tmp_path / "robot.yaml", tmp_path / "swing.csv", tmp_path / "found.json"
    robot.write_text(cdprcal.to_yaml(ROBOT))
    cdprcal.write_log(hauled.log, str(log))
    cli("diagnose", robot, log).refused("diagnose --motion")
    found = cli("diagnose", robot, log, "--motion", "-o", result, "--json")
    assert json.loads(found.stdout)["verdict"] == "consistent"
    again = json.loads(cli("repeat", result, "--json").stdout)
    assert again["same"]
    moving = json.loads(cli("calibrate", robot, log, "--motion", "--json").stdout)
    assert moving["motion"]["moments"] > 50
