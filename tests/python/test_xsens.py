"""The Xsens MTi: frames, measurements, set-up; byte sequences, a pty, garbage."""

from __future__ import annotations

import contextlib
import math
import os
import struct
import threading
import time
import tty
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdprcal.hardware import BackendError
from cdprcal.hardware.session import Ahrs
from cdprcal.hardware.xsens import measurement as mt
from cdprcal.hardware.xsens.device import XsensMti, open_port
from cdprcal.hardware.xsens.frames import Frame, FrameReader, encode
from cdprcal.testing.simulated_devices.mti import SimulatedMti, SimulatedPort

#: Messages without data as the low-level protocol document prints them.
PUBLISHED = {
    "GoToConfig": ("FA FF 30 00 D1", 0x30),
    "GoToConfigAck": ("FA FF 31 00 D0", 0x31),
    "GoToMeasurement": ("FA FF 10 00 F1", 0x10),
    "GoToMeasurementAck": ("FA FF 11 00 F0", 0x11),
    "ReqDID": ("FA FF 00 00 01", 0x00),
    "Reset": ("FA FF 40 00 C1", 0x40),
    "WakeUp": ("FA FF 3E 00 C3", 0x3E),
    "WakeUpAck": ("FA FF 3F 00 C2", 0x3F),
}
#: SetOutputConfiguration: quaternion, float32, ENU, 100 Hz.
CONFIGURE = bytes.fromhex("FA FF C0 04 20 10 00 64 A9")
#: A packet by hand: counter 0x1234, time 0x00989680 (1000 s), quaternion (1, 0, 0, 0), status.
PACKET = bytes.fromhex(
    "FA FF 36 26"
    "10 20 02 12 34"
    "10 60 04 00 98 96 80"
    "20 10 10 3F 80 00 00 00 00 00 00 00 00 00 00 00 00 00 00"
    "E0 20 04 00 00 00 87"
)
PACKET += bytes((-sum(PACKET[1:]) & 0xFF,))


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_messages(name: str) -> None:
    text, mid = PUBLISHED[name]
    data = bytes.fromhex(text)
    assert encode(mid) == data
    assert FrameReader().feed(data) == [Frame(mid, b"")]


def test_set_output_configuration() -> None:
    assert encode(0xC0, bytes.fromhex("20100064")) == CONFIGURE


def test_a_packet_by_hand() -> None:
    (frame,) = FrameReader().feed(PACKET)
    assert frame.mid == mt.MID
    measurement = mt.parse(frame.data)
    assert measurement is not None
    assert measurement.packet_counter == 0x1234
    assert measurement.time_fine == 10_000_000
    assert measurement.quaternion == (1.0, 0.0, 0.0, 0.0)
    assert measurement.status == 0x87
    assert measurement.frame == "ENU"


def test_extended_length() -> None:
    data = bytes(range(256)) * 2
    framed = encode(0x36, data)
    assert framed[3:6] == b"\xff\x02\x00"
    assert FrameReader().feed(framed) == [Frame(0x36, data)]
    for size in (254, 255, 256, 2048):
        assert FrameReader().feed(encode(0x36, bytes(size))) == [Frame(0x36, bytes(size))]
    with pytest.raises(ValueError, match="2049"):
        encode(0x36, bytes(2049))


@pytest.mark.parametrize("frame", mt.FRAME_BITS)
@pytest.mark.parametrize("precision", mt.PRECISION_BITS)
@pytest.mark.parametrize("kind", [mt.QUATERNION, mt.EULER])
def test_every_format_gives_the_same_attitude(
    kind: int, precision: mt.Precision, frame: mt.LocalFrame
) -> None:
    rotation = mt.rotation_from_zyx_deg((20.0, -35.0, 130.0))
    local = mt.rotation_local_enu(frame) @ rotation
    if kind == mt.QUATERNION:
        numbers = mt.quaternion_from_rotation(local)
    else:
        numbers = mt.zyx_deg_from_rotation(local)
    item = kind | mt.FRAME_BITS[frame] | mt.PRECISION_BITS[precision]
    data = mt.encode_item(item, mt.encode_reals(precision, numbers))
    measurement = mt.parse(data)
    assert measurement is not None
    found = mt.rotation_enu_sensor(measurement)
    assert found is not None
    step = {"float32": 1e-6, "fp12.20": 2e-6, "fp16.32": 1e-9, "float64": 1e-14}[precision]
    np.testing.assert_allclose(found, rotation, atol=step)


def test_frames_are_what_they_are_called() -> None:
    """A sensor with x to the east, y to the north, z up, told in each frame."""
    told = {
        "ENU": (1.0, 0.0, 0.0, 0.0),
        # x east is y in NED, z up is -z: half a turn about the diagonal of x and y.
        "NED": (0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0),
        # x east is -y in NWU: a quarter turn to the right.
        "NWU": (math.sqrt(0.5), 0.0, 0.0, -math.sqrt(0.5)),
    }
    for frame, quaternion in told.items():
        found = mt.rotation_enu_sensor(mt.Measurement(quaternion=quaternion, frame=frame))  # type: ignore[arg-type]
        assert found is not None
        np.testing.assert_allclose(found, np.eye(3), atol=1e-15, err_msg=frame)


def test_fixed_point_as_the_document_writes_it() -> None:
    # 16.32: fraction first, then the whole part, two's complement: -1.5 is -2 + 0.5.
    assert mt.encode_reals("fp16.32", (-1.5,)) == bytes.fromhex("80000000 FFFE")
    assert mt.encode_reals("fp12.20", (-1.5,)) == bytes.fromhex("FFE80000")


@pytest.mark.parametrize(
    "data",
    [
        bytes.fromhex("2010"),
        bytes.fromhex("20100F") + bytes(15),  # a size that is not that of four float32
        bytes.fromhex("201010") + bytes(15),  # cut
        bytes.fromhex("102002123410"),  # something is left over
    ],
)
def test_measurements_that_are_none(data: bytes) -> None:
    assert mt.parse(data) is None


@pytest.mark.parametrize("numbers", [(math.nan, 0, 0, 0), (2.0, 0, 0, 0), (0, 0, 0, 0),
                                     (3e38, 3e38, 0, 0)])  # fmt: skip
def test_quaternions_that_are_none_are_absent(numbers: tuple[float, ...]) -> None:
    measurement = mt.parse(mt.encode_item(mt.QUATERNION, struct.pack(">4f", *numbers)))
    assert measurement is not None
    assert measurement.quaternion is None
    assert mt.rotation_enu_sensor(measurement) is None


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4))
def test_rotations_and_quaternions_are_inverses(numbers: list[float]) -> None:
    if math.hypot(*numbers) < 0.1:
        return
    rotation = mt.rotation_from_quaternion(tuple(numbers))
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    again = mt.rotation_from_quaternion(mt.quaternion_from_rotation(rotation))
    np.testing.assert_allclose(again, rotation, atol=1e-12)
    angles = mt.zyx_deg_from_rotation(rotation)
    if abs(angles[1]) > 89.9:
        return  # gimbal lock
    np.testing.assert_allclose(mt.rotation_from_zyx_deg(angles), rotation, atol=1e-6)


# --- finding frames again ------------------------------------------------------------------------

messages = st.tuples(st.integers(0, 255), st.binary(max_size=300))


@given(st.lists(messages, max_size=6), st.lists(st.integers(1, 40), min_size=1))
def test_frames_come_out_however_they_are_cut(
    said: list[tuple[int, bytes]], pieces: list[int]
) -> None:
    stream = b"".join(encode(mid, data) for mid, data in said)
    reader, frames, at, turn = FrameReader(), [], 0, 0
    while at < len(stream):
        size = pieces[turn % len(pieces)]
        frames += reader.feed(stream[at : at + size])
        at, turn = at + size, turn + 1
    assert frames == [Frame(mid, data) for mid, data in said]
    assert reader.skipped == 0


@given(st.binary(max_size=200), messages)
def test_a_frame_is_found_behind_any_garbage(garbage: bytes, message: tuple[int, bytes]) -> None:
    """At once, unless the garbage and it make another frame by chance."""
    garbage = garbage.replace(b"\xfa\xff", b"")
    frame = encode(*message)
    reader = FrameReader()
    found = reader.feed(garbage + frame)
    if garbage.endswith(b"\xfa"):
        return  # with the frame's own first byte it may begin another
    assert found == [Frame(*message)]
    assert reader.skipped == len(garbage)


def test_a_head_by_chance_holds_nothing_back() -> None:
    """Garbage that looks like a long message: the next packet comes out, not the tenth."""
    reader = FrameReader()
    reader.feed(PACKET)
    assert reader.feed(b"\x00\xfa\xff\x36\xfe" + b"\x11" * 20) == []
    assert [frame.mid for frame in reader.feed(PACKET)] == [mt.MID]
    assert [frame.mid for frame in reader.feed(PACKET)] == [mt.MID]
    assert reader.skipped == 25


@given(st.binary(max_size=600))
def test_no_bytes_at_all_make_it_fail(data: bytes) -> None:
    reader = FrameReader()
    for frame in reader.feed(data) + reader.feed(PACKET) + reader.feed(PACKET):
        measurement = mt.parse(frame.data)
        if measurement is not None:
            mt.rotation_enu_sensor(measurement)


def mutated(random: np.random.Generator, count: int) -> Iterator[bytes]:
    """Packets of every kind with a few bytes changed, cut, doubled or put in."""
    packets = [PACKET, CONFIGURE, encode(0x42, b"\x04"), encode(0x36, bytes(300))]
    for kind in (mt.QUATERNION, mt.EULER):
        for precision, bits in mt.PRECISION_BITS.items():
            numbers = (0.5, 0.5, 0.5, 0.5)[: 4 if kind == mt.QUATERNION else 3]
            item = mt.encode_item(kind | bits, mt.encode_reals(precision, numbers))
            packets.append(encode(mt.MID, item))
    for _ in range(count):
        packet = bytearray(packets[int(random.integers(len(packets)))])
        for _ in range(int(random.integers(4))):
            at = int(random.integers(len(packet)))
            what = int(random.integers(4))
            if what == 0:
                packet[at] = int(random.integers(256))
            elif what == 1:
                del packet[at:]
                packet += b"\xfa"
            elif what == 2:
                packet[at:at] = random.bytes(3)
            else:
                packet[at:at] = packet[:at]
        if random.integers(2):  # a checksum that is right again, so that the inside is read
            packet[-1] = -sum(packet[1:-1]) & 0xFF
        yield bytes(packet)


FRAMES = int(os.environ.get("CDPRCAL_MTI_FRAMES", "20000"))


def test_mutated_and_random_frames_make_no_exception() -> None:
    random = np.random.default_rng(3)
    reader, parsed = FrameReader(), 0
    for number, packet in enumerate(mutated(random, FRAMES)):
        data = packet if number % 4 else random.bytes(40)
        for frame in reader.feed(data):
            measurement = mt.parse(frame.data)
            if measurement is not None and mt.rotation_enu_sensor(measurement) is not None:
                parsed += 1
    assert parsed > FRAMES / 20


# --- the device ----------------------------------------------------------------------------------


@pytest.mark.parametrize("frame", mt.FRAME_BITS)
@pytest.mark.parametrize("output", ["quaternion", "euler"])
def test_set_up_and_poll(output: str, frame: str) -> None:
    ahrs = Ahrs.model_validate(
        {"port": "simulated", "output": output, "frame": frame, "mounting_deg": [180.0, 0.0, 45.0]}
    )
    port = SimulatedPort(ahrs)
    device = XsensMti(port, ahrs)
    assert device.settings["device_id"] == "07812345"
    assert device.poll(0.0) is None
    for tick in range(5):
        truth = mt.rotation_from_zyx_deg((5.0 * tick, 3.0, -170.0))
        port.device.show(truth, 0.01 * tick)
        attitude = device.poll(10.0 + 0.01 * tick)
        assert attitude is not None
        np.testing.assert_allclose(attitude.R_world_platform, truth, atol=2e-6)
        assert attitude.time_s == pytest.approx(10.0 + 0.01 * tick, abs=1e-4)
    assert device.settings["lost_packets"] == 0


def test_what_waited_somewhere_is_known_to_be_old() -> None:
    ahrs = Ahrs(port="simulated")
    port = SimulatedPort(ahrs)
    device = XsensMti(port, ahrs)
    for tick in range(200):
        port.device.show(np.eye(3), 0.01 * tick)
        if not 100 <= tick < 105:  # nobody reads for 50 ms …
            attitude = device.poll(0.01 * tick)
    assert attitude is not None
    assert attitude.time_s == pytest.approx(1.99, abs=1e-3)
    port.device.show(np.eye(3), 2.0)
    late = device.poll(2.08)  # … and this one waited 80 ms in a buffer
    assert late is not None
    assert late.time_s == pytest.approx(2.0, abs=1e-3)


def test_lost_packets_are_counted() -> None:
    ahrs = Ahrs(port="simulated")
    port = SimulatedPort(ahrs)
    device = XsensMti(port, ahrs)
    for tick in range(10):
        port.device.show(np.eye(3), 0.01 * tick)
        if tick in (4, 5, 6):
            port.read(1000)
        device.poll(0.01 * tick)
    assert device.settings["lost_packets"] == 3


class Deaf(SimulatedPort):
    def write(self, data: bytes) -> int:
        return len(data)


def test_what_does_not_answer_is_said() -> None:
    ahrs = Ahrs(port="/dev/ttyMTI")
    with pytest.raises(BackendError, match="AHRS on /dev/ttyMTI: does not answer at 115200 bit/s"):
        XsensMti(Deaf(ahrs), ahrs)


def test_rates_that_cannot_be() -> None:
    ahrs = Ahrs(port="simulated", rate_Hz=400)
    with pytest.raises(BackendError, match=r"400 packets of 36 bytes per second need 144000 bit/s"):
        XsensMti(SimulatedPort(ahrs), ahrs)
    ahrs = Ahrs(port="simulated", rate_Hz=150)
    with pytest.raises(BackendError, match=r"gives 133 Hz where ahrs\.rate_Hz asks for 150"):
        XsensMti(SimulatedPort(ahrs), ahrs)


def test_an_error_message_of_the_device() -> None:
    ahrs = Ahrs(port="simulated")
    port = SimulatedPort(ahrs)
    device = XsensMti(port, ahrs)
    port._sent.extend(encode(0x42, b"\x28"))
    with pytest.raises(BackendError, match="measurement engine is overloaded"):
        device.poll(0.0)


def test_over_a_serial_line() -> None:
    """pyserial on a pty, the simulated device at its other end."""
    theirs, ours = os.openpty()
    tty.setraw(theirs)
    ahrs = Ahrs(port=os.ttyname(ours), rate_Hz=100)

    def send(data: bytes) -> None:
        os.write(theirs, data)

    device_there = SimulatedMti(ahrs, send)
    truth = mt.rotation_from_zyx_deg((10.0, -20.0, 30.0))
    done = threading.Event()

    def serve() -> None:
        os.set_blocking(theirs, False)
        tick = 0
        os.write(theirs, b"\x00\xfa\xff\x36")  # the rest of something
        while not done.is_set():
            with contextlib.suppress(BlockingIOError):
                device_there.receive(os.read(theirs, 1000))
            device_there.show(truth, 0.01 * tick)
            tick += 1
            time.sleep(0.001)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        device = XsensMti(open_port(ahrs), ahrs)
        deadline = time.monotonic() + 10.0
        while (attitude := device.poll(time.monotonic())) is None:
            assert time.monotonic() < deadline
            time.sleep(0.001)
        np.testing.assert_allclose(attitude.R_world_platform, truth, atol=1e-6)
    finally:
        done.set()
        thread.join()
        os.close(theirs)
    os.close(ours)
    with pytest.raises(BackendError, match="AHRS: "):  # the other end is gone
        device.poll(time.monotonic())
    device.close()
    device.close()


def test_a_port_that_is_not_there() -> None:
    with pytest.raises(BackendError, match=r"AHRS: .*ttyNONE"):
        open_port(Ahrs(port="/dev/ttyNONE"))


@pytest.mark.alone
def test_parsing_is_quick(benchmark: object) -> None:
    """Packets per second: the rate that is asserted leaves room for a slow, busy machine."""
    data = PACKET * 200

    def read() -> int:
        reader = FrameReader()
        return sum(mt.parse(frame.data) is not None for frame in reader.feed(data))

    assert benchmark(read) == 200  # type: ignore[operator]
    stats = benchmark.stats.stats  # type: ignore[attr-defined]
    assert 200 / stats.min > 2e4
