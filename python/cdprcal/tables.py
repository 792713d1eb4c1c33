"""Answers for people: the first line says it, then why, then detail; --verbose has the lists."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from rich.console import Console
from rich.text import Text

from cdprcal import sensors
from cdprcal.findings import Finding
from cdprcal.terminal import Table, answers, counted, degrees, fixed, notes, say, scaled, summed_up
from cdprcal.trust import worst_sigma

_STYLE = {"error": "bold red", "warning": "yellow", "info": "cyan"}


def print_findings(
    findings: Iterable[Finding], out: Console | None = None, *, verbose: bool = False
) -> None:
    """One line a finding, its remedy below it; on stderr unless they are what was asked.

    Findings of one kind become one with a count, unless ``verbose``.
    """
    out = out or notes()
    alike: dict[object, list[Finding]] = {}
    for number, finding in enumerate(findings):
        kind = number if verbose else (finding.severity, finding.code, finding.remedy)
        alike.setdefault(kind, []).append(finding)
    for group in alike.values():
        first = group[0]
        more = f"; and {len(group) - 1} more like it: --verbose" if len(group) > 1 else ""
        line = Text(f"{first.severity}: ", style=_STYLE[first.severity])
        say(out, line + Text(f"{first.message}{_place(first)}{more}", style="none"))
        say(out, Text(f"    {first.remedy}", style="dim"))


def _place(finding: Finding) -> str:
    """The place, unless the message already names it."""
    parts = []
    if finding.line is not None and "line" not in finding.message:
        parts.append(f"line {finding.line}")
    if finding.time_s is not None:
        end = finding.end_s
        parts.append(
            f"{finding.time_s:g} s"
            if end is None or end == finding.time_s
            else f"{finding.time_s:g} to {end:g} s"
        )
    return f" [{', '.join(parts)}]" if parts else ""


def print_check(
    report: dict[str, Any], findings: Iterable[Finding], *, verbose: bool = False
) -> None:
    """Whether a log can be used, what is wrong with it, what it holds and how its samples come."""
    out = answers()
    findings = list(findings)
    _say_verdict(out, report["log"], report["trusted"], findings)
    print_findings(findings, out, verbose=verbose)
    segments = report["segments"]
    say(
        out,
        f"{report['format']} log, {counted(report['samples'], 'sample')}, "
        f"{counted(len(segments), 'segment')}, "
        f"{counted(len(report['equilibria']), 'equilibrium', 'equilibria')} in the run",
    )
    table = Table("segment", "from [s]", "to [s]", "samples", "", text={4})
    for number, segment in enumerate(segments):
        if not (segment["run"] or verbose):
            continue
        table.add_row(
            str(number),
            f"{segment['begin_s']:.3f}",
            f"{segment['end_s']:.3f}",
            str(segment["samples"]),
            "run" if segment["run"] else "",
        )
    out.print(table)
    if not verbose and len(segments) > 1:
        say(out, f"{counted(len(segments) - 1, 'other segment')}: --verbose")
    for signal in report["signals"]:
        if words := _not_white(signal):
            say(out, f"{sensors.CHANNELS[signal['channel']].label}: {words}")


def _say_verdict(out: Console, what: str, trusted: bool, findings: list[Finding]) -> None:
    """'run.csv can be used: 2 warnings'."""
    counts = [
        counted(sum(finding.severity == kind for finding in findings), kind)
        for kind in ("error", "warning")
        if any(finding.severity == kind for finding in findings)
    ]
    verdict = "can be used" if trusted else "cannot be trusted"
    line = Text(f"{what} ") + Text(verdict, style="bold green" if trusted else "bold red")
    say(out, line + Text(f": {', '.join(counts) or 'nothing is wrong with it'}", style="none"))


def _not_white(signal: dict[str, Any]) -> str:
    """How the samples of a channel come, where not each is a reading with a noise of its own."""
    unit, scale = _UNITS[sensors.CHANNELS[signal["channel"]].sensor.unit]
    words = []
    if signal["resolution"]:
        words.append(f"in steps of {scale * signal['resolution']:.2g} {unit}")
    if signal["hold_rows"] > 1.0:
        words.append(f"read anew in every {signal['hold_rows']:g} rows")
    if signal["correlation_s"] > 0.0:
        words.append(f"filtered over {1e3 * signal['correlation_s']:.2g} ms")
    return ", ".join(words)


def print_robot_check(report: dict[str, Any], findings: Iterable[Finding]) -> None:
    """Whether a robot file can be used, what is wrong with it, and what it describes."""
    out = answers()
    findings = list(findings)
    _say_verdict(out, report["robot"], report["trusted"], findings)
    print_findings(findings, out, verbose=True)
    low, high = report["tension_limits_N"]
    where = ""
    for size, unit in ((report["workspace_m3"], "m³"), (report["workspace_m2"], "m²")):
        if size is not None:
            where = f", static workspace about {size:.2g} {unit}"
    say(
        out,
        f"{report['cables']} cables, weight {report['weight_N']:.4g} N, "
        f"tensions {low:g} to {high:g} N{where}",
    )


def print_calibration(
    document: dict[str, Any], sigma: dict[str, float], *, verbose: bool = False
) -> None:
    """The result of ``calibrate``; ``sigma`` is what each channel's residuals are held against."""
    out = answers()
    converged = document["status"] == "converged"
    pose = document["initial_pose"]
    if converged:
        say(out, Text(pose_line(document), style="bold"))
    elif pose is None:
        say(out, Text("no initial pose", style="bold red"))
    else:
        say(out, Text("no initial pose that can be trusted", style="bold red"))
    status = Text(document["status"], style="bold green" if converged else "bold red")
    say(out, status + Text(f": {document['reason']}", style="none"))
    if document["least_observed"]:
        say(out, document["least_observed"])
    for line in summed_up(map(gated_line, document["gated"]), verbose=verbose):
        say(out, line)
    if pose is None:
        return
    title = f"initial pose at {document['reference_time_s']:.3f} s"
    say(out, title if converged else f"{title} (not to be trusted)")
    out.print(_pose_table(document))
    out.print(_cable_table(document))
    out.print(_residual_table(document["residual_rms"], sigma))
    if verbose:
        out.print(_poses_table(document["poses"]))
    more = "" if verbose else " (--verbose lists them)"
    say(
        out,
        f"from {document['static_poses']} static and {document['kinematic_poses']} kinematic poses"
        f"{more}; cost {fixed(document['cost'], 3)}, {document['iterations']} iterations, "
        f"{1e3 * document['solve_time_s']:.2f} ms",
    )


def print_motion(motion: dict[str, Any] | None) -> None:
    """What ``calibrate --motion`` adds."""
    if motion is None:
        say(answers(), "motion adds nothing: this is what the rests say")
        return
    shift, turn = (fixed(motion[f"damping_{what}_1_s"], 2) for what in ("shift", "turn"))
    say(
        answers(),
        f"in balance at {counted(motion['moments'], 'moment')} of motion too; what holds the "
        f"platform back lets shifts decay with {shift} 1/s and turns with {turn} 1/s",
    )
    for swing in motion["swings"]:
        model, measured = (swing[f"{who}_hz"] for who in ("model", "measured"))
        if model is None or measured is None:
            continue
        say(
            answers(),
            f"with locked winches it swings at {fixed(measured, 3)} Hz, the model at "
            f"{fixed(model, 3)} Hz ({100.0 * (model / measured - 1.0):+.1f} %)",
        )


def pose_line(document: dict[str, Any]) -> str:
    """The initial pose with its uncertainty in the worst direction (1 σ), on one line."""
    pose = document["initial_pose"]
    x, y, z = (fixed(value, 4) for value in pose["position_m"])
    roll, pitch, yaw = (fixed(degrees(value), 2) for value in pose["euler_rad"])
    position, rotation = worst_sigma(document["covariance"]) or (None, None)
    return (
        f"x {x}, y {y}, z {z} m ± {fixed(scaled(position, 1e3), 2)} mm; "
        f"roll {roll}, pitch {pitch}, yaw {yaw}° ± {fixed(degrees(rotation), 3)}°"
    )


def sigma_of(robot: object) -> dict[str, float]:
    """The robot's sigma by channel, in SI units."""
    sigma = getattr(robot, "sigma")  # noqa: B009
    names = [sensor.sigma_field for sensor in sensors.SENSORS.values() if sensor.sigma_field]
    return {name: getattr(sigma, name) for name in names}


def gated_line(gated: dict[str, Any]) -> str:
    """Which reading was left out, when and why."""
    if gated["reason"] == "slack":
        return (
            f"left out at {gated['time_s']:.3f} s: cable {gated['component'] + 1} is slack "
            f"({gated['size']:.3g} N); its length and swivel, and the balance there"
        )
    name = _reading_name(gated["channel"], gated["component"])
    return (
        f"left out at {gated['time_s']:.3f} s: {name}, an outlier of "
        f"{gated['size']:.1f} standard deviations"
    )


def _reading_name(channel: str, component: int) -> str:
    """A reading in words; ``component`` is the cable or the axis, from 0."""
    if channel == "balance":
        return "the balance of the tensions"
    row = sensors.CHANNELS[channel]
    if row.count == 1:
        return channel.replace("_", " ")
    return row.sensor.column(component).removesuffix(f"_{row.sensor.unit}").replace("_", " ")


def _pose_table(document: dict[str, Any]) -> Table:
    pose = document["initial_pose"]
    deviation = document["standard_deviation"]
    table = Table("", "value", "± σ", "", text={3})
    for i in range(3):
        table.add_row(
            "xyz"[i],
            f"{fixed(pose['position_m'][i], 4)} m",
            f"{fixed(scaled(deviation[i], 1e3), 2)} mm",
            "",
        )
    for i, name in enumerate(("roll", "pitch", "yaw")):
        table.add_row(
            name,
            f"{fixed(degrees(pose['euler_rad'][i]), 3)}°",
            f"{fixed(degrees(deviation[3 + i]), 3)}°",
            f"about world {'xyz'[i]}",
        )
    return table


def _cable_table(document: dict[str, Any]) -> Table:
    table = Table("cable", "initial length [m]", "initial swivel [deg]")
    swivels = document["initial_swivels_rad"]
    for i, length in enumerate(document["initial_lengths_m"]):
        table.add_row(str(i + 1), fixed(length, 4), fixed(degrees(swivels[i]), 3))
    return table


_UNITS = {
    "m": ("mm", 1e3),
    "rad": ("deg", math.degrees(1)),
    "N": ("N", 1.0),
    "m_s2": ("m/s2", 1.0),
    "rad_s": ("deg/s", math.degrees(1)),
}


def _rms_rows(*, absolute: bool) -> dict[str, tuple[str, str, float, str | None]]:
    return {
        c.rms_field: (c.label, *_UNITS[c.sensor.unit], c.sensor.sigma_field)
        for c in sensors.CHANNELS.values()
        if c.sensor.is_absolute == absolute
    }


#: Channel of residual_rms → name for people, unit, factor from SI, key of sigma.
CHANNELS = {
    **_rms_rows(absolute=False),
    "wrench_force_N": ("balance, force", "N", 1.0, None),
    "wrench_moment_Nm": ("balance, moment", "Nm", 1.0, None),
    **_rms_rows(absolute=True),
}


def _residual_table(rms: dict[str, float | None], sigma: dict[str, float]) -> Table:
    table = Table("residuals", "rms", "σ", "unit", text={0, 3})
    for key, (name, unit, factor, sigma_key) in CHANNELS.items():
        value = rms.get(key)
        if value is not None:
            limit = sigma[sigma_key] * factor if sigma_key else None
            table.add_row(
                name, f"{value * factor:.3g}", "" if limit is None else f"{limit:.3g}", unit
            )
    return table


def _poses_table(poses: list[dict[str, Any]]) -> Table:
    table = Table("pose", "time [s]", "x [m]", "y [m]", "z [m]", "kind", text={5})
    for number, pose in enumerate(poses):
        table.add_row(
            str(number),
            f"{pose['time_s']:.3f}",
            *(fixed(value, 4) for value in pose["position_m"]),
            pose["kind"],
        )
    return table
