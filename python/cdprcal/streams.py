"""stdout and stderr that are closed, full, or left by who read them: the work goes on.

Notes on stderr that cannot be written are given up. Answers on stdout that cannot be are missed at
the end, when everything else is done: an exit code says so.
"""

from __future__ import annotations

import io
import os
import sys
from typing import Any, TextIO

from cdprcal.interrupt import SIGNALLED

_SIGPIPE = 13
#: What shells say of who wrote into a pipe that nobody read any more.
LEFT = SIGNALLED + _SIGPIPE
NOT_WRITTEN = 2


class _Patient(io.RawIOBase):
    """A stream that takes everything: its first failure is kept, and nothing written after it."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream  # which closes its binary one when nobody holds it
        binary: Any = stream.buffer
        self._raw = getattr(binary, "raw", binary)  # unbuffered (python -u) it is that itself
        self.failure: OSError | None = None

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        number: int = self._raw.fileno()
        return number

    def isatty(self) -> bool:
        yes: bool = self._raw.isatty()
        return yes

    def write(self, data: Any) -> int:
        if self.failure is None:
            try:
                written: int | None = self._raw.write(data)
                if written is not None:
                    return written
                self.failure = BlockingIOError()  # it does not block, and is full
            except OSError as error:
                self.failure = error
        return len(data)


def watch() -> None:
    """To be called before anything is written. What is closed becomes /dev/null.

    Else the first file that is opened would take its number, and what is printed.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            setattr(sys, name, open(number, "w" if number else "r", closefd=False))  # noqa: SIM115
    sys.stdout = _patient(sys.stdout)
    sys.stderr = _patient(sys.stderr)


def leave_stdout() -> None:
    """To be called where a file is written to stdout: what is answered beside it goes to stderr."""
    sys.stdout.flush()
    sys.stdout = sys.stderr


def _patient(stream: TextIO) -> TextIO:
    stream.flush()
    return io.TextIOWrapper(
        io.BufferedWriter(_Patient(stream)),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=bool(stream.line_buffering or getattr(stream, "write_through", False)),
    )


def exit_code(code: Any) -> Any:
    """That of a command which ends with ``code``, by what became of its answer."""
    sys.stdout.flush()
    failure = getattr(getattr(sys.stdout.buffer, "raw", None), "failure", None)
    if failure is None:
        return code
    if isinstance(failure, BrokenPipeError):
        return LEFT
    why = (failure.strerror or "it blocks").lower()
    sys.stderr.write(f"cdprcal: output: cannot be written: {why}; give it another place\n")
    return NOT_WRITTEN
