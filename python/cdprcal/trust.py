"""What restricts a calibration that converged: the caveats that go with its pose."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.findings import Finding
from cdprcal.sensors import CHANNELS

#: What the core says of a fit that it believes; what it adds behind this restricts it.
CLAIM = "minimum found; residuals are within what the sensors' sigma allow"
#: Caveats that say of which pose the answer is, not that it is off.
ABOUT_RUN = ("gap", "short_run")
#: How often a log of a robot that is as its file says gets the caveat "misfit"; diagnose takes as
#: much for the chance of an accusation.
FALSE_ALARMS = 0.01
#: Of the size of the robot: what an eye beside it sees.
BY_EYE = 0.01
_BY_EYE = f"which is no better than the eye: {BY_EYE:.0%} of the robot's size"
#: Times that are listed.
_SHOWN = 6


def against_pose(caveats: Iterable[Finding]) -> tuple[Finding, ...]:
    """Of the caveats of a calibration those for which its pose may be off, or is not to be used."""
    return tuple(caveat for caveat in caveats if caveat.code not in ABOUT_RUN)


def caveats_of(calibration: _core.Calibration) -> tuple[Finding, ...]:
    """What is to be known before the pose is used; empty for one that did not converge.

    ``misfit``: residuals are larger than the readings scatter within a rest, by χ² over all of
    them, or an effect of the catalogue is there by 95 %; ``unchecked``: as many numbers are fitted
    as are read; ``unbalanced``: the balance of several rests is left out, as an outlier;
    ``imprecise``: by its own σ the pose is no better than what an eye sees;
    ``reservation``: what the core adds to its claim.
    """
    result = calibration.result
    if result.status != _core.CalibrationStatus.converged:
        return ()
    found = []
    added = result.reason.removeprefix(CLAIM).lstrip("; ").removeprefix("yet ")
    if added:
        found.append(
            Finding(
                severity="warning",
                code="reservation",
                message=f"{added}",
                remedy="use the pose with care, or let cdprcal diagnose find what the model lacks",
            )
        )
    if result.residual_count <= result.parameter_count:
        found.append(
            Finding(
                severity="warning",
                code="unchecked",
                message="as many numbers are fitted as are read: what the model lacks, or a sensor "
                "that is off, moves the pose and shows nowhere",
                remedy="measure with more sensors, or check the pose by other means",
            )
        )
    found += _unbalanced(calibration)
    robot = calibration.problem.robot
    position_m, rotation_rad = worst_sigma(result.covariance) or (0.0, 0.0)
    if max(position_m, rotation_rad * _core.characteristic_length_m(robot)) > (
        BY_EYE * _core.robot_size_m(robot)
    ):
        found.append(
            Finding(
                severity="warning",
                code="imprecise",
                message=f"the pose is known to ± {_two_digits(1e3 * position_m)} mm and "
                f"± {_two_digits(math.degrees(rotation_rad))}° (1 σ, worst directions), {_BY_EYE}",
                remedy=_of_pulleys(robot, position_m)
                or "measure at more varied poses, or with more sensors: cdprcal plan --optimal "
                "says where",
            )
        )
    fit = _with_scatter_alone(calibration)
    p_value = 0.0 if fit.status == _core.CalibrationStatus.not_converged else fit.chi_square_p_value
    if p_value < FALSE_ALARMS or result.lacks_something:
        freedom = max(1, fit.residual_count - fit.parameter_count)
        times = _two_digits(math.sqrt(2.0 * fit.cost / freedom))
        seen = (
            f"the model misses the readings by {times} times (rms) what these scatter at rest"
            if p_value < FALSE_ALARMS
            else "the readings agree beyond chance better with an effect that the model has not"
        )
        found.append(
            Finding(
                severity="warning",
                code="misfit",
                message=f"{seen}: it lacks something, or sensors have errors that stay over a rest "
                f"(without either no more than one of {1 / FALSE_ALARMS:g} logs gets this warning)",
                remedy="the pose may be off by more than its σ if the model lacks something: let "
                "cdprcal diagnose find what, or correct the robot file",
            )
        )
    return tuple(found)


def _two_digits(value: float) -> str:
    """As people write them: 420, not 4.2e+02."""
    return f"{float(f'{value:.2g}'):,.9g}"


def _unbalanced(calibration: _core.Calibration) -> Iterator[Finding]:
    """Rests whose balance no other rest agrees with, where that are several: one may be chance.

    Of moments in motion, of which there are hundreds, some are always left out.
    """
    rests = calibration.equilibria
    times_s = sorted(
        {
            reading.time_s
            for reading in calibration.gated
            if (reading.channel, reading.reason) == ("balance", "outlier")
            and (not rests or any(r.begin_s <= reading.time_s <= r.end_s for r in rests))
        }
    )
    if len(times_s) > 1:
        at = ", ".join(f"{time_s:.1f}" for time_s in times_s[:_SHOWN])
        more = ", …" if len(times_s) > _SHOWN else ""
        yield Finding(
            severity="warning",
            code="unbalanced",
            message=f"{len(times_s)} rests are out of balance with all others and left "
            f"out (at {at}{more} s): something may have pulled at the platform or borne it",
            remedy="look what acted there, and on other rests less; or choose rests by --at",
        )


def _known_to(pulley: int, sigma_m: float) -> str:
    return f"pulley {pulley + 1} is known to ± {_two_digits(1e3 * sigma_m)} mm"


def _of_pulleys(robot: _core.Robot, position_m: float) -> str:
    """What to do where pulleys are a good part of why; empty where they are not."""
    sigma_m = np.array([cable.pulley.position_sigma_m for cable in robot.cables])
    if not np.isfinite(sigma_m).any() or np.nanmax(sigma_m) < 0.5 * position_m:
        return ""
    cable, _ = np.unravel_index(np.nanargmax(sigma_m), sigma_m.shape)
    return (
        f"{_known_to(int(cable), np.nanmax(sigma_m))} "
        "(position_sigma_m): measure it, or let cdprcal geometry find the pulleys from more poses"
    )


def caveats_of_frame(found: _core.FrameResult) -> tuple[Finding, ...]:
    """What is to be known before a frame is used; empty for one that did not converge.

    ``imprecise``: a pulley is known no better than an eye sees.
    """
    if found.status != _core.FrameStatus.converged:
        return ()
    sigma_m = np.array(found.anchors_sigma_m).max(axis=1)
    worst = int(np.argmax(sigma_m))
    if not sigma_m[worst] > BY_EYE * _core.robot_size_m(found.corrected):
        return ()
    return (
        Finding(
            severity="warning",
            code="imprecise",
            message=f"{_known_to(worst, sigma_m[worst])} (1 σ, worst direction), {_BY_EYE}",
            remedy="measure at the poses that would tell more, or measure that pulley and give "
            "its position_sigma_m",
        ),
    )


def caveats_of_diagnosis(diagnosis: _core.Diagnosis) -> tuple[Finding, ...]:
    """Why a log with which nothing disagrees may lack something all the same."""
    if not diagnosis.misfit:
        return ()
    return (
        Finding(
            severity="warning",
            code="misfit",
            message=f"no effect is found, yet the model misfits {diagnosis.misfit}: sensors may "
            "err so, and so may the model",
            remedy="measure again, at more rests or with other sensors: what comes again is of "
            "the model",
        ),
    )


def worst_sigma(covariance: Any) -> tuple[float, float] | None:
    """Largest σ of a pose in any direction: position [m], rotation [rad]; None where it is not
    observable. ``covariance``: [6, 6] as of CalibrationResult, or None."""
    if covariance is None:
        return None
    table = np.array(covariance, dtype=float)
    if not np.isfinite(table).all():
        return None
    position_m, rotation_rad = (
        math.sqrt(max(0.0, float(np.linalg.eigvalsh(table[i : i + 3, i : i + 3])[-1])))
        for i in (0, 3)
    )
    return position_m, rotation_rad


def _with_scatter_alone(calibration: _core.Calibration) -> _core.CalibrationResult:
    """The fit again, every reading as good as its samples within a rest say.

    Where no sample says anything (poses of one sample) its noise stays, and so does one that was
    specified; in a list of rests it is the specified one. Only rests and the reference count where
    there are any: what is read in motion lags in its own ways, and a balance there is no better
    than the accelerations, which no scatter at rest says anything of.
    """
    problem = calibration.problem
    if problem.noise is None:
        return calibration.result
    measurements, poses = problem.measurements, calibration.result.poses  # each a copy
    rests = [i for i, m in enumerate(measurements) if i == 0 or m.rests]
    kept = rests if len(rests) > 1 else list(range(len(measurements)))
    if any(measurements[i].moves for i in kept):
        return calibration.result
    # In a list of rests no reading has a neighbour: what it scatters by the robot file says.
    specified = _core.specified_noise(problem.robot.sigma).channels
    is_list = all(noise.sample == 0.0 for noise in problem.noise.channels.values())
    channels = {}
    for name, noise in problem.noise.channels.items():
        signal = noise.signal
        if CHANNELS[name].sensor.is_inertial:  # whose bias stays, and does not scatter
            channels[name] = noise
            continue
        # A column that is noisier than the others scatters, and misfits nothing.
        sample = noise.sample * math.sqrt(signal.rows) * signal.loudest
        channels[name] = (
            _core.ChannelNoise(signal.rounding, sample)
            if noise.sample > 0.0
            else _core.ChannelNoise(specified[name].pose if is_list else noise.pose)
        )
    # The balance may be wrong by what the robot file says, no more.
    force_N = problem.robot.sigma.wrench_force_N
    arm_m = _core.characteristic_length_m(problem.robot)
    again = _core.CalibrationProblem(
        robot=problem.robot,
        measurements=[measurements[i] for i in kept],
        statics=problem.statics,
        left_inverse_rows=problem.left_inverse_rows,
        reference_attitude=problem.reference_attitude,
        reference_statics=problem.reference_statics,
        reference_noise=problem.reference_noise,
        noise=_core.NoiseModel(channels, force_N, force_N * arm_m),
    )
    return _core.solve(again, [poses[i] for i in kept], _core.SolveOptions(explain=False))
