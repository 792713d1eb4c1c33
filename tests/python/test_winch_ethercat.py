"""Winches over EtherCAT: the same drives behind software slaves, on a virtual network cable.

Skipped where pysoem is not installed (pip install 'cdprcal[ethercat]') or where this user may not
make a network namespace with raw sockets and a pair of interfaces in it.
"""

from __future__ import annotations

import json
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal.hardware import BackendError
from cdprcal.hardware.drives.ethercat_bus import EthercatFieldbus
from cdprcal.hardware.session import Session
from cdprcal.testing.simulated_devices.drive import SimulatedDrive
from cdprcal.testing.simulated_devices.ethercat_slave import EthercatSlave, process_frame
from scripts import executed
from winch_bus import ethercat_session

RUN = Path(__file__).with_name("ethercat_run.py")
_TRY = """
import socket, subprocess
subprocess.run(["ip", "link", "add", "ec0", "type", "veth", "peer", "name", "ec1"], check=True)
socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x88a4)).bind(("ec0", 0x88a4))
"""


@pytest.fixture(scope="module")
def network() -> list[str]:
    """What runs a command in a network of its own; skips, saying why, where that cannot be."""
    if find_spec("pysoem") is None:
        pytest.skip("pysoem is not installed: pip install 'cdprcal[ethercat]'")
    if shutil.which("unshare") is None or shutil.which("ip") is None:
        pytest.skip("no unshare or ip on this machine")
    alone = ["unshare", "--map-root-user", "--net"]
    tried = executed([*alone, sys.executable, "-c", _TRY])
    if tried.returncode:
        reason = " ".join(tried.stderr.split())[-200:]
        pytest.skip(f"no network namespace with raw sockets and veth on this machine: {reason}")
    return alone


def run(network: list[str], what: str) -> dict[str, Any]:
    ran = executed([*network, sys.executable, str(RUN), what], timeout=300)
    assert ran.returncode == 0, ran.stderr[-3000:]
    document: dict[str, Any] = json.loads(ran.stdout)
    return document


@pytest.mark.alone
def test_the_start_up_over_ethercat_is_that_of_the_simulator(network: list[str]) -> None:
    document = run(network, "start-up")
    assert document["state"] == "done", document["reason"]
    assert [drive["serial"] for drive in document["drives"]] == [1001, 1002, 1003, 1004]
    assert document["states"] == ["switch on disabled"] * 4
    assert document["rows"][0] == document["rows"][1]
    apart = document["apart"]
    # As over CANopen (test_winches.py): a few steps of each sensor.
    assert apart["length_m"] < 1e-5
    assert apart["swivel_rad"] < 2.01 * 2 * np.pi / 65536
    assert apart["tension_N"] < 0.0201
    assert apart["roll_pitch_yaw_rad"] < 6e-6


@pytest.mark.alone
def test_a_dry_run_stays_safe_operational(network: list[str]) -> None:
    document = run(network, "dry")
    assert document["states"] == ["switch on disabled"] * 4
    assert document["alive"]


@pytest.mark.alone
@pytest.mark.parametrize(
    ("what", "reason"),
    [
        ("drive", "node 3 (cable 3): left operation enabled, is fault, error 0x2310"),
        ("cable", "does not answer"),
    ],
)
def test_faults_stop_the_drives_within_two_cycles(
    network: list[str], what: str, reason: str
) -> None:
    document = run(network, what)
    assert document["state"] == "holding"
    assert reason in document["reason"]
    assert document["off_after_s"][0] <= 0.0201
    assert "operation enabled" not in document["states"]


@pytest.mark.alone
def test_an_emergency_message_stops_the_drives(network: list[str]) -> None:
    """It lies in a slave's mailbox, which is looked into once in as many cycles as there are."""
    document = run(network, "emergency")
    assert document["state"] == "holding"
    assert "node 2 (cable 2): EMCY 0x2310, error register 0x01" in document["reason"]
    assert document["off_after_s"][0] <= (4 + 2) * 0.01 + 1e-4


@pytest.mark.alone
def test_a_program_that_hangs_is_missed_by_the_slaves(network: list[str]) -> None:
    """Their process-data watchdog."""
    document = run(network, "hang")
    assert document["before"] == ["operation enabled"] * 4
    assert document["off_after_s"] < 0.0211


# --- the slave by itself, on any machine ---------------------------------------------------------


@pytest.fixture
def session() -> Session:
    return ethercat_session("nowhere0")


def frame_of(command: int, node: int, register: int, data: bytes) -> bytes:
    """A frame with one datagram."""
    head = bytes([command, 0]) + node.to_bytes(2, "little") + register.to_bytes(2, "little")
    datagram = head + len(data).to_bytes(2, "little") + b"\0\0" + data + b"\0\0"
    ethercat = (len(datagram) | 0x1000).to_bytes(2, "little") + datagram
    return b"\xff" * 6 + b"\1" * 6 + b"\x88\xa4" + ethercat


def answer_of(frame: bytes) -> tuple[bytes, int]:
    """(data, working counter)."""
    size = int.from_bytes(frame[22:24], "little")
    counter = int.from_bytes(frame[26 + size : 28 + size], "little")
    return frame[26 : 26 + size], counter


def test_registers_by_position_and_by_address(session: Session) -> None:
    slaves = [EthercatSlave(SimulatedDrive(w), last=False) for w in session.winches]
    # Broadcast read: all count.
    assert answer_of(process_frame(slaves, frame_of(7, 0, 0x0000, b"\0")))[1] == 4
    # By position: the third sees 0 when it starts at -2.
    named = process_frame(slaves, frame_of(2, 0xFFFE, 0x0010, b"\x03\x10"))
    assert answer_of(named)[1] == 1
    assert answer_of(process_frame(slaves, frame_of(4, 0x1003, 0x0010, b"\0\0"))) == (
        b"\x03\x10",
        1,
    )
    assert answer_of(process_frame(slaves, frame_of(4, 0x1004, 0x0010, b"\0\0")))[1] == 0


def test_the_eeprom_tells_the_identity(session: Session) -> None:
    slave = EthercatSlave(SimulatedDrive(session.winches[1]), last=True)
    request = (0x0100).to_bytes(2, "little") + (0x0E).to_bytes(4, "little")
    process_frame([slave], frame_of(2, 0, 0x0502, request))
    data, _ = answer_of(process_frame([slave], frame_of(1, 0, 0x0508, bytes(4))))
    assert int.from_bytes(data, "little") == 1002


@pytest.mark.skipif(find_spec("pysoem") is None, reason="pysoem is not installed")
def test_an_interface_that_is_not_there(session: Session) -> None:
    with pytest.raises(BackendError, match="EtherCAT nowhere0: cannot be opened"):
        EthercatFieldbus(session)


def test_without_its_extra_it_says_what_to_install(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pysoem", None)  # as if it could not be imported
    with pytest.raises(cdprcal.InputError, match=r"pip install 'cdprcal\[ethercat\]'"):
        EthercatFieldbus(session)
