"""What the Python tests share: a robot, generated logs, the measured data when it is there."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from copy import copy
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from browser import Tab, browser_tab, chromium
from cdprcal.cli import app
from cdprcal.sensors import LOG_GROUPS
from robots import small_plan
from scripts import executed

# An environment from before they were dependencies: test_session.py says so, the others go on.
collect_ignore_glob = [] if find_spec("canopen") else ["test_winch*.py", "test_rosbag*.py"]

# Some tests run a study in short.
sys.path.append(str(Path(__file__).resolve().parents[1] / "studies"))

# What commands print must not depend on who runs the tests.
os.environ["LC_ALL"] = "C.UTF-8"
os.environ.pop("COLUMNS", None)

#: Tensions of Table II [N]: eight equilibria of irma4 around its workspace.
TABLE_II_TENSIONS_N = [
    [118.476264, 170.828165, 115.569155, 82.981581],
    [82.981579, 115.569157, 170.828164, 118.476265],
    [115.489778, 82.967942, 118.540763, 170.725470],
    [170.725469, 118.540765, 82.967940, 115.489780],
    [81.175193, 55.900918, 31.006417, 53.855798],
    [53.855797, 31.006417, 55.900918, 81.175194],
    [31.018552, 53.872214, 81.210513, 55.871600],
    [55.871600, 81.210513, 53.872213, 31.018553],
]


@dataclass(frozen=True)
class Ran:
    """What a command left behind."""

    code: int
    stdout: str
    stderr: str

    def document(self, code: int = 0) -> Any:
        """What it said with --json; holds that it ended with this exit code."""
        assert self.code == code, self
        return strict(self.stdout)

    def refused(self, *words: str) -> None:
        """Holds that it was wrong use, and that stderr has these words."""
        assert self.code == 2, self
        assert all(word in self.stderr for word in words), self


#: The fixture ``cli``: runs a command of the command line.
Cli = Callable[..., Ran]


@pytest.fixture(scope="session", autouse=True)
def frames_that_copy_quickly() -> Iterator[None]:
    """A virtual bus gives each listener a deep copy of each frame, which is a quarter of a run.

    Of its fields only the data can be changed in place; ``deepcopy`` finds that out every time.
    """
    if not find_spec("can"):
        yield
        return
    import can

    def with_data_of_its_own(frame: can.Message, _memo: object) -> can.Message:
        twin = copy(frame)
        twin.data = bytearray(frame.data)
        return twin

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(can.Message, "__deepcopy__", with_data_of_its_own)
        yield


@pytest.fixture(scope="session")
def robot() -> cdprcal.Robot:
    return cdprcal.load_robot("irma4")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of measured and practice data; skips when it is not there."""
    root = Path(__file__).resolve().parents[2]
    path = Path(os.environ.get("CDPRCAL_SHARED_DATA", root.parent / "shared" / "data"))
    if not (path / "irma4").is_dir():
        pytest.skip(f"no shared data at {path}; set CDPRCAL_SHARED_DATA")
    return path


@pytest.fixture(scope="session")
def synthetic(robot: cdprcal.Robot) -> cdprcal.SyntheticLog:
    """A run through Table II with a fifth of the robot's sigma as noise."""
    options = cdprcal.SyntheticLogOptions(
        dwell_s=4.0, move_s=4.0, noise=cdprcal.reading_noise(robot.sigma, 0.05), seed=7
    )
    return cdprcal.synthetic_log(robot, [np.array(t) for t in TABLE_II_TENSIONS_N], options)


@pytest.fixture(scope="session")
def log(synthetic: cdprcal.SyntheticLog) -> cdprcal.Log:
    """What was read on the synthetic run."""
    return synthetic.log


@pytest.fixture
def log_path(synthetic: cdprcal.SyntheticLog, tmp_path: Path) -> Path:
    """The synthetic run as a canonical CSV log."""
    path = tmp_path / "run.csv"
    cdprcal.write_log(synthetic.log, str(path))
    return path


@pytest.fixture(scope="session")
def plan(robot: cdprcal.Robot) -> cdprcal.Plan:
    return small_plan(robot)


@pytest.fixture
def plan_path(plan: cdprcal.Plan, tmp_path: Path) -> Path:
    path = tmp_path / "plan.csv"
    path.write_text(cdprcal.format_plan(plan))
    return path


@pytest.fixture
def cli(capfd: pytest.CaptureFixture[str]) -> Cli:
    """Runs a command in this process: cli("check", "irma4", path) → Ran."""

    def run(*arguments: object) -> Ran:
        capfd.readouterr()
        with pytest.raises(SystemExit) as stop:
            app([str(argument) for argument in arguments], prog_name="cdprcal")
        code = stop.value.code
        out, err = capfd.readouterr()
        return Ran(code if isinstance(code, int) else 0, out, err)

    return run


def strict(text: str) -> Any:
    """JSON without NaN or infinities, and nothing else around it."""

    def refuse(constant: str) -> Any:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(text, parse_constant=refuse)


def few(cases: Iterable[Any], kept: int = 1) -> list[Any]:
    """Cases of a test of which the first show enough every time, and the others are thorough."""
    out = []
    for i, case in enumerate(cases):
        values = case if isinstance(case, tuple) else (case,)
        marks = () if i < kept else (pytest.mark.thorough,)
        out.append(pytest.param(*values, marks=marks))
    return out


def changed(log: cdprcal.Log, **arrays: object) -> cdprcal.Log:
    """A copy of a log with some arrays replaced (None: absent)."""
    kept = {name: getattr(log, name) for name in ("time_s", *LOG_GROUPS)}
    return cdprcal.Log(**(kept | arrays), source="changed")


def samples_of(log: cdprcal.Log) -> Iterator[cdprcal.RobotSample]:
    """As they come from a robot, with all that the log reads of drives, AHRS and inertial unit."""
    read = {
        name: values
        for name in (
            "length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad", "specific_force_m_s2",
            "angular_velocity_rad_s",
        )
        if (values := getattr(log, name)).size
    }  # fmt: skip
    for row, time_s in enumerate(log.time_s.tolist()):
        yield cdprcal.RobotSample(time_s=time_s, **{name: of[row] for name, of in read.items()})


def raw_text(log: cdprcal.Log) -> str:
    """A log as the robot would write it: one line a cable, one for the attitude in degrees."""
    lines = []
    for i, time in enumerate(log.time_s.tolist()):
        for c in range(log.cable_count):
            length, swivel = float(log.length_m[i, c]), float(log.swivel_rad[i, c])
            tension, target = float(log.tension_N[i, c]), float(log.tension_setpoint_N[i, c])
            lines.append(
                f"3,{time!r},{c},9,-93392,7,0,{length!r},-1.9e-07,{tension!r},{target!r},15218,1,"
                f"{swivel!r}"
            )
        roll, pitch, yaw = np.rad2deg(log.roll_pitch_yaw_rad[i]).tolist()
        lines.append(f"5,{time!r},{roll!r},{pitch!r},{yaw!r}")
        lines.append(f"6,{time!r},0,0,0,0,0,0,0,0,0,0")
    return "\n".join(lines) + "\n"


@pytest.fixture
def tab() -> Iterator[Tab]:
    """A tab of headless Chromium to drive; skips where there is none."""
    if chromium() is None:
        pytest.skip("no Chromium on PATH: apt-get install chromium")
    with browser_tab() as opened:
        yield opened


@dataclass(frozen=True)
class Browsed:
    """A page as a browser left it: its elements after all scripts, and what its console said."""

    dom: str
    console: list[str]


@pytest.fixture(scope="session")
def browse() -> Callable[..., Browsed]:
    """Opens a page in headless Chromium with the network off; skips where there is none."""
    browser = chromium()
    if browser is None:
        pytest.skip("no Chromium on PATH: apt-get install chromium")

    def run(address: str, *flags: str) -> Browsed:
        with tempfile.TemporaryDirectory() as profile:
            done = executed(
                [
                    browser,
                    "--headless=new",
                    "--no-sandbox",
                    "--disable-dev-shm-usage",
                    "--use-angle=swiftshader",
                    "--enable-unsafe-swiftshader",
                    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
                    "--enable-logging=stderr",
                    f"--user-data-dir={profile}",
                    "--window-size=1200,1600",
                    *flags,
                    "--dump-dom",
                    address,
                ],
                timeout=120,
            )
        lines = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
        return Browsed(done.stdout, lines)

    return run
