"""What every command shares: errors as one message, exit codes, JSON alone on stdout."""

from __future__ import annotations

import functools
import os
import signal
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, ParamSpec, TypeVar

import typer

from cdprcal.completion import effect_file_names, robot_names
from cdprcal.interrupt import INTERRUPTED as INTERRUPTED
from cdprcal.interrupt import loaded, stopping
from cdprcal.letters import readable
from cdprcal.streams import leave_stdout

if TYPE_CHECKING:
    from cdprcal import _core
    from cdprcal.io.replacing import Output

#: Names of stdout as a file.
_STDOUT = ("/dev/stdout", "/dev/fd/1", "/proc/self/fd/1")

DONE, UNTRUSTED, WRONG_USE, WITH_CAVEATS = 0, 1, 2, 3

P = ParamSpec("P")
R = TypeVar("R")

RobotArgument = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT",
        help="Robot file (YAML) or built-in name (irma4, ring3, ring5, posts8, belts4, hang4).",
        autocompletion=robot_names,
    ),
]
LogArgument = Annotated[
    str,
    typer.Argument(
        metavar="LOG", help="Canonical CSV, MCAP or raw robot log, told apart by content."
    ),
]
LogOutputOption = Annotated[
    str,
    typer.Option(
        "-o",
        "--output",
        metavar="LOG",
        help="Canonical log: MCAP as .mcap, CSV as .csv or any ending of plain text (.txt, .dat, "
        ".log).",
    ),
]
MapOption = Annotated[
    str,
    typer.Option(
        "--map",
        metavar="FILE",
        help="Mapping file: which columns of a file of your own are what (cdprcal check RAW "
        "--propose FILE writes one). For CSV of any kind, JSON, Excel, MAT, HDF5, Parquet, "
        "Feather, MCAP, ROS 2 bags.",
    ),
]
EffectsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--effects",
        metavar="FILE",
        autocompletion=effect_file_names,
        help="Effects of your own, written as formulas (YAML; see the docs, extend: a formula), "
        "beside those of the robot file; or more: those that come with cdprcal. May be repeated.",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON, alone on stdout.")]
VerboseOption = Annotated[
    bool, typer.Option("--verbose", "-v", help="Also what is summed up or left out otherwise.")
]
ForceOption = Annotated[
    bool,
    typer.Option("--force", help="Write over files that are there already; never over an input."),
]
SegmentOption = Annotated[
    int, typer.Option("--segment", help="Which segment is the run, from 0; -1 is the last.")
]


def reports_errors(command: Callable[P, R]) -> Callable[P, R]:
    """Turns every exception into one message on stderr and an exit code, never a traceback.

    With CDPRCAL_TRACEBACK set, an unexpected one shows where it comes from.
    """

    @functools.wraps(command)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
        import cdprcal._core  # noqa: F401

        loaded()
        try:
            return command(*args, **kwargs)
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except KeyboardInterrupt:
            fail("interrupted", INTERRUPTED)
        except Exception as error:
            _fail_with(error)

    return wrapper


@contextmanager
def interruptible() -> Iterator[None]:
    """Around a long calculation in C++ that cannot ask Python: Ctrl-C, SIGTERM or SIGHUP
    ends the process at once.

    Only where no file is open: nothing is left half written.
    """
    before: dict[signal.Signals, Any] = {}
    try:
        for name in stopping():
            before[name] = signal.signal(name, signal.SIG_DFL)
    except ValueError:  # not the main thread: signals are not ours
        yield
        return
    try:
        yield
    finally:
        for name, handler in before.items():
            signal.signal(name, handler)


def _fail_with(error: Exception) -> NoReturn:
    from cdprcal._core import InputError
    from cdprcal.io.files import reason

    if isinstance(error, InputError):
        fail(str(error))
    if isinstance(error, OSError):
        fail(f"{error.filename or 'output'}: {reason(error)}")
    if isinstance(error, ModuleNotFoundError) and error.name:
        from cdprcal.extras import EXTRAS, missing

        if (module := error.name.partition(".")[0]) in EXTRAS:
            fail(missing(module))
    if isinstance(error, MemoryError):
        fail("not enough memory; close other programs, or ask for less: coarser, fewer, shorter")
    if os.environ.get("CDPRCAL_TRACEBACK"):
        raise error
    fail(
        f"internal error ({type(error).__name__}: {error}); please report it, with what "
        "CDPRCAL_TRACEBACK=1 shows",
        UNTRUSTED,
    )


def fail(message: str, code: int = WRONG_USE) -> NoReturn:
    """Ends the command with one message on stderr."""
    line = "".join(c if c.isprintable() else " " for c in message.strip())
    typer.echo(f"cdprcal: {readable(line)}", err=True)
    raise typer.Exit(code)


def load_robot(robot: str) -> _core.Robot:
    """A robot by path or built-in name. Raises InputError, which names what may be meant."""
    import difflib

    from cdprcal import _core

    try:
        return _core.load_robot(robot)
    except _core.InputError as error:
        near = difflib.get_close_matches(robot.lower(), _core.builtin_robot_names(), n=1)
        if not near or Path(robot).exists():
            raise
        raise _core.InputError(f"{error}; give {near[0]}, if that is meant") from None


def robot_with_effects(robot: str, effects: Sequence[str] | None) -> _core.Robot:
    """A robot by name or path, with the effects that some files define beside its own.

    ``effects``: paths, or names of files that come with the package. Raises InputError naming file,
    line and column.
    """
    from cdprcal import _core, effect_files
    from cdprcal.io.files import read_utf_8

    the_robot = load_robot(robot)
    for path in effects or []:
        ours = path in effect_files.names()
        text = effect_files.text(path) if ours else read_utf_8(Path(path))
        the_robot = _core.with_effect_definitions(the_robot, text, path)
    return the_robot


def keep_apart(outputs: Mapping[str, str], inputs: Mapping[str, str | Sequence[str]]) -> None:
    """Refuses to write over what is read, or two things into one file; a file that is stdout by
    its name has it for itself.

    ``outputs``: option → its path, empty when it was not given; ``inputs``: what it is → its path
    or paths, which need not exist (built-in robots). Raises InputError.
    """
    from cdprcal._core import InputError

    read = [
        (what, path)
        for what, paths in inputs.items()
        for path in ([paths] if isinstance(paths, str) else paths)
    ]
    written: dict[str, str] = {}
    for option, path in outputs.items():
        if not path:
            continue
        if path == "-":
            raise InputError(f"{option} -: is no file; give its name, or /dev/stdout")
        if path in _STDOUT:
            leave_stdout()
        for what, source in read:
            if source and _same_file(path, source):
                raise InputError(
                    f"{path}: is the {what} that is read; give another name with {option}"
                )
        for other, taken in written.items():
            if _same_file(path, taken):
                raise InputError(f"{path}: is the file of {other} too; give {option} another")
        written[option] = path


def keep_existing(
    outputs: Mapping[Output, str], *, force: bool, any_name: Collection[str] = ()
) -> None:
    """Refuses a name whose ending is none of its kind, unless it is one of ``any_name``; and to
    write over a file that is no earlier result of its kind, unless ``force``.

    ``outputs``: what is written → its path, empty when it was not asked for. Raises InputError.
    """
    from cdprcal.io.replacing import check_ending, refuse_to_replace

    for kind, path in outputs.items():
        if path and path not in any_name:
            check_ending(Path(path), kind)
        if path and not force:
            refuse_to_replace(Path(path), kind)


def _same_file(a: str, b: str) -> bool:
    """Of two names, whether or not there is a file yet; a device is never the same."""
    try:
        if os.path.exists(a) and os.path.exists(b):
            return os.path.samefile(a, b) and os.path.isfile(a)
        return os.path.realpath(a) == os.path.realpath(b)
    except (OSError, ValueError):  # what is no name at all is refused where it is opened
        return False


def print_json(document: Any) -> None:
    """The document, alone on stdout."""
    from cdprcal.results import strict_json

    sys.stdout.write(strict_json(document))
    sys.stdout.flush()
