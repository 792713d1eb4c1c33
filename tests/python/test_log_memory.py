"""A log's arrays: views of its own memory, read-only, alive as long as anyone looks."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import cdprcal
from cdprcal import InputError, Log
from cdprcal.sensors import LOG_GROUPS

ARRAYS = ("time_s", *LOG_GROUPS)


def big_log(samples: int = 20000) -> Log:
    values = np.arange(samples * 4, dtype=float).reshape(samples, 4)
    return Log(time_s=np.arange(samples, dtype=float), length_m=values, tension_N=values + 0.5)


def test_arrays_are_views_of_the_same_memory() -> None:
    log = big_log()
    assert np.shares_memory(log.length_m, log.length_m)
    assert log.length_m.flags.c_contiguous
    assert not log.length_m.flags.owndata


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_are_read_only(name: str) -> None:
    with pytest.raises(ValueError, match="read-only"):
        getattr(big_log(10), name)[...] = 0


def test_an_array_outlives_the_name_of_its_log() -> None:
    log = big_log()
    lengths, expected = log.length_m, np.array(log.length_m)
    row = lengths[19999]
    del log
    gc.collect()
    ballast = [np.full(80000, np.nan) for _ in range(50)]  # would overwrite freed memory
    np.testing.assert_array_equal(lengths, expected)
    np.testing.assert_array_equal(row, expected[19999])
    assert len(ballast) == 50


def test_the_log_has_its_own_copy_of_what_it_was_made_from() -> None:
    values = np.ones((3, 2))
    log = Log(time_s=[0, 1, 2], length_m=values)
    values[:] = 7
    np.testing.assert_array_equal(log.length_m, np.ones((3, 2)))


def test_slices_and_foreign_layouts_are_taken_as_they_look() -> None:
    values = np.arange(24, dtype=np.float32).reshape(6, 4)
    log = Log(
        time_s=np.arange(3), length_m=values[::2, ::-1], swivel_rad=np.asfortranarray(values[:3])
    )
    np.testing.assert_array_equal(log.length_m, values[::2, ::-1])
    np.testing.assert_array_equal(log.swivel_rad, values[:3])


def test_absent_groups_have_no_columns() -> None:
    log = big_log(5)
    assert log.swivel_rad.shape == (5, 0)
    assert log.roll_pitch_yaw_rad.shape == (5, 0)
    assert (len(log), log.sample_count, log.cable_count) == (5, 5, 4)


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"time_s": [0, 1, 1]}, "time"),
        ({"time_s": [0, np.nan]}, "time"),
        ({"time_s": []}, "sample"),
        ({"time_s": [0, 1], "length_m": np.zeros((3, 4))}, "length"),
        (
            {"time_s": [0, 1], "length_m": np.zeros((2, 4)), "tension_N": np.zeros((2, 3))},
            "tension",
        ),
        ({"time_s": [0, 1], "roll_pitch_yaw_rad": np.zeros((2, 2))}, "roll"),
        ({"time_s": [0, 1], "length_m": [[np.inf], [0]]}, "infinit"),
        ({"time_s": [0, 1], "length_m": np.zeros((2, 9))}, "8"),
    ],
)
def test_shapes_and_times_that_do_not_fit_are_refused(arrays: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Log(**arrays)


cells = st.floats(allow_infinity=False, width=64)


@given(st.data(), st.integers(1, 8), st.integers(1, 5))
def test_canonical_csv_gives_back_the_same_numbers(
    data: st.DataObject, cables: int, samples: int
) -> None:
    times = data.draw(
        st.lists(st.floats(-1e9, 1e9), min_size=samples, max_size=samples, unique=True).map(sorted)
    )

    def group(width: int) -> st.SearchStrategy[np.ndarray | None]:
        row = st.lists(cells, min_size=width, max_size=width)
        rows = st.lists(row, min_size=samples, max_size=samples)
        return st.none() | rows.map(np.array)

    arrays: dict[str, Any] = {name: data.draw(group(cables)) for name in ARRAYS[1:5]}
    arrays["roll_pitch_yaw_rad"] = data.draw(group(3))
    log = Log(time_s=times, **arrays)
    again = cdprcal.parse_log(cdprcal.format_log(log), "again")
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again, name), getattr(log, name), err_msg=name)


def test_a_written_log_reads_back(log: cdprcal.Log, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    cdprcal.write_log(log, str(path))
    again = cdprcal.read_log(str(path))
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again, name), getattr(log, name))


def test_a_message_that_quotes_bytes_of_a_damaged_file_is_still_a_message() -> None:
    with pytest.raises(InputError, match=r"x:1: column"):
        cdprcal.parse_log(b"time_s,l\xfcngth\n0,1\n", "x")
