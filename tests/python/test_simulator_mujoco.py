"""The simulated plant beside MuJoCo, which knows nothing of it: the same robot, the same transient.

Eyelets instead of pulleys, since MuJoCo's tendons run through points.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import cdprcal

mujoco = pytest.importorskip("mujoco")

Array = NDArray[np.float64]

AXIAL_STIFFNESS_N = 2e5
DURATION_S, LOOK_S, MUJOCO_STEP_S = 5.0, 0.05, 5e-5


def with_eyelets() -> cdprcal.Robot:
    """irma4 with pulleys of radius 0."""
    text = cdprcal.builtin_robot_yaml("irma4").replace("radius_m: 0.03", "radius_m: 0")
    return cdprcal.parse_robot(text, "irma4 with eyelets")


def undamped() -> cdprcal.SimulatorOptions:
    forever = float("inf")
    return cdprcal.SimulatorOptions(
        strand=cdprcal.StrandOptions(axial_stiffness_N=AXIAL_STIFFNESS_N, damping_ratio=0.0),
        damping=cdprcal.PlatformDamping(translation_decay_s=forever, rotation_decay_s=forever),
        winch=cdprcal.WinchOptions(
            mode=cdprcal.WinchMode.velocity, time_constant_s=0.0, tension_noise_N=0.0
        ),
        sensors=cdprcal.perfect_sensors(),
    )


def mujoco_model(robot: cdprcal.Robot, joints: str = "<freejoint/>") -> Any:
    """A body on one spring tendon a cable, which pulls only beyond its natural length."""
    centre = " ".join(map(repr, robot.platform.centre_of_mass_m.tolist()))
    i = robot.platform.inertia_kg_m2
    inertia = " ".join(
        repr(float(v)) for v in (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
    )
    frame, platform, tendons = [], [], []
    for c, cable in enumerate(robot.cables):
        at = [
            " ".join(map(repr, p.tolist()))
            for p in (cable.pulley.position_m, cable.platform_anchor_m)
        ]
        frame.append(f'<site name="d{c}" pos="{at[0]}"/>')
        platform.append(f'<site name="a{c}" pos="{at[1]}"/>')
        tendons.append(
            f'<spatial stiffness="1" springlength="0 1"><site site="d{c}"/><site site="a{c}"/>'
            "</spatial>"
        )
    return mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <compiler balanceinertia="false" boundmass="0" boundinertia="0"/>
  <option timestep="{MUJOCO_STEP_S}" gravity="0 0 {-robot.gravity_m_s2}" integrator="RK4"/>
  <worldbody>
    {"".join(frame)}
    <body name="platform">{joints}
      <inertial pos="{centre}" mass="{robot.platform.mass_kg!r}" fullinertia="{inertia}"/>
      {"".join(platform)}
    </body>
  </worldbody>
  <tendon>{"".join(tendons)}</tendon>
</mujoco>""")


class MujocoPlant:
    """The model at the simulator's state; cables of natural length ``natural_m`` [n]."""

    def __init__(self, robot: cdprcal.Robot, truth: cdprcal.PlantTruth, natural_m: Array) -> None:
        self.model = mujoco_model(robot)
        self.data = mujoco.MjData(self.model)
        self.natural_m = natural_m.copy()
        pose = truth.pose
        self.data.qpos[:] = [*pose.position_m, *wxyz(pose)]
        self.data.qvel[:3] = truth.twist[:3]
        self.data.qvel[3:] = pose.rotation.T @ truth.twist[3:]  # MuJoCo turns in body axes

    def advance(self, velocity_m_s: Array, duration_s: float) -> None:
        for _ in range(round(duration_s / MUJOCO_STEP_S)):
            middle = self.natural_m + 0.5 * MUJOCO_STEP_S * velocity_m_s
            self.model.tendon_lengthspring[:, 1] = middle
            self.model.tendon_stiffness[:] = AXIAL_STIFFNESS_N / middle
            mujoco.mj_step(self.model, self.data)
            self.natural_m += MUJOCO_STEP_S * velocity_m_s

    def pose(self) -> cdprcal.Pose:
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, self.data.qpos[3:])
        return cdprcal.Pose(self.data.qpos[:3], rotation.reshape(3, 3))


def wxyz(pose: cdprcal.Pose) -> Array:
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, pose.rotation.flatten())
    return quaternion


@pytest.mark.parametrize(
    ("winches", "step_s", "knock"),
    [("locked", 2.5e-4, 1.0), ("hauling", 2.5e-4, 1.0), ("hauling", 1e-3, 0.4)],
)
def test_a_transient_of_five_seconds_is_mujocos(winches: str, step_s: float, knock: float) -> None:
    """Undamped, with cables that go slack and snatch: the step must resolve their vibrations."""
    robot = with_eyelets()
    options = undamped()
    options.step_s = step_s
    simulator = cdprcal.Simulator(robot, options)
    assert simulator.reset(np.array([80.0, 95.0, 85.0, 75.0])).found
    start = simulator.truth().pose
    natural_m = simulator.read().length_m  # perfect encoders, no offsets: what is paid out
    simulator.push(knock * np.array([0.1, -0.15, 0.05]), knock * np.array([0.3, -0.2, 0.5]))
    other = MujocoPlant(robot, simulator.truth(), natural_m)
    moved_m = turned_rad = 0.0
    least_N = np.inf
    for i in range(round(DURATION_S / LOOK_S)):
        velocity_m_s = np.zeros(4)
        if winches == "hauling" and i < 40:  # two seconds
            velocity_m_s = np.array([-0.06, 0.02, 0.05, -0.01])
        simulator.command_velocity(velocity_m_s)
        assert simulator.advance(LOOK_S)
        other.advance(velocity_m_s, LOOK_S)
        ours, theirs = simulator.truth().pose, other.pose()
        assert np.linalg.norm(ours.position_m - theirs.position_m) < 1e-3
        assert np.degrees(cdprcal.rotation_distance_rad(ours, theirs)) < 0.1
        moved_m = max(moved_m, float(np.linalg.norm(ours.position_m - start.position_m)))
        turned_rad = max(turned_rad, cdprcal.rotation_distance_rad(ours, start))
        least_N = min(least_N, float(simulator.truth().tension_N.min()))
    # It was worth looking: many times the tolerance, and through slack.
    assert moved_m > 0.01
    assert np.degrees(turned_rad) > 2.0
    assert least_N == 0.0


#: A point and a plate in a plane, and what MuJoCo calls their guides.
_SLIDES = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
_GUIDED = {
    "2T": ("platform_anchor_m: [0, 0, 0]", _SLIDES),
    "1R2T": ("platform_anchor_m: [{x}, 0, {z}]", _SLIDES + '<joint type="hinge" axis="0 1 0"/>'),
}


@pytest.mark.parametrize("motion", _GUIDED)
def test_on_guides_a_transient_is_mujocos(motion: str) -> None:
    """Slides and hinges without friction; cables that are not all in the plane press on them."""
    anchor, joints = _GUIDED[motion]
    corners = [(-0.8, 0.1, 1.2), (0.8, 0.0, 1.2), (0.8, -0.1, 0.0), (-0.8, 0.0, 0.0)]
    cables = "".join(
        f"  - {{pulley: {{radius_m: 0, position_m: [{x}, {y}, {z}]}}, "
        + anchor.format(x=0.1 * x, z=0.05 - 0.08 * z)
        + "}\n"
        for x, y, z in corners
    )
    robot = cdprcal.parse_robot(
        f"""
name: plate
platform:
  mass_kg: 3
  motion: {motion}
  motion_plane_normal: [0, 1, 0]
  centre_of_mass_m: [0.02, 0.01, -0.03]
  inertia_kg_m2: [[0.02, 0.003, 0.002], [0.003, 0.04, 0.001], [0.002, 0.001, 0.03]]
cables:
{cables}tension_limits_N: [1, 500]
""",
        "plate",
    )
    there = cdprcal.inverse(robot, [0.1, 0.0, 0.5])
    assert there.pose is not None
    soft_N = 5e3  # all that is left is vibration: slow enough that phases agree
    options = undamped()
    options.step_s = 2.5e-4
    options.strand = cdprcal.StrandOptions(axial_stiffness_N=soft_N, damping_ratio=0.0)
    simulator = cdprcal.Simulator(robot, options)
    rest = simulator.reset(there.tension_N, there.pose)
    assert rest.found, rest.reason
    natural_m = simulator.read().length_m
    simulator.push(np.array([0.3, 0.2, -0.4]), np.array([0.3, 0.5, 0.2]))
    model = mujoco_model(robot, joints)
    data = mujoco.MjData(model)
    model.qpos0[:] = 0.0
    start = simulator.truth()
    np.testing.assert_allclose(start.twist[[1, 3, 5]], 0.0, atol=1e-15)
    data.qpos[:2], data.qvel[:2] = start.pose.position_m[[0, 2]], start.twist[[0, 2]]
    if model.nq == 3:
        data.qvel[2] = start.twist[4]
    moved_m = 0.0
    for _ in range(40):
        assert simulator.advance(LOOK_S)
        for _ in range(round(LOOK_S / MUJOCO_STEP_S)):
            model.tendon_lengthspring[:, 1] = natural_m
            model.tendon_stiffness[:] = soft_N / natural_m
            mujoco.mj_step(model, data)
        pose = simulator.truth().pose
        assert pose.position_m[1] == 0.0
        np.testing.assert_allclose(pose.position_m[[0, 2]], data.qpos[:2], atol=2e-4)
        if model.nq == 3:
            pitch = np.arctan2(pose.rotation[0, 2], pose.rotation[0, 0])
            assert abs(pitch - data.qpos[2]) < 2e-3
        away_m = float(np.linalg.norm(pose.position_m - there.pose.position_m))
        moved_m = max(moved_m, away_m)
    assert moved_m > 5e-3
