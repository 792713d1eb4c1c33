"""The blind bench: cases that depend on nothing but their number, and a short study."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest
from typer.testing import CliRunner

from cdprcal import _core
from cdprcal.testing.blind_bench.__main__ import app
from cdprcal.testing.blind_bench.cases import NoiseKind, Setting, Split, draw_case, kind_of
from cdprcal.testing.blind_bench.report import markdown, read_lines
from cdprcal.testing.blind_bench.score import CLASSES, score
from cdprcal.testing.blind_bench.simulate import SimulationError, simulate

SETTING = Setting(poses=8, noise=0.2)


def test_kinds_come_in_their_shares_in_every_block() -> None:
    for block in range(2):
        numbers = range(110 * block, 110 * (block + 1))
        kinds = Counter(kind_of(Split.tuning, 5, SETTING, number) for number in numbers)
        assert kinds == {"clean": 30, "one": 40, "two": 20, "outside": 10, "fault": 10}


def test_a_case_is_the_same_whenever_drawn_and_other_for_other_splits_and_seeds() -> None:
    again = [draw_case(Split.tuning, 1, SETTING, 7, 4) for _ in range(2)]
    assert again[0] == again[1]
    others = [
        draw_case(Split.sealed, 1, SETTING, 7, 4),
        draw_case(Split.tuning, 2, SETTING, 7, 4),
        draw_case(Split.tuning, 1, Setting(27, 0.2), 7, 4),
    ]
    assert len({c.seed for c in [again[0], *others]}) == 4


def test_sizes_names_and_misstated_noise_are_as_documented() -> None:
    catalogue = {e.name for e in _core.effect_catalogue()}
    cases = [draw_case(Split.tuning, 3, SETTING, number, 4) for number in range(330)]
    hidden = [h for c in cases if c.kind in ("one", "two") for h in c.hidden]
    assert {h.name for h in hidden} == catalogue == {n for names in CLASSES.values() for n in names}
    assert all(0.7 <= h.size <= 2.0 for h in hidden)
    misstated = [c for c in cases if c.stated != 1.0]
    assert {c.stated for c in misstated} == {0.5, 2.0}
    assert len(misstated) / len(cases) == pytest.approx(1 / 3, abs=0.1)


def test_errors_of_whole_poses_do_not_show_as_ripple() -> None:
    number = next(n for n in range(200) if kind_of(Split.tuning, 1, SETTING, n) == "clean")
    white = simulate(draw_case(Split.tuning, 1, SETTING, number, 4), SETTING)
    steady = simulate(
        draw_case(Split.tuning, 1, SETTING, number, 4), Setting(8, 0.2, NoiseKind.pose)
    )
    ripple = [_core.channel_noise(made.log.length_m[:, 0]) for made in (white, steady)]
    assert ripple[1] < 0.3 * ripple[0]


def test_a_short_study_runs_goes_on_where_it_stopped_and_reports(tmp_path: Path) -> None:
    def run(cases: int) -> None:
        ran = CliRunner().invoke(
            app, ["run", "--cases", str(cases), "--poses", "8", "-o", str(tmp_path)]
        )
        assert ran.exit_code == 0, ran.output

    run(6)
    (path,) = tmp_path.glob("*.jsonl")
    first = path.read_text()
    path.write_text(first + '{"cut": ')  # an interruption in the middle of a line
    run(14)
    assert path.read_text().startswith(first)
    lines = read_lines(path)
    numbers = [line["case"]["number"] for line in lines]
    assert sorted(numbers) == list(range(14))
    assert Counter(line["status"] for line in lines)["diagnosed"] >= 12
    scores = score(lines)
    # A study of this size cannot measure the rates: it can show that the bench can tell.
    assert scores.rates["clean: an effect named (false alarm)"].value <= 0.5
    assert scores.rates["one: right name first, of those named"].value >= 0.5
    text = markdown([path])
    assert "Hidden → named first" in text
    assert f"Failures ({len(scores.failures)})" in text


def test_one_process_and_two_find_the_same_to_the_bit(tmp_path: Path) -> None:
    found = []
    for jobs in (1, 2):
        folder = tmp_path / str(jobs)
        words = ["run", "--cases", "4", "--poses", "8", "--jobs", str(jobs), "-o", str(folder)]
        ran = CliRunner().invoke(app, words)
        assert ran.exit_code == 0, ran.output
        (path,) = folder.glob("*.jsonl")
        clocks = ("simulation_s", "diagnosis_s")
        found.append(
            [{k: v for k, v in line.items() if k not in clocks} for line in read_lines(path)]
        )
    assert found[0] == found[1]
    assert len(found[0]) == 4


def test_a_wrong_name_counts_as_wrong(tmp_path: Path) -> None:
    number = next(n for n in range(200) if kind_of(Split.tuning, 1, SETTING, n) == "one")
    ran = CliRunner().invoke(
        app,
        ["run", "--cases", str(number + 1), "--only", "one", "--poses", "8", "-o", str(tmp_path)],
    )
    assert ran.exit_code == 0, ran.output
    (path,) = tmp_path.glob("*.jsonl")
    line = read_lines(path)[-1]
    effect = {
        "name": "something_else",
        "values": [1.0],
        "deviation": [1.0],
        "log_evidence": 9.0,
        "rivals": [],
        "held_out_before": 9.0,
        "held_out_after": 5.0,
    }
    line["found"]["effects"] = [effect]
    scores = score([json.loads(json.dumps(line))])
    assert scores.rates["one: right name first, of those named"].hits == 0
    assert scores.rates["one: right class first, of those named"].hits == 0
    assert len(scores.failures) == 1


def test_a_case_that_cannot_be_run_is_a_line_that_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from cdprcal.testing.blind_bench import judge

    def not_simulated(*_: object) -> None:
        raise SimulationError("holding: cable 2 slack")

    def refused(*_: object) -> None:
        raise _core.InputError("run: no poses")

    monkeypatch.setattr(judge, "simulate", not_simulated)
    line = judge.run_case(Split.tuning, 1, SETTING, 0)
    assert (line["status"], line["reason"]) == ("not_simulated", "holding: cable 2 slack")
    monkeypatch.undo()
    monkeypatch.setattr("cdprcal._core.diagnose", refused)
    line = judge.run_case(Split.tuning, 1, SETTING, 0)
    assert (line["status"], line["reason"]) == ("refused", "run: no poses")
    assert "found" not in line
    # Neither is a failure of the diagnosis; the report counts them apart.
    path = tmp_path / "study.jsonl"
    path.write_text(json.dumps(line) + "\n")
    ran = CliRunner().invoke(app, ["report", str(path), "-o", str(tmp_path / "report.md")])
    assert ran.exit_code == 0, ran.output
    text = (tmp_path / "report.md").read_text()
    assert "8 poses" in text.replace("-", " ")
    assert CliRunner().invoke(app, ["report", str(path)]).output == text


def test_wrong_use_is_said(tmp_path: Path) -> None:
    ran = CliRunner().invoke(app, ["run", "--poses", "9", "-o", str(tmp_path)])
    assert ran.exit_code == 2
    assert "--poses: must be 8 or 27, not 9" in ran.output
    assert list(tmp_path.iterdir()) == []
