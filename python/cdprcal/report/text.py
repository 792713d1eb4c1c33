"""Numbers and sentences of a report: every value with its unit and σ."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.diagnosis.document import TRUSTED
from cdprcal.diagnosis.table import left_over
from cdprcal.report.subject import Subject
from cdprcal.terminal import decimals, fixed, listed, measured
from cdprcal.trust import worst_sigma


def with_sigma(value: float | None, sigma: float | None, unit: str) -> str:
    """'367.09 ± 0.41 mm', to two digits of σ; '–' for what is absent."""
    if value is None:
        return "–"
    if sigma is None or not math.isfinite(sigma):
        number = fixed(value, decimals(None))
    else:
        number = " ± ".join(measured(value, sigma, sign=""))
    return typeset(f"{number}{_space(unit)}{unit}")


def typeset(text: str) -> str:
    """A number with a true minus, and its unit kept on its line."""
    return text.replace("-", "\N{MINUS SIGN}").replace(" ", "\u00a0")


def _space(unit: str) -> str:
    return "" if unit.startswith("°") else " "


def small(value: float | None, unit: str, digits: int = 3) -> str:
    """A few digits and the unit; '–' for what is absent."""
    if value is None or not math.isfinite(value):
        return "–"
    # Rounded first: 420, not 4.2e+02.
    number = f"{value:,.0f}" if abs(value) >= 1000 else f"{float(f'{value:.{digits}g}'):g}"
    return typeset(f"{number}{_space(unit)}{unit}".strip())


def names_in_words(names: list[str]) -> str:
    """'a', 'a and b', 'a, b and c'; underscores become spaces."""
    return listed([name.replace("_", " ") for name in names])


def headline(subject: Subject) -> tuple[str, str, str]:
    """(state, title, lead): the one message of the page. state: good, changed or bad."""
    document, diagnosis = subject.runs[0].calibration, subject.diagnosis
    name = subject.robot.name
    converged = document["status"] == "converged"
    found = [] if diagnosis is None else [effect["name"] for effect in diagnosis["effects"]]
    found = list(dict.fromkeys(found))
    left = diagnosis is not None and diagnosis["verdict"] not in TRUSTED
    best = subject.runs[0].best
    if best["status"] != "converged" and not left:
        title = f"{name}: this log gives no pose that can be trusted"
        finds = f" The diagnosis names {names_in_words(found)}." if found else ""
        lead = f"{best['reason'].rstrip('.')}.{finds}"
        return "bad", title, lead[0].upper() + lead[1:]
    if found and not left and diagnosis is not None:
        after = diagnosis["initial_pose_after"]
        effects = "one effect" if len(found) == 1 else f"{len(found)} effects"
        title = f"The model of {name} misses {effects}: {names_in_words(found)}"
        lead = (
            f"With {'it' if len(found) == 1 else 'them'}, the platform hung at "
            f"{_place(after, diagnosis['covariance_after'])} when it was switched on. "
            f"Without, {moved_by(document, diagnosis) if converged else 'no pose can be trusted'}."
        )
        return "changed", title, lead
    if left and diagnosis is not None:
        knows = f"{names_in_words(found)} explain much of it; " if found else ""
        undetermined = diagnosis["verdict"] == _core.Verdict.undetermined.name
        title = (
            f"{name}: this log is too little to say what the model lacks"
            if undetermined
            else f"{name}: something is left that no known effect explains"
        )
        lead = f"{knows}{diagnosis['reason']}. The pose below is to be used with care."
        return "bad", title, lead[0].upper() + lead[1:]
    title = f"{name} knows where it hangs"
    place = _place(document["initial_pose"], document["covariance"])
    model = (
        f"No diagnosis: {subject.no_diagnosis.rstrip('.')}."
        if diagnosis is None
        else "Nothing known would improve the model, yet it does not agree with the sensors "
        "as well as they repeat."
        if left_over(diagnosis)
        else "Model and sensors agree: nothing is missing."
    )
    return "good", title, f"When it was switched on, the platform hung at {place}. {model}"


def moved_by(calibration: dict[str, Any], diagnosis: dict[str, Any]) -> str:
    """How far what was found moves the initial pose of ``calibrate``, and that of the model alone.

    The first is that of the tables, which allows for what the model may lack; the second that of
    the figures, which allows for nothing.
    """
    after = diagnosis["initial_pose_after"]["position_m"]
    allowing, alone = (
        _distance(float(np.linalg.norm(np.subtract(after, pose["position_m"]))))
        for pose in (calibration["initial_pose"], diagnosis["initial_pose_before"])
    )
    if allowing == alone:
        return f"the model puts it {alone} away"
    return (
        f"a calibration that allows for what the model may lack puts it {allowing} away, and the "
        f"model alone {alone}"
    )


def _distance(metres: float) -> str:
    return "less than 0.01 mm" if metres < 1e-5 else _length(metres)


def _place(pose: dict[str, Any], covariance: Any) -> str:
    sigma = worst_sigma(covariance)
    digits = decimals(None if sigma is None else sigma[0])
    numbers = ", ".join(fixed(value, digits) for value in pose["position_m"])
    place = typeset(f"({numbers}) m")
    if sigma is None:
        return place
    angle = small(math.degrees(sigma[1]), "°", 2)
    return f"{place}, ±\u00a0{_length(sigma[0])} and ±\u00a0{angle} (1\u00a0σ)"


def _length(metres: float) -> str:
    return small(1e3 * metres, "mm", 2) if metres < 0.0995 else small(metres, "m", 2)
