"""ROS 2 bags: single files of MCAP and SQLite, and folders with their metadata."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from malformed.case import Case, Change, Valid, cut, only, sub, swap


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


WRONG = "no whole ROS 2 bag|cannot be read|no sensor_msgs"

CASES = (
    _bag("cut in the header", lambda data: data[:40], WRONG),
    _bag("cut in the middle", cut(0.5), WRONG),
    _bag("cut in the footer", lambda data: data[:-20], WRONG),
    _bag(
        "a list of 2^31 names",
        lambda data: data.replace(
            b"\x08\0\0\0\x08\0\0\0cable_1", b"\xff\xff\xff\x7f\x08\0\0\0cable_1"
        ),
        WRONG,
    ),
    _bag(
        "a name of 2^31 letters",
        lambda data: data.replace(b"\x08\0\0\0cable_1", b"\xff\xff\xff\x7fcable_1"),
        WRONG,
    ),
    _bag(
        "joint states of another type",
        lambda data: data.replace(b"sensor_msgs/msg/JointState", b"sensor_msgs/msg/JointStatE"),
        WRONG + "|is sensor",
    ),
    _bag(
        "no joint states",
        lambda data: data.replace(b"/joint_states", b"/joint_statez"),
        "no sensor_msgs/JointState|no .*JointState",
    ),
    _bag("other joints", lambda data: data.replace(b"cable_1", b"kable_1"), "not cable_1"),
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
