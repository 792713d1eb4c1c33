"""What becomes of exceptions that no command expects: one line, an exit code, never a traceback."""

from __future__ import annotations

import errno
import signal
import threading

import pytest
import typer

from cdprcal import InputError
from cdprcal.command import interruptible, reports_errors


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (InputError("run.csv:3: wrong"), 2, "run.csv:3: wrong"),
        (InputError("run.csv:\n 3\x1b[31m"), 2, "run.csv:  3 [31m"),
        (
            OSError(errno.ENOSPC, "No space left on device", "out.csv"),
            2,
            "out.csv: no space left on device; free some space, or give another path",
        ),
        (OSError(errno.EIO, "Input/output error"), 2, "output: input/output error; look at the"),
        (MemoryError(), 2, "not enough memory; close other programs, or ask for less"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (
            ZeroDivisionError("by zero"),
            1,
            "internal error (ZeroDivisionError: by zero); please report it, with what "
            "CDPRCAL_TRACEBACK=1 shows",
        ),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else None,
)
def test_an_exception_becomes_one_line(
    error: BaseException,
    code: int,
    said: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("CDPRCAL_TRACEBACK", raising=False)

    @reports_errors
    def command() -> None:
        raise error

    with pytest.raises(typer.Exit) as stop:
        command()
    assert stop.value.exit_code == code
    ran = capsys.readouterr()
    assert ran.out == ""
    assert ran.err.startswith(f"cdprcal: {said}")
    assert ran.err.count("\n") == 1


def test_an_unexpected_one_shows_where_it_comes_from_if_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("CDPRCAL_TRACEBACK", "1")

    @reports_errors
    def command() -> None:
        raise ZeroDivisionError("by zero")

    with pytest.raises(ZeroDivisionError, match="by zero"):
        command()


@pytest.mark.parametrize("kind", [typer.Exit, typer.Abort, typer.BadParameter])
def test_what_typer_means_goes_through(kind: type[Exception]) -> None:
    @reports_errors
    def command() -> None:
        raise kind("x")

    with pytest.raises(kind):
        command()


def test_ctrl_c_is_the_system_s_only_while_a_long_calculation_lasts() -> None:
    before = signal.getsignal(signal.SIGINT)
    with interruptible():
        assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
    assert signal.getsignal(signal.SIGINT) is before
    with pytest.raises(InputError), interruptible():
        raise InputError("wrong")
    assert signal.getsignal(signal.SIGINT) is before


def test_outside_of_the_main_thread_signals_are_left_alone() -> None:
    before = signal.getsignal(signal.SIGINT)
    seen = []

    def work() -> None:
        with interruptible():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before]
