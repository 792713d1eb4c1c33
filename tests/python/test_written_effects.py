"""Effects that a person writes as text: checked, found, simulated and kept like the catalogue's."""

from __future__ import annotations

import pickle
import time
from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal import effect_files
from conftest import Cli
from robots import altered

CATALOGUE = Path(__file__).resolve().parents[2] / "examples" / "effects" / "catalogue.yaml"
#: An eccentric drum of a known circumference, which the catalogue does not have.
DRUM = """\
effect_definitions:
  - name: round_drum
    says: the drums run out
    remedy: turn the drums true
    parameters:
      sine_m: {typical: 0.002, plausible: 0.02}
      cosine_m: {typical: 0.002, plausible: 0.02}
    adds:
      length_m: sine_m * sin(2 * pi * length_m / 0.3) + cosine_m * cos(2 * pi * length_m / 0.3)
"""
PER_METRE = """\
effect_definitions:
  - name: spring
    scope: run
    parameters: {rate_N_m: {typical: 5, plausible: 100}}
    adds: {force_z_N: -rate_N_m * (z_m - 1)}
"""


def read(text: str, robot: cdprcal.Robot) -> cdprcal.Robot:
    return cdprcal.with_effect_definitions(robot, text, "mine.yaml")


@pytest.fixture(scope="module")
def written(robot: cdprcal.Robot) -> cdprcal.Robot:
    return read(CATALOGUE.read_text(encoding="utf-8"), robot)


def run_with(robot: cdprcal.Robot, effects: list[str], seed: int = 3) -> cdprcal.StartUpRun:
    plan = cdprcal.make_plan(robot, grid=(2, 2, 2), order=cdprcal.VisitingOrder.random)
    return cdprcal.simulate_startup(robot, plan.plan, effects=effects, seed=seed)


def test_written_ones_have_the_evidence_of_the_compiled_ones(written: cdprcal.Robot) -> None:
    log = run_with(cdprcal.load_robot("irma4"), ["load_cell_bias=6,-5,4,-8"]).log
    found = cdprcal.diagnose(written, [log])
    evidence = {score.name: score.log_evidence for score in found.ranking}
    detectable = {i.name: i.detectable for i in found.identifiability}
    twins = [name for name in evidence if not name.startswith("written_")]
    assert len(twins) >= 20
    for name in set(twins) - {"umbilical"}:  # which has more numbers than a formula may
        twin = f"written_{name}"
        assert evidence[twin] == pytest.approx(evidence[name], rel=1e-6, abs=1e-6), name
        if name not in ("ahrs_misalignment", "base_tilt"):  # of first order, like the scan
            # Of effects drawn at random, in another order of their axes.
            assert detectable[twin] == pytest.approx(detectable[name], rel=0.2, nan_ok=True)
    names = {effect.info.name.removeprefix("written_") for effect in found.effects}
    assert names == {"load_cell_bias"}


def test_forty_of_them_cost_no_more_than_their_share(
    written: cdprcal.Robot, robot: cdprcal.Robot
) -> None:
    log = run_with(robot, []).log

    def scan_s(of: cdprcal.Robot) -> tuple[float, int]:
        model = cdprcal.diagnose(of, [log]).baseline
        times = []
        for _ in range(15):
            begin = time.perf_counter()
            scores = cdprcal.scan(model)
            times.append(time.perf_counter() - begin)
        return float(np.median(times)), len(scores)

    (plain_s, compiled), (both_s, all_of_them) = scan_s(robot), scan_s(written)
    assert all_of_them == 2 * compiled - 1  # all but umbilical
    # Twice as many effects; those of text may take at most twice what compiled ones take.
    assert both_s < 3.0 * plain_s


def test_an_effect_of_ones_own_is_found_and_the_pose_with_it(robot: cdprcal.Robot) -> None:
    mine = read(DRUM, robot)
    run = run_with(mine, ["round_drum=0.004,-0.002"])
    found = cdprcal.diagnose(mine, [run.log])
    assert [effect.info.name for effect in found.effects] == ["round_drum"]
    (effect,) = found.effects
    assert not effect.described
    off = np.abs(effect.values - [0.004, -0.002]) / effect.standard_deviation
    assert off.max() < 4.0
    truth = run.poses[0].position_m
    before = np.linalg.norm(found.initial_pose_before.position_m - truth)
    after = np.linalg.norm(found.initial_pose_after.position_m - truth)
    assert after < 0.5 * before or after < 1e-3
    again = cdprcal.parse_robot(cdprcal.to_yaml(found.corrected), "corrected.yaml")
    assert [e.name for e in again.effects] == ["round_drum"]
    assert cdprcal.diagnose(again, [run.log]).verdict == cdprcal.Verdict.consistent


@pytest.mark.parametrize(
    ("text", "effect"),
    [
        (PER_METRE, "spring=30"),
        (CATALOGUE.read_text(encoding="utf-8"), "written_load_cell_gain=0.05,-0.04,0.03,0.06"),
        (
            CATALOGUE.read_text(encoding="utf-8"),
            "written_frame_anchors=" + ",".join(["0.004"] * 12),
        ),
        (CATALOGUE.read_text(encoding="utf-8"), "written_pulley_friction=0.04"),
    ],
)
def test_the_simulated_machine_does_what_the_text_says(
    robot: cdprcal.Robot, text: str, effect: str
) -> None:
    """A robot file that lists the very values calibrates as one of a robot without the effect.

    Friction at rest depends on how the platform came to rest: what is left of it widens σ.
    """
    mine = read(text, robot)
    injected = cdprcal.expanded_effect(cdprcal.parse_injected_effect(effect, mine), mine)
    info = next(i for i in cdprcal.effects_of(mine) if i.name == injected.name)
    parameters, begin = {}, 0
    for parameter in info.parameters:
        count = robot.cable_count if str(parameter.shape) == "per_cable" else 1
        parameters[parameter.name] = injected.values[begin : begin + count]
        begin += count
    known = altered(
        mine, effects=[cdprcal.AppliedEffect(name=injected.name, parameters=parameters)]
    )
    run = run_with(mine, [effect])
    result = cdprcal.calibrate(known, run.log).result
    assert result.status == cdprcal.CalibrationStatus.converged
    plain = cdprcal.calibrate(robot, run_with(robot, []).log).result
    assert result.initial_pose is not None
    off = result.initial_pose.position_m - run.poses[0].position_m
    assert np.linalg.norm(off) < (5e-3 if "friction" in effect else 1e-3)
    assert (np.abs(off) < 3.0 * result.standard_deviation[:3]).all()
    rms, usual = result.residual_rms.length_m, plain.residual_rms.length_m
    assert rms < 2.0 * usual + 1e-4


def test_robots_keep_them_through_pickle_and_file(written: cdprcal.Robot) -> None:
    again = pickle.loads(pickle.dumps(written))
    assert again.effect_definitions == written.effect_definitions
    assert [e.name for e in cdprcal.effects_of(again)] == [
        e.name for e in cdprcal.effects_of(written)
    ]
    own = cdprcal.effects_of(again)[-1]
    del again
    assert own.formulas == {
        "roll_rad": "-delay_s * roll_rate_rad_s",
        "pitch_rad": "-delay_s * pitch_rate_rad_s",
        "yaw_rad": "-delay_s * yaw_rate_rad_s",
    }
    assert own.parameters[0].unit == "s"


def test_commands_take_a_file(cli: Cli, tmp_path: Path, robot: cdprcal.Robot) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text(DRUM, encoding="utf-8")
    plan, log, corrected = (tmp_path / name for name in ("plan.csv", "run.csv", "corrected.yaml"))
    assert cli("plan", "irma4", "--order", "random", "-o", plan).code == 0
    hidden = ["--effects", mine, "--effect", "round_drum=0.004,-0.002"]
    wide = ["--corridor-m", 0.3]
    assert cli("acquire", "irma4", plan, "--seed", 3, *hidden, *wide, "-o", log).code == 0
    ran = cli("diagnose", "irma4", log, "--effects", mine, "-o", corrected, "--json")
    (effect,) = ran.document()["effects"]
    assert effect["name"] == "round_drum"
    assert effect["formula"]["length_m"].startswith("sine_m * sin(2 * pi * length_m / 0.3)")
    assert effect["units"] == {"sine_m": "m", "cosine_m": "m"}
    assert cli("calibrate", corrected, log).code == 0
    listed = cli("effects", "--effects", mine)
    assert "round_drum" in listed.stdout
    assert "the drums run out" in cli("explain", "round_drum", "--effects", mine).stdout
    assert "direction_x" in cli("effects", "--words").stdout


def test_a_mistake_is_shown_with_its_line_and_column(cli: Cli, tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text(DRUM.replace("sin(2 * pi", "sinus(2 * pi"), encoding="utf-8")
    ran = cli("effects", "--effects", mine)
    ran.refused(f"{mine}:9:26: effect_definitions[#1].adds.length_m: knows no function")


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("load_cell_curvature", [5e-4, -4e-4, 7e-4, -6e-4]),
        ("drum_eccentricity", [0.002, -0.001, 0.001, 0.002, 0.001, 0.002, -0.002, -0.001]),
        ("attitude_scale", [0.05, -0.04]),
    ],
)
def test_more_effects_are_found_by_their_names(
    robot: cdprcal.Robot, name: str, values: list[float]
) -> None:
    more = read(effect_files.text("more"), robot)
    plan = cdprcal.make_plan(robot, grid=(3, 3, 3), order=cdprcal.VisitingOrder.random, visits=1)
    hidden = cdprcal.InjectedEffect(name, values)
    run = cdprcal.simulate_startup(more, plan.plan, effects=[hidden], seed=7)
    (effect,) = cdprcal.diagnose(more, [run.log]).effects
    assert effect.info.name == name
    off = (effect.values - values) / effect.standard_deviation
    assert np.sqrt(np.mean(off**2)) < 2.5
