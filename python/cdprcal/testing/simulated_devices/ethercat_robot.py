"""A whole simulated robot on an EtherCAT segment: a raw socket at the other end of a cable.

It runs in a process of its own: pysoem holds Python's lock while it waits for slaves. Its clock is
the master's, told by frames of an EtherType for local experiments; each is answered by what the
drives are, and by the largest true tension.
"""

from __future__ import annotations

import json
import socket
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal.hardware.session import Session
from cdprcal.testing.simulated_devices.ethercat_slave import (
    ETHERTYPE,
    EthercatSlave,
    process_frame,
)
from cdprcal.testing.simulated_devices.platform import AttitudeSink, SimulatedPlatform

_ALL, _CONTROL = 0x0003, 0x88B5
_HEADER, _TYPE_AT, _SOURCE_AT = 14, 12, 6
_PROCESSED = 0x02  # in the first byte of the source address
_CYCLIC = range(10, 13)  # datagrams with logical addresses: process data
_BROADCAST = b"\xff" * 6


class SimulatedRobotOnEthercat:
    """Simulated drives behind a network interface. Needs the right to open raw sockets.

    tension_N [n]: true tensions at power-on.
    """

    def __init__(
        self,
        session: Session,
        robot: _core.Robot,
        tension_N: NDArray[np.float64],
        options: _core.SimulatorOptions,
        interface: str,
        ahrs: AttitudeSink | None = None,
    ) -> None:
        self._platform = SimulatedPlatform(session, robot, tension_N, options, ahrs)
        drives = sorted(self._platform.drives, key=lambda drive: drive.winch.node)
        self._slaves = [
            EthercatSlave(drive, last=at == len(drives) - 1) for at, drive in enumerate(drives)
        ]
        self._cut = False
        self._now_s = 0.0
        self._cycle_due = False
        self._socket = raw_socket(interface, _ALL)

    def serve(self, timeout_s: float) -> None:
        """Answers the next frame, if one comes in time."""
        self._socket.settimeout(timeout_s)
        try:
            frame = self._socket.recv(2048)
        except TimeoutError:
            return
        kind = int.from_bytes(frame[_TYPE_AT:_HEADER], "big")
        if frame[_SOURCE_AT] & _PROCESSED:
            return  # what went out from here
        if kind == _CONTROL:
            self._obey(json.loads(frame[_HEADER:].rstrip(b"\0")))
        elif kind == ETHERTYPE and not self._cut:
            self._socket.send(self._process(frame))

    def close(self) -> None:
        """Leaves the segment."""
        self._socket.close()

    def _process(self, frame: bytes) -> bytes:
        cycle = self._cycle_due and frame[_HEADER + 2] in _CYCLIC
        if cycle:
            self._cycle_due = False
            self._platform.cycle(self._now_s)
        for slave in self._slaves:
            slave.refresh_inputs()
        answer = process_frame(self._slaves, frame)
        if cycle:
            commanded = any(slave.listens for slave in self._slaves)
            self._platform.cycle_ended(commanded=commanded)
        return answer

    def _obey(self, told: dict[str, Any]) -> None:
        self._now_s = float(told["now_s"])
        self._cycle_due = self._cycle_due or bool(told.get("cycle"))
        if "fail" in told:
            self._slaves[int(told["fail"])].drive.fail(0x2310)
        if "emergency" in told:
            self._slaves[int(told["emergency"])].emergency(0x2310)
        self._cut = self._cut or bool(told.get("cut"))
        self._platform.advance(self._now_s)
        for slave in self._slaves:
            slave.advance(self._now_s)
        states = [slave.drive.state.value for slave in self._slaves]
        tension_N = round(float(self._platform.truth().tension_N.max()), 3)
        answer = {"states": states, "tension_N": tension_N}
        self._socket.send(control_frame(answer, processed=True))


def raw_socket(interface: str, kind: int = _CONTROL) -> socket.socket:
    """A raw socket on an interface. Raises OSError."""
    raw = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(kind))
    raw.bind((interface, kind))
    return raw


def control_frame(told: dict[str, Any], *, processed: bool = False) -> bytes:
    """A frame that tells now_s, and maybe cycle, fail or emergency (of a slave), or cut."""
    source = bytes((_PROCESSED if processed else 0x04, 0, 0, 0, 0, 1))
    body = json.dumps(told).encode()
    return (_BROADCAST + source + _CONTROL.to_bytes(2, "big") + body).ljust(60, b"\0")
