"""ROS 2 bags: what is written opens with other readers, what others wrote calibrates."""

from __future__ import annotations

import contextlib
import json
import re
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import cdprcal
from cdprcal import Log, Robot
from cdprcal.hardware.session import Ros2, load_topics
from cdprcal.hardware.xsens.measurement import quaternion_from_rotation
from cdprcal.ros2 import is_bag, load_bag, save_bag
from conftest import Cli, changed

CHANNELS = ("length_m", "swivel_rad", "tension_N", "tension_setpoint_N", "roll_pitch_yaw_rad")
STORE = get_typestore(Stores.ROS2_HUMBLE)
TYPES = STORE.types


def topics(**fields: Any) -> Ros2:
    return Ros2.model_validate(fields)


WRENCHES = [f"/cable_{i}/wrench" for i in range(1, 5)]
#: Names as a ros2_control robot might have them, drums of 50 mm that turn the other way.
MAP = {
    "joint_states": "/winches/joint_states",
    "imu": "/imu",
    "setpoints": "/winches/commands",
    "length_joints": ["fl", "fr", "rr", "rl"],
    "swivel_joints": ["fl_swivel", "fr_swivel", "rr_swivel", "rl_swivel"],
    "length_per_position_m": 0.05,
    "length_sign": -1,
    "swivel_sign": -1,
    "tension_sign": -1,
    "mounting_deg": [180.0, 0.0, 90.0],
}


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize(
    "map_of",
    [{}, MAP, MAP | {"wrenches": WRENCHES}],
    ids=["plain", "map", "all"],
)
def test_what_is_written_is_read_again(
    robot: Robot,
    log: Log,
    tmp_path: Path,
    map_of: dict[str, Any],
    storage: Literal["mcap", "sqlite3"],
) -> None:
    path = tmp_path / "bag"
    save_bag(log, path, robot.euler_convention, topics(**map_of), storage=storage)
    assert is_bag(path)
    for place in (path, next(path.glob("bag.*"))):
        read = load_bag(place, topics(**map_of), robot.euler_convention).log
        np.testing.assert_allclose(read.time_s, log.time_s - log.time_s[0], atol=2e-9)
        for name in CHANNELS:
            np.testing.assert_allclose(getattr(read, name), getattr(log, name), atol=1e-12)


def test_gaps_are_kept(robot: Robot, log: Log, tmp_path: Path) -> None:
    lengths, angles = log.length_m.copy(), log.roll_pitch_yaw_rad.copy()
    lengths[5, 2], angles[7] = np.nan, np.nan
    log = changed(log, length_m=lengths, roll_pitch_yaw_rad=angles, swivel_rad=None)
    save_bag(log, tmp_path / "bag", robot.euler_convention)
    read = load_bag(tmp_path / "bag", None, robot.euler_convention).log
    assert np.isnan(read.length_m[5, 2])
    assert np.isnan(read.roll_pitch_yaw_rad[7]).all()
    assert np.isnan(read.roll_pitch_yaw_rad).sum() == 3
    assert read.swivel_rad.shape[1] == 0


def test_a_bag_opens_with_mcap_ros2_support(robot: Robot, log: Log, tmp_path: Path) -> None:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    save_bag(log, tmp_path / "bag", robot.euler_convention, topics(wrenches=WRENCHES))
    counts: dict[str, int] = {}
    with (tmp_path / "bag" / "bag.mcap").open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        decoded = list(reader.iter_decoded_messages())
    for _, channel, _, said in decoded:
        row = counts.setdefault(channel.topic, 0)
        counts[channel.topic] += 1
        if channel.topic == "/joint_states":
            assert said.name[:4] == ["cable_1", "cable_2", "cable_3", "cable_4"]
            np.testing.assert_array_equal(said.position[:4], log.length_m[row])
            np.testing.assert_array_equal(said.effort[:4], log.tension_N[row])
        elif channel.topic == WRENCHES[2]:
            assert said.wrench.force.x == log.tension_N[row, 2]
            assert said.header.frame_id == "cable_3_load_cell"
    topics_of = ["/joint_states", "/imu/data", "/tension_setpoints", *WRENCHES]
    assert counts == dict.fromkeys(topics_of, len(log))


def test_a_bag_opens_with_rosbags(robot: Robot, log: Log, tmp_path: Path) -> None:
    save_bag(log, tmp_path / "bag", robot.euler_convention)
    with Reader(tmp_path / "bag") as reader:
        assert {c.topic: c.msgtype for c in reader.connections} == {
            "/joint_states": "sensor_msgs/msg/JointState",
            "/imu/data": "sensor_msgs/msg/Imu",
            "/tension_setpoints": "sensor_msgs/msg/JointState",
        }
        assert reader.message_count == 3 * len(log)


def header(time_s: float) -> Any:
    sec, nanosec = divmod(round(time_s * 1e9), 1_000_000_000)
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id="x")


def foreign_bag(path: Path, log: Log, robot: Robot) -> None:
    """A bag as a ROS robot records it: by rosbags alone, joints in another order and not all of
    them cables, an IMU that runs beside them, stamps of today."""
    joint, imu = TYPES["sensor_msgs/msg/JointState"], TYPES["sensor_msgs/msg/Imu"]
    start_s = 1.75e9
    order = [7, 2, 0, 3, 1, 5, 4, 6]
    names = np.array([*MAP["length_joints"], *MAP["swivel_joints"]])[order]  # type: ignore[misc]
    vector = TYPES["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=9.81)
    covariance = np.zeros(9)
    with Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        kinds = {"/winches/joint_states": joint, "/imu": imu}
        made = {
            topic: writer.add_connection(topic, kind.__msgtype__, typestore=STORE)
            for topic, kind in kinds.items()
        }
        for row, time_s in enumerate((start_s + log.time_s).tolist()):
            position = np.concatenate([-log.length_m[row] / 0.05, -log.swivel_rad[row]])[order]
            effort = np.concatenate([-log.tension_N[row] * 0.05, np.zeros(4)])[order]
            said = joint(
                header=header(time_s),
                name=["gripper", *names.tolist()],
                position=np.array([0.1, *position]),
                velocity=np.zeros(9),
                effort=np.array([0.0, *effort]),
            )
            data = STORE.serialize_cdr(said, joint.__msgtype__)
            writer.write(made["/winches/joint_states"], round(time_s * 1e9) + 300_000, data)
            rotation = cdprcal.rotation_from_euler(
                log.roll_pitch_yaw_rad[row], robot.euler_convention
            )
            flip = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
            w, x, y, z = quaternion_from_rotation(rotation @ flip)
            said = imu(
                header=header(time_s + 0.004),
                orientation=TYPES["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
                orientation_covariance=covariance,
                angular_velocity=vector,
                angular_velocity_covariance=covariance,
                linear_acceleration=vector,
                linear_acceleration_covariance=covariance,
            )
            data = STORE.serialize_cdr(said, imu.__msgtype__)
            writer.write(made["/imu"], round(time_s * 1e9) + 5_000_000, data)


ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
SESSION_TEXT = (ROOT / "examples/canopen-simulated.yaml").read_text()


def test_a_bag_of_rosbags_calibrates(cli: Cli, robot: Robot, log: Log, tmp_path: Path) -> None:
    foreign_bag(tmp_path / "bag", log, robot)
    session, out = tmp_path / "session.yaml", tmp_path / "run.csv"
    session.write_text(f"{SESSION_TEXT}ros2: {json.dumps(MAP)}\n")
    ran = cli("import", tmp_path / "bag", "--robot", "irma4", "--session", session, "-o", out)
    assert ran.code == 0, ran.stderr
    read = cdprcal_log(out)
    assert read.time_s[0] == 0.0
    for name in ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"):
        np.testing.assert_allclose(getattr(read, name), getattr(log, name), atol=1e-9)
    without_setpoints = changed(log, tension_setpoint_N=None)
    found = cli("calibrate", "irma4", out, "--json").document()["initial_pose"]["position_m"]
    wanted = cdprcal.calibrate(robot, without_setpoints).result.poses[0].position_m
    np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_a_session_of_topics_alone_is_enough_for_bags(
    cli: Cli, robot: Robot, log: Log, tmp_path: Path
) -> None:
    foreign_bag(tmp_path / "bag", log, robot)
    session, out = tmp_path / "session.yaml", tmp_path / "run.csv"
    page = (DOCS / "ros2.md").read_text(encoding="utf-8")
    session.write_text(re.findall(r"^```yaml\n(.*?)^```$", page, re.M | re.S)[0])
    named = load_topics(session).ros2
    assert named is not None
    assert named.length_per_position_m == 0.05
    session.write_text(f"format: cdprcal-session-1\nrobot: irma4\nros2: {json.dumps(MAP)}\n")
    ran = cli("import", tmp_path / "bag", "--robot", "irma4", "--session", session, "-o", out)
    assert ran.code == 0, ran.stderr
    np.testing.assert_allclose(cdprcal_log(out).length_m, log.length_m, atol=1e-9)
    # What is misspelt is no topic map, and with devices it is a session as a whole.
    for text, said in (
        ("ros: {}", "session.yaml:3:1: ros: is not known"),
        ("winches: []", "bus: is missing"),
    ):
        session.write_text(f"format: cdprcal-session-1\nrobot: irma4\n{text}\n")
        cli("export", "irma4", out, "-o", tmp_path / "no", "--session", session).refused(said)


def test_export_and_import_again(cli: Cli, log_path: Path, log: Log, tmp_path: Path) -> None:
    bag, out = tmp_path / "bag", tmp_path / "again.mcap"
    assert cli("export", "irma4", log_path, "-o", bag).code == 0
    assert cli("import", bag, "--robot", "irma4", "-o", out).code == 0
    again = cdprcal_log(out)
    np.testing.assert_allclose(again.tension_N, log.tension_N, atol=1e-12)
    wanted_N = log.tension_setpoint_N
    np.testing.assert_allclose(again.tension_setpoint_N, wanted_N, atol=1e-12)
    cli("export", "irma4", log_path, "-o", bag).refused("exists already")
    cli("import", bag, "-o", tmp_path / "no.csv").refused("give --robot")
    assert not (tmp_path / "no.csv").exists()


def cdprcal_log(path: Path) -> Log:
    from cdprcal.io import load_log

    return load_log(path).log


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        (
            {"joint_states": "/js"},
            r"no sensor_msgs/msg/JointState on /js; it holds .*/joint_states",
        ),
        (
            {"imu": "/joint_states", "joint_states": "/imu/data"},
            r"is sensor_msgs/msg/\w+, and must be sensor_msgs/msg/",
        ),
        ({"length_joints": ["a", "b"]}, "has no joint 'a'; it has cable_1, "),
    ],
)
def test_maps_that_do_not_fit_are_said(
    robot: Robot, log: Log, tmp_path: Path, fields: dict[str, Any], words: str
) -> None:
    save_bag(log, tmp_path / "bag", robot.euler_convention)
    with pytest.raises(cdprcal.InputError, match=words):
        load_bag(tmp_path / "bag", topics(**fields), robot.euler_convention)


def test_joints_of_other_names_are_listed(robot: Robot, log: Log, tmp_path: Path) -> None:
    save_bag(log, tmp_path / "bag", robot.euler_convention, topics(**MAP))
    only = topics(joint_states=MAP["joint_states"])
    with pytest.raises(cdprcal.InputError, match=r"has the joints fl, fr, .*ros2\.length_joints"):
        load_bag(tmp_path / "bag", only)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_damaged_bags_are_refused(
    robot: Robot, log: Log, tmp_path: Path, storage: Literal["mcap", "sqlite3"]
) -> None:
    save_bag(log, tmp_path / "bag", robot.euler_convention, storage=storage)
    path = next((tmp_path / "bag").glob("bag.*"))
    whole = path.read_bytes()
    random = np.random.default_rng(1)
    for share in (0.1, 0.5, 0.9):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(cdprcal.InputError, match=r"bag.*(reindex|recover)"):
            load_bag(path, None, robot.euler_convention)
    for _ in range(20):
        data = bytearray(whole)
        for at in random.integers(64, len(data), 20).tolist():
            data[at] = int(random.integers(256))
        path.write_bytes(data)
        with contextlib.suppress(cdprcal.InputError):  # and nothing else
            load_bag(path, None, robot.euler_convention)
    (tmp_path / "bag" / "metadata.yaml").write_text("rosbag2_bagfile_information: 3")
    with pytest.raises(cdprcal.InputError, match="is no whole ROS 2 bag"):
        load_bag(tmp_path / "bag")


def test_what_is_no_bag_is_none(log_path: Path, tmp_path: Path) -> None:
    assert not is_bag(log_path)
    assert not is_bag(tmp_path)
    assert not is_bag(tmp_path / "none")


def test_a_map_for_another_number_of_cables(robot: Robot, log: Log, tmp_path: Path) -> None:
    with pytest.raises(cdprcal.InputError, match=r"ros2\.wrenches: names 3, the log has 4"):
        save_bag(log, tmp_path / "bag", robot.euler_convention, topics(wrenches=WRENCHES[:3]))
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def short(log: Log) -> Log:
    """Its first hundred samples."""
    return changed(log, **{name: getattr(log, name)[:100] for name in ("time_s", *CHANNELS)})


@pytest.mark.parametrize("of", ["message", "file", "storage"])
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_packed_bags_are_read(
    robot: Robot, short: Log, tmp_path: Path, of: str, storage: str
) -> None:
    if (storage, of) == ("sqlite3", "storage"):
        pytest.skip("SQLite packs nothing by itself")
    save_bag(short, tmp_path / "plain", robot.euler_convention)
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    writer = Writer(tmp_path / "packed", version=8, storage_plugin=plugin)
    writer.set_compression(CompressionMode[of.upper()], CompressionFormat.ZSTD)
    with Reader(tmp_path / "plain") as reader, writer:
        made = {
            c.topic: writer.add_connection(c.topic, c.msgtype, typestore=STORE)
            for c in reader.connections
        }
        for connection, stamp, data in reader.messages():
            writer.write(made[connection.topic], stamp, data)
    packed = load_bag(tmp_path / "packed", None, robot.euler_convention).log
    plain = load_bag(tmp_path / "plain", None, robot.euler_convention).log
    for name in ("time_s", *CHANNELS):
        np.testing.assert_array_equal(getattr(packed, name), getattr(plain, name))


@pytest.mark.parametrize("compression", ["lz4", "zstd", ""])
def test_an_mcap_of_another_writer_is_read(
    robot: Robot, short: Log, tmp_path: Path, compression: str
) -> None:
    """As rosbag2_storage_mcap writes them: many chunks, with and without an index."""
    from mcap.records import Channel, Message, Schema
    from mcap.stream_reader import StreamReader
    from mcap.writer import CompressionType
    from mcap.writer import Writer as McapWriter

    save_bag(short, tmp_path / "bag", robot.euler_convention)
    kinds = {"lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD, "": CompressionType.NONE}
    path = tmp_path / "other.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(
            stream, chunk_size=4000, compression=kinds[compression], enable_data_crcs=True,
            use_chunking=bool(compression),
        )  # fmt: skip
        writer.start(profile="ros2", library="test")
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for record in StreamReader(str(tmp_path / "bag" / "bag.mcap")).records:
            if isinstance(record, Schema) and record.id not in schemas:
                schemas[record.id] = writer.register_schema(record.name, "ros2msg", record.data)
            elif isinstance(record, Channel) and record.id not in channels:
                channels[record.id] = writer.register_channel(
                    record.topic, "cdr", schemas[record.schema_id]
                )
            elif isinstance(record, Message):
                writer.add_message(
                    channels[record.channel_id], record.log_time, record.data, record.publish_time
                )
        writer.finish()  # type: ignore[no-untyped-call]
    assert is_bag(path)
    read = load_bag(path, None, robot.euler_convention).log
    plain = load_bag(tmp_path / "bag", None, robot.euler_convention).log
    for name in ("time_s", *CHANNELS):
        np.testing.assert_array_equal(getattr(read, name), getattr(plain, name))
    if not compression:  # no chunk, no checksum of it: that of all data together counts
        data = bytearray(path.read_bytes())
        data[len(data) // 3] ^= 1
        path.write_bytes(data)
        with pytest.raises(cdprcal.InputError, match="checksum of the data"):
            load_bag(path, None, robot.euler_convention)


def test_a_flipped_bit_in_an_exported_mcap_is_noticed(
    robot: Robot, short: Log, tmp_path: Path
) -> None:
    save_bag(short, tmp_path / "bag", robot.euler_convention)
    path = tmp_path / "bag" / "bag.mcap"
    whole = path.read_bytes()
    chunk = 17 + whole[9]  # behind magic and header
    records = chunk + 9 + 40  # behind the chunk's head: 28 bytes, no name of a compression, size
    size = int.from_bytes(whole[records - 8 : records], "little")
    random = np.random.default_rng(5)
    for at in random.integers(records, records + size, 200).tolist():
        data = bytearray(whole)
        data[at] ^= 1 << int(random.integers(8))
        path.write_bytes(data)
        with pytest.raises(cdprcal.InputError, match="the checksum of a chunk does not fit"):
            load_bag(path, None, robot.euler_convention)


def test_an_exported_sqlite_has_a_checksum_and_others_are_said_to_have_none(
    robot: Robot, short: Log, tmp_path: Path
) -> None:
    """A flipped bit in a reading: SQLite itself does not see it; docs/ros2.md says so."""
    save_bag(short, tmp_path / "bag", robot.euler_convention, storage="sqlite3")
    path = tmp_path / "bag" / "bag.db3"
    whole = path.read_bytes()
    load_bag(path, None, robot.euler_convention)
    for page in range(1, len(whole) // 4096):
        data = bytearray(whole)
        data[4096 * page + 4] ^= 0x40  # of its count of cells
        path.write_bytes(data)
        with pytest.raises(cdprcal.InputError, match="is no whole ROS 2 bag"):
            load_bag(path, None, robot.euler_convention)
    reading = whole.index(short.length_m[50, 1].tobytes())
    data = bytearray(whole)
    data[reading + 3] ^= 1
    path.write_bytes(data)
    with pytest.raises(cdprcal.InputError, match=r"the checksum of bag\.db3 does not fit"):
        load_bag(path.parent, None, robot.euler_convention)
    alone = load_bag(path, None, robot.euler_convention)  # without its metadata
    assert alone.log.length_m[50, 1] != short.length_m[50, 1]
    assert [finding.code for finding in alone.findings] == ["no_checksum"]
    path.write_bytes(whole)
    assert load_bag(path.parent, None, robot.euler_convention).findings == ()


def test_a_bag_of_several_files(robot: Robot, log: Log, tmp_path: Path) -> None:
    """As ``ros2 bag record --max-bag-duration`` splits them."""
    save_bag(log, tmp_path / "whole", robot.euler_convention)
    bag = tmp_path / "bag"
    bag.mkdir()
    names = []
    for number, rows in enumerate((slice(0, 200), slice(200, None))):
        parts = {name: getattr(log, name)[rows] for name in ("time_s", *CHANNELS)}
        save_bag(changed(log, **parts), tmp_path / f"part{number}", robot.euler_convention)
        names.append(f"part{number}.mcap")
        (tmp_path / f"part{number}" / names[-1]).rename(bag / names[-1])
    (bag / "metadata.yaml").write_text(
        json.dumps(
            {
                "rosbag2_bagfile_information": {
                    "version": 8,
                    "storage_identifier": "mcap",
                    "relative_file_paths": names,
                }
            }
        )
    )
    read = load_bag(bag, None, robot.euler_convention).log
    whole = load_bag(tmp_path / "whole", None, robot.euler_convention).log
    for name in ("time_s", *CHANNELS):
        np.testing.assert_array_equal(getattr(read, name), getattr(whole, name))
