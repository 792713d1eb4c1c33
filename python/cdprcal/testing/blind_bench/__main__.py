"""``python -m cdprcal.blind_bench``: run a blind study, or report on one."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from cdprcal.command import fail, reports_errors
from cdprcal.studies.workers import Workers, stream
from cdprcal.testing.blind_bench.cases import Setting, Split, kind_of
from cdprcal.testing.blind_bench.families import FAMILIES
from cdprcal.testing.blind_bench.judge import run_case
from cdprcal.testing.blind_bench.report import markdown, read_lines
from cdprcal.testing.blind_bench.score import KINDS

app = typer.Typer(
    help="Blind tests of the diagnosis, on logs of the dynamic simulator.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)


@app.command(
    epilog="Example: python -m cdprcal.blind_bench run --cases 110 --seed 1 -o build/bench"
)
@reports_errors
def run(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Study folder.")],
    cases: Annotated[
        int, typer.Option(min=1, help="Cases 0 … N-1; shares are even over 110.")
    ] = 110,
    seed: Annotated[int, typer.Option(help="Of the study.")] = 1,
    split: Annotated[Split, typer.Option(help="sealed: for published numbers, run once.")] = (
        Split.tuning
    ),
    poses: Annotated[int, typer.Option(help="8 or 27.")] = 27,
    noise: Annotated[
        float, typer.Option(min=0.0, help="Of the robot file's sigma; most families draw it.")
    ] = 0.2,
    family: Annotated[
        str, typer.Option(metavar="NAME[,NAME…]|all", help=", ".join(FAMILIES))
    ] = "white",
    only: Annotated[str, typer.Option(help=f"Cases of one kind: {', '.join(KINDS)}.")] = "",
    jobs: Annotated[int, typer.Option(min=1, help="Processes.")] = 1,
) -> None:
    """Draws, simulates and diagnoses cases; one JSON line a case, one file a family.

    Goes on where it was stopped.
    """
    if poses not in (8, 27):
        fail(f"--poses: must be 8 or 27, not {poses}")
    families = list(FAMILIES) if family == "all" else family.split(",")
    for name in families:
        if name not in FAMILIES:
            fail(f"--family: no family {name!r}; give one of {', '.join(FAMILIES)}")
    output.mkdir(parents=True, exist_ok=True)
    for name in families:
        setting = Setting(poses, noise, name)
        numbers = [
            number
            for number in range(cases)
            if not only or kind_of(split, seed, setting, number) == only
        ]
        _run_family(output, split, seed, setting, numbers, Workers(jobs))


def _run_family(
    output: Path, split: Split, seed: int, setting: Setting, numbers: list[int], workers: Workers
) -> None:
    path = output / f"{split}-{seed}_{setting.name}.jsonl"
    done = {line["case"]["number"] for line in read_lines(path)} if path.exists() else set()
    left = [number for number in numbers if number not in done]
    torn = path.exists() and not path.read_text().endswith("\n")
    with path.open("a") as file:
        file.write("\n" if torn else "")  # after a line cut short by an interruption
        lines = stream(partial(run_case, split, seed, setting), left, workers)
        for count, line in enumerate(lines, start=1):
            file.write(json.dumps(line) + "\n")
            file.flush()
            if count % 10 == 0 or count == len(left):
                typer.echo(f"… {count} of {len(left)} cases", err=True)
    typer.echo(f"{path}", err=True)


@app.command(epilog="Example: python -m cdprcal.blind_bench report build/bench/*.jsonl")
@reports_errors
def report(
    files: Annotated[list[Path], typer.Argument(metavar="STUDY.jsonl…", help="Of `run`.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Markdown; else stdout.")
    ] = None,
) -> None:
    """Families side by side, scores, confusion, detection by size, intervals, every failure."""
    text = markdown(files)
    if output is None:
        typer.echo(text, nl=False)
    else:
        output.write_text(text)


if __name__ == "__main__":
    app()
