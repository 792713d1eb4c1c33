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
from cdprcal.hardware.drives.winch import WinchState
from winch_bus import example_session

LEAST, MOST = cia402.POSITION_LEAST, cia402.POSITION_MOST
WRAP = 1 << 31


class Dictionary:
    """Objects of one node: (bits, value); keeps what was written, in order."""

    def __init__(self, **own: int) -> None:
        self.objects = {
            cia402.RATED_TORQUE: (32, 2400),
            cia402.MAX_TORQUE: (16, 1000),
            cia402.MAX_MOTOR_SPEED: (32, 3000),
            LEAST: (32, own.get("least", 0)),
            MOST: (32, own.get("most", 0)),
            cia402.POSITION: (32, own.get("here", 0)),
        }
        self.written: list[tuple[tuple[int, int], int]] = []

    def sdo_read(self, node: int, index: int, subindex: int) -> bytes:
        assert node == 1
        if (index, subindex) not in self.objects:
            raise NoSuchObjectError(f"no object 0x{index:04X}")
        bits, value = self.objects[index, subindex]
        return (value % (1 << bits)).to_bytes(bits // 8, "little")

    def sdo_write(self, node: int, index: int, subindex: int, data: bytes) -> None:
        assert node == 1
        bits, _ = self.objects[index, subindex]
        assert len(data) == bits // 8
        # Position limits are the only ones with a sign.
        value = int.from_bytes(data, "little", signed=index == LEAST[0])
        self.objects[index, subindex] = bits, value
        self.written.append(((index, subindex), value))
        least, most = self.objects[LEAST][1], self.objects[MOST][1]
        assert least <= most, "a drive refuses, or stops, in between"


def winch(*, counts_per_m: float = 1e7, drum: bool = True) -> WinchState:
    session = example_session()
    changed = session.winches[0].model_copy(update={"counts_per_m": counts_per_m})
    if not drum:
        changed = changed.model_copy(update={"torque": None})
    return WinchState(changed, session)


def test_a_winch_without_a_drum_has_no_rated_torque_to_compare() -> None:
    assert rated_torque_is_wrong(Dictionary(), winch(drum=False)) == ""  # type: ignore[arg-type]
    bare = Dictionary()
    del bare.objects[cia402.RATED_TORQUE]
    assert rated_torque_is_wrong(bare, winch()) == ""  # type: ignore[arg-type]


def test_a_drive_that_may_give_all_is_limited() -> None:
    """0xFFFF is what drives say that have no limit: it has no sign."""
    drive = Dictionary()
    drive.objects[cia402.MAX_TORQUE] = 16, 0xFFFF
    drive.objects[cia402.MAX_MOTOR_SPEED] = 32, 0xFFFFFFFF
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
    drive = Dictionary(here=here)
    found = set_position_limits(drive, winch(), beyond_m, [])  # type: ignore[arg-type]
    far = math.ceil(beyond_m * 1e7)
    assert (drive.objects[LEAST][1], drive.objects[MOST][1]) == (here - far, here + far)
    assert found is not None
    assert found == (far / 1e7, (0, 0))
    put_back(drive, winch(), (0, 0))  # type: ignore[arg-type]
    assert (drive.objects[LEAST][1], drive.objects[MOST][1]) == (0, 0)


def test_limits_end_where_counts_do() -> None:
    for here, ends in ((WRAP - 10, (WRAP - 10 - 10**6, WRAP - 1)), (-WRAP, (-WRAP, 10**6 - WRAP))):
        drive = Dictionary(here=here)
        found = set_position_limits(drive, winch(), 0.1, [])  # type: ignore[arg-type]
        assert (drive.objects[LEAST][1], drive.objects[MOST][1]) == ends
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
    drive = Dictionary(least=least, most=most)
    found = set_position_limits(drive, winch(), 0.1, [])  # type: ignore[arg-type]
    assert (drive.objects[LEAST][1], drive.objects[MOST][1]) == expected
    assert found == (way_m, (least, most))


@pytest.mark.parametrize("here", [-301, 201])
def test_a_count_beyond_its_own_limits_is_refused(here: int) -> None:
    drive = Dictionary(least=-300, most=200, here=here)
    with pytest.raises(BackendError, match=rf"stands at {here} counts, .*\(0x607D: -300 to 200\)"):
        set_position_limits(drive, winch(), 0.1, [])  # type: ignore[arg-type]
    assert drive.written == []


@pytest.mark.parametrize("missing", [LEAST, MOST])
def test_a_drive_without_position_limits_is_noted(missing: tuple[int, int]) -> None:
    drive = Dictionary()
    del drive.objects[missing]
    notes: list[str] = []
    assert set_position_limits(drive, winch(), 0.1, notes) is None  # type: ignore[arg-type]
    assert notes == [
        "node 1 (cable 1): has no object 0x607D; limit its positions by its own set-up"
    ]


def test_a_drive_that_says_no_position_is_not_taken_for_one_at_zero() -> None:
    drive = Dictionary()
    del drive.objects[cia402.POSITION]
    with pytest.raises(BackendError, match="0x6064"):
        set_position_limits(drive, winch(), 0.1, [])  # type: ignore[arg-type]
