"""``cdprcal geometry``: the frame of a machine that writes belt lengths."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import cdprcal
from cdprcal.mapping import load_mapped, read_raw
from cdprcal.schemas import schema
from scripts import executed

PAGE = Path(__file__).resolve().parents[2] / "docs" / "robots" / "maslow.md"
SHARED = Path(os.environ.get("CDPRCAL_SHARED_DATA", "none")) / "robots" / "maslow"
FRAME = np.array([[0.0, 0.0], [3.042, 0.0], [3.037, 2.128], [-0.003, 2.126]])


def _blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """The files of the page, made by its own code."""
    robot, the_map = _blocks("yaml")
    (tmp_path / "maslow.yaml").write_text(robot)
    (tmp_path / "map.yaml").write_text(the_map)
    subprocess.run([sys.executable, "-c", _blocks("python")[0]], cwd=tmp_path, check=True)
    return tmp_path


def _run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return executed([sys.executable, "-m", "cdprcal", *arguments], cwd=folder)


def test_the_page_finds_the_frame_of_its_twin(machine: Path) -> None:
    command = _blocks("sh")[0].split()
    done = _run(machine, *command[1:], "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    jsonschema.validate(document, schema("geometry"))
    anchors, sigma = np.array(document["anchors_m"]), np.array(document["anchors_sigma_m"])
    assert (abs(anchors[:, [0, 2]] - FRAME) <= 3.5 * sigma[:, [0, 2]] + 1e-9).all()
    (offset,) = document["offset_m"]
    assert abs(offset["value"] - 0.06) < 3 * offset["sigma"]
    assert document["rms_m"] < document["held_out_rms_m"] < 1.3e-3
    assert any("scale of all lengths" in text for text in document["not_determined"])
    corrected = cdprcal.load_robot(str(machine / "calibrated.yaml"))
    places = [cable.pulley.position_m for cable in corrected.cables]
    assert np.allclose(places, anchors)
    table = _run(machine, *command[1:])
    assert table.stdout.startswith("converged")


def test_the_calibrated_file_takes_the_offset_off(machine: Path) -> None:
    command = _blocks("sh")[0].split()
    assert _run(machine, *command[1:]).returncode == 0
    calibrated = cdprcal.load_robot(str(machine / "calibrated.yaml"))
    (fault,) = calibrated.effects
    assert fault.name == "whole_length_offset"
    assert np.allclose(fault.parameters["offset_m"], 0.06, atol=0.02)
    log = load_mapped(str(machine / "grid.txt"), str(machine / "map.yaml"), calibrated).log
    again = cdprcal.find_frame(calibrated, [log])
    (left,) = again.offset_m
    assert abs(left.value) < left.sigma
    (total,) = again.corrected.effects  # one, not one a time
    assert np.allclose(
        total.parameters["offset_m"], np.array(fault.parameters["offset_m"]) + left.value
    )
    found = cdprcal.calibrate(calibrated, log).result
    assert found.residual_rms.direct_length_m < 2e-3


@pytest.mark.parametrize(("points", "code"), [(9, 3), (100, 0)])
def test_a_frame_known_no_better_than_by_eye_is_said_to_be_so(
    machine: Path, points: int, code: int
) -> None:
    """Of points in the middle of the frame alone; the file is written all the same."""
    lines = (machine / "grid.txt").read_text().splitlines(keepends=True)
    lengths_m = np.array([[float(x) for x in re.findall(r":([\d.]+)", line)] for line in lines])
    from_middle = np.abs(lengths_m - np.median(lengths_m, axis=0)).max(axis=1)
    chosen = np.sort(np.argsort(from_middle)[:points])
    (machine / "grid.txt").write_text("".join(lines[k] for k in chosen))
    command = _blocks("sh")[0].split()
    done = _run(machine, *command[1:], "--json")
    assert done.returncode == code, done.stderr
    document = json.loads(done.stdout)
    jsonschema.validate(document, schema("geometry"))
    said = [caveat["message"] for caveat in document["caveats"] if caveat["code"] == "imprecise"]
    assert len(said) == (code == 3)
    assert all(re.match(r"pulley \d is known to ± [1-9]\d+ mm ", message) for message in said)
    assert (machine / "calibrated.yaml").exists()
    table = _run(machine, *command[1:], "--force")
    assert table.returncode == code
    assert all(message.split(" (1")[0] in table.stdout + table.stderr for message in said)


def test_records_are_read_from_between_words(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("First run\n {a:1.5, b:-2},\n{a:2.5,\n b:3e1}\n\nSecond {a: 1, b: 2}\n")
    raw = read_raw(path)
    assert raw.kind == "records"
    assert raw.columns["a"].values.tolist() == [1.5, 2.5, 1.0]
    assert raw.columns["b"].values.tolist() == [-2.0, 30.0, 2.0]
    assert raw.columns["run"].values.tolist() == [1.0, 1.0, 2.0]
    assert raw.line is not None
    assert raw.line.tolist() == [2, 3, 6]


def test_records_of_other_names_are_refused_by_line(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("{a:1, b:2}\n{a:1, b:2}\n{a:1, c:2}\n")
    with pytest.raises(cdprcal.InputError, match=r"notes.txt:3: .*a, c"):
        read_raw(path)


def test_one_run_of_several_is_taken_by_its_number(machine: Path) -> None:
    text = (machine / "grid.txt").read_text()
    (machine / "two.txt").write_text("First\n" + text[: len(text) // 2] + "\nSecond\n" + text)
    the_map = (machine / "map.yaml").read_text()
    for run in (1, 2, 3):
        (machine / "run.yaml").write_text(the_map + f"run: {run}\n")
        if run == 3:
            with pytest.raises(cdprcal.InputError, match="has 2 runs, and none is 3"):
                load_mapped(machine / "two.txt", machine / "run.yaml", None)
            continue
        log = load_mapped(machine / "two.txt", machine / "run.yaml", None).log
        assert log.sample_count == (50, 100)[run - 1]


def test_too_few_poses_end_with_1_and_write_nothing(machine: Path) -> None:
    lines = (machine / "grid.txt").read_text().splitlines()
    (machine / "few.txt").write_text("\n".join(lines[:2]))
    done = _run(machine, "geometry", "maslow.yaml", "few.txt", "--map", "map.yaml", "-o", "x.yaml")
    assert done.returncode == 1
    assert not (machine / "x.yaml").exists()


def test_wrong_words_are_wrong_use(machine: Path) -> None:
    base = ("geometry", "maslow.yaml", "grid.txt", "--map", "map.yaml")
    for option in (("--offset", "two"), ("--poses", "some")):
        done = _run(machine, *base, *option)
        assert done.returncode == 2
        assert "must be" in done.stderr


@pytest.mark.skipif(not SHARED.is_dir(), reason="CDPRCAL_SHARED_DATA is not there")
@pytest.mark.parametrize("name", ["altspace_concrete_anchors.txt"])
def test_measured_frames_close_and_a_hidden_offset_is_found(name: str, tmp_path: Path) -> None:
    records = read_raw(SHARED / name).columns
    lengths = np.stack([records[key].values for key in ("bl", "br", "tr", "tl")], axis=1) * 1e-3
    robot = cdprcal.parse_robot(_blocks("yaml")[0], "maslow")
    offsets = []
    for hidden_m in (0.0, 0.03, 0.2):
        log = cdprcal.Log(
            time_s=np.arange(len(lengths), dtype=float), direct_length_m=lengths + hidden_m
        )
        found = cdprcal.geometry(robot, log)
        assert found.status == cdprcal.FrameStatus.converged
        assert found.held_out_rms_m < 1.7e-3
        (offset,) = found.offset_m
        offsets.append(offset.value - hidden_m)
        assert abs(offset.value - hidden_m) < 3 * offset.sigma
    assert np.ptp(offsets) < 1e-3
