"""What ends the program from outside, from its first moment on."""

from __future__ import annotations

import os
import signal
import sys
from typing import Any, NoReturn

INTERRUPTED, TERMINATED = 130, 143


def watch() -> None:
    """To be called before anything else is loaded: Ctrl-C leaves at once, SIGTERM cleans up."""
    try:
        signal.signal(signal.SIGINT, _leave)
    except KeyboardInterrupt:  # it came before, and Python delivers it here
        _leave()
    signal.signal(signal.SIGTERM, _terminated)


def loaded() -> None:
    """To be called once modules are there: from here on Ctrl-C is KeyboardInterrupt.

    Raised inside of a module that is half loaded it would become anything.
    """
    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _leave(*_: Any) -> NoReturn:
    os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, b"cdprcal: interrupted\n")
    os._exit(INTERRUPTED)  # nothing was begun yet


def _terminated(*_: Any) -> NoReturn:
    """Leaves by an exception: what is half written is removed on the way."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    sys.exit(TERMINATED)
