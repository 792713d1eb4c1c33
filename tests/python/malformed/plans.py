"""Plan files."""

from __future__ import annotations

from malformed.case import (
    PNG,
    TEN_MILLION,
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


def _plan(name: str, change: Change, words: str, big: bool = False) -> Case:
    return Case("plan", name, change, words, big=big)


CELLS = {
    "purpose unknown": (1, "look", "purpose: 'look'"),
    "purpose empty": (1, "", "purpose"),
    "position is text": (2, "left", "position_x_m: must be a number, not 'left'"),
    "position is NaN": (2, "nan", "position_x_m: must be finite"),
    "position is infinite": (3, "inf", "position_y_m: must be finite"),
    "position beyond double": (4, "1e999", "position_z_m"),
    "position in mm": (2, "400 mm", "position_x_m: must be a number, not '400 mm'"),
    "quaternion not of norm 1": (5, "0.5", "norm"),
    "quaternion zero": (5, "0", "norm"),
    "quaternion huge": (5, "1e300", "norm"),
    "tension zero": (9, "0", "tension_1_N: a tension must be positive"),
    "tension negative": (9, "-5", "tension_1_N"),
    "tension NaN": (9, "nan", "tension_1_N"),
    "tension empty": (9, "", "tension_1_N"),
    "time negative": (13, "-1", "transition_s: must not be negative"),
    "time infinite": (13, "inf", "transition_s"),
    "dwell is text": (14, "long", "dwell_s: must be a number, not 'long'"),
    "frequency negative": (15, "-1", "natural_frequency_1_hz"),
}
COMMENTS = {
    "start_tension_N": ("0, 1, 1, 1", "positive"),
    "start_position_m": ("0, 0", "has 2 values; give 3"),
    "start_quaternion_wxyz": ("1, 1, 0, 0", "norm"),
    "start_dwell_s": ("-2", "negative"),
    "stops": ("many", "'many'"),
    "predicted_standard_deviation_m_rad": ("1", "has 1 values; give 6"),
}

CASES = (
    *(
        _plan(name, cell(11, column, text), rf":11:\d+: .*{words}")
        for name, (column, text, words) in CELLS.items()
    ),
    *(
        _plan(f"{key} wrong", sub(rf"^# {key}: .*?$", f"# {key}: {text}"), rf":\d+:\d+: .*{words}")
        for key, (text, words) in COMMENTS.items()
    ),
    _plan("robot missing", line(3, lambda old: b"#"), "# robot: … ?' is missing|robot"),
    _plan("robot without a name", line(3, lambda old: b"# robot:"), ":3:.*name is missing"),
    _plan("stops missing", line(8, lambda old: b"#"), "stops"),
    _plan("a comment twice", insert(3, "# stops: 2"), "appears twice"),
    _plan(
        "column unknown", swap("dwell_s,nat", "dwell_ms,nat"), r":10:\d+: unknown column 'dwell_ms'"
    ),
    _plan("column missing", swap(",dwell_s,", ",natural_frequency_9_hz,"), ":10:"),
    _plan("column twice", swap("position_y_m", "position_x_m"), r":10:\d+: column .* twice"),
    _plan("tensions skip a number", swap("tension_2_N", "tension_7_N"), r":10:\d+: "),
    _plan("row cut", lambda data: data[:-60], r":12:\d+: .*cut"),
    _plan("a row too many", lambda data: data + data.split(b"\n")[-2] + b"\n", "3 stops where 2"),
    _plan("a row lost", line(12, lambda old: b""), "1 stops where 2"),
    _plan("cut in the header", cut(0.3), ": "),
    _plan(
        "three tensions at the start",
        sub(r"^(# start_tension_N: .*?),[^,]*?$", r"\1"),
        "start_tension_N has 3",
    ),
    _plan(
        "nine tensions at the start",
        sub(r"^# start_tension_N: .*?$", "# start_tension_N: " + "1, " * 8 + "1"),
        "at most 8",
    ),
    _plan("tensions beyond the limits", cell(11, 9, "4000"), "tension|limit"),
    _plan("a stop outside", cell(11, 2, "90"), "cannot be run|equilibrium|balance"),
    _plan("empty", only(b""), ":1:1: holds no table"),
    _plan("comments alone", only(b"# robot: irma4\n# stops: 1\n"), "holds no table"),
    _plan("NUL inside", cell(11, 2, "\0"), r":11:\d+: holds NUL"),
    _plan("a picture", only(PNG), ":1:.*(NUL|unknown column)"),
    _plan("UTF-16", lambda data: data.decode().encode("utf-16"), ":1: is UTF-16 text; save it"),
    _plan("a log instead", only(b"time_s,length_1_m\n0,1\n"), r":1:\d+: unknown column 'time_s'"),
    _plan("a robot file instead", only(b"name: irma4\n"), ":1:1: unknown column 'name: irma4'"),
    _plan("100,000 columns", only(b",".join(b"c%d" % i for i in range(100_000)) + b"\n"), ":1:"),
    _plan(
        "ten million rows", lambda data: data + b"measure\n" * TEN_MILLION, "over|cells", big=True
    ),
)
