"""Explore: the page's numbers are the diagnosis', and a browser switches, clicks and saves."""

from __future__ import annotations

import contextlib
import json
import re
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from browser import PHONE, Tab
from cdprcal.diagnosis import diagnosis_as_dict
from cdprcal.explore import Exploration, ExploreServer
from cdprcal.explore.exploration import Choice, LeftOut, without_rests
from conftest import TABLE_II_TENSIONS_N, Cli, changed
from local_pages import ask, serves_until_ctrl_c

BIAS_N = (6.0, -5.0, 4.0, -8.0)
READY = "document.documentElement.dataset.explore === 'ready'"


def biased(log: cdprcal.Log) -> cdprcal.Log:
    return changed(log, tension_N=np.array(log.tension_N) + np.array(BIAS_N))


@pytest.fixture(scope="module")
def logs(robot: cdprcal.Robot, log: cdprcal.Log) -> list[cdprcal.Log]:
    """Two runs of a robot whose load cells are biased."""
    options = cdprcal.SyntheticLogOptions(
        dwell_s=4.0, move_s=4.0, noise=cdprcal.reading_noise(robot.sigma, 0.05), seed=8
    )
    tensions = [np.array(t) for t in TABLE_II_TENSIONS_N]
    other = cdprcal.synthetic_log(robot, tensions, options)
    return [biased(log), biased(other.log)]


@pytest.fixture
def server(
    robot: cdprcal.Robot, logs: list[cdprcal.Log], tmp_path: Path
) -> Iterator[ExploreServer]:
    exploration = Exploration(robot, logs[:1])
    with ExploreServer(exploration, ["run.csv"], output=tmp_path / "corrected.yaml") as serving:
        yield serving


def told(server: ExploreServer, path: str, body: Any) -> tuple[int, Any]:
    answer = ask(server, "POST", path, body=body, X_Token=server.token)
    return answer.status, json.loads(answer.read())


def rms(page: dict[str, Any], channel: str, when: str = "now") -> float:
    return float(next(row[when] for row in page["rms"] if row["channel"] == channel))


def on(page: dict[str, Any]) -> list[str]:
    return [effect["name"] for effect in page["effects"] if effect["on"]]


def test_it_begins_with_what_diagnose_finds(
    server: ExploreServer, robot: cdprcal.Robot, logs: list[cdprcal.Log]
) -> None:
    status, page = told(server, "/fit", {})
    document = diagnosis_as_dict(cdprcal.diagnose(robot, logs[0]), robot, logs=logs[:1])
    assert (status, page["said"]) == (200, "explained: load_cell_bias")
    assert on(page) == ["load_cell_bias"]
    assert page["evidence"] == pytest.approx(document["effects"][0]["log_evidence"])
    gap = {g["channel"]: g["train_rms"] for g in document["gap"] if g["after_effect"]}
    assert rms(page, "tension [N]") == pytest.approx(gap["tension_N"], abs=5e-4)
    values = [float(value) for _, value, _, _ in page["effects"][0]["values"]]
    np.testing.assert_allclose(values, BIAS_N, atol=0.5)
    x, _, _, now, sigma, *_ = page["pose"][0]
    after = document["initial_pose_after"]["position_m"]
    assert x == "x"
    assert float(now) == pytest.approx(1e3 * after[0], abs=5e-3)
    expected = 1e3 * float(np.sqrt(document["covariance_after"][0][0]))
    assert float(sigma) == pytest.approx(expected, abs=5e-3)


def test_an_effect_is_switched_off_and_on(server: ExploreServer) -> None:
    _, found = told(server, "/fit", {})
    _, without = told(server, "/fit", {"effects": []})
    _, again = told(server, "/fit", {"effects": ["load_cell_bias"]})
    assert on(without) == []
    assert without["evidence"] == 0.0
    assert rms(without, "tension [N]") > 10.0 * rms(again, "tension [N]")
    assert rms(again, "tension [N]", "given") == rms(without, "tension [N]")
    assert again["evidence"] == pytest.approx(found["evidence"])
    for channel in (row["channel"] for row in found["rms"]):
        assert rms(again, channel) == pytest.approx(rms(found, channel), rel=0.01)
    # What is not in the model is listed by what it would add: the right one first.
    assert without["effects"][0]["name"] == "load_cell_bias"
    assert without["effects"][0]["evidence"] > 10.0


def test_a_pose_that_is_left_out_has_no_say(server: ExploreServer) -> None:
    _, whole = told(server, "/fit", {"effects": []})
    times_s = whole["channels"][0]["series"][0]["x"]
    _, page = told(server, "/fit", {"effects": [], "left_out": [[0, times_s[3]]]})
    series = next(s for s in page["channels"][0]["series"] if s["now"])
    assert [y is None for y in series["y"]] == [i == 3 for i in range(len(times_s))]
    assert page["pose"] != whole["pose"]


def test_what_is_left_out_is_read_no_more_and_nothing_else_is(
    robot: cdprcal.Robot, logs: list[cdprcal.Log]
) -> None:
    log = logs[0]
    less = without_rests(log, robot, [26.0])
    gone = np.isnan(less.tension_N[:, 0])
    assert (less.time_s[gone][0], less.time_s[gone][-1]) == (23.7, pytest.approx(28.4))
    np.testing.assert_array_equal(np.isnan(less.length_m[:, 2]), gone)
    np.testing.assert_array_equal(less.length_m[~gone], log.length_m[~gone])
    np.testing.assert_array_equal(less.tension_setpoint_N, log.tension_setpoint_N)
    assert without_rests(log, robot, []) is log
    with pytest.raises(cdprcal.InputError, match="no rest at 22 s that could be left out"):
        without_rests(log, robot, [22.0])
    with pytest.raises(cdprcal.InputError, match="holds the initial pose"):
        without_rests(log, robot, [1.35])


def test_two_logs_are_laid_over_each_other(robot: cdprcal.Robot, logs: list[cdprcal.Log]) -> None:
    with ExploreServer(Exploration(robot, logs), ["a.csv", "b.csv"]) as server:
        _, page = told(server, "/fit", {})
        assert on(page) == ["load_cell_bias"]
        for channel in page["channels"]:
            assert {(s["log"], s["now"]) for s in channel["series"]} == {
                (run, now) for run in (0, 1) for now in (False, True)
            }
        _, less = told(server, "/fit", {"left_out": [[1, 26.0]]})
        empty = {s["log"] for s in less["channels"][0]["series"] if any(y is None for y in s["y"])}
        assert empty == {1}


class Endless(Exploration):
    """A search that goes on until it is told to end."""

    fits = 0

    def fit(
        self, choice: Choice, progress: Callable[[str], bool] | None = None
    ) -> cdprcal.Diagnosis:
        self.fits += 1
        while choice.effects is None and progress is not None and progress("scan after 0 effects"):
            time.sleep(0.01)
        return super().fit(Choice(effects=(), left_out=choice.left_out) if progress else choice)


@pytest.fixture
def endless(robot: cdprcal.Robot, logs: list[cdprcal.Log]) -> Iterator[ExploreServer]:
    with ExploreServer(Endless(robot, logs[:1]), ["run.csv"]) as serving:
        yield serving


def test_a_search_ends_when_something_else_is_asked_for(endless: ExploreServer) -> None:
    with ThreadPoolExecutor() as threads:
        search = threads.submit(told, endless, "/fit", {})
        while told(endless, "/step", None)[1]["step"] != "scan after 0 effects":
            time.sleep(0.01)
        status, page = told(endless, "/fit", {"effects": ["load_cell_bias"]})
        assert (status, on(page)) == (200, ["load_cell_bias"])
        status, answer = search.result()
    assert status == 400
    assert "ended, since a page asked for something else" in answer["error"]


def test_what_was_fitted_is_not_fitted_again(robot: cdprcal.Robot, logs: list[cdprcal.Log]) -> None:
    exploration = Endless(robot, logs[:1])
    with ExploreServer(exploration, ["run.csv"]) as server:
        first = told(server, "/fit", {"effects": []})
        assert told(server, "/fit", {"effects": []}) == first
        assert exploration.fits == 1
        for pose in range(40):
            told(server, "/fit", {"effects": [], "left_out": [[0, 22.0 + pose / 1e3]]})
        assert told(server, "/save", {"effects": []})[0] == 200
        assert exploration.fits == 41


def test_saving_writes_the_corrected_robot(server: ExploreServer, tmp_path: Path) -> None:
    choice = {"effects": ["load_cell_bias"], "left_out": [[0, 26.0]]}
    path = tmp_path / "corrected.yaml"
    assert told(server, "/save", choice) == (200, {"saved": str(path)})
    corrected = cdprcal.load_robot(path)
    assert [effect.name for effect in corrected.effects] == ["load_cell_bias"]
    np.testing.assert_allclose(corrected.effects[0].parameters["bias_N"], BIAS_N, atol=0.5)
    text = path.read_text()
    assert "\n# Made by cdprcal explore from run.csv; effects chosen by hand.\n" in text
    assert "# Left out: the pose at 26 s of run.csv.\n" in text


def test_without_an_output_the_browser_gets_the_file(
    robot: cdprcal.Robot, logs: list[cdprcal.Log]
) -> None:
    with ExploreServer(Exploration(robot, logs[:1]), ["run.csv"]) as server:
        status, saved = told(server, "/save", {})
    assert (status, saved["name"]) == (200, "irma4-corrected.yaml")
    assert len(cdprcal.parse_robot(saved["text"], "saved").effects) == 1


def test_what_cannot_be_done_is_said(server: ExploreServer, tmp_path: Path) -> None:
    for body, words in (
        ({"effects": ["nonsense"]}, "'nonsense' is not known; give one of"),
        ({"left_out": [[0, 22.0]]}, "no rest at 22 s"),
        ({"left_out": [[1, 26.0]]}, "there is no log 2 to leave a pose out of"),
        ({"left_out": [[0]]}, "left_out.0"),
        ({"efects": []}, "efects: Extra inputs are not permitted"),
        ([], "the choice: "),
    ):
        status, answer = told(server, "/fit", body)
        assert status == 400
        assert words in answer["error"]
    (tmp_path / "corrected.yaml").mkdir()
    status, answer = told(server, "/save", {"effects": []})
    assert status == 400
    assert "corrected.yaml" in answer["error"]


def test_only_the_page_itself_may_ask(server: ExploreServer, tmp_path: Path) -> None:
    assert ask(server, "POST", "/save", body={}).status == 403
    assert ask(server, "POST", "/save", body={}, X_Token="guess").status == 403
    evil = ask(server, "POST", "/fit", body={}, X_Token=server.token, Host="evil.example")
    assert evil.status == 403
    assert not (tmp_path / "corrected.yaml").exists()
    assert ask(server, "GET", "/events").status == 404
    page = ask(server, "GET", "/")
    assert "default-src 'none'" in str(page.getheader("Content-Security-Policy"))
    match = re.search(r'name="token" content="([^"]+)"', page.read().decode())
    assert match is not None
    assert match[1] == server.token
    # The answer may come before all of it is sent.
    with contextlib.suppress(BrokenPipeError, ConnectionResetError):
        too_long = ask(server, "POST", "/fit", body="x" * (1 << 20), X_Token=server.token)
        assert too_long.status == 413


def test_the_choice_is_read_strictly() -> None:
    assert Choice.model_validate({}).effects is None
    made = Choice.model_validate({"effects": ["mass"], "left_out": [[0, 1.5]]})
    assert made == Choice(effects=("mass",), left_out=(LeftOut(0, 1.5),))


# In a browser.


def tension_rms(tab: Tab) -> float:
    row = tab.js("[...document.querySelectorAll('#rms tr')].at(-1).innerText.split('\\t')")
    assert row[0] == "tension [N]"
    return float(row[2])


def test_in_a_browser(server: ExploreServer, tab: Tab, tmp_path: Path) -> None:
    tab.size(1280, 900)
    tab.open(server.address, READY)
    assert tab.text("#said") == "explained: load_cell_bias"
    found = tension_rms(tab)
    box = '[data-effect="load_cell_bias"]'

    tab.click(box)
    tab.wait(f"{READY} && document.querySelector('#said').textContent.startsWith('0 effects')")
    assert tension_rms(tab) > 10.0 * found
    tab.click(box)
    tab.wait(f"{READY} && document.querySelector('#said').textContent.startsWith('1 effect,')")
    assert tension_rms(tab) == found
    assert re.search(r"evidence \+\d+\.\d nat \(\+\d+\.\d nat\)", tab.text("#said"))

    # A click on a point leaves its pose out; the button takes it back.
    before = tab.text("#pose")
    tab.js("document.querySelector('.plot').scrollIntoView({block: 'center'})")
    tab.click(".plot .scatterlayer .trace:nth-last-child(1) .point:nth-child(4)")
    tab.wait(f"{READY} && document.querySelectorAll('#left-out button').length === 1")
    assert tab.text("#left-out button") == "26.0 s left out: take it back"
    assert tab.text("#pose") != before
    tab.click("#left-out button")
    tab.wait(f"{READY} && document.querySelectorAll('#left-out button').length === 0")
    assert tab.text("#pose") == before

    # The initial pose stays: the page says why, and goes on.
    tab.click(".plot .scatterlayer .trace:nth-last-child(1) .point:nth-child(1)")
    tab.wait("!document.querySelector('#warning').hidden")
    assert "holds the initial pose" in tab.text("#warning")
    tab.click("#none")
    tab.wait(f"{READY} && document.querySelector('#warning').hidden")

    tab.click("#find")
    tab.wait(f"{READY} && document.querySelector('#said').textContent.startsWith('explained')")
    tab.click("#save")
    tab.wait("!document.querySelector('#done').hidden")
    assert tab.text("#done") == f"Saved: {tmp_path / 'corrected.yaml'}"
    assert len(cdprcal.load_robot(tmp_path / "corrected.yaml").effects) == 1
    assert [p for p in tab.problems if "400" not in p] == []
    assert tab.foreign_requests() == []


def test_the_model_as_given_is_there_before_the_search_ends(
    endless: ExploreServer, tab: Tab
) -> None:
    tab.size(1280, 900)
    tab.open(endless.address, "document.querySelectorAll('#rms tr').length > 2")
    tab.wait("document.querySelector('#said').textContent.endsWith('… scan after 0 effects')")
    assert tab.js("document.documentElement.dataset.explore") == "busy"
    given = tension_rms(tab)
    tab.click('[data-effect="load_cell_bias"]')
    tab.wait(f"{READY} && document.querySelector('#said').textContent.startsWith('1 effect,')")
    assert tension_rms(tab) < given / 10.0
    assert tab.js("document.querySelector('#warning').hidden")


def test_on_a_phone_in_the_dark(server: ExploreServer, tab: Tab) -> None:
    tab.size(*PHONE, dark=True)
    tab.open(server.address, READY)
    assert tab.wider_than_the_window() == []
    assert tab.js("document.documentElement.scrollWidth") == PHONE[0]
    paper = "rgb(20, 25, 31)"
    assert tab.js("getComputedStyle(document.documentElement).backgroundColor") == paper
    fill = "getComputedStyle(document.querySelector('.plot .main-svg')).background"
    assert str(tab.js(fill)).startswith(paper)
    tab.size(*PHONE)  # the owner turns the light on
    tab.wait(f"{fill}.startsWith('rgb(255, 255, 255)')")
    assert tab.problems == []


# The command.


def test_the_command_serves_until_ctrl_c(logs: list[cdprcal.Log], tmp_path: Path) -> None:
    for name, log in zip("ab", logs, strict=True):
        cdprcal.write_log(log, str(tmp_path / f"{name}.csv"))
    given = ("irma4", tmp_path / "a.csv", tmp_path / "b.csv")
    serves_until_ctrl_c("<title>cdprcal, explore</title>", "/", "explore", *given)


def test_wrong_use_is_said(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    for arguments, words in (
        (("irma4", tmp_path / "none.csv"), "cannot be read"),
        (("nobody", log_path), "nobody"),
        (("irma4", log_path, log_path), "give each run once"),
        (("irma4", log_path, "--port", "70000"), "--port"),
    ):
        cli("explore", *arguments).refused(words)
