"""``plan --diagnose``: what a run would show, before it is run."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import cdprcal
from conftest import TABLE_II_TENSIONS_N, Cli

SETPOINTS = [np.array(t) for t in TABLE_II_TENSIONS_N]


def sizes(seen: cdprcal.Foresight) -> dict[str, float]:
    return {effect.info.name: effect.detectable for effect in seen.effects}


def test_less_noise_and_more_poses_show_smaller_effects(robot: cdprcal.Robot) -> None:
    plain = sizes(cdprcal.foresee(robot, SETPOINTS))
    quiet = sizes(cdprcal.foresee(robot, SETPOINTS, noise=0.2))
    twice = sizes(cdprcal.foresee(robot, SETPOINTS * 2))
    assert len(plain) == len(quiet) >= 20
    for name, size in plain.items():
        if not math.isnan(size):
            assert quiet[name] < 0.5 * size, name
            assert twice[name] < size, name


def test_the_size_that_shows_is_one_that_is_found(robot: cdprcal.Robot) -> None:
    """Of twice that size nearly all are found, of a quarter nearly none: the word means that."""
    options = cdprcal.SyntheticLogOptions(noise=cdprcal.reading_noise(robot.sigma, 0.3), seed=5)
    rate = sizes(cdprcal.foresee(robot, SETPOINTS, noise=0.3 / math.sqrt(50)))["yaw_drift"]
    typical = next(i for i in cdprcal.effect_catalogue() if i.name == "yaw_drift").parameters[0]
    log = cdprcal.synthetic_log(robot, SETPOINTS, options).log
    for factor, is_found in ((4.0, True), (0.1, False)):
        attitude = np.array(log.roll_pitch_yaw_rad)
        attitude[:, 2] += factor * rate * typical.typical * np.array(log.time_s)
        drifted = cdprcal.Log(
            time_s=log.time_s,
            length_m=log.length_m,
            swivel_rad=log.swivel_rad,
            tension_N=log.tension_N,
            roll_pitch_yaw_rad=attitude,
        )
        found = [e.info.name for e in cdprcal.diagnose(robot, [drifted]).effects]
        assert ("yaw_drift" in found) == is_found, (factor, found)


def test_what_cannot_be_told_apart_looks_alike(robot: cdprcal.Robot) -> None:
    seen = cdprcal.foresee(robot, SETPOINTS, noise=0.2)
    names = [effect.info.name for effect in seen.effects]
    share = {
        (effect.info.name, other): value
        for effect in seen.effects
        for other, value in zip(names, effect.imitated, strict=True)
    }
    # From inside the robot mass is a vertical force; but no force is a wrong yaw.
    assert share["mass", "external_force"] > 0.99
    assert share["mass", "yaw_drift"] < 0.1
    assert share["yaw_drift", "yaw_drift"] == 1.0


def test_the_command_says_it(cli: Cli) -> None:
    ran = cli("plan", "irma4", "--diagnose")
    assert ran.code == 0, ran.stderr
    assert "would look like" in ran.stdout
    document = json.loads(cli("plan", "irma4", "--diagnose", "--json").stdout)
    assert document["diagnose"]["poses"] == 9
    with pytest.raises(cdprcal.InputError):
        cdprcal.foresee(cdprcal.load_robot("irma4"), [])


def test_places_are_added_for_what_is_asked(cli: Cli, robot: cdprcal.Robot) -> None:
    ran = cli("plan", "irma4", "--diagnose", "--for", "centre_of_mass,pulley_friction", "--json")
    document = ran.document()
    seen = document["diagnose"]
    assert seen["asked"] == ["centre_of_mass", "pulley_friction"]
    assert 1 <= len(seen["added_positions_m"]) <= 6
    now = {row["name"]: row["detectable"] for row in seen["effects"]}
    without = seen["detectable_without"]
    assert set(without) == set(seen["asked"])
    assert all(now[name] <= without[name] for name in without)
    assert min(now[name] / without[name] for name in without) < 0.85
    # The places are in the plan, each visited twice.
    at = [stop["position_m"] for stop in document["poses"] if stop["measured"]]
    for place in seen["added_positions_m"]:
        assert sum(np.allclose(place, position, atol=1e-3) for position in at) == 2


def test_what_cannot_be_asked_is_said(cli: Cli) -> None:
    for arguments, text in (
        (("--for", "mass"), "give both"),
        (("--diagnose", "--for", "mas"), "'mas' is not known"),
        (("--diagnose", "--for", "sensor_delay"), "shows only in motion"),
        (("--diagnose", "--for", "mass", "--optimal", "4"), "leave out --optimal"),
    ):
        cli("plan", "irma4", *arguments).refused(text)


def test_many_rests_without_noise_are_no_overflow(robot: cdprcal.Robot) -> None:
    """Far below its mean a chi-square of some hundred degrees of freedom made Boost overflow."""
    seen = cdprcal.foresee(robot, SETPOINTS * 8, of=["mass"])
    assert [effect.info.name for effect in seen.effects] == ["mass"]
    assert seen.effects[0].detectable > 0.0
