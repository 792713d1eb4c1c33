"""Results for people: tables and prose on stderr, so that stdout stays free for JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from cdprcal import sensors
from cdprcal.findings import Finding

_STYLE = {"error": "bold red", "warning": "yellow", "info": "cyan"}
_MOST_POSES = 40
_MOST_SEGMENTS = 10


def console() -> Console:
    """A console on stderr; piped, its tables are as wide as they need to be."""
    out = Console(stderr=True, highlight=False, emoji=False, markup=False)
    if out.is_terminal:
        return out
    return Console(stderr=True, highlight=False, emoji=False, markup=False, width=200)


def say(out: Console, text: str | Text) -> None:
    """Prose: wrapped on a terminal, one line when piped, so that it can be searched."""
    out.print(text, soft_wrap=not out.is_terminal, markup=False)


def print_findings(findings: Iterable[Finding]) -> None:
    """One line a finding, its remedy below it."""
    out = console()
    for finding in findings:
        line = Text(f"{finding.severity}: ", style=_STYLE[finding.severity])
        say(out, line + Text(f"{finding.message}{_place(finding)}", style="none"))
        say(out, Text(f"    {finding.remedy}", style="dim"))


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


def print_check(report: dict[str, Any], findings: Iterable[Finding]) -> None:
    """What a log holds, how its samples come, what is wrong with it, and the verdict."""
    out = console()
    count = len(report["segments"])
    say(
        out,
        f"{report['log']}: {report['format']} log, {report['samples']} samples, {count} "
        f"{'segment' if count == 1 else 'segments'}, {len(report['equilibria'])} equilibria in the "
        "run",
    )
    table = plain_table("segment", "from [s]", "to [s]", "samples", "")
    for number, segment in enumerate(report["segments"]):
        if not (segment["run"] or number >= count - _MOST_SEGMENTS):
            continue
        table.add_row(
            str(number),
            f"{segment['begin_s']:.3f}",
            f"{segment['end_s']:.3f}",
            str(segment["samples"]),
            "run" if segment["run"] else "",
        )
    out.print(table)
    if count > _MOST_SEGMENTS:
        say(out, f"only the run and the last of {count} segments are shown: see --json")
    for signal in report["signals"]:
        if words := _not_white(signal):
            say(out, f"{sensors.CHANNELS[signal['channel']].label}: {words}")
    print_findings(findings)
    say(
        out,
        Text("this log can be used", style="green")
        if report["trusted"]
        else Text("this log cannot be trusted", style="bold red"),
    )


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
    """What a robot file describes, what is wrong with it, and the verdict."""
    out = console()
    low, high = report["tension_limits_N"]
    volume = report["workspace_m3"]
    where = "" if volume is None else f", static workspace about {volume:.2g} m³"
    say(
        out,
        f"{report['robot']}: {report['cables']} cables, weight {report['weight_N']:.4g} N, "
        f"tensions {low:g} to {high:g} N{where}",
    )
    print_findings(findings)
    say(
        out,
        Text("this robot file can be used", style="green")
        if report["trusted"]
        else Text("this robot file cannot be trusted", style="bold red"),
    )


def print_calibration(document: dict[str, Any], sigma: dict[str, float]) -> None:
    """The result of ``calibrate``; ``sigma`` is what each channel's residuals are held against."""
    out = console()
    converged = document["status"] == "converged"
    status = Text(document["status"], style="bold green" if converged else "bold red")
    say(out, status + Text(f": {document['reason']}", style="none"))
    say(
        out,
        f"{document['static_poses']} static and {document['kinematic_poses']} kinematic poses, "
        f"{document['iterations']} iterations, {1e3 * document['solve_time_s']:.2f} ms, "
        f"cost {fixed(document['cost'], 3)}",
    )
    if document["initial_pose"] is None:
        return
    title = f"initial pose at {document['reference_time_s']:.3f} s"
    say(out, title if converged else f"{title} (not to be trusted)")
    out.print(_pose_table(document))
    if document["least_observed"]:
        say(out, document["least_observed"])
    out.print(_cable_table(document))
    for gated in document["gated"]:
        say(out, gated_line(gated))
    say(out, "residuals")
    out.print(_residual_table(document["residual_rms"], sigma))
    out.print(_poses_table(document["poses"]))


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
    return row.sensor.column(component).rpartition("_")[0].replace("_", " ")


def plain_table(*headers: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    for header in headers:
        table.add_column(header, justify="right", no_wrap=True)
    return table


def _pose_table(document: dict[str, Any]) -> Table:
    pose = document["initial_pose"]
    deviation = document["standard_deviation"]
    table = plain_table("", "value", "± σ", "", "value", "± σ (about world x, y, z)")
    for i in range(3):
        table.add_row(
            "xyz"[i],
            f"{fixed(pose['position_m'][i], 4)} m",
            f"{fixed(scaled(deviation[i], 1e3), 2)} mm",
            ("roll", "pitch", "yaw")[i],
            f"{fixed(degrees(pose['euler_rad'][i]), 3)}°",
            f"{fixed(degrees(deviation[3 + i]), 3)}°",
        )
    return table


def _cable_table(document: dict[str, Any]) -> Table:
    table = plain_table("cable", "initial length [m]", "initial swivel [deg]")
    swivels = document["initial_swivels_rad"]
    for i, length in enumerate(document["initial_lengths_m"]):
        table.add_row(str(i + 1), fixed(length, 4), fixed(degrees(swivels[i]), 3))
    return table


_UNITS = {"m": ("mm", 1e3), "rad": ("deg", math.degrees(1)), "N": ("N", 1.0)}


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
    table = plain_table("channel", "rms", "σ", "unit")
    for key, (name, unit, factor, sigma_key) in CHANNELS.items():
        value = rms.get(key)
        if value is not None:
            limit = sigma[sigma_key] * factor if sigma_key else None
            table.add_row(
                name, f"{value * factor:.3g}", "" if limit is None else f"{limit:.3g}", unit
            )
    return table


def _poses_table(poses: list[dict[str, Any]]) -> Table:
    table = plain_table("pose", "time [s]", "x [m]", "y [m]", "z [m]", "kind")
    shown = poses
    if len(poses) > _MOST_POSES:  # the reference and what rests; --json has them all
        shown = [p for i, p in enumerate(poses) if i == 0 or p["kind"] == "static"][:_MOST_POSES]
    for pose in shown:
        table.add_row(
            str(poses.index(pose)),
            f"{pose['time_s']:.3f}",
            *(fixed(value, 4) for value in pose["position_m"]),
            pose["kind"],
        )
    if len(shown) < len(poses):
        table.caption = f"and {len(poses) - len(shown)} more, see --json"
        table.caption_justify = "left"
    return table


def fixed(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def degrees(value: float | None) -> float | None:
    return scaled(value, math.degrees(1))
