"""The robots of the blind bench: built-in and random ones, of any size.

A robot of another mass is the same machine built larger or smaller: lengths go with the cube root
of the mass, forces with the mass, times with the root of a length. What is hidden in it and what
its sensors err by go along (``Scale``), so a case is as hard on any of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal.testing.altered import altered

Floats = NDArray[np.float64]

#: Grid of the set-points by number of poses.
GRIDS = {8: (2, 2, 2), 27: (3, 3, 3)}
#: Platforms that are hung from 3 to 6 cables.
_SMALLEST_KG, _LARGEST_KG = 0.3, 500.0
#: Robots that nobody drew: 3, 4 and 5 cables.
_BUILT_IN = ("ring3", "irma4", "ring5")
#: Draws of a robot, or of tensions, before it is given up; about every second one can be visited.
_MOST_DRAWS = 100

#: What is seen by one kind of sensor alone.
_OF_LOAD_CELLS = {
    "pulley_friction",
    "bending_hysteresis",
    "load_cell_bias",
    "load_cell_gain",
    "load_cell_drift",
    "load_cell_curvature",
}
_OF_SWIVELS = {
    "swivel_hysteresis",
    "swivel_delay",
    "swivel_scale",
    "swivel_sign",
    "swivel_eccentricity",
    "angle_unit",  # or in part
}


@dataclass(frozen=True)
class Scale:
    """How much larger a robot is than the one that typical sizes are meant for."""

    length: float = 1.0
    force: float = 1.0  #: and mass

    @property
    def time(self) -> float:
        """Of a pendulum: gravity stays the same."""
        return float(np.sqrt(self.length))

    def of(self, unit: str) -> float:
        """Factor of a value in this unit."""
        return {
            "m": self.length,
            "N": self.force,
            "kg": self.force,
            "N/s": self.force,
            "N s": self.force * self.time,
            "kg/m": self.force / self.length,
            "rad/m": 1.0 / self.length,
            "m/N": self.length / self.force,
            "1/N": 1.0 / self.force,
            # Load cells of the plant shift by newtons a kelvin, whatever they carry.
            "K": min(1.0, self.force),
        }.get(unit, 1.0)


@dataclass(frozen=True)
class Machine:
    """Which robot a case runs on; its numbers follow from these."""

    name: str = "irma4"  #: built in; or random3 … random6
    seed: int = 0  #: of a random one
    mass_kg: float | None = None  #: None: as the built-in one is
    load_cells: bool = True
    swivels: bool = True

    @property
    def cables(self) -> int:
        """How many."""
        return int(self.name[-1])

    def reads(self, name: str) -> bool:
        """Whether an effect or fault of this name shows in what its sensors read at all."""
        return (self.load_cells or name not in _OF_LOAD_CELLS) and (
            self.swivels or name not in _OF_SWIVELS
        )

    @property
    def scale(self) -> Scale:
        """Against its own drawing."""
        if self.mass_kg is None:
            return Scale()
        ratio = self.mass_kg / _drawing(self.name, self.seed).platform.mass_kg
        return Scale(length=float(np.cbrt(ratio)), force=ratio)

    def robot(self) -> _core.Robot:
        """As its robot file has it."""
        drawing = _drawing(self.name, self.seed)
        return drawing if self.mass_kg is None else _scaled(drawing, self.scale)

    def setpoints(self, poses: int) -> list[Floats]:
        """The tension set-points that every case on it visits."""
        drawn = _setpoints(self.name, self.seed, poses)
        return [self.scale.force * setpoint for setpoint in drawn]

    def poses(self, poses: int) -> list[_core.Pose]:
        """Where lengths lead it, one a set-point; empty: tensions lead it.

        Random robots of six cables are led by tensions, as those of fewer.
        """
        if self.name not in _core.builtin_robot_names() or not _core.holds_orientation(
            self.robot()
        ):
            return []
        length = self.scale.length
        return [
            _core.Pose(length * pose.position_m, pose.rotation)
            for pose in _core.default_stops(_drawing(self.name, self.seed), *GRIDS[poses])[1]
        ]


def draw_machine(rng: np.random.Generator) -> Machine:
    """Built in or random with 3 to 6 cables, evenly; 0.3 to 500 kg, log-uniform."""
    mass_kg = float(np.exp(rng.uniform(np.log(_SMALLEST_KG), np.log(_LARGEST_KG))))
    if rng.random() < 0.5:
        return Machine(str(rng.choice(_BUILT_IN)), mass_kg=mass_kg)
    return Machine(f"random{rng.integers(3, 7)}", int(rng.integers(2**31)), mass_kg)


@cache
def _drawing(name: str, seed: int) -> _core.Robot:
    """At the size it was drawn: the first random one that can be visited at all."""
    if name in _core.builtin_robot_names():
        return _core.load_robot(name)
    rng = np.random.default_rng(seed)
    for _ in range(_MOST_DRAWS):
        robot = _random_robot(rng, int(name[-1]))
        try:
            _visitable(robot, 8, seed)
        except _core.InputError:
            continue
        return robot
    raise _core.InputError(
        f"{name}: none of {_MOST_DRAWS} draws of seed {seed} can be visited; give another seed"
    )


def _random_robot(rng: np.random.Generator, cables: int) -> _core.Robot:
    """Pulleys around a hall of about 2 × 2 × 2 m, anchors around the platform, nothing even."""
    mass_kg = rng.uniform(8.0, 16.0)
    weight_N = 9.81 * mass_kg
    half_m = rng.uniform(0.1, 0.2)
    made = []
    upright = rng.random() < 0.5  # swivel axis: upright as ring3's, or along a side as irma4's
    for i in range(cables):
        angle = 2.0 * np.pi * (i + rng.uniform(-0.2, 0.2)) / cables
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        along = np.array([-out[1], out[0], 0.0])
        down = np.array([0.0, 0.0, -1.0])
        made.append(
            _core.Cable(
                pulley=_core.Pulley(
                    radius_m=rng.uniform(0.015, 0.04),
                    position_m=rng.uniform(0.9, 1.3) * out + [0, 0, rng.uniform(1.6, 2.0)],
                    x_axis=-out if upright else down,
                    swivel_axis=down if upright else along,
                ),
                platform_anchor_m=half_m * out + [0.0, 0.0, rng.uniform(0.0, 0.1)],
            )
        )
    squares = rng.uniform(0.2, 0.4, size=3) ** 2
    return _core.Robot(
        name=f"random{cables}",
        platform=_core.Platform(
            mass_kg=mass_kg,
            centre_of_mass_m=rng.uniform([-0.02, -0.02, -0.15], [0.02, 0.02, 0.0]),
            inertia_kg_m2=np.diag(mass_kg / 12.0 * (squares.sum() - squares)),
        ),
        cables=made,
        tension_limits_N=[0.05 * weight_N, 3.0 * weight_N],
        euler_convention=list(_core.EulerConvention.__members__.values())[int(rng.integers(6))],
    )


@cache
def _setpoints(name: str, seed: int, poses: int) -> list[Floats]:
    return _visitable(_drawing(name, seed), poses, seed)


def _visitable(robot: _core.Robot, poses: int, seed: int) -> list[Floats]:
    """A grid of equilibria; of six random cables, which leave no motion free, drawn ones.

    Raises InputError when there are none.
    """
    if robot.cable_count <= 5 or robot.name in _core.builtin_robot_names():
        return list(_core.default_setpoints(robot, *GRIDS[poses]))
    rng = np.random.default_rng([seed, poses])
    weight_N = robot.gravity_m_s2 * robot.platform.mass_kg
    visited: list[Floats] = []
    for _ in range(_MOST_DRAWS):
        tension_N = weight_N * rng.uniform(0.15, 0.6, size=robot.cable_count)
        if reachable(robot, [*visited, tension_N]):
            visited.append(tension_N)
        if len(visited) == poses:
            return visited
    raise _core.InputError(
        f"set-points: {robot.name} hangs at {len(visited)} of {poses} only; give another seed"
    )


def reachable(robot: _core.Robot, visited: list[Floats]) -> bool:
    """Whether constant tension control reaches each set-point from the one before."""
    try:
        _core.StartUp(robot, _core.StartUpPlan(visited))
    except _core.InputError:
        return False
    return True


def _scaled(robot: _core.Robot, scale: Scale) -> _core.Robot:
    platform, sigma = robot.platform, robot.sigma
    return altered(
        robot,
        platform=_core.Platform(
            mass_kg=scale.force * platform.mass_kg,
            centre_of_mass_m=scale.length * platform.centre_of_mass_m,
            inertia_kg_m2=scale.force * scale.length**2 * platform.inertia_kg_m2,
        ),
        cables=[
            _core.Cable(
                pulley=_core.Pulley(
                    radius_m=scale.length * cable.pulley.radius_m,
                    position_m=scale.length * cable.pulley.position_m,
                    x_axis=cable.pulley.x_axis,
                    swivel_axis=cable.pulley.swivel_axis,
                ),
                platform_anchor_m=scale.length * cable.platform_anchor_m,
            )
            for cable in robot.cables
        ],
        tension_limits_N=[scale.force * limit for limit in robot.tension_limits_N],
        sigma=_core.SensorSigma(
            length_m=scale.length * sigma.length_m,
            swivel_rad=sigma.swivel_rad,
            attitude_rad=sigma.attitude_rad,
            tension_N=scale.force * sigma.tension_N,
        ),
    )
