"""What people read, wherever it goes: answers on stdout, progress and warnings on stderr.

Nothing is ever cut: prose is wrapped on a terminal, tables are laid out in as many blocks as the
width needs, and where the locale is not one of Unicode its letters are written in ASCII.
"""

from __future__ import annotations

import math
import os
import re
import shlex
import shutil
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Table as RichTable
from rich.text import Text

from cdprcal.letters import readable, speaks_unicode

_MOST_DECIMALS = 6  # of a number without an exponent
_GAP = 2  # columns of blanks between two of a table


def answers() -> Console:
    """A console on stdout: for what was asked."""
    return _console(stderr=False)


def notes() -> Console:
    """A console on stderr: for progress, warnings and what happened on the way."""
    return _console(stderr=True)


def _console(*, stderr: bool) -> Console:
    stream = sys.stderr if stderr else sys.stdout
    if hasattr(stream, "reconfigure"):  # a name of a file may be no text at all
        stream.reconfigure(errors="backslashreplace")
    console = Console(stderr=stderr, highlight=False, emoji=False, markup=False)
    if not console.width:  # COLUMNS=0 says that who set it does not know; rich takes its word
        console.width = shutil.get_terminal_size().columns
    return console


def as_typed(*words: object) -> str:
    """A command of cdprcal as a shell takes it: names with blanks are quoted."""
    return shlex.join(["cdprcal", *(str(word) for word in words)])


def say(out: Console, text: str | Text) -> None:
    """Prose: wrapped on a terminal; in a pipe one line, so that it can be searched.

    Who sets COLUMNS says how wide it is to be, in a pipe too.
    """
    if isinstance(text, str):
        text = Text(text)
    if not speaks_unicode():
        text = _plain(text)
    out.print(text, soft_wrap=not (out.is_terminal or os.environ.get("COLUMNS")))


def _plain(text: Text) -> Text:
    parts = text.divide([*(edge for span in text.spans for edge in (span.start, span.end))])
    plain = Text()
    for part in parts:
        style = part.spans[0].style if part.spans else text.style
        plain.append(readable(part.plain), style)
    return plain


#: Cells of each row, and its style.
Rows = Sequence[tuple[list[str], str]]


@dataclass(frozen=True)
class _Column:
    header: str
    is_text: bool  #: to the left, and may be wrapped between words


class Table:
    """Rows under headers, for a console to print.

    Where not all columns fit side by side they come in blocks one below the other, each with the
    first ``keys`` columns. Columns of ``text`` (by number) are to the left, others to the right.
    """

    def __init__(self, *headers: str, text: Collection[int] = (), keys: int = 1) -> None:
        self._columns = [_Column(header, i in text) for i, header in enumerate(headers)]
        self._keys = keys
        self._rows: list[tuple[tuple[str, ...], str]] = []

    def add_row(self, *cells: str, style: str = "") -> None:
        """One cell a column."""
        if len(cells) != len(self._columns):
            raise ValueError(f"{len(cells)} cells for {len(self._columns)} columns")
        self._rows.append((cells, style))

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        rows = [([readable(cell) for cell in cells], style) for cells, style in self._rows]
        headers, least, blocks = self._laid_out(rows, options.max_width)
        for block in blocks:
            widths = self._widths(block, headers, rows, least, options.max_width)
            table = RichTable(
                box=None, pad_edge=False, header_style="bold", padding=(0, _GAP, 0, 0)
            )
            for i in block:
                is_text = self._columns[i].is_text
                table.add_column(
                    Text(headers[i]),
                    justify="left" if is_text else "right",
                    no_wrap=False,
                    overflow="fold",
                    width=widths[i],
                )
            for cells, style in rows:
                table.add_row(*(Text(cells[i]) for i in block), style=style)
            yield table

    def _laid_out(self, rows: Rows, width: int) -> tuple[list[str], list[int], list[list[int]]]:
        """Headers, the narrowest columns, and which of them stand side by side: all if possible.

        To that end units go below names first, then keys are wrapped between words.
        """
        names = [readable(column.header) for column in self._columns]
        below = [name.replace(" [", "\n[") for name in names]
        tried = []
        for headers, whole_keys in ((names, True), (below, True), (names, False), (below, False)):
            least = self._least(headers, rows, whole_keys=whole_keys)
            tried.append((headers, least, self._blocks(least, width)))
        return next((layout for layout in tried if len(layout[2]) == 1), tried[-1])

    def _least(self, headers: Sequence[str], rows: Rows, *, whole_keys: bool) -> list[int]:
        """The narrowest that each column may be."""
        return [
            _longest_word(headers[i], rows, i)
            if column.is_text and not (whole_keys and i < self._keys)
            else _widest(headers[i], rows, i)
            for i, column in enumerate(self._columns)
        ]

    def _widths(
        self, block: list[int], headers: Sequence[str], rows: Rows, least: list[int], width: int
    ) -> dict[int, int]:
        """Of the columns of a block: what is to spare goes to the texts, from the left."""
        widths = {i: least[i] for i in block}
        spare = width - sum(widths.values()) - _GAP * (len(block) - 1)
        for i in block:
            more = max(0, min(spare, _widest(headers[i], rows, i) - widths[i]))
            widths[i] += more
            spare -= more
        return widths

    def _blocks(self, least: Sequence[int], width: int) -> list[list[int]]:
        """Which columns stand side by side."""
        keys = list(range(self._keys))
        blocks: list[list[int]] = []
        taken = width + 1
        for i in range(self._keys, len(self._columns)):
            needed = least[i] + _GAP
            if taken + needed > width or not blocks:
                blocks.append(list(keys))
                # A column to the right of the last has no blanks after it.
                taken = sum(least[key] + _GAP for key in keys) - _GAP
            blocks[-1].append(i)
            taken += needed
        return blocks or [keys]


def _widest(header: str, rows: Rows, i: int) -> int:
    lines = [*header.splitlines(), *(cells[i] for cells, _ in rows)]
    return max((cell_len(line) for line in lines), default=0)


def _longest_word(header: str, rows: Rows, i: int) -> int:
    words = [word for text in (header, *(cells[i] for cells, _ in rows)) for word in text.split()]
    return max(map(cell_len, words), default=0)


def summed_up(lines: Iterable[str], *, verbose: bool = False) -> list[str]:
    """Lines that differ in their numbers only (but for a cable's) as one with a count.

    ``verbose``: as they are.
    """
    alike: dict[str, list[str]] = {}
    for line in lines:
        key = line if verbose else re.sub(r"(?<!cable )[-+]?\b\d[\d.]*(e[-+]?\d+)?", "#", line)
        alike.setdefault(key, []).append(line)
    if verbose:
        return [line for group in alike.values() for line in group]
    return [
        group[0] if len(group) == 1 else f"{len(group)} times, here the first: {group[0]}"
        for group in alike.values()
    ]


def counted(count: int, one: str, many: str = "") -> str:
    """'1 pose', '2 poses'."""
    return f"{count} {one if count == 1 else many or one + 's'}"


def listed(words: Sequence[str]) -> str:
    """'a', 'a and b', 'a, b and c'."""
    return " and ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def fixed(value: float | None, digits: int) -> str:
    """A number with so many digits after the point, and no minus before 0; – when there is none."""
    return "–" if value is None else f"{value:z.{digits}f}"


def decimals(sigma: float | None) -> int:
    """Decimals that show two digits of σ; 4 without one."""
    if sigma is None or not sigma > 0 or not math.isfinite(sigma):
        return 4
    return max(0, 1 - int(f"{sigma:.1e}".partition("e")[2]))


def measured(value: float | None, sigma: float | None, sign: str = "+") -> tuple[str, str]:
    """A value and its σ, both to two digits of σ; – for one that there is not.

    What would need many decimals has an exponent, the same for both. ``sign``: '+' or '', as of
    Python's formats.
    """
    if value is None or math.isnan(value):
        return "–", "–"
    if sigma is None or not sigma > 0 or not math.isfinite(sigma):
        return f"{value:{sign}z.4g}", "–" if sigma is None or math.isnan(sigma) else f"{sigma:g}"
    digits, power = decimals(sigma), 0
    if digits > _MOST_DECIMALS:
        power = math.floor(math.log10(max(abs(value), sigma)))
    unit, exponent = (10.0**power, f"e{power}") if power else (1.0, "")
    shown = f"z.{digits + power}f"
    return f"{value / unit:{sign}{shown}}{exponent}", f"{sigma / unit:{shown}}{exponent}"


def scaled(value: float | None, factor: float) -> float | None:
    """A number in another unit; None when there is none."""
    return None if value is None else value * factor


def degrees(value: float | None) -> float | None:
    """Radians in degrees; None when there is none."""
    return scaled(value, math.degrees(1))


Show = Callable[[str, float], None]


@contextmanager
def progress_bar() -> Iterator[Show]:
    """Yields ``show(stage, share)``; one bar, named after the stage, that disappears at the end."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    out = notes()
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=out, transient=True, disable=not out.is_terminal) as bar:
        task = bar.add_task("starting", total=1.0)

        def show(stage: str, share: float) -> None:
            bar.update(task, description=stage, completed=share)

        yield show
