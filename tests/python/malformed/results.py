"""Result files of ``calibrate -o`` and ``diagnose --result``."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from collections.abc import Callable
from typing import Any

from malformed.case import PNG, TEN_MILLION, Case, Change, cut, only, sub, swap

#: What only solving again looks at, and what is a robot file to ``report``.
REPEAT = ("times beyond the log", "segment is 99", "a list", "null", "a picture")


def _result(name: str, change: Change, words: str, base: str = "", big: bool = False) -> Case:
    command = "repeat" if name in REPEAT else ""
    return Case("result", name, change, words, base, big=big, command=command)


def _edited(edit: Callable[[Any], None]) -> Change:
    """The document, changed as data."""

    def change(data: bytes) -> bytes:
        document = json.loads(data)
        edit(document)
        return json.dumps(document).encode()

    return change


def _put(value: Any, *path: str | int) -> Change:
    def edit(document: Any) -> None:
        for step in path[:-1]:
            document = document[step]
        document[path[-1]] = value

    return _edited(edit)


def _gone(*path: str | int) -> Change:
    def edit(document: Any) -> None:
        for step in path[:-1]:
            document = document[step]
        del document[path[-1]]

    return _edited(edit)


def _log(text: bytes, packed: bytes | None = None) -> Change:
    """Another log, with the SHA-256 that fits."""
    zipped = gzip.compress(text, mtime=0) if packed is None else packed
    return _put(
        [
            {
                "name": "run.csv",
                "sha256": hashlib.sha256(text).hexdigest(),
                "csv_gzip_base64": base64.b64encode(zipped).decode(),
            }
        ],
        "inputs",
        "logs",
    )


def _gigabyte(data: bytes) -> bytes:
    """A gigabyte of zeros, gzip."""
    import zlib

    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    parts = [packer.compress(bytes(1 << 20)) for _ in range(1024)] + [packer.flush()]
    return _log(b"", b"".join(parts))(data)


LOG = ("inputs", "logs", 0)
OF_CALIBRATE = {
    "no initial pose": (_gone("initial_pose"), "initial_pose"),
    "the pose is a list": (_put([1, 2, 3], "initial_pose"), "initial_pose"),
    "the rotation is none": (
        _put([[1, 0, 0], [0, 1, 0], [0, 0, 2]], "initial_pose", "rotation"),
        "rotation",
    ),
    "the covariance is text": (_put("small", "covariance"), "covariance"),
    "the covariance is 2×2": (_put([[1, 0], [0, 1]], "covariance"), "covariance"),
    "the covariance is negative": (_put([[-1.0] * 6] * 6, "covariance"), "covariance"),
    "status is a number": (_put(3, "status"), "status"),
    "status is unknown": (_put("splendid", "status"), "status"),
    "poses are text": (_put("none", "poses"), "poses"),
    "poses are gone": (_gone("poses"), "poses"),
    "a residual is text": (_put("x", "poses", 0, "residuals"), "residuals"),
    "a pose without a time": (_gone("poses", 0, "time_s"), "time_s"),
    "residual_rms is a list": (_put([], "residual_rms"), "residual_rms"),
    "an Infinity": (swap('"cost": ', '"cost": Infinity, "x": '), "Infinity|damaged|unknown|x"),
}
INPUTS = {
    "inputs are a list": (_put([], "inputs"), "no result file"),
    "inputs missing": (_gone("inputs"), "no result file"),
    "command unknown": (_put("solve", "inputs", "command"), "command.*'solve'"),
    "command missing": (_gone("inputs", "command"), "command"),
    "command is a list": (_put(["calibrate"], "inputs", "command"), "command"),
    "robot missing": (_gone("inputs", "robot"), "robot"),
    "robot is no robot file": (_put("name: x\n", "inputs", "robot"), r"inputs\.robot:1:1"),
    "robot is a number": (_put(4, "inputs", "robot"), "robot"),
    "logs missing": (_gone("inputs", "logs"), "logs"),
    "no logs": (_put([], "inputs", "logs"), r"inputs\.logs: \[\]"),
    "logs are text": (_put("run.csv", "inputs", "logs"), "log"),
    "logs are a number": (_put(1, "inputs", "logs"), "inputs.logs: 1"),
    "log without content": (_gone(*LOG, "csv_gzip_base64"), "csv_gzip_base64"),
    "log is not base64": (_put("!!!", *LOG, "csv_gzip_base64"), "log is damaged"),
    "log is a number": (_put(5, *LOG, "csv_gzip_base64"), "csv_gzip_base64: 5"),
    "log is not gzip": (_put("aGVsbG8=", *LOG, "csv_gzip_base64"), "log is damaged"),
    "log's gzip cut": (_log(b"time_s\n0\n1\n", gzip.compress(b"time_s\n0\n1\n")[:-6]), "damaged"),
    "log changed": (_put("0" * 64, *LOG, "sha256"), "was changed"),
    "log without a name": (_gone(*LOG, "name"), "name"),
    "log's name is a number": (_put(7, *LOG, "name"), "name"),
    "log is no log": (_log(b"hello\n"), "run.csv:1: "),
    "log is of three cables": (
        _log(b"time_s,length_1_m,length_2_m,length_3_m\n0,1,1,1\n1,1,1,1\n"),
        "cables",
    ),
    "version missing": (_gone("inputs", "version"), "version"),
    "method unknown": (_put("best", "inputs", "method"), "best"),
    "method is a number": (_put(1, "inputs", "method"), "method|options are damaged"),
    "method missing": (_gone("inputs", "method"), "method"),
    "times are text": (_put("now", "inputs", "at_s"), "at_s"),
    "times beyond the log": (_put([1e9, 2e9], "inputs", "at_s"), "no sample at"),
    "segment is 10^30": (_put(10**30, "inputs", "segment"), "more digits"),
    "segment is 99": (_put(99, "inputs", "segment"), "segment"),
    "spacing is text": (_put("x", "inputs", "kinematic_spacing_s"), "kinematic_spacing_s"),
}

CASES = (
    *(_result(name, change, words) for name, (change, words) in INPUTS.items()),
    *(_result(name, change, words) for name, (change, words) in OF_CALIBRATE.items()),
    _result("diagnosis without a verdict", _gone("verdict"), "verdict", "diagnosis"),
    _result("diagnosis, effects are text", _put("all", "effects"), "effects", "diagnosis"),
    _result(
        "diagnosis, corrected is no robot", _put("x: 1", "corrected"), "corrected", "diagnosis"
    ),
    _result("diagnosis, gap is a number", _put(3, "gap"), "gap", "diagnosis"),
    _result(
        "diagnosis, poses gone", _gone("initial_pose_after"), "initial_pose_after", "diagnosis"
    ),
    _result("empty", only(b""), "no JSON|empty"),
    _result("cut", cut(0.5), "no JSON"),
    _result("an empty object", only(b"{}"), "no result file"),
    _result("a list", only(b"[]"), "no result file"),
    _result("null", only(b"null"), "no result file"),
    _result("a key twice", sub(r'"status": ', '"status": "converged", "status": '), "twice"),
    _result("a comma too many", sub(r"\}\s*$", ",}"), "no JSON"),
    _result("single quotes", only(b"{'inputs': {}}"), "no JSON"),
    _result("100,000 lists in lists", only(b'{"inputs": ' + b"[" * 100_000), "no JSON|nested"),
    _result("a number of 10,000 digits", only(b'{"inputs": ' + b"7" * 10_000 + b"}"), "no JSON"),
    _result("a picture", only(PNG), "no JSON"),
    _result("UTF-8 broken", lambda data: data.replace(b"converged", b"conv\xff", 1), "no JSON"),
    _result("NUL bytes", lambda data: data + b"\0" * 100, "no JSON"),
    _result("a log that unpacks to a gigabyte", _gigabyte, "log is damaged", big=True),
    _result(
        "ten million lines", lambda data: data + b"\n" * TEN_MILLION + b"x", "no JSON", big=True
    ),
    _result(
        "ten million numbers",
        lambda data: b'{"inputs": [' + b"1,\n" * TEN_MILLION + b"1]}",
        "over 8 million values",
        big=True,
    ),
)
