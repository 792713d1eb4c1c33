"""One malformed file: what it is derived from, how, and what must be said about it."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from cdprcal.cli import app

Change = Callable[[bytes], bytes]
EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@dataclass(frozen=True)
class Valid:
    """The valid files that the others are derived from, by what reads them."""

    files: dict[str, bytes]
    folder: Path


@dataclass(frozen=True)
class Case:
    """``kind``: which reader; ``change``: valid content → this file's; ``words``: a pattern that
    the message must hold after the file's name.

    ``said``: the reader takes what is good in the file and says what is not, instead of refusing.
    ``place``: makes what is no plain file at a path. ``big``: takes memory that must be bounded.
    """

    kind: str
    name: str
    change: Change | None = None
    words: str = ""
    base: str = ""  # which valid file, when it is not that of the kind
    said: bool = False
    place: Callable[[Path, Valid], Path] | None = field(default=None)
    big: bool = False
    command: str = ""  # only this one looks at what is wrong

    @property
    def id(self) -> str:
        """For pytest."""
        return f"{self.kind}: {self.name}"


#: What a file of each kind is called: the name is in every message.
NAMES = {
    "robot": "case.yaml",
    "csv": "case.csv",
    "raw": "case.log",
    "mcap": "case.mcap",
    "bag": "case_bag.mcap",
    "plan": "case_plan.csv",
    "session": "case_session.yaml",
    "result": "case_result.json",
    "path": "case_path",
}


def make(case: Case, folder: Path, valid: Valid) -> Path:
    """Writes the file of a case into a folder; returns where it is."""
    path = folder / NAMES[case.kind]
    if case.place is not None:
        return case.place(path, valid)
    assert case.change is not None
    before = valid.files[case.base or case.kind]
    after = case.change(before)
    assert after != before, f"{case.id}: nothing was changed"
    if case.base == "sqlite":
        path = path.with_suffix(".db3")
    path.write_bytes(after)
    return path


def make_valid(folder: Path) -> Valid:
    """Runs the commands that write every kind of file."""
    import cdprcal
    from cdprcal.io import load_log, save_log
    from conftest import raw_text

    def run(*arguments: str) -> None:
        said = io.StringIO()
        with redirect_stdout(said), redirect_stderr(said), pytest.raises(SystemExit) as stop:
            app([str(folder / a[1:]) if a.startswith("@") else a for a in arguments])
        assert not stop.value.code, (arguments, said.getvalue())

    (folder / "robot.yaml").write_text(cdprcal.builtin_robot_yaml("irma4"))
    run("plan", "irma4", "--grid", "1x1x2", "--threads", "1", "-o", "@plan.csv")
    run("acquire", "irma4", "@plan.csv", "--quick", "-o", "@acquired.csv")
    run("acquire", "irma4", "@plan.csv", "--quick", "-o", "@acquired.mcap")
    run("calibrate", "irma4", "@acquired.csv", "-o", "@result.json")
    run("diagnose", "irma4", "@acquired.csv", "--result", "@diagnosis.json")
    run("export", "irma4", "@acquired.csv", "-o", "@bag")
    run("export", "irma4", "@acquired.csv", "-o", "@sqlite", "--storage", "sqlite3")
    log = load_log(folder / "acquired.csv").log
    save_log(log, folder / "run.csv")
    save_log(log, folder / "run.mcap")
    (folder / "run.log").write_text(raw_text(log))
    read = {
        "robot": "robot.yaml",
        "csv": "run.csv",
        "acquired": "acquired.csv",
        "raw": "run.log",
        "mcap": "run.mcap",
        "acquired mcap": "acquired.mcap",
        "bag": "bag/bag.mcap",
        "sqlite": "sqlite/sqlite.db3",
        "plan": "plan.csv",
        "result": "result.json",
        "diagnosis": "diagnosis.json",
    }
    files = {kind: (folder / name).read_bytes() for kind, name in read.items()}
    files["session"] = (EXAMPLES / "canopen-simulated.yaml").read_bytes()
    return Valid(files, folder)


# Changes.


def swap(old: str, new: str, count: int = 1) -> Change:
    """Other text in place of some that must be there."""

    def change(data: bytes) -> bytes:
        assert old.encode() in data, old
        return data.replace(old.encode(), new.encode(), count)

    return change


def sub(pattern: str, new: str) -> Change:
    """The first match of a pattern, which must be there."""

    def change(data: bytes) -> bytes:
        after, count = re.subn(pattern.encode(), new.encode(), data, count=1, flags=re.M | re.S)
        assert count, pattern
        return after

    return change


def line(number: int, edit: Callable[[bytes], bytes]) -> Change:
    """One line, from 1, without its end; -1 is the last."""

    def change(data: bytes) -> bytes:
        lines = data.removesuffix(b"\n").split(b"\n")
        at = number - 1 if number > 0 else number
        lines[at] = edit(lines[at])
        return b"\n".join(lines) + b"\n"

    return change


def cell(number: int, column: int, text: str) -> Change:
    """One cell of a comma-separated line; both from 1."""

    def edit(old: bytes) -> bytes:
        cells = old.split(b",")
        cells[column - 1] = text.encode()
        return b",".join(cells)

    return line(number, edit)


def insert(number: int, text: str) -> Change:
    """A new line before line ``number``."""

    def change(data: bytes) -> bytes:
        lines = data.split(b"\n")
        lines.insert(number - 1, text.encode())
        return b"\n".join(lines)

    return change


def cut(share: float) -> Change:
    """The first part of the file."""
    return lambda data: data[: int(len(data) * share)]


def flip(share: float, byte: int = 0xFF) -> Change:
    """One byte, at a share of the file, becomes its exclusive or."""

    def change(data: bytes) -> bytes:
        at = int(len(data) * share)
        return data[:at] + bytes([data[at] ^ byte]) + data[at + 1 :]

    return change


def aliases(data: bytes) -> bytes:
    """2^60 lists in a few lines of YAML."""
    steps = [f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]" for i in range(1, 60)]
    return data + "\n".join(["a0: &a0 [1, 1]", *steps, ""]).encode()


def only(data: bytes) -> Change:
    """Something else altogether."""
    return lambda before: data


PNG = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(range(256))
ZIP = b"PK\x03\x04\x14\0\0\0\x08\0" + bytes(range(255, 0, -1))
TEN_MILLION = 10_000_000
