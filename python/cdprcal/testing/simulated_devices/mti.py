"""A simulated Xsens MTi: what comes out of its plug, on a port of this process or any stream."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cdprcal.hardware.session import Ahrs
from cdprcal.hardware.xsens import measurement as mt
from cdprcal.hardware.xsens.device import (
    ERROR,
    GO_TO_CONFIG,
    GO_TO_MEASUREMENT,
    OUTPUT_CONFIGURATION,
    REQUEST_DEVICE_ID,
)
from cdprcal.hardware.xsens.frames import FrameReader, encode

_DEVICE_ID = bytes.fromhex("07812345")
_INTERNAL_HZ = 400
_EVERY_PACKET = 0xFFFF
_OUTPUTS = (mt.QUATERNION, mt.EULER, mt.ACCELERATION, mt.RATE_OF_TURN)
_G_M_S2 = 9.81


class SimulatedMti:
    """The device. At power-on it measures, as set up the last time: Euler angles, float32, ENU.

    send: takes the bytes it sends. ahrs: only how it is mounted.
    """

    def __init__(self, ahrs: Ahrs, send: Callable[[bytes], None]) -> None:
        self._send = send
        self._R_platform_sensor = mt.rotation_from_zyx_deg(tuple(ahrs.mounting_deg))
        self._reader = FrameReader()
        self._measuring = True
        self._configuration = [(mt.PACKET_COUNTER, _EVERY_PACKET), (mt.EULER, 100)]
        self._counter = 0
        self._due_s = 0.0
        self._inertial: dict[int, NDArray[np.float64]] = {}  # [3] in platform axes

    def receive(self, data: bytes) -> None:
        """Bytes that were sent to it."""
        for frame in self._reader.feed(data):
            if frame.mid == GO_TO_CONFIG:
                self._measuring = False
                self._answer(frame.mid)
            elif self._measuring:
                self._send(encode(ERROR, b"\x04"))  # only in config state
            elif frame.mid == GO_TO_MEASUREMENT:
                self._measuring = True
                self._answer(frame.mid)
            elif frame.mid == REQUEST_DEVICE_ID:
                self._answer(frame.mid, _DEVICE_ID)
            elif frame.mid == OUTPUT_CONFIGURATION:
                self._configure(frame.data)
            else:
                self._send(encode(ERROR, b"\x04"))

    def show(
        self,
        R_world_platform: NDArray[np.float64],
        time_s: float,
        specific_force_m_s2: NDArray[np.float64] | None = None,
        angular_velocity_rad_s: NDArray[np.float64] | None = None,
    ) -> None:
        """The attitude from now on; sends it if a packet is due.

        What an inertial unit reads, [3] in platform axes: left out, it rests as it hangs.
        """
        rates = [rate for _, rate in self._configuration if rate != _EVERY_PACKET]
        if not self._measuring or not rates or time_s < self._due_s - 1e-6:
            return
        period_s = 1.0 / max(rates)
        late = time_s - self._due_s > period_s
        self._due_s = time_s + period_s if late else self._due_s + period_s
        self._counter = (self._counter + 1) & 0xFFFF
        rotation = R_world_platform @ self._R_platform_sensor
        force = specific_force_m_s2
        rate = angular_velocity_rad_s
        self._inertial = {
            mt.ACCELERATION: _G_M_S2 * R_world_platform[2] if force is None else force,
            mt.RATE_OF_TURN: np.zeros(3) if rate is None else rate,
        }
        items = b"".join(self._item(item, rotation, time_s) for item, _ in self._configuration)
        self._send(encode(mt.MID, items))

    def _item(self, item: int, rotation: NDArray[np.float64], time_s: float) -> bytes:
        if item == mt.PACKET_COUNTER:
            return mt.encode_item(item, self._counter.to_bytes(2, "big"))
        if item == mt.SAMPLE_TIME_FINE:
            ticks = round(time_s * mt.TIME_FINE_HZ) & 0xFFFFFFFF
            return mt.encode_item(item, ticks.to_bytes(4, "big"))
        precision = next(p for p, bits in mt.PRECISION_BITS.items() if bits == item & 3)
        if item & ~15 in self._inertial:
            read = self._inertial[item & ~15] @ self._R_platform_sensor
            return mt.encode_item(item, mt.encode_reals(precision, tuple(read.tolist())))
        frame = next(f for f, bits in mt.FRAME_BITS.items() if bits == item & 12)
        local = mt.rotation_local_enu(frame) @ rotation
        if item & ~15 == mt.QUATERNION:
            numbers = mt.quaternion_from_rotation(local)
        else:
            numbers = mt.zyx_deg_from_rotation(local)
        return mt.encode_item(item, mt.encode_reals(precision, numbers))

    def _configure(self, data: bytes) -> None:
        wanted = []
        for at in range(0, len(data) - 3, 4):
            item = int.from_bytes(data[at : at + 2], "big")
            rate = int.from_bytes(data[at + 2 : at + 4], "big")
            known = item in (mt.PACKET_COUNTER, mt.SAMPLE_TIME_FINE)
            if not known and item & ~15 not in _OUTPUTS:
                self._send(encode(ERROR, b"\x21"))
                return
            if rate != _EVERY_PACKET:  # the nearest it can
                rate = _INTERNAL_HZ // max(1, round(_INTERNAL_HZ / max(1, rate)))
            wanted.append((item, _EVERY_PACKET if known else rate))
        self._configuration = wanted
        answer = b"".join(i.to_bytes(2, "big") + rate.to_bytes(2, "big") for i, rate in wanted)
        self._answer(OUTPUT_CONFIGURATION, answer)

    def _answer(self, mid: int, data: bytes = b"") -> None:
        self._send(encode(mid + 1, data))


class SimulatedPort:
    """The plug of a simulated MTi in this process, as a serial port."""

    def __init__(self, ahrs: Ahrs) -> None:
        self.timeout: float | None = None
        self._sent = bytearray()
        self.device = SimulatedMti(ahrs, self._sent.extend)

    @property
    def in_waiting(self) -> int:
        return len(self._sent)

    def read(self, size: int = 1) -> bytes:
        data = bytes(self._sent[:size])
        del self._sent[:size]
        return data

    def write(self, data: bytes) -> int:
        self.device.receive(data)
        return len(data)

    def close(self) -> None:
        """Nothing to give back."""
