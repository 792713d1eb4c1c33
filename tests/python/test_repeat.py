"""Result files: what they hold is enough to solve again."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal.io.result_file import (
    calibrate_options,
    calibrate_options_as_dict,
    load_result,
    log_sha256,
)
from conftest import Cli


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--method", "static", "--formulation", "paper"),
        ("--method", "kinematic", "--noise", "data"),
        ("--at", "2,10,18,26", "--noise", "specified"),
    ],
)
def test_a_calibration_is_solved_again_from_its_file_alone(
    cli: Cli, log_path: Path, tmp_path: Path, options: tuple[str, ...]
) -> None:
    path = tmp_path / "result.json"
    cli("calibrate", "irma4", log_path, "-o", path, *options)
    log_path.unlink()
    ran = cli("repeat", path, "--json")
    document = json.loads(ran.stdout)
    assert (ran.code, document["same"]) == (0, True), ran.stderr
    assert document["difference_sigma"] < 0.1
    held = json.loads(path.read_text())
    assert document["again"].keys() == held.keys() - {"inputs"}
    assert document["again"]["cost"] == pytest.approx(held["cost"], rel=1e-2)


def test_a_diagnosis_is_solved_again_from_its_file_alone(
    cli: Cli, log_path: Path, tmp_path: Path
) -> None:
    path = tmp_path / "result.json"
    cli("diagnose", "irma4", log_path, "--result", path)
    log_path.unlink()
    ran = cli("repeat", path)
    assert ran.code == 0
    assert "the same again: consistent" in ran.stdout


def test_a_platform_that_cannot_move_everywhere_is_solved_again(cli: Cli, tmp_path: Path) -> None:
    """Its σ is zero in some directions, in which nothing can differ."""
    log, path = tmp_path / "run.csv", tmp_path / "result.json"
    cli("generate", "belts4", "--grid", "3x1x3", "-o", log)
    cli("calibrate", "belts4", log, "-o", path)
    ran = cli("repeat", path, "--json")
    assert (ran.code, ran.stderr) == (0, "")
    assert json.loads(ran.stdout)["difference_sigma"] < 0.1
    document = json.loads(path.read_text())
    for variance in (-1e-9, 0.0):
        document["covariance"] = np.diag([variance] * 6).tolist()
        path.write_text(json.dumps(document))
        cli("repeat", path).refused("covariance: a variance is not positive; write it anew")


def test_another_result_is_noticed(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    cli("calibrate", "irma4", log_path, "-o", path)
    document = json.loads(path.read_text())
    document["initial_pose"]["position_m"][0] += 0.5 * document["standard_deviation"][0]
    path.write_text(json.dumps(document))
    ran = cli("repeat", path)
    assert ran.code == 1
    assert "not the same: the initial pose moved by 0.5" in ran.stdout


def test_a_changed_log_is_refused(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    cli("calibrate", "irma4", log_path, "-o", path)
    document = json.loads(path.read_text())
    document["inputs"]["logs"][0]["sha256"] = "0" * 64
    path.write_text(json.dumps(document))
    cli("repeat", path).refused("was changed: SHA-256 does not fit")
    document["inputs"]["logs"][0]["csv_gzip_base64"] = "H4sI"
    path.write_text(json.dumps(document))
    cli("repeat", path).refused("its log is damaged")


def test_what_is_no_result_file_is_said(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    cli("repeat", log_path).refused("is no JSON")
    cli("repeat", tmp_path / "none.json").refused("cannot be read")


def test_the_log_comes_back_bit_for_bit(
    cli: Cli, log: cdprcal.Log, log_path: Path, tmp_path: Path
) -> None:
    path = tmp_path / "result.json"
    cli("calibrate", "irma4", log_path, "-o", path)
    (again,) = load_result(path).logs
    assert log_sha256(again) == log_sha256(log)
    for name in ("time_s", "length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"):
        np.testing.assert_array_equal(getattr(again, name), getattr(log, name))


def test_options_survive_the_way_through_a_file() -> None:
    options = cdprcal.CalibrateOptions(
        method=cdprcal.Method.statics,
        formulation=cdprcal.parse_formulation("paper"),
        noise=cdprcal.NoiseSource.from_data,
        at_s=[1.0, 2.5],
        segment=0,
        kinematic_spacing_s=0.5,
    )
    plain = json.loads(json.dumps(calibrate_options_as_dict(options)))
    assert calibrate_options_as_dict(calibrate_options(plain)) == plain
    with pytest.raises(cdprcal.InputError, match="options are damaged"):
        calibrate_options({})
