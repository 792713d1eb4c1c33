"""A robot file to be filled in: ``cdprcal check`` names the next thing that is missing."""

from __future__ import annotations

import re
from pathlib import Path

from cdprcal import _core
from cdprcal.io.files import read_bytes

#: Stands where a number is to be entered. The robot file's reader refuses it, naming the place.
BLANK = "FILL"

_HEAD = """\
# Robot file of cdprcal. Replace every {blank}, then: cdprcal check {name}.yaml
# SI units; the unit is the key's suffix. World frame: z up. Platform frame: any, fixed in it.
name: {name}
gravity_m_s2: 9.81

platform:
  # On a scale, with everything that hangs on it.
  mass_kg: {blank}
  # In the platform frame; from CAD, or hang the platform by one anchor after the other.
  centre_of_mass_m: [{blank}, {blank}, {blank}]
  # About the centre of mass, from CAD. Only plan and the simulator use it.
  inertia_kg_m2: [[{blank}, 0, 0], [0, {blank}, 0], [0, 0, {blank}]]
  # What it can do, in turns (R) and shifts (T): 3R3T anything, 3T a point in space, 1R2T in a
  # plane, 2T a point in a plane; the last two with the direction across the plane, as here:
  # motion: 1R2T
  # motion_plane_normal: [0, 1, 0]

cables:
"""

_CABLE = """\
  # Cable {number}
  - pulley:
      # Of the groove, where the cable runs; 0 is a plain eyelet.
      radius_m: {blank}
      # D: where the cable enters the groove, on the swivel axis. World frame.
      position_m: [{blank}, {blank}, {blank}]
      # How well that is known (one sigma); cdprcal geometry finds what is not known well.
      # position_sigma_m: 0.5
      # Where the pulley points at swivel angle zero, and the axis that it swivels about.
      x_axis: [{blank}, {blank}, {blank}]
      swivel_axis: [{blank}, {blank}, {blank}]
    # Where the cable holds the platform. Platform frame.
    platform_anchor_m: [{blank}, {blank}, {blank}]
"""

_TAIL = """\

# Least: no cable goes slack. Most: what winches, cables and load cells bear.
tension_limits_N: [{blank}, {blank}]

sensors:
  # Order of the attitude sensor's angles: R = Rx(roll) Ry(pitch) Rz(yaw) is XYZ.
  euler_convention: XYZ
  # One standard deviation of each reading; these are the paper's (eq. 18), generous for most.
  sigma: {{length_m: 0.01, swivel_deg: 1, attitude_deg: 2, tension_N: 10}}
"""


def robot_template(name: str, cables: int) -> str:
    """The text of a robot file for so many cables, with blanks."""
    parts = [_HEAD.format(blank=BLANK, name=name)]
    parts += [_CABLE.format(blank=BLANK, number=number) for number in range(1, cables + 1)]
    return "".join(parts) + _TAIL.format(blank=BLANK)


def robot_like(source: str, name: str) -> str:
    """The file of a built-in robot or of a path, comments and all, under another name.

    Raises InputError when it is no robot.
    """
    if source in _core.builtin_robot_names():
        text = _core.builtin_robot_yaml(source)
    else:
        _core.load_robot(source)  # says what is wrong with it, and where
        text = read_bytes(Path(source)).decode("utf-8")
    renamed, count = re.subn(r"(?m)^name:.*$", f"name: {name}", text, count=1)
    return renamed if count else f"name: {name}\n{text}"
