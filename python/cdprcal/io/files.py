"""Files as a whole: read at once, written all or nothing."""

from __future__ import annotations

import bz2
import errno
import gzip
import lzma
import os
import shutil
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, cast

from cdprcal._core import InputError

#: More than any log, plan or result: 11 hours of an eight-cable robot at 100 Hz.
MOST_BYTES = 1 << 30
#: 13 hours of samples at 100 Hz; a day of a four-cable robot's raw log at 10 Hz.
MOST_LINES = 5_000_000
_KINDS = (
    (stat.S_ISDIR, "is a directory; give the path of a file"),
    (stat.S_ISFIFO, "is a pipe: save what comes out of it to a file first"),
    (stat.S_ISCHR, "is a device; give the path of a file"),
    (stat.S_ISBLK, "is a device; give the path of a file"),
    (stat.S_ISSOCK, "is a socket; give the path of a file"),
)
#: How a file begins that holds another one, packed → what unpacks it while it is read.
_PACKED: dict[bytes, Callable[..., Any]] = {
    b"\x1f\x8b": gzip.open,
    b"\xfd7zXZ\0": lzma.open,
    b"BZh": bz2.open,
}
_ZIP = b"PK\3\4"
_WORKBOOK = "is an Excel workbook; save the sheet as CSV"
#: How files begin that hold no log which could be read, what they are, and what to do.
_FOREIGN = {
    _ZIP: "is a ZIP archive, as .npz is; unpack it, or save what it holds as CSV",
    b"\x93NUMPY": "is an array of NumPy; write it as text with numpy.savetxt",
    b"\xd0\xcf\x11\xe0": "is an old Excel workbook; save it as .xlsx, or the sheet as CSV",
    b"\x28\xb5\x2f\xfd": "is packed by zstd; unpack it",
    b"7z\xbc\xaf": "is a 7z archive; unpack it",
    b"#ROSBAG": "is a ROS 1 bag; turn it into a ROS 2 bag with rosbags-convert",
}
#: What unpacking a file that is cut or damaged ends with.
_DAMAGE = (gzip.BadGzipFile, lzma.LZMAError, zlib.error, EOFError)


def read_bytes(path: Path, most: int = MOST_BYTES) -> bytes:
    """The file's content, unpacked (gzip, xz, bzip2). Raises InputError naming the file when it
    cannot be read.

    Also for what is no plain file, since that may never end, and for more than ``most`` bytes.
    """
    shown = shown_path(path)
    try:
        if shown == "-" and not path.exists():
            raise InputError("-: nothing is read from stdin; save it to a file, and give its name")
        if why := not_a_file(path):
            raise InputError(f"{shown}: cannot be read: {why}")
        with path.open("rb") as stream:
            size = os.fstat(stream.fileno()).st_size
            # What is read is allocated first; some files of the system do not know their size.
            data = b"" if size > most else stream.read(max(size, 1 << 16) + 1)
        why = next((_FOREIGN[magic] for magic in _FOREIGN if data.startswith(magic)), "")
        if why and is_workbook(path):
            why = _WORKBOOK
        if why:
            raise InputError(f"{shown}: cannot be read: {why}")
        if _opener(data) is not open:
            with _unpacked(path) as stream:
                data = b"".join(_blocks(stream, most))
    except _DAMAGE:
        raise InputError(f"{shown}: is packed, but not whole; save it again") from None
    except OSError as error:
        raise InputError(f"{shown}: cannot be read: {reason(error)}") from None
    except InputError:
        raise
    except ValueError:
        raise InputError(
            f"{shown}: cannot be read: no file's name holds NUL bytes; check the path"
        ) from None
    if max(size, len(data)) > most:
        raise InputError(
            f"{shown}: is over {in_words(most)}: give a file of the kind that is meant"
        )
    return data


def read_utf_8(path: Path, most: int = MOST_BYTES) -> str:
    """A text as read_bytes reads it; what is no UTF-8 in it is replaced. Raises InputError also for
    UTF-16, of which nothing would be left."""
    data = read_bytes(path, most)
    refuse_utf_16(data, path)
    return data.decode("utf-8", "replace")


def refuse_utf_16(data: bytes, path: Path) -> None:
    """Raises InputError for text that begins as UTF-16 does, as editors mark it."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError(f"{shown_path(path)}:1: is UTF-16 text; save it as UTF-8")


def refuse_many_lines(path: Path) -> None:
    """Raises InputError for a file of more lines than a log has, before all of it is in memory.

    What is no plain file, or cannot be read, is left to read_bytes and its messages.
    """
    lines = 0
    try:
        if not_a_file(path):
            return
        if path.stat().st_size <= MOST_LINES and _opener(begins_with(path, 8)) is open:
            return
        with _unpacked(path) as stream:
            for block in _blocks(stream, MOST_BYTES):
                lines += block.count(b"\n")
                if lines > MOST_LINES:
                    break
    except (OSError, ValueError, *_DAMAGE):
        return
    if lines > MOST_LINES:
        raise InputError(
            f"{shown_path(path)}: has over {MOST_LINES // 1_000_000} million lines: split it, or "
            "log at a lower rate"
        )


def not_a_file(path: Path) -> str:
    """Why something that is there is no plain file; empty when it is one. Raises OSError."""
    mode = path.stat().st_mode
    return next((words for is_kind, words in _KINDS if is_kind(mode)), "")


def begins_with(path: Path, count: int, *, unpacked: bool = False) -> bytes:
    """The first bytes of a plain file, ``unpacked`` those of what it holds; none when there is no
    such file or it cannot be read."""
    try:
        if not_a_file(path):
            return b""
        with _unpacked(path) if unpacked else path.open("rb") as stream:
            return stream.read(count)
    except (OSError, ValueError, *_DAMAGE):
        return b""


def is_workbook(path: Path) -> bool:
    """Whether a file is an Excel workbook (.xlsx)."""
    if begins_with(path, len(_ZIP)) != _ZIP:
        return False
    try:
        with zipfile.ZipFile(path) as held:
            return "xl/workbook.xml" in held.namelist()
    except (OSError, ValueError, zipfile.BadZipFile):
        return False


def is_foreign(head: bytes) -> bool:
    """Whether a file that begins so is of a kind that nothing here reads."""
    return head.startswith(tuple(_FOREIGN))


def _opener(head: bytes) -> Callable[..., Any]:
    """What opens a file that begins so and unpacks it."""
    return next((opens for magic, opens in _PACKED.items() if head.startswith(magic)), open)


def _unpacked(path: Path) -> BinaryIO:
    """A file for reading what it holds."""
    return cast(BinaryIO, _opener(begins_with(path, 8))(path, "rb"))


def _blocks(stream: BinaryIO, most: int) -> Iterator[bytes]:
    """What is left of a stream, up to somewhat more than ``most`` bytes."""
    while most >= 0 and (block := stream.read(1 << 20)):
        most -= len(block)
        yield block


def in_words(count: int) -> str:
    """'64 kB', '256 MB', '1 GB'."""
    for size, unit in ((1 << 30, "GB"), (1 << 20, "MB"), (1 << 10, "kB")):
        if count >= size:
            return f"{count // size} {unit}"
    return f"{count} bytes"


def shown_path(path: str | Path) -> str:
    """The path as messages show it: valid UTF-8 on one line."""
    text = str(path).encode("utf-8", "replace").decode()
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


def shown_text(text: str, most: int = 100) -> str:
    """A name or message out of a file as messages show it: one line, no longer than ``most``."""
    line = shown_path(" ".join(text.split()))
    return line if len(line) <= most else f"{line[: most - 1]}…"


@contextmanager
def atomic_output(path: Path) -> Iterator[Path]:
    """Yields a temporary path beside ``path`` that becomes ``path`` when the block succeeds.

    When it fails, an older file of that name is untouched and nothing new is left behind. A
    symbolic link stays one; a device (/dev/null) or a pipe (/dev/stdout) is written to, never
    replaced.
    Raises InputError naming the file when it cannot be written.
    """
    shown = shown_path(path)
    try:
        # Before links are followed: /dev/stdout is one to no path where it is a pipe.
        device = path.exists() and not path.is_file() and not path.is_dir()
        path = path if device else path.resolve()
        folder = None if device else path.parent
        handle, name = tempfile.mkstemp(
            dir=folder, prefix=f".{path.name[:50]}.", suffix=path.suffix[:50]
        )
        os.close(handle)
    except (OSError, RuntimeError) as error:
        raise InputError(f"{shown}: cannot be written: {reason(error)}") from None
    except ValueError:
        raise InputError(
            f"{shown}: cannot be written: no file's name holds NUL bytes; check the path"
        ) from None
    temporary = Path(name)
    try:
        if path.is_dir():
            raise InputError(f"{shown}: cannot be written: is a directory; give the path of a file")
        yield temporary
        if device:
            with temporary.open("rb") as source, _opened(path) as sink:
                shutil.copyfileobj(source, sink)
        else:
            temporary.chmod(_usual_mode(path))
            temporary.replace(path)
    except OSError as error:
        raise InputError(f"{shown}: cannot be written: {reason(error)}") from None
    finally:
        temporary.unlink(missing_ok=True)


class _AbandonedError(Exception):
    """Ends the writing of a file that is not meant yet."""


def refuse_unwritable(path: Path) -> None:
    """Raises InputError naming the file where atomic_output would: asked before a long run, at
    whose end the file is written."""
    with suppress(_AbandonedError), atomic_output(path):
        raise _AbandonedError


def _opened(device: Path) -> BinaryIO:
    """What is no plain file, for writing; a pipe that nobody reads would wait for ever."""
    pipe = stat.S_ISFIFO(device.stat().st_mode)
    try:
        handle = os.open(device, os.O_WRONLY | (os.O_NONBLOCK if pipe else 0))
    except OSError as error:
        if pipe and error.errno == errno.ENXIO:
            raise InputError(
                f"{shown_path(device)}: cannot be written: is a pipe that nobody reads; start its "
                "reader first, or give the path of a file"
            ) from None
        raise
    os.set_blocking(handle, True)
    return os.fdopen(handle, "wb")


def write_text(path: Path, text: str) -> None:
    """Writes ``text`` as UTF-8, all or nothing."""
    with atomic_output(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_texts(texts: Mapping[Path, str]) -> None:
    """As write_text, for several files: none is replaced before all are written."""
    with ExitStack() as files:
        for path, text in texts.items():
            files.enter_context(atomic_output(path)).write_text(text, encoding="utf-8")


def make_folder(path: Path) -> None:
    """Makes a folder that need not be there yet. Raises InputError naming it."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be made: {reason(error)}") from None


#: What to do about what the system says.
_REMEDIES = {
    errno.ENOENT: "check the path",
    errno.ENOTDIR: "check the path",
    errno.EISDIR: "give the path of a file",
    errno.EEXIST: "give another name",
    errno.ENAMETOOLONG: "give a shorter name",
    errno.EACCES: "change its permissions, or give another path",
    errno.EPERM: "change its permissions, or give another path",
    errno.EROFS: "give another path",
    errno.ENOSPC: "free some space, or give another path",
    errno.EDQUOT: "free some space, or give another path",
    errno.EIO: "look at the disk",
    errno.EPIPE: "see why its reader ended",
}


def reason(error: OSError | RuntimeError) -> str:
    """Why, in the system's words and without the number; and what to do, where that is known."""
    if isinstance(error, RuntimeError):  # pathlib's word for a loop
        return "too many levels of symbolic links; check the path"
    why = (error.strerror or str(error)).lower()
    remedy = _REMEDIES.get(error.errno or 0)
    return f"{why}; {remedy}" if remedy else why


def _usual_mode(path: Path) -> int:
    """Permissions of the file that is replaced, or those that a new file gets."""
    try:
        return path.stat().st_mode & 0o777
    except OSError:
        umask = os.umask(0)
        os.umask(umask)
        return 0o666 & ~umask
