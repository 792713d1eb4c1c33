"""The practice logs: made elsewhere, each with at most one hidden effect whose values are known."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from conftest import Cli


@pytest.mark.parametrize("name", ["p1", "p2", "p3", "p4", "p5", "p6"])
def test_the_hidden_effect_is_named_measured_and_corrected(
    cli: Cli, shared_data: Path, tmp_path: Path, name: str
) -> None:
    log = shared_data / "practice" / f"{name}.csv"
    if not log.exists():
        pytest.skip(f"no practice log at {log}")
    answers = json.loads((log.parent / "answers.json").read_text())[name]
    corrected = tmp_path / "corrected.yaml"
    ran = cli("diagnose", "irma4", log, "--json", "-o", corrected)
    result = json.loads(ran.stdout)
    assert ran.code == 0
    assert [effect["name"] for effect in result["effects"]] == list(answers["effects"])
    for effect in result["effects"]:
        for parameter, truth in answers["effects"][effect["name"]].items():
            error = np.array(effect["parameters"][parameter]) - np.array(truth)
            deviation = np.array(effect["standard_deviation"][parameter])
            # 95 % for all values of an effect together: 2 sigma for one, 2.5 for one a cable.
            bound = norm.ppf(1.0 - 0.025 / error.size)
            assert np.all(np.abs(error) <= bound * deviation), (parameter, error / deviation)
    again = json.loads(cli("diagnose", corrected, log, "--json").stdout)
    assert again["verdict"] == "consistent"
