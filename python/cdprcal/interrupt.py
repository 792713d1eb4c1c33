"""What ends the program from outside, from its first moment on."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from typing import Any, NoReturn

INTERRUPTED = 130
SIGNALLED = 128  # and the number of the signal: what shells say of who died of it


def watch() -> None:
    """To be called before anything else is loaded: until ``loaded``, Ctrl-C, SIGTERM and SIGHUP
    leave at once."""
    try:
        signal.signal(signal.SIGINT, _leave)
    except KeyboardInterrupt:  # it came before, and Python delivers it here
        _leave()
    for number in _polite():
        signal.signal(number, _leave_quietly)


def stopping() -> tuple[signal.Signals, ...]:
    """The signals that ask to stop: Ctrl-C, SIGTERM and, of a terminal that was closed, SIGHUP.

    SIGHUP only where the platform has it and nobody (``nohup``) said that it is to be ignored.
    """
    return (signal.SIGINT, *_polite())


def _polite() -> tuple[signal.Signals, ...]:
    hang_up: signal.Signals | None = getattr(signal, "SIGHUP", None)
    heard = hang_up is not None and signal.getsignal(hang_up) != signal.SIG_IGN
    return (signal.SIGTERM, hang_up) if hang_up is not None and heard else (signal.SIGTERM,)


def loaded() -> None:
    """To be called once modules are there: from here on Ctrl-C is KeyboardInterrupt, and SIGTERM
    and SIGHUP clean up by SystemExit.

    Raised inside of a module that is half loaded they would become anything.
    """
    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in _polite():
        if signal.getsignal(number) is _leave_quietly:
            signal.signal(number, _terminated)


def _leave(*_: Any) -> NoReturn:
    with contextlib.suppress(OSError):  # nobody may be there to read it
        os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, b"cdprcal: interrupted\n")
    os._exit(INTERRUPTED)  # nothing was begun yet


def _leave_quietly(number: int, _: Any) -> NoReturn:
    os._exit(SIGNALLED + number)  # nothing was begun yet


def _terminated(number: int, _: Any) -> NoReturn:
    """Leaves by an exception: what is half written is removed on the way."""
    for name in _polite():
        signal.signal(name, signal.SIG_IGN)
    sys.exit(SIGNALLED + number)
