"""MTData2 (MID 0x36): items {u16 id, u8 size, data}, big-endian.

The low four bits of an id say how its numbers are written (0: float32, 1: fixed point 12.20, 2:
fixed point 16.32, 3: float64) and in which frame they are (0: ENU, 4: NED, 8: NWU).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

MID = 0x36

PACKET_COUNTER = 0x1020
SAMPLE_TIME_FINE = 0x1060
QUATERNION = 0x2010
EULER = 0x2030
ACCELERATION = 0x4020
RATE_OF_TURN = 0x8020
STATUS_WORD = 0xE020

LocalFrame = Literal["ENU", "NED", "NWU"]
Precision = Literal["float32", "fp12.20", "fp16.32", "float64"]

PRECISION_BITS: dict[Precision, int] = {"float32": 0, "fp12.20": 1, "fp16.32": 2, "float64": 3}
FRAME_BITS: dict[LocalFrame, int] = {"ENU": 0, "NED": 4, "NWU": 8}
NUMBER_BYTES: dict[Precision, int] = {"float32": 4, "fp12.20": 4, "fp16.32": 6, "float64": 8}

#: SampleTimeFine counts these per second, and wraps after 2³² of them.
TIME_FINE_HZ = 10_000

_UNIT_TOLERANCE = 1e-2  # of a quaternion's norm; fixed point is coarse, garbage is far off

Numbers = tuple[float, ...]


@dataclass(slots=True)
class Measurement:
    """What one packet said; None: it did not say.

    quaternion (w, x, y, z): of R_local_sensor. euler_deg: roll, pitch, yaw, R_local_sensor =
    Rz(yaw) Ry(pitch) Rx(roll). frame: the local one, of the orientation. Acceleration (what holds
    the sensor against gravity included) and rate of turn in the sensor's own axes.
    """

    packet_counter: int | None = None
    time_fine: int | None = None
    quaternion: Numbers | None = None
    euler_deg: Numbers | None = None
    frame: LocalFrame = "ENU"
    acceleration_m_s2: Numbers | None = None
    rate_of_turn_rad_s: Numbers | None = None
    status: int | None = None


def _reals(precision: Precision, count: int) -> tuple[int, Callable[[bytes, int], Numbers]]:
    """(bytes, reader at an offset) of so many numbers."""
    size = count * NUMBER_BYTES[precision]
    if precision in ("float32", "float64"):
        layout = struct.Struct(f">{count}{'f' if precision == 'float32' else 'd'}")
        return size, layout.unpack_from
    if precision == "fp12.20":
        fixed = struct.Struct(f">{count}i")
        return size, lambda data, at: tuple(v / 2**20 for v in fixed.unpack_from(data, at))
    # 16.32: the fraction first, then the whole part.
    parts = struct.Struct(">" + "Ih" * count)

    def read(data: bytes, at: int) -> Numbers:
        values = parts.unpack_from(data, at)
        return tuple(
            whole + fraction / 2**32
            for fraction, whole in zip(values[::2], values[1::2], strict=True)
        )

    return size, read


#: id → (kind, bytes, reader, frame) of every orientation there is.
_ORIENTATION = {
    kind | frame_bits | precision_bits: (kind, *_reals(precision, count), frame)
    for kind, count in ((QUATERNION, 4), (EULER, 3))
    for frame, frame_bits in FRAME_BITS.items()
    for precision, precision_bits in PRECISION_BITS.items()
}
#: id → (field, bytes, reader) of what the inertial unit inside reads.
_INERTIAL = {
    kind | precision_bits: (field, *_reals(precision, 3))
    for kind, field in (
        (ACCELERATION, "acceleration_m_s2"),
        (RATE_OF_TURN, "rate_of_turn_rad_s"),
    )
    for precision, precision_bits in PRECISION_BITS.items()
}


def parse(data: bytes) -> Measurement | None:
    """The data of an MTData2 message; None when it is not one as the protocol says.

    Items of other kinds are passed over. A quaternion that is far from a unit one and angles that
    are not finite count as absent.
    """
    measurement = Measurement()
    at, end = 0, len(data)
    while at + 3 <= end:
        item = data[at] << 8 | data[at + 1]
        size = data[at + 2]
        at += 3
        if at + size > end:
            return None
        orientation = _ORIENTATION.get(item)
        if orientation is not None:
            kind, wanted, read, frame = orientation
            if size != wanted:
                return None
            values = read(data, at)
            if kind == QUATERNION:
                w, x, y, z = values
                # NaN fails the comparison, overflow gives inf.
                if abs(w * w + x * x + y * y + z * z - 1.0) < 2.0 * _UNIT_TOLERANCE:
                    measurement.quaternion = values
                    measurement.frame = frame
            elif math.isfinite(values[0] + values[1] + values[2]):
                measurement.euler_deg = values
                measurement.frame = frame
        elif item & ~12 in _INERTIAL:
            field, wanted, read = _INERTIAL[item & ~12]
            if size != wanted:
                return None
            values = read(data, at)
            if math.isfinite(values[0] + values[1] + values[2]):
                setattr(measurement, field, values)
        elif item == PACKET_COUNTER and size == 2:
            measurement.packet_counter = data[at] << 8 | data[at + 1]
        elif item == SAMPLE_TIME_FINE and size == 4:
            measurement.time_fine = int.from_bytes(data[at : at + 4], "big")
        elif item == STATUS_WORD and size == 4:
            measurement.status = int.from_bytes(data[at : at + 4], "big")
        at += size
    return measurement if at == end else None


def encode_reals(precision: Precision, values: Numbers) -> bytes:
    """Numbers as a device writes them."""
    if precision == "float32":
        return struct.pack(f">{len(values)}f", *values)
    if precision == "float64":
        return struct.pack(f">{len(values)}d", *values)
    if precision == "fp12.20":
        return struct.pack(f">{len(values)}i", *(round(value * 2**20) for value in values))
    data = b""
    for value in values:
        whole, fraction = divmod(round(value * 2**32), 2**32)
        data += struct.pack(">Ih", fraction, whole)
    return data


def encode_item(item: int, data: bytes) -> bytes:
    """One item of the data of an MTData2 message."""
    return item.to_bytes(2, "big") + bytes((len(data),)) + data


#: Turns each local frame into one with z up: x, y, z of ENU by those of the frame.
_R_ENU_LOCAL: dict[LocalFrame, NDArray[np.float64]] = {
    "ENU": np.eye(3),
    "NED": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    "NWU": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}


def rotation_enu_sensor(measurement: Measurement) -> NDArray[np.float64] | None:
    """R_ENU_sensor [3, 3], from the quaternion or else the Euler angles; None without both."""
    if measurement.quaternion is not None:
        local = rotation_from_quaternion(measurement.quaternion)
    elif measurement.euler_deg is not None:
        local = rotation_from_zyx_deg(measurement.euler_deg)
    else:
        return None
    return _R_ENU_LOCAL[measurement.frame] @ local


def rotation_local_enu(frame: LocalFrame) -> NDArray[np.float64]:
    """R_local_ENU [3, 3]."""
    return _R_ENU_LOCAL[frame].T


def rotation_from_quaternion(quaternion: Numbers) -> NDArray[np.float64]:
    """R of (w, x, y, z), normalised first."""
    w, x, y, z = np.array(quaternion) / math.sqrt(sum(value * value for value in quaternion))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_from_zyx_deg(roll_pitch_yaw_deg: Numbers) -> NDArray[np.float64]:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = (
        np.cos(np.deg2rad(roll_pitch_yaw_deg)),
        np.sin(np.deg2rad(roll_pitch_yaw_deg)),
    )
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def quaternion_from_rotation(rotation: NDArray[np.float64]) -> Numbers:
    """(w, x, y, z), w ≥ 0 or so: the largest of the four decides, so that none is lost."""
    r = rotation
    squares = np.array(
        [
            1 + r[0, 0] + r[1, 1] + r[2, 2],
            1 + r[0, 0] - r[1, 1] - r[2, 2],
            1 - r[0, 0] + r[1, 1] - r[2, 2],
            1 - r[0, 0] - r[1, 1] + r[2, 2],
        ]
    )
    rows = np.array(
        [
            [squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], squares[1], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], squares[2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[3]],
        ]
    )
    row = rows[int(np.argmax(squares))]
    unit = row / np.linalg.norm(row)
    return tuple((unit if unit[0] >= 0 else -unit).tolist())


def zyx_deg_from_rotation(rotation: NDArray[np.float64]) -> Numbers:
    """Roll, pitch, yaw [deg] of Rz(yaw) Ry(pitch) Rx(roll)."""
    r = rotation
    pitch = math.asin(min(1.0, max(-1.0, -float(r[2, 0]))))
    roll = math.atan2(r[2, 1], r[2, 2])
    yaw = math.atan2(r[1, 0], r[0, 0])
    return math.degrees(roll), math.degrees(pitch), math.degrees(yaw)
