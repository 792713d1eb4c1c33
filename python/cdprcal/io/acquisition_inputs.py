"""What a log was acquired with: it is in the log, so that the log alone is enough to solve again.

In MCAP they are attachments (robot.yaml, plan.csv, settings.json), in CSV comment lines before the
header: ``# robot| name: irma4``.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdprcal._core import InputError
from cdprcal.io.files import read_bytes, shown_path
from cdprcal.io.log_file import ACQUIRED, readable_format
from cdprcal.io.mcap_records import readable_records

if TYPE_CHECKING:
    from mcap.writer import Writer

ROBOT, PLAN, SETTINGS = "robot.yaml", "plan.csv", "settings.json"
_MARKS = {ROBOT: b"# robot| ", PLAN: b"# plan| ", SETTINGS: b"# settings| "}
_MEDIA = {ROBOT: "application/yaml", PLAN: "text/csv", SETTINGS: "application/json"}


@dataclass(frozen=True)
class AcquisitionInputs:
    """Robot file and plan file as texts; settings of procedure and backend, the seed among them."""

    robot_yaml: str
    plan_csv: str
    settings: dict[str, Any]

    def files(self) -> dict[str, str]:
        """Name → text."""
        settings = json.dumps(self.settings, allow_nan=False)
        return {ROBOT: self.robot_yaml, PLAN: self.plan_csv, SETTINGS: settings}


def attach(writer: Writer, inputs: AcquisitionInputs) -> None:
    """Puts them into an MCAP file that is being written."""
    for name, text in inputs.files().items():
        writer.add_attachment(0, 0, name, _MEDIA[name], text.encode())


def as_comments(inputs: AcquisitionInputs) -> bytes:
    """The lines that stand before a CSV log's header."""
    lines = [ACQUIRED + b": this log's robot, plan and settings"]
    for name, text in inputs.files().items():
        # Line feeds alone end a line: others, of any alphabet, may be in a robot's name.
        lines += [_MARKS[name] + line.encode() for line in text.removesuffix("\n").split("\n")]
    return b"\n".join(lines) + b"\n"


def read_inputs(path: str | Path) -> AcquisitionInputs | None:
    """What a log was acquired with; None when it does not say (it was not acquired by cdprcal).

    Logs that were cut are read as far as they go. Raises InputError when the file cannot be read
    or the settings are damaged.
    """
    path = Path(path)
    data = read_bytes(path)
    kind = readable_format(data, path)
    files = _attachments(data) if kind == "mcap" else _comments(data) if kind == "csv" else {}
    if not files.keys() >= _MARKS.keys():
        return None
    try:
        settings = json.loads(files[SETTINGS])
    except ValueError:
        settings = None
    if not isinstance(settings, dict):
        raise InputError(
            f"{shown_path(path)}: the settings in this log are damaged; leave out --inputs"
        )
    return AcquisitionInputs(files[ROBOT], files[PLAN], settings)


def _comments(data: bytes) -> dict[str, str]:
    found: dict[str, list[str]] = {}
    for line in data.split(b"\n"):
        if line and not line.startswith(b"#"):
            break  # the header
        for name, mark in _MARKS.items():
            if line.startswith(mark.rstrip()):
                found.setdefault(name, []).append(line[len(mark) :].decode("utf-8", "replace"))
    return {name: "\n".join(lines) + "\n" for name, lines in found.items()}


def _attachments(data: bytes) -> dict[str, str]:
    from mcap.records import Attachment

    return {
        record.name: record.data.decode("utf-8", "replace")
        for record in readable_records(data)
        if isinstance(record, Attachment) and record.name in _MARKS
    }
