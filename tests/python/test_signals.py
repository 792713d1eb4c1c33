"""Samples as sensors give them: rounded, held, filtered. Clean logs of such are not accused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal.check import check_log
from cdprcal.io import LogFile

Readings = dict[str, np.ndarray]
_GROUPS = ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
_ROWS_HZ = 50.0
_TIME_CONSTANT_S = 0.05
_RUN_UP = 50  #: rows in which the platform still rests


def every(readings: Readings, rows: int) -> Readings:
    return {name: values[::rows].copy() for name, values in readings.items()}


def rounded(readings: Readings) -> Readings:
    """To steps that begin anywhere: poses of one plan are not to have one error in every run."""
    steps = [0.5e-3, np.radians(0.1), 1.0, np.radians(0.1)]
    rng = np.random.default_rng(int(1e6 * abs(readings["length_m"][0, 0])))
    for name, step in zip(_GROUPS, steps, strict=True):
        begin = step * rng.uniform(-0.5, 0.5, readings[name].shape[1])
        readings[name] = step * np.round((readings[name] - begin) / step) + begin
    return readings


def held(readings: Readings, rows: int = 5) -> Readings:
    """Sensors a fifth as fast as the rows, the attitude out of step with the drives."""
    index = np.arange(len(readings["time_s"]))
    for name in _GROUPS:
        late = 2 if name == "roll_pitch_yaw_rad" else 0
        readings[name] = readings[name][np.maximum(0, (index - late) // rows * rows + late)]
    return readings


def filtered(readings: Readings) -> Readings:
    """A first-order filter of all sensors, which ran long before the first row."""
    gain = 1.0 - np.exp(-np.median(np.diff(readings["time_s"])) / _TIME_CONSTANT_S)
    for name in _GROUPS:
        values = readings[name]
        state = values[_RUN_UP]
        for row in range(_RUN_UP, 0, -1):
            state = state + gain * (values[row] - state)
        for row in range(len(values)):
            state = values[row] = state + gain * (values[row] - state)
    return readings


_KINDS: dict[str, Callable[[Readings], Readings]] = {
    "rounded, 10 Hz": lambda readings: rounded(every(readings, 10)),
    "rounded": lambda readings: rounded(every(readings, 2)),
    "held": lambda readings: held(every(readings, 2)),
    "held and rounded": lambda readings: rounded(held(every(readings, 2))),
    "filtered": lambda readings: every(filtered(readings), 2),
    "filtered and rounded": lambda readings: rounded(every(filtered(readings), 2)),
}


def simulated(robot: cdprcal.Robot, seed: int, noise: float = 1.0) -> tuple[Readings, np.ndarray]:
    """A clean run of eight poses at 100 Hz, and where it began."""
    degree = np.radians(1.0)
    channel = cdprcal.SensorChannel
    run = cdprcal.simulate_startup(
        robot,
        cdprcal.StartUpPlan(list(cdprcal.default_setpoints(robot, 2, 2, 2))),
        simulator=cdprcal.SimulatorOptions(
            seed=seed,
            sensors=cdprcal.SensorOptions(
                length_m=channel(noise=noise * 0.4e-3, resolution=1e-6),
                swivel_rad=channel(noise=noise * 0.08 * degree, resolution=1e-5),
                tension_N=channel(noise=noise * 0.8, resolution=1e-2),
                roll_pitch_rad=channel(noise=noise * 0.08 * degree, resolution=1e-6),
                yaw_rad=channel(noise=noise * 0.15 * degree, resolution=1e-6),
            ),
        ),
        log_rate_Hz=2.0 * _ROWS_HZ,
    )
    names = ("time_s", *_GROUPS, "tension_setpoint_N")
    return {name: np.array(getattr(run.log, name)) for name in names}, run.poses[0].position_m


@pytest.fixture(params=["irma4", "ring3"], scope="module")
def a_robot(request: pytest.FixtureRequest) -> cdprcal.Robot:
    return cdprcal.load_robot(request.param)


@pytest.mark.parametrize("noise", [1.0, 0.15])
def test_clean_logs_are_not_accused_and_their_poses_are_as_good_as_they_say(
    a_robot: cdprcal.Robot, noise: float
) -> None:
    accused, off, unlike = [], [], []
    for seed in (71, 72, 73, 74):
        readings, began_m = simulated(a_robot, seed, noise)
        for kind, alter in _KINDS.items():
            log = cdprcal.Log(
                source=f"{kind} {seed}", **alter({k: v.copy() for k, v in readings.items()})
            )
            diagnosis = cdprcal.diagnose(a_robot, [log])
            if diagnosis.verdict != cdprcal.Verdict.consistent:
                accused.append(log.source)
            report = check_log(a_robot, LogFile(Path("made.csv"), "csv", log))
            unlike += [f"{log.source}: {finding.message}" for finding in report.findings]
            result = cdprcal.calibrate(a_robot, log).result
            error_m = np.asarray(result.poses[0].position_m) - began_m
            covariance = np.asarray(result.covariance)[:3, :3]
            off.append(float(error_m @ np.linalg.solve(covariance, error_m)))
    assert accused == []
    assert unlike == []
    # χ² of three, 48 times (not all are independent): at a quarter of it σ would be twice as large.
    assert 0.25 * 3.0 < np.mean(off) < 2.0 * 3.0


def test_check_says_how_samples_come(a_robot: cdprcal.Robot) -> None:
    readings, _ = simulated(a_robot, 75)

    def signals(alter: Callable[[Readings], Readings]) -> dict[str, dict[str, float]]:
        log = cdprcal.Log(source="made", **alter({k: v.copy() for k, v in readings.items()}))
        report = check_log(a_robot, LogFile(Path("made.csv"), "csv", log)).as_dict()
        assert [s["channel"] for s in report["signals"]] == [
            "length",
            "swivel",
            "roll_pitch",
            "yaw",
            "balance",
        ]
        return {s["channel"]: s for s in report["signals"]}

    plain = signals(lambda r: every(r, 2))
    for channel, signal in signals(lambda r: held(every(r, 2))).items():
        assert signal["hold_rows"] == 5.0
        assert signal["resolution"] is None
        assert signal["samples_effective"] < 0.3 * plain[channel]["samples_effective"]
    for channel, signal in signals(lambda r: every(filtered(r), 2)).items():
        assert signal["correlation_s"] == pytest.approx(_TIME_CONSTANT_S, rel=0.3), channel
        assert plain[channel]["correlation_s"] == 0.0
    coarse = signals(lambda r: rounded(every(r, 2)))
    assert coarse["length"]["resolution"] == pytest.approx(0.5e-3, rel=1e-3)
    assert coarse["balance"]["resolution"] == pytest.approx(1.0, rel=1e-3)


def test_an_attitude_that_is_filtered_alone_arrives_late_and_none_arrives_early(
    a_robot: cdprcal.Robot,
) -> None:
    """A first-order filter is a delay while the platform moves slowly; nothing reads the future."""
    for seed in (76, 77):
        readings, _ = simulated(a_robot, seed)
        smooth = filtered({k: v.copy() for k, v in readings.items()})
        late = every(readings | {"roll_pitch_yaw_rad": smooth["roll_pitch_yaw_rad"]}, 2)
        found = cdprcal.diagnose(a_robot, [cdprcal.Log(source="late", **late)]).effects
        assert [effect.info.name for effect in found] == ["sensor_delay"]
        assert found[0].values[0] == pytest.approx(_TIME_CONSTANT_S, rel=0.3)
        early = every(smooth | {"roll_pitch_yaw_rad": readings["roll_pitch_yaw_rad"]}, 2)
        found = cdprcal.diagnose(a_robot, [cdprcal.Log(source="early", **early)]).effects
        assert "sensor_delay" not in [effect.info.name for effect in found]
