"""Lines for people: every reading that can be left out has a name."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import cdprcal
from cdprcal.diagnosis.table import value_rows
from cdprcal.tables import CHANNELS, gated_line, sigma_of
from cdprcal.terminal import Table, fixed, measured
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


@pytest.mark.parametrize(
    ("value", "sigma", "said"),
    [
        (15.602, 2.656, ("+15.6", "2.7")),
        (2.6e-4, 1.04e-4, ("+0.00026", "0.00010")),
        (-2.6e-9, 1.04e-10, ("-2.60e-9", "0.10e-9")),
        (4e-10, 1.24e-9, ("+0.4e-9", "1.2e-9")),
        (123456.7, 1234.0, ("+123457", "1234")),
        (0.0999, 0.0996, ("+0.10", "0.10")),
        (-0.0004, 0.1, ("+0.00", "0.10")),
        (2.6e-4, 0.0, ("+0.00026", "0")),
        (-2.6, np.nan, ("-2.6", "–")),
        (-2.6, None, ("-2.6", "–")),
        (2.6, np.inf, ("+2.6", "inf")),
        (np.nan, 1.0, ("–", "–")),
        (None, None, ("–", "–")),
    ],
)
def test_a_value_has_the_digits_that_sigma_needs(
    value: float | None, sigma: float | None, said: tuple[str, str]
) -> None:
    assert measured(value, sigma) == said


def printed(table: Table, width: int) -> list[str]:
    console = Console(width=width, file=io.StringIO())
    with console.capture() as said:
        console.print(table)
    return [line.rstrip() for line in said.get().splitlines()]


def test_no_word_of_a_table_is_broken_where_another_column_has_room() -> None:
    table = Table("effect", "found from", "of its usual size", "looks like", text={0, 1, 3})
    table.add_row("magnetic_disturbance", "no believable size", "", "external_force, umbilical")
    *_, row, rest = printed(table, 80)
    assert row.split() == ["magnetic_disturbance", "no", "believable", "size", "external_force,"]
    assert rest.split() == ["umbilical"]


def test_units_go_below_names_before_a_key_is_broken() -> None:
    table = Table("effect", "of", "value [mm]", "evidence [nat]", text={0, 1}, keys=2)
    table.add_row("eccentric_drum", "cosine_m cable 1", "+0.039", "222.9")
    assert printed(table, 62)[0].split() == [
        "effect", "of", "value", "[mm]", "evidence", "[nat]",
    ]  # fmt: skip
    _, units, row = printed(table, 52)
    assert units.split() == ["effect", "of", "[mm]", "[nat]"]
    assert row.split() == ["eccentric_drum", "cosine_m", "cable", "1", "+0.039", "222.9"]


def test_nothing_is_less_than_zero_by_nothing() -> None:
    assert fixed(-0.0, 1) == "0.0"
    assert fixed(-0.0004, 3) == "0.000"
    assert measured(-0.0, None, sign="") == ("0", "–")


def test_the_numbers_of_a_law_are_seen() -> None:
    """Newtons per square newton are small."""
    effect = {
        "name": "a_law",
        "parameters": {"curve_N_N2": [2.6e-4, -1.23e-3]},
        "standard_deviation": {"curve_N_N2": [1.0e-4, None]},
        "units": {"curve_N_N2": "N/N2"},
        "shapes": {"curve_N_N2": "per_cable"},
    }
    assert list(value_rows(effect)) == [
        ("cable 1", "+0.00026", "0.00010", "N/N2"),
        ("cable 2", "-0.00123", "–", "N/N2"),
    ]


def test_the_parts_of_a_vector_are_its_axes_also_where_no_catalogue_has_it() -> None:
    """Of a step; of two logs."""
    effect = {
        "name": "a_step",
        "parameters": {"time_s": 7.5, "shift_m": [[0.01, 0.02, -0.03], [0.0, 0.0, 0.0]]},
        "standard_deviation": {"shift_m": [[0.001] * 3] * 2},
        "units": {"shift_m": "m"},
        "shapes": {"shift_m": "vector3"},
    }
    assert [where for where, *_ in value_rows(effect)] == [
        "time_s",
        *(f"shift_m log {log}, {axis}" for log in (1, 2) for axis in "xyz"),
    ]


def test_every_channel_with_a_sigma_has_it(robot: cdprcal.Robot) -> None:
    keys = {sigma for _, _, _, sigma in CHANNELS.values() if sigma}
    assert keys <= sigma_of(robot).keys()


def test_an_outlier_of_the_last_cable_is_left_out_and_said(
    cli: object, log: cdprcal.Log, tmp_path: Path
) -> None:
    assert callable(cli)
    length_m = log.length_m.copy()
    rest = log.time_s > 48.0  # the whole of a dwell
    length_m[rest & (log.time_s < 53.0), 3] += 0.02
    cdprcal.write_log(changed(log, length_m=length_m), str(tmp_path / "run.csv"))
    ran: Ran = cli("calibrate", "irma4", tmp_path / "run.csv")
    assert "internal error" not in ran.stderr
    assert "length 4, an outlier of" in ran.stdout
    assert np.isfinite(length_m).all()
