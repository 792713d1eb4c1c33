"""Files as a whole: what is read is a plain file of bounded size, what is written is whole."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import os
import socket
import stat
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cdprcal import InputError
from cdprcal.io import load_log
from cdprcal.io.files import (
    atomic_output,
    begins_with,
    in_words,
    read_bytes,
    shown_path,
    shown_text,
    write_text,
)


def test_a_file_may_be_as_large_as_is_allowed_and_no_larger(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(bytes(1000))
    assert read_bytes(path, 1000) == bytes(1000)
    with pytest.raises(InputError, match="file: is over 999 bytes: give a file of the kind"):
        read_bytes(path, 999)
    # Files of the system do not say how large they are.
    assert read_bytes(Path("/proc/self/status")).startswith(b"Name:")
    with pytest.raises(InputError, match="status: is over 10 bytes"):
        read_bytes(Path("/proc/self/status"), 10)


@pytest.mark.parametrize("pack", [gzip.compress, lzma.compress, bz2.compress])
def test_a_packed_file_is_read_unpacked(
    tmp_path: Path, log_path: Path, pack: Callable[[bytes], bytes]
) -> None:
    path, content = tmp_path / "packed", log_path.read_bytes()
    path.write_bytes(pack(content))
    assert read_bytes(path) == content
    assert begins_with(path, 6, unpacked=True) == content[:6]
    assert np.array_equal(load_log(path).log.length_m, load_log(log_path).log.length_m)
    path.write_bytes(pack(content)[:-20])
    assert begins_with(path, 1 << 30, unpacked=True) == b""
    with pytest.raises(InputError, match="packed: is packed, but not whole; save it again"):
        load_log(path)
    path.write_bytes(pack(bytes(1 << 22)))
    with pytest.raises(InputError, match="packed: is over 1 MB"):
        read_bytes(path, 1 << 20)
    path.write_bytes(pack(b"\n" * 5_000_001))  # 200 bytes or so
    with pytest.raises(InputError, match="packed: has over 5 million lines"):
        load_log(path)


def test_a_file_of_another_kind_says_which_and_what_to_do(tmp_path: Path) -> None:
    archive, array = io.BytesIO(), io.BytesIO()
    with zipfile.ZipFile(archive, "w") as files:
        files.writestr("run.csv", "time_s,length_1_m\n")
    np.save(array, np.eye(3))
    for content, said in (
        (
            archive.getvalue(),
            r"run: cannot be read: is a ZIP archive, as .npz is; unpack it, or save",
        ),
        (
            array.getvalue(),
            r"run: cannot be read: is an array of NumPy; write it as text with numpy.savetxt$",
        ),
        (
            b"#ROSBAG V2.0\n",
            r"run: cannot be read: is a ROS 1 bag; turn it into a ROS 2 bag with rosbags-convert",
        ),
    ):
        (tmp_path / "run").write_bytes(content)
        with pytest.raises(InputError, match=said):
            load_log(tmp_path / "run")


def test_a_pipe_is_written_to_only_where_somebody_reads(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="pipe: cannot be written: is a pipe that nobody reads"):
        write_text(pipe, "never")
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_text(pipe, "read")
    assert os.read(reader, 10) == b"read"
    os.close(reader)
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


def test_what_is_no_plain_file_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # names of sockets are short
    os.mkfifo("pipe")
    os.symlink("loop", "loop")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        for name, words in (
            ("pipe", "pipe: cannot be read: is a pipe: save what comes out of it"),
            ("socket", "socket: cannot be read: is a socket"),
            (".", "is a directory; give the path of a file"),
            ("/dev/zero", "/dev/zero: cannot be read: is a device"),
            ("none", "none: cannot be read: no such file or directory; check the path"),
            ("loop", "loop: cannot be read: too many levels of symbolic links"),
            ("a\0b", "a\N{REPLACEMENT CHARACTER}b: cannot be read: no file's name holds NUL"),
        ):
            with pytest.raises(InputError) as told:
                read_bytes(Path(name))
            assert words in str(told.value)
            assert begins_with(Path(name), 10) == b""
    (tmp_path / "plain").write_bytes(b"abcdef")
    assert begins_with(tmp_path / "plain", 3) == b"abc"


def test_sizes_in_words() -> None:
    assert [in_words(n) for n in (12, 64 << 10, 256 << 20, 1 << 30)] == [
        "12 bytes",
        "64 kB",
        "256 MB",
        "1 GB",
    ]


def test_what_a_file_calls_itself_is_shown_on_one_short_line() -> None:
    assert shown_path("a\nb\x1b[31m\udc80") == "a\N{REPLACEMENT CHARACTER}b" + (
        "\N{REPLACEMENT CHARACTER}[31m?"
    )
    assert shown_text("sensor\n msgs\t/x") == "sensor msgs /x"
    assert shown_text("é" * 100) == "é" * 100
    assert shown_text("é" * 101) == "é" * 99 + "…"


def test_an_output_replaces_its_file_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "out.txt"
    path.write_text("old")
    path.chmod(0o640)

    def half_written() -> None:
        with atomic_output(path) as temporary:
            temporary.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        half_written()
    assert path.read_text() == "old"
    write_text(path, "new")
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert list(tmp_path.iterdir()) == [path]


def test_a_new_file_has_the_usual_permissions_and_a_link_stays_one(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_text(tmp_path / "target", "x")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "target").stat().st_mode) == 0o640
    (tmp_path / "link").symlink_to("target")
    write_text(tmp_path / "link", "y")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == "y"


def test_a_device_is_written_to_and_never_replaced() -> None:
    write_text(Path("/dev/null"), "gone")
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)
    with pytest.raises(InputError, match="/dev/full: cannot be written: no space left on device"):
        write_text(Path("/dev/full"), "x" * 100_000)
    assert stat.S_ISCHR(Path("/dev/full").stat().st_mode)


def test_where_nothing_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "loop").symlink_to("loop")
    for path, words in (
        (tmp_path, "is a directory; give the path of a file"),
        (tmp_path / "none" / "out", "no such file or directory; check the path"),
        (tmp_path / "file" / "out", "not a directory; check the path"),
        (tmp_path / "loop" / "out", "too many levels of symbolic links"),
        (tmp_path / "a\0b", "no file's name holds NUL bytes"),
    ):
        with pytest.raises(InputError, match=f"cannot be written: .*{words}"):
            write_text(path, "x")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "loop"]
