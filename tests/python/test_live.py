"""The live page: this computer only, read-only unless asked, the same page for a run and a log."""

from __future__ import annotations

import http.client
import json
import re
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from browser import PHONE, Tab
from cdprcal.io import load_log
from cdprcal.io.events import read_events
from cdprcal.live import Feed, LiveServer, places_of, replay_messages
from cdprcal.live.feed import end_message, estimate_message, hello, sample_message
from conftest import Browsed, Cli, raw_text
from local_pages import ask, get, serves_until_ctrl_c, started


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("live") / "plan.csv"
    robot = cdprcal.load_robot("irma4")
    made = cdprcal.make_plan(robot, grid=[2, 1, 1])
    path.write_text(cdprcal.format_plan(made.plan))
    return path


def events(server: LiveServer) -> list[dict[str, Any]]:
    """All messages of a feed that ends."""
    answer = ask(server, "GET", "/events")
    assert answer.getheader("Content-Type") == "text/event-stream"
    texts = re.findall(r"^data: (.*)$", answer.read().decode(), re.M)
    return [json.loads(text) for text in texts]


def greeting(**more: Any) -> dict[str, Any]:
    return hello("run.csv", cdprcal.load_robot("irma4"), 4, 3, replay=False, **more)


def estimate(**more: Any) -> dict[str, Any]:
    """As acquire logs one."""
    return {
        "rests": 1,
        "status": "converged",
        "position_m": [0.4, 0.4, 1.2],
        "rotation": np.eye(3).tolist(),
        "position_sigma_m": 1e-3,
        "rotation_sigma_rad": 1e-2,
        "reached": False,
        **more,
    }


def test_a_page_opened_late_gets_everything() -> None:
    feed = Feed(greeting())
    feed.publish(sample_message(0.1, [1.0, np.nan], [2.0, 3.0], state="moving", setpoint=2))
    with LiveServer(feed.messages) as server:
        seen: list[dict[str, Any]] = []
        reader = threading.Thread(target=lambda: seen.extend(events(server)))
        reader.start()
        feed.publish(estimate_message(1.0, estimate(), cdprcal.EulerConvention.XYZ))
        feed.publish(end_message("holding", "cable 2 is slack"))
        feed.close()
        reader.join(10.0)
        assert [message["type"] for message in seen] == ["hello", "sample", "estimate", "end"]
        assert seen[0]["limits_N"] == [20.0, 400.0]
        assert seen[1]["tension_N"] == [1.0, None]
        assert seen[2]["pose"]["position_m"] == [0.4, 0.4, 1.2]
        assert events(server) == seen  # after the end, too


def test_a_page_that_does_not_read_holds_nothing_up() -> None:
    feed = Feed(greeting())
    stuck = feed.messages()
    next(stuck)
    for i in range(6000):  # more than is kept for one reader
        feed.publish(sample_message(float(i), [], []))
    assert sum(1 for _ in _until_heartbeat(feed)) == 6001


def _until_heartbeat(feed: Feed) -> Iterator[str]:
    for text in feed.messages(heartbeat_s=0.05):
        if not text:
            return
        yield text


def test_only_this_computer_and_only_by_its_name() -> None:
    with LiveServer(Feed(greeting()).messages) as server:
        assert server.address.startswith("http://127.0.0.1:")
        assert ask(server, "GET", "/").status == 200
        assert ask(server, "GET", "/", Host=f"localhost:{server.port}").status == 200
        assert ask(server, "GET", "/", Host="evil.example").status == 403
        assert ask(server, "GET", "/events", Host=f"evil.example:{server.port}").status == 403
        assert ask(server, "GET", "/../../etc/passwd").status == 404
        assert "default-src 'none'" in str(
            ask(server, "GET", "/").getheader("Content-Security-Policy")
        )
        with pytest.raises(cdprcal.InputError, match="is taken"):
            LiveServer(Feed(greeting()).messages, port=server.port)


def test_without_permission_nothing_can_be_stopped() -> None:
    with LiveServer(Feed(greeting()).messages) as server:
        assert ask(server, "POST", "/stop", X_Token=server.token).status == 403
        assert server.token not in ask(server, "GET", "/").read().decode()


def test_with_permission_the_page_alone_can_stop() -> None:
    stops: list[int] = []
    feed = Feed(greeting(may_stop=True))
    with LiveServer(feed.messages, stop=lambda: stops.append(1)) as server:
        assert ask(server, "POST", "/stop").status == 403
        assert ask(server, "POST", "/stop", X_Token="guess").status == 403
        assert stops == []
        page = ask(server, "GET", "/").read().decode()
        match = re.search(r'name="token" content="([^"]+)"', page)
        assert match is not None
        assert ask(server, "POST", "/stop", X_Token=match[1]).status == 204
        assert stops == [1]


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_an_acquired_log_replays_as_it_went(
    cli: Cli, plan: Path, tmp_path: Path, suffix: str
) -> None:
    log = tmp_path / f"run.{suffix}"
    ran = cli("acquire", "irma4", plan, "-o", log, "--quick", "--json")
    acquired = json.loads(ran.stdout)
    file = load_log(log)
    slept: list[float] = []
    texts = replay_messages(file, cdprcal.load_robot("irma4"), 3, speed=10.0, sleep=slept.append)
    messages = [json.loads(text) for text in texts]
    assert [messages[0]["type"], messages[-1]["type"]] == ["hello", "end"]
    samples = [m for m in messages if m["type"] == "sample"]
    assert len(samples) == len(file.log) + 1  # and once more what the last event made of it
    assert samples[-1]["done"] == acquired["setpoints"] == 3
    assert {m["state"] for m in samples} >= {"recording", "moving", "measuring", "done"}
    assert sum(slept) == pytest.approx(float(np.ptp(file.log.time_s)) / 10.0)
    assert messages[-1] == {"type": "end", "state": "done", "reason": ""}
    assert read_events(log)[-1]["state"] == "done"
    # A run that is killed leaves a log that replays as far as it goes.
    data = log.read_bytes()
    log.write_bytes(data[: len(data) * 2 // 3])
    cut = [json.loads(text) for text in replay_messages(load_log(log), None, None, speed=0.0)]
    assert cut[0]["limits_N"] is None
    assert 0 < sum(m["type"] == "sample" for m in cut) < len(samples)


def test_estimates_in_a_log_are_replayed(cli: Cli, plan: Path, tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    ran = cli("acquire", "irma4", plan, "-o", log, "--quick", "--json")
    made = json.loads(ran.stdout)["estimates"]
    assert made
    texts = replay_messages(load_log(log), cdprcal.load_robot("irma4"), None, speed=0.0)
    found = [m for m in map(json.loads, texts) if m["type"] == "estimate"]
    assert [m["rests"] for m in found] == [e["rests"] for e in made]
    assert found[-1]["position_sigma_m"] == made[-1]["position_sigma_m"]
    np.testing.assert_allclose(found[-1]["pose"]["position_m"], made[-1]["position_m"], atol=1e-6)


def test_where_it_is_at_every_sample_is_replayed(synthetic: cdprcal.SyntheticLog) -> None:
    places = places_of(synthetic.log, cdprcal.load_robot("irma4"))
    times = synthetic.log.time_s.tolist()
    assert len(places) > 0.95 * len(times)
    off = np.array(
        [
            (places[t].position_m - truth.position_m) / places[t].sigma_m
            for t, truth in zip(times, synthetic.poses, strict=True)
            if t in places
        ]
    )
    assert np.abs(off).max() < 6.0
    assert 0.2 < np.sqrt(np.mean(off**2)) < 2.0
    alone = cdprcal.Log(time_s=synthetic.log.time_s[:5], length_m=synthetic.log.length_m[:5])
    assert places_of(alone, cdprcal.load_robot("irma4")) == {}  # too little to calibrate


def test_acquire_tells_where_it_is(plan: Path, tmp_path: Path) -> None:
    running, port = started(
        "acquire", "irma4", plan, "-o", tmp_path / "run.csv", "--live", "--speed", "20"
    )
    try:
        stream = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        stream.request("GET", "/events")
        lines = stream.getresponse().read().decode().splitlines()
        assert running.wait(60) == 0
    finally:
        running.kill()
    messages = [json.loads(line[6:]) for line in lines if line.startswith("data: ")]
    places = [m["place"] for m in messages if m["type"] == "sample"]
    assert places[0] is None  # nothing is known at power-on
    assert 0.0 < max(places[-1]["position_sigma_m"]) < 0.1
    assert len(places[-1]["position_m"]) == 3


def test_rests_are_found_in_logs_of_other_origin(
    log: cdprcal.Log, log_path: Path, tmp_path: Path
) -> None:
    (tmp_path / "raw.log").write_text(raw_text(log))
    for path in (log_path, tmp_path / "raw.log"):
        texts = replay_messages(load_log(path), None, None, speed=0.0)
        samples = [m for m in map(json.loads, texts) if m["type"] == "sample"]
        assert {m["does"] for m in samples} == {"moving", "at rest"}
        assert samples[-1]["done"] == 8


def test_the_page_in_a_browser(log_path: Path, browse: Callable[..., Browsed]) -> None:
    def messages() -> Iterator[str]:
        file, robot = load_log(log_path), cdprcal.load_robot("irma4")
        places = places_of(file.log, robot)
        *whole, end = replay_messages(file, robot, 8, places=places, speed=0.0)
        yield from whole
        for k in range(1, 4):
            made = estimate(rests=k, position_sigma_m=1e-3 / k, rotation_sigma_rad=1e-2 / k)
            effect = {"name": "mass", "log_evidence": 30.0 * k, "rivals": ["external_force"]}
            made["diagnosis"] = {"verdict": "explained", "faults": [], "effects": [effect]}
            yield json.dumps(estimate_message(10.0 * k, made, cdprcal.EulerConvention.XYZ))
        yield end

    with LiveServer(messages) as server:
        seen = browse(server.address, "--virtual-time-budget=20000")
    assert [line for line in seen.console if "Error" in line or "Refused" in line] == []
    assert 'data-live="ended"' in seen.dom
    assert "8 of 8" in seen.dom
    assert 'id="stop" hidden' in seen.dom
    assert "1.2000 m" in seen.dom
    assert re.search(r'id="place">[^<]+ m<', seen.dom)
    assert "mm (1 σ)" in seen.dom
    assert "0.33 mm and ± 0.19°" in seen.dom
    assert "After 3 rests: explained: mass (90 nats, or external_force)." in seen.dom
    assert seen.dom.count('class="main-svg"') >= 6  # all three figures are drawn


def test_on_a_phone_in_the_dark(log_path: Path, tab: Tab) -> None:
    def messages() -> Iterator[str]:
        yield from replay_messages(load_log(log_path), cdprcal.load_robot("irma4"), 8, speed=0.0)

    ended = "document.documentElement.dataset.live === 'ended'"
    with LiveServer(messages) as server:
        tab.size(*PHONE, dark=True)
        tab.open(server.address, ended)
        assert tab.wider_than_the_window() == []
        told = tab.js("document.getElementById('no-estimate').textContent")
        assert told == "The log holds no estimate: cdprcal calibrate makes one of it."
        assert tab.js("document.documentElement.scrollWidth") == PHONE[0]
        fill = "getComputedStyle(document.querySelector('#plot .main-svg')).background"
        assert str(tab.js(fill)).startswith("rgb(20, 25, 31)")
        tab.size(*PHONE)
        tab.wait(f"{fill}.startsWith('rgb(255, 255, 255)')")
        assert tab.problems == []
        assert tab.foreign_requests() == []


def test_acquire_shows_its_run_and_the_page_stops_it(plan: Path, tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    arguments = ("acquire", "irma4", plan, "-o", log, "--live-stop", "--speed", "4")
    running, port = started(*arguments)
    try:
        match = re.search(r'name="token" content="([^"]+)"', get(port, "/"))
        assert match is not None
        stream = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        stream.request("GET", "/events")
        answer = stream.getresponse()
        kinds: list[str] = []
        while len(kinds) < 5:
            line = answer.readline().decode()
            if line.startswith("data: "):
                kinds.append(json.loads(line[6:])["type"])
        assert kinds == ["hello", *["sample"] * 4]
        stop = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        stop.request("POST", "/stop", headers={"X-Token": match[1]})
        assert stop.getresponse().status == 204
        rest = answer.read().decode()
        assert running.wait(30) == 1
    finally:
        running.kill()
    assert '"type": "end", "state": "holding"' in rest
    assert read_events(log)[-1]["state"] == "holding"


def test_a_port_that_is_taken_is_said_before_anything_begins(
    cli: Cli, plan: Path, tmp_path: Path
) -> None:
    with LiveServer(Feed(greeting()).messages) as server:
        log = tmp_path / "run.csv"
        ran = cli("acquire", "irma4", plan, "-o", log, "--live", "--port", server.port)
    ran.refused("is taken; choose another")
    assert not log.exists()


def test_a_page_that_fails_does_not_stop_the_robot(capfd: pytest.CaptureFixture[str]) -> None:
    from cdprcal.cli.live import Page

    class Broken:
        def show(self, *arguments: Any) -> None:
            raise RuntimeError("no page any more")

    page = Page(Broken())  # type: ignore[arg-type]
    for _ in range(2):
        page.show(None, None, True, None)  # type: ignore[arg-type]
    assert capfd.readouterr().err.count("the robot goes on: no page any more") == 1


def test_replay_serves_a_log_until_ctrl_c(log_path: Path) -> None:
    given = ("replay", log_path, "--speed", "0", "--robot", "irma4")
    serves_until_ctrl_c('"limits_N": [20.0, 400.0]', "/events", *given)


def test_wrong_use_is_said(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    for arguments, words in (
        ((tmp_path / "none.csv",), "cannot be read"),
        ((log_path, "--robot", "nobody"), "nobody"),
        ((log_path, "--port", "70000"), "--port"),
        ((log_path, "--speed", "-1"), "--speed"),
    ):
        cli("replay", *arguments).refused(words)
