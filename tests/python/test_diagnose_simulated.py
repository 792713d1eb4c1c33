"""What the diagnosis finds in start-ups of the dynamic simulator: physics code not its own."""

from __future__ import annotations

import numpy as np
import pytest

import cdprcal
from cdprcal import _core
from cdprcal.diagnosis import diagnosis_as_dict
from cdprcal.diagnosis.table import unexplained_line
from cdprcal.testing.blind_bench.cases import Case, Hidden, Setting
from cdprcal.testing.blind_bench.simulate import simulate
from conftest import changed, few

SETTING = Setting(poses=27, noise=0.1)


def diagnosed(hidden: list[Hidden], setting: Setting = SETTING, seed: int = 7) -> _core.Diagnosis:
    case = Case(number=1, seed=seed, kind="one", shuffled=True, stated=1.0, hidden=hidden)
    made = simulate(case, setting)
    return _core.diagnose(made.robot, [made.log])


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("sensor_delay", [0.12]),
        ("swivel_hysteresis", [0.01]),
        ("pulley_friction", [0.03]),
        ("cable_elasticity", [6e4]),
    ],
)
def test_one_effect_is_named_and_its_interval_holds_the_truth(
    name: str, values: list[float]
) -> None:
    diagnosis = diagnosed([Hidden(name, values, 1.0)])
    assert diagnosis.verdict == _core.Verdict.explained
    assert [e.info.name for e in diagnosis.effects] == [name]
    error = np.abs(diagnosis.effects[0].values - np.array(values))
    assert np.all(error <= 3.0 * diagnosis.effects[0].standard_deviation)
    assert np.all(error <= 0.25 * np.array(values))


def test_a_slip_is_found_with_its_cable_time_and_length() -> None:
    diagnosis = diagnosed([Hidden("cable_slip", [0.4, 3.0, 0.02], 1.0)])
    (slip,) = diagnosis.effects
    assert slip.info.name == "cable_slip"
    assert slip.where["cable"] == 3.0
    assert slip.values[0] == pytest.approx(0.02, abs=0.002)
    duration_s = diagnosis.model.pose_count * 10.0  # rough: some ten seconds a pose
    assert slip.where["time_s"] == pytest.approx(0.4 * duration_s, rel=0.4)
    # It belongs to this log, not to the robot: the corrected robot does not carry it.
    assert not diagnosis.corrected.effects


@pytest.mark.parametrize(
    ("name", "values"),
    [("swivel_shift", [0.4, 3.0, 0.05]), ("ahrs_shift", [0.4, 0.03, -0.02, 0.01])],
)
def test_a_sensor_of_angles_that_is_knocked_is_named_with_its_time(
    name: str, values: list[float]
) -> None:
    diagnosis = diagnosed([Hidden(name, values, 1.0)])
    assert diagnosis.verdict == _core.Verdict.explained
    (shift,) = diagnosis.effects
    assert shift.info.name == name
    hidden = values[2:] if "cable" in shift.where else values[1:]
    error = np.abs(shift.values - np.array(hidden))
    assert np.all(error <= np.maximum(3.0 * shift.standard_deviation, 1e-3))


@pytest.mark.parametrize("slip_m", [0.05, 0.3])
def test_what_happened_in_a_log_is_no_reason_to_mistrust_its_pose(slip_m: float) -> None:
    """``calibrate`` cannot: no robot file holds what happened once."""
    made = simulate(Case(1, 7, "one", True, 1.0, []), SETTING)
    log = made.log
    late = log.time_s > np.median(log.time_s)
    slipped = np.array(log.length_m)
    slipped[late, 1] -= slip_m
    diagnosis = _core.diagnose(made.robot, [changed(log, length_m=slipped)])
    assert [e.info.name for e in diagnosis.effects] == ["cable_slip"]
    assert diagnosis.verdict == _core.Verdict.explained
    assert diagnosis.unexplained == []


def test_a_touch_at_one_rest_is_not_said_of_a_sensor() -> None:
    made = simulate(Case(1, 7, "one", True, 1.0, []), SETTING)
    rests = _core.detect_equilibria(made.log, sigma=made.robot.sigma)
    rest = rests[len(rests) // 2]
    touched = np.array(made.log.tension_N)
    during = (made.log.time_s >= rest.begin_s - 0.5) & (made.log.time_s <= rest.end_s + 0.5)
    touched[during, 3] += 10.0
    diagnosis = _core.diagnose(made.robot, [changed(made.log, tension_N=touched)])
    (own,) = diagnosis.own_errors
    assert own.column == "tension_4_N"
    assert rest.begin_s <= own.at_s + made.log.time_s[0] <= rest.end_s
    assert any("at no other" in text for text in diagnosis.next)
    json = diagnosis_as_dict(diagnosis, made.robot)
    assert json["own_errors"][0]["at_s"] == own.at_s


def test_an_outlier_is_left_out_by_time_and_cable_and_accuses_nobody() -> None:
    diagnosis = diagnosed([Hidden("outlier", [0.5, 2.0, 0.1], 1.0)])
    assert diagnosis.verdict == _core.Verdict.consistent
    assert any("outlier" in text and "cable 2" in text for text in diagnosis.gated)


@pytest.mark.parametrize(
    ("name", "values", "channel", "depends_on"),
    [
        ("load_cell_curvature", [4e-4], "tension", "reading"),
        ("roll_pitch_bend", [0.5], "roll_pitch", "reading"),
        ("temperature_step", [0.3, 8.0], "tension", "time"),
    ],
)
def test_what_the_catalogue_lacks_is_not_given_a_name(
    name: str, values: list[float], channel: str, depends_on: str
) -> None:
    """At most a formula: of that channel, in what the law depends on."""
    diagnosis = diagnosed([Hidden(name, values, 1.0)])
    assert diagnosis.verdict in (_core.Verdict.unexplained, _core.Verdict.described)
    assert all(effect.described for effect in diagnosis.effects)
    said = [(left.channel, left.depends_on) for left in diagnosis.unexplained]
    for effect in diagnosis.effects:
        to, _, by = effect.info.name.partition("_by_")
        itself = by.startswith(to)
        to = {"roll": "roll_pitch", "pitch": "roll_pitch"}.get(to, to)
        said.append((to, "reading" if itself else by.partition("_")[0]))
    assert (channel, depends_on) in said
    assert {left_channel for left_channel, _ in said} == {channel}


@pytest.mark.parametrize("seed", few([2, 4, 8]))
def test_the_play_of_encoders_is_not_taken_for_a_delay(seed: int) -> None:
    """Both move the attitude against the lengths by the sign of the motion; rests are few."""
    robot = cdprcal.load_robot("ring5")
    run = cdprcal.simulate_startup(robot, cdprcal.make_plan(robot, grid=(2, 2, 2)).plan, seed=seed)
    true_m = np.array([cdprcal.platform_state(robot, pose).length_m for pose in run.poses])
    turned = np.zeros(true_m.shape)  # by the last millimetres
    for k in range(1, len(true_m)):
        turned[k] = np.clip(turned[k - 1] + (true_m[k] - true_m[k - 1]) / 1e-3, -1.0, 1.0)
    length_m = np.array(run.log.length_m) + 2e-3 * turned
    found = cdprcal.diagnose(robot, [changed(run.log, length_m=length_m)])
    assert [e.info.name for e in found.effects] in ([], ["length_by_direction_line"])
    refused = {r.name: r.reason for r in found.rejected}
    law = "a law that no effect has: length_m += slope_m * length_direction"
    assert any(law in why for name, why in refused.items() if name.endswith("_delay"))
    assert found.verdict in (cdprcal.Verdict.described, cdprcal.Verdict.unexplained)
    # And a delay is one.
    time_s, angles = np.array(run.log.time_s), np.array(run.log.roll_pitch_yaw_rad)
    late = np.column_stack([np.interp(time_s - 0.1, time_s, angle) for angle in angles.T])
    found = cdprcal.diagnose(robot, [changed(run.log, roll_pitch_yaw_rad=late)])
    assert [e.info.name for e in found.effects] == ["sensor_delay"]


def test_the_smallest_visible_size_grows_with_the_noise() -> None:
    quiet, loud = (
        {i.name: i.detectable for i in diagnosed([], Setting(27, noise)).identifiability}
        for noise in (0.05, 0.5)
    )
    for name in ("load_cell_bias", "transmission_ratio", "sensor_delay", "yaw_drift"):
        assert quiet[name] < loud[name]


def test_ties_come_with_poses_that_raise_the_evidence() -> None:
    diagnosis = diagnosed([Hidden("platform_anchors", [0.003, 0.0, 0.0] * 4, 1.0)])
    names = {n for e in diagnosis.effects for n in [e.info.name, *e.rivals]}
    # A common shift of the anchors is a shift of the centre of mass: exactly (design, section 5).
    assert {"platform_anchors", "centre_of_mass"} <= names
    assert any("cannot be told apart" in text for text in diagnosis.next)


def test_what_nobody_can_describe_counts_in_every_sigma() -> None:
    """Swivels that are off by a random function of the place, another one for each."""
    robot = cdprcal.load_robot("irma4")
    run = cdprcal.simulate_startup(robot, cdprcal.make_plan(robot, grid=(3, 3, 3)).plan, seed=1)
    rng = np.random.default_rng([1, 77])
    # What stays the same over a rest.
    sigma = {"length_m": 3e-4, "swivel_rad": 1.5e-3, "tension_N": 0.5, "roll_pitch_yaw_rad": 2e-3}
    read = {name: np.array(getattr(run.log, name)) for name in sigma}
    time_s = np.array(run.log.time_s)
    place_m = np.array([pose.position_m for pose in run.poses])
    for cable in range(4):
        wave, phase = 2.0 * rng.standard_normal((6, 3)), rng.uniform(0, 6.3, 6)
        size = rng.standard_normal(6) * 0.04 / np.sqrt(3)
        read["swivel_rad"][:, cable] += np.cos(place_m @ wave.T + phase) @ size
    for name, of_rest in sigma.items():
        for rest in run.rests:
            rows = (time_s >= rest.begin_s) & (time_s <= rest.end_s)
            read[name][rows] += of_rest * rng.standard_normal(read[name].shape[1])
    log = cdprcal.Log(time_s=time_s, source="odd.csv", **read)
    found = cdprcal.diagnose(robot, logs=[log])
    assert found.verdict == _core.Verdict.unexplained
    (left,) = found.discrepancy.channels
    assert left.channel == "swivel"
    assert 0.01 < left.rms < 0.06
    assert 0.2 < found.discrepancy.reach_m < 1.5
    assert any("change with the place (swivel)" in text for text in found.next)
    document = diagnosis_as_dict(found, robot, logs=[log])
    assert document["discrepancy"]["channels"][0]["rms"] == left.rms
    away_m = found.initial_pose_after.position_m - run.poses[0].position_m
    covariance = np.array(found.covariance_after)[:3, :3]
    assert away_m @ np.linalg.solve(covariance, away_m) < 16.3  # 99.9 % of three coordinates
    clean = cdprcal.diagnose(robot, [run.log]).discrepancy
    assert (clean.channels, np.isnan(clean.reach_m)) == ([], True)


@pytest.mark.parametrize("name", ["irma4", "ring3"])
@pytest.mark.parametrize("factor", [2.0, 0.5, 1.35], ids=["halves", "diameters", "another type"])
def test_pulleys_of_another_size_are_named(name: str, factor: float) -> None:
    """Lengths that count from anywhere hide most of it: a pose off by up to 25 sigma."""
    robot = cdprcal.load_robot(name)
    plan = cdprcal.make_plan(robot, order=cdprcal.VisitingOrder.random, seed=2).plan
    error_m = (factor - 1.0) * robot.cables[0].pulley.radius_m
    run = cdprcal.simulate_startup(robot, plan, effects=[f"pulley_diameter={error_m}"], seed=4)
    found = cdprcal.diagnose(robot, run.log)
    assert [effect.info.name for effect in found.effects] == ["pulley_diameter"]
    assert not found.faults
    effect = found.effects[0]
    value_m, sigma_m = np.ravel(effect.values)[0], np.ravel(effect.standard_deviation)[0]
    assert abs(value_m - error_m) < 4.0 * sigma_m < abs(error_m)
    error = cdprcal.minus(found.initial_pose_after, run.truth[0].pose)
    assert np.max(np.abs(error) / np.sqrt(np.diag(found.covariance_after))) < 4.0
    assert np.linalg.norm(error[:3]) < 3e-3


@pytest.mark.parametrize(("bent", "only"), [([3], 3), ([1, 3], -1)])
def test_what_is_left_on_one_cable_alone_names_the_cable(
    robot: cdprcal.Robot, bent: list[int], only: int
) -> None:
    """Load cells that are not straight, at too few rests for a formula."""
    options = cdprcal.SyntheticLogOptions(
        noise=cdprcal.reading_noise(robot.sigma, 0.1), seed=2, dwell_s=4.0, move_s=2.0
    )
    log = cdprcal.synthetic_log(robot, cdprcal.default_setpoints(robot, 2, 2, 2), options).log
    tension_N = np.array(log.tension_N)
    tension_N[:, bent] += 9e-4 * (tension_N[:, bent] - 60.0) ** 2
    found = cdprcal.diagnose(robot, [changed(log, tension_N=tension_N)])
    assert found.verdict == _core.Verdict.unexplained
    (left,) = found.unexplained
    assert (left.channel, left.depends_on, left.cable) == ("tension", "reading", only)
    (shown,) = diagnosis_as_dict(found, robot, logs=[log])["unexplained"]
    assert shown["cable"] == (None if only < 0 else only + 1)
    on_one = f"on cable {only + 1} alone" in unexplained_line(shown)
    assert on_one == (only >= 0) == any(f"cable {only + 1}, the only one" in n for n in found.next)


def test_sigma_allows_for_laws_beside_the_name_that_was_found() -> None:
    """An AHRS that bends tilts the platform no more than a centre of mass does: 4.3 σ off."""
    hidden = Hidden("roll_pitch_bend", [-0.6946568318649553], 1.736642079662388)
    case = Case(number=8, seed=741308269246158495, kind="outside", shuffled=False, stated=1.0,
                hidden=[hidden], signal="held", noise=1.0)  # fmt: skip
    made = simulate(case, Setting(poses=8, noise=0.2, family="held"))
    found = _core.diagnose(made.robot, [made.log])
    assert [effect.info.name for effect in found.effects] == ["centre_of_mass"]
    off = np.asarray(_core.minus(found.initial_pose_after, made.initial_pose))
    assert np.all(np.abs(off) < 3.0 * np.sqrt(np.diag(found.covariance_after)))
