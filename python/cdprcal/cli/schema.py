"""``cdprcal schema``: what the JSON of a command looks like."""

from __future__ import annotations

from typing import Annotated

import typer

from cdprcal.command import print_json, reports_errors

EXAMPLE = "Example: cdprcal schema calibrate > calibrate.schema.json"


@reports_errors
def command(
    name: Annotated[
        str,
        typer.Argument(
            metavar="[DOCUMENT]",
            help="Command whose --json is meant, or NAME-result for its result files, or "
            "effects-words; without one their names are listed.",
        ),
    ] = "",
) -> None:
    """Print the JSON schema (draft 2020-12) of a command's --json, or of its result file."""
    from cdprcal.schemas import DOCUMENTS, schema

    if name:
        print_json(schema(name))
    else:
        typer.echo("\n".join(DOCUMENTS))
