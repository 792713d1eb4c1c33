"""Files as a whole: read at once, written all or nothing."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cdprcal._core import InputError


def read_bytes(path: Path) -> bytes:
    """The file's content. Raises InputError naming the file when it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {reason(error)}") from None


@contextmanager
def atomic_output(path: Path) -> Iterator[Path]:
    """Yields a temporary path beside ``path`` that becomes ``path`` when the block succeeds.

    When it fails, an older file of that name is untouched and nothing new is left behind.
    Raises InputError naming the file when it cannot be written.
    """
    try:
        handle, name = tempfile.mkstemp(
            dir=path.parent, prefix=f".{path.name[:100]}.", suffix=path.suffix
        )
        os.close(handle)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {reason(error)}") from None
    temporary = Path(name)
    try:
        if path.is_dir():
            raise InputError(f"{path}: cannot be written: is a directory; give the path of a file")
        yield temporary
        temporary.chmod(_usual_mode(path))
        temporary.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {reason(error)}") from None
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes ``text`` as UTF-8, all or nothing."""
    with atomic_output(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


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
}


def reason(error: OSError) -> str:
    """Why, in the system's words and without the number; and what to do, where that is known."""
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
