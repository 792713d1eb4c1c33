"""The command line: one file a command.

Only typer is imported until a command runs, so that ``cdprcal --help`` answers at once.
"""

from __future__ import annotations

from typing import Annotated

import typer

from cdprcal.cli import (
    acquire,
    calibrate,
    check,
    demo,
    diagnose,
    effects,
    export,
    generate,
    import_log,
    plan,
    repeat,
    replay,
    report,
    schema,
    template,
    workspace,
)

app = typer.Typer(
    name="cdprcal",
    help="Find out where a cable robot hangs when it is switched on, and what its model gets "
    "wrong.\n\nExit codes: 0 done, 1 the data or the solution cannot be trusted, 2 wrong use, "
    "3 calibrate found a pose, but with caveats.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command("demo", epilog=demo.EXAMPLE)(demo.command)
app.command("workspace", epilog=workspace.EXAMPLE)(workspace.command)
app.command("plan", epilog=plan.EXAMPLE)(plan.command)
app.command("acquire", epilog=acquire.EXAMPLE)(acquire.command)
app.command("replay", epilog=replay.EXAMPLE)(replay.command)
app.command("import", epilog=import_log.EXAMPLE)(import_log.command)
app.command("export", epilog=export.EXAMPLE)(export.command)
app.command("check", epilog=check.EXAMPLE)(check.command)
app.command("calibrate", epilog=calibrate.EXAMPLE)(calibrate.command)
app.command("diagnose", epilog=diagnose.EXAMPLE)(diagnose.command)
app.command("effects", epilog=effects.EFFECTS_EXAMPLE)(effects.effects)
app.command("explain", epilog=effects.EXPLAIN_EXAMPLE)(effects.explain)
app.command("report", epilog=report.EXAMPLE)(report.command)
app.command("repeat", epilog=repeat.EXAMPLE)(repeat.command)
app.command("template", epilog=template.EXAMPLE)(template.command)
app.command("schema", epilog=schema.EXAMPLE)(schema.command)
app.command("generate", epilog=generate.EXAMPLE)(generate.command)


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
