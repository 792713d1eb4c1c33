"""An accelerometer and a gyroscope, from the plug to the pose."""

from __future__ import annotations

import json
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import cdprcal
from cdprcal import CalibrateOptions, CalibrationStatus, InputError, _core
from cdprcal.cli.generate import with_sensors
from cdprcal.hardware.session import Ahrs
from cdprcal.hardware.xsens import measurement as mt
from cdprcal.hardware.xsens.device import XsensMti
from cdprcal.io import load_log
from cdprcal.mapping import load_mapped, propose
from cdprcal.mapping.read import read_raw
from cdprcal.testing.simulated_devices.mti import SimulatedPort
from cdprcal.trust import caveats_of
from conftest import TABLE_II_TENSIONS_N, Cli, samples_of

PLACE = "  inertial_unit_m: [0.05, -0.02, 0.03]\n"


def robot_text() -> str:
    return cdprcal.builtin_robot_yaml("irma4").replace("platform:\n", f"platform:\n{PLACE}", 1)


@pytest.fixture(scope="module")
def robot() -> cdprcal.Robot:
    return cdprcal.parse_robot(robot_text(), "robot.yaml")


@pytest.fixture(scope="module")
def robot_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("robot") / "robot.yaml"
    path.write_text(robot_text())
    return path


@pytest.fixture(scope="module")
def run(robot: cdprcal.Robot) -> cdprcal.StartUpRun:
    plan = cdprcal.StartUpPlan(setpoint_N=cdprcal.default_setpoints(robot, 2, 2, 1))
    options = cdprcal.SimulatorOptions(seed=4)
    return cdprcal.simulate_startup(robot, plan, simulator=options, log_rate_Hz=100.0)


def test_its_place_is_in_the_robot_file(robot: cdprcal.Robot) -> None:
    place_m = robot.platform.inertial_unit_m
    assert place_m is not None
    np.testing.assert_array_equal(place_m, [0.05, -0.02, 0.03])
    assert PLACE in cdprcal.to_yaml(robot)
    assert "inertial_unit_m" not in cdprcal.to_yaml(cdprcal.load_robot("irma4"))
    wrong = robot_text().replace("[0.05, -0.02, 0.03]", "[0.05, -0.02]")
    with pytest.raises(InputError, match=r"robot\.yaml:\d+:\d+: platform\.inertial_unit_m"):
        cdprcal.parse_robot(wrong, "robot.yaml")


def test_it_says_which_way_is_up(robot: cdprcal.Robot) -> None:
    """Instead of an AHRS, at any attitude; as well as its noise allows."""
    options = cdprcal.SyntheticLogOptions(
        noise=cdprcal.reading_noise(robot.sigma, 0.1, absolute=True), seed=2
    )
    setpoints = [np.array(tension_N) for tension_N in TABLE_II_TENSIONS_N[:6]]
    made = cdprcal.synthetic_log(robot, setpoints, options)
    sigma_m = {}
    for sensors in (
        {"length_m", "swivel_rad", "specific_force_m_s2"},
        {"length_m", "tension_N", "specific_force_m_s2"},
        {"length_m", "swivel_rad"},
    ):
        log = with_sensors(made.log, sensors)
        result = cdprcal.calibrate(robot, log, CalibrateOptions(allow_for_effects=False)).result
        assert result.status == CalibrationStatus.converged, result.reason
        assert result.covariance is not None
        error = cdprcal.minus(result.poses[0], made.poses[0])
        assert error @ np.linalg.solve(result.covariance, error) < 30.0
        sigma_m[len(sensors)] = np.sqrt(np.diag(result.covariance)[:3].max())
        if "specific_force_m_s2" in sensors:
            assert np.isfinite(result.residual_rms.specific_force_m_s2)
    assert sigma_m[3] < sigma_m[2]


def test_gyroscopes_alone_say_nothing_of_a_pose(run: cdprcal.StartUpRun) -> None:
    robot = cdprcal.load_robot("irma4")
    log = with_sensors(run.log, {"angular_velocity_rad_s"})
    with pytest.raises(InputError, match="to tell rest from motion by"):
        cdprcal.calibrate(robot, log)


def test_readings_of_the_paper_are_weighed_as_before(run: cdprcal.StartUpRun) -> None:
    """A gyroscope beside them changes nothing at rest."""
    robot = cdprcal.load_robot("irma4")
    plain = {"length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"}
    without = cdprcal.calibrate(robot, with_sensors(run.log, plain)).result
    beside = with_sensors(run.log, plain | {"angular_velocity_rad_s"})
    result = cdprcal.calibrate(robot, beside).result
    np.testing.assert_array_equal(result.poses[0].position_m, without.poses[0].position_m)
    np.testing.assert_array_equal(result.covariance, without.covariance)


def test_motion_is_known_better(robot: cdprcal.Robot, run: cdprcal.StartUpRun) -> None:
    truth = np.array([at.twist for at in run.truth])
    calibration = cdprcal.calibrate(robot, run.log)
    plain = {"length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"}
    rms = []
    for sensors in (plain, plain | {"specific_force_m_s2", "angular_velocity_rad_s"}):
        track = _core.track(calibration, with_sensors(run.log, sensors))
        assert track.trusted.all()
        off = (track.twist - truth)[100:]
        sigma = np.sqrt(np.diagonal(track.twist_covariance, axis1=1, axis2=2))[100:]
        assert np.mean(np.abs(off) < 3.0 * sigma) > 0.98
        rms.append(np.sqrt(np.mean(off**2, axis=0)))
    assert (rms[1][3:] < 0.4 * rms[0][3:]).all()
    assert (rms[1][:3] < 1.05 * rms[0][:3]).all()


def test_a_stream_takes_it_too(robot: cdprcal.Robot, run: cdprcal.StartUpRun) -> None:
    log = run.log
    calibration = cdprcal.calibrate(robot, log)
    tracker = cdprcal.Tracker(calibration)
    for sample in islice(samples_of(log), 200):
        now = tracker.add(sample)
    np.testing.assert_array_equal(now.twist, _core.track(calibration, log).twist[199])


def test_a_rehearsal_logs_it(cli: Cli, robot_path: Path, tmp_path: Path) -> None:
    plan, log = tmp_path / "plan.csv", tmp_path / "run.mcap"
    assert cli("plan", robot_path, "--grid", "1x1x2", "-o", plan).code == 0
    ran = cli("acquire", robot_path, plan, "--quick", "-o", log)
    assert ran.code == 0, ran.stderr
    read = load_log(log).log
    assert read.specific_force_m_s2.shape == (len(read), 3)
    up = np.linalg.norm(read.specific_force_m_s2, axis=1)
    assert np.median(np.abs(up - 9.81)) < 0.1
    assert np.isfinite(read.angular_velocity_rad_s).all()
    tracked = cli("track", robot_path, log, "--json")
    assert tracked.code in (0, 3), tracked.stderr  # two rests are few
    document = json.loads(tracked.stdout)
    assert document["trusted_samples"] == document["samples"]


def test_an_xsens_gives_it() -> None:
    ahrs = Ahrs.model_validate(
        {"port": "simulated", "inertial_unit": True, "mounting_deg": [180.0, 0.0, 45.0]}
    )
    port = SimulatedPort(ahrs)
    device = XsensMti(port, ahrs)
    attitude = mt.rotation_from_zyx_deg((5.0, 3.0, -170.0))
    force, rate = np.array([0.3, -0.2, 9.7]), np.array([0.1, 0.2, -0.3])
    port.device.show(attitude, 0.0, force, rate)
    read = device.poll(0.0)
    assert read is not None
    assert read.specific_force_m_s2 is not None
    assert read.angular_velocity_rad_s is not None
    np.testing.assert_allclose(read.R_world_platform, attitude, atol=2e-6)
    np.testing.assert_allclose(read.specific_force_m_s2, force, atol=2e-6)
    np.testing.assert_allclose(read.angular_velocity_rad_s, rate, atol=2e-7)
    port.device.show(attitude, 0.01)
    read = device.poll(0.01)
    assert read is not None
    assert read.specific_force_m_s2 is not None
    np.testing.assert_allclose(attitude @ read.specific_force_m_s2, [0, 0, 9.81], atol=1e-5)
    plain = Ahrs(port="simulated")
    port = SimulatedPort(plain)
    device = XsensMti(port, plain)
    port.device.show(attitude, 0.0)
    read = device.poll(0.0)
    assert read is not None
    assert read.specific_force_m_s2 is None


@pytest.mark.parametrize(
    ("names", "units"),
    [
        (("Acc_{}", "Gyr_{}"), (1.0, 1.0)),
        (("acc{} [g]", "gyro{} [deg/s]"), (9.80665, np.pi / 180.0)),
        (("imu.linear_acceleration.{}", "imu.angular_velocity.{}"), (1.0, 1.0)),
        (("accel_{}_mg", "omega_{} [°/s]"), (9.80665e-3, np.pi / 180.0)),
    ],
)
def test_its_columns_are_recognised(
    names: tuple[str, str],
    units: tuple[float, float],
    robot: cdprcal.Robot,
    run: cdprcal.StartUpRun,
    tmp_path: Path,
) -> None:
    log = run.log
    columns = {"time_s": log.time_s}
    columns |= {f"cable_{i + 1}_m": log.length_m[:, i] for i in range(4)}
    columns |= {f"force_{i + 1}_N": log.tension_N[:, i] for i in range(4)}
    for name, unit, group in zip(
        names, units, (log.specific_force_m_s2, log.angular_velocity_rad_s), strict=True
    ):
        columns |= {name.format(axis): group[:, i] / unit for i, axis in enumerate("xyz")}
    columns |= {f"FreeAcc_{axis}": log.specific_force_m_s2[:, i] for i, axis in enumerate("XYZ")}
    path = tmp_path / "raw.csv"
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    proposal = propose(read_raw(path), robot)
    map_path = tmp_path / "map.yaml"
    map_path.write_text(proposal.text())
    mapped = load_mapped(path, map_path, robot).log
    np.testing.assert_allclose(mapped.specific_force_m_s2, log.specific_force_m_s2, atol=1e-6)
    np.testing.assert_allclose(mapped.angular_velocity_rad_s, log.angular_velocity_rad_s, atol=1e-6)


def test_a_bag_holds_it(
    cli: Cli, run: cdprcal.StartUpRun, robot_path: Path, tmp_path: Path
) -> None:
    path, bag, again = tmp_path / "run.csv", tmp_path / "bag", tmp_path / "again.csv"
    rows = slice(0, 40)
    fields = ("length_m", "tension_N", "roll_pitch_yaw_rad", "specific_force_m_s2",
              "angular_velocity_rad_s")  # fmt: skip
    part = {field: getattr(run.log, field)[rows] for field in fields}
    cdprcal.write_log(cdprcal.Log(time_s=run.log.time_s[rows], **part), str(path))
    assert cli("export", robot_path, path, "-o", bag).code == 0
    assert cli("import", bag, "--robot", robot_path, "-o", again).code == 0
    read = load_log(again).log
    for field in fields:
        np.testing.assert_allclose(getattr(read, field), part[field], atol=1e-9, err_msg=field)


def test_the_simulated_unit_turns_as_the_platform_does(run: cdprcal.StartUpRun) -> None:
    """SciPy's rotations as witness: the change of attitude over a second is the rate's integral."""
    time_s = run.log.time_s
    attitude = Rotation.from_matrix([truth.pose.rotation for truth in run.truth])
    step_s = np.diff(time_s)[:, None]
    mean = 0.5 * (run.log.angular_velocity_rad_s[1:] + run.log.angular_velocity_rad_s[:-1])
    steps = Rotation.from_rotvec(mean * step_s)
    for begin in range(0, len(step_s) - 100, 100):
        turned = Rotation.identity()
        for step in steps[begin : begin + 100]:
            turned = turned * step
        off = (attitude[begin].inv() * attitude[begin + 100]).inv() * turned
        assert off.magnitude() < np.radians(0.6)  # a bias of 0.1°/s and the noise


def test_its_bias_is_no_misfit(robot: cdprcal.Robot, run: cdprcal.StartUpRun) -> None:
    calibration = cdprcal.calibrate(robot, run.log)
    assert not caveats_of(calibration)
    assert cdprcal.diagnose(robot, run.log).verdict == cdprcal.Verdict.consistent


@pytest.mark.parametrize("effect", ["base_tilt=0.02,-0.01", "load_cell_bias=5,-4,3,0"])
def test_effects_are_named_without_an_ahrs(effect: str, robot: cdprcal.Robot) -> None:
    plan = cdprcal.StartUpPlan(setpoint_N=cdprcal.default_setpoints(robot, 2, 2, 2))
    made = cdprcal.simulate_startup(robot, plan, effects=[effect], seed=1)
    kept = {"length_m", "tension_N", "specific_force_m_s2", "angular_velocity_rad_s"}
    found = cdprcal.diagnose(robot, with_sensors(made.log, kept))
    assert [e.info.name for e in found.effects] == [effect.partition("=")[0]]
