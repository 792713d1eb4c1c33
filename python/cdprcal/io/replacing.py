"""Which files a command may write over: results that it can make again, and nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from cdprcal._core import InputError
from cdprcal.io.files import begins_with, shown_path

Output = Literal[
    "log", "mapping file", "robot file", "result", "truth", "plan", "track", "page", "picture",
    "mesh", "settings",
]  # fmt: skip

#: What is written → how an earlier one begins, which may be replaced. Mapping files are edited by
#: hand, none of them is; nor is a log that was acquired, or a robot file that somebody wrote, which
#: begin otherwise than what cdprcal itself makes of others.
_EARLIER: dict[Output, tuple[bytes, ...]] = {
    "log": (b"time_s,",),
    "mapping file": (),
    "robot file": (b'name: "',),
    "result": (b'{\n  "status": ', b'{\n  "verdict": '),
    "truth": (b'{\n  "poses": ',),
    "plan": (b"# cdprcal plan",),
    "track": (b"time_s,x_m,y_m,z_m,quaternion_w,",),
    "page": (b"<!doctype html>",),
    "picture": (b"\x89PNG\r\n", b"%PDF-", b"<?xml "),
    "mesh": (
        b"ply\nformat ascii 1.0\ncomment static workspace",
        b"ply\nformat binary_little_endian 1.0\ncomment static workspace",
        b"solid workspace",
        b"static workspace",
    ),
    "settings": (b'{"',),
}


def may_replace(path: Path, kind: Output) -> bool:
    """Whether nothing is lost when this is written: no file is there, an empty one, or an earlier
    output of its kind."""
    if not path.is_file():  # a folder is refused where it is opened; a device keeps nothing
        return True
    return not path.stat().st_size or begins_with(path, 100).startswith(_EARLIER[kind])


def refuse_to_replace(path: Path, kind: Output) -> None:
    """Raises InputError naming the file unless it may be replaced."""
    try:
        if may_replace(path, kind):
            return
    except (OSError, ValueError):  # what is no name at all is refused where it is opened
        return
    other = f" and is no earlier {kind}" if _EARLIER[kind] else ""
    raise InputError(
        f"{shown_path(path)}: exists already{other}; give another name, or --force to replace it"
    )
