"""The documentation: built strictly, its commands and code run, its made pages up to date."""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import cdprcal
from browser import Tab, browser_tab, chromium
from cdprcal.acquisition.remedies import remedy_for
from scripts import executed

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
#: Pages whose commands are run, in their order, each in an empty directory.
WALKED = (
    "first-calibration.md",
    "your-robot.md",
    "your-log.md",
    "results.md",
    "extend/formula.md",
)
#: Pages whose Python is run, block after block.
RUN = ("your-log.md", "extend/sensor.md", "api/index.md")

#: Sources with messages that only add a place to the message of another.
HAND_ON = {
    "__main__.py",
    "backend.py",
    "command.py",
    "devices.py",
    "drive.py",
    "ethercat_robot.py",
    "extras.py",
    "faults.py",
    "file.py",
    "injected_effect.cpp",
    "log.cpp",
    "model.cpp",
    "path.cpp",
    "plan_parser.cpp",
    "platform.py",
    "result_file.py",
    "robot.cpp",
    "robot_check.hpp",
    "robot_file.cpp",
    "schema.cpp",
    "server.py",
    "set_point.cpp",
    "strict_yaml.py",
    "timing.cpp",
    "track.py",
    "workspace.py",
    "yaml_reader.cpp",
}


def blocks(page: str, language: str) -> list[str]:
    """The fenced blocks of a page in one language."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.M | re.S)


def tool(name: str) -> ModuleType:
    """One of docs/tools."""
    spec = importlib.util.spec_from_file_location(name, DOCS / "tools" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def shell(tmp_path: Path) -> dict[str, str]:
    """An environment where ``cdprcal`` is this one."""
    program = tmp_path / "bin" / "cdprcal"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m cdprcal "$@"\n')
    program.chmod(0o755)
    return {**os.environ, "PATH": f"{program.parent}:{os.environ['PATH']}"}


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs", reason="no mkdocs: pip install '.[test]'")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(tmp_path / "site")]
    # MkDocs' theme advertises itself on stderr, which is no warning of the build's.
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "true", "DISABLE_MKDOCS_2_WARNING": "true"}
    done = executed(command, cwd=ROOT, env=environment)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "site" / "api" / "calibration.html").read_text(encoding="utf-8")
    for name in ("calibrate", "CalibrationResult", "OnlineCalibration"):
        assert f'id="cdprcal._core.{name}"' in page
    # It opens without a network: no page fetches anything from another host.
    pages = sorted((tmp_path / "site").rglob("*.html"))
    assert len(pages) > 30
    fetched = re.compile(
        r'<(?:script|img|iframe|source)[^>]*\ssrc="?https?:[^>]*>|<link[^>]*\shref="?https?:[^>]*>'
    )
    foreign = {p.name: fetched.findall(p.read_text(encoding="utf-8")) for p in pages}
    assert {name: found for name, found in foreign.items() if found} == {}
    if chromium() is not None:
        with browser_tab() as tab:
            _search_from_the_disk(tab, tmp_path / "site" / "index.html")


def _search_from_the_disk(tab: Tab, page: Path) -> None:
    tab.size(1200, 900)
    tab.open(page.as_uri())
    tab.click("[data-md-component=search-query]")
    tab.type("explore")
    tab.wait("document.querySelectorAll('.md-search-result__item').length > 0")
    assert "Explore a diagnosis" in tab.text(".md-search-result__list")
    assert tab.problems == []
    assert tab.foreign_requests() == []


def test_every_name_of_the_core_is_in_the_api() -> None:
    hook = tool("made_pages")
    pages = [path.read_text(encoding="utf-8") for path in (DOCS / "api").glob("*.md")]
    stages = [s for text in pages for wanted in hook._WANTED.findall(text) for s in wanted.split()]
    names = [name for stage in stages for name in hook.bound_names(stage)]
    from cdprcal import _core

    public = {name for name in dir(_core) if not name.startswith("_")}
    assert sorted(names) == sorted(public)


def walked(script: str, folder: Path, shell: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Runs commands in a folder; all of them must end well."""
    done = executed(["bash", "-eu", "-c", script], cwd=folder, env=shell, timeout=120)
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.parametrize("page", WALKED)
def test_the_commands_of_a_page_do_what_it_says(
    page: str, shell: dict[str, str], tmp_path: Path
) -> None:
    script = "\n".join(blocks(page, "sh"))
    assert "cdprcal" in script
    if page == "your-robot.md":  # the template's blanks are not filled in, and check says so
        script = script.replace("cdprcal check myrobot.yaml", "! cdprcal check myrobot.yaml")
    if page == "first-calibration.md":  # a pose with caveats, as the page says
        script = script.replace("-o result.json", "-o result.json || [ $? -eq 3 ]", 1)
    folder = tmp_path / "walk"
    folder.mkdir()
    if page == "extend/formula.md":  # "In `mine.yaml`"
        (folder / "mine.yaml").write_text("".join(blocks(page, "yaml")), encoding="utf-8")
    done = walked(script, folder, shell)
    if page == "extend/formula.md":
        assert "\ndescribed: length_by_length_sine" in done.stdout
        page_text = " ".join((DOCS / page).read_text(encoding="utf-8").split())
        (law,) = re.findall(r"^length_by_length_sine\S+: (.*)$", done.stdout, re.M)
        assert law in page_text
        wrong = (folder / "mine.yaml").read_text().replace(" sin(", " sinus(", 1)
        (folder / "mine.yaml").write_text(wrong)
        refused = walked("! cdprcal effects --effects mine.yaml", folder, shell).stderr
        assert refused.partition("give one of")[0].removeprefix("cdprcal: ") in page_text
        assert "\nexplained: eccentric_drum" in done.stdout
        assert "eccentric_drum" in (folder / "corrected.yaml").read_text()
    if page == "first-calibration.md":
        for made in ("cdprcal-demo/report.html", "corrected.yaml", "report.html"):
            assert (folder / made).stat().st_size > 0
        assert "load_cell_bias" in (folder / "corrected.yaml").read_text()
        sigmas = re.findall(r"x +[-\d.]+ m +([\d.]+) mm", done.stdout)
        assert len(sigmas) == 2
        assert float(sigmas[0]) > 3.0 * float(sigmas[1])  # "known far better"
    if page == "your-robot.md":
        assert "'FILL'" in done.stderr


@pytest.mark.parametrize("page", sorted(path.name for path in (DOCS / "robots").glob("*.md")))
def test_a_robot_of_the_gallery_runs(
    page: str, shell: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its files, then its Python, then its commands: with a caveat where the page says so."""
    monkeypatch.chdir(tmp_path)
    for text in blocks(f"robots/{page}", "yaml"):
        named = re.match(r"name: (\w+)", text)
        Path(f"{named[1]}.yaml" if named else "map.yaml").write_text(text, encoding="utf-8")
    names: dict[str, Any] = {}
    for code in blocks(f"robots/{page}", "python"):
        exec(compile(code, page, "exec"), names)
    commands = "".join(blocks(f"robots/{page}", "sh"))
    ends = 3 if "exit code 3" in (DOCS / "robots" / page).read_text(encoding="utf-8") else 0
    script = re.sub(r"^(cdprcal .*)$", r"\1 || { [ $? -eq 3 ] && ended=3; }", commands, flags=re.M)
    walked(f"ended=0\n{script}[ $ended -eq {ends} ]", tmp_path, shell)


@pytest.mark.parametrize("page", RUN)
def test_the_python_of_a_page_runs(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for code in blocks(page, "python"):
        exec(compile(code, page, "exec"), names)
    if page == "extend/sensor.md":
        # The laser helps where it looks, and the error stays within the new σ's.
        assert np.all(names["after"] <= names["before"] * (1 + 1e-9))
        assert names["after"][0] < 0.7 * names["before"][0]
        error = cdprcal.minus(names["truth"], names["updated"])
        assert np.all(np.abs(error[:3]) < 4.0 * names["after"])


def test_the_device_of_its_page_starts_up_a_robot(tmp_path: Path) -> None:
    names: dict[str, Any] = {}
    for code in blocks("extend/device.md", "python"):
        exec(compile(code, "device.md", "exec"), names)
    robot = cdprcal.load_robot("irma4")
    made = cdprcal.make_plan(robot, grid=[2, 1, 1])
    link = names["time"] = SimulatedLink(robot, made.plan)
    run = names["start_up"](robot, made.plan, names["MyRobot"](link), tmp_path / "run.csv")
    assert (run.state, run.reason) == (cdprcal.StartUpState.done, "")
    assert len(run.rests) == 3
    # A connection that is lost ends in a stop, with the reason.
    link = names["time"] = SimulatedLink(robot, made.plan, lost_after=300)
    run = names["start_up"](robot, made.plan, names["MyRobot"](link), tmp_path / "lost.csv")
    assert run.state == cdprcal.StartUpState.holding
    assert "cable torn out" in run.reason
    assert link.braked


class SimulatedLink:
    """A maker's library whose robot is simulated, and the clock that its time passes by."""

    def __init__(
        self, robot: cdprcal.Robot, plan: cdprcal.Plan, lost_after: int | None = None
    ) -> None:
        options = cdprcal.SimulatorOptions(seed=1)
        assert options.winch.mode == cdprcal.WinchMode.tension
        self._simulator = cdprcal.Simulator(robot, options)
        assert self._simulator.reset(plan.start_tension_N).found
        self._left = lost_after
        self.braked = False

    def monotonic(self) -> float:
        return self._simulator.time_s

    def sleep(self, duration_s: float) -> None:
        self._simulator.advance(duration_s)

    def read(self) -> tuple[Any, Any, Any, Any]:
        if self._left is not None:
            self._left -= 1
            if self._left < 0:
                raise OSError("cable torn out")
        sample = self._simulator.read()
        angles = sample.roll_pitch_yaw_rad
        return sample.length_m, sample.swivel_rad, sample.tension_N, angles

    def hold(self, tension_N: Any) -> None:
        self._simulator.command_tension(tension_N)

    def pay_out(self, velocity_m_s: Any) -> None:
        self._simulator.command_velocity(velocity_m_s)

    def brake(self) -> None:
        self.braked = True
        self._simulator.hold()


def test_the_page_of_errors_holds_what_commands_say(tmp_path: Path) -> None:
    errors = tool("errors")
    page = errors.fill((DOCS / "errors.md").read_text(encoding="utf-8"))
    for known in (
        "`slack`",  # from a call with positions, …
        "`no_workspace`",  # … from one with a helper
        "`unfinished`",  # … and from one with keywords
        "is no result file",  # Python
        "must be a number, not",  # C++, the robot file's reader
        "neither a file nor a built-in robot",  # C++, thrown
    ):
        assert known in page
    codes = {finding.code for finding in errors.findings()}
    assert len(codes) > 20
    assert all(finding.remedy for finding in errors.findings())


def test_every_message_of_wrong_use_says_what_to_do() -> None:
    """And is in the table: whatever refuses is found in the sources, or hands on a message."""
    errors = tool("errors")
    messages = errors.messages()
    said = [message for message in messages if not message.forwards]
    assert len(said) > 350
    silent = [f"{m.file}:{m.line}: {m.text}" for m in said if not m.parts[1]]
    assert silent == [], "end these with what to do: '…; give another name'"
    # A message without words of its own adds a place to another's.
    handed_on = {m.file.name for m in messages if m.forwards}
    assert handed_on <= HAND_ON
    page = errors.fill((DOCS / "errors.md").read_text(encoding="utf-8"))
    for message in said:
        wrong, what = message.parts
        assert f"| {errors.cell(wrong)} | {errors.cell(what)} |" in page
    # Nothing that refuses escapes: each such line of the sources is one of these.
    places = {(str(message.file), message.line) for message in messages}
    for pattern, folder, words in (
        ("*.py", "python/cdprcal", r"raise (?:_core\.)?(?:InputError|BackendError)\("),
        ("*.[ch]pp", "cpp/cdprcal", r"throw (?:detail::)?(?:InputError|FieldError)\("),
        ("*.[ch]pp", "bindings", r"throw InputError\("),
    ):
        for path in (ROOT / folder).rglob(pattern):
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                if re.search(words, line):
                    assert (str(path.relative_to(ROOT)), number) in places, f"{path}:{number}"


def test_every_reason_to_stop_the_robot_has_a_remedy() -> None:
    errors = tool("errors")
    reasons = errors.stops()
    assert len(reasons) >= 16
    page = errors.fill((DOCS / "errors.md").read_text(encoding="utf-8"))
    for reason in reasons:
        assert remedy_for(reason), reason
        assert f"| {errors.cell(reason)} | {remedy_for(reason)} |" in page
    assert "load cell" in remedy_for("node 2 (cable 2): the load cell reads 9 counts, not valid")
    assert "PDO mapping" in remedy_for("drive error: node 2 (cable 2): TPDO 1 has 6 bytes")
    assert remedy_for("something else") == ""


@pytest.mark.parametrize(
    ("text", "tells"),
    [
        ("…: is given twice; delete one", True),
        ("…: at: … is not one of a, b", True),
        ("mass_kg must be positive", True),
        ("…: cannot hang there: give another", True),
        ("…: the set-points are wrong", False),
        ("…: a log, a plan and a start were expected, not …", False),
        ("…: is damaged: …", False),
    ],
)
def test_what_counts_as_telling_what_to_do(text: str, tells: bool) -> None:
    message = tool("errors").Message(text, Path("python/cdprcal/any.py"), 1)
    assert bool(message.parts[1]) == tells


def test_the_catalogue_is_that_of_the_program(tmp_path: Path) -> None:
    catalogue = tool("catalogue")
    text = (DOCS / "catalogue.md").read_text(encoding="utf-8")
    plan = catalogue.signature_plan()
    for info in cdprcal.effect_catalogue():
        assert catalogue.entry(info) in text, "run: python docs/tools/catalogue.py -o docs"
        assert catalogue.row(info) in text
        picture = DOCS / "catalogue" / f"{info.name}.svg"
        assert picture.read_text(encoding="utf-8").startswith("<?xml")
        if info.name in ("load_cell_bias", "yaw_drift"):  # the others take too long for every day
            found = catalogue.signature(info, plan, tmp_path)
            assert f"names `{info.name}`" in found.sentence()
            assert found.sentence() in text
    assert catalogue.tables_of_faults() in text


def test_every_help_ends_with_an_example_that_can_be_typed() -> None:
    from typer.main import get_command

    from cdprcal.cli import app

    commands = get_command(app).commands  # type: ignore[attr-defined]
    for name, command in commands.items():
        assert command.epilog, name
        assert command.epilog.startswith("Example: cdprcal "), name
        for part in command.epilog.removeprefix("Example: ").split(" && "):
            words = shlex.split(part.partition(" > ")[0])
            if words[0] != "cdprcal":
                continue  # another program goes on from there
            used = commands[words[1]]
            known = {option for parameter in used.params for option in parameter.opts}
            assert {word for word in words[2:] if word.startswith("-")} <= known, part
        assert name in command.epilog


def test_every_command_is_in_the_table() -> None:
    from typer.main import get_command

    from cdprcal.cli import app

    table = (DOCS / "commands.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `cdprcal ([\w-]+)", table, re.M)
    assert sorted(listed) == sorted(get_command(app).commands)  # type: ignore[attr-defined]


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "tests/README.md"])
def test_links_of_pages_outside_the_site_lead_somewhere(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    links = [link for link in re.findall(r"\]\(([^)#]+)", text) if "://" not in link]
    assert links
    for link in links:
        assert (ROOT / page).parent.joinpath(link).exists(), link
