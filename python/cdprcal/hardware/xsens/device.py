"""An Xsens MTi: set up as the session says, then polled."""

from __future__ import annotations

import contextlib
import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cdprcal.hardware.backend import Attitude, BackendError
from cdprcal.hardware.session import Ahrs
from cdprcal.hardware.xsens import measurement as mt
from cdprcal.hardware.xsens.frames import Frame, FrameReader, encode

# Message identifiers; an answer has the next number.
REQUEST_DEVICE_ID = 0x00
GO_TO_MEASUREMENT = 0x10
GO_TO_CONFIG = 0x30
ERROR = 0x42
OUTPUT_CONFIGURATION = 0xC0

_ERRORS = {
    0x03: "the period is not valid",
    0x04: "the message is not valid",
    0x1E: "a timer overflowed",
    0x20: "the baud rate is not valid",
    0x21: "a parameter is not valid",
    0x28: "its measurement engine is overloaded",
}
_TRIES = 3
_READS = 20  # of _READ_S each, for an answer
_READ_S = 0.05
_CLOCK_DRIFT = 1e-4  # between the device's clock and ours
_BITS_A_BYTE = 10  # start and stop bit


class Port(Protocol):
    """A serial port, as pyserial's."""

    timeout: float | None

    @property
    def in_waiting(self) -> int: ...
    def read(self, size: int = 1) -> bytes: ...
    def write(self, data: bytes) -> int | None: ...
    def close(self) -> None: ...


def open_port(ahrs: Ahrs) -> Port:
    """The serial port of a session's AHRS. Raises BackendError."""
    import serial

    try:
        return serial.Serial(ahrs.port, ahrs.baudrate_bit_s, timeout=_READ_S, exclusive=True)
    except (OSError, ValueError) as error:
        raise _unreachable(error) from None


class XsensMti:
    """The AHRS on a port, measuring. Raises BackendError when it does not answer or obey."""

    def __init__(self, port: Port, ahrs: Ahrs) -> None:
        self._port = port
        self._ahrs = ahrs
        self._reader = FrameReader()
        # The mounting turns the platform's axes into the sensor's: R_platform_sensor.
        self._R_sensor_platform = mt.rotation_from_zyx_deg(tuple(ahrs.mounting_deg)).T
        self._device_id = ""
        self._offset_s = math.inf  # of our clock against the device's, when nothing queues
        self._time_s = math.nan  # of the device, made continuous
        self._fine = 0
        self._polled_s = math.nan
        self._counter: int | None = None
        self.lost_packets = 0  #: by their counter
        self._latest: Attitude | None = None
        try:
            self._set_up()
        except BaseException:
            self.close()
            raise

    @property
    def settings(self) -> dict[str, object]:
        return {"type": "xsens", "device_id": self._device_id, "lost_packets": self.lost_packets}

    def poll(self, now_s: float) -> Attitude | None:
        try:
            data = self._port.read(self._port.in_waiting) if self._port.in_waiting else b""
        except OSError as error:
            raise _unreachable(error) from None
        if data:
            for frame in self._reader.feed(data):
                self._take(frame, now_s)
        return self._latest

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._port.close()

    def _take(self, frame: Frame, now_s: float) -> None:
        if frame.mid == ERROR:
            raise _complaint(frame.data)
        if frame.mid != mt.MID:
            return
        measurement = mt.parse(frame.data)
        rotation = None if measurement is None else mt.rotation_enu_sensor(measurement)
        if measurement is None or rotation is None:
            return
        if measurement.packet_counter is not None:
            if self._counter is not None:
                self.lost_packets += (measurement.packet_counter - self._counter - 1) & 0xFFFF
            self._counter = measurement.packet_counter
        self._latest = Attitude(
            rotation @ self._R_sensor_platform,
            self._taken_s(measurement, now_s),
            self._in_platform(measurement.acceleration_m_s2),
            self._in_platform(measurement.rate_of_turn_rad_s),
        )

    def _in_platform(self, read: mt.Numbers | None) -> NDArray[np.float64] | None:
        return None if read is None else np.array(read) @ self._R_sensor_platform

    def _taken_s(self, measurement: mt.Measurement, now_s: float) -> float:
        """When it was measured, by our clock: packets that waited somewhere are older than now.

        The smallest difference of the clocks is that of a packet that did not wait.
        """
        if measurement.time_fine is None:
            return now_s
        if math.isnan(self._time_s):
            self._time_s = 0.0
        else:
            ticks = (measurement.time_fine - self._fine) & 0xFFFFFFFF
            self._time_s += ticks / mt.TIME_FINE_HZ
            self._offset_s += _CLOCK_DRIFT * max(0.0, now_s - self._polled_s)
        self._fine = measurement.time_fine
        self._polled_s = now_s
        self._offset_s = min(self._offset_s, now_s - self._time_s)
        return self._time_s + self._offset_s

    # --- set-up ----------------------------------------------------------------------------------

    def _set_up(self) -> None:
        configuration = self._configuration()
        self._check_rate()
        self._ask(GO_TO_CONFIG)
        self._device_id = self._ask(REQUEST_DEVICE_ID).hex().upper()
        answer = self._ask(OUTPUT_CONFIGURATION, configuration)
        self._check_answer(answer)
        self._ask(GO_TO_MEASUREMENT)
        self._port.timeout = 0.0

    def _configuration(self) -> bytes:
        precision = mt.PRECISION_BITS[self._ahrs.precision]
        kind = mt.QUATERNION if self._ahrs.output == "quaternion" else mt.EULER
        kind |= mt.FRAME_BITS[self._ahrs.frame] | precision
        inertial = (mt.ACCELERATION, mt.RATE_OF_TURN) if self._ahrs.inertial_unit else ()
        # Counter and time come with every packet whatever rate is asked for: 0xFFFF.
        wanted = (
            (mt.PACKET_COUNTER, 0xFFFF),
            (mt.SAMPLE_TIME_FINE, 0xFFFF),
            (kind, self._ahrs.rate_Hz),
            *((item | precision, self._ahrs.rate_Hz) for item in inertial),
        )
        return b"".join(item.to_bytes(2, "big") + rate.to_bytes(2, "big") for item, rate in wanted)

    def _check_rate(self) -> None:
        count = 4 if self._ahrs.output == "quaternion" else 3
        number = mt.NUMBER_BYTES[self._ahrs.precision]
        packet = 5 + (3 + 2) + (3 + 4) + (3 + count * number)
        if self._ahrs.inertial_unit:
            packet += 2 * (3 + 3 * number)
        needed = packet * self._ahrs.rate_Hz * _BITS_A_BYTE
        if needed > self._ahrs.baudrate_bit_s:
            raise BackendError(
                f"AHRS: {self._ahrs.rate_Hz} packets of {packet} bytes per second need {needed} "
                f"bit/s, and ahrs.baudrate_bit_s is {self._ahrs.baudrate_bit_s}: lower "
                "ahrs.rate_Hz, or raise the baud rate of the device first"
            )

    def _check_answer(self, answer: bytes) -> None:
        got = int.from_bytes(answer[-2:], "big") if len(answer) >= 4 else 0
        if got != self._ahrs.rate_Hz:
            raise BackendError(
                f"AHRS: gives {got} Hz where ahrs.rate_Hz asks for {self._ahrs.rate_Hz}: take a "
                "rate that divides 400"
            )

    def _ask(self, mid: int, data: bytes = b"") -> bytes:
        """The data of the answer. While it measures, packets come in between and are passed."""
        for _ in range(_TRIES):
            try:
                self._port.write(encode(mid, data))
                for _ in range(_READS):
                    said = self._port.read(max(1, self._port.in_waiting))
                    for frame in self._reader.feed(said):
                        if frame.mid == mid + 1:
                            return frame.data
                        if frame.mid == ERROR:
                            raise _complaint(frame.data)
            except OSError as error:
                raise _unreachable(error) from None
        raise BackendError(
            f"AHRS on {self._ahrs.port}: does not answer at {self._ahrs.baudrate_bit_s} bit/s; "
            "look at its power, the port and ahrs.baudrate_bit_s"
        )


def _unreachable(error: Exception) -> BackendError:
    return BackendError(f"AHRS: {' '.join(str(error).split())}; check ahrs.port and its cable")


def _complaint(data: bytes) -> BackendError:
    """What an error of the device means."""
    code = data[0] if data else 0
    said = _ERRORS.get(code, f"error 0x{code:02X}")
    return BackendError(f"AHRS: {said}; switch it off and on, or see its manual")
