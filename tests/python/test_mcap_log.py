"""The canonical log as MCAP."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

import cdprcal
from cdprcal import InputError
from cdprcal.io import load_log, save_log
from cdprcal.sensors import LOG_GROUPS

ARRAYS = ("time_s", *LOG_GROUPS)


def write(path: Path, *topics: list[object]) -> Path:
    """An MCAP file with one channel a list of messages."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        for number, messages in enumerate(topics):
            schema = writer.register_schema("any", "jsonschema", b"{}")
            channel = writer.register_channel(f"/topic{number}", "json", schema)
            for i, message in enumerate(messages):
                data = message if isinstance(message, bytes) else json.dumps(message).encode()
                writer.add_message(channel, i, data, i)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_a_log_reads_back_to_the_bit(log: cdprcal.Log, tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    save_log(log, path)
    file = load_log(path)
    assert file.format == "mcap"
    assert file.findings == ()
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(file.log, name), getattr(log, name))


def test_absent_readings_stay_absent(tmp_path: Path) -> None:
    log = cdprcal.Log(
        time_s=[-1.5, 0.1, 0.30000000000000004],
        length_m=np.array([[1, np.nan], [2, 3], [np.nan, np.nan]]),
        roll_pitch_yaw_rad=[[0.1, 0.2, np.nan]] * 3,
    )
    path = tmp_path / "log.mcap"
    save_log(log, path)
    again = load_log(path).log
    for name in ("time_s", "length_m", "swivel_rad"):
        np.testing.assert_array_equal(getattr(again, name), getattr(log, name))
    np.testing.assert_array_equal(again.roll_pitch_yaw_rad, log.roll_pitch_yaw_rad)


def test_channels_of_one_time_are_one_sample_in_time_order(tmp_path: Path) -> None:
    path = write(
        tmp_path / "two.mcap",
        [{"time_s": 2, "length_1_m": 3.0}, {"time_s": 1, "length_1_m": 2.0, "note": "x"}],
        [{"time_s": 1, "roll_rad": 0.5, "pitch_rad": None}, {"unrelated": 1}, [1, 2]],
    )
    log = load_log(path).log
    np.testing.assert_array_equal(log.time_s, [1, 2])
    np.testing.assert_array_equal(log.length_m, [[2], [3]])
    np.testing.assert_array_equal(log.roll_pitch_yaw_rad, [[0.5, np.nan, np.nan], [np.nan] * 3])


def test_a_cut_file_is_read_as_far_as_it_goes(log: cdprcal.Log, tmp_path: Path) -> None:
    whole = tmp_path / "log.mcap"
    save_log(log, whole)
    data = whole.read_bytes()
    path = tmp_path / "cut.mcap"
    for share in (0.3, 0.6, 0.9):
        path.write_bytes(data[: int(share * len(data))])
        file = load_log(path)
        assert [finding.code for finding in file.findings] == ["truncated"]
        count = len(file.log)
        assert 0.5 * share < count / len(log) <= 1
        np.testing.assert_array_equal(file.log.length_m, log.length_m[:count])


@pytest.mark.parametrize(
    ("messages", "words"),
    [
        ([], "no JSON messages"),
        ([{"other": 1}], "no JSON messages"),
        ([{"time_s": 0, "length_1_m": "abc"}], r"message 1 on /topic0: length_1_m: .* not 'abc'"),
        ([{"time_s": 0, "length_1_m": True}], "length_1_m"),
        ([{"length_1_m": 1.0}], r"message 1 on /topic0: time_s"),
        ([b"{"], "message 1: is not JSON"),
        ([b'{"time_s": 0, "length_1_m": 1e999}'], "length_1_m"),
    ],
)
def test_what_is_no_reading_is_refused(tmp_path: Path, messages: list[object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_log(write(tmp_path / "bad.mcap", messages))


def test_random_damage_never_escapes_as_another_exception(log: cdprcal.Log, tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    save_log(log, path)
    data = bytearray(path.read_bytes())
    random = np.random.default_rng(3)
    for _ in range(40):
        damaged = bytearray(data)
        for place in random.integers(8, len(data), size=5):
            damaged[place] = int(random.integers(256))
        path.write_bytes(damaged)
        try:
            load_log(path)
        except InputError:
            continue


def parsed(data: bytes) -> cdprcal.Log:
    from cdprcal.io.log_file import parse_log_bytes

    return parse_log_bytes(data, Path("any.mcap")).log


def test_very_many_channels_cost_no_more_than_their_number(tmp_path: Path) -> None:
    """A record of a channel before each sample: ten times as many take ten times as long."""
    took = []
    for count in (500, 5000):
        path = tmp_path / f"{count}.mcap"
        with path.open("wb") as stream:
            writer = Writer(stream, chunk_size=500)
            writer.start()
            schema = writer.register_schema("any", "jsonschema", b"{}")
            for number in range(count):
                channel = writer.register_channel(f"/{number}", "json", schema)
                data = json.dumps({"time_s": number / 8, "length_1_m": 1.0}).encode()
                writer.add_message(channel, number, data, number)
            writer.finish()  # type: ignore[no-untyped-call]
        begun = time.process_time()
        assert len(load_log(path).log) == count
        took.append(time.process_time() - begun)
    assert took[1] < 30.0 * took[0] + 0.1


def test_chunks_are_read_at_once_as_message_by_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Readings that are absent or null, in small chunks, some of which are not plain."""
    random = np.random.default_rng(4)
    path = tmp_path / "log.mcap"
    keys = [f"length_{i}_m" for i in range(1, 5)] + ["roll_rad", "position_x_m", "speed"]
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=2000)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        channels = [writer.register_channel(f"/{i}", "json", schema) for i in range(3)]
        for number in range(1000):
            sample: dict[str, object] = {"time_s": int(random.integers(300)) / 8}
            for key in random.permutation(keys)[: random.integers(len(keys) + 1)].tolist():
                values = [None, float(random.normal()), int(random.integers(9))]
                sample[key] = values[int(random.integers(3))]
            if number % 200 == 7:
                sample["note"] = "text that is no reading"
            data = json.dumps(sample).encode()
            writer.add_message(channels[int(random.integers(3))], number, data, number)
        writer.finish()  # type: ignore[no-untyped-call]
    data = path.read_bytes()
    counts = []
    at_once = cdprcal._core.plain_json_messages

    def counted(block: bytes, channels: list[int]) -> object:
        read = at_once(block, channels)
        counts.append(read is not None)
        return read

    monkeypatch.setattr("cdprcal._core.plain_json_messages", counted)
    fast = parsed(data)
    assert counts.count(True) > 20
    assert counts.count(False) >= 4  # beside the first, which is not tried
    monkeypatch.setattr("cdprcal._core.plain_json_messages", lambda block, channels: None)
    slow = parsed(data)
    for name in (*ARRAYS, "position_m"):
        np.testing.assert_array_equal(getattr(fast, name), getattr(slow, name))
    samples: dict[float, dict[str, float]] = {}
    for _, _, message in make_reader(path.open("rb")).iter_messages(log_time_order=False):
        read: dict[str, float] = json.loads(message.data)
        if read.keys() & set(keys[:-1]):
            samples.setdefault(read.pop("time_s"), {}).update(read)
    assert fast.time_s.tolist() == sorted(samples)
    wanted = [[samples[t].get(key) for key in keys[:4]] for t in sorted(samples)]
    np.testing.assert_array_equal(fast.length_m, np.array(wanted, dtype=float))


def test_a_wrong_message_is_counted_over_all_chunks(tmp_path: Path) -> None:
    good = [{"time_s": i, "length_1_m": 1.5} for i in range(200_000)]
    good[150_000] = {"time_s": 1, "length_1_m": "x"}  # type: ignore[dict-item]
    with pytest.raises(InputError, match="message 150001 on /topic0: length_1_m"):
        load_log(write(tmp_path / "long.mcap", good))  # type: ignore[arg-type]


def test_a_flipped_bit_is_noticed_and_what_was_before_it_is_kept(
    log: cdprcal.Log, tmp_path: Path
) -> None:
    path = tmp_path / "log.mcap"
    save_log(log, path)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0x10
    path.write_bytes(data)
    file = load_log(path)
    assert [finding.code for finding in file.findings] == ["truncated"]
    assert "is damaged" in file.findings[0].message
    count = len(file.log)
    assert 0.2 < count / len(log) < 0.6
    np.testing.assert_array_equal(file.log.length_m, log.length_m[:count])
