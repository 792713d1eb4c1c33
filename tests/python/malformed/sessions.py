"""Session files: which device is which cable."""

from __future__ import annotations

from malformed.case import PNG, TEN_MILLION, Case, Change, aliases, cut, only, sub, swap

HERE = r":\d+:\d+: .*"


def _session(name: str, change: Change, words: str, big: bool = False) -> Case:
    return Case("session", name, change, words, big=big)


FIELDS = {
    "rate is text": ("rate_Hz: 100\n", "rate_Hz: fast\n", "rate_Hz: .*'fast'"),
    "rate is too low": ("rate_Hz: 100\n", "rate_Hz: 10\n", ":6:10: rate_Hz: .*50"),
    "rate is NaN": ("rate_Hz: 100\n", "rate_Hz: .nan\n", "rate_Hz: "),
    "rate is infinite": ("rate_Hz: 100\n", "rate_Hz: .inf\n", "rate_Hz: "),
    "rate is a list": ("rate_Hz: 100\n", "rate_Hz: [100]\n", "rate_Hz: "),
    "rate is true": ("rate_Hz: 100\n", "rate_Hz: true\n", "rate_Hz: "),
    "rate has 10,000 digits": ("rate_Hz: 100\n", f"rate_Hz: {'7' * 10_000}\n", "rate_Hz|YAML"),
    "rate is null": ("rate_Hz: 100\n", "rate_Hz:\n", "rate_Hz: "),
    "format of another version": ("session-1", "session-2", "format: "),
    "format missing": ("format: cdprcal-session-1\n", "", ":4:1: format: is missing"),
    "robot is a number": ("robot: irma4", "robot: 4", "robot: "),
    "unknown key": ("mode: velocity", "mode: velocity\nspeed: 3", "speed: is not known here"),
    "unknown key in another case": (
        "rate_Hz: 100\n",
        "rate_hz: 100\n",
        r":6:1: rate_hz: is not known here; use one of format, robot, .*rate_Hz",
    ),
    "unknown key below": ("counts_per_m: 1e7", "counts_m: 1e6", r":\d+:5: winches\[#1\]\.counts_"),
    "misspelt": (
        "counts_per_m: 1e7",
        "counts_pr_m: 1e7",
        r":15:5: winches\[#1\]\.counts_per_m: is missing, "
        r"and counts_pr_m is not known there; correct its name",
    ),
    "missing below": (" quick_stop_m_s2: 4", "", r":9:9: limits\.quick_stop_m_s2: is missing"),
    "unknown mode": ("mode: velocity", "mode: position", ":7:7: mode: .*'position'"),
    "duplicate key": ("robot: irma4", "robot: irma4\nrobot: b", ":6:1: found duplicate key"),
    "bus is text": ("bus: {", "bus: can0\nbuses: {", "bus"),
    "bus of another type": ("type: canopen", "type: modbus", ":8:6: bus: .*'canopen', 'ethercat'"),
    "bus of no type": ("type: canopen, ", "", ":8:6: bus: "),
    "bus without an interface": ("interface: virtual, ", "", r"bus\.interface: is missing"),
    "bus interface real": ("interface: virtual", "interface: socketcan", r"bus\.interface: simul"),
    "AHRS alone simulated": (
        "interface: virtual",
        "interface: udp_multicast",
        r"ahrs\.port: simulated",
    ),
    "limits reversed": (
        "[10, 420]",
        "[420, 10]",
        r":9:21: limits\.tension_N: the first must be",
    ),
    "limits are three": ("[10, 420]", "[10, 20, 420]", r"limits\.tension_N: "),
    "limits with infinity": ("[10, 420]", "[10, .inf]", r"limits\.tension_N.*"),
    "speed zero": ("velocity_m_s: 0.4", "velocity_m_s: 0", r"limits\.velocity_m_s: "),
    "speed is text": ("velocity_m_s: 0.4", "velocity_m_s: fast", r"limits\.velocity_m_s: .*'fast'"),
    "speed in mm/s": ("velocity_m_s: 0.4", "velocity_mm_s: 400", r"limits\.velocity_"),
    "brakes are text": ("brakes: true", "brakes: 'true'", r"safety\.brakes: "),
    "brakes missing": ("{brakes: true}", "{}", r"safety\.brakes: is missing"),
    "cable 9": ("cable: 4", "cable: 9", r"winches\[#4\]\.cable"),
    "cable left out": ("cable: 4", "cable: 5", r":\d+:12: winches\[#4\]\.cable: 4 winches need"),
    "cable 0": ("cable: 4", "cable: 0", r"winches\[#4\]\.cable"),
    "cable twice": ("cable: 4", "cable: 3", r":\d+:12: winches\[#4\]\.cable: 4 winches need"),
    "cable is a float": ("cable: 4", "cable: 4.0", r"winches\[#4\]\.cable"),
    "node 0": ("node: 2", "node: 0", r"winches\[#2\]\.node"),
    "node 128": ("node: 2", "node: 128", r"winches\[#2\]\.node"),
    "node twice": ("node: 2", "node: 1", r":20:11: winches\[#2\]\.node: another winch has"),
    "node of the master": ("node: 2", "node: 127", r":20:11: .*\[#2\]\.node: is bus\.master_node"),
    "sign 0": ("sign: -1", "sign: 0", r":21:11: winches\[#2\]\.sign: .* not '0'"),
    "scale negative": ("counts_per_m: 1e7", "counts_per_m: -3", r":15:19: .*counts_per_m: .*'-3'"),
    "scale infinite": ("counts_per_m: 1e7", "counts_per_m: .inf", "counts_per_m: .*finite"),
    "scale beyond double": ("counts_per_m: 1e7", "counts_per_m: 1e999", r"counts_per_m"),
    "object of one part": ("0x2401:01", "0x2401", r"load_cell\.object: write an object as"),
    "object without 0x": (
        "0x2401:01",
        "2401",
        r"load_cell\.object: write an object as 0xINDEX:SUB",
    ),
    "object too high": ("0x2401:01", "0x12401:01", r"load_cell\.object"),
    "integer type unknown": ("type: int32", "type: int33", r"load_cell\.type"),
    "AHRS rate 0": (
        "port: simulated, rate_Hz: 100",
        "port: simulated, rate_Hz: 0",
        r"ahrs\.rate_Hz",
    ),
    "AHRS frame unknown": ("frame: ENU", "frame: XYZ", r"ahrs\.frame"),
    "AHRS mounting of two": ("[0, 0, 90]", "[0, 90]", r"ahrs\.mounting_deg"),
    "flow not closed": ("[10, 420]", "[10, 420", r":9:\d+: expected"),
    "tab as indent": ("    node: 2", "\tnode: 2", "."),
    "unknown anchor": ("robot: irma4", "robot: *name", "undefined alias"),
    "a Python object": ("robot: irma4", "robot: !!python/object/apply:os.system [ls]", "robot|tag"),
    "an unknown tag": ("rate_Hz: 100\n", "rate_Hz: !rate 100\n", "rate_Hz|tag"),
    "a date": ("robot: irma4", "robot: 2024-01-01", "robot: "),
    "a merge of itself": ("robot: irma4", "robot: &r {<<: *r}", "."),
    "a control character": ("robot: irma4", "robot: \x01", "."),
}

CASES = (
    *(
        _session(name, swap(old, new), words if words[0] == ":" else r":(\d+:\d+:)? .*" + words)
        for name, (old, new, words) in FIELDS.items()
    ),
    _session("no winches", sub(r"^winches:.*?(?=^ahrs)", "winches: []\n"), HERE + "winches"),
    _session(
        "nine winches", sub(r"(^  - cable: 1.*?)(?=^  - cable: 2)", r"\1" * 6), HERE + "winches"
    ),
    _session(
        "winches as a mapping", sub(r"^winches:.*?(?=^ahrs)", "winches: {a: 1}\n"), HERE + "winches"
    ),
    _session("empty", only(b""), HERE + "a session file is a map"),
    _session("a list", only(b"- 1\n"), HERE + "a session file is a map"),
    _session("two documents", lambda data: data + b"---\na: 1\n", "."),
    _session("cut", cut(0.5), HERE),
    _session("aliases of aliases", aliases, "alias|a0"),
    _session(
        "a mapping that holds itself", lambda data: data + b"more: &m {a: *m}\n", "alias|more"
    ),
    _session("10,000 lists in lists", lambda data: data + b"more: " + b"[" * 10_000, "."),
    _session(
        "5,000 nested blocks",
        lambda data: (
            data + b"more:\n" + b"".join(b" " * i + b"- \n" for i in range(1, 250)) + b"[" * 2000
        ),
        ".",
    ),
    _session("a picture", only(PNG), "UTF-8|not YAML"),
    _session("Latin-1", lambda data: data.replace(b"irma4", b"irm\xe4"), "UTF-8"),
    _session("UTF-16", lambda data: data.decode().encode("utf-16"), ":1: is UTF-16 text; save it"),
    _session("NUL inside", swap("robot: irma4", "robot: \0"), "."),
    _session("a robot file instead", only(b"name: irma4\ngravity_m_s2: 9.81\n"), HERE),
    _session("ten million lines", lambda data: data + b"\n" * TEN_MILLION, "over", big=True),
    _session(
        "a megabyte of keys",
        lambda data: data + b"".join(b"k%d: 1\n" % i for i in range(100_000)),
        "over",
        big=True,
    ),
)
