"""Result files: what came out together with all it was made from, so that it can be solved again.

A result file is the document of ``--json`` with one more key, ``inputs``: the robot file, the
options, and the logs themselves (canonical CSV, gzip, base64), each with its SHA-256.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.io.files import begins_with, read_bytes, shown_path, write_text
from cdprcal.io.json_document import parse_json, require_schema

Command = Literal["calibrate", "diagnose"]
#: Of the file; logs take a third of their size as CSV in it.
_MOST_BYTES = 256 << 20
#: A log's CSV over its gzip. Readings have noise: three or four; eight cables that never move: 40.
_MOST_RATIO = 100
_ROTATION_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Result:
    """A result as a file keeps it. ``options`` are those of the command, as plain data.

    ``source`` is what messages call the file.
    """

    command: Command
    document: dict[str, Any]
    robot: _core.Robot
    logs: tuple[_core.Log, ...]
    options: dict[str, Any]
    version: str
    source: str = "result file"


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
    write_text(path, result_text(command, document, robot, logs, options))


def result_text(
    command: Command,
    document: Mapping[str, Any],
    robot: _core.Robot,
    logs: Sequence[_core.Log],
    options: Mapping[str, Any],
) -> str:
    """What a result file holds."""
    from cdprcal.results import strict_json

    inputs = {
        "command": command,
        "version": cdprcal_version(),
        "robot": _core.to_yaml(robot),
        "logs": [_packed(log) for log in logs],
        **options,
    }
    return strict_json({**document, "inputs": inputs})


def load_result(path: str | Path) -> Result:
    """Reads a result file. Raises InputError naming the file and what is wrong with it."""
    path = Path(path)
    name = shown_path(path)
    document = parse_json(read_bytes(path, _MOST_BYTES), name)
    inputs = document.get("inputs") if isinstance(document, dict) else None
    if not isinstance(inputs, dict):
        raise InputError(
            f"{name}: is no result file: it has no 'inputs' (write one with calibrate -o FILE or "
            "diagnose -o FILE.json)"
        )
    command: Any = inputs.get("command")
    if command not in ("calibrate", "diagnose"):
        raise InputError(
            f"{name}: inputs.command: {str(command)[:40]!r} is neither calibrate nor diagnose"
        )
    require_schema(document, f"{command}-result", name)
    _require_sense(document, name)
    options = dict(document.pop("inputs"))
    del options["command"]
    robot = _core.parse_robot(options.pop("robot"), f"{name}: inputs.robot")
    logs = tuple(_unpacked(packed, name) for packed in options.pop("logs"))
    for log in logs:
        if log.cable_count not in (0, robot.cable_count):
            raise InputError(
                f"{name}: is damaged: its log has {log.cable_count} cables, its robot "
                f"{robot.cable_count}; write it anew"
            )
    if "corrected" in document:
        _core.parse_robot(document["corrected"], f"{name}: corrected")
    return Result(command, document, robot, logs, options, options.pop("version"), name)


@contextmanager
def naming(source: str) -> Iterator[None]:
    """Every InputError inside begins with the name of the file that it comes from."""
    try:
        yield
    except InputError as error:
        said = str(error)
        raise InputError(said if said.startswith(source) else f"{source}: {said}") from None


def is_result_file(path: str | Path) -> bool:
    """Whether a file is JSON, by its first character; False when it cannot be read."""
    return begins_with(Path(path), 64).lstrip()[:1] == b"{"


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
        said = str(error).split("\n", 1)[0]
        raise InputError(f"the result file's options are damaged: {said}; write it anew") from None


def diagnose_options(options: Mapping[str, Any]) -> _core.DiagnoseOptions:
    """Plain data → DiagnoseOptions."""
    return _core.DiagnoseOptions(motion=bool(options.get("motion")), effects=options.get("effects"))


def calibrate_options_as_dict(
    options: _core.CalibrateOptions, *, motion: bool = False
) -> dict[str, Any]:
    """CalibrateOptions → plain data; ``motion``: whether the balance counts in motion too."""
    noises = {_core.NoiseSource.from_data: "data", _core.NoiseSource.specified: "specified"}
    return {
        "method": "static" if options.method == _core.Method.statics else options.method.name,
        "formulation": options.formulation.name,
        "noise": None if options.noise is None else noises[options.noise],
        "at_s": list(options.at_s),
        "segment": options.segment,
        "kinematic_spacing_s": options.kinematic_spacing_s,
        **({"motion": True} if motion else {}),
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
        zipped = base64.b64decode(packed["csv_gzip_base64"], validate=True)
        most = _MOST_RATIO * len(zipped)
        text = gzip.GzipFile(fileobj=BytesIO(zipped)).read(most + 1)
    except (OSError, EOFError, ValueError, zlib.error) as error:
        raise InputError(f"{name}: its log is damaged: {error}; write it anew") from None
    if len(text) > most:
        raise InputError(
            f"{name}: its log is damaged: it unpacks to far more than any log; write it anew"
        )
    if hashlib.sha256(text).hexdigest() != packed["sha256"]:
        raise InputError(
            f"{name}: its log {packed['name']} was changed: SHA-256 does not fit; write it anew"
        )
    with naming(name):
        return _core.parse_log(text, packed["name"])


def _require_sense(document: Mapping[str, Any], name: str) -> None:
    """What a schema cannot say: rotations are rotations, variances positive, or zero where the
    platform cannot move."""
    poses = [
        document.get(key) for key in ("initial_pose", "initial_pose_before", "initial_pose_after")
    ]
    poses += document.get("poses", [])
    rotations = np.array([pose["rotation"] for pose in poses if pose is not None], dtype=float)
    if rotations.size:
        apart = np.abs(rotations @ np.swapaxes(rotations, 1, 2) - np.eye(3)).max()
        if not (apart < _ROTATION_TOLERANCE and np.all(np.linalg.det(rotations) > 0.0)):
            raise InputError(f"{name}: is damaged: a rotation in it is none; write it anew")
    for key in ("covariance", "covariance_before", "covariance_after"):
        covariance = document.get(key)
        if covariance is None:
            continue
        variance = np.diag(np.array(covariance, dtype=float))
        if not (np.all(variance >= 0.0) and np.any(variance > 0.0)):
            raise InputError(
                f"{name}: is damaged: {key}: a variance is not positive; write it anew"
            )
