"""What drives are told never to exceed, on a drive that is a dictionary."""

from __future__ import annotations

import math

import pytest

from cdprcal.hardware import BackendError
from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.canopen_bus import NoSuchObjectError
from cdprcal.hardware.drives.limits import (
    put_back,
    rated_torque_is_wrong,
    set_limits,
    set_position_limits,
)
from cdprcal.hardware.drives.process_data import Key
from cdprcal.hardware.drives.winch import WinchState
from cdprcal.testing.simulated_devices.object_dictionary import ObjectDictionary
from winch_bus import example_session

LEAST, MOST = cia402.POSITION_LEAST, cia402.POSITION_MOST
WRAP = 1 << 31


class Drive:
    """A node that is its dictionary; keeps what was written, in order."""

    def __init__(self, *, least: int = 0, most: int = 0, here: int = 0) -> None:
        self.own = ObjectDictionary()
        self.own.add(cia402.RATED_TORQUE, 2400, 4)
        self.own.add(cia402.MAX_TORQUE, 1000, 2, writable=True)
        self.own.add(cia402.MAX_MOTOR_SPEED, 3000, 4, writable=True)
        self.own.add(LEAST, least, 4, writable=True)
        self.own.add(MOST, most, 4, writable=True)
        self.own.add(cia402.POSITION, here, 4)
        self.written: list[tuple[Key, int]] = []

    @property
    def limits(self) -> tuple[int, int]:
        """Its position limits; no other object has a sign."""
        return self.own.get(LEAST, signed=True), self.own.get(MOST, signed=True)

    def sdo_read(self, node: int, index: int, subindex: int) -> bytes:
        assert node == 1
        if (index, subindex) not in self.own.objects:
            raise NoSuchObjectError(f"no object 0x{index:04X}")
        return self.own.objects[index, subindex].data

    def sdo_write(self, node: int, index: int, subindex: int, data: bytes) -> None:
        assert node == 1
        assert self.own.write((index, subindex), data) == 0
        value = self.own.get((index, subindex), signed=index == LEAST[0])
        self.written.append(((index, subindex), value))
        least, most = self.limits
        assert least <= most, "a drive refuses, or stops, in between"


def winch(*, drum: bool = True) -> WinchState:
    session = example_session()
    one = session.winches[0]
    return WinchState(one if drum else one.model_copy(update={"torque": None}), session)


def test_a_winch_without_a_drum_has_no_rated_torque_to_compare() -> None:
    assert rated_torque_is_wrong(Drive(), winch(drum=False)) == ""  # type: ignore[arg-type]
    bare = Drive()
    del bare.own.objects[cia402.RATED_TORQUE]
    assert rated_torque_is_wrong(bare, winch()) == ""  # type: ignore[arg-type]


def test_a_drive_that_may_give_all_is_limited() -> None:
    """0xFFFF is what drives say that have no limit: it has no sign."""
    drive = Drive()
    drive.own.set(cia402.MAX_TORQUE, 0xFFFF)
    drive.own.set(cia402.MAX_MOTOR_SPEED, 0xFFFFFFFF)
    session = example_session()
    found = set_limits(drive, winch(), session, [])  # type: ignore[arg-type]
    # 462 N on a drum of 50 mm at 10:1 of 2.4 Nm; 0.5 m/s.
    assert drive.written == [(cia402.MAX_TORQUE, 963), (cia402.MAX_MOTOR_SPEED, 955)]
    assert found["tension_N"] == pytest.approx(963 / (1000 * 0.05 / 10 / 2.4))
    assert found["velocity_m_s"] == pytest.approx(955 * 0.05 * 2 * math.pi / 60 / 10)


@pytest.mark.parametrize("here", [0, 5_000_000, -5_000_000])
@pytest.mark.parametrize("beyond_m", [0.05, 0.1000000049, 3.0])
def test_limits_lie_so_far_either_way(here: int, beyond_m: float) -> None:
    """Counts are rounded up: what may be gone is never less than was asked for."""
    drive = Drive(here=here)
    found = set_position_limits(drive, winch(), beyond_m, [])  # type: ignore[arg-type]
    far = math.ceil(beyond_m * 1e7)
    assert drive.limits == (here - far, here + far)
    assert found is not None
    assert found == (far / 1e7, (0, 0))
    put_back(drive, winch(), (0, 0))  # type: ignore[arg-type]
    assert drive.limits == (0, 0)


def test_limits_end_where_counts_do() -> None:
    for here, ends in ((WRAP - 10, (WRAP - 10 - 10**6, WRAP - 1)), (-WRAP, (-WRAP, 10**6 - WRAP))):
        drive = Drive(here=here)
        found = set_position_limits(drive, winch(), 0.1, [])  # type: ignore[arg-type]
        assert drive.limits == ends
        assert found == (min(ends[1] - here, here - ends[0]) / 1e7, (0, 0))


@pytest.mark.parametrize(
    ("least", "most", "expected", "way_m"),
    [
        (-2_000_000, 500_000, (-1_000_000, 500_000), 0.05),
        (-300_000, 2_000_000, (-300_000, 1_000_000), 0.03),
        (-300_000, 0, (-300_000, 0), 0.0),  # it may stand at its own limit
        (0, 500_000, (0, 500_000), 0.0),
        (-5_000_000, 5_000_000, (-1_000_000, 1_000_000), 0.1),
        (7, 7, (-1_000_000, 1_000_000), 0.1),  # equal: none
    ],
)
def test_the_drives_own_limits_stay_where_they_are_narrower(
    least: int, most: int, expected: tuple[int, int], way_m: float
) -> None:
    drive = Drive(least=least, most=most)
    found = set_position_limits(drive, winch(), 0.1, [])  # type: ignore[arg-type]
    assert drive.limits == expected
    assert found == (way_m, (least, most))


@pytest.mark.parametrize("here", [-301, 201])
def test_a_count_beyond_its_own_limits_is_refused(here: int) -> None:
    drive = Drive(least=-300, most=200, here=here)
    with pytest.raises(BackendError, match=rf"stands at {here} counts, .*\(0x607D: -300 to 200\)"):
        set_position_limits(drive, winch(), 0.1, [])  # type: ignore[arg-type]
    assert drive.written == []


@pytest.mark.parametrize("missing", [LEAST, MOST])
def test_a_drive_without_position_limits_is_noted(missing: tuple[int, int]) -> None:
    drive = Drive()
    del drive.own.objects[missing]
    notes: list[str] = []
    assert set_position_limits(drive, winch(), 0.1, notes) is None  # type: ignore[arg-type]
    assert notes == [
        "node 1 (cable 1): has no object 0x607D; limit its positions by its own set-up"
    ]


def test_a_drive_that_says_no_position_is_not_taken_for_one_at_zero() -> None:
    drive = Drive()
    del drive.own.objects[cia402.POSITION]
    with pytest.raises(BackendError, match="0x6064"):
        set_position_limits(drive, winch(), 0.1, [])  # type: ignore[arg-type]
