"""ROS 2 bags: single files of MCAP and SQLite, and folders with their metadata."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from malformed.case import Case, Change, Valid, cut, flip, only, sub, swap
from malformed.mcap_logs import chunk, zeros_packed


def _bag(name: str, change: Change, words: str, base: str = "") -> Case:
    return Case("bag", name, change, words, base)


def _folder(
    name: str, edit: Callable[[Path, Valid], None], words: str, source: str = "bag"
) -> Case:
    """A folder that was a bag."""

    def place(path: Path, valid: Valid) -> Path:
        target = path.with_name("case_bag")
        shutil.copytree(valid.folder / source, target)
        edit(target, valid)
        return target

    return Case("bag", name, words=words, place=place)


def _metadata(change: Change) -> Callable[[Path, Valid], None]:
    def edit(folder: Path, valid: Valid) -> None:
        path = folder / "metadata.yaml"
        before = path.read_bytes()
        after = change(before)
        assert after != before
        path.write_bytes(after)

    return edit


def _outside(folder: Path, valid: Valid) -> None:
    """The metadata names a file beside the bag."""
    shutil.move(folder / "bag.mcap", folder.parent / "outside.mcap")
    _metadata(lambda data: data.replace(b"bag.mcap", b"../outside.mcap"))(folder, valid)


def _unchecked(change: Change) -> Change:
    """A change that no checksum gives away: that of a bag's one chunk is taken out."""

    def edit(data: bytes) -> bytes:
        at = 17 + data[9] + 9 + 24  # magic, header, the chunk's opcode, size, times and size
        return change(data[:at] + bytes(4) + data[at + 4 :])

    return edit


def _bomb(kind: str, says: int = 1 << 30) -> Change:
    """A bag's header, and a gigabyte of zeros in one chunk."""

    def edit(data: bytes) -> bytes:
        return data[: 17 + data[9]] + chunk(kind.encode(), says, zeros_packed(kind))[8:]

    return edit


def _message_bomb(data: bytes) -> bytes:
    """The joint states of a bag that packs each message by itself."""
    import sqlite3

    database = sqlite3.connect(":memory:")
    database.deserialize(data)
    database.execute("update messages set data = ? where id < 9", (zeros_packed("zstd"),))
    database.commit()
    after: bytes = database.serialize()
    return after


def _file_bomb(path: Path, valid: Valid) -> Path:
    """A bag whose one file is packed as a whole."""
    target = path.with_name("case_bag")
    target.mkdir()
    metadata = (valid.folder / "bag" / "metadata.yaml").read_bytes()
    (target / "metadata.yaml").write_bytes(metadata.replace(b"bag.mcap", b"bag.mcap.zstd"))
    (target / "bag.mcap.zstd").write_bytes(zeros_packed("zstd"))
    return target


WRONG = "no whole ROS 2 bag|cannot be read|no sensor_msgs"

CASES = (
    _bag("cut in the header", lambda data: data[:40], WRONG),
    _bag("cut in the middle", cut(0.5), WRONG),
    _bag("cut in the footer", lambda data: data[:-20], WRONG),
    _bag(
        "a list of 2^31 names",
        _unchecked(
            lambda data: data.replace(
                b"\x08\0\0\0\x08\0\0\0cable_1", b"\xff\xff\xff\x7f\x08\0\0\0cable_1"
            )
        ),
        WRONG,
    ),
    _bag(
        "a name of 2^31 letters",
        _unchecked(lambda data: data.replace(b"\x08\0\0\0cable_1", b"\xff\xff\xff\x7fcable_1")),
        WRONG,
    ),
    _bag(
        "joint states of another type",
        _unchecked(
            lambda data: data.replace(b"sensor_msgs/msg/JointState", b"sensor_msgs/msg/JointStatE")
        ),
        "/joint_states is sensor_msgs/msg/JointStatE",
    ),
    _bag(
        "no joint states",
        _unchecked(lambda data: data.replace(b"/joint_states", b"/joint_statez")),
        "no sensor_msgs/JointState|no .*JointState",
    ),
    _bag(
        "other joints",
        _unchecked(lambda data: data.replace(b"cable_1", b"kable_1")),
        "not cable_1",
    ),
    _bag("a flipped bit", flip(0.4, 1), "the checksum of a chunk"),
    _bag(
        "a type of two lines",
        _unchecked(
            lambda data: data.replace(b"sensor_msgs/msg/JointState", b"sensor\nmsgs/msg/JointState")
        ),
        "is sensor msgs/msg/JointState, and must be",
    ),
    *(
        Case("bag", f"a gigabyte in {kind}", _bomb(kind), "no whole ROS 2 bag.*large", big=True)
        for kind in ("zstd", "lz4")
    ),
    *(
        Case(
            "bag",
            f"a gigabyte in {kind} that says 1 MB",
            _bomb(kind, 1 << 20),
            "no whole ROS 2 bag.*another size",
            big=True,
        )
        for kind in ("zstd", "lz4")
    ),
    Case("bag", "a message of a gigabyte", _message_bomb, "more than any log", "sqlite", big=True),
    Case("bag", "a file of a gigabyte", words="far more than any log", place=_file_bomb, big=True),
    _bag("SQLite's magic alone", only(b"SQLite format 3\0"), WRONG),
    _bag("SQLite cut", cut(0.5), WRONG, "sqlite"),
    _bag("SQLite, a table renamed", swap("messages", "massages", 99), WRONG, "sqlite"),
    _bag("SQLite of something else", lambda data: _other_database(), WRONG),
    _bag(
        "SQLite, joints renamed",
        lambda data: data.replace(b"cable_1", b"kable_1"),
        "not cable_1",
        "sqlite",
    ),
    _folder("metadata empty", _metadata(only(b"")), WRONG),
    _folder("metadata is a list", _metadata(only(b"- 1\n")), WRONG),
    _folder("metadata is no YAML", _metadata(only(b"a: [")), WRONG),
    _folder("metadata of version 99", _metadata(sub(r"version: \d+", "version: 99")), WRONG),
    _folder("metadata names another file", _metadata(swap("bag.mcap", "gone.mcap", 9)), WRONG),
    _folder("metadata names a file outside", _outside, "missing"),
    _folder("metadata names /etc/passwd", _metadata(swap("bag.mcap", "/etc/passwd", 9)), "missing"),
    _folder(
        "metadata of another storage",
        _metadata(swap("storage_identifier: mcap", "storage_identifier: tape")),
        WRONG,
    ),
    _folder("metadata without files", _metadata(swap("relative_file_paths", "files")), WRONG),
    _folder(
        "metadata with aliases of aliases",
        _metadata(
            lambda data: (
                data
                + "\n".join(
                    [
                        "a0: &a0 [1, 1]",
                        *(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]" for i in range(1, 40)),
                    ]
                )
                .encode()
                .replace(b"a0", b"b0", 0)
                + b"\n["
            )
        ),
        WRONG,
    ),
    _folder("metadata cut", _metadata(cut(0.4)), WRONG),
    _folder("data lost", lambda folder, valid: (folder / "bag.mcap").unlink(), WRONG),
    _folder("data empty", lambda folder, valid: _emptied(folder / "bag.mcap"), WRONG),
    _folder("SQLite lost", lambda folder, valid: (folder / "sqlite.db3").unlink(), WRONG, "sqlite"),
    _folder(
        "no metadata",
        lambda folder, valid: (folder / "metadata.yaml").unlink(),
        "is a directory|folder",
    ),
)


def _emptied(path: Path) -> None:
    path.write_bytes(b"")


def _other_database() -> bytes:
    import sqlite3

    database = sqlite3.connect(":memory:")
    database.execute("create table messages (id integer primary key, words text)")
    database.execute("insert into messages (words) values ('nothing')")
    database.commit()
    data: bytes = database.serialize()
    return data
