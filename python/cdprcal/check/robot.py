"""What is remarkable about a robot file: what a slip of unit or sign looks like."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.findings import Finding, Severity, worst_first
from cdprcal.sensors import SENSORS
from cdprcal.workspace import round_step_m
from cdprcal.workspace.document import is_planar

#: The farthest that pulleys of any cable robot are apart; beyond it the positions are in mm.
_FARTHEST_M = 500.0
#: How many times as long as its frame is wide the cables of a robot that hangs deep may be.
_DEEPEST = 20.0
_FEWEST_CABLES = 3  # that a position can be chosen with
#: A swivel angle at mid-workspace beyond this: zero is on the other side of the pulley.
_LARGEST_SWIVEL_RAD = math.radians(90.0)
_WORKSPACE_POINTS = 8_000


@dataclass(frozen=True)
class RobotReport:
    """What a robot file holds and what is wrong with it."""

    robot: _core.Robot
    workspace_m3: float | None
    workspace_m2: float | None  # of a planar platform
    findings: tuple[Finding, ...]

    @property
    def trusted(self) -> bool:
        """Whether nothing in it is certainly wrong."""
        return not any(finding.severity == "error" for finding in self.findings)

    def as_dict(self) -> dict[str, Any]:
        """For ``check ROBOT --json``."""
        robot = self.robot
        return {
            "trusted": self.trusted,
            "robot": robot.name,
            "cables": robot.cable_count,
            "weight_N": robot.weight_N,
            "tension_limits_N": list(robot.tension_limits_N),
            "workspace_m3": self.workspace_m3,
            "workspace_m2": self.workspace_m2,
            "effects": [effect.name for effect in robot.effects],
            "findings": [finding.as_dict() for finding in self.findings],
        }


def check_robot(robot: _core.Robot) -> RobotReport:
    """Looks at sizes, inertia, swivel zeros and tension limits, and where the platform can hang."""
    findings = [*sizes_of(robot), *_copies(robot), *_inertia(robot), *_sigma(robot)]
    size = None
    planar = is_planar(robot)
    if any(finding.severity == "error" for finding in findings):
        pass  # a workspace of wrong sizes says nothing
    elif robot.cable_count >= _FEWEST_CABLES or _core.holds_orientation(robot):
        size, more = _hangs(robot)
        findings += more
    else:
        findings.append(
            _finding(
                "info",
                "workspace_not_computed",
                f"the static workspace is not computed for {robot.cable_count} cables",
                "with fewer than three a position cannot be chosen; calibrate, check, diagnose and "
                "report work all the same, workspace, plan and generate do not",
            )
        )
    volume, area = (None, size) if planar else (size, None)
    return RobotReport(robot, volume, area, worst_first(findings))


def sizes_of(robot: _core.Robot) -> Iterator[Finding]:
    """What no robot can measure: units mixed up, most of all."""
    pulleys = np.array([cable.pulley.position_m for cable in robot.cables])
    anchors = np.array([cable.platform_anchor_m for cable in robot.cables])
    frame_m, platform_m = (_extent(points) for points in (pulleys, anchors))
    if frame_m > _FARTHEST_M:
        yield _finding(
            "error",
            "too_large",
            f"the pulleys are {frame_m:.4g} m apart",
            "position_m is in metres; these look like millimetres",
        )
    least_m, most_m = robot.surroundings.length_limits_m
    if least_m > _DEEPEST * frame_m > 0.0:
        yield _finding(
            "error",
            "length_limits",
            f"every cable is to be {least_m:.4g} to {most_m:.4g} m long, and the pulleys are "
            f"{frame_m:.4g} m apart",
            "length_limits_m is in metres; these look like millimetres",
        )
    if robot.cable_count > 1 and platform_m >= frame_m:
        yield _finding(
            "warning",
            "platform_larger_than_frame",
            f"the platform's anchors are {platform_m:.4g} m apart, the pulleys {frame_m:.4g} m",
            "check that platform_anchor_m is in metres and in the platform's own frame",
        )
    below_m = float(np.linalg.norm(anchors - robot.platform.centre_of_mass_m, axis=1).min())
    if frame_m > 0.0 and below_m > frame_m:
        yield _finding(
            "error",
            "far_centre_of_mass",
            f"the centre of mass is {below_m:.4g} m from the nearest anchor, farther than the "
            f"pulleys are apart ({frame_m:.4g} m)",
            "centre_of_mass_m is in metres and in the platform's own frame, as platform_anchor_m",
        )
    for i, cable in enumerate(robot.cables, 1):
        if cable.pulley.radius_m > 0.25 * frame_m > 0:
            yield _finding(
                "warning",
                "large_pulley",
                f"cable {i}: the pulley's radius is {cable.pulley.radius_m:.4g} m",
                "radius_m is in metres, and a radius, not a diameter",
            )


def _copies(robot: _core.Robot) -> Iterator[Finding]:
    """What stands in the file twice."""
    places = [tuple(cable.pulley.position_m) for cable in robot.cables]
    for i, place in enumerate(places, 1):
        if (first := places.index(place) + 1) < i:
            yield _finding(
                "warning",
                "pulleys_coincide",
                f"cable {i}: its pulley is where that of cable {first} is",
                "correct position_m of one of them, if it is a copy",
            )
    names = [(effect.name, effect.run) for effect in robot.effects]
    for name, run in dict.fromkeys(names):
        if (count := names.count((name, run))) > 1:
            yield _finding(
                "warning",
                "effect_repeated",
                f"effects: {name} stands there {count} times" + (f" for {run}" if run else ""),
                "each is applied after the others; delete all but one, if they are copies",
            )


def _inertia(robot: _core.Robot) -> Iterator[Finding]:
    platform = robot.platform
    if "R" not in platform.motion:
        return  # it cannot turn, so nobody needs to say its inertia
    anchors = np.array([cable.platform_anchor_m for cable in robot.cables])
    reach_m = float(np.linalg.norm(anchors - platform.centre_of_mass_m, axis=1).max())
    gyration_m = math.sqrt(np.linalg.eigvalsh(platform.inertia_kg_m2).max() / platform.mass_kg)
    if gyration_m > 3.0 * max(reach_m, 1e-3):
        yield _finding(
            "warning",
            "large_inertia",
            f"the platform's radius of gyration is {gyration_m:.3g} m, its farthest anchor "
            f"{reach_m:.3g} m from the centre of mass",
            "inertia_kg_m2 is about the centre of mass, in kg m²; many CAD programs give kg mm²",
        )


def _sigma(robot: _core.Robot) -> Iterator[Finding]:
    default = _core.SensorSigma()
    names = (sensor.sigma_field or "" for sensor in SENSORS.values())
    if any(getattr(robot.sigma, name) != getattr(default, name) for name in names):
        return
    usual = [f"lengths {1e3 * default.length_m:g} mm"]
    if not is_planar(robot):  # in a plane no pulley swivels
        usual.append(f"swivels {math.degrees(default.swivel_rad):g}°")
    if "R" in robot.platform.motion:
        usual.append(f"attitude {math.degrees(default.attitude_rad):g}°")
    usual.append(f"tensions {default.tension_N:g} N")
    yield _finding(
        "info",
        "default_sigma",
        "what sensors there are count with the default sigma, that of the paper (eq. 18): "
        + ", ".join(usual),
        "enter your sensors' own under sensors: sigma, if you know them",
    )


def _hangs(robot: _core.Robot) -> tuple[float | None, list[Finding]]:
    """Volume [m³] or area [m²] of the static workspace, roughly, and what is odd about it."""
    remedy = "check mass_kg, tension_limits_N, and that pulleys and anchors are in the same order"
    try:
        box = _core.workspace_box(robot)
        step_m = round_step_m(box, _WORKSPACE_POINTS)
        workspace = _core.compute_workspace(robot, box=box, step_m=step_m)
    except InputError as error:  # pulleys in a line, or all in one place
        return None, [_finding("warning", "no_workspace", f"no workspace: {error}", remedy)]
    if not workspace.points_inside:
        why = f"the platform can hang nowhere: {_core.explain_empty(workspace)}"
        if not _core.holds_orientation(robot) or "R" not in robot.platform.motion:
            return None, [_finding("error", "no_workspace", why, remedy)]
        # In one orientation: there may be others, and other ways to be held.
        remedy += "; cdprcal workspace --orientation looks in another"
        return None, [_finding("warning", "no_workspace", why, remedy)]
    size = workspace.points_inside * workspace.grid.step_m ** (2 if is_planar(robot) else 3)
    return size, list(_swivels(robot, workspace))


def _swivels(robot: _core.Robot, workspace: _core.Workspace) -> Iterator[Finding]:
    inside = workspace.inside_m
    nearest = int(np.argmin(np.linalg.norm(inside - inside.mean(axis=0), axis=1)))
    found = _core.inverse(robot, inside[nearest])
    if found.status != _core.EquilibriumStatus.found or found.pose is None:
        return
    angles = _core.platform_state(robot, found.pose).swivel_rad
    for i, angle in enumerate(angles.tolist(), 1):
        if abs(angle) > _LARGEST_SWIVEL_RAD:
            yield _finding(
                "warning",
                "swivel_zero",
                f"cable {i}: its swivel angle is {math.degrees(angle):.0f}° in the middle of the "
                "workspace",
                "x_axis is where the pulley points at angle zero, usually towards the platform or "
                "down; check its sign",
            )


def _extent(points: Any) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _finding(severity: Severity, code: str, message: str, remedy: str) -> Finding:
    return Finding(severity=severity, code=code, message=message, remedy=remedy)
