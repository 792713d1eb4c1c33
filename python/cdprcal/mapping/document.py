"""The mapping file: which column of a raw file is which channel, in which unit and direction."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from cdprcal import sensors
from cdprcal.mapping.units import UNITS, factor
from cdprcal.strict_yaml import YamlKind, misplaced, unfit

#: Name in the mapping file → the group of a log that it fills.
GROUPS = {
    **{
        name.replace("-", "_"): sensors.LOG_GROUPS[group] for name, group in sensors.OPTIONS.items()
    },
    **{
        f"{group.name}s": group
        for field, group in sensors.LOG_GROUPS.items()
        if field not in sensors.SENSORS
    },
}
#: Orders of four columns that are an orientation, as units of ``attitude``.
QUATERNIONS = {"quaternion_xyzw": (3, 0, 1, 2), "quaternion_wxyz": (0, 1, 2, 3)}

Sign = Literal[1, -1]


def _refuse_no_size(unit: str | float) -> None:
    """Raises ValueError for a number that is no size of a unit."""
    if not isinstance(unit, str) and not 0.0 < unit < math.inf:
        raise ValueError(
            f"unit {unit:g} is not above 0: give the SI units that one is; directions are sign: -1"
        )


def _unit_of_time(unit: str | float) -> str | float:
    """The unit. Raises an error of pydantic when it is none of a time."""
    _refuse_no_size(unit)
    if factor("s", unit) is None:
        raise unfit(f"unit {unit!r} is not one of {', '.join(UNITS['s'])}; give one of those")
    return unit


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Text(_Strict):
    """How a text file is cut into columns; of other files left out."""

    separator: str = ","
    decimal: Literal[".", ","] = "."
    header_line: Annotated[int, Field(ge=0)] = 1
    encoding: str = "utf-8"

    @field_validator("separator")
    @classmethod
    def _one_character(cls, separator: str) -> str:
        if len(separator) != 1:
            raise unfit(f'{separator!r} is not one character; give ";", ",", "|", " " or "\\t"')
        return separator

    @field_validator("encoding")
    @classmethod
    def _that_is_known(cls, encoding: str) -> str:
        try:
            b"a".decode(encoding)
        except UnicodeError:
            return encoding  # which has no letter of one byte
        except (LookupError, ValueError):
            raise unfit(
                f"{encoding!r} is no encoding of text; give utf-8, utf-16, cp1252, latin-1 …"
            ) from None
        return encoding


class Part(_Strict):
    """A column that a time is a part of, such as the nanoseconds since the second began."""

    column: Annotated[str, Field(min_length=1)]
    unit: str | float

    @field_validator("unit")
    @classmethod
    def _of_time(cls, unit: str | float) -> str | float:
        return _unit_of_time(unit)


class Time(_Strict):
    """When: a column, or a rate where there is none; ``plus``: what is added to the column. Of a
    bag, the topic of the rows."""

    column: str = ""
    unit: str | float = "s"
    plus: Part | None = None
    rate_Hz: Annotated[float, Field(gt=0.0, le=1e5)] | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> Time:
        if bool(self.column) == (self.rate_Hz is not None):
            raise ValueError("give either a column or rate_Hz")
        _unit_of_time(self.unit)
        return self


class Group(_Strict):
    """Columns of one kind; '' where there is none."""

    columns: Annotated[list[str], Field(min_length=1, max_length=64)]
    unit: str | float = Field(description="A unit, or the number of SI units that one of it is.")
    sign: Sign | list[Sign] = 1
    delay_s: Annotated[float, Field(ge=-10.0, le=10.0)] = 0.0  #: stamped so long after they were so

    @property
    def signs(self) -> list[Sign]:
        """One a column."""
        return self.sign if isinstance(self.sign, list) else [self.sign] * len(self.columns)

    @field_validator("sign", mode="before")
    @classmethod
    def _directions(cls, sign: Any) -> Any:
        for one in sign if isinstance(sign, list) else [sign]:
            if isinstance(one, bool) or one not in (1, -1):
                raise unfit(
                    f"{one} is neither 1 nor -1; give 1 where cables grow and rotations follow the "
                    "right hand, else -1, or a list with one a column"
                )
        return sign

    @model_validator(mode="after")
    def _one_sign_a_column(self) -> Group:
        if isinstance(self.sign, list) and len(self.sign) != len(self.columns):
            raise unfit(
                f"{len(self.sign)} signs for {len(self.columns)} columns; give one, or one a column"
            )
        return self

    @model_validator(mode="after")
    def _sizes_and_names(self) -> Group:
        _refuse_no_size(self.unit)
        named = [name for name in self.columns if name]
        if twice := next((name for name in named if named.count(name) > 1), None):
            raise ValueError(f"names column {twice!r} twice; give each cable or axis its own")
        return self


class Map(_Strict):
    """Everything that turns a raw file into a log."""

    format: Literal["cdprcal-map-1"]
    text: Text | None = None
    time: Time
    run: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="Of records, which stretch of them; None: all."
    )
    missing: list[float] = Field(
        default=[], description="Numbers that say in any column that nothing was read."
    )
    channels: dict[str, Group]

    @model_validator(mode="after")
    def _known_channels(self) -> Map:
        if not self.channels:
            raise misplaced("channels", f"name one or more of {', '.join(GROUPS)}")
        for name, group in self.channels.items():
            if name not in GROUPS:
                raise misplaced(f"channels.{name}", f"is not one of {', '.join(GROUPS)}")
            _check(name, group)
        return self

    @model_validator(mode="after")
    def _one_column_a_cable(self) -> Map:
        of_cables = {
            name: len(group.columns)
            for name, group in self.channels.items()
            if GROUPS[name].is_per_cable
        }
        most = max(of_cables, key=of_cables.__getitem__, default="")
        for name, count in of_cables.items():
            if count < of_cables[most]:
                raise misplaced(
                    f"channels.{name}.columns",
                    f"has {count} columns, {most} has {of_cables[most]}; name one a cable, and "
                    "write '' for one that is not there",
                )
        return self


def _check(name: str, group: Group) -> None:
    sensor, count = GROUPS[name], len(group.columns)
    where = f"channels.{name}"
    if name == "attitude" and group.unit in QUATERNIONS:
        if count != 4:
            raise misplaced(f"{where}.columns", "must be 4 for a quaternion")
        return
    if not sensor.is_per_cable and count != sensor.columns_of(0):
        raise misplaced(
            f"{where}.columns",
            f"has {count} columns, expected {sensor.columns_of(0)}; write '' for one that is not "
            "there",
        )
    if factor(sensor.unit, group.unit) is None:
        known = [*UNITS[sensor.unit], *(QUATERNIONS if name == "attitude" else ())]
        raise misplaced(
            f"{where}.unit",
            f"{group.unit!r} is not one of {', '.join(known)}, nor a number of {sensor.unit} that "
            "one is",
        )


_KIND = YamlKind(Map, "mapping file", "docs/your-log.md")


def load_map(path: str | Path) -> Map:
    """Reads a mapping file. Raises InputError 'file:line:column: …'."""
    return _KIND.load(path)


def parse_map(text: str, source: str) -> Map:
    """A mapping file from its text; ``source`` is its name in messages. Raises InputError."""
    return _KIND.parse(text, source)


def quoted(value: Any) -> str:
    """A value as the file writes it: names always in quotes, so that any will do."""
    if isinstance(value, list):
        return "[" + ", ".join(map(quoted, value)) + "]"
    if isinstance(value, str):
        inner = value.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t")
        return f'"{inner}"'
    return f"{value:g}" if isinstance(value, float) else str(value)
