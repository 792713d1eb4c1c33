"""The robot's own ``.log``: its reader takes what is whole, says what is not."""

from __future__ import annotations

from malformed.case import TEN_MILLION, Case, Change, cell, insert, line, only

ROW = b"3,1.0,0,9,-93392,7,0,1.5,-1.9e-07,80.0,80.0,15218,1,0.2\n"


def _raw(name: str, change: Change, words: str, said: bool = False) -> Case:
    return Case("raw", name, change, words, said=said)


CELLS = {
    "time is text": (2, "now", r":13: time_s: 'now'|line 11"),
    "time is infinite": (2, "inf", ":13: time_s: is infinite"),
    "cable is text": (3, "one", ":13: cable id: 'one'"),
    "cable is 8": (3, "8", ":13: cable id: .*8"),
    "cable is 1e9": (3, "1e9", ":13: cable id: .*1e\\+09"),
    "cable is negative": (3, "-1", ":13: cable id: .*-1"),
    "cable is 1.5": (3, "1.5", ":13: cable id: .*1.5"),
    "cable is NaN": (3, "nan", ":13: cable id: .*nan"),
    "cable is empty": (3, "", ":13: cable id"),
    "length is text": (8, "x", ":13: cable length: 'x'"),
    "length has a unit": (8, "1.5m", ":13: cable length: '1.5m'"),
    "length is infinite": (8, "inf", ":13: cable length: is infinite"),
    "length is beyond double": (8, "1e999", ":13: cable length: is infinite"),
    "tension is text": (10, "slack", ":13: tension: 'slack'"),
    "set-point is text": (11, "-", ":13: tension set-point: '-'"),
    "swivel is text": (14, "0x1", ":13: swivel angle: '0x1'"),
    "swivel has an underscore": (14, "1_0", ":13: swivel angle: '1_0'"),
    "length in Arabic digits": (8, "\u0661", ":13: cable length"),
}

CASES = (
    *(_raw(name, cell(13, column, text), words) for name, (column, text, words) in CELLS.items()),
    _raw("roll is text", line(5, lambda old: b"5,0,x,0,0"), ":5: roll: 'x'"),
    _raw("roll is infinite", line(5, lambda old: b"5,0,-inf,0,0"), ":5: roll: is infinite"),
    _raw("no whole line", only(b"3,1.0,0\n5,1.0\n"), "no complete cable"),
    _raw("other lines alone", only(b"6,1.0,0,0,0\n" * 10), "no complete cable"),
    _raw("rows of a CSV log alone", only(b"0,1.5,1.6\n" * 9), "^: has no header line"),
    _raw("one line, cut", only(ROW[:-4]), "no complete cable"),
    _raw("NUL alone after a line's begin", only(b"3,1.0," + b"\0" * 1000), "no complete cable"),
    _raw("time never finite", only(b"3,nan," + ROW[6:]), "time|no samples|number"),
    _raw("NUL padding", line(11, lambda old: old + b"\0" * 512), "NUL bytes at line 11", said=True),
    _raw("NUL inside a line", line(11, lambda old: old[:10] + b"\0" * 9), "line 11", said=True),
    _raw("last line cut", lambda data: data[:-9], "the last line, \\d+, has no end", said=True),
    _raw("a ragged line", line(13, lambda old: old + b",1,2"), "line 13.*14 fields", said=True),
    _raw("an unknown type", line(11, lambda old: b"9" + old[1:]), "line 11.*type 3", said=True),
    _raw("prose between", insert(11, "emergency stop"), "line 11.*not a line", said=True),
    _raw("time goes back", cell(31, 2, "0.0"), "time goes back", said=True),
    _raw(
        "a line twice",
        lambda data: b"".join(x + b"\n" for x in data.split(b"\n")[:3] for _ in (0, 1)) + data,
        "second line of this cable|time goes back",
        said=True,
    ),
    Case("raw", "ten million lines", lambda data: ROW * TEN_MILLION, "million lines", big=True),
    Case(
        "raw",
        "ten million blank lines",
        lambda data: data + b"\n" * TEN_MILLION,
        "million lines",
        big=True,
    ),
    Case(
        "raw",
        "ten million commas",
        lambda data: b"3,1.0" + b"," * TEN_MILLION + b"\n",
        "no complete cable",
        big=True,
    ),
    Case(
        "raw",
        "100 million NULs",
        lambda data: ROW + b"\0" * 100_000_000,
        "NUL bytes at line 2",
        big=True,
        said=True,
    ),
)
