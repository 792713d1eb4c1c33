"""Canonical CSV logs, and those that ``acquire`` wrote."""

from __future__ import annotations

import gzip

from malformed.case import (
    PNG,
    TEN_MILLION,
    ZIP,
    Case,
    Change,
    cell,
    cut,
    insert,
    line,
    only,
    sub,
    swap,
)

HEADER = b"time_s,length_1_m,tension_1_N\n"


def _log(name: str, change: Change, words: str) -> Case:
    return Case("csv", name, change, words)


def _in_header(old: str, new: str) -> Change:
    """Other text in the first line: a separator everywhere, a name once."""
    count = -1 if len(old) == 1 else 1
    return line(1, lambda text: text.replace(old.encode(), new.encode(), count))


def _rows(count: int, row: str = "{0},1,2\n") -> bytes:
    return HEADER + "".join(row.format(i) for i in range(count)).encode()


CELLS = {
    "text": ("abc", "'abc' is not a number"),
    "a unit": ("1.5m", "'1.5m' is not a number"),
    "a decimal comma as a semicolon": ("1;5", "'1;5' is not a number"),
    "hexadecimal": ("0x10", "'0x10' is not a number"),
    "beyond double": ("1e400", "beyond double"),
    "infinity": ("inf", "infinite"),
    "minus infinity": ("-Infinity", "infinite"),
    "two signs": ("+-1", "'\\+-1' is not a number"),
    "two numbers": ("1 2", "'1 2' is not a number"),
    "quoted": ('"1.5"', "is not a number"),
    "a fraction": ("1/2", "is not a number"),
    "NA": ("NA", "leave the cell empty"),
    "a date": ("2024-01-01", "is not a number"),
    "Fortran's exponent": ("1.5D3", "is not a number"),
    "a megabyte": ("7" * 1_000_000, "'7{40}…' is beyond double"),
    "a formula": ("=A1+1", "is not a number"),
}
HEADERS = {
    "time column missing": ("time_s,", "t,", "'t'|time_s"),
    "time in ms": ("time_s", "time_ms", "time_ms"),
    "length in mm": ("length_1_m", "length_1_mm", "length_1_mm"),
    "yaw in degrees": ("yaw_rad", "yaw_deg", "yaw_deg"),
    "a gap in the cables": ("length_2_m", "length_9_m", "length_9_m|length"),
    "cable 0": ("length_1_m", "length_0_m", "length_0_m"),
    "cable 01": ("length_1_m", "length_01_m", "length_01_m"),
    "cable 2147483648": ("length_1_m", "length_2147483648_m", "length_2147483648_m"),
    "cable -1": ("length_1_m", "length_-1_m", "length_-1_m"),
    "twice": ("pitch_rad", "roll_rad", "roll_rad"),
    "pitch missing": ("pitch_rad", "tension_9_N", "tension_9_N|pitch"),
    "unknown": ("yaw_rad", "temperature_C", "temperature_C"),
    "other case": ("time_s", "Time_s", "Time_s"),
    "semicolons": (",", ";", "time_s;|column|comma"),
    "tabs": (",", "\t", "column|time_s"),
    "no-break space": ("time_s,", "time_s\u00a0,", "column"),
}

CASES = (
    *(
        _log(f"a cell is {name}", cell(30, 2, text), words=rf":30: column length_1_m: .*{words}")
        for name, (text, words) in CELLS.items()
    ),
    *(
        _log(
            f"header: {name}",
            _in_header(old_text, new),
            words=f":1: .*({words})",
        )
        for name, (old_text, new, words) in HEADERS.items()
    ),
    _log("header: 100,000 columns", only(b"time_s," + b"x," * 100_000 + b"\n"), words=":1: "),
    _log(
        "header: nine cables",
        only(",".join(["time_s", *(f"length_{i}_m" for i in range(1, 10))]).encode() + b"\n"),
        words=":1: column length_9_m",
    ),
    _log("header: trailing comma", line(1, lambda old: old + b","), words=":1: "),
    _log("header missing", lambda data: data.split(b"\n", 1)[1], words=": .*(raw|header|column)"),
    _log("header twice", lambda data: data.split(b"\n")[0] + b"\n" + data, words=":2: "),
    _log("header cut", only(b"time_s,length_1_m,len"), words=":1: .*'?len'?"),
    _log("header alone", lambda data: data.split(b"\n")[0] + b"\n", words=":1: no samples"),
    _log("header without a line end", lambda data: data.split(b"\n")[0], words=":1: no samples"),
    _log("empty", only(b""), words=": is empty"),
    _log("blank lines", only(b"\n\n \n"), words=": is empty"),
    _log("comments alone", only(b"# a log\n"), words=": is empty"),
    _log("a BOM alone", only(b"\xef\xbb\xbf"), words=": is empty"),
    _log("a cell too many", line(30, lambda old: b"1," + old), words=":30: .*cells"),
    _log("a cell too few", line(30, lambda old: old.split(b",", 1)[1]), words=":30: .*cells"),
    _log("one cell", line(30, lambda old: b"1"), words=":30: .*1 cells"),
    _log("a blank line", insert(30, ""), words=":30: a blank line"),
    _log("prose between", insert(30, "the robot was stopped here"), words=":30: "),
    _log("the header again", lambda data: data + data, words=r":\d+: "),
    _log("time NaN", cell(30, 1, "nan"), words=":30: column time_s"),
    _log("time empty", cell(30, 1, ""), words=":30: column time_s.*empty"),
    _log("time infinite", cell(30, 1, "inf"), words=":30: column time_s.*infinite"),
    _log("time as a clock", cell(30, 1, "12:00:01"), words=":30: column time_s"),
    _log("a picture", only(PNG), words=r":\d+: .*binary"),
    _log("an archive", only(ZIP), words="is a ZIP archive.*; unpack it"),
    _log("gzip, cut", lambda data: gzip.compress(data, mtime=0)[:-9], words="packed.*not whole"),
    _log(
        "UTF-16",
        lambda data: data.decode().encode("utf-16"),
        words=":1: is UTF-16 text; save it as",
    ),
    _log("UTF-32", lambda data: data.decode().encode("utf-32"), words=r":\d+: .*(UTF|binary)"),
    _log("Latin-1 in a header", swap("length_1_m", "l\u00e4nge_1_m"), words=":1: "),
    _log("bytes above 127", only(bytes(range(128, 256)) * 20), words=":1: "),
    _log("old Macintosh line ends", lambda data: data.replace(b"\n", b"\r"), words=":1: "),
    _log("a robot file instead", lambda data: b"name: irma4\ngravity_m_s2: 9.81\n", words=":1: "),
    _log("a plan instead", lambda data: b"# robot: x\npurpose,position_x_m\n", words=":2: "),
    _log("JSON instead", only(b'{"status": "converged"}\n'), words=":1: "),
    _log("HTML instead", only(b"<!DOCTYPE html><html></html>"), words=":1: "),
    _log("a script instead", only(b"#!/bin/sh\nrm -rf /\n"), words=":2: "),
    _log("three cables", sub(r",length_4_m", ""), words=":1: column length_4_m"),
    _log("an endless line", only(HEADER + b"1," * 5_000_000), words=":2: .*cells"),
    Case("csv", "NUL bytes", cell(30, 2, "\0\0\0"), ":30: .*NUL|NUL bytes at line 30", said=True),
    Case("csv", "NUL at the end", lambda d: d + b"\0" * 4096, "NUL|nul_padding", said=True),
    Case("csv", "cut in the last row", lambda d: d[:-150], "cut", said=True),
    Case("csv", "time goes back", cell(30, 1, "0"), "time.*30|:30: column time_s", said=True),
    *(
        Case("csv", f"time goes back, to {by}", cell(30, 1, "0"), ":30: .*time_s.*incr", command=by)
        for by in ("calibrate", "import")
    ),
    Case(
        "csv",
        "time stands",
        line(30, lambda old: b"0.1," + old.split(b",", 1)[1]),
        "time.*30|:30: column time_s",
        said=True,
    ),
    Case("csv", "acquired, then killed", cut(0.7), "unfinished|killed", "acquired", said=True),
    Case("csv", "acquired, header lost", cut(0.01), ": is empty|no samples", "acquired"),
    Case(
        "csv",
        "ten million rows",
        lambda d: HEADER + b"0,1,2\n" * TEN_MILLION,
        r":3: column time_s|over \d+ (million|lines)|too many",
        big=True,
    ),
    Case("csv", "ten million good rows", lambda d: _many_rows(), "million lines", big=True),
    Case(
        "csv",
        "ten million empty lines",
        lambda d: d + b"\n" * TEN_MILLION,
        "blank line|million lines",
        big=True,
    ),
    Case(
        "csv",
        "ten million commas",
        lambda d: HEADER + b"1" + b"," * TEN_MILLION,
        ":2: .*cells",
        big=True,
    ),
)


def _many_rows() -> bytes:
    """Ten million rows whose time increases."""
    import numpy as np

    rows = np.empty((TEN_MILLION, 13), dtype=np.uint8)
    number = np.arange(TEN_MILLION, dtype=np.int32)
    for place in range(8):
        rows[:, 7 - place] = number % 10 + ord("0")
        number //= 10
    rows[:, 8:] = np.frombuffer(b",1,2\n", dtype=np.uint8)
    return HEADER + rows.tobytes()
