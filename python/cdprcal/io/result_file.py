"""Result files: what came out together with all it was made from, so that it can be solved again.

A result file is the document of ``--json`` with one more key, ``inputs``: the robot file, the
options, and the logs themselves (canonical CSV, gzip, base64), each with its SHA-256.
"""

from __future__ import annotations

import base64
import binascii
import gzip
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.io.files import read_bytes, write_text
from cdprcal.io.log_file import display_name

Command = Literal["calibrate", "diagnose"]
_LONGEST_LOG_BYTES = 1 << 30


@dataclass(frozen=True)
class Result:
    """A result as a file keeps it. ``options`` are those of the command, as plain data."""

    command: Command
    document: dict[str, Any]
    robot: _core.Robot
    logs: tuple[_core.Log, ...]
    options: dict[str, Any]
    version: str


def cdprcal_version() -> str:
    """Of the installed package; 'unknown' when it runs from a source tree."""
    try:
        return version("cdprcal")
    except PackageNotFoundError:
        return "unknown"


def save_result(
    path: Path,
    command: Command,
    document: Mapping[str, Any],
    robot: _core.Robot,
    logs: Sequence[_core.Log],
    options: Mapping[str, Any],
) -> None:
    """Writes a result file, all or nothing. Raises InputError."""
    from cdprcal.results import strict_json

    inputs = {
        "command": command,
        "version": cdprcal_version(),
        "robot": _core.to_yaml(robot),
        "logs": [_packed(log) for log in logs],
        **options,
    }
    write_text(path, strict_json({**document, "inputs": inputs}))


def load_result(path: str | Path) -> Result:
    """Reads a result file. Raises InputError naming the file and what is wrong with it."""
    path = Path(path)
    name = display_name(path)
    try:
        document = json.loads(read_bytes(path))
    except ValueError as error:
        raise InputError(f"{name}: is no JSON ({error}); give a result file") from None
    inputs = document.pop("inputs", None) if isinstance(document, dict) else None
    if not isinstance(inputs, dict):
        raise InputError(
            f"{name}: is no result file: it has no 'inputs' (write one with calibrate -o FILE or "
            "diagnose --result FILE)"
        )
    options = dict(inputs)
    try:
        command = options.pop("command")
        robot = _core.parse_robot(options.pop("robot"), f"{name}: robot")
        logs = tuple(_unpacked(packed, name) for packed in options.pop("logs"))
        made_by = str(options.pop("version"))
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{name}: its inputs are damaged: {error}; write it anew") from None
    if command not in ("calibrate", "diagnose") or not logs:
        raise InputError(
            f"{name}: its inputs are damaged: command {command!r}, {len(logs)} logs; write it anew"
        )
    return Result(command, document, robot, logs, options, made_by)


def is_result_file(path: str | Path) -> bool:
    """Whether a file is JSON, by its first character; False when it cannot be read."""
    try:
        with Path(path).open("rb") as file:
            return file.read(64).lstrip()[:1] == b"{"
    except OSError:
        return False


def calibrate_options(options: Mapping[str, Any]) -> _core.CalibrateOptions:
    """Plain data → CalibrateOptions. Raises InputError for names that do not exist."""
    try:
        return _core.CalibrateOptions(
            method=_core.parse_method(options["method"]),
            formulation=_core.parse_formulation(options["formulation"]),
            noise=_core.parse_noise_source(options["noise"]) if options["noise"] else None,
            at_s=options["at_s"],
            segment=options["segment"],
            kinematic_spacing_s=options["kinematic_spacing_s"],
        )
    except (KeyError, TypeError) as error:
        raise InputError(f"the result file's options are damaged: {error}; write it anew") from None


def calibrate_options_as_dict(options: _core.CalibrateOptions) -> dict[str, Any]:
    """CalibrateOptions → plain data."""
    noises = {_core.NoiseSource.from_data: "data", _core.NoiseSource.specified: "specified"}
    return {
        "method": "static" if options.method == _core.Method.statics else options.method.name,
        "formulation": options.formulation.name,
        "noise": None if options.noise is None else noises[options.noise],
        "at_s": list(options.at_s),
        "segment": options.segment,
        "kinematic_spacing_s": options.kinematic_spacing_s,
    }


def log_sha256(log: _core.Log) -> str:
    """Of the log as canonical CSV: the same for CSV, MCAP and raw files with the same samples."""
    return hashlib.sha256(_core.format_log(log).encode()).hexdigest()


def _packed(log: _core.Log) -> dict[str, str]:
    text = _core.format_log(log).encode()
    return {
        "name": log.source,
        "sha256": hashlib.sha256(text).hexdigest(),
        # Without a time stamp: the same log is the same text.
        "csv_gzip_base64": base64.b64encode(gzip.compress(text, mtime=0)).decode(),
    }


def _unpacked(packed: Mapping[str, str], name: str) -> _core.Log:
    try:
        stream = gzip.GzipFile(fileobj=_bytes(packed["csv_gzip_base64"]))
        text = stream.read(_LONGEST_LOG_BYTES)
    except (OSError, EOFError, ValueError, binascii.Error) as error:
        raise InputError(f"{name}: its log is damaged: {error}; write it anew") from None
    if hashlib.sha256(text).hexdigest() != packed["sha256"]:
        raise InputError(
            f"{name}: its log {packed['name']} was changed: SHA-256 does not fit; write it anew"
        )
    return _core.parse_log(text, packed["name"])


def _bytes(text: str) -> Any:
    from io import BytesIO

    return BytesIO(base64.b64decode(text, validate=True))
