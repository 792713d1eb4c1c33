"""What is known while the robot is started up, and what to do about it.

After every rest, or while it moves, the initial pose is estimated from all that was read so far;
when the accuracy that was asked for is reached the run ends, and until then each next stop is the
one that teaches most per second. A run may be diagnosed too: then it goes where rivals come apart,
and ends when nothing more would be told. What is solved, predicted and decided is C++
(``OnlineCalibration``, ``NextStopChooser``, ``diagnose``, ``separation_by_stops``).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal._core import RobotSample, StartUp, StartUpCommand, StartUpState
from cdprcal.acquisition.told import Told, settled, told_by
from cdprcal.check import caveats_with_log
from cdprcal.findings import Finding
from cdprcal.io.loaded import LogFile
from cdprcal.results import number
from cdprcal.trust import against_pose, worst_sigma


@dataclass(frozen=True)
class Estimate:
    """The initial pose after some rests, or some motion. NaN: not known yet."""

    time_s: float
    rests: int
    status: str
    reason: str
    position_sigma_m: float  #: standard deviation along the worst axis, whichever way it points
    rotation_sigma_rad: float
    least_observed: str
    pose: _core.Pose | None
    covariance: NDArray[np.float64] | None  #: [6, 6] of the pose, as in CalibrationResult
    reached: bool  #: the accuracy asked for, confirmed by a complete calibration of the log so far
    told: Told | None = None  #: by a diagnosis of the log so far, where one was asked for
    in_motion: bool = False  #: from the motion, too; ``rests``: set-points that were passed
    trusted: bool = True  #: it converged, and its covariance allows for what the model misfits
    #: Of one with the accuracy asked for: what ``calibrate`` on the log so far says against it.
    caveats: tuple[Finding, ...] = ()

    def as_event(self) -> dict[str, Any]:
        """The estimate for the log and ``--json``: SI, None where nothing is known."""
        known = self.pose if math.isfinite(self.position_sigma_m) else None
        return {
            "time_s": self.time_s,
            "rests": self.rests,
            "status": self.status,
            "trusted": self.trusted,
            "position_m": None if known is None else [float(v) for v in known.position_m],
            "rotation": None if known is None else known.rotation.tolist(),
            "position_sigma_m": number(self.position_sigma_m),
            "rotation_sigma_rad": number(self.rotation_sigma_rad),
            "reached": self.reached,
            "in_motion": self.in_motion,
            "caveats": [caveat.code for caveat in self.caveats],
        } | ({} if self.told is None else {"diagnosis": self.told.as_event()})

    def __str__(self) -> str:
        of = "set-point" if self.in_motion else "rest"
        after = f"after {self.rests} {of}{'s' * (self.rests != 1)}"
        if not math.isfinite(self.position_sigma_m) or not self.trusted:
            converged = self.status == _core.CalibrationStatus.converged.name
            misfits = "not to be trusted, σ leaves out by what the model misfits"
            return f"{after}: {misfits if converged else self.status.replace('_', ' ')}"
        but = ", ".join(caveat.code for caveat in self.caveats)
        return (
            f"{after}: ± {1e3 * self.position_sigma_m:.2g} mm, "
            f"± {math.degrees(self.rotation_sigma_rad):.2g}° (1 σ, worst axis)"
            + (f", with caveats: {but}" if but else "")
        )


def parse_accuracy(text: str, *, turns: bool = True) -> _core.AskedAccuracy:
    """``5mm,0.5deg`` (also ``m``, ``rad``; either order) as an AskedAccuracy.

    Of a platform that cannot turn (``turns`` false) the position is enough, and any rotation will
    do then. Raises InputError for anything else.
    """
    scale = {"mm": ("m", 1e-3), "m": ("m", 1.0), "deg": ("rad", math.pi / 180), "rad": ("rad", 1.0)}
    found: dict[str, float] = {}
    for part in text.split(","):
        match = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(mm|m|deg|rad)\s*", part)
        try:
            value = float(match[1]) if match else math.nan
        except ValueError:
            value = math.nan
        if match is None or not 0.0 < value < math.inf or scale[match[2]][0] in found:
            found.clear()
            break
        kind, unit = scale[match[2]]
        found[kind] = value * unit
    if not turns and "m" in found:
        found.setdefault("rad", math.inf)
    if set(found) != {"m", "rad"}:
        wanted = "of position and rotation, for example 5mm,0.5deg"
        raise _core.InputError(
            f"--until: {text!r} is no accuracy; give standard deviations "
            f"{wanted if turns else 'of the position, for example 5mm'}"
        )
    return _core.AskedAccuracy(position_m=found["m"], rotation_rad=found["rad"])


#: Before a run may end early. After fewer, readings and unknowns are so nearly alike in number that
#: load cells with wrong gains do not show as a misfit, and the estimate is off by several σ.
_FEWEST_RESTS = 3
#: Caveats that leave the accuracy to who asked for it.
_ABOUT_ACCURACY = ("imprecise",)
#: What healthy robots that never rest have, too: residuals are held against the scatter at rest.
_ALSO_IN_MOTION = ("misfit",)
#: Between two estimates of a run that does not wait for rests, where an accuracy is asked for; two
#: in a row must have it, since how much neighbouring moments hang together is estimated, too.
_IN_MOTION_EVERY_S = 1.0
#: Before such a run may end early: after less, what load cells are wrong by may not show either.
_LEAST_MOTION_S = 10.0


class Guide:
    """Estimates after every rest; with ``asked``, chooses the stops and ends the run.

    ``diagnoses``: also says what the model lacks, goes to the stops that tell its rivals apart
    (with ``asked``: to those that it chooses), and ends the run when more rests would not change
    the answer (``settled``).

    ``in_motion``: the run does not wait for rest (``StartUpOptions.wait_for_rest``): the estimates
    are those of ``calibrate_in_motion``, at every set-point passed; with ``asked``, every second.

    ``background``: estimate on a thread of its own, so that no control cycle is late; for robots
    whose clock does not wait. ``options``: of the estimate. ``on_way``: called with the pose and
    the tensions [N] that a chosen way begins at, and the way, before it is gone.
    """

    def __init__(
        self,
        robot: _core.Robot,
        plan: _core.Plan,
        startup: StartUp,
        *,
        asked: _core.AskedAccuracy | None = None,
        diagnoses: bool = False,
        quick: bool = False,
        in_motion: bool = False,
        background: bool = False,
        options: _core.CalibrateOptions | None = None,
        progress: Callable[[float], object] | None = None,
        on_way: Callable[[_core.Pose, NDArray[np.float64], _core.StartUpPlan], object]
        | None = None,
    ) -> None:
        self._robot = robot
        self._plan = plan
        self._startup = startup
        self._asked = asked
        self._on_way = on_way
        self._diagnoses = diagnoses
        self.settled = ""  #: why the diagnosis ended the run; empty: it did not
        self._quick = quick
        self._estimated_s = -math.inf
        self._options = options or _core.CalibrateOptions()
        self._online = None if in_motion else _core.OnlineCalibration(robot, self._options)
        self._chooser = (
            _core.NextStopChooser(robot, plan, progress=progress)
            if asked is not None or diagnoses
            else None
        )
        self._pool: Executor | None = ThreadPoolExecutor(1) if background else None
        self._pending: Future[Estimate] | None = None
        self._rows = _Rows(robot.cable_count)
        self._sent = 0  # rows that the estimate has
        self._rests = 0
        self._state = StartUpState.idle
        self._setpoint = -1
        # Which stop of the plan each set-point of the start-up is; None: passed through.
        self._stops: list[int | None] = [None]
        self._stops += [i if stop.measured else None for i, stop in enumerate(plan.poses)]
        self._measured: list[int] = []
        self._chose = False  # a stop that tells rivals apart: the plan's order is left
        self._initial_reading_N = plan.start_tension_N
        self.estimates: list[Estimate] = []

    @property
    def in_motion(self) -> bool:
        """Whether the run does not wait for rest."""
        return self._online is None

    @property
    def visited(self) -> int:
        """Set-points that were measured, or passed in motion; tau_0 is the first."""
        return self._rests

    @property
    def reached(self) -> bool:
        """Whether the accuracy asked for was reached, and nothing speaks against the pose."""
        return bool(self.estimates) and self.estimates[-1].reached

    @property
    def caveats(self) -> tuple[Finding, ...]:
        """What speaks against a pose whose σ is as was asked for; none where it is larger."""
        return self.estimates[-1].caveats if self.estimates else ()

    def step(self, command: StartUpCommand, sample: RobotSample, logged: bool) -> Estimate | None:
        """To be called with every command; an estimate when there is a new one."""
        if logged:
            self._rows.add(sample, command)
        if self.in_motion:
            self._pass(command, sample)
        rests = self._startup.rests
        if len(rests) > self._rests:
            for rest in rests[self._rests :]:
                stop = self._stops[rest.setpoint]
                if stop is not None:
                    self._measured.append(stop)
            self._rests = len(rests)
            self._request()
        self._choose(command, sample)
        return self._collect()

    def _pass(self, command: StartUpCommand, sample: RobotSample) -> None:
        """Takes note of a set-point that is left behind; asks for an estimate now and then."""
        if command.state not in (StartUpState.moving, StartUpState.done) or self.reached:
            return
        passed = command.setpoint + (command.state == StartUpState.done) > self._rests
        if passed:
            stop = self._stops[self._rests]
            if stop is not None:
                self._measured.append(stop)
            self._rests += 1
        # A way that is chosen anew begins at the set-point that was just passed.
        later = sample.time_s - self._estimated_s >= _IN_MOTION_EVERY_S
        if later and (passed or self._asked is not None):
            self._estimated_s = sample.time_s
            self._request()

    def close(self) -> Estimate | None:
        """Waits for the last estimate; one when there is a new one."""
        done = self._collect(wait=True)
        if self._pool is not None:
            self._pool.shutdown()
        return done

    def _request(self) -> None:
        """Starts an estimate, unless one is going on: then what is new waits for the next rest."""
        if self._pending is not None:
            return
        begin, self._sent = self._sent, len(self._rows)
        left = self._left() if self._diagnoses else None
        last = self.estimates[-1] if self.estimates else None
        good = last is not None and last.trusted and _has(self._asked, last.covariance)
        work = _Work(self._robot, self._online, self._asked, left, self._options, self._rows, good)
        if self._pool is None:
            self._pending = Future()
            self._pending.set_result(work(begin, self._sent, self._rests))
        else:
            self._pending = self._pool.submit(work, begin, self._sent, self._rests)

    def _collect(self, *, wait: bool = False) -> Estimate | None:
        if self._pending is None or not (wait or self._pending.done()):
            return None
        estimate = self._pending.result()
        self._pending = None
        self.estimates.append(estimate)
        told = [e.told for e in self.estimates if e.told is not None]
        self.settled = settled(told, "set-points" if self.in_motion else "rests")
        if estimate.reached or self.settled:
            self._startup.finish()
        return estimate

    def _choose(self, command: StartUpCommand, sample: RobotSample) -> None:
        """On setting out for a stop, says where to go from there."""
        before, self._state = (self._state, self._setpoint), command.state
        self._setpoint = command.setpoint
        if self._chooser is None or (command.state, command.setpoint) == before:
            return
        if command.state not in (StartUpState.moving_to_start, StartUpState.moving):
            return
        target = self._stops[command.setpoint]
        if command.state == StartUpState.moving_to_start:
            self._initial_reading_N = sample.tension_N
        elif target is None:
            return  # on the way to a stop that was chosen already
        measured = self._measured + ([] if target is None else [target])
        if self._asked is not None:
            initial = self.estimates[-1].pose if self.estimates else None
            choice = self._chooser.choose(
                measured, initial or self._plan.start_pose, self._initial_reading_N, self._asked
            )
            if choice is None and self.in_motion:  # rests there would do: motion may not
                choice = self._telling(measured, {})
        else:
            told = self.estimates[-1].told if self.estimates else None
            if not self._chose and (told is None or not any(told.worth.values())):
                return  # the plan's own order, until another is better
            choice = self._telling(measured, {} if told is None else told.worth)
            self._chose = True
        way = choice.way if choice is not None else _core.StartUpPlan([])
        if self._on_way is not None:
            at = self._plan.poses[target] if target is not None else None
            self._on_way(
                self._plan.start_pose if at is None else at.pose,
                self._plan.start_tension_N if at is None else at.tension_N,
                way,
            )
        times = [] if self._quick else way.transition_s
        self._startup.go_on_with(_core.StartUpPlan(list(way.setpoint_N), times, way.via, way.pose))
        del self._stops[command.setpoint + 1 :]
        if choice is not None:
            self._stops += [None] * (len(way.via) - 1) + [choice.stop]

    def _left(self, but: Sequence[int] = ()) -> dict[int, _core.PlannedPose]:
        """The stops that were not measured yet, by their place in the plan."""
        done = {*self._measured, *but}
        return {
            i: stop for i, stop in enumerate(self._plan.poses) if stop.measured and i not in done
        }

    def _telling(
        self, measured: Sequence[int], worth: Mapping[int, float]
    ) -> _core.NextStop | None:
        """The stop that tells most between rivals; else the plan's next that can be reached."""
        assert self._chooser is not None
        left = self._left(measured)
        wanted = [{stop: worth.get(stop, 0.0) for stop in left}, *({stop: 1.0} for stop in left)]
        for of in wanted:
            each = [of.get(i, 0.0) for i in range(len(self._plan.poses))]
            choice = self._chooser.choose_by_worth(list(measured), each)
            if choice is not None:
                return choice
        return None


@dataclass(frozen=True)
class _Work:
    """One estimate, on whatever thread."""

    robot: _core.Robot
    online: _core.OnlineCalibration | None  #: None: from the motion, too
    asked: _core.AskedAccuracy | None
    left: dict[int, _core.PlannedPose] | None  #: stops to come, where the log is diagnosed
    options: _core.CalibrateOptions
    rows: _Rows
    good_before: bool  #: whether the last estimate had the accuracy

    def __call__(self, begin: int, end: int, rests: int) -> Estimate:
        caveats: tuple[Finding, ...] = ()
        if self.online is None:
            log = self.rows.log(0, end)
            found = _core.calibrate_in_motion(self.robot, log, self.options).calibration
            result = found.result
        else:
            log = self.rows.log(begin, end)
            result = self.online.add(log)
        lasts_s = float(log.time_s[-1] - log.time_s[0])
        enough = (
            rests >= _FEWEST_RESTS
            if self.online
            else lasts_s >= _LEAST_MOTION_S and self.good_before
        )
        reached = enough and self._is_good(result)
        if reached and self.online:
            # A live estimate does not look for what the model lacks; the whole procedure does.
            found = _core.calibrate(self.robot, self.rows.log(0, end), self.options)
            result = found.result
            reached = self._is_good(result)
        if reached:
            file = LogFile(Path(), "csv", self.rows.log(0, end))
            said = against_pose(caveats_with_log(self.robot, file, found))
            beside = _ABOUT_ACCURACY if self.online else (*_ABOUT_ACCURACY, *_ALSO_IN_MOTION)
            caveats = tuple(caveat for caveat in said if caveat.code not in beside)
            reached = not caveats
        position_m, rotation_rad = worst_sigma(result.covariance) or (math.nan, math.nan)
        return Estimate(
            float(log.time_s[-1]),
            rests,
            result.status.name,
            result.reason,
            position_m,
            rotation_rad,
            result.least_observed,
            result.initial_pose,
            result.covariance,
            reached,
            told_by(self.robot, self.rows.log(0, end), self.left, in_motion=self.online is None)
            if self.left is not None and rests >= _FEWEST_RESTS
            else None,
            self.online is None,
            _is_trusted(result),
            caveats,
        )

    def _is_good(self, result: _core.CalibrationResult) -> bool:
        return _is_trusted(result) and _has(self.asked, result.covariance)


def _is_trusted(result: _core.CalibrationResult) -> bool:
    return result.status == _core.CalibrationStatus.converged and result.covariance_holds


def _has(asked: _core.AskedAccuracy | None, covariance: NDArray[np.float64] | None) -> bool:
    """Whether an estimate has the accuracy asked for."""
    return asked is not None and covariance is not None and asked.reached(covariance)


class _Rows:
    """Logged samples, as they come, in one array that doubles when it is full."""

    def __init__(self, cables: int) -> None:
        self._cables = cables
        widths = {
            "time_s": 1,
            "length_m": cables,
            "swivel_rad": cables,
            "tension_N": cables,
            "roll_pitch_yaw_rad": 3,
            "specific_force_m_s2": 3,
            "angular_velocity_rad_s": 3,
            "tension_setpoint_N": cables,
        }
        ends = np.cumsum(list(widths.values()))
        self._columns = {
            name: slice(int(end) - width, int(end))
            for (name, width), end in zip(widths.items(), ends, strict=True)
        }
        self._data = np.empty((1024, int(ends[-1])))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def add(self, sample: RobotSample, command: StartUpCommand) -> None:
        if self._count == len(self._data):
            self._data = np.concatenate([self._data, np.empty_like(self._data)])
        row = self._data[self._count]
        for name, columns in self._columns.items():
            source = command if name == "tension_setpoint_N" else sample
            values = np.asarray(getattr(source, name), dtype=float).reshape(-1)
            row[columns] = values if values.size == columns.stop - columns.start else np.nan
        self._count += 1

    def log(self, begin: int, end: int) -> _core.Log:
        """Some rows as a log; sensors that never spoke in them are absent."""
        data = self._data[begin:end]
        groups: dict[str, Any] = {
            name: data[:, columns]
            for name, columns in self._columns.items()
            if name != "time_s" and np.isfinite(data[:, columns]).any()
        }
        return _core.Log(time_s=data[:, 0], **groups)
