"""Which files a command may write over: results that it can make again, and nothing else."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import Literal

from cdprcal._core import InputError
from cdprcal.io.files import begins_with, shown_path

Output = Literal[
    "log", "mapping file", "robot file", "result", "truth", "plan", "track", "page", "picture",
    "mesh", "settings",
]  # fmt: skip

#: What is written → the endings that its name may have. A log's say how it is written
#: (io.log_file), settings have one name.
ENDINGS: dict[Output, tuple[str, ...]] = {
    "mapping file": (".yaml", ".yml"),
    "robot file": (".yaml", ".yml"),
    "result": (".json",),
    "truth": (".json",),
    "plan": (".csv",),
    "track": (".csv",),
    "page": (".html", ".htm"),
    "picture": (".png", ".pdf", ".svg"),
    "mesh": (".ply", ".stl"),
}

#: What is written → how an earlier one begins, which may be replaced. Mapping files are edited by
#: hand, and a log looks like any other: none of them is.
_EARLIER: dict[Output, tuple[bytes, ...]] = {
    "log": (),
    "mapping file": (),
    "robot file": (b"# written by cdprcal ",),
    "result": (b'{\n  "status": ', b'{\n  "verdict": '),
    "truth": (b'{\n  "poses": ',),
    "plan": (b"# written by cdprcal ",),
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

#: How a plan begins below that line.
_PLAN = b"# cdprcal plan"

#: Who made a picture, in its own words: by them one is known that may be replaced.
MAKER = "cdprcal"
#: How PNG, PDF, SVG and pages say it.
_MADE_HERE = tuple(
    text.encode()
    for text in (
        f"Software\0{MAKER}",
        f"/Creator ({MAKER})",
        f"<dc:title>{MAKER}</dc:title>",
        f'<meta name="generator" content="{MAKER} ',
    )
)
#: So far from the beginning, or the end, it says it.
_NEAR_BYTES = 16384


#: What is opened by other programs, which go by its name's ending: it must have one.
_FOR_OTHERS: frozenset[Output] = frozenset({"page", "picture", "mesh"})


def check_ending(path: Path, *kinds: Output) -> None:
    """Raises InputError where a name's ending is that of none of these kinds.

    A device or pipe has none, nor need a name have one where only one form is written.
    """
    endings = {kind: ENDINGS[kind] for kind in kinds if kind in ENDINGS}
    known = not endings or any(path.suffix.lower() in one for one in endings.values())
    if known or _is_device(path) or (not path.suffix and not _FOR_OTHERS.intersection(kinds)):
        return
    names = "; ".join(f"a {kind} a name in {' or '.join(one)}" for kind, one in endings.items())
    raise InputError(f"{shown_path(path)}: its ending does not say what it is; give {names}")


def signed(text: str) -> str:
    """A robot file or plan as it is written: its first line tells whether anybody has edited it
    since."""
    digest = _digest(text.encode())
    return f"# written by cdprcal ({digest}); unless edited, the next replaces it\n{text}"


def may_replace(path: Path, kind: Output) -> bool:
    """Whether nothing is lost when this is written: no file is there, an empty one, or an earlier
    output of its kind, as it was written."""
    # A folder is refused where it is opened; a device keeps nothing.
    if not path.is_file() or not path.stat().st_size:
        return True
    if not begins_with(path, 100).startswith(_EARLIER[kind]):
        return False
    if kind in ("robot file", "plan"):
        line, _, text = path.read_bytes().partition(b"\n")
        same_kind = text.startswith(_PLAN) == (kind == "plan")
        return same_kind and f"({_digest(text)})".encode() in line
    return kind not in ("picture", "page") or _is_made_here(path)


def refuse_to_replace(path: Path, kind: Output) -> None:
    """Raises InputError naming the file unless it may be replaced."""
    try:
        if may_replace(path, kind):
            return
    except (OSError, ValueError):  # what is no name at all is refused where it is opened
        return
    other = f" and is no earlier {kind} as it was written" if _EARLIER[kind] else ""
    raise InputError(
        f"{shown_path(path)}: exists already{other}; give another name, or --force to replace it"
    )


def _is_device(path: Path) -> bool:
    try:
        return path.exists() and not path.is_file() and not path.is_dir()
    except (OSError, ValueError):  # what is no name at all is refused where it is opened
        return True


def _digest(text: bytes) -> str:
    return sha256(text).hexdigest()[:12]


def _is_made_here(path: Path) -> bool:
    with path.open("rb") as stream:
        begin = stream.read(_NEAR_BYTES)
        stream.seek(max(0, path.stat().st_size - _NEAR_BYTES))
        near = begin + stream.read()
    return any(maker in near for maker in _MADE_HERE)
