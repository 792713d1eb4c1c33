"""What the name of a column says: a kind of reading, a cable or axis, a unit."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from cdprcal.mapping.units import unit_at_end, unit_named

WHOLE_LENGTHS = "direct_lengths"

#: Of an inertial unit, three columns each, told apart by their axes.
INERTIAL = ("specific_force", "angular_velocity")

#: What an axis letter makes an angle of, however the name begins.
_ANGLES = r"(?:\w+_)?(?:euler|rpy|attitude)_?"

#: Words of a name that stand for what is asked of a drive and not what it does.
_ASKED = re.compile(
    r"set|setpoint|setpt|setvalue|sp|soll\w*|ref|reference|cmd|command|commanded|target|desired|"
    r"goal|demand|nominal|\w+(?:cmd|setpoint|soll|target)"
)
_FORCES = re.compile(
    r"tensi[oó]n\w*|tens|force\w*|\w*kr(?:a|ä|ae)fte?|kraft\w*|load\w*|tau|effort|torque|"
    r"f|(?:\w*(?:force|tension))(?:cmd|setpoint|soll|target)?"
)

#: Words that say no reading alone and may stand before one: 'current position', 'drive 1 force'.
_BEFORE = re.compile(r"current|mode|state|status|drive")
#: Words of readings that name a thing: 'drive mode of cable 1' is no length.
_THINGS = re.compile(
    r"cable|rope|seil|winch|drum|spool|wire|tendon|motor|joint|cavo|l|f|t|x|y|z|pulley\w*|"
    r"sheave|rolle\w*|cell|load|clock|sec"
)

#: Words that make a column a reading of a kind, in the languages of labs; the first kind that has a
#: word wins, so that 'cable velocity' is no length.
_WORDS: tuple[tuple[str, str], ...] = (
    ("none", r"free|jerk|covariance"),  # free of gravity: no reading of an accelerometer
    ("angular_velocity", r"gyr|gyro|gyr[xyz]|gyro[xyz]|gyroscope|omega|omega[xyz]|angular"),
    ("specific_force", r"acc|acc[xyz]|accel\w*|specific|beschleunigung"),
    (
        "none",
        r"speed|vel|velo|velocity|geschw\w*|vitesse|current|strom|torque|temp|temperature|"
        r"mode|state|status|drive|watchdog|error|counter|battery|volt\w*",
    ),
    ("time", r"time|t|zeit|timestamp|stamp|clock|temps|tempo|tiempo|millis|sec|uhrzeit|datetime"),
    ("quaternion", r"q[wxyz]|quat\w*|orientation|quaternion"),
    (WHOLE_LENGTHS, r"laser|tape|distance|direct"),
    ("position_m", r"tracker|mocap|vicon|optitrack|leica|pos[xyz]"),
    ("roll", rf"roll|phi|rx|rollen|rollwinkel|roulis|rollio|{_ANGLES}x|wank\w*"),
    ("pitch", rf"pitch|theta|ry|nick\w*|neigung|tangage|beccheggio|{_ANGLES}y"),
    ("yaw", rf"yaw|psi|chi|rz|heading|gier\w*|lacet|imbardata|azimut|azimuth|{_ANGLES}z|course"),
    ("attitude", r"rpy|euler|attitude"),
    (
        "swivels",
        r"swivel\w*|sigma|pulley\w*|umlenk\w*|caster|sheave|schwenk\w*|poulie|rolle\w*|pan",
    ),
    (
        "tensions",
        r"tensi[oó]n\w*|tens|force|forza|fuerza|força|kracht|kraft|seilkraft|zugkraft|"
        r"load|loadcell|cell|effort|tau|f|kraefte|kräfte|strain|dms|lc|zug|spannung|zugspannung",
    ),
    (
        "lengths",
        r"length\w*|len|l|cable|rope|seil|seillaenge|seillänge|laenge|länge|lunghezza|longueur|"
        r"encoder|enc|winch|drum|spool|dl|wire|tendon|position|pos|cavo|motor|joint",
    ),
)
_KINDS = [(kind, re.compile(words)) for kind, words in _WORDS]
_CAMEL = re.compile(r"(?<=[a-zäöü])(?=[A-Z])|(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])")
_BRACKETS = re.compile(r"[\[(]([^\])]*)[\])]\s*$")


@dataclass(frozen=True)
class Name:
    """A column's name taken apart.

    ``stem``: without what tells cables or axes apart; ``index``: that; ``unit``: None when the name
    has none; ``kind``: what it seems to be, empty when no word says so; ``unknown``: what stands
    where units do and is none; ``is_asked``: a word says that it was commanded, not read;
    ``shape``: the words, '#' for each of ``numbers``.
    """

    text: str
    kind: str
    stem: str
    index: str
    unit: str | None
    unknown: str = ""
    is_asked: bool = False
    shape: str = ""
    numbers: tuple[str, ...] = ()


def taken_apart(text: str, given_unit: str = "") -> Name:
    """What a name says; ``given_unit`` is what the file says apart from it."""
    bracket = _BRACKETS.search(text)
    bare = text[: bracket.start()] if bracket else text
    bare = bare.replace("joint_states", "joints")  # ROS's topic of readings, no state of a machine
    unit = unit_named(given_unit) or (unit_named(bracket[1]) if bracket else None)
    if unit is None:
        unit, bare = unit_at_end(bare.rstrip())
    written = given_unit or (bracket[1] if bracket else "")
    unknown = written.strip() if unit is None and re.search(r"[^\W\d]|%", written) else ""
    words = [w for w in re.split(r"[^0-9A-Za-zÀ-ÿ]+", _CAMEL.sub("_", bare)) if w]
    numbers = [word for word in words if word.isdigit()]
    index = numbers[-1] if numbers else ""
    lower = [_singular(word.lower()) for word in words if not word.isdigit()]
    stem = "_".join("#" if word == index and index else word.lower() for word in words)
    shape = "_".join("#" if word.isdigit() else word.lower() for word in words)
    is_asked = any(_ASKED.fullmatch(word) for word in lower)
    kind = _kind(lower)
    of_force = kind == "tensions" or any(_FORCES.fullmatch(word) for word in lower)
    if is_asked and of_force and kind != "none":
        kind = "tension_setpoints"
    return Name(text, kind, stem, index, unit, unknown, is_asked, shape, tuple(numbers))


def with_indices(names: dict[str, Name]) -> dict[str, Name]:
    """Names with several numbers, of which the first that differs from name to name tells the
    cables apart: 'length_1_AI0' … 'length_4_AI3', 'LC1_500N' … 'LC4_500N'."""
    families: dict[str, list[Name]] = {}
    for name in names.values():
        if len(name.numbers) > 1:
            families.setdefault(name.shape, []).append(name)
    out = dict(names)
    for shape, family in families.items():
        for numbers in zip(*(name.numbers for name in family), strict=True):
            if len(family) > 1 and len(set(numbers)) == len(family):
                pairs = zip(family, numbers, strict=True)
                out |= {name.text: replace(name, stem=shape, index=i) for name, i in pairs}
                break
    return out


def _singular(word: str) -> str:
    """'forces' → 'force'; what is a word here already stays ('temps', 'status')."""
    known = any(pattern.fullmatch(word) for _, pattern in _KINDS)
    return word if known or len(word) < 4 else word.removesuffix("s")


def _kind(words: list[str]) -> str:
    words = _without_context(words)
    joined = "_".join(words)
    for kind, pattern in _KINDS:
        if any(pattern.fullmatch(word) for word in words):
            return kind
        if kind != "none" and pattern.fullmatch(joined):
            return kind
    return ""


def _without_context(words: list[str]) -> list[str]:
    """Without words that only stand before a reading, such as 'current' of 'current position'."""
    last = max((i for i, word in enumerate(words) if _says_a_reading(word)), default=0)
    return [word for i, word in enumerate(words) if i > last or not _BEFORE.fullmatch(word)]


def _says_a_reading(word: str) -> bool:
    return not _THINGS.fullmatch(word) and any(
        kind != "none" and pattern.fullmatch(word) for kind, pattern in _KINDS
    )
