"""Lines for people: every reading that can be left out has a name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cdprcal
from cdprcal.tables import CHANNELS, gated_line, sigma_of
from conftest import Ran, changed


@pytest.mark.parametrize(
    ("channel", "component", "words"),
    [
        ("length", 3, "length 4"),
        ("swivel", 7, "swivel 8"),
        ("roll_pitch", 1, "pitch"),
        ("yaw", 0, "yaw"),
        ("balance", 0, "the balance of the tensions"),
        ("absolute_yaw", 0, "absolute yaw"),
        ("direct_length", 3, "direct length 4"),
        ("position", 2, "position z"),
    ],
)
def test_every_outlier_has_a_name(channel: str, component: int, words: str) -> None:
    gated = {"reason": "outlier", "time_s": 1.0, "size": 9.0}
    line = gated_line(gated | {"channel": channel, "component": component})
    assert line == f"left out at 1.000 s: {words}, an outlier of 9.0 standard deviations"


def test_every_channel_with_a_sigma_has_it(robot: cdprcal.Robot) -> None:
    keys = {sigma for _, _, _, sigma in CHANNELS.values() if sigma}
    assert keys <= sigma_of(robot).keys()


def test_an_outlier_of_the_last_cable_is_left_out_and_said(
    cli: object, synthetic: cdprcal.SyntheticLog, tmp_path: Path
) -> None:
    assert callable(cli)
    length_m = synthetic.log.length_m.copy()
    rest = synthetic.log.time_s > 48.0  # the whole of a dwell
    length_m[rest & (synthetic.log.time_s < 53.0), 3] += 0.02
    cdprcal.write_log(changed(synthetic.log, length_m=length_m), str(tmp_path / "run.csv"))
    ran: Ran = cli("calibrate", "irma4", tmp_path / "run.csv")
    assert "internal error" not in ran.stderr
    assert "length 4, an outlier of" in ran.stdout
    assert np.isfinite(length_m).all()
