"""Logs of a platform that never rests, by MuJoCo: nothing of the motion is the package's own."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

import cdprcal
from cdprcal.testing.altered import altered

Array = NDArray[np.float64]

STEP_S, PERIOD_S, RAMP_S = 2e-4, 20.0, 2.0
AXIAL_STIFFNESS_N, TENDON_DAMPING_N_S_M = 2e6, 600.0
SIGMA_LENGTH_M, SIGMA_SWIVEL_RAD, SIGMA_TENSION_N, SIGMA_ATTITUDE_RAD = 1e-4, 1e-3, 0.5, 2e-3


@dataclass
class Hidden:
    """What the robot file does not know."""

    mass_kg: float = 0.0
    centre_of_mass_m: Array = field(default_factory=lambda: np.zeros(3))
    bias_N: Array | float = 0.0
    misalignment_rad: Array = field(default_factory=lambda: np.zeros(3))
    #: Times [s] in which a hand pushes an anchor the way that it goes, with so much force [N].
    pushed_s: tuple[tuple[float, float], ...] = ()
    push_N: float = 0.5


@dataclass
class Swing:
    log: cdprcal.Log
    poses: list[cdprcal.Pose]


def hand(robot: cdprcal.Robot, hidden: Hidden, data: Any, time_s: float) -> Array:
    """Force and moment about the centre of mass of a hand at the first anchor, which goes along."""
    if not any(begin <= time_s < end for begin, end in hidden.pushed_s):
        return np.zeros(6)
    rotation = data.xmat[1].reshape(3, 3)
    arm_m = rotation @ robot.cables[0].platform_anchor_m
    velocity_m_s = data.qvel[:3] + np.cross(rotation @ data.qvel[3:], arm_m)
    # Soft where the platform turns back.
    force_N = hidden.push_N * velocity_m_s / (float(np.linalg.norm(velocity_m_s)) + 0.02)
    out: Array = np.concatenate([force_N, np.cross(data.xpos[1] + arm_m - data.xipos[1], force_N)])
    return out


def text_of(values: Any) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))


def model_of(mujoco: Any, robot: cdprcal.Robot, hidden: Hidden, damping_1_s: float) -> Any:
    """A free body on one spring tendon a cable; damped as a share of mass and inertia."""
    platform = robot.platform
    mass_kg = platform.mass_kg + hidden.mass_kg
    i = platform.inertia_kg_m2
    full = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
    sites = [
        (
            f'<site name="d{c}" pos="{text_of(cable.pulley.position_m)}"/>',
            f'<site name="a{c}" pos="{text_of(cable.platform_anchor_m)}"/>',
        )
        for c, cable in enumerate(robot.cables)
    ]
    tendons = [
        f'<spatial stiffness="1" damping="{TENDON_DAMPING_N_S_M!r}" springlength="0 1">'
        f'<site site="d{c}"/><site site="a{c}"/></spatial>'
        for c in range(len(sites))
    ]
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <compiler balanceinertia="false" boundmass="0" boundinertia="0"/>
  <option timestep="{STEP_S}" gravity="0 0 {-robot.gravity_m_s2}" integrator="RK4"/>
  <worldbody>
    {"".join(fixed for fixed, _ in sites)}
    <body name="platform"><freejoint/>
      <inertial pos="{text_of(platform.centre_of_mass_m + hidden.centre_of_mass_m)}"
                mass="{mass_kg!r}" fullinertia="{text_of(full)}"/>
      {"".join(moving for _, moving in sites)}
    </body>
  </worldbody>
  <tendon>{"".join(tendons)}</tendon>
</mujoco>""")
    model.dof_damping[:3] = damping_1_s * mass_kg
    model.dof_damping[3:] = damping_1_s * np.diag(i)
    return model


def swing(
    mujoco: Any,
    robot: cdprcal.Robot,
    hidden: Hidden | None = None,
    *,
    duration_s: float = 30.0,
    rate_Hz: float = 100.0,
    haul_m: float = 0.06,
    kick: float = 0.3,
    damping_1_s: float = 0.05,
    seed: int = 0,
) -> Swing:
    """From a kick on: winches haul it round a circle (0: locked), nothing comes to rest."""
    hidden = hidden or Hidden()
    random = np.random.default_rng(seed)
    model = model_of(mujoco, robot, hidden, damping_1_s)
    data = mujoco.MjData(model)
    platform = cdprcal.Platform(
        mass_kg=robot.platform.mass_kg + hidden.mass_kg,
        centre_of_mass_m=robot.platform.centre_of_mass_m + hidden.centre_of_mass_m,
        inertia_kg_m2=robot.platform.inertia_kg_m2,
    )
    winches = round_trip(altered(robot, platform=platform), random, haul_m)
    data.qpos[:3] = winches.start.position_m
    mujoco.mju_mat2Quat(data.qpos[3:], winches.start.rotation.flatten())
    mujoco.mj_forward(model, data)
    data.qvel[:] = kick * freely(model, data, random.standard_normal(6))
    n = model.ntendon
    a_sample = round(1.0 / (rate_Hz * STEP_S))
    rows: list[Array] = []
    poses: list[cdprcal.Pose] = []
    times_s = STEP_S * np.arange(round(duration_s / STEP_S), dtype=np.float64)
    sampled_m = winches.natural_m(times_s[::a_sample])
    middle_m = winches.natural_m(times_s + 0.5 * STEP_S)
    for step, time_s in enumerate(times_s):
        if step % a_sample == 0:
            now_m = sampled_m[step // a_sample]
            mujoco.mj_forward(model, data)
            poses.append(cdprcal.Pose(data.xpos[1].copy(), data.xmat[1].reshape(3, 3).copy()))
            pulled_N = AXIAL_STIFFNESS_N * (data.ten_length / now_m - 1.0)
            pulled_N += TENDON_DAMPING_N_S_M * (data.ten_velocity)
            rows.append(np.concatenate([[time_s], now_m, np.maximum(pulled_N, 0.0)]))
        model.tendon_lengthspring[:, 1] = middle_m[step]
        model.tendon_stiffness[:] = AXIAL_STIFFNESS_N / middle_m[step]
        data.xfrc_applied[1] = hand(robot, hidden, data, time_s)
        mujoco.mj_step(model, data)
    table = np.array(rows)
    assert table[:, n + 1 :].min() > 0.0, "a cable went slack and snatches: take another seed"
    turned = rotation_of(mujoco, hidden.misalignment_rad)
    swivel_rad = np.array([swivels(robot, pose) for pose in poses])
    attitude = [
        cdprcal.euler_from_rotation(pose.rotation @ turned, robot.euler_convention)
        for pose in poses
    ]

    def noisy(values: Any, sigma: float) -> Array:
        true = np.asarray(values, dtype=np.float64)
        noisy: Array = true + sigma * random.standard_normal(true.shape)
        return noisy

    attitude_rad = noisy(attitude, SIGMA_ATTITUDE_RAD)
    attitude_rad[:, 2] -= attitude_rad[0, 2]
    length_m, swivel_rad = (
        noisy(table[:, 1 : n + 1], SIGMA_LENGTH_M),
        noisy(swivel_rad, SIGMA_SWIVEL_RAD),
    )
    log = cdprcal.Log(
        time_s=table[:, 0],
        length_m=length_m - length_m[0],
        swivel_rad=swivel_rad - swivel_rad[0],
        tension_N=noisy(table[:, n + 1 :], SIGMA_TENSION_N) + hidden.bias_N,
        roll_pitch_yaw_rad=attitude_rad,
    )
    return Swing(log, poses)


MISREAD = (
    "euler_convention", "attitude_sign", "angle_unit", "length_sign", "swivel_sign", "cable_order",
    "tension_unit",
)  # fmt: skip


def misread(run: Swing, what: str) -> cdprcal.Log:
    """The log as a program wrote it that had its sensors' map wrong, by the catalogue's name."""
    log = run.log
    columns: dict[str, Any] = {
        name: np.array(getattr(log, name))
        for name in ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
    }
    angles = columns["roll_pitch_yaw_rad"]
    if what == "euler_convention":
        random = np.random.default_rng(5)
        zyx = cdprcal.EulerConvention.ZYX
        angles[:] = [cdprcal.euler_from_rotation(pose.rotation, zyx) for pose in run.poses]
        angles += SIGMA_ATTITUDE_RAD * random.standard_normal(angles.shape)
        angles[:, 2] -= angles[0, 2]
    elif what == "attitude_sign":
        angles[:, 1:] *= -1.0
    elif what == "angle_unit":
        angles *= 180.0 / np.pi
    elif what == "cable_order":
        for name in ("length_m", "swivel_rad", "tension_N"):
            columns[name][:, [0, 2]] = columns[name][:, [2, 0]]
    elif what == "tension_unit":
        columns["tension_N"] /= 9.80665
    else:
        columns[{"length_sign": "length_m", "swivel_sign": "swivel_rad"}[what]][:, 1] *= -1.0
    return cdprcal.Log(time_s=log.time_s, **columns)


@dataclass
class RoundTrip:
    """Natural lengths [m] that would hold the platform on a circle, over and over."""

    start: cdprcal.Pose
    spline: CubicSpline

    def natural_m(self, time_s: Array) -> Array:
        """As long as that by each ``time_s``, off gently."""
        gently_s = time_s**2 / (2 * RAMP_S)
        along_s = np.where(time_s < RAMP_S, gently_s, time_s - RAMP_S / 2)
        return np.asarray(self.spline(along_s))


def round_trip(robot: cdprcal.Robot, random: np.random.Generator, radius_m: float) -> RoundTrip:
    centre = random.uniform([-0.1, -0.1, 0.8], [0.1, 0.1, 1.1])
    begin = random.uniform(0.0, 2.0 * np.pi)
    start, lengths = None, []
    for angle in np.linspace(0.0, 2.0 * np.pi, 401):
        out = radius_m * np.array(
            [np.cos(begin + angle), np.sin(begin + angle), 0.3 * np.sin(angle)]
        )
        held, _ = cdprcal.set_point_at(robot, centre + out)
        assert held is not None
        start = start or held.pose
        to = held.pose.position_m + anchors_of(robot) @ held.pose.rotation.T - pulleys_of(robot)
        lengths.append(np.linalg.norm(to, axis=1) / (1.0 + held.tension_N / AXIAL_STIFFNESS_N))
    assert start is not None
    times_s = np.linspace(0.0, PERIOD_S, len(lengths))
    lengths[-1] = lengths[0]
    return RoundTrip(
        start, CubicSpline(times_s, lengths, bc_type="periodic", extrapolate="periodic")
    )


def anchors_of(robot: cdprcal.Robot) -> Array:
    return np.array([cable.platform_anchor_m for cable in robot.cables])


def pulleys_of(robot: cdprcal.Robot) -> Array:
    return np.array([cable.pulley.position_m for cable in robot.cables])


def freely(model: Any, data: Any, velocity: Array) -> Array:
    """The part that leaves all cables as long as they are: nothing goes slack and snatches."""
    along = data.ten_J.reshape(model.ntendon, model.nv)
    out: Array = velocity - np.linalg.pinv(along) @ (along @ velocity)
    return out


def rotation_of(mujoco: Any, vector_rad: Array) -> Array:
    quaternion, rotation = np.zeros(4), np.zeros(9)
    angle_rad = float(np.linalg.norm(vector_rad))
    axis = vector_rad / angle_rad if angle_rad else np.array([1.0, 0.0, 0.0])
    mujoco.mju_axisAngle2Quat(quaternion, axis, angle_rad)
    mujoco.mju_quat2Mat(rotation, quaternion)
    return rotation.reshape(3, 3)


def swivels(robot: cdprcal.Robot, pose: cdprcal.Pose) -> Array:
    """Of each cable at its pulley [rad]."""
    to_m = pose.position_m + anchors_of(robot) @ pose.rotation.T - pulleys_of(robot)
    return np.array(
        [
            cdprcal.cable_state(cable.pulley, to).swivel_rad
            for cable, to in zip(robot.cables, to_m, strict=True)
        ]
    )


def late(run: Swing, rows: int, sensor: str = "roll_pitch_yaw_rad") -> Swing:
    """As logged by a program to which readings of one sensor come so many rows late."""
    read = {}
    for name in ("time_s", "length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad"):
        values = getattr(run.log, name)
        read[name] = values[: len(values) - rows] if name == sensor else values[rows:]
    return Swing(cdprcal.Log(**read), run.poses[rows:])
