"""``cdprcal report``: one page that holds everything and needs nothing else."""

from __future__ import annotations

import base64
import html
import io
import json
import re
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import cdprcal
from browser import PHONE, Tab, browser_tab, chromium
from cdprcal.cli import app
from cdprcal.diagnosis.plots import CABLES
from cdprcal.diagnosis.table import value_rows
from cdprcal.io import load_run
from cdprcal.report import subject_of_logs
from cdprcal.report.night import NIGHT
from cdprcal.report.page import _times_typical, about_ranking
from cdprcal.report.text import moved_by, small, with_sigma
from cdprcal.trust import worst_sigma
from conftest import Browsed, Cli, changed

LARGEST_PAGE_BYTES = 5_000_000
MINUS = "\N{MINUS SIGN}"
BIAS_N = np.array([6.0, -5.0, 4.0, -8.0])


@pytest.fixture(scope="module")
def biased(log: cdprcal.Log, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose load cells read too much or too little."""
    path = tmp_path_factory.mktemp("biased") / "biased.csv"
    log = changed(log, tension_N=log.tension_N + BIAS_N)
    cdprcal.write_log(log, str(path))
    return path


@pytest.fixture(scope="module")
def page(biased: Path) -> Path:
    path = biased.parent / "report.html"
    with pytest.raises(SystemExit) as stop:
        app(["report", "irma4", str(biased), "-o", str(path)], prog_name="cdprcal")
    assert stop.value.code == 0
    return path


def embedded(text: str, name: str) -> Any:
    """The JSON that a page holds under a name."""
    match = re.search(rf'<script type="application/json" id="{name}">(.*?)</script>', text, re.S)
    assert match is not None
    return json.loads(match[1])


def shown(text: str) -> str:
    """What a reader sees: no tags, no scripts, no styles."""
    text = re.sub(r"<(script|style)\b.*?</\1>", "", text, flags=re.S)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", text)).split())


def test_the_page_is_whole_and_light(page: Path) -> None:
    assert page.stat().st_size < LARGEST_PAGE_BYTES
    text = page.read_text()
    head = re.sub(r'<script type="application/octet-stream".*?</script>', "", text, flags=re.S)
    # Nothing is fetched from anywhere: every src and href is inside the page.
    links = re.findall(r'\b(?:src|href)\s*=\s*["\']([^"\']*)', head)
    assert links
    assert all(link.startswith(("#", "data:")) for link in links)
    assert not re.search(r"@import|url\(", head)


def test_the_top_says_what_was_found(page: Path) -> None:
    text = page.read_text()
    title = re.search(r"<h1>(.*?)</h1>", text)
    assert title is not None
    assert title[1] == "The model of irma4 misses one effect: load cell bias"
    assert '<header class="changed">' in text
    assert text.index("<h1>") < text.index("<table")


def test_the_top_and_the_table_say_the_same(page: Path) -> None:
    """How far the pose moved: from that of the table, and from that of the model alone."""
    text = page.read_text()
    numbers = embedded(text, "numbers")
    after = numbers["diagnosis"]["initial_pose_after"]["position_m"]
    allowing, alone = (
        f"{1e3 * np.linalg.norm(np.subtract(after, pose['position_m'])):.2g} mm"
        for pose in (
            numbers["calibrations"][0]["initial_pose"],
            numbers["diagnosis"]["initial_pose_before"],
        )
    )
    assert allowing != alone
    words = shown(text)
    assert (
        f"Without, a calibration that allows for what the model may lack puts it {allowing} away, "
        f"and the model alone {alone}." in words
    )
    assert "model as given allowing for what it may lack with what was found" in words
    assert {figure["name"] for figure in embedded(text, "figures")["residuals"]["data"]} == {
        "model alone",
        "with what was found",
    }


def test_every_number_of_the_diagnosis_is_there_with_its_sigma(page: Path) -> None:
    text = page.read_text()
    words = shown(text)
    numbers = embedded(text, "numbers")
    (effect,) = numbers["diagnosis"]["effects"]
    assert effect["name"] == "load_cell_bias"
    for where, value, deviation, unit in value_rows(effect):
        assert f"{where} {value.replace('-', MINUS)} ± {deviation} {unit}" in words
    for cable, bias in enumerate(effect["parameters"]["bias_N"]):
        sigma = effect["standard_deviation"]["bias_N"][cable]
        assert abs(bias - BIAS_N[cable]) < 5.0 * sigma + 0.5
    pose, covariance = (numbers["diagnosis"][f"{k}_after"] for k in ("initial_pose", "covariance"))
    for i in range(3):
        cell = with_sigma(pose["position_m"][i], float(np.sqrt(covariance[i][i])), "m")
        assert " ".join(cell.split()) in words
    calibration = numbers["calibrations"][0]
    length_mm = 1e3 * calibration["residual_rms"]["length_m"]
    assert f"length {small(length_mm, 'mm')}".replace("\u00a0", " ") in words
    for word in ("cdprcal report", "SHA-256", "gravity_m_s2", "ripple of the readings"):
        assert word in words


def test_the_figures_are_what_plotly_takes(page: Path) -> None:
    graph_objects = pytest.importorskip("plotly.graph_objects")
    figures = embedded(page.read_text(), "figures")
    assert figures.keys() == {"scene-0", "time-0", "residuals", "staircase", "ranking"}
    for figure in figures.values():
        moving = figure.pop("moving", None)
        drawn = graph_objects.Figure(figure)  # refuses names and values that do not exist
        if moving is not None:
            kinds = [type(drawn.data[i]).__name__ for i in moving["traces"]]
            pose = moving["poses"][0]
            assert len(kinds) == len(pose["cables"]) + 3
            assert set(kinds) == {"Scatter3d"}


def test_the_cables_of_the_scene_have_their_lengths(page: Path) -> None:
    text = page.read_text()
    figures, numbers = embedded(text, "figures"), embedded(text, "numbers")
    pose = numbers["diagnosis"]["initial_pose_after"]
    robot = cdprcal.load_robot("irma4")
    state = cdprcal.platform_state(robot, cdprcal.Pose(pose["position_m"], pose["rotation"]))
    for cable, line in enumerate(figures["scene-0"]["moving"]["poses"][0]["cables"]):
        points = np.array(line, dtype=float).T
        length_m = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        assert length_m == pytest.approx(state.length_m[cable], abs=1e-3)
        # The cable enters at D and ends at the platform.
        np.testing.assert_allclose(points[0], robot.cables[cable].pulley.position_m, atol=1e-3)


def test_a_browser_without_network_draws_it_all(page: Path, browse: Callable[..., Browsed]) -> None:
    seen = browse(page.as_uri(), "--virtual-time-budget=60000")
    errors = [line for line in seen.console if "Error" in line or ":ERROR:" in line]
    assert errors == []
    assert 'data-report="drawn"' in seen.dom
    assert seen.dom.count('data-drawn="true"') == 5
    # The picture for paper of the 3D view: it has the colours of all four cables.
    cables_shown(r'id="scene-0".*?<img class="print"[^>]*src=', seen.dom, 200)
    assert "poses at rest" in seen.dom


def cables_shown(before: str, page: str, least: int) -> NDArray[np.float64]:
    """The picture in a page behind this pattern; holds that it has the colours of four cables."""
    from matplotlib.image import imread

    match = re.search(before + '"data:image/png;base64,([^"]+)"', page, re.S)
    assert match is not None
    pixels: NDArray[np.float64] = imread(io.BytesIO(base64.b64decode(match[1])))[..., :3]
    for colour in CABLES[:4]:
        wanted = np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
        assert (np.abs(pixels - wanted).max(axis=-1) < 0.12).sum() > least, colour
    return pixels


DRAWN = "document.documentElement.dataset.report === 'drawn'"
PAPER, NIGHT_PAPER = "rgb(255, 255, 255)", "rgb(20, 25, 31)"


def test_on_a_phone_and_in_the_dark(page: Path, tab: Tab) -> None:
    tab.size(*PHONE, dark=True)
    tab.open(page.as_uri(), DRAWN, seconds=90.0)
    assert tab.wider_than_the_window() == []
    assert tab.js("document.documentElement.scrollWidth") == PHONE[0]
    background = "getComputedStyle(document.documentElement).backgroundColor"
    figure = "getComputedStyle(document.querySelector('#time-0 .main-svg')).backgroundColor"
    assert (tab.js(background), tab.js(figure)) == (NIGHT_PAPER, NIGHT_PAPER)
    # Panels side by side keep a size that can be read, and are scrolled to.
    assert tab.js("document.getElementById('residuals').clientWidth") >= 680
    # A table that goes on beyond the edge shows it by a shadow.
    cut = "[...document.querySelectorAll('table')].filter((t) => t.scrollWidth > t.clientWidth)"
    assert tab.js(f"{cut}.length") > 0
    assert tab.js(f"{cut}.every((t) => getComputedStyle(t).backgroundImage.includes('gradient'))")
    # Pictures for paper are those of paper.
    shown = tab.js("document.querySelector('#time-0 ~ img.print').src")
    assert "20%2C%2025%2C%2031" not in shown
    assert "255%2C%20255%2C%20255" in shown
    tab.size(1160, 900)
    tab.wait(f"{figure} === '{PAPER}'")
    # With WebGL the still picture makes room.
    assert tab.js("document.querySelector('.scene img.still').clientHeight") == 0
    place = "document.getElementById('scene-0')"
    assert tab.js(f"{place}.offsetWidth === {place}.querySelector('.main-svg').clientWidth")
    assert tab.problems == []
    assert tab.foreign_requests() == []


#: The drawn points of a scene as shares of its half width and half height: within 1 they are seen.
FARTHEST = """
(() => {
  const place = document.getElementById("scene-0"), scene = place._fullLayout.scene._scene;
  const { model, view, projection } = scene.glplot.cameraParams;
  const four = [0, 1, 2, 3];
  const times = (m, v) => four.map((i) => four.reduce((a, k) => a + m[4 * k + i] * v[k], 0));
  let farthest = 0;
  for (const { x, y, z } of place.data.filter((trace) => trace.type === "scatter3d"))
    for (let i = 0; i < x.length; ++i) {
      if (x[i] === null || x[i] === undefined) continue;
      const scaled = [x[i], y[i], z[i]].map((v, k) => v * scene.dataScale[k]);
      const [right, up, , depth] = times(projection, times(view, times(model, [...scaled, 1])));
      const share = Math.max(Math.abs(right), Math.abs(up)) / depth;
      farthest = Math.max(farthest, depth > 0 ? share : Infinity);
    }
  return farthest;
})()
"""


def test_the_whole_robot_is_seen_in_every_view(
    page: Path, cli: Cli, tab: Tab, tmp_path: Path
) -> None:
    """A planar robot, and one of any shape; in a wide window and on a phone."""
    run, planar = tmp_path / "run.csv", tmp_path / "planar.html"
    assert cli("generate", "belts4", "-o", run).code == 0
    assert cli("report", "belts4", run, "-o", planar).code == 0
    for size in ((1160, 900), PHONE):
        tab.size(*size)
        for drawn in (page, planar):
            tab.open(drawn.as_uri(), DRAWN, seconds=90.0)
            for view in ("home", "top", "front"):
                tab.click(f"[data-view={view}]")
                tab.wait(f"{FARTHEST} < 0.95 && {FARTHEST} > 0.5")
    assert tab.problems == []


def test_without_webgl_there_is_a_still_picture(page: Path) -> None:
    if chromium() is None:
        pytest.skip("no Chromium on PATH: apt-get install chromium")
    with browser_tab("--disable-gpu", "--disable-3d-apis") as tab:
        tab.size(1160, 900)
        tab.open(page.as_uri(), DRAWN, seconds=90.0)
        assert not tab.js("!!document.createElement('canvas').getContext('webgl')")
        assert tab.js("document.querySelectorAll('[data-drawn]').length") == 4
        still = "document.querySelector('.scene img.still')"
        assert tab.js(f"{still}.naturalWidth") > 600
        assert tab.js(f"{still}.clientWidth") > 600
        assert tab.js("document.getElementById('scene-0').clientHeight") == 0
        assert tab.js("document.querySelector('.scene .controls').clientHeight") == 0
        assert tab.problems == []


def test_the_still_picture_shows_the_cables_and_the_workspace(page: Path) -> None:
    pixels = cables_shown('class="still" src=', page.read_text(), 100)
    grey = (np.ptp(pixels, axis=-1) < 0.06) & (pixels.mean(axis=-1) > 0.75)
    assert (grey & (pixels.mean(axis=-1) < 0.97)).sum() > 20_000


def test_only_the_scripts_of_the_page_may_run(page: Path, tab: Tab, tmp_path: Path) -> None:
    evil = '<script>document.title = "broken in"</script></body>'
    (tmp_path / "evil.html").write_text(page.read_text().replace("</body>", evil))
    tab.open((tmp_path / "evil.html").as_uri(), seconds=90.0)
    assert tab.js("document.title").startswith("The model of irma4")
    assert any("Content Security Policy" in problem for problem in tab.problems)


def test_every_colour_of_the_figures_has_one_for_the_dark(page: Path) -> None:
    figures = embedded(page.read_text(), "figures")
    used = set(re.findall(r'"(#[0-9a-fA-F]{3,8})"', json.dumps(figures)))
    assert len(used) > 10
    assert used <= NIGHT.keys()


def test_all_pages_share_one_palette() -> None:
    style = (resources.files("cdprcal.local_page") / "static" / "page.css").read_text()
    paper, night = style.split("@media (prefers-color-scheme: dark)")

    def cables(text: str) -> dict[str, str]:
        return dict(re.findall(r"--c(\d): (#[0-9a-f]{6})", text))

    assert cables(paper) == {str(i + 1): colour.lower() for i, colour in enumerate(CABLES)}
    in_the_dark = {str(i + 1): NIGHT[colour] for i, colour in enumerate(CABLES)}
    assert cables(paper) | cables(night) == in_the_dark


def test_results_make_the_same_page_as_their_logs(
    cli: Cli, biased: Path, page: Path, tmp_path: Path
) -> None:
    calibration, diagnosis = tmp_path / "c.json", tmp_path / "d.json"
    assert cli("calibrate", "irma4", biased, "-o", calibration).code == 3  # it misfits
    assert cli("diagnose", "irma4", biased, "--result", diagnosis).code == 0
    biased.rename(biased.with_suffix(".away"))
    try:
        ran = cli("report", calibration, diagnosis, "-o", tmp_path / "again.html")
    finally:
        biased.with_suffix(".away").rename(biased)
    assert ran.code == 0, ran.stderr
    again = (tmp_path / "again.html").read_text()

    first, second = (embedded(text, "numbers") for text in (page.read_text(), again))
    assert first["diagnosis"]["verdict"] == second["diagnosis"]["verdict"]
    one, two = (numbers["calibrations"][0] for numbers in (first, second))
    assert one.keys() == two.keys()
    # Solved twice: the same to far below σ.
    apart = np.subtract(one["initial_pose"]["position_m"], two["initial_pose"]["position_m"])
    assert np.all(np.abs(apart) < 0.1 * np.array(one["standard_deviation"][:3]))
    # One of them alone will do.
    for alone in (calibration, diagnosis):
        assert cli("report", alone, "-o", tmp_path / "alone.html").code == 0
    assert "give one, of" not in (tmp_path / "alone.html").read_text()


def test_a_pose_that_cannot_be_trusted_is_said_at_the_top(
    cli: Cli, log: cdprcal.Log, tmp_path: Path
) -> None:
    gone = ("tension_N", "swivel_rad", "tension_setpoint_N", "roll_pitch_yaw_rad")
    log = changed(log, **dict.fromkeys(gone))  # lengths alone
    cdprcal.write_log(log, str(tmp_path / "poor.csv"))
    ran = cli("report", "irma4", tmp_path / "poor.csv", "-o", tmp_path / "poor.html")
    assert ran.code == 1
    text = (tmp_path / "poor.html").read_text()
    assert '<header class="bad">' in text
    assert "no pose that can be trusted" in text


@pytest.mark.parametrize("robot_name", ["ring3", "ring5"])
def test_other_robots_have_a_page_too(cli: Cli, robot_name: str, tmp_path: Path) -> None:
    run = tmp_path / "run.csv"
    assert cli("generate", robot_name, "-o", run, "--noise", "0.05").code == 0
    ran = cli("report", robot_name, run, "-o", tmp_path / "report.html")
    assert ran.code in (0, 1), ran.stderr
    figures = embedded((tmp_path / "report.html").read_text(), "figures")
    assert len(figures["scene-0"]["moving"]["poses"][0]["cables"]) == int(robot_name[-1])


def eight_cables() -> cdprcal.Robot:
    """A robot with more cables than the static workspace is computed for."""
    four = cdprcal.load_robot("irma4")
    cables = []
    for i in range(8):
        angle = 2 * np.pi * i / 8 + 0.3
        away = np.array([np.cos(angle), np.sin(angle), 0.0])
        pulley = cdprcal.Pulley(
            position_m=1.2 * away + [0, 0, 2.0],
            x_axis=-away,
            swivel_axis=[0, 0, -1],
            radius_m=0.03,
        )
        anchor = 0.12 * away + [0, 0, 0.1 + 0.03 * (i % 2)]
        cables.append(cdprcal.Cable(pulley=pulley, platform_anchor_m=anchor))
    return cdprcal.Robot(
        name="octopus", platform=four.platform, cables=cables, tension_limits_N=[1, 500]
    )


def test_eight_cables_and_absent_sensors_have_a_page_too(cli: Cli, tmp_path: Path) -> None:
    robot = eight_cables()
    (tmp_path / "robot.yaml").write_text(cdprcal.to_yaml(robot))
    random = np.random.default_rng(0)
    setpoints = [robot.weight_N / 8 * 1.3 * (1 + random.uniform(-0.25, 0.25, 8)) for _ in range(6)]
    options = cdprcal.SyntheticLogOptions(noise=cdprcal.reading_noise(robot.sigma, 0.05))
    made = cdprcal.synthetic_log(robot, setpoints, options)
    bare = changed(made.log, tension_N=None, tension_setpoint_N=None)
    for name, log in (("whole", made.log), ("bare", bare)):
        cdprcal.write_log(log, str(tmp_path / f"{name}.csv"))
        page = tmp_path / f"{name}.html"
        ran = cli("report", tmp_path / "robot.yaml", tmp_path / f"{name}.csv", "-o", page)
        assert ran.code in (0, 1), ran.stderr
        text = page.read_text()
        assert "no static workspace" in text  # its cables hold no turn about the vertical
        figures = embedded(text, "figures")
        assert len(figures["scene-0"]["moving"]["poses"][0]["cables"]) == 8
        names = {trace["name"] for trace in figures["time-0"]["data"]}
        assert ("cable 8" in names) == (name == "whole")
        assert names >= {"x", "y", "z", "roll", "pitch", "yaw"}


def test_names_cannot_break_out_of_the_page(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    evil = "</script><script>alert(1)</script><!--"
    yaml = cdprcal.builtin_robot_yaml("irma4").replace("name: irma4", f"name: '{evil}'")
    (tmp_path / "robot.yaml").write_text(yaml)
    log = tmp_path / "<img src=x onerror=alert(1)>.csv"
    log_path.rename(log)
    ran = cli("report", tmp_path / "robot.yaml", log, "-o", tmp_path / "report.html")
    assert ran.code == 0, ran.stderr
    text = (tmp_path / "report.html").read_text()
    assert "<script>alert" not in text
    assert "<img src=x" not in text
    assert embedded(text, "numbers")["calibrations"]


def test_wrong_use_is_said_and_nothing_is_written(
    cli: Cli, log_path: Path, biased: Path, tmp_path: Path
) -> None:
    result, other = tmp_path / "c.json", tmp_path / "o.json"
    cli("calibrate", "irma4", log_path, "-o", result)
    cli("diagnose", "irma4", biased, "--result", other)
    (tmp_path / "plain.json").write_text('{"status": "converged"}')
    (tmp_path / "half.json").write_text('{"inputs": {"command": "calibrate"}}')
    for arguments, words in (
        (("irma4",), "name its logs after it"),
        (("irma4", log_path, "-o", tmp_path / "page.pdf"), "give a page a name in .html or .htm"),
        (("irma4", tmp_path / "none.csv"), "none.csv: cannot be read"),
        (("nobody", log_path), "nobody"),
        ((tmp_path / "plain.json",), "is no result file"),
        ((tmp_path / "half.json",), "damaged"),
        ((result, other), "the diagnosis is of other logs"),
        ((other, other), "2 diagnoses"),
    ):
        out = tmp_path / "out.html"
        ran = cli("report", *arguments, *(() if "-o" in arguments else ("-o", out)))
        ran.refused(words)
        assert not out.exists()


def test_numbers_are_shown_to_two_digits_of_sigma() -> None:
    assert with_sigma(0.367123, 0.00041, "m") == "0.36712\u00a0±\u00a00.00041\u00a0m"
    assert with_sigma(-12.3456, 1.234, "°") == f"{MINUS}12.3\u00a0±\u00a01.2°"
    assert with_sigma(None, 1.0, "m") == "–"
    assert with_sigma(1.0, None, "m") == "1.0000\u00a0m"
    assert small(23912.0, "") == "23,912"
    assert small(423.0, "", 2) == "420"
    assert small(0.000123, "", 2) == "0.00012"
    covariance = np.diag([1.0, 4.0, 9.0, 16.0, 25.0, 36.0])
    assert worst_sigma(covariance) == (3.0, 6.0)
    assert worst_sigma(None) is None


def test_a_way_that_nobody_can_measure_has_no_digits() -> None:
    def pose(x_m: float) -> dict[str, list[float]]:
        return {"position_m": [x_m, 0.0, 1.0]}

    near = {"initial_pose_before": pose(1e-7), "initial_pose_after": pose(0.0)}
    said = "the model puts it less than 0.01 mm away"
    assert moved_by({"initial_pose": pose(-2e-7)}, near) == said


def test_hatching_is_explained_where_there_is_some(page: Path) -> None:
    text = page.read_text()
    (effect,) = embedded(text, "numbers")["diagnosis"]["effects"]
    hatched = any(bar["marker"]["pattern"] for bar in embedded(text, "figures")["ranking"]["data"])
    assert hatched == bool(effect["rivals"])
    assert ("Hatched:" in shown(text)) == hatched
    assert "Hatched:" in about_ranking(hatched=True)


def test_encoders_fit_the_pose_that_is_shown(biased: Path) -> None:
    """The pose is the diagnosis' own, not that of the last calibration: so are the lengths."""
    robot = cdprcal.load_robot("irma4")
    subject = subject_of_logs(robot, [load_run(biased, robot)], ["cdprcal"])
    document = subject.runs[0].best
    pose = document["initial_pose"]
    shown = cdprcal.platform_state(robot, cdprcal.Pose(pose["position_m"], pose["rotation"]))
    np.testing.assert_allclose(document["initial_lengths_m"], shown.length_m, atol=1e-9)
    np.testing.assert_allclose(document["initial_swivels_rad"], shown.swivel_rad, atol=1e-9)
    alone = cdprcal.calibrate(subject.corrected, subject.runs[0].log).result
    assert np.abs(alone.initial_length_m - shown.length_m).max() > 1e-6, "this tests nothing"


def test_what_no_effect_can_be_is_not_given_in_typical_sizes() -> None:
    infos = {info.name: info for info in cdprcal.effect_catalogue()}
    assert _times_typical(infos["load_cell_bias"], 0.5) == "0.5 × typical"
    assert _times_typical(infos["load_cell_bias"], 55357.0) == "no believable one"
    assert _times_typical(infos["load_cell_bias"], None) == "–"


@pytest.fixture(scope="module")
def listed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A robot file, and a list of rests: one row each, whole lengths and tensions."""
    folder = tmp_path_factory.mktemp("listed")
    text = cdprcal.builtin_robot_yaml("belts4")
    robot_path, log_path = folder / "robot.yaml", folder / "rests.csv"
    robot_path.write_text(text)
    robot = cdprcal.load_robot(robot_path)
    setpoints_N, poses = cdprcal.default_stops(robot, 3, 1, 3)
    rng = np.random.default_rng(2)
    length_m = np.array([cdprcal.platform_state(robot, pose).length_m for pose in poses])
    tension_N = np.array(setpoints_N)
    log = cdprcal.Log(
        time_s=10.0 * np.arange(len(poses)),
        direct_length_m=length_m + rng.normal(0.0, 1e-4, length_m.shape),
        tension_N=tension_N + rng.normal(0.0, 0.3, tension_N.shape),
    )
    cdprcal.write_log(log, str(log_path))
    return robot_path, log_path


def test_of_a_list_of_rests_no_ripple_is_told(
    cli: Cli, listed: tuple[Path, Path], tmp_path: Path
) -> None:
    ran = cli("diagnose", *listed, "--json", "--result", tmp_path / "rests.json")
    assert set(ran.document()["ripple"].values()) == {None}
    ran = cli("repeat", tmp_path / "rests.json", "--json")
    assert set(ran.document()["again"]["ripple"].values()) == {None}
    ran = cli("report", *listed, "-o", tmp_path / "rests.html")
    assert ran.code == 0, ran.stderr
    assert "Model and sensors agree" in ran.stdout
    words = shown((tmp_path / "rests.html").read_text())
    assert "ripple" not in words
    assert "they repeat" not in words


def test_captions_say_what_is_drawn(page: Path, cli: Cli, listed: tuple[Path, Path]) -> None:
    parts = ("Shaded:", "set-points", "open ones: in motion", "The band is", "Dotted: the readings")
    words = shown(page.read_text())
    assert all(part in words for part in parts)
    rests = listed[0].parent / "captions.html"
    assert cli("report", *listed, "-o", rests).code == 0
    words = shown(rests.read_text())
    assert not any(part in words for part in parts)


def test_titles_of_one_row_of_panels_lie_below_the_legend(
    cli: Cli, listed: tuple[Path, Path]
) -> None:
    rests = listed[0].parent / "legend.html"
    assert cli("report", *listed, "-o", rests).code == 0
    drawn = embedded(rests.read_text(), "figures")["residuals"]["layout"]
    assert {key for key in drawn if key.startswith("yaxis")} == {
        "yaxis",
        *(f"yaxis{k}" for k in "234"),
    }
    inside_px = drawn["height"] - drawn["margin"]["t"] - drawn["margin"]["b"]
    room_px = (drawn["legend"]["y"] - drawn["yaxis"]["domain"][1]) * inside_px
    assert room_px > max(note["font"]["size"] for note in drawn["annotations"]) + 4
