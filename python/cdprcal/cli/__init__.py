"""The command line: one file a command.

Only typer is imported until a command runs, so that ``cdprcal --help`` answers at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from cdprcal.cli import (
    acquire,
    calibrate,
    check,
    compare,
    demo,
    diagnose,
    effects,
    explore,
    export,
    generate,
    geometry,
    import_log,
    plan,
    repeat,
    replay,
    report,
    schema,
    template,
    track,
    workspace,
)
from cdprcal.letters import readable


class _Command(TyperCommand):
    """One whose help can be read in every locale."""

    def get_help(self, ctx: Any) -> str:
        return readable(super().get_help(ctx))

    def get_usage(self, ctx: Any) -> str:
        return readable(super().get_usage(ctx))


class _Commands(Mapping[str, Any]):
    """Each command, made when it is asked for: all of them take longer than most that they do."""

    def __getitem__(self, name: str) -> Any:
        return _command(name)

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)


class _Group(TyperGroup):
    """All commands: as each of them."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands: Any = _Commands()

    def get_help(self, ctx: Any) -> str:
        return readable(super().get_help(ctx))

    def get_usage(self, ctx: Any) -> str:
        return readable(super().get_usage(ctx))

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, summary) for name, (_, _, summary) in COMMANDS.items()])


#: Name → function, example and what ``cdprcal --help`` says of it, in its order.
COMMANDS: dict[str, tuple[Callable[..., None], str, str]] = {
    "demo": (demo.command, demo.EXAMPLE, "The whole story, simulated: start here."),
    "workspace": (workspace.command, workspace.EXAMPLE, "Where the platform can hang stably."),
    "plan": (plan.command, plan.EXAMPLE, "Where to measure, and the accuracy to expect."),
    "acquire": (acquire.command, acquire.EXAMPLE, "Run the start-up procedure and log it."),
    "replay": (replay.command, replay.EXAMPLE, "A log on the live page."),
    "import": (import_log.command, import_log.EXAMPLE, "A file of any kind to a canonical log."),
    "export": (export.command, export.EXAMPLE, "A log to a ROS 2 bag."),
    "check": (check.command, check.EXAMPLE, "What is wrong with a robot file or a log."),
    "calibrate": (calibrate.command, calibrate.EXAMPLE, "The initial pose, from a log."),
    "track": (track.command, track.EXAMPLE, "Pose and twist at every sample."),
    "diagnose": (diagnose.command, diagnose.EXAMPLE, "What the model gets wrong, from logs."),
    "compare": (compare.command, compare.EXAMPLE, "Which numbers moved from log to log."),
    "geometry": (geometry.command, geometry.EXAMPLE, "Where the pulleys are, from many poses."),
    "explore": (explore.command, explore.EXAMPLE, "Effects switched on and off on a page."),
    "effects": (effects.effects, effects.EFFECTS_EXAMPLE, "What diagnose looks for."),
    "explain": (effects.explain, effects.EXPLAIN_EXAMPLE, "All about one effect."),
    "report": (report.command, report.EXAMPLE, "One HTML page about a start-up."),
    "repeat": (repeat.command, repeat.EXAMPLE, "Solve a result file again, and compare."),
    "template": (template.command, template.EXAMPLE, "A robot file to be filled in."),
    "schema": (schema.command, schema.EXAMPLE, "The JSON schema of a command's --json."),
    "generate": (generate.command, generate.EXAMPLE, "The log of an ideal start-up, truth known."),
}

app = typer.Typer(
    name="cdprcal",
    cls=_Group,
    help="Find out where a cable robot hangs when it is switched on, and what its model gets "
    "wrong.\n\nExit codes: 0 done, 1 the data or the solution cannot be trusted, 2 wrong use, "
    "3 calibrate, track or acquire --until found a pose, or geometry a frame, but with caveats.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@cache
def _command(name: str) -> Any:
    """One command, as typer makes it."""
    function, example, summary = COMMANDS[name]
    alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
    alone.command(name, epilog=example, short_help=summary, cls=_Command)(function)
    return get_command(alone)


def _print_version(wanted: bool) -> None:
    if wanted:
        import platform
        from importlib.metadata import version

        from cdprcal._core import library_versions

        inside = library_versions()
        compiler = inside.pop("compiler")
        typer.echo(f"cdprcal {version('cdprcal')}")
        typer.echo(f"Python {platform.python_version()}, numpy {version('numpy')}")
        typer.echo(", ".join(f"{name} {number}" for name, number in inside.items()))
        typer.echo(f"built with {compiler}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_print_version,
            is_eager=True,
            help="Print the version, and those of the libraries inside.",
        ),
    ] = False,
) -> None:
    pass
