"""A case made into a log by the dynamic simulator, and the truth that goes with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdprcal import _core
from cdprcal.testing.altered import altered
from cdprcal.testing.blind_bench.cases import EVENTS, Case, Hidden, Setting
from cdprcal.testing.blind_bench.families import FAMILIES
from cdprcal.testing.blind_bench.faults import in_readings
from cdprcal.testing.blind_bench.machines import Floats, Machine, Scale, reachable
from cdprcal.testing.blind_bench.signals import SIGNALS, Readings, Recording, Signal

_RESOLUTION = {"length": 1e-6, "angle": 1e-5, "tension": 0.01}
#: Of coarse sensors on irma4: 0.5 mm, 0.1°, 1 N.
_COARSE = {"length": 0.5e-3, "angle": np.radians(0.1), "tension": 1.0}
#: A knock of the case's own, as a share of the run, and its impulse: the platform has rested then.
_KNOCK_AT, _KNOCK_N_S = 0.6, 6.0
#: How long a lone rest is recorded, knock included.
_LONE_REST_S = 6.0
#: Swinging: amplitudes fall by a factor e in 30 s, and half a σ of a sensor passes for rest.
_SWING_DECAY_S, _SWING_SIGMA = 30.0, 0.5


@dataclass(frozen=True)
class Simulated:
    """What the diagnosis gets (`robot`, `log`), and the sealed truth."""

    robot: _core.Robot  #: nominal, with the stated σ
    log: _core.Log
    initial_pose: _core.Pose
    duration_s: float
    event_time_s: float | None  #: of a fault that happens at one time


class SimulationError(RuntimeError):
    """The start-up ended early: there is no whole log."""


def simulate(case: Case, setting: Setting) -> Simulated:
    """Runs the start-up with the case's effects hidden in the plant and its readings.

    Raises SimulationError when the start-up procedure stopped before the last pose.
    """
    machine, scale = case.machine, case.machine.scale
    robot = machine.robot()
    rng = np.random.default_rng([case.seed, 1])
    family = FAMILIES[setting.family]
    plan = _plan(case, setting, robot, rng)
    # The procedure's own limits are not what is tested here: a load cell that is off must not end
    # the run.
    startup = _core.StartUpOptions(watchdog=_patient_watchdog(scale))
    damping = _core.PlatformDamping(
        translation_decay_s=scale.time * 1.0, rotation_decay_s=scale.time * 1.0
    )
    if family.swings:
        startup.rest = _core.RestOptions(tolerance=_SWING_SIGMA)
        damping = _core.PlatformDamping(
            translation_decay_s=_SWING_DECAY_S, rotation_decay_s=_SWING_DECAY_S
        )
    if len(plan.setpoint_N) == 1:
        startup.measure_s = _LONE_REST_S
    duration_s = float(_core.StartUp(robot, plan, startup).planned_duration_s)
    effects = [
        _injected(hidden, duration_s) for hidden in case.hidden if _in_plant(hidden, machine)
    ]
    if case.knocked:
        knock = [_KNOCK_AT * duration_s, 1.0, _KNOCK_N_S * scale.of("N s")]
        effects.append(_core.InjectedEffect("oscillation", knock))
    noise = setting.noise if case.noise is None else case.noise
    signal = SIGNALS[case.signal]
    white = noise if signal.white is None else signal.white
    options = _core.SimulatorOptions(
        seed=case.seed,
        effects=effects,
        sensors=_sensors(robot.sigma, white, scale),
        damping=damping,
        strand=_core.StrandOptions(axial_stiffness_N=scale.force * 1e7),
        winch=_core.WinchOptions(
            tension_noise_N=scale.force * 0.2, max_velocity_m_s=scale.length / scale.time
        ),
        # The smallest robots are twice as fast; samples stay at multiples of the step.
        step_s=1e-3 if scale.time >= 1.0 else 0.5e-3,
    )
    try:
        run = _core.simulate_startup(
            robot,
            plan,
            simulator=options,
            startup=startup,
            log_rate_Hz=signal.log_rate_Hz,
            initial_pose=_parked(case, robot, plan),
        )
    except _core.InputError as error:
        raise SimulationError(str(error)) from error
    if run.state != _core.StartUpState.done:
        raise SimulationError(f"{run.state.name}: {run.reason}")
    log = _altered(run, case, signal, noise, robot, rng)
    return Simulated(
        robot=_stated(robot, noise * case.stated),
        log=log,
        initial_pose=run.poses[0],
        duration_s=float(log.time_s[-1]),
        event_time_s=next(
            (h.values[0] * duration_s for h in case.hidden if h.name in EVENTS), None
        ),
    )


def _plan(
    case: Case, setting: Setting, robot: _core.Robot, rng: np.random.Generator
) -> _core.StartUpPlan:
    setpoints = case.machine.setpoints(setting.poses)
    poses = case.machine.poses(setting.poses)
    order = _visited(case, robot, setpoints, bool(poses), rng)
    if FAMILIES[setting.family].revisits:
        order = [*order, *order[-2:-4:-1]]  # back the way it came
    return _core.StartUpPlan(
        [setpoints[i] for i in order], pose=[poses[i] for i in order] if poses else []
    )


def _visited(
    case: Case, robot: _core.Robot, setpoints: list[Floats], held: bool, rng: np.random.Generator
) -> list[int]:
    order = list(range(len(setpoints)))
    if case.rests:
        first, count = case.rests
        order = order[first : first + count]
    if not case.shuffled:
        return order
    shuffled = [order[i] for i in rng.permutation(len(order))]
    # Constant tension control does not reach every set-point from every other.
    return shuffled if held or reachable(robot, [setpoints[i] for i in shuffled]) else order


def _parked(case: Case, robot: _core.Robot, plan: _core.StartUpPlan) -> _core.Pose | None:
    """Where the platform is at power-on when lengths lead it; None: where its tensions hold it."""
    if not plan.pose:
        return None
    start = _core.parked_start(robot, plan.pose[0], case.seed)
    if start is None:
        raise SimulationError("the platform is held nowhere near the first pose")
    return start.pose


def _patient_watchdog(scale: Scale) -> _core.WatchdogOptions:
    return _core.WatchdogOptions(
        follow_s=60.0,
        tension_s=60.0,
        stuck_s=60.0,
        runaway_m=max(1.0, scale.length) * 5.0,
        follow_share=5.0,
    )


def _sensors(sigma: _core.SensorSigma, noise: float, scale: Scale) -> _core.SensorOptions:
    def channel(sigma: float, resolution: float) -> _core.SensorChannel:
        return _core.SensorChannel(noise=noise * sigma, resolution=resolution)

    return _core.SensorOptions(
        length_m=channel(sigma.length_m, scale.length * _RESOLUTION["length"]),
        swivel_rad=channel(sigma.swivel_rad, _RESOLUTION["angle"]),
        tension_N=channel(sigma.tension_N, scale.force * _RESOLUTION["tension"]),
        roll_pitch_rad=channel(sigma.attitude_rad, _RESOLUTION["angle"]),
        yaw_rad=channel(sigma.attitude_rad, _RESOLUTION["angle"]),
    )


def _stated(robot: _core.Robot, factor: float) -> _core.Robot:
    """The nominal robot, its file stating `factor` times its σ."""
    sigma = robot.sigma
    return altered(
        robot,
        sigma=_core.SensorSigma(
            length_m=factor * sigma.length_m,
            swivel_rad=factor * sigma.swivel_rad,
            attitude_rad=factor * sigma.attitude_rad,
            tension_N=factor * sigma.tension_N,
        ),
    )


def _swivel_eccentricity(readings: Readings, amount: float) -> None:
    readings["swivel_rad"] += amount * np.sin(readings["swivel_rad"])


def _roll_pitch_bend(readings: Readings, amount: float) -> None:
    angles = readings["roll_pitch_yaw_rad"][:, :2]
    angles *= 1.0 + amount * angles


def _load_cell_curvature(readings: Readings, amount: float) -> None:
    readings["tension_N"] *= 1.0 + amount * readings["tension_N"]


#: What is outside the catalogue and not in the plant either: done to the readings of the log.
_IN_READINGS: dict[str, Callable[[Readings, float], None]] = {
    "swivel_eccentricity": _swivel_eccentricity,
    "roll_pitch_bend": _roll_pitch_bend,
    "load_cell_curvature": _load_cell_curvature,
}
#: Effects of the plant that begin at a time, their first value.
_TIMED = {e["name"] for e in _core.injectable_effects() if e["parameters"][0][0] == "time_s"}


def _in_plant(hidden: Hidden, machine: Machine) -> bool:
    fault = in_readings(hidden.name, hidden.values, machine.cables)
    return hidden.name not in _IN_READINGS and fault is None


def _injected(hidden: Hidden, duration_s: float) -> _core.InjectedEffect:
    values = list(hidden.values)
    if hidden.name in _TIMED:
        values[0] *= duration_s  # drawn as a share of the run
    return _core.InjectedEffect(hidden.name, values)


def _altered(
    run: _core.StartUpRun,
    case: Case,
    signal: Signal,
    noise: float,
    robot: _core.Robot,
    rng: np.random.Generator,
) -> _core.Log:
    """The log with what is wrong in its readings alone: outside effects, errors, faults."""
    readings: Readings = {
        "length_m": np.array(run.log.length_m),
        "swivel_rad": np.array(run.log.swivel_rad),
        "tension_N": np.array(run.log.tension_N),
        "roll_pitch_yaw_rad": np.array(run.log.roll_pitch_yaw_rad),
    }
    for hidden in case.hidden:
        if hidden.name in _IN_READINGS:
            _IN_READINGS[hidden.name](readings, hidden.values[0])
    recording = _recording(run, case, noise, robot, readings)
    if signal.spoil:
        signal.spoil(recording, rng)
    recording = recording.every(signal.every)
    read = recording.readings
    # What the drives were asked for is told in the load cells' unit and order.
    read["tension_setpoint_N"] = np.array(recording.tension_setpoint_N)
    for hidden in case.hidden:
        fault = in_readings(hidden.name, hidden.values, robot.cable_count)
        if fault:
            fault(read, hidden.values)
    if not case.machine.load_cells:
        del read["tension_N"], read["tension_setpoint_N"]
    if not case.machine.swivels:
        del read["swivel_rad"]
    return _core.Log(time_s=recording.time_s, source=f"case-{case.number}", **read)


def _recording(
    run: _core.StartUpRun, case: Case, noise: float, robot: _core.Robot, readings: Readings
) -> Recording:
    factor = _units(case)
    sigma, scale = robot.sigma, case.machine.scale
    attitude = factor["roll_pitch_yaw_rad"]
    return Recording(
        time_s=np.array(run.log.time_s),
        readings=readings,
        position_m=np.array([pose.position_m for pose in run.poses]),
        tension_setpoint_N=np.array(run.log.tension_setpoint_N),
        rests_s=[(rest.begin_s, rest.end_s) for rest in run.rests],
        scale={
            "length_m": factor["length_m"] * noise * sigma.length_m,
            "swivel_rad": factor["swivel_rad"] * noise * sigma.swivel_rad,
            "tension_N": noise * sigma.tension_N,
            "roll_pitch_yaw_rad": attitude * noise * sigma.attitude_rad,
        },
        quantum={
            "length_m": factor["length_m"] * scale.length * _COARSE["length"],
            "swivel_rad": factor["swivel_rad"] * _COARSE["angle"],
            "tension_N": scale.force * _COARSE["tension"],
            "roll_pitch_yaw_rad": attitude * _COARSE["angle"],
        },
        turn=attitude * 2.0 * np.pi,
        size_m=scale.length,
    )


#: Sensors whose readings the plant multiplies by a fault's values.
_UNITS = {"length_unit": ["length_m"], "angle_unit": ["swivel_rad", "roll_pitch_yaw_rad"]}


def _units(case: Case) -> dict[str, float]:
    """What the plant multiplies readings by: errors come in the unit that a sensor reads."""
    factor = {"length_m": 1.0, "swivel_rad": 1.0, "roll_pitch_yaw_rad": 1.0}
    for hidden in case.hidden:
        factor |= dict(zip(_UNITS.get(hidden.name, []), hidden.values, strict=False))
    return factor
