"""The simulated robot in a process of its own: CAN over UDP on this machine, the AHRS on a pty."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import can
import numpy as np
import pytest

from cdprcal.io import load_log
from conftest import Cli
from winch_bus import EXAMPLE

TWO = EXAMPLE.with_name("canopen-two-processes.yaml")


@pytest.fixture(scope="module")
def group() -> str:
    """A multicast group that works here and is nobody else's, or a reason to skip."""
    group, port = "239.74.163.5", 20_000 + os.getpid() % 10_000
    try:
        with contextlib.ExitStack() as stack:
            ends = []
            for _ in range(2):
                bus = can.Bus(interface="udp_multicast", channel=group, port=port, hop_limit=0)
                stack.callback(bus.shutdown)
                ends.append(bus)
            ends[0].send(can.Message(arbitration_id=1, is_extended_id=False))
            arrived = ends[1].recv(1.0)
    except (OSError, can.CanError) as error:
        pytest.skip(f"no UDP multicast on this machine: {error}")
    if arrived is None:
        pytest.skip("UDP multicast does not arrive on this machine")
    return f"{group}:{port}"


@pytest.fixture
def session(group: str, tmp_path: Path) -> Path:
    path = tmp_path / "session.yaml"
    text = TWO.read_text().replace("239.74.163.4", group)
    path.write_text(text.replace("/tmp/cdprcal-mti", str(tmp_path / "mti")))
    return path


class RobotProcess:
    """A simulated robot that runs beside the test; what it says is kept."""

    def __init__(self, plan: Path, session: Path, said: Path) -> None:
        self._said = said
        with said.open("wb") as stderr:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "cdprcal.testing.simulated_devices", "irma4", plan,
                 "--session", session, "--seed", "3"],
                stderr=stderr,
            )  # fmt: skip
        self.wait_for("ready")

    def said(self) -> str:
        return self._said.read_text()

    def wait_for(self, words: str) -> None:
        deadline = time.monotonic() + 60.0
        while words not in self.said():
            assert time.monotonic() < deadline, self.said()
            assert self.process.poll() is None, self.said()
            time.sleep(0.02)


@pytest.fixture
def robot_process(plan_path: Path, session: Path, tmp_path: Path) -> Iterator[RobotProcess]:
    beside = RobotProcess(plan_path, session, tmp_path / "said.txt")
    yield beside
    beside.process.send_signal(signal.SIGINT)
    assert beside.process.wait(30) == 0, beside.said()


def test_two_processes_are_as_one(
    cli: Cli,
    robot_process: RobotProcess,
    plan_path: Path,
    session: Path,
    tmp_path: Path,
) -> None:
    apart, together = tmp_path / "apart.csv", tmp_path / "together.csv"
    acquire = ("acquire", "irma4", plan_path, "--backend", "canopen", "--quick", "--session")
    ran = cli(*acquire, session, "-o", apart)
    assert ran.code == 0, ran.stderr
    ran = cli(*acquire, EXAMPLE, "--seed", 3, "-o", together)
    assert ran.code == 0, ran.stderr
    there, here = load_log(apart).log, load_log(together).log
    np.testing.assert_allclose(there.time_s, here.time_s, atol=1e-9)
    for name in ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"):
        np.testing.assert_array_equal(getattr(there, name), getattr(here, name))
    assert robot_process.said().rstrip().endswith(", ".join(["switch on disabled"] * 4))


def test_drives_stop_when_the_program_is_killed(
    robot_process: RobotProcess, plan_path: Path, session: Path, tmp_path: Path
) -> None:
    """kill -9: no quick stop is sent, the heartbeat stays away."""
    log = tmp_path / "run.csv"
    acquire = subprocess.Popen(
        [sys.executable, "-m", "cdprcal", "acquire", "irma4", plan_path, "--backend", "canopen",
         "--session", session, "-o", log],
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    deadline = time.monotonic() + 60.0
    while not (log.exists() and log.stat().st_size > 30_000):
        assert time.monotonic() < deadline
        assert acquire.poll() is None
        time.sleep(0.01)
    assert robot_process.said().rstrip().endswith(", ".join(["operation enabled"] * 4))
    acquire.kill()
    acquire.wait()
    robot_process.wait_for(", ".join(["switch on disabled"] * 4))
    assert len(load_log(log).log) > 10
