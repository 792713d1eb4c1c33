"""cdprcal.studies: the same results wherever they are calculated, and rows that mean something."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import estimator
import numpy as np
import pytest
from typer.testing import CliRunner

import cdprcal
from cdprcal import InputError
from cdprcal.studies import (
    Workers,
    coverage,
    plans,
    spread,
    start_ups,
    stream,
    variants,
    vary,
    workspaces,
)
from cdprcal.studies.__main__ import app
from scripts import executed

SERIAL = Workers(jobs=1)
SEEDS = range(1, 5)


def half(x: float) -> float:
    if x < 0:
        raise InputError(f"{x:g}: is negative")
    return x / 2


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A scheduler and two worker processes on this computer."""
    distributed = pytest.importorskip(
        "distributed", reason="Dask is not installed (the dask extra has it)"
    )
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as running:
        yield running


@pytest.fixture(params=["processes", "dask"])
def two_workers(request: pytest.FixtureRequest) -> Workers:
    if request.param == "processes":
        return Workers(jobs=2)
    return Workers(dask=request.getfixturevalue("cluster").scheduler_address)


def test_order_and_errors_are_those_of_a_loop(two_workers: Workers) -> None:
    items = [float(i) for i in range(100)]
    assert spread(half, items, two_workers) == [half(x) for x in items]

    assert spread(half, [], two_workers) == []
    with pytest.raises(InputError, match="-1: is negative"):
        spread(half, [1.0, -1.0, 2.0], two_workers)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_stream_gives_each_result_when_it_is_there(jobs: int) -> None:
    items = [4.0, 3.0, -1.0, 2.0]
    results = stream(half, items, Workers(jobs=jobs))
    assert [next(results), next(results)] == [2.0, 1.5]
    with pytest.raises(InputError, match="-1: is negative"):
        next(results)
    assert list(stream(half, [], Workers(jobs=jobs))) == []
    stopped = stream(half, items, Workers(jobs=jobs))
    assert next(stopped) == 2.0
    stopped.close()  # what is left is not calculated, and nothing hangs


def test_monte_carlo_is_the_same_to_the_bit(robot: cdprcal.Robot, two_workers: Workers) -> None:
    serial = start_ups(robot, SEEDS, noise=0.2, workers=SERIAL)
    assert start_ups(robot, SEEDS, noise=0.2, workers=two_workers) == serial


def test_a_script_s_study_is_the_same_to_the_bit(cluster: Any) -> None:
    """A function of a file that no worker has imported: it travels as code."""
    work = partial(estimator.outcome, noise=0.2, name="irma4")
    serial = spread(work, SEEDS, SERIAL)
    there = spread(work, SEEDS, Workers(dask=cluster.scheduler_address))
    for a, b in zip(serial, there, strict=True):
        assert (a.status, a.mahalanobis) == (b.status, b.mahalanobis)
        np.testing.assert_array_equal(a.error, b.error)
        np.testing.assert_array_equal(a.bound, b.bound)


def test_families_are_the_same_to_the_bit(robot: cdprcal.Robot, cluster: Any) -> None:
    there = Workers(dask=cluster.scheduler_address)
    values = {"platform.mass_kg": [10.0, 12.992, 16.0]}
    serial = workspaces(robot, values, step_m=0.15, workers=SERIAL)
    assert workspaces(robot, values, step_m=0.15, workers=there) == serial
    planned = plans(robot, values, workers=SERIAL)
    assert plans(robot, values, workers=there) == planned


def test_the_same_script_on_a_cluster_prints_the_same(cluster: Any) -> None:
    script = [sys.executable, str(estimator.__file__), "coverage", "--count", "8"]
    address = cluster.scheduler_address
    serial, spread_out = (
        executed([*script, *how], check=True, timeout=300)
        for how in (["--jobs", "1"], ["--dask", address])
    )
    assert spread_out.stdout == serial.stdout
    assert "converged 8" in serial.stdout


def test_no_scheduler_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cdprcal.studies.workers._CONNECT_S", 1)
    pytest.importorskip("distributed", reason="Dask is not installed (the dask extra has it)")
    with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:1: no scheduler answers"):
        spread(half, [1.0], Workers(dask="tcp://127.0.0.1:1"))


def test_jobs_that_make_no_sense() -> None:
    with pytest.raises(InputError, match="jobs: -1"):
        Workers(jobs=-1)


def test_start_ups_are_honest(robot: cdprcal.Robot) -> None:
    rows = start_ups(robot, range(1, 25), noise=0.2, workers=SERIAL)
    assert [row.seed for row in rows] == list(range(1, 25))
    assert all(row.status == "converged" for row in rows)
    assert all(0 < row.position_error_m < 2e-3 for row in rows)
    assert coverage(rows) > 0.75  # of 24; fewer than 19 have a chance of 1e-5 at 95 %


def test_a_heavier_platform_hangs_elsewhere(robot: cdprcal.Robot) -> None:
    rows = workspaces(robot, {"platform.mass_kg": [5.0, 13.0]}, step_m=0.15, workers=SERIAL)
    assert [row.changes for row in rows] == [{"platform.mass_kg": 5.0}, {"platform.mass_kg": 13.0}]
    light, heavy = rows
    own = cdprcal.workspace_shape(cdprcal.compute_workspace(robot, step_m=0.15))
    assert heavy.volume_m3 == pytest.approx(own.volume_m3, rel=0.01)  # 12.992 kg
    assert light.volume_m3 < 0.9 * heavy.volume_m3


def test_a_plan_that_cannot_be_made_is_a_row(robot: cdprcal.Robot) -> None:
    rows = plans(robot, {"platform.mass_kg": [12.992, 0.5]}, workers=SERIAL)
    assert [row.status == "planned" for row in rows] == [True, False]
    assert rows[0].poses == 8
    assert 0 < rows[0].position_sigma_m < 0.1
    assert rows[1].reason


def test_values_of_a_robot_file(robot: cdprcal.Robot) -> None:
    changed = vary(
        robot,
        {
            "platform.centre_of_mass_m.z": 0.2,
            "cables.2.pulley.radius_m": 0.01,
            "cables.*.platform_anchor_m.x": 0.08,
        },
    )
    assert changed.platform.centre_of_mass_m.tolist() == [0, 0, 0.2]
    assert [c.pulley.radius_m for c in changed.cables] == [0.03, 0.01, 0.03, 0.03]
    assert {float(c.platform_anchor_m[0]) for c in changed.cables} == {0.08}
    grid = variants(robot, {"platform.mass_kg": [1, 2], "gravity_m_s2": [9.81, 1.62, 3.7]})
    assert [c["gravity_m_s2"] for c, _ in grid] == [9.81, 1.62, 3.7] * 2


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("platform.weight", "no 'weight' there; known are mass_kg"),
        ("cables.5.pulley.radius_m", "known are 1 to 4, or \\* for all"),
        ("cables.0.pulley.radius_m", "known are 1 to 4"),
        ("platform.centre_of_mass_m.w", "known are x, y, z"),
        ("platform.centre_of_mass_m", "is not one number"),
        ("platform.mass_kg.x", "nothing is inside"),
        ("name", "is not one number"),
    ],
)
def test_values_that_are_not_there(robot: cdprcal.Robot, name: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        vary(robot, {name: 1.0})


def test_a_value_that_makes_no_robot(robot: cdprcal.Robot) -> None:
    with pytest.raises(InputError, match=r"irma4 with platform\.mass_kg = -1.*mass_kg"):
        vary(robot, {"platform.mass_kg": -1.0})


def study(*arguments: str) -> tuple[int, list[dict[str, str]], str]:
    """(exit code, rows, stderr) of ``python -m cdprcal.studies`` in one process."""
    ran = CliRunner().invoke(app, [*arguments, "--jobs", "1"])
    return ran.exit_code, list(csv.DictReader(io.StringIO(ran.stdout))), ran.stderr


def test_the_command_writes_what_the_functions_return(robot: cdprcal.Robot, tmp_path: Path) -> None:
    code, rows, said = study("start-ups", "irma4", "--count", "2", "--noise", "0.2")
    expected = start_ups(robot, [1, 2], noise=0.2, workers=SERIAL)
    assert code == 0
    assert "2 of 2 converged" in said
    assert [float(r["position_error_m"]) for r in rows] == [e.position_error_m for e in expected]
    assert [float(r["sigma_z_m"]) for r in rows] == [e.standard_deviation[2] for e in expected]

    table = tmp_path / "table.csv"
    values = ["--vary", "platform.mass_kg=5,13", "--step-m", "0.15"]
    code, rows, _ = study("workspaces", "irma4", *values, "-o", str(table))
    assert (code, rows) == (0, [])  # nothing on stdout
    families = workspaces(robot, {"platform.mass_kg": [5, 13]}, step_m=0.15, workers=SERIAL)
    written = list(csv.DictReader(table.open()))
    assert [float(r["volume_m3"]) for r in written] == [f.volume_m3 for f in families]


def test_the_command_tells_what_cannot_be_planned() -> None:
    code, rows, _ = study("plans", "irma4", "--vary", "platform.mass_kg=0.1")
    assert code == 1
    assert rows[0]["duration_s"] == ""
    assert "set-point" in rows[0]["reason"]


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        ("platform.mass=1", "no 'mass' there"),
        ("platform.mass_kg", "give NAME=V1,V2"),
        ("platform.mass_kg=", "give NAME=V1,V2"),
        ("platform.mass_kg=1,x", "'x' in '1,x' must be a number"),
    ],
)
def test_the_command_names_a_wrong_value(vary: str, words: str) -> None:
    code, rows, said = study("plans", "irma4", "--vary", vary)
    assert (code, rows) == (2, [])
    assert words in said
