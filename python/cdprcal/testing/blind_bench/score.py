"""Scores of a study: what was hidden against what was named."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cdprcal.testing.blind_bench import faults

Line = dict[str, Any]

#: Effects between which the same part of the robot has to be looked at.
CLASSES: dict[str, tuple[str, ...]] = {
    "winch and cable": ("transmission_ratio", "cable_elasticity", "cable_creep", "cable_sag"),
    "friction": ("pulley_friction", "bending_hysteresis", "viscous_friction"),
    "swivel encoder": ("swivel_hysteresis", "swivel_scale"),
    "geometry": (
        "pulley_radius",
        "pulley_diameter",
        "frame_anchors",
        "frame_scale",
        "frame_shear",
        "frame_warp",
        "platform_anchors",
    ),
    "load cell": ("load_cell_bias", "load_cell_gain", "load_cell_drift"),
    "weight and loads": (
        "mass",
        "centre_of_mass",
        "external_force",
        "umbilical",
        "base_tilt",
        "inertia",
    ),
    "attitude": ("ahrs_misalignment", "attitude_scale", "yaw_drift", "magnetic_disturbance"),
    "timing": ("sensor_delay", "length_delay", "swivel_delay", "tension_delay"),
}


def class_of(name: str) -> str:
    """The class of an effect of the catalogue; any other name is its own."""
    return next((c for c, names in CLASSES.items() if name in names), name)


#: Half a 95 % interval, in σ.
INTERVAL = 1.959964
#: All kinds of cases.
KINDS = ("clean", "one", "two", "outside", "fault", "configuration", "configuration_one")


@dataclass(frozen=True)
class Rate:
    """Successes out of trials, with a Wilson interval."""

    hits: int
    trials: int

    @property
    def value(self) -> float:
        """Share of successes; NaN without trials."""
        return self.hits / self.trials if self.trials else float("nan")

    def interval(self) -> tuple[float, float]:
        """95 % Wilson interval."""
        if not self.trials:
            return 0.0, 1.0
        z, n, p = 1.96, self.trials, self.value
        centre = (p + z * z / (2 * n)) / (1 + z * z / n)
        half = z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
        return max(0.0, float(centre - half)), min(1.0, float(centre + half))

    def __str__(self) -> str:
        low, high = self.interval()
        if not self.trials:
            return "–"
        counts = f"{self.hits}/{self.trials}, {100 * low:.0f}–{100 * high:.0f}"
        return f"{100 * self.value:.1f} % ({counts})"


def rate(outcomes: list[bool]) -> Rate:
    """Of a list of outcomes."""
    return Rate(sum(outcomes), len(outcomes))


@dataclass
class Scores:
    """Of one setting and split."""

    counts: Counter[str] = field(default_factory=Counter)
    rates: dict[str, Rate] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)
    confusion: Counter[tuple[str, str]] = field(default_factory=Counter)
    by_size: dict[tuple[str, str], Rate] = field(default_factory=dict)
    coverage: dict[str, Rate] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)


def hidden_names(line: Line) -> list[str]:
    """What the case hides."""
    return [h["name"] for h in line["case"]["hidden"]]


def named(line: Line) -> list[str]:
    """Effects accepted by the diagnosis."""
    return [e["name"] for e in line["found"]["effects"]]


def reported(line: Line) -> set[str]:
    """Names accepted, and the rivals they were reported with."""
    return {n for e in line["found"]["effects"] for n in [e["name"], *e["rivals"]]}


def detected(line: Line) -> bool:
    """The diagnosis said that something is missing, whatever."""
    return line["found"]["verdict"] not in ("consistent", "undetermined")


def right_names(line: Line) -> bool:
    """Every effect and fault that was hidden is named, and nothing else."""
    named_faults = [f["name"] for f in line["found"]["faults"]]
    return sorted([*named_faults, *named(line)]) == sorted(hidden_names(line))


def intervals(line: Line) -> list[bool]:
    """Of each value of each rightly named effect: whether its 95 % interval holds the truth."""
    truth = {h["name"]: h["values"] for h in line["case"]["hidden"]}
    inside = []
    for effect in line["found"]["effects"]:
        # An event in time has a place beside its size: what is read off there is no interval.
        if len(truth.get(effect["name"], [])) != len(effect["values"]):
            continue
        for value, deviation, true in zip(
            effect["values"], effect["deviation"], truth[effect["name"]], strict=True
        ):
            inside.append(
                value is not None
                and deviation is not None
                and abs(value - true) <= INTERVAL * deviation
            )
    return inside


def excess_removed(line: Line) -> float | None:
    """Share of the held-out excess χ² that the accepted effects removed.

    From the first effect's before to the last one's after, above ½ for each of the 2n + 9 - 6
    degrees of freedom of a pose.
    """
    effects = line["found"]["effects"]
    if len(effects) != 1 or None in (effects[0]["held_out_before"], effects[0]["held_out_after"]):
        return None
    expected = 0.5 * (2 * line["cables"] + 9 - 6)
    before = effects[0]["held_out_before"] - expected
    after = effects[0]["held_out_after"] - expected
    return float(1.0 - after / before) if before > 0.5 else None


def score(lines: list[Line]) -> Scores:
    """Of all diagnosed cases of one setting."""
    s = Scores()
    for line in lines:
        s.counts[line["status"]] += 1
        s.counts[line["case"]["kind"]] += line["status"] == "diagnosed"
    told = [line for line in lines if line["status"] == "diagnosed"]
    clean, one, two, outside, fault, *configured = (
        [line for line in told if line["case"]["kind"] == kind] for kind in KINDS
    )

    s.rates["clean: nothing accused"] = rate([not detected(x) for x in clean])
    s.rates["clean: an effect named (false alarm)"] = rate([bool(named(x)) for x in clean])
    s.rates["clean: verdict unexplained"] = rate([_unexplained(x) for x in clean])
    s.rates["clean: initial pose moved by less than 0.5 σ"] = rate(
        [x["found"]["pose_shift_sigma"] < 0.5 for x in clean]
    )
    s.rates["one: detected"] = rate([detected(x) for x in one])
    s.rates["one: detected, of those that this log can show at that size"] = rate(
        [detected(x) for x in one if all(_shown(x).values())]
    )
    s.rates["one: not detected and listed as not to be seen at that size, of not detected"] = rate(
        [not all(_shown(x).values()) for x in one if not detected(x)]
    )
    s.rates["one: an effect named"] = rate([bool(named(x)) for x in one])
    spoke = [x for x in one if named(x)]
    s.rates["one: right name first, of those named"] = rate([_right_name(x) for x in spoke])
    s.rates["one: right name first, of all"] = rate([_right_name(x) for x in one])
    s.rates["one: right class first, of those named"] = rate([_right_class(x) for x in spoke])
    s.rates["one: right class first, of all"] = rate([_right_class(x) for x in one])
    s.rates["one: right name and nothing else, of those named"] = rate(
        [named(x) == hidden_names(x) for x in spoke]
    )
    s.rates["one: reported set covers the truth, of those named"] = rate(
        [set(hidden_names(x)) <= reported(x) for x in spoke]
    )
    s.numbers["one: names in the reported set, mean"] = _mean([len(reported(x)) for x in spoke])
    s.rates["two: both named"] = rate([set(hidden_names(x)) <= set(named(x)) for x in two])
    s.rates["two: both named, of those that this log can show at those sizes"] = rate(
        [set(hidden_names(x)) <= set(named(x)) for x in two if all(_shown(x).values())]
    )
    s.rates["two: both in the reported set"] = rate(
        [set(hidden_names(x)) <= reported(x) for x in two]
    )
    s.rates["two: at least one named"] = rate([bool({*hidden_names(x)} & {*named(x)}) for x in two])
    s.rates["two: a wrong name"] = rate([bool(set(named(x)) - set(hidden_names(x))) for x in two])
    s.rates["outside: wrongly named"] = rate([bool(named(x)) for x in outside])
    s.rates["outside: called unexplained"] = rate([_unexplained(x) for x in outside])
    s.rates["outside: not noticed"] = rate([not detected(x) for x in outside])
    s.rates["fault: discrete, right name and nothing else"] = rate(
        [_right_fault(x) for x in fault if hidden_names(x)[0] in faults.FIRST]
    )
    events = [x for x in fault if hidden_names(x)[0] not in faults.FIRST]
    s.rates["fault: event in time, right name, located"] = rate([_located(x) for x in events])
    s.rates["fault: event in time, located, by whatever name"] = rate(
        [_located(x) or _located_in_time(x) for x in events]
    )
    s.rates["fault: event in time, no effect named"] = rate([not _misnamed(x) for x in events])
    for label, cases in zip(("alone", "beside an effect"), configured, strict=True):
        s.rates[f"configuration, {label}: right names and nothing else"] = rate(
            [right_names(x) for x in cases]
        )
    excess = [e for x in [*one, *two] if (e := excess_removed(x)) is not None]
    s.numbers["held-out excess χ² removed, median"] = float(np.median(excess)) if excess else np.nan
    s.rates["held-out excess χ² removed by at least 90 %"] = rate([e >= 0.9 for e in excess])
    inside = [i for x in [*one, *two] for i in intervals(x)]
    s.rates["95 % intervals that cover the truth"] = rate(inside)
    errors = [x["found"]["pose_error_sigma"] for x in clean]
    s.numbers["clean: pose error ÷ stated σ, rms"] = float(np.sqrt(_mean([e * e for e in errors])))
    worse = [x for x in [*one, *two] if named(x)]
    for index, label in ((0, "before"), (1, "after")):
        s.numbers[f"one, two: initial position error {label}, median, mm"] = 1e3 * float(
            np.median([x["found"]["position_error_m"][index] for x in worse]) if worse else np.nan
        )
    s.rates["one, two: initial position nearer the truth"] = rate(
        [x["found"]["position_error_m"][1] < x["found"]["position_error_m"][0] for x in worse]
    )
    s.numbers["diagnosis time, median, s"] = _median([x["diagnosis_s"] for x in told])

    for x in [*clean, *one, *outside]:
        truth = hidden_names(x)[0] if x["case"]["hidden"] else "(clean)"
        first = named(x)[0] if named(x) else "(unexplained)" if detected(x) else "(consistent)"
        s.confusion[truth, first] += 1
    for effect in sorted({hidden_names(x)[0] for x in one}):
        for label, low, high in (("0.7–1", 0, 1), ("1–1.4", 1, 1.4), ("1.4–2", 1.4, 9)):
            cases = [
                x
                for x in one
                if hidden_names(x)[0] == effect and low <= x["case"]["hidden"][0]["size"] < high
            ]
            s.by_size[effect, label] = rate([detected(x) for x in cases])
        s.coverage[effect] = rate(
            [i for x in one if hidden_names(x)[0] == effect for i in intervals(x)]
        )
    s.failures = [f for line in lines if (f := failure(line))]
    return s


def failure(line: Line) -> str:
    """One line on a case that did not come out as it should; empty when it did."""
    case = line["case"]
    head = f"{case['number']} {case['kind']}" + (
        f" [{', '.join(_describe(h) for h in case['hidden'])}]" if case["hidden"] else ""
    )
    if line["status"] != "diagnosed":
        return f"{head}: {line['status']}: {line['reason']}"
    found = line["found"]
    discrete = case["kind"] == "fault" and hidden_names(line)[0] in faults.FIRST
    right = {
        "clean": lambda: not detected(line),
        "one": lambda: named(line) == hidden_names(line),
        "two": lambda: sorted(named(line)) == sorted(hidden_names(line)),
        "outside": lambda: not named(line),
        "fault": lambda: _right_fault(line) if discrete else _located(line) and not _misnamed(line),
        "configuration": lambda: right_names(line),
        "configuration_one": lambda: right_names(line),
    }[case["kind"]]()
    if right and not (found["faults"] and case["kind"] in ("clean", "one", "two", "outside")):
        return ""
    effects = [
        f"{e['name']} ({e['log_evidence']:.1f} nats"
        + (f"; or {', '.join(e['rivals'])}" if e["rivals"] else "")
        + ")"
        for e in found["effects"]
    ]
    said = [*(f["name"] for f in found["faults"]), *effects]
    said += [f["name"] for f in found.get("formulas", [])]
    said += [f"{u['channel']} depends on {u['depends_on']}" for u in found["unexplained"]]
    notes = [
        f"{r['name']}: {r['reason']}" for r in found["rejected"] if r["name"] in hidden_names(line)
    ]
    if case["kind"] in ("one", "two"):
        notes += [
            f"{n}: listed as not to be seen at that size" for n, s in _shown(line).items() if not s
        ]
    elif case["kind"] == "fault" and not discrete and _located_in_time(line):
        notes.append("something was left out at that time: " + "; ".join(found["left_out"][:2]))
    because = "; ".join(notes)
    return f"{head}: {found['verdict']}: {', '.join(said) or 'nothing'}" + (
        f" — {because}" if because else ""
    )


def _describe(hidden: dict[str, Any]) -> str:
    return f"{hidden['name']} × {hidden['size']:.2f}"


def _unexplained(line: Line) -> bool:
    """Something is left that has no name; there may be a formula for it."""
    return line["found"]["verdict"] in ("unexplained", "described")


def _shown(line: Line) -> dict[str, bool]:
    """Of each hidden effect: named, or large enough that the diagnosis says this log would show it
    (beside what was accepted)."""
    after = line["found"]["detectable_after"]
    before = line["found"]["detectable"]
    shown = {}
    for hidden in line["case"]["hidden"]:
        name = hidden["name"]
        limit = after.get(name) or before.get(name)
        shown[name] = name in named(line) or (limit is not None and hidden["size"] >= limit)
    return shown


def _right_name(line: Line) -> bool:
    return named(line)[:1] == hidden_names(line)


def _right_class(line: Line) -> bool:
    return bool(named(line)) and class_of(named(line)[0]) == class_of(hidden_names(line)[0])


def _right_fault(line: Line) -> bool:
    found = line["found"]
    return [f["name"] for f in found["faults"]] == hidden_names(line) and not found["effects"]


def _located(line: Line) -> bool:
    """The event is among the readings left out, or named: a slip at its cable."""
    hidden = line["case"]["hidden"][0]
    named_there = any(
        e["name"] == hidden["name"] and e["where"].get("cable") == hidden["values"][1]
        for e in line["found"]["effects"]
    )
    return named_there or any(hidden["name"] in text for text in line["found"]["left_out"])


def _located_in_time(line: Line) -> bool:
    """Something left out, or named, begins or ends within 3 s of the event."""
    texts = [text.split(": ", 1)[-1] for text in line["found"]["left_out"]]
    times = [float(t) for text in texts for t in re.findall(r"(?:at|from|to) ([0-9.]+)", text)]
    return any(abs(time - line["event_time_s"]) < 3.0 for time in times)


def _misnamed(line: Line) -> bool:
    """An effect named where an event in time was hidden."""
    return bool(set(named(line)) - set(hidden_names(line)))


def _mean(values: list[Any]) -> float:
    return float(np.mean(values)) if values else float("nan")


def _median(values: list[Any]) -> float:
    return float(np.median(values)) if values else float("nan")
