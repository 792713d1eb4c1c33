"""Some of what tests/studies/sensor_subsets.py tries: any sensors, two to eight cables."""

from __future__ import annotations

import numpy as np
import pytest
import sensor_subsets as study


@pytest.mark.parametrize("cables", range(2, 9))
def test_the_default_solves_what_any_method_solves(cables: int) -> None:
    subsets = study.subsets()
    chosen = np.random.default_rng(cables).choice(len(subsets), size=6, replace=False)
    found = [study.outcome((cables, subsets[k], 1)) for k in chosen]
    assert not [one.in_words() for one in found if one.is_missed or "unified" in one.wrong]


@pytest.mark.parametrize("cables", [3, 4])
def test_encoders_at_rest_are_enough_below_six_cables(cables: int) -> None:
    found = study.outcome((cables, ("length", "swivel"), 2))
    assert found.sigma_m["unified"] is not None, found.reasons["unified"]
    assert not found.wrong


def test_a_rest_that_hangs_deep_does_not_make_the_balance_doubtful() -> None:
    """Its cables are parallel: one of its rows hardly depends on the load cells."""
    found = study.outcome((5, ("tension", "roll_pitch_yaw", "absolute_yaw", "position"), 1))
    assert not found.is_worse, found.in_words()
    assert "misfits" not in found.reasons["unified"]


def test_a_minimum_that_fits_badly_is_not_the_last_that_is_looked_at() -> None:
    """Residuals of four times the noise pass for a minimum, but another fits ten times better."""
    found = study.outcome((5, ("swivel", "tension", "direct_length"), 1))
    assert found.sigma_m["unified"] is not None, found.reasons["unified"]
    assert not found.wrong, found.in_words()
