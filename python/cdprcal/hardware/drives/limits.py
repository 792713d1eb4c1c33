"""Limits that drives keep by themselves: set as the session has them, never wider, read back."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cdprcal.hardware.backend import BackendError
from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.canopen_bus import NoSuchObjectError, RefusedError
from cdprcal.hardware.drives.fieldbus import Fieldbus
from cdprcal.hardware.drives.process_data import Key
from cdprcal.hardware.drives.supervision import OVERLOAD, OVERSPEED, name_of
from cdprcal.hardware.drives.winch import WinchState, torque_counts
from cdprcal.hardware.session import Session

_RATED_SHARE = 0.01  # data sheets and drives round the rated torque differently


def rated_torque_is_wrong(bus: Fieldbus, winch: WinchState) -> str:
    """What is wrong with the session's rated torque by the drive's own (0x6076); else empty."""
    torque = winch.winch.torque
    if torque is None or (own_mNm := _read(bus, winch, cia402.RATED_TORQUE)) is None:
        return ""
    if abs(1e-3 * own_mNm - torque.rated_torque_Nm) <= _RATED_SHARE * torque.rated_torque_Nm:
        return ""
    return (
        f"{name_of(winch)}: its rated torque (0x6076) is {1e-3 * own_mNm:g} Nm, the session says "
        f"{torque.rated_torque_Nm:g}; correct rated_torque_Nm"
    )


def set_limits(
    bus: Fieldbus, winch: WinchState, session: Session, notes: list[str]
) -> dict[str, float]:
    """Torque (0x6072) and speed (0x6080) that a drive will not exceed; those that hold now.

    Keys ``tension_N`` and ``velocity_m_s``, where a torque section says how to convert them.
    Raises BackendError when a drive does not keep what it is told.
    """
    torque = winch.winch.torque
    if torque is None:
        return {}
    per_N = abs(torque_counts(torque, winch.winch.sign, 1.0))
    per_m_s = 60.0 * torque.gear_ratio / (2.0 * math.pi * torque.drum_radius_m)
    limits = session.limits
    wanted = (
        ("tension_N", cia402.MAX_TORQUE, 2, per_N, (1.0 + OVERLOAD) * limits.tension_N[1]),
        ("velocity_m_s", cia402.MAX_MOTOR_SPEED, 4, per_m_s, OVERSPEED * limits.velocity_m_s),
    )
    effective = {}
    for name, key, size, scale, most in wanted:
        own = _read(bus, winch, key)
        if own is None:
            notes.append(
                f"{name_of(winch)}: has no object 0x{key[0]:04X}; limit {name} by its own set-up"
            )
            continue
        counts = min(own, math.ceil(scale * most))
        if counts < own and not _kept(bus, winch, key, counts, size):
            raise BackendError(
                f"{name_of(winch)}: does not keep the limit that 0x{key[0]:04X} is told; look it "
                "up in its manual"
            )
        effective[name] = counts / scale
    return effective


def set_position_limits(
    bus: Fieldbus, winch: WinchState, beyond_m: float, notes: list[str]
) -> tuple[float, tuple[int, int]] | None:
    """Software position limits (0x607D), so far either way from where the drive is now.

    What it has kept before stays where it is narrower. Gives how far cable may go from here [m],
    the nearer of both ways, and the drive's own limits, to be put back; None where it has no such
    object. Raises BackendError when the drive does not keep them, or stands beyond its own.
    """
    lower = _read(bus, winch, cia402.POSITION_LEAST, signed=True)
    upper = _read(bus, winch, cia402.POSITION_MOST, signed=True)
    if lower is None or upper is None:
        notes.append(
            f"{name_of(winch)}: has no object 0x607D; limit its positions by its own set-up"
        )
        return None
    here = _value(bus, winch, cia402.POSITION, signed=True)
    limited = lower < upper
    if limited and not lower <= here <= upper:
        raise BackendError(
            f"{name_of(winch)}: stands at {here} counts, beyond its own position limits (0x607D: "
            f"{lower} to {upper}); correct them in the drive, or switch it off and on"
        )
    far = math.ceil(beyond_m * winch.winch.counts_per_m)
    least, most = max(here - far, -(1 << 31)), min(here + far, (1 << 31) - 1)
    if limited:
        least, most = max(least, lower), min(most, upper)
    for key, value in _in_order((least, most), upper):
        if not _kept(bus, winch, key, value, 4):
            raise BackendError(
                f"{name_of(winch)}: does not keep the limit that 0x607D is told; look it up in "
                "its manual"
            )
    return min(most - here, here - least) / winch.winch.counts_per_m, (lower, upper)


def put_back(bus: Fieldbus, winch: WinchState, own: tuple[int, int]) -> None:
    """The position limits that a drive had. Raises BackendError."""
    upper = _value(bus, winch, cia402.POSITION_MOST, signed=True)
    for key, value in _in_order(own, upper):
        bus.sdo_write(winch.winch.node, *key, value.to_bytes(4, "little", signed=True))


def _in_order(limits: tuple[int, int], upper: int) -> Iterator[tuple[Key, int]]:
    """Both position limits, never the lower one above the upper one in between.

    upper: the one that holds now.
    """
    both = [*zip((cia402.POSITION_LEAST, cia402.POSITION_MOST), limits, strict=True)]
    yield from reversed(both) if limits[0] > upper else both


def _value(bus: Fieldbus, winch: WinchState, key: Key, *, signed: bool) -> int:
    return int.from_bytes(bus.sdo_read(winch.winch.node, *key), "little", signed=signed)


def _read(bus: Fieldbus, winch: WinchState, key: Key, *, signed: bool = False) -> int | None:
    try:
        return _value(bus, winch, key, signed=signed)
    except NoSuchObjectError:
        return None


def _kept(bus: Fieldbus, winch: WinchState, key: Key, value: int, size: int) -> bool:
    try:
        bus.sdo_write(winch.winch.node, *key, value.to_bytes(size, "little", signed=value < 0))
    except RefusedError:
        return False
    return _read(bus, winch, key, signed=value < 0) == value
