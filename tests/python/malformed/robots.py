"""Robot files."""

from __future__ import annotations

from malformed.case import (
    PNG,
    TEN_MILLION,
    Case,
    Change,
    aliases,
    cut,
    insert,
    line,
    only,
    sub,
    swap,
)

HERE = r":\d+:\d+: .*"


def _field(name: str, change: Change, words: str) -> Case:
    return Case("robot", name, change, HERE + words)


def _effect(name: str, text: str, words: str) -> Case:
    return _field(name, lambda data: data + b"effects:\n" + text.encode(), words)


SCALARS = {
    "NaN": (".nan", "finite"),
    "infinity": (".inf", "finite"),
    "nan without a dot": ("nan", "number"),
    "beyond double": ("1e999", "beyond double"),
    "text": ("heavy", "'heavy'"),
    "with its unit": ("12.992 kg", "'12.992 kg'"),
    "decimal comma": ("12,992", "'12,992'"),
    "thousands": ("12_992", "'12_992'"),
    "hexadecimal": ("0x1F", "'0x1F'"),
    "a quoted number": ("'12.992'", "text '12.992'"),
    "nothing": ("", "not empty"),
    "null": ("null", "number"),
    "true": ("true", "'true'"),
    "a list": ("[12.992]", "not a list"),
    "a mapping": ("{kg: 12.992}", "not a mapping"),
    "zero": ("0", "positive"),
    "negative": ("-12.992", "positive"),
    "200,000 digits": ("1" * 200_000, "beyond double"),
}
VECTORS = {
    "two": ("[0, 0]", "3 numbers, but has 2"),
    "four": ("[0, 0, 0, 0]", "3 numbers, but has 4"),
    "a scalar": ("7", "3 numbers, not a single value"),
    "text inside": ("[0, x, 0]", "'x'"),
    "nested": ("[[0, 0, 0]]", "3 numbers, but has 1"),
    "NaN": ("[0, .nan, 0]", "finite"),
    "empty": ("[]", "3 numbers, but has 0"),
}

CASES = (
    *(
        _field(f"mass is {name}", swap("12.992", text), rf"platform\.mass_kg: .*{words}")
        for name, (text, words) in SCALARS.items()
    ),
    *(
        _field(
            f"centre of mass is {name}",
            swap("[0, 0, 0.173]", text),
            rf"platform\.centre_of_mass_m.*{words}",
        )
        for name, (text, words) in VECTORS.items()
    ),
    _field("unknown key", swap("gravity_m_s2", "gravty_m_s2"), "did you mean gravity_m_s2"),
    _field("radius in mm", swap("radius_m:", "radius_mm:"), "did you mean radius_m"),
    _field("unit left out", swap("mass_kg", "mass"), "did you mean mass_kg"),
    _field("sigma in cm", swap("length_m: 0.01", "length_cm: 1"), "length_cm"),
    _field("angle twice", swap("swivel_deg: 1", "swivel_deg: 1, swivel_rad: 0.02"), "degrees too"),
    _field("duplicate key", swap("name: irma4\n", "name: irma4\nname: irma4\n"), "given twice"),
    _field("duplicate key inside", swap("radius_m:", "radius_m: 0.03, radius_m:"), "given twice"),
    _field("key is a list", insert(2, "? [1, 2]\n: 3"), "a key must be text"),
    _field("key missing", line(5, lambda old: b""), r"platform\.mass_kg: is missing"),
    _field("no cables", sub(r"^cables:.*?(?=^tension)", "cables: []\n"), "cables"),
    _field("cables are a number", sub(r"^cables:.*?(?=^tension)", "cables: 4\n"), "cables.*list"),
    _field(
        "nine cables",
        sub(r"(^  - pulley.*?\n.*?\n)", r"\1\1\1\1\1\1"),
        "cables.*(8|at most)",
    ),
    _field(
        "100,000 cables",
        sub(r"^cables:.*?(?=^tension)", "cables: [" + "1," * 100_000 + "1]\n"),
        "cables",
    ),
    _field("gravity is NaN", swap("9.81", ".nan"), "gravity_m_s2"),
    _field(
        "zero axis",
        swap("swivel_axis: [1, 0, 0]", "swivel_axis: [0, 0, 0]"),
        r"cables\[#1\]\.pulley\.swivel_axis",
    ),
    _field(
        "anchor of two numbers",
        sub(r"platform_anchor_m: \[[^]]*\]", "platform_anchor_m: [0, 0]"),
        r"cables\[#1\]\.platform_anchor_m",
    ),
    _field(
        "parallel axes", swap("x_axis: [0, 0, -1]", "x_axis: [1, 0, 0]"), r"pulley\.x?_?axis|axis"
    ),
    _field("negative radius", swap("radius_m: 0.03", "radius_m: -0.03"), "radius_m"),
    _field("limits reversed", swap("[20, 400]", "[400, 20]"), "tension_limits_N"),
    _field("limits negative", swap("[20, 400]", "[-20, 400]"), "tension_limits_N"),
    _field("one limit", swap("[20, 400]", "[400]"), "tension_limits_N.*2 numbers"),
    _field(
        "inertia has two rows",
        sub(r"inertia_kg_m2: .*?\]\]", "inertia_kg_m2: [[1, 0, 0], [0, 1, 0]]"),
        "inertia",
    ),
    _field("inertia not symmetric", swap("[0.18396, 0, 0]", "[0.18396, 0.1, 0]"), "inertia"),
    _field("inertia of no body", swap("0.11545", "11.545"), "inertia"),
    _field("inertia negative", swap("0.11545", "-0.11545"), "inertia"),
    _field("inertia is text", sub(r"inertia_kg_m2: .*?\]\]", "inertia_kg_m2: solid"), "inertia"),
    _field("convention unknown", swap("convention: XYZ", "convention: ABC"), "XYZ, XZY"),
    _field("convention is a list", swap("convention: XYZ", "convention: [X, Y, Z]"), "text"),
    _field("sigma zero", swap("tension_N: 10", "tension_N: 0"), r"sigma\.tension_N"),
    _field("sigma negative", swap("swivel_deg: 1", "swivel_deg: -1"), r"sigma\.swivel"),
    _field("name is a list", swap("name: irma4", "name: [irma4]"), "name: must be text"),
    _field("name is empty", swap("name: irma4", "name: ''"), "name"),
    _field("flow never closed", swap("name: irma4", "name: [irma4"), "not YAML"),
    _field("tab as indent", swap("  mass_kg", "\tmass_kg"), "not YAML"),
    _field("cut in a list", cut(0.35), "not YAML|missing"),
    _field("cut at a key", cut(0.12), "."),
    _field("two documents", lambda data: data + b"---\n" + data, "second document"),
    _field("unknown anchor", swap("12.992", "*mass"), "not YAML"),
    _field("aliases of aliases", aliases, "unknown key"),
    _field("a list that holds itself", swap("[0, 0, 0.173]", "&a [*a, *a, *a]"), "."),
    _field("10,000 lists in lists", swap("12.992", "[" * 10_000 + "]" * 10_000), "nested|YAML"),
    _field("10,000 mappings in mappings", only(b"{a: " * 10_000), "nested|YAML|unknown"),
    _field("a list at the top", only(b"- name: irma4\n"), "must be a mapping"),
    _field("a word", only(b"irma4\n"), "must be a mapping"),
    _field("JSON of something else", only(b'{"name": "x", "version": 2}'), "version"),
    _field("a template with blanks", swap("12.992", "FILL"), "'FILL'"),
    _effect("unknown effect", "  - name: rust\n", "rust"),
    _effect("effect without parameters", "  - name: mass\n", "mass_error_kg"),
    _effect("effect of another shape", "  - {name: load_cell_bias, bias_N: [1, 2]}\n", "4 numbers"),
    _effect("effect with an unknown key", "  - {name: mass, mass_error_g: 1}\n", "mass_error_kg"),
    _effect("effect NaN", "  - {name: mass, mass_error_kg: .nan}\n", "finite"),
    _effect("effects as a mapping", "  mass: 1\n", "effects.*list"),
    _effect("effect without a name", "  - {mass_error_kg: 1}\n", "name|unknown key"),
    Case("robot", "empty", only(b""), ": is empty"),
    Case("robot", "comments alone", only(b"# robot\n\n"), ": is empty"),
    Case("robot", "NUL inside", swap("12.992", "12.\0992"), r":5: .*binary"),
    Case("robot", "a picture", only(PNG), r":\d+: .*binary"),
    Case(
        "robot",
        "UTF-16",
        lambda data: data.decode().encode("utf-16"),
        ":1: is UTF-16 text; save it as",
    ),
    Case("robot", "Latin-1 in a key", swap("mass_kg", "m\u00e4ss_kg"), HERE + "mäss_kg"),
    Case("robot", "a log instead", only(b"time_s,length_1_m\n0,1\n"), HERE),
    Case(
        "robot",
        "ten million lines",
        lambda data: data + b"\n" * TEN_MILLION,
        ": is over 250 kB",
        big=True,
    ),
    Case("robot", "300 kB of x", lambda data: data + b"x" * 300_000, ": is over 250 kB"),
)
