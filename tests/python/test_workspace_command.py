"""``cdprcal workspace``: its document, mesh and picture, and what it refuses."""

from __future__ import annotations

import json
import re
import signal
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal.workspace.table import print_workspace
from conftest import Cli
from robots import altered, polygon_robot
from test_cli_bad_input import assert_refused
from test_plan_command import effect, robot_file


def workspace_of(cli: Cli, *arguments: object) -> dict[str, Any]:
    document: dict[str, Any] = cli("workspace", *arguments, "--json").document()
    return document


def volume_of(vertices: np.ndarray, faces: np.ndarray) -> float:
    """By the divergence theorem; positive when the faces look outward."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def assert_closed(faces: np.ndarray) -> None:
    """Every edge in two faces, once in each direction."""
    edges = Counter((int(face[i]), int(face[(i + 1) % 3])) for face in faces for i in range(3))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)


def test_document(cli: Cli) -> None:
    document = workspace_of(cli, "irma4", "--step-m", 0.1)
    assert {
        "volume_m3",
        "points_tested",
        "points_inside",
        "box",
        "vertices",
        "faces",
        "alpha_m2",
        "watertight",
    } <= document.keys()
    assert document["watertight"]
    assert document["complete"]
    assert 0 < document["points_inside"] < document["points_tested"]
    assert document["points"]["inside"] == document["points_inside"]
    vertices, faces = np.array(document["vertices"]), np.array(document["faces"])
    assert_closed(faces)
    assert volume_of(vertices, faces) == pytest.approx(document["volume_m3"], rel=1e-9)
    low, high = (np.array(document["searched_box"][end]) for end in ("lower_m", "upper_m"))
    assert (vertices >= low - 1e-9).all()
    assert (vertices <= high + 1e-9).all()
    inscribed = document["box"]
    assert (np.array(inscribed["lower_m"]) >= low).all()
    # A grid point inside stands for a cell: the counts say the volume too, coarsely.
    assert document["points_inside"] * 0.1**3 == pytest.approx(document["volume_m3"], rel=0.1)


def test_the_papers_box_is_inside_and_the_volume_converges(cli: Cli) -> None:
    """Eq. 19; three steps, each volume within the one before's distance, 2 % at the finest."""
    volumes = []
    for step in (0.16, 0.08, 0.04):
        document = workspace_of(cli, "irma4", "--step-m", step)
        volumes.append(document["volume_m3"])
        mesh = cdprcal.Mesh(document["vertices"], document["faces"])
        assert mesh.watertight
        for x in np.linspace(-0.4, 0.4, 5):
            for y in np.linspace(-0.4, 0.4, 5):
                for z in (0.6, 0.9, 1.2):
                    assert mesh.contains([x, y, z])
    changes = np.abs(np.diff(volumes)) / volumes[-1]
    assert changes[1] < 0.02
    assert changes[1] < changes[0]


def test_sections_and_probes(cli: Cli, robot: cdprcal.Robot) -> None:
    arguments = ["--section-m", 0.9, "--probe", "0.2,-0.1,0.8", "--probe", "0,0,1.8"]
    document = workspace_of(cli, "irma4", *arguments, "--step-m", 0.08)
    (section,) = document["sections"]
    assert section["height_m"] == 0.9
    # The paper's box is 0.8 m wide; the pulleys stand on 2.13 × 2.31 m.
    assert 0.64 < section["area_m2"] < 2.13 * 2.31
    (polygon,) = section["polygons"]
    assert len(polygon) > 20
    inside, outside = document["probes"]
    alone = cdprcal.inverse(robot, [0.2, -0.1, 0.8])
    assert inside["inside"]
    assert inside["status"] == "found"
    assert inside["tension_N"] == pytest.approx(alone.tension_N, abs=1e-6)
    low, high = robot.tension_limits_N
    margin = min(min(t - low, high - t) for t in inside["tension_N"])
    assert inside["margin_N"] == pytest.approx(margin)
    assert not outside["inside"]
    assert outside["status"] != "found"


def triangles_of(path: Path) -> Any:
    """The corners [f, 3, 3] in a PLY or STL file, text or binary, read by its format's rules."""
    content = path.read_bytes()
    if path.suffix == ".stl" and content.startswith(b"solid"):
        corners = re.findall(rb"vertex (\S+) (\S+) (\S+)", content)
        return np.array(corners, float).reshape(-1, 3, 3)
    if path.suffix == ".stl":
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        faces = np.frombuffer(content, record, offset=84)
        assert struct.unpack_from("<I", content, 80) == (len(faces),)
        return faces["corners"].astype(float)
    header, body = content.split(b"end_header\n", 1)
    vertices, faces_count = map(int, re.findall(rb"element \w+ (\d+)", header))
    if b"format ascii" in header:
        lines = [line.split() for line in body.splitlines()]
        assert len(lines) == vertices + faces_count
        places = np.array(lines[:vertices], float)
        indices = np.array(lines[vertices:], int)
    else:
        places = np.frombuffer(body, "<f8", 3 * vertices).reshape(-1, 3)
        rest = np.frombuffer(body, [("count", "u1"), ("index", "<i4", 3)], offset=24 * vertices)
        assert len(rest) == faces_count
        indices = np.column_stack([rest["count"], rest["index"]])
    assert (indices[:, 0] == 3).all()
    return places[indices[:, 1:]]


@pytest.mark.parametrize("name", ["mesh.ply", "mesh.stl"])
@pytest.mark.parametrize("text", [False, True])
def test_the_mesh_file_is_the_documents_mesh(
    cli: Cli, tmp_path: Path, name: str, text: bool
) -> None:
    path = tmp_path / name
    extra = ["--ascii"] if text else []
    document = workspace_of(cli, "irma4", "--step-m", 0.12, "-o", path, *extra)
    drawn = np.array(document["vertices"])[np.array(document["faces"])]
    written = triangles_of(path)
    if name == "mesh.ply":
        np.testing.assert_array_equal(written, drawn)
        content = path.read_bytes()
        assert content.startswith(b"ply\nformat ascii" if text else b"ply\nformat binary_little")
    else:
        np.testing.assert_allclose(written, drawn, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("count", [3, 4, 5])
def test_other_robots(cli: Cli, tmp_path: Path, count: int) -> None:
    document = workspace_of(cli, robot_file(polygon_robot(count), tmp_path))
    assert 60_000 < sum(document["points"].values()) < 100_000, "the step fits the box"
    assert document["watertight"]
    assert document["volume_m3"] > 0.1
    assert document["box"] is not None


def test_tension_control_demands_more_than_brakes(cli: Cli) -> None:
    arguments = ["irma4", "--step-m", 0.1, "--box", "-1,-1,0.2:1,1,1.7"]
    brakes = workspace_of(cli, *arguments)
    control = workspace_of(cli, *arguments, "--stability", "constant-tensions")
    assert control["points_inside"] <= brakes["points_inside"]


def test_what_is_searched_from_one_point_is_its_part(cli: Cli) -> None:
    document = workspace_of(cli, "irma4", "--step-m", 0.1, "--from", "0,0,0.9", "--threads", 1)
    whole = workspace_of(cli, "irma4", "--step-m", 0.1)
    assert document["points_inside"] == whole["points_inside"]
    assert document["points_tested"] <= whole["points_tested"]


def test_a_larger_alpha_fills_more(cli: Cli) -> None:
    tight = workspace_of(cli, "irma4", "--step-m", 0.1)
    loose = workspace_of(cli, "irma4", "--step-m", 0.1, "--alpha-m2", 4.0)
    assert loose["alpha_m2"] == 4.0
    assert loose["volume_m3"] > tight["volume_m3"]


def test_known_effects_move_the_boundary(cli: Cli, robot: cdprcal.Robot, tmp_path: Path) -> None:
    listed = altered(robot, name="listed", effects=[effect("mass", mass_error_kg=[6.0])])
    platform = robot.platform
    heavier = cdprcal.Platform(
        mass_kg=platform.mass_kg + 6.0,
        centre_of_mass_m=platform.centre_of_mass_m,
        inertia_kg_m2=platform.inertia_kg_m2,
    )
    same = altered(robot, name="same", platform=heavier)
    a, b, plain = (
        workspace_of(cli, robot_file(r, tmp_path), "--step-m", 0.1)["volume_m3"]
        for r in (listed, same, altered(robot, name="plain"))
    )
    assert a == pytest.approx(b, rel=1e-9)
    assert a != pytest.approx(plain, rel=1e-3)


def test_for_people(cli: Cli, tmp_path: Path) -> None:
    picture = tmp_path / "workspace.png"
    ran = cli("workspace", "irma4", "--step-m", 0.1, "--section-m", 0.9, "--plot", picture)
    assert ran.code == 0
    assert ran.stdout.startswith("volume ")
    for words in ("watertight", "largest inscribed box", "area"):
        assert words in ran.stdout
    assert ran.stderr == f"{picture}\n"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size > 20_000


def test_sections_and_probes_are_tables_for_people(cli: Cli) -> None:
    ran = cli("workspace", "irma4", "--step-m", 0.2, "--section-m", 0.9, "--probe", "0,0,0.9",
              "--probe", "9,0,0.9")  # fmt: skip
    assert ran.code == 0, ran.stderr
    assert re.search(r"^ *0\.9 +\d\.\d{4} +1 *$", ran.stdout, flags=re.M)
    # Tensions, margin and stiffness; what is beyond the limits has them too, and is named so.
    inside = r"^ *0 +0 +0\.9 +inside( +\d+\.\d){4} +\d+\.\d +\d+\.\d$"
    assert re.search(inside, ran.stdout, flags=re.M)
    assert re.search(r"^ *9 +0 +0\.9 +infeasible( +-?\d+\.\d){6}$", ran.stdout, flags=re.M)


def test_a_part_without_a_box_says_so(cli: Cli, capfd: pytest.CaptureFixture[str]) -> None:
    document = json.loads(cli("workspace", "irma4", "--step-m", 0.2, "--json").stdout)
    capfd.readouterr()
    print_workspace(document | {"box": None, "complete": False, "components": 2})
    said = capfd.readouterr().out
    assert "no grid cell lies inside: take a smaller step" in said
    assert "this part was found until the search was interrupted" in said
    assert "2 pieces" in said


def test_the_callback_can_stop_it_and_the_part_is_usable(robot: cdprcal.Robot) -> None:
    calls = []

    def enough(done: cdprcal.WorkspaceProgress) -> bool:
        calls.append(done.inside)
        return done.inside < 2000

    part = cdprcal.compute_workspace(robot, step_m=0.05, progress=enough)
    assert not part.complete
    assert calls == sorted(calls)
    assert part.points_inside >= 2000
    assert part.inside_m.shape == (part.points_inside, 3)
    assert part.tension_N.shape == (part.points_inside, 4)
    shape = cdprcal.workspace_shape(part)
    assert shape.watertight
    whole = cdprcal.compute_workspace(robot, step_m=0.05)
    assert part.points_inside < whole.points_inside
    assert 0.0 < shape.volume_m3 < cdprcal.workspace_shape(whole).volume_m3

    def broken(done: cdprcal.WorkspaceProgress) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        cdprcal.compute_workspace(robot, progress=broken)


@pytest.fixture
def ctrl_c_counts() -> Iterator[None]:
    """Also in a job in the background, which a shell lets ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c_counts")
def test_ctrl_c_leaves_what_was_found(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The signal comes in the middle of the search, when the bar shows how far it is."""
    shown = []

    @contextmanager
    def bar_with_ctrl_c() -> Iterator[Callable[[str, float], None]]:
        def show(stage: str, share: float) -> None:
            shown.append(share)
            if share > 0.05:
                signal.raise_signal(signal.SIGINT)

        yield show

    monkeypatch.setattr("cdprcal.terminal.progress_bar", bar_with_ctrl_c)
    path = tmp_path / "part.ply"
    document = cli("workspace", "irma4", "-o", path, "--json").document(1)
    assert not document["complete"]
    assert 0 < document["points_inside"] < 30_000  # the whole has 40,000
    assert max(shown) < 0.5
    assert document["watertight"]
    assert len(triangles_of(path)) == len(document["faces"])
    said = cli("workspace", "irma4")
    assert said.code == 1
    assert "interrupted" in said.stdout


BAD = {
    "box outside the anchors": (["--box", "3,3,0.5:4,4,1"], ("box", "pulleys")),
    "box above the pulleys": (["--box", "-0.3,-0.3,4:0.3,0.3,5"], ("box",)),
    "empty box": (["--box", "0,0,1:0,0,1"], ("box",)),
    "step of nothing": (["--step-m", "0"], ("step",)),
    "step beyond the box": (["--step-m", "9"], ("step",)),
    "step too fine": (["--step-m", "0.0005"], ("step|points",)),
    "alpha": (["--alpha-m2", "-1"], ("alpha",)),
    "seed outside": (["--from", "9,9,9"], ("seed", "in the box")),
    "stability": (["--stability", "firm"], ("firm", "locked-lengths")),
    "mesh format": (["-o", "mesh.obj"], (r"mesh\.obj", r"\.ply")),
    "picture's format": (["--plot", "mesh.gif"], (r"mesh\.gif", r"\.png")),
    "no such folder": (["-o", "nowhere/mesh.ply"], ("nowhere/mesh.ply", "cannot be written")),
    "nothing there": (["--box", "-0.2,-0.2,1.7:0.2,0.2,1.83"], ("no static workspace",)),
    "lambda for nothing": (["--lambda", "50"], ("--lambda: barycentre", "given_lambda")),
    "probe": (["--probe", "1,2"], ("--probe", "has 2 numbers; give 3")),
}


@pytest.mark.parametrize("case", BAD)
def test_wrong_use_is_refused(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments, words = BAD[case]
    assert_refused(cli("workspace", "irma4", *arguments), *words)
    assert not list(tmp_path.iterdir()), "nothing is written"


def test_limits_that_hold_nothing_are_an_empty_workspace(
    cli: Cli, robot: cdprcal.Robot, tmp_path: Path
) -> None:
    weak = altered(robot, name="weak", tension_limits_N=[1.0, 25.0])
    words = ("no static workspace", "outside the limits", "tension_limits_N")
    assert_refused(cli("workspace", robot_file(weak, tmp_path), "--json"), *words)
