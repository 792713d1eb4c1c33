"""What is no plain file: folders, pipes, devices, loops, names that no file can have.

Wherever a file is named, by every command that reads one.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from malformed.case import Case, Valid


def _path(name: str, words: str, place: Callable[[Path, Valid], Path]) -> Case:
    return Case("path", name, words=words, place=place)


def _done(path: Path, action: Callable[[Path], object]) -> Path:
    action(path)
    return path


def _loop(path: Path) -> None:
    other = path.with_name("other")
    other.symlink_to(path)
    path.symlink_to(other)


def _locked(path: Path) -> None:
    path.write_bytes(b"x")
    path.chmod(0)


def _socket(path: Path) -> None:
    import socket

    before = Path.cwd()
    os.chdir(path.parent)  # an address must be short
    try:
        with socket.socket(socket.AF_UNIX) as here:
            here.bind(path.name)
    finally:
        os.chdir(before)


NONE = "no such file|neither a file nor a built-in robot"

CASES = (
    _path("absent", NONE, lambda path, valid: path),
    _path("a folder", "directory|folder", lambda path, valid: _done(path, Path.mkdir)),
    _path("a pipe", "pipe", lambda path, valid: _done(path, os.mkfifo)),
    _path("a socket", "is a socket|no such device", lambda path, valid: _done(path, _socket)),
    _path("a loop of links", NONE + "|too many levels", lambda path, valid: _done(path, _loop)),
    _path(
        "a link to nothing", NONE, lambda path, valid: _done(path, lambda p: p.symlink_to("gone"))
    ),
    _path("no permission", "permission", lambda path, valid: _done(path, _locked)),
    _path("an endless device", "device", lambda path, valid: Path("/dev/zero")),
    _path("a terminal's name", "device|no such", lambda path, valid: Path("/dev/tty")),
    _path(
        "memory of this process",
        "cannot be read|cannot be opened|failing|empty|not",
        lambda path, valid: Path("/proc/self/mem"),
    ),
    _path(
        "a name too long", NONE + "|name too long", lambda path, valid: path.with_name("x" * 300)
    ),
    _path("a path too long", NONE + "|name too long", lambda path, valid: Path("/x" * 3000)),
    _path(
        "below a file",
        NONE + "|not a directory",
        lambda path, valid: _done(path, lambda p: p.write_bytes(b"x")) / "below",
    ),
    _path("a line end in the name", NONE, lambda path, valid: Path(f"{path}\nx")),
    _path(
        "a name that is not UTF-8",
        NONE,
        lambda path, valid: Path(os.fsdecode(os.fsencode(path) + b"\xff")),
    ),
    _path("nothing", NONE + "|is a directory|is a folder", lambda path, valid: Path("")),
)
