"""``cdprcal diagnose``: the JSON contract, the table, exit codes, the corrected robot file."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal import Log, Robot
from cdprcal.diagnosis.table import print_diagnosis, unexplained_line
from conftest import Cli, changed, strict

BIAS_N = [9.0, -7.0, 11.0, -8.0]
KEYS = {
    "verdict",
    "effects",
    "rejected",
    "unexplained",
    "gap",
    "initial_pose_before",
    "initial_pose_after",
    "next",
}
CHANNELS = {"length_m", "swivel_rad", "roll_pitch_rad", "yaw_rad", "tension_N"}


def a_clean_log(robot: Robot, seed: int) -> Log:
    options = cdprcal.SyntheticLogOptions(
        dwell_s=4.0, move_s=4.0, noise=cdprcal.reading_noise(robot.sigma, 0.2), seed=seed
    )
    return cdprcal.synthetic_log(robot, cdprcal.default_setpoints(robot, 3, 3, 2), options).log


@pytest.fixture(scope="module")
def clean_log(robot: Robot) -> Log:
    return a_clean_log(robot, 5)


@pytest.fixture(scope="module")
def biased_log(clean_log: Log) -> Log:
    return changed(clean_log, tension_N=clean_log.tension_N + np.array(BIAS_N))


def written(log: Log, path: Path) -> Path:
    cdprcal.write_log(log, str(path))
    return path


def test_json_of_a_clean_log_is_as_documented(cli: Cli, clean_log: Log, tmp_path: Path) -> None:
    ran = cli("diagnose", "irma4", written(clean_log, tmp_path / "clean.csv"), "--json")
    result = strict(ran.stdout)
    assert (ran.code, result["verdict"]) == (0, "consistent")
    assert set(result) >= KEYS
    assert result["effects"] == result["unexplained"] == []
    assert {gap["channel"] for gap in result["gap"]} == CHANNELS
    assert all(gap["after_effect"] is None for gap in result["gap"])
    assert result["initial_pose_before"] == result["initial_pose_after"]


def test_json_of_a_bias_is_as_documented(cli: Cli, biased_log: Log, tmp_path: Path) -> None:
    ran = cli("diagnose", "irma4", written(biased_log, tmp_path / "biased.csv"), "--json")
    result = strict(ran.stdout)
    assert (ran.code, result["verdict"]) == (0, "explained")
    (effect,) = result["effects"]
    assert effect["name"] == "load_cell_bias"
    assert set(effect["parameters"]) == set(effect["standard_deviation"]) == {"bias_N"}
    error = np.array(effect["parameters"]["bias_N"]) - BIAS_N
    assert np.all(np.abs(error) < 3 * np.array(effect["standard_deviation"]["bias_N"]))
    assert effect["log_evidence"] > 3
    assert 0 < effect["p_value"] < 0.01
    assert effect["held_out"]["after"] < effect["held_out"]["before"]
    assert isinstance(effect["rivals"], list)
    for pose in (result["initial_pose_before"], result["initial_pose_after"]):
        assert set(pose) == {"position_m", "rotation", "euler_rad"}
        rotation = np.array(pose["rotation"])
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
    by_step = {
        (gap["after_effect"], gap["channel"]): (gap["train_rms"], gap["held_out_rms"])
        for gap in result["gap"]
    }
    for i in range(2):
        assert by_step["load_cell_bias", "tension_N"][i] < 0.5 * by_step[None, "tension_N"][i]
    for rejected in result["rejected"]:
        assert set(rejected) == {"name", "reason"}
        assert rejected["reason"]


def test_the_corrected_file_is_consistent_and_calibrates(
    cli: Cli, biased_log: Log, tmp_path: Path
) -> None:
    log = written(biased_log, tmp_path / "biased.csv")
    corrected = tmp_path / "corrected.yaml"
    first = cli("diagnose", "irma4", log, "-o", corrected, "--json")
    assert first.code == 0
    assert "load_cell_bias" in corrected.read_text()
    again = strict(cli("diagnose", corrected, log, "--json").stdout)
    assert again["verdict"] == "consistent"
    after = np.array(strict(first.stdout)["initial_pose_after"]["position_m"])
    calibrated = strict(cli("calibrate", corrected, log, "--method", "static", "--json").stdout)
    np.testing.assert_allclose(calibrated["initial_pose"]["position_m"], after, atol=2e-3)


def test_a_discrete_fault_stands_among_the_effects(cli: Cli, log: Log, tmp_path: Path) -> None:
    degrees = np.rad2deg(log.roll_pitch_yaw_rad)
    path = written(changed(log, roll_pitch_yaw_rad=degrees), tmp_path / "degrees.csv")
    corrected = tmp_path / "corrected.yaml"
    ran = cli("diagnose", "irma4", path, "--json", "-o", corrected)
    result = strict(ran.stdout)
    assert (ran.code, result["verdict"]) == (0, "explained")
    fault = result["effects"][0]
    assert fault["name"] == "angle_unit"
    assert fault["parameters"] == {"factor": [1.0, math.radians(1)]}
    assert fault["standard_deviation"] is fault["log_evidence"] is fault["p_value"] is None
    assert fault["held_out"] == {"before": None, "after": None}
    assert strict(cli("diagnose", corrected, path, "--json").stdout)["verdict"] == "consistent"


def test_faults_that_are_known_are_set_right_and_not_looked_for(
    robot: Robot, clean_log: Log
) -> None:
    turned = changed(clean_log, swivel_rad=np.array(clean_log.swivel_rad) * [1.0, -1.0, 1.0, 1.0])

    def fitted(**options: Any) -> tuple[cdprcal.Diagnosis, list[str]]:
        steps: list[str] = []
        chosen = cdprcal.DiagnoseOptions(effects=["mass"], **options)
        return cdprcal.diagnose(robot, [turned, turned], chosen, steps.append), steps

    found, steps = fitted()
    again, steps_again = fitted(faults=found.faults)
    assert [fault.name for fault in found.faults] == ["swivel_sign"]
    assert [fault.name for fault in again.faults] == ["swivel_sign"]
    assert steps[0].startswith("discrete faults")
    assert steps[1:] == ["found: the swivel of cable 2 counts backwards", *steps_again]
    assert again.corrected.effects[0].parameters == found.corrected.effects[0].parameters
    np.testing.assert_array_equal(
        again.initial_pose_after.position_m, found.initial_pose_after.position_m
    )
    without, _ = fitted(faults=[])
    assert without.faults == []
    gaps = zip(without.gap, found.gap, strict=True)
    worse = {a.channel: a.train_rms / b.train_rms for a, b in gaps if not a.after_effect}
    assert max(worse.values()) > 10.0, worse


def test_the_table_says_what_why_and_how_much(cli: Cli, biased_log: Log, tmp_path: Path) -> None:
    ran = cli("diagnose", "irma4", written(biased_log, tmp_path / "biased.csv"))
    assert (ran.code, ran.stdout.splitlines()[0]) == (0, "explained: load_cell_bias")
    for text in ("cable 4", " N ", "tare", "tension", "± σ"):
        assert text in ran.stdout
    assert "+ load_cell_bias" in ran.stdout  # the gap after that step


def test_what_is_left_open_is_said_to_people(
    cli: Cli, biased_log: Log, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """What a document may also hold: rejected effects, what no effect explains, blind spots."""
    ran = cli("diagnose", "irma4", written(biased_log, tmp_path / "biased.csv"), "--json")
    document = json.loads(ran.stdout)
    document["verdict"] = "unexplained"
    document["left_out"] = ["12 readings of cable 2"]
    document["rejected"] = [
        {"name": "cable_sag", "reason": "too early"},
        {"name": "mass", "reason": "held-out poses do not get better"},
        {"name": "cable_sag", "reason": "its interval holds zero"},
    ]
    document["unexplained"] = [
        {"channel": "length", "rms": 0.0123, "sigma": 0.001, "depends_on": "cable 3"},
        {"channel": "yaw", "rms": math.radians(1.5), "sigma": 0.0, "depends_on": "time"},
        {"channel": "balance", "rms": 25.0, "sigma": 2.0, "depends_on": "height"},
    ]
    document["identifiability"] = [
        {"name": "yaw_drift", "detectable": None, "detectable_after": None},
        {"name": "cable_elasticity", "detectable": 4.0, "detectable_after": 2.0},
        {"name": "sensor_delay", "detectable": 9e4, "detectable_after": 7e4},  # no delay is hours
        {"name": "mass", "detectable": 0.5, "detectable_after": 0.4},  # would have shown
        {"name": "load_cell_bias", "detectable": 9.0, "detectable_after": 9.0},  # was found
    ]
    document["next"] = ["measure at (0, 0, 1.2)"]
    capfd.readouterr()
    print_diagnosis(document)
    said = capfd.readouterr().out
    assert "other effects: 3 could be there unseen, 2 looked at and rejected (--verbose" in said
    print_diagnosis(document, verbose=True)
    said = capfd.readouterr().out
    assert said.startswith("unexplained: ")
    assert "left out: 12 readings of cable 2" in said
    assert re.search(r"cable_sag +its interval holds zero", said)  # the last word
    assert "too early" not in said
    assert re.search(r"mass +held-out poses do not get better", said)
    assert "unexplained: length, rms 12.300 mm where" in said
    assert "ripple by 1.000 mm; it depends on cable 3" in said
    assert "unexplained: yaw, rms 1.500 °" in said
    assert "unexplained: balance, rms 25.000 N" in said
    (blind,) = re.findall("this log does not show: (.*)", said)
    typical = {info.name: info.parameters[0].typical for info in cdprcal.effect_catalogue()}
    # Twice the typical compliance is half the typical stiffness, in newtons; kN for people.
    stiffness = 1.0 / (2.0 * typical["cable_elasticity"])
    assert blind == (
        f"yaw_drift of any size; cable_elasticity above {1e-3 * stiffness:.3g} kN (2 × its typical "
        "size); sensor_delay of any believable size"
    )
    assert "next: measure at (0, 0, 1.2)" in said


def test_pictures_are_written(cli: Cli, biased_log: Log, tmp_path: Path) -> None:
    log = written(biased_log, tmp_path / "biased.csv")
    folder = tmp_path / "new" / "pictures"
    assert cli("diagnose", "irma4", log, "--plot", folder).code == 0
    names = {path.name for path in folder.iterdir()}
    assert names == {"residuals.png", "gap.png", "ranking.png", "held_out.png"}
    for path in folder.iterdir():
        assert path.read_bytes().startswith(b"\x89PNG")
        assert path.stat().st_size > 10_000
    cli("diagnose", "irma4", log, "--plot", log).refused("biased.csv")  # a file, not a folder


def test_several_logs_are_explained_together(cli: Cli, robot: Robot, tmp_path: Path) -> None:
    rates = [0.0006, -0.0004]
    paths = []
    for i, rate in enumerate(rates):
        clean = a_clean_log(robot, 5 + i)  # the same noise twice would be evidence twice
        angles = clean.roll_pitch_yaw_rad.copy()
        angles[:, 2] += rate * clean.time_s
        log = changed(clean, roll_pitch_yaw_rad=angles)
        paths.append(written(log, tmp_path / f"run{i}.csv"))
    corrected = tmp_path / "corrected.yaml"
    result = strict(cli("diagnose", "irma4", *paths, "--json", "-o", corrected).stdout)
    (effect,) = result["effects"]
    assert effect["name"] == "yaw_drift"
    np.testing.assert_allclose(effect["parameters"]["rate_rad_s"], rates, atol=5e-5)
    effects = cdprcal.load_robot(str(corrected)).effects
    assert [e.run for e in effects] == ["run0.csv", "run1.csv"]
    for path in paths:
        assert strict(cli("diagnose", corrected, path, "--json").stdout)["verdict"] == "consistent"


def test_what_no_name_explains_is_described(cli: Cli, clean_log: Log, tmp_path: Path) -> None:
    # A swivel encoder that follows the square of its cable's tension: nothing in the catalogue.
    tension = clean_log.tension_N
    swivel = clean_log.swivel_rad + 0.05 * (tension / tension.mean()) ** 2
    log = written(changed(clean_log, swivel_rad=swivel), tmp_path / "odd.csv")
    corrected, pictures = tmp_path / "corrected.yaml", tmp_path / "pictures"
    ran = cli("diagnose", "irma4", log, "--json", "-o", corrected, "--plot", pictures)
    result = strict(ran.stdout)
    assert (ran.code, result["verdict"]) == (0, "described")
    (effect,) = result["effects"]
    assert effect["described"]
    assert "tension_N" in effect["formula"]["swivel_rad"]
    course = effect["course"]
    assert (course["to"], course["variable"]) == ("swivel_rad", "tension_N")
    read = np.array([point["read"] for point in course["points"]])
    added = np.array([point["added"] for point in course["points"]])
    assert np.std(read - added) < 0.1 * np.std(read)
    assert (pictures / "formulas.png").stat().st_size > 10_000
    known = cli("diagnose", corrected, log, "--json")
    assert strict(known.stdout)["verdict"] == "consistent"


def test_what_nothing_explains_is_said_and_fails(cli: Cli, clean_log: Log, tmp_path: Path) -> None:
    # A swivel encoder that hops with the least change of tension: no law that anybody could find.
    hops = 0.12 * np.sin(1e3 * np.round(clean_log.tension_setpoint_N))
    log = written(changed(clean_log, swivel_rad=clean_log.swivel_rad + hops), tmp_path / "odd.csv")
    ran = cli("diagnose", "irma4", log, "--json")
    result = strict(ran.stdout)
    assert (ran.code, result["verdict"]) == (1, "unexplained")
    channels = {left["channel"] for left in result["unexplained"]}
    assert "swivel" in channels
    for left in result["unexplained"]:
        assert left["rms"] > left["sigma"] > 0
        assert left["depends_on"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["nowhere.yaml", "LOG"], "nowhere.yaml"),
        (["irma4", "missing.csv"], "missing.csv"),
        (["irma4", "LOG", "-o", "no/such/folder/c.yaml"], "no/such/folder/c.yaml"),
        (["irma4"], "LOG"),
    ],
)
def test_wrong_use_is_one_message(
    cli: Cli, log_path: Path, arguments: list[str], text: str
) -> None:
    ran = cli("diagnose", *(str(log_path) if a == "LOG" else a for a in arguments))
    assert ran.code == 2
    assert ran.stdout == ""
    assert text in ran.stderr
    assert "Traceback" not in ran.stderr


def test_the_catalogue_is_data() -> None:
    catalogue = cdprcal.effect_catalogue()
    names = [info.name for info in catalogue]
    assert len(names) == len(set(names)) == 33
    for info in catalogue:
        assert info.equation
        assert info.sentence
        assert info.remedy
        assert info.settle
        assert set(info.confused_with) <= set(names)
        for parameter in info.parameters:
            assert 0 < parameter.typical < parameter.plausible
            assert parameter.times_reference(cdprcal.load_robot("irma4")) == 1.0
            if parameter.unit not in ("1", "s", "rad", "rad/s"):
                assert parameter.of


def test_sizes_are_those_of_the_robot() -> None:
    ring = cdprcal.load_robot("ring3")
    infos = {info.name: info for info in cdprcal.effect_catalogue()}
    weight = ring.platform.mass_kg / cdprcal.load_robot("irma4").platform.mass_kg
    for name in ("mass", "load_cell_bias", "external_force"):
        assert infos[name].parameters[0].times_reference(ring) == pytest.approx(weight)
    assert infos["cable_elasticity"].parameters[0].times_reference(ring) == pytest.approx(
        1.0 / weight
    )
    assert infos["load_cell_gain"].parameters[0].times_reference(ring) == 1.0


def test_progress_can_stop_and_its_errors_come_through(robot: Robot, biased_log: Log) -> None:
    steps: list[str] = []
    found = cdprcal.diagnose(robot, [biased_log], progress=steps.append)
    assert steps[0].startswith("discrete faults")
    assert [effect.info.name for effect in found.effects] == ["load_cell_bias"]
    stopped = cdprcal.diagnose(robot, [biased_log], progress=lambda step: "scan" not in step)
    assert stopped.effects == []

    def interrupt(step: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        cdprcal.diagnose(robot, [biased_log], progress=interrupt)


def test_effects_of_a_robot_are_checked_kept_and_pickled(robot: Robot) -> None:
    import pickle

    effect = cdprcal.AppliedEffect(name="load_cell_bias", parameters={"bias_N": BIAS_N})
    parts: dict[str, Any] = {
        "name": "r",
        "platform": robot.platform,
        "cables": robot.cables,
        "tension_limits_N": robot.tension_limits_N,
    }
    made = Robot(**parts, effects=[effect])
    for copy in (made, pickle.loads(pickle.dumps(made))):
        assert copy.effects[0].name == "load_cell_bias"
        assert copy.effects[0].parameters == {"bias_N": BIAS_N}
    wrong = cdprcal.AppliedEffect(name="load_cell_bias", parameters={"bias_N": [1.0]})
    with pytest.raises(cdprcal.InputError, match="bias_N: must have 4 values"):
        Robot(**parts, effects=[wrong])


def test_what_is_left_of_absolute_sensors_has_their_units() -> None:
    left = {"rms": 0.0123, "sigma": 0.001, "depends_on": "time"}
    for channel, shown in (("position", "12.300 mm"), ("direct_length", "12.300 mm")):
        assert shown in unexplained_line({"channel": channel} | left)
    assert "0.705 °" in unexplained_line({"channel": "absolute_yaw"} | left)
