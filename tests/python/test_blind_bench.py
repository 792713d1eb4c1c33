"""The blind bench: cases that depend on nothing but their number, and a short study."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from cdprcal import _core
from cdprcal.testing.altered import altered
from cdprcal.testing.blind_bench import faults
from cdprcal.testing.blind_bench.__main__ import app
from cdprcal.testing.blind_bench.cases import Setting, Split, draw_case, kind_of
from cdprcal.testing.blind_bench.families import FAMILIES
from cdprcal.testing.blind_bench.judge import run_case
from cdprcal.testing.blind_bench.machines import Machine, draw_machine
from cdprcal.testing.blind_bench.report import (
    calibration_silently_wrong,
    markdown,
    read_lines,
    silently_wrong,
)
from cdprcal.testing.blind_bench.score import CLASSES, score
from cdprcal.testing.blind_bench.signals import SIGNALS, Recording
from cdprcal.testing.blind_bench.simulate import SimulationError, simulate
from conftest import few

SETTING = Setting(poses=8, noise=0.2)


def test_kinds_come_in_their_shares_in_every_block() -> None:
    for block in range(2):
        numbers = range(110 * block, 110 * (block + 1))
        kinds = Counter(kind_of(Split.tuning, 5, SETTING, number) for number in numbers)
        assert kinds == {"clean": 30, "one": 40, "two": 20, "outside": 10, "fault": 10}


def test_a_case_is_the_same_whenever_drawn_and_other_for_other_splits_and_seeds() -> None:
    again = [draw_case(Split.tuning, 1, SETTING, 7) for _ in range(2)]
    assert again[0] == again[1]
    others = [
        draw_case(Split.sealed, 1, SETTING, 7),
        draw_case(Split.tuning, 2, SETTING, 7),
        draw_case(Split.tuning, 1, Setting(27, 0.2), 7),
    ]
    assert len({c.seed for c in [again[0], *others]}) == 4


def test_sizes_names_and_misstated_noise_are_as_documented() -> None:
    catalogue = _core.effect_catalogue()
    at_rests = {
        e.name
        for e in catalogue
        if e.shows != _core.Shows.in_moving_balance and not e.all_or_nothing
    }
    cases = [draw_case(Split.tuning, 3, SETTING, number) for number in range(330)]
    hidden = [h for c in cases if c.kind in ("one", "two") for h in c.hidden]
    assert {h.name for h in hidden} == at_rests
    assert {e.name for e in catalogue} == {n for names in CLASSES.values() for n in names}
    assert all(0.7 <= h.size <= 2.0 for h in hidden)
    misstated = [c for c in cases if c.stated != 1.0]
    assert {c.stated for c in misstated} == {0.5, 2.0}
    assert len(misstated) / len(cases) == pytest.approx(1 / 3, abs=0.1)


def test_cases_of_the_first_studies_are_drawn_as_they_were() -> None:
    # Seeds of the simulator that the first studies had; what catalogues grow by does not move them.
    first = {5: 3035002645696570931, 6: 3427423371101231838, 7: 3577116183294215125}
    for number, seed in first.items():
        case = draw_case(Split.tuning, 1, SETTING, number)
        assert (case.kind, case.seed) == ("clean", seed)
        assert (case.machine, case.signal, case.noise, case.rests) == (
            Machine(),
            "white",
            None,
            None,
        )
    assert SETTING.name == "8-poses_0.2-sigma_reading"
    assert Setting(27, 0.5, "rest").name == "27-poses_0.5-sigma_pose"


def test_errors_of_whole_poses_do_not_show_as_ripple() -> None:
    number = next(n for n in range(200) if kind_of(Split.tuning, 1, SETTING, n) == "clean")
    case = draw_case(Split.tuning, 1, SETTING, number)
    made = [simulate(replace(case, signal=signal), SETTING) for signal in ("white", "rest")]
    ripple = [_core.channel_noise(m.log.length_m[:, 0]) for m in made]
    assert ripple[1] < 0.3 * ripple[0]


def spoilt(signal: str, rows: int = 20_000) -> Recording:
    """Constant readings of two cables at two places in turn, with the errors of a signal."""
    time_s = np.linspace(0.0, 0.01 * (rows - 1), rows)
    names = ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
    recording = Recording(
        time_s=time_s,
        readings={name: np.ones((rows, 2)) for name in names},
        position_m=np.where((np.arange(rows) % 2)[:, None], [0.1, 0.2, 0.3], [-0.4, 0.2, 0.1]),
        tension_setpoint_N=np.ones((rows, 2)),
        rests_s=[(1.0, 3.0), (5.0, 9.0)],
        scale=dict.fromkeys(names, 0.1),
        quantum=dict.fromkeys(names, 0.3),
        turn=2.0 * np.pi,
        size_m=1.0,
    )
    if signal in ("held", "filtered"):  # they change what others make of the readings
        recording.readings["length_m"] += np.random.default_rng(2).normal(size=(rows, 2))
    spoil = SIGNALS[signal].spoil
    assert spoil
    spoil(recording, np.random.default_rng(1))
    return recording


def test_each_signal_errs_in_its_own_way() -> None:
    def errors(signal: str) -> Any:
        return spoilt(signal).readings["length_m"] - 1.0

    rest = errors("rest")
    assert np.ptp(rest[100:300], axis=0) == pytest.approx(0.0, abs=1e-12)
    assert abs(rest[200] - rest[600]).min() > 0.0
    place = errors("place")
    assert np.ptp(place[::2], axis=0) == pytest.approx(0.0, abs=1e-12)
    assert abs(place[0] - place[1]).min() > 0.0
    walks = [spoilt("walk", 500).readings[n] - 1.0 for n in spoilt("walk", 500).readings]
    assert np.diff(walks[0], axis=0).std() < 0.2 * walks[0].std()
    wander = spoilt("wander", 2000).readings
    about_zero = np.hstack([wander[n] - 1.0 for n in wander])
    assert np.sqrt(np.mean(about_zero**2)) == pytest.approx(0.1, rel=0.5)
    assert np.diff(about_zero, axis=0).std() < 0.1 * np.sqrt(np.mean(about_zero**2))
    tails = errors("heavy_tailed")
    assert tails.std() == pytest.approx(0.1, rel=0.3)
    assert abs(tails).max() > 6.0 * tails.std()
    coarse = spoilt("quantised").readings["tension_N"] / 0.3
    assert coarse == pytest.approx(np.round(coarse), abs=1e-9)
    held = spoilt("held").readings["length_m"]
    assert np.mean(np.diff(held[:, 0]) != 0.0) == pytest.approx(0.2, abs=0.01)
    filtered = spoilt("filtered").readings["length_m"][2000:, 0]
    assert 0.7 < np.corrcoef(filtered[1:], filtered[:-1])[0, 1] < 0.97
    spikes = errors("spiked")
    assert np.mean(spikes != 0.0) == pytest.approx(0.01, rel=0.2)
    assert abs(spikes[spikes != 0.0]).min() >= 1.0


class Drawn:
    """Draws what it is told."""

    def __init__(self, cut_off_Hz: float, sections: int) -> None:
        self.uniform = lambda *_: np.log(cut_off_Hz)
        self.integers = lambda _: sections
        self.random = lambda: 0.9  # all sensors


@pytest.mark.parametrize("sections", [0, 1, 2])
def test_low_passes_are_those_of_scipy(sections: int) -> None:
    signal = pytest.importorskip("scipy.signal")
    rate_Hz, cut_off_Hz = 100.0, 5.0
    rng = np.random.default_rng(1)
    names = ("length_m", "tension_N", "roll_pitch_yaw_rad")
    read = {name: 0.1 * np.cumsum(rng.normal(size=(300, 2)), axis=0) for name in names}
    recording = Recording(
        time_s=np.arange(300) / rate_Hz,
        readings={name: values.copy() for name, values in read.items()},
        position_m=np.zeros((300, 3)),
        tension_setpoint_N=np.ones((300, 2)),
        rests_s=[],
        scale={},
        quantum={},
        turn=2.0 * np.pi,
        size_m=1.0,
    )
    spoil = SIGNALS["low_passes"].spoil
    assert spoil
    drawn: Any = Drawn(cut_off_Hz, sections)
    spoil(recording, drawn)
    on, back = np.ones(9) / 9, np.ones(1)
    if sections:
        on, back = signal.butter(2 * sections, cut_off_Hz, fs=rate_Hz)
    for name in names[:2]:
        for column, values in enumerate(read[name].T):
            settled = signal.lfilter_zi(on, back) * values[0]
            expected = signal.lfilter(on, back, values, zi=settled)[0]
            assert recording.readings[name][:, column] == pytest.approx(expected, abs=1e-9)


def test_a_robot_built_larger_hangs_where_its_drawing_does() -> None:
    small, large = Machine("irma4"), Machine("irma4", mass_kg=500.0)
    k = large.scale.length
    assert large.robot().platform.mass_kg == pytest.approx(500.0)
    assert k**3 == pytest.approx(500.0 / 12.992)
    for ours, theirs in zip(small.setpoints(8)[:3], large.setpoints(8)[:3], strict=True):
        pose = _core.direct_from_tensions(small.robot(), ours).pose
        scaled = _core.direct_from_tensions(large.robot(), theirs).pose
        assert pose is not None
        assert scaled is not None
        assert scaled.position_m == pytest.approx(k * pose.position_m, abs=1e-6)


def test_robots_have_3_to_6_cables_and_any_weight() -> None:
    rng = np.random.default_rng(3)
    machines = [draw_machine(rng) for _ in range(60)]
    assert {m.cables for m in machines} == {3, 4, 5, 6}
    assert {m.name for m in machines} >= {"irma4", "ring3", "ring5"}
    masses = [m.robot().platform.mass_kg for m in machines]
    assert 0.3 <= min(masses) < 1.0
    assert 150.0 < max(masses) <= 500.0
    six = next(m for m in machines if m.cables == 6)
    assert len(six.setpoints(8)) == 8


def test_what_was_hidden_is_in_the_units_of_the_robot() -> None:
    setting = Setting(8, 0.2, "weights")
    cases = [draw_case(Split.tuning, 1, setting, number) for number in range(110)]
    typical = {e.name: e.parameters[0].typical for e in _core.effect_catalogue()}
    biased = [c for c in cases for h in c.hidden if h.name == "load_cell_bias"]
    assert {round(c.machine.mass_kg or 0.0, 1) for c in biased} == {0.3, 13.0, 100.0, 500.0}
    for case in biased:
        (hidden,) = case.hidden
        rms = float(np.sqrt(np.mean(np.square(hidden.values))))
        own = hidden.size * typical["load_cell_bias"] * case.machine.scale.force
        assert rms == pytest.approx(own)


@pytest.mark.parametrize("family", list(FAMILIES))
def test_every_family_makes_logs_of_its_kind(family: str) -> None:
    setting = Setting(8, 0.2, family)
    for number in range(4):  # what the start-up refuses is a case, too: not every one of them
        case = draw_case(Split.tuning, 1, setting, number)
        try:
            made = simulate(case, setting)
        except SimulationError:
            continue
        break
    assert made.log.time_s[-1] > 3.0
    assert made.log.tension_N.shape[1] == (case.machine.cables if case.machine.load_cells else 0)
    assert made.log.swivel_rad.shape[1] == (case.machine.cables if case.machine.swivels else 0)
    assert case.machine.load_cells == (family != "no_load_cells")
    assert case.machine.swivels == (family != "no_swivels")
    assert (case.noise is None) == (family in ("white", "rest", "quantised", "faults"))
    period_s = float(np.median(np.diff(made.log.time_s)))
    assert period_s == pytest.approx(0.02 if family == "held" else 0.1)
    if case.rests:
        assert case.rests[1] == 1 if family == "one_rest" else 2 <= case.rests[1] <= 4


def test_faults_in_the_readings_are_those_that_a_robot_file_sets_right() -> None:
    rng = np.random.default_rng(5)
    robot = Machine().robot()
    tension_N = rng.uniform(50.0, 100.0, size=(3, 4))
    order, tensions = [1.0, 2.0, 3.0, 4.0], [2.0, 3.0, 1.0, 4.0]
    readings = {"tension_N": tension_N.copy(), "tension_setpoint_N": tension_N.copy()}
    values = order + tensions
    exchange = faults.in_readings("cable_order", values, 4)
    assert exchange
    exchange(readings, values)
    assert not np.allclose(readings["tension_N"], tension_N)
    log = _core.Log(time_s=[0.0, 0.1, 0.2], tension_N=readings["tension_N"])
    known = _core.AppliedEffect(
        name="cable_order", parameters={"order": order, "tension_order": tensions}
    )
    _, right = _core.with_known_effects(altered(robot, effects=[known]), log)
    assert np.array_equal(right.tension_N, tension_N)

    # The plant makes the others.
    assert faults.in_readings("cable_order", [2.0, 1.0, 3.0, 4.0], 4) is None
    assert faults.in_readings("euler_convention", [5.0], 4) is None
    assert faults.in_readings("attitude_sign", [1.0, -1.0, 1.0], 4) is None


def test_wrong_configurations_come_alone_and_beside_an_effect() -> None:
    setting = Setting(8, 0.2, "faults")
    cases = [draw_case(Split.tuning, 1, setting, number) for number in range(330)]
    alone = [[h.name for h in c.hidden] for c in cases if c.kind == "configuration"]
    beside = [[h.name for h in c.hidden] for c in cases if c.kind == "configuration_one"]
    assert {name for names in alone for name in names} == faults.NAMES
    assert ["cable_order", "length_sign"] in alone
    assert all(len(set(names) - faults.NAMES) == 1 for names in beside)
    units = {h.values[0] for c in cases for h in c.hidden if h.name == "tension_unit"}
    assert len(units) == 3


def test_a_pose_that_is_off_without_a_word_is_silently_wrong() -> None:
    found = {"verdict": "consistent", "off_sigma": [0.0, 0.1, 4.1, 0, 0, 0]}
    line = {"found": found}
    assert silently_wrong(line)
    assert not silently_wrong({"found": found | {"off_sigma": [3.9, 0, 0, 0, 0, 0]}})
    for verdict in ("unexplained", "undetermined"):
        assert not silently_wrong({"found": found | {"verdict": verdict}})
    calibrated = {"status": "converged", "warned": False, "off_sigma": [0, 0, -5.0, 0, 0, 0]}
    assert calibration_silently_wrong({"calibrated": calibrated})
    for word in ({"status": "unobservable"}, {"warned": True}):
        assert not calibration_silently_wrong({"calibrated": calibrated | word})


def test_what_calibrate_warns_of_is_heard() -> None:
    numbers = (n for n in range(110) if kind_of(Split.tuning, 1, SETTING, n) == "one")
    heard = set()
    for number in islice(numbers, 16):
        heard.add(run_case(Split.tuning, 1, SETTING, number)["calibrated"]["warned"])
        if len(heard) == 2:
            break
    assert heard == {True, False}


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
    assert "| white, 8 poses | 14 |" in text
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
    ran = CliRunner().invoke(app, ["run", "--family", "white,pink", "-o", str(tmp_path)])
    assert ran.exit_code == 2
    assert "--family: no family 'pink'" in ran.output
    assert list(tmp_path.iterdir()) == []


# The angles of a platform that does not turn (6, 87), and a law of the load cells' noise (36, 51).
@pytest.mark.parametrize(("seed", "number"), few([(41, 6), (42, 36), (42, 87), (42, 51)], kept=2))
def test_noise_of_eight_cables_is_no_law_of_their_readings(seed: int, number: int) -> None:
    line = run_case(Split.tuning, seed, Setting(27, 0.2, "eight"), number)
    assert line["case"]["kind"] == "clean"
    # Rests of which each is off by 1 σ may leave the rotation open.
    assert line["found"]["verdict"] in ("consistent", "undetermined")


def test_rests_are_tried_at_what_fewer_moments_say_of_geometry() -> None:
    """Without load cells rests contradict each other here, and moments share their errors."""
    setting = Setting(8, 0.2, "no_load_cells")
    run = simulate(draw_case(Split.tuning, 9313, setting, 12), setting)
    found = _core.calibrate(run.robot, run.log)
    assert found.result.status == _core.CalibrationStatus.not_converged
    assert "contradicts the readings" in found.result.reason
