"""A proposed mapping file: its lines, how sure each is, and the text."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from cdprcal.io.files import shown_path
from cdprcal.mapping.document import GROUPS, Map, parse_map, quoted
from cdprcal.mapping.raw import RawTable

PER_CABLE = [name for name, sensor in GROUPS.items() if sensor.is_per_cable]
#: Between the units of a time that two columns hold.
PLUS = " + "


@dataclass(frozen=True)
class Line:
    """One group of the proposal: where from, in what unit and direction; how sure, and why."""

    name: str
    columns: tuple[str, ...]
    unit: str | float
    sign: tuple[int, ...]
    sure: str  #: 'sure', 'likely' or 'guess'
    why: str
    rivals: tuple[str, ...] = ()  #: units that it may have as well
    has_scale: bool = True  #: whether the unit may be right

    def as_dict(self) -> dict[str, Any]:
        """The line as plain data."""
        return {key: at for key, at in asdict(self).items() if key not in ("rivals", "has_scale")}


@dataclass(frozen=True)
class Proposal:
    """A mapping file as lines; ``text()`` writes it."""

    raw: RawTable
    time: Line
    lines: tuple[Line, ...]
    rate_Hz: float | None = None
    missing: Line | None = None  #: ``unit``: the numbers that say that nothing was read

    def text(self) -> str:
        """The mapping file, with a comment to each line."""
        out = [
            f"# {shown_path(self.raw.path.name)}: as cdprcal check proposes; correct it.",
            "# unit: as written, or a number: how many SI units one is (metres a count, say).",
            "# sign: 1 if cables grow and rotations follow the right hand; else -1; or a list.",
            "format: cdprcal-map-1",
        ]
        if self.raw.form is not None:
            form = self.raw.form
            out.append(
                f"text: {{separator: {quoted(form.separator)}, decimal: {quoted(form.decimal)}, "
                f"header_line: {form.header_line}, encoding: {quoted(form.encoding)}}}"
            )
        if self.rate_Hz is not None:
            out.append(f"time: {{rate_Hz: {self.rate_Hz:g}}}  # {self.time.sure}: {self.time.why}")
        else:
            units = str(self.time.unit).split(PLUS)
            first, *more = (
                f"column: {quoted(column)}, unit: {quoted(unit)}"
                for column, unit in zip(self.time.columns, units, strict=True)
            )
            plus = f", plus: {{{more[0]}}}" if more else ""
            out.append(f"time: {{{first}{plus}}}  # {self.time.sure}: {self.time.why}")
        if self.missing is not None:
            why = self.missing.why
            out.append(f"missing: {self.missing.unit}  # {self.missing.sure}: {why}")
        out.append("channels:")
        for line in self.lines:
            sign = line.sign[0] if len(set(line.sign)) == 1 else list(line.sign)
            out.append(
                f"  {line.name}: {{columns: {quoted(list(line.columns))}, "
                f"unit: {quoted(line.unit)}, sign: {quoted(sign)}}}  # {line.sure}: {line.why}"
            )
        if self.lacks:
            out.append(f"# {self.lacks}")
        if spare := self.unused():
            shown = ", ".join(map(quoted, spare[:40]))
            out.append(f"# not used: {shown}{' …' if len(spare) > 40 else ''}")
        return "\n".join(out) + "\n"

    def all_lines(self) -> list[Line]:
        """The lines in the order of the file: time, what is missing, channels."""
        return [self.time, *filter(None, [self.missing]), *self.lines]

    def as_dict(self) -> dict[str, Any]:
        """The lines as plain data, with what they leave out."""
        missing = self.missing
        return {
            "log": shown_path(self.raw.path),
            "time": self.time.as_dict(),
            "rate_Hz": self.rate_Hz,
            "missing": missing
            and {
                "columns": list(missing.columns),
                "values": self.map().missing,
                "sure": missing.sure,
                "why": missing.why,
            },
            "channels": [line.as_dict() for line in self.lines],
            "lacks": self.lacks,
            "unused": self.unused(),
        }

    @property
    def lacks(self) -> str:
        """What no line has and no pose can do without; empty: nothing."""
        if {line.name for line in self.lines} & set(PER_CABLE):
            return ""
        return (
            "no column is recognised as a cable's: add lengths, swivels or tensions under channels"
        )

    def unused(self) -> list[str]:
        """Columns that no line takes, in the order of the file, then what is no column, lines with
        NUL bytes, and the last line where it is cut off."""
        used = {*self.time.columns, *(c for line in self.lines for c in line.columns)}
        cut_line = self.raw.cut_line
        cut = [] if cut_line is None else [f"line {cut_line}, which is cut off"]
        lost = [f"NUL bytes in {self.raw.lost}"] if self.raw.lost else []
        columns = (name for name in self.raw.columns if name not in used)
        return [*columns, *self.raw.left_out, *lost, *cut]

    def map(self) -> Map:
        """The mapping itself."""
        return parse_map(self.text(), "the proposed map")
