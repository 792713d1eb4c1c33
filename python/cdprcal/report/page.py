"""The page itself: what the template shows, and the file."""

from __future__ import annotations

import base64
import datetime
import gzip
import hashlib
import json
import math
import platform
import shlex
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.diagnosis.document import TRUSTED, in_words
from cdprcal.diagnosis.plots import gap_panels, gap_steps
from cdprcal.diagnosis.table import (
    LEFT_OVER,
    believable,
    left_over,
    unexplained_line,
    unique,
    value_rows,
)
from cdprcal.io.files import write_text
from cdprcal.io.result_file import cdprcal_version, log_sha256
from cdprcal.report import figures, text
from cdprcal.report.night import NIGHT
from cdprcal.report.scene import MOST_SHOWN, magnification, scene, workspace_mesh
from cdprcal.report.still import still_picture
from cdprcal.report.subject import Run, Subject
from cdprcal.tables import CHANNELS, gated_line, sigma_of
from cdprcal.terminal import degrees, fixed, scaled
from cdprcal.trust import worst_sigma

_AXES = ("x", "y", "z", "roll", "pitch", "yaw")
_DEGREE = math.degrees(1.0)


def write_report(subject: Subject, path: Path) -> None:
    """Writes the page, all or nothing. Raises InputError."""
    write_text(path, render(subject))


def render(subject: Subject) -> str:
    """The whole page as one text: style, figures, plotly and all."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("cdprcal.report", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    state, title, lead = text.headline(subject)
    all_figures, about = _figures(subject)
    script = (resources.files("cdprcal.report") / "templates" / "report.js").read_text("utf-8")
    plotly = (resources.files("plotly") / "package_data" / "plotly.min.js").read_text("utf-8")
    return environment.get_template("report.html").render(
        robot=subject.robot,
        state=state,
        title=title,
        lead=lead,
        key_figures=_key_figures(subject),
        runs=[_run(subject, number) for number in range(len(subject.runs))],
        diagnosis=None if subject.diagnosis is None else _diagnosis(subject),
        no_diagnosis=subject.no_diagnosis,
        about=about,
        figures=all_figures,
        stills={
            name: still_picture(figure)
            for name, figure in all_figures.items()
            if "moving" in figure
        },
        night=NIGHT,
        policy=_policy(script, plotly),
        script=script,
        json=_for_script,
        command=shlex.join(subject.command),
        robot_yaml=_core.to_yaml(subject.robot),
        logs=[_log(run) for run in subject.runs],
        version=cdprcal_version(),
        made=datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        machine=f"Python {platform.python_version()}, {platform.system()} {platform.machine()}",
        numbers={
            "calibrations": [run.calibration for run in subject.runs],
            "diagnosis": subject.diagnosis,
        },
        plotly=_packed(plotly),
    )


def _policy(*scripts: str) -> str:
    """What the page may do: run these scripts, and fetch nothing from anywhere."""
    hashes = " ".join(
        f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
        for script in scripts
    )
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _for_script(value: Any) -> str:
    """JSON that may stand in a <script>: no '</' and no '<!--' can end or change it."""
    text_ = json.dumps(value, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    return text_.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _packed(script: str) -> str:
    """Gzip and base64: a third of its size; the page unpacks it."""
    return base64.b64encode(gzip.compress(script.encode(), mtime=0)).decode()


def _figures(subject: Subject) -> tuple[dict[str, Any], dict[str, str]]:
    """Figures by their id in the page, and what their captions say."""
    found: dict[str, Any] = {}
    about: dict[str, str] = {}
    mesh, about["workspace"] = workspace_mesh(subject.robot)
    for number, run in enumerate(subject.runs):
        if run.best["poses"]:
            found[f"scene-{number}"] = scene(subject.corrected, run.best, mesh)
        found[f"time-{number}"] = figures.timelines(subject.robot, run)
        about[f"time-{number}"] = about_time(run)
        if any(told["effects"] for told in run.told):
            found[f"told-{number}"] = figures.evidence(run.told)
    drawn = figures.residuals(subject)
    if drawn:
        found["residuals"] = drawn
        about["residuals"] = about_residuals(
            subject.diagnosis, band=bool(drawn["layout"]["shapes"])
        )
    if subject.diagnosis is not None:
        if subject.diagnosis["gap"]:
            drawn = found["staircase"] = figures.staircase(subject.diagnosis)
            about["staircase"] = about_staircase(ripple=bool(drawn["layout"]["shapes"]))
        for number, effect in enumerate(subject.diagnosis["effects"], 1):
            if effect["course"]:
                found[f"course-{number}"] = figures.course(effect)
        drawn = figures.ranking(subject.diagnosis)
        if drawn:
            found["ranking"] = drawn
            hatched = any(bar["marker"]["pattern"] for bar in drawn["data"])
            about["ranking"] = about_ranking(hatched=hatched)
    return found, about


def about_time(run: Run) -> str:
    """What the timelines' caption says, of what is drawn."""
    document = run.best
    shaded = sum(rest["end_s"] > rest["begin_s"] for rest in document["equilibria"])
    kinds = {pose["kind"] for pose in document["poses"]}
    parts = [
        f"Shaded: the {shaded} intervals at rest that were found." if shaded else "",
        "Dotted: tension set-points." if run.log.tension_setpoint_N.shape[1] else "",
        "Full symbols: poses at rest; open ones: in motion." if len(kinds) > 1 else "",
        "Drag along an axis to zoom, double-click to return.",
        "Poses are those with what the diagnosis found." if document is run.corrected else "",
    ]
    return " ".join(filter(None, parts))


def about_residuals(diagnosis: dict[str, Any] | None, *, band: bool) -> str:
    """What the residuals' caption says; ``band``: the readings' own ripple is drawn."""
    parts = [
        "Modelled minus measured at each pose.",
        "The model alone allows for nothing that it may lack."
        if diagnosis and diagnosis["effects"]
        else "",
        "The band is ± 1 σ of the readings' own ripple; what lies outside is what the model lacks."
        if band
        else "",
    ]
    return " ".join(filter(None, parts))


def about_staircase(*, ripple: bool) -> str:
    """What the staircase's caption says; ``ripple``: that of the readings is drawn."""
    dotted = " Dotted: the readings' own ripple, which no model can go below."
    return (
        "Root mean square of what the model alone leaves, before any effect, and what is left "
        "after each. Solid, dots: on the poses that were fitted; dashed, diamonds: on poses held "
        f"out.{dotted if ripple else ''}"
    )


def about_ranking(*, hatched: bool) -> str:
    """What the candidates' caption says; ``hatched``: there are rivals among them."""
    rivals = " Hatched: rivals that these poses cannot tell from what was accepted."
    return (
        "Evidence of each effect on the model alone, as a scan estimates it; the tables above have "
        "that of the fit, which differs. Dotted: 3 nat, what is asked for."
        f"{rivals if hatched else ''}"
    )


def _key_figures(subject: Subject) -> list[tuple[str, str, str]]:
    """(what, value, small print): the four numbers at the top."""
    run, diagnosis = subject.runs[0], subject.diagnosis
    document = run.calibration
    corrected = diagnosis is not None and bool(diagnosis["effects"])
    covariance = (
        diagnosis["covariance_after"] if corrected and diagnosis else document["covariance"]
    )
    sigma = worst_sigma(covariance)
    where = "with what was found" if corrected else "worst direction"
    position = "–" if sigma is None else f"± {text.small(1e3 * sigma[0], 'mm', 2)}"
    rotation = "–" if sigma is None else f"± {text.small(_DEGREE * sigma[1], '°', 2)}"
    poses = f"{document['static_poses']} + {document['kinematic_poses']}"
    verdict = "none" if diagnosis is None else diagnosis["verdict"]
    effects = [] if diagnosis is None else diagnosis["effects"]
    found = {0: "no effect found", 1: "1 effect found"}.get(len(effects), f"{len(effects)} effects")
    return [
        ("position, 1 σ", position, where),
        ("rotation, 1 σ", rotation, where),
        ("poses used", poses, "at rest + in motion"),
        ("diagnosis", verdict, found if diagnosis is not None else "see below"),
    ]


def _run(subject: Subject, number: int) -> dict[str, Any]:
    run = subject.runs[number]
    document = run.calibration
    best = run.best
    return {
        "number": number,
        "name": Path(run.log.source).name,
        "status": document["status"],
        "reason": document["reason"],
        "has_pose": best["initial_pose"] is not None,
        "reference_time": fixed(document["reference_time_s"], 3),
        "pose_rows": _pose_rows(run),
        "by_corrected": best is run.corrected,
        "has_corrected": run.corrected is not None,
        "corrected_status": "" if run.corrected is None else run.corrected["status"],
        "corrected_reason": "" if run.corrected is None else run.corrected["reason"],
        "cable_rows": _cable_rows(best),
        "least_observed": best["least_observed"],
        "residual_rows": _residual_rows(subject.robot, run),
        "gated": [gated_line(gated) for gated in document["gated"]],
        "findings": run.findings,
        "told": [(f"{told['time_s']:.1f}", in_words(told)) for told in run.told],
        "ellipsoid": _ellipsoid(subject.robot, best),
        "facts": _facts(document),
        "shown": min(MOST_SHOWN, 1 + sum(p["kind"] == "static" for p in best["poses"][1:])),
    }


def _facts(document: dict[str, Any]) -> list[tuple[str, str]]:
    p_value = document["chi_square_p_value"]
    return [
        ("cost ½ Σ (F/σ)²", fixed(document["cost"], 3)),
        ("residuals, parameters", f"{document['residual_count']}, {document['parameter_count']}"),
        ("χ² p-value", "–" if p_value is None else f"{p_value:.3g}"),
        ("iterations", str(document["iterations"])),
        ("solved in", text.small(1e3 * (document["solve_time_s"] or 0.0), "ms")),
    ]


def _pose_rows(run: Run) -> list[tuple[str, ...]]:
    documents = [run.calibration, *([run.corrected] if run.corrected is not None else [])]
    rows = []
    for i, name in enumerate(_AXES):
        cells = []
        for document in documents:
            pose, covariance = document["initial_pose"], document["covariance"]
            if pose is None:
                cells.append("–")
                continue
            value = pose["euler_rad"][i - 3] * _DEGREE if i >= 3 else pose["position_m"][i]
            sigma = None if covariance is None else math.sqrt(covariance[i][i])
            if sigma is not None and i >= 3:
                sigma *= _DEGREE
            cells.append(text.with_sigma(value, sigma, "°" if i >= 3 else "m"))
        rows.append((name, *cells))
    return rows


def _cable_rows(document: dict[str, Any]) -> list[tuple[str, str, str]]:
    swivels = document["initial_swivels_rad"]
    return [
        (
            str(i + 1),
            text.typeset(f"{fixed(length, 4)} m"),
            text.typeset(f"{fixed(degrees(swivels[i]), 3)}°"),
        )
        for i, length in enumerate(document["initial_lengths_m"])
    ]


def _ellipsoid(robot: _core.Robot, document: dict[str, Any]) -> str:
    if document["covariance"] is None or not document["poses"]:
        return ""
    times = magnification(robot, document)
    size = "to scale" if times == 1.0 else f"{times:g} times too large, to be seen at all"
    return f"The 95 % ellipsoid of the initial position is drawn {size}."


def _residual_rows(robot: _core.Robot, run: Run) -> list[tuple[str, ...]]:
    """Channel, rms as given, rms with what was found where there is that, σ."""
    sigma = sigma_of(robot)
    rows = []
    for key, (name, unit, factor, sigma_key) in CHANNELS.items():
        documents = [run.calibration, *([run.corrected] if run.corrected is not None else [])]
        values = [document["residual_rms"].get(key) for document in documents]
        if any(value is not None for value in values):
            unit = "°" if unit == "deg" else unit
            limit = sigma[sigma_key] if sigma_key else None
            shown = [scaled(v, factor) for v in (*values, limit)]
            rows.append((name, *(text.small(v, unit) for v in shown)))
    return rows


def _diagnosis(subject: Subject) -> dict[str, Any]:
    document = subject.diagnosis
    assert document is not None
    effects = []
    for effect in document["effects"]:
        held = effect["held_out"]
        effects.append(
            {
                "name": effect["name"],
                "sentence": effect["sentence"],
                "remedy": effect["remedy"],
                "equation": effect["equation"],
                "rows": [
                    (where, text.typeset(value), text.typeset(deviation), unit)
                    for where, value, deviation, unit in value_rows(effect)
                ],
                "evidence": "–"
                if effect["log_evidence"] is None
                else f"{effect['log_evidence']:.1f} nat",
                "p": "–" if effect["p_value"] is None else f"{effect['p_value']:.3g}",
                "held_out": "–"
                if held["before"] is None
                else f"{text.small(held['before'], '')} → {text.small(held['after'], '')}",
                "rivals": effect["rivals"],
                "settle": effect["settle"] if effect["rivals"] else "",
            }
        )
    visible = [i for i in document["identifiability"] if i["visible"]]
    infos = {info.name: info for info in _core.effects_of(subject.corrected)}
    return {
        "verdict": document["verdict"],
        "reason": document["reason"],
        "left_over": left_over(document) if document["verdict"] in TRUSTED else [],
        "left_over_words": LEFT_OVER[0].upper() + LEFT_OVER[1:],
        "effects": effects,
        "gap": _gap(document),
        "unexplained": [unexplained_line(left) for left in document["unexplained"]],
        "rejected": unique((r["name"], r["reason"]) for r in document["rejected"]),
        "left_out": document["left_out"],
        "next": document["next"],
        "seen": [
            (i["name"], _times_typical(infos.get(i["name"]), i["detectable"])) for i in visible
        ],
        "unseen": [i["name"] for i in document["identifiability"] if not i["visible"]],
    }


def _times_typical(info: _core.EffectInfo | None, size: float | None) -> str:
    if size is None:
        return "–"
    if info and not believable(info, size):
        return "no believable one"
    return f"{size:.2g} × typical"


def _gap(document: dict[str, Any]) -> dict[str, Any]:
    """The staircase as a table: rms fitted / held out."""
    panels = gap_panels(document)
    rows = [
        [step, *(" / ".join(_three(s.y[i]) for s in reversed(panel.series)) for panel in panels)]
        for i, step in enumerate(gap_steps(document))
    ]
    if any(panel.ripple for panel in panels):
        rows.append(["ripple of the readings, σ", *(_three(p.ripple) for p in panels)])
    return {"heads": [panel.quantity for panel in panels], "rows": rows}


def _three(value: float | None) -> str:
    return "–" if value is None or math.isnan(value) else f"{value:.3g}"


def _log(run: Run) -> dict[str, str]:
    log = run.log
    duration = float(log.time_s[-1] - log.time_s[0])
    absent = [
        name
        for name, table in (
            ("lengths", log.length_m),
            ("swivels", log.swivel_rad),
            ("tensions", log.tension_N),
            ("attitude", log.roll_pitch_yaw_rad),
        )
        if not np.isfinite(table).any()
    ]
    options = run.options
    return {
        "name": log.source,
        "samples": f"{len(log)} in {duration:.1f} s",
        "sha256": log_sha256(log),
        "absent": ", ".join(absent) or "none",
        "options": ", ".join(
            f"{key} {value}" for key, value in options.items() if value or value == 0
        ),
    }
