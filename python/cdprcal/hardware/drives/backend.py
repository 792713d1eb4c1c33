"""A robot with CiA-402 winches on a fieldbus and an AHRS: the protocol of ``hardware.backend``.

The first read arms: it enables the drives at standstill in velocity mode. From then on every cycle
checks all devices; whatever is wrong trips the guard, which stops all winches at once, and tells
the start-up procedure, which ends the log with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal._core import RobotSample, StartUpCommand
from cdprcal.hardware.backend import Attitude, AttitudeSource, BackendError
from cdprcal.hardware.drives import cia402
from cdprcal.hardware.drives.bounds import check_session, stop_of
from cdprcal.hardware.drives.canopen_bus import NoSuchObjectError
from cdprcal.hardware.drives.cia402 import Goal, State
from cdprcal.hardware.drives.fieldbus import Clock, Fieldbus
from cdprcal.hardware.drives.guard import Guard
from cdprcal.hardware.drives.limits import (
    put_back,
    rated_torque_is_wrong,
    set_limits,
    set_position_limits,
)
from cdprcal.hardware.drives.plausibility import Plausibility, efficiency_of
from cdprcal.hardware.drives.process_data import Values, layouts
from cdprcal.hardware.drives.supervision import Phase, Supervisor, name_of
from cdprcal.hardware.drives.wiggle import ENOUGH, REST_S, SPEED_M_S, Responses
from cdprcal.hardware.drives.winch import WinchState
from cdprcal.hardware.session import Session

_ENABLE_TIMEOUT_S = 3.0  # brakes take a while to open
_STOP_TIMEOUT_S = 1.0
_STOP_CYCLES = 3
_ATTITUDE_TIMEOUT_S = 2.0
_MOST_REMEMBERED = 8  # errors of the past that are read from a drive


class FieldbusBackend:
    """The drives and sensors of one session.

    robot: for the number of cables and the Euler convention of the samples. jitter_m: of encoders
    that are simulated, 1 σ; a drive's own count what the drum turns. armed: false is a dry
    run, in which samples are read, and no drive is ever told anything. Raises InputError when
    session and robot do not fit, BackendError when a device does not answer or obey; the bus is
    then closed.
    """

    #: Whether something may really move, so that the operator has to mean it.
    is_real = True

    def __init__(
        self,
        session: Session,
        robot: _core.Robot,
        bus: Fieldbus,
        attitude: AttitudeSource | None,
        clock: Clock,
        *,
        armed: bool,
        jitter_m: float = 0.0,
    ) -> None:
        check_session(session, robot)
        self._session = session
        self._robot = robot
        self._bus = bus
        self._attitude_source = attitude
        self._clock = clock
        self._armed = armed
        self._guard = Guard(bus, session, armed=armed)
        self._winches = [
            WinchState(winch, session) for winch in sorted(session.winches, key=lambda w: w.cable)
        ]
        self._supervisor = Supervisor(session, self._winches, jitter_m)
        self._plausibility: Plausibility | None = Plausibility(robot, self._winches)
        self._told_torque: dict[int, int] = {}
        self._told_m_s: dict[int, float] = {}
        self._identity: list[dict[str, Any]] = []
        self._notes: list[str] = []
        self._effective: list[dict[str, float]] = []  # limits of the drives
        self._own_positions: list[tuple[WinchState, tuple[int, int]]] = []  # to be put back
        self._without_abort: set[int] = set()  # nodes without object 0x6007
        self._disobeyed = 0  # cycles since the guard has tripped in which some drive was not off
        # Drives without brakes may be holding the platform since the last run.
        self._goal = Goal.off if session.safety.brakes else Goal.quick_stop
        self._mode = cia402.CSV
        self._velocity_m_s = [0.0] * len(self._winches)
        self._tension_N = [math.nan] * len(self._winches)
        self._attitude: Attitude | None = None
        self._fresh_s = 0.0  # when all winches were last heard; they were before the first sample
        self._due_s = -math.inf  # when the next cycle begins: the first one at once
        self._began_s = math.nan
        self._stop_asked: Callable[[], bool] = lambda: False
        self._stopped = False
        self._fault: str  # once it is stopped: what had been wrong before
        try:
            self._open()
        except BaseException:
            self.stop()
            raise

    @property
    def settings(self) -> dict[str, Any]:
        return {
            "backend": self._session.bus.type,
            "session": self._session.model_dump(mode="json"),
            "drives": self._identity,
            "ahrs": None if self._attitude_source is None else self._attitude_source.settings,
            "inertial_unit": self._session.ahrs is not None and self._session.ahrs.inertial_unit,
            "limits": self.limits,
            "notes": list(self._notes),
            "armed": self._armed,
        }

    @property
    def limits(self) -> dict[str, Any]:
        """What holds in effect: of the session, and what follows from it."""
        stop = stop_of(self._session)
        return self._session.limits.model_dump() | {
            "stop_time_s": stop.time_s,
            "stop_distance_m": stop.distance_m,
            "drives": self._effective,
        }

    @property
    def winches(self) -> list[WinchState]:
        """What each winch last said, by cable."""
        return self._winches

    @property
    def notes(self) -> list[str]:
        """What was noticed while the devices were set up, a sentence each."""
        return self._notes

    @property
    def tripped(self) -> str:
        """Why the winches were stopped quickly; empty: they were not."""
        return self._fault if self._stopped else self._guard.reason

    def stop_if(self, asked: Callable[[], bool]) -> None:
        """Asked in every cycle of arming, which takes seconds; later on the caller asks itself."""
        self._stop_asked = asked

    # --- start -----------------------------------------------------------------------------------

    def _open(self) -> None:
        for winch in self._winches:
            self._identify(winch)
        if self._armed:
            for winch in self._winches:
                self._prepare(winch)
        self._bus.configure(layouts(self._session), outputs=self._armed)
        self._await_process_data()
        self._await_attitude()

    def _identify(self, winch: WinchState) -> None:
        node, cable = winch.winch.node, winch.winch.cable
        kind = int.from_bytes(self._bus.sdo_read(node, 0x1000, 0), "little")
        if kind & 0xFFFF != 402:
            raise BackendError(
                f"{name_of(winch)}: is no CiA-402 drive (0x1000: {kind}); correct the "
                "winch's node in the session"
            )
        identity = {"cable": cable, "node": node}
        for subindex, name in ((1, "vendor"), (2, "product"), (3, "revision"), (4, "serial")):
            try:
                data = self._bus.sdo_read(node, 0x1018, subindex)
            except NoSuchObjectError:
                continue
            identity[name] = int.from_bytes(data, "little")
        wanted = winch.winch.serial_number
        if wanted is not None and identity.get("serial") != wanted:
            raise BackendError(
                f"{name_of(winch)}: has the serial number {identity.get('serial')}, the "
                f"session says {wanted}; correct the node or the serial number if it is "
                "another cable's drive"
            )
        self._identity.append(identity)
        state = cia402.state_of(self._read_object(winch, cia402.STATUSWORD))
        if self._armed and state is State.enabled:
            raise BackendError(
                f"{name_of(winch)}: is in operation enabled already: somebody else moves it; end "
                "that program first"
            )
        self._recall(winch)

    def _recall(self, winch: WinchState) -> None:
        """Notes the errors that a drive remembers; resetting one leaves no other trace."""
        node = winch.winch.node
        try:
            count = min(self._bus.sdo_read(node, cia402.ERROR_HISTORY, 0)[0], _MOST_REMEMBERED)
            errors = [
                int.from_bytes(self._bus.sdo_read(node, cia402.ERROR_HISTORY, at), "little")
                for at in range(1, count + 1)
            ]
        except NoSuchObjectError:
            return
        if errors:
            codes = ", ".join(f"0x{error & 0xFFFF:04X}" for error in errors)
            self._notes.append(f"{name_of(winch)}: remembers the errors {codes}, newest first")

    def _read_object(self, winch: WinchState, key: tuple[int, int]) -> int:
        return int.from_bytes(self._bus.sdo_read(winch.winch.node, *key), "little")

    def _prepare(self, winch: WinchState) -> None:
        """What a drive must know before it may move: how to stop, and when by itself."""
        session = self._session
        ramp = round(winch.winch.deceleration_scale * session.limits.quick_stop_m_s2)
        stop = cia402.QUICK_STOP_THEN_OFF if session.safety.brakes else cia402.QUICK_STOP_AND_STAY
        self._write(winch, cia402.QUICK_STOP_DECELERATION, ramp, 4)
        self._write(winch, cia402.QUICK_STOP_OPTION, stop, 2)
        missing = self._try_write(
            winch, cia402.ABORT_CONNECTION_OPTION, cia402.ABORT_CONNECTION_QUICK_STOP, 2
        )
        if missing:
            self._without_abort.add(winch.winch.node)
            self._notes.append(
                f"{name_of(winch)}: has no object 0x6007; make sure by its "
                "own set-up that it stops when this computer falls silent"
            )
        if said := rated_torque_is_wrong(self._bus, winch):
            raise BackendError(said)
        effective = set_limits(self._bus, winch, session, self._notes)
        if session.limits.travel_m is not None:
            # The drive's own limit is where this program's is, once it has stopped there.
            beyond_m = session.limits.travel_m + stop_of(session).distance_m
            kept = set_position_limits(self._bus, winch, beyond_m, self._notes)
            if kept is not None:
                effective["travel_m"], own = kept
                self._own_positions.append((winch, own))
        self._effective.append(effective)
        # Interpolation between set-points: the cycle in milliseconds, or tenths of them.
        exponent = -3 if 1e3 % session.rate_Hz == 0.0 else -4
        period = round(10.0**-exponent / session.rate_Hz)
        self._try_write(winch, cia402.INTERPOLATION_PERIOD, period, 1)
        self._try_write(winch, cia402.INTERPOLATION_EXPONENT, exponent & 0xFF, 1)

    def _write(self, winch: WinchState, key: tuple[int, int], value: int, size: int) -> None:
        self._bus.sdo_write(winch.winch.node, *key, value.to_bytes(size, "little"))

    def _try_write(self, winch: WinchState, key: tuple[int, int], value: int, size: int) -> bool:
        """True: the drive has no such object."""
        try:
            self._write(winch, key, value, size)
        except NoSuchObjectError:
            return True
        return False

    def _await_attitude(self) -> None:
        if self._attitude_source is None:
            return
        until_s = self._clock.now_s() + _ATTITUDE_TIMEOUT_S
        while self._attitude is None:
            if self._clock.now_s() > until_s:
                raise BackendError(
                    "the AHRS sends no attitude; check ahrs.port and its output settings"
                )
            self._cycle({})

    def _arm(self) -> None:
        """Enables the drives at standstill. From its first cycle on they watch this computer.

        No drive is told to enable operation before all of them say that they are in cyclic
        synchronous velocity: in another mode a drive may go wherever its objects say. Raises
        BackendError; the drives have been told to stop then.
        """
        self._goal = Goal.switched_on
        self._supervisor.enter(Phase.preparing)
        try:
            self._cycle(self._outputs())  # with what has been waiting on the bus since
            self._notes += [f"said before arming: {fault}" for fault in self._bus.faults()]
            self._be_watched()
            self._reset_faults()
            self._reach(Goal.switched_on, State.switched_on)
            self._supervisor.enter(Phase.enabling)
            self._reach(Goal.enabled, State.enabled)
            self._supervisor.enter(Phase.running)
            self._wiggle()
        except BackendError as error:
            self._guard.trip(str(error))
            raise

    def _wiggle(self) -> None:
        """Pays out each cable a little and reels it in. Raises BackendError with what is wrong."""
        most = math.floor(self._session.safety.wiggle_m / (SPEED_M_S * self._session.period_s))
        if most < 1:
            return
        responses = Responses([efficiency_of(winch) for winch in self._winches])
        for at in range(len(self._winches)):
            before_N = self._rest_N()
            enough_N = ENOUGH * before_N.std(axis=0)
            cycles = 0
            while cycles < most:
                self._creep(at, SPEED_M_S)
                cycles += 1
                now_N = [winch.tension_N for winch in self._winches]
                if np.any(np.abs(now_N - before_N.mean(axis=0)) > enough_N):
                    break
            after_N = self._rest_N()
            # As it was told: that its encoder shows as much is seen in every cycle.
            responses.add(at, cycles * SPEED_M_S * self._session.period_s, before_N, after_N)
            for _ in range(cycles):
                self._creep(at, -SPEED_M_S)
        self._rest_N()
        if wrong := responses.wrong():
            at, what = wrong
            raise BackendError(
                f"before anything moved: {name_of(self._winches[at])}: {what}; correct the session"
            )

    def _creep(self, at: int, velocity_m_s: float) -> None:
        """A cycle in which one cable moves; the others rest."""
        self._velocity_m_s[at] = velocity_m_s
        self._supervise(self._outputs())

    def _rest_N(self) -> np.ndarray:
        """Tensions [cycles, n] while all cables stand, once the last motion has faded a little."""
        rows = []
        self._velocity_m_s = [0.0] * len(self._winches)
        cycles = round(REST_S * self._session.rate_Hz)
        for cycle in range(2 * cycles):
            self._supervise(self._outputs())
            row = [winch.tension_N for winch in self._winches]
            if cycle >= cycles and all(map(math.isfinite, row)):  # a cycle may be missed
                rows.append(row)
        return np.array(rows)

    def _be_watched(self) -> None:
        """Has the drives watch this computer. Raises BackendError for one that would run on."""
        alone = set(self._bus.watch_us(on=True))
        for winch in self._winches:
            if winch.winch.node not in alone:
                continue
            what = f"{name_of(winch)}: has no event timer for its commands (0x1400:05)"
            # What does not obey is seen by its motion, and motion is compared in mode velocity.
            if winch.winch.node in self._without_abort or self._session.mode == "torque":
                raise BackendError(
                    f"{what}, so it would go on with its last command if that were all that gets "
                    "lost; give it firmware that has one, or use it in mode velocity with 0x6007"
                )
            self._notes.append(
                f"{what}; when only they get lost it is stopped by its heartbeat consumer, once "
                "this computer sees that it does not obey"
            )

    def _reset_faults(self) -> None:
        faults = [winch for winch in self._winches if winch.state is State.fault]
        if not faults:
            return
        self._notes += [
            f"{name_of(winch)}: fault 0x{winch.error_code:04X} was reset" for winch in faults
        ]
        reset = self._outputs()
        for winch in faults:
            reset[winch.winch.node][cia402.CONTROLWORD] = cia402.FAULT_RESET
        self._supervise(reset)

    def _reach(self, goal: Goal, state: State) -> None:
        """Cycles until all drives are in a state and in cyclic synchronous velocity."""
        self._goal = goal
        until_s = self._clock.now_s() + _ENABLE_TIMEOUT_S
        reached = {state}
        if goal is Goal.switched_on and not self._session.safety.brakes:
            reached.add(State.quick_stop)  # holds the platform until it is enabled
        while True:
            self._supervise(self._outputs())
            late = [w for w in self._winches if w.state not in reached or w.mode != cia402.CSV]
            if not late:
                return
            if self._clock.now_s() <= until_s:
                continue
            winch = late[0]
            if winch.state in reached:
                what = (
                    f"stays in mode of operation {winch.mode}, not cyclic synchronous velocity "
                    f"({cia402.CSV})"
                )
            else:
                what = (
                    f"does not become {state.value}; it says: {winch.state.value}, error "
                    f"0x{winch.error_code:04X}"
                )
            raise BackendError(f"{name_of(winch)}: {what}; look it up in its manual")

    def _supervise(self, outputs: dict[int, Values]) -> None:
        """One cycle of arming, judged. Raises BackendError with what is wrong, or as the operator
        wants to stop."""
        if self._stop_asked():
            raise BackendError(
                "stopped by the operator while the drives were armed; start again when the robot "
                "may move"
            )
        late_s = self._clock.now_s() - self._due_s
        self._cycle(outputs)
        wrong = self._wrong()
        if self._supervisor.phase is Phase.running and late_s > self._session.late_s:
            wrong = wrong or f"the control cycle began {1e3 * late_s:.0f} ms late"
        if wrong:
            raise BackendError(f"while the drives were armed: {wrong}; see what it says, then "
                               "acquire again")  # fmt: skip

    def _await_process_data(self) -> None:
        until_s = self._clock.now_s() + _ENABLE_TIMEOUT_S
        while True:
            self._cycle(self._outputs())
            silent = [winch for winch in self._winches if winch.missed]
            if not silent:
                return
            if faults := self._bus.faults():
                raise BackendError("; ".join(faults))
            if self._clock.now_s() > until_s:
                raise BackendError(
                    f"{name_of(silent[0])}: does not send its process data; check its PDO mapping "
                    "in its manual"
                )

    def _cycle(self, outputs: dict[int, Values]) -> None:
        """One cycle on time, nothing judged."""
        self._due_s = max(self._due_s, self._clock.now_s())
        self._clock.sleep_until(self._due_s)
        self._take(outputs)
        self._due_s += self._session.period_s

    # --- cycle -----------------------------------------------------------------------------------

    def read(self) -> RobotSample:
        if self._stopped:
            raise BackendError(self._fault or "the robot is stopped")
        first = math.isnan(self._began_s)
        if first and self._guard.reason:
            raise BackendError(self._guard.reason)  # arming failed
        if first:
            # Not before: until now nobody kept the cycle, and the drives would have stopped again.
            if self._armed:
                self._arm()
            self._due_s = max(self._due_s, self._clock.now_s())
        self._clock.sleep_until(self._due_s)
        late_s = self._clock.now_s() - self._due_s
        if first:
            self._began_s = self._due_s
        elif late_s > self._session.late_s:
            self._guard.trip(f"the control cycle began {1e3 * late_s:.0f} ms late")
            self._due_s = self._clock.now_s()
        # To the nanosecond: what sums of cycles leave beyond is no time.
        time_s = round(self._clock.now_s() - self._began_s, 9)
        try:
            # The latest command once more: drives miss it when it stays away for two cycles, and a
            # slow answer to the last sample must not look like that.
            self._take(self._outputs())
        except BackendError as error:
            self._guard.trip(str(error))
        self._due_s += self._session.period_s
        if wrong := self._wrong():
            self._guard.trip(wrong)
        if self._plausibility is not None:
            self._plausibility.collect()
        return self._sample(time_s)

    def _take(self, outputs: dict[int, Values]) -> None:
        self._told_m_s = self._guard.told_m_s()
        self._told_torque = self._guard.told_torque()
        image = self._guard.exchange(outputs)
        for winch in self._winches:
            winch.take(image)
        self._guard.measured({winch.winch.node: winch.tension_N for winch in self._winches})
        if self._attitude_source is not None:
            self._attitude = self._attitude_source.poll(self._clock.now_s()) or self._attitude
        if self._armed and self._guard.reason:
            self._see_to_it()

    def _see_to_it(self) -> None:
        """Who does not stop when it is told to must do so because nobody tells it anything."""
        if any(winch.missed or winch.state is State.enabled for winch in self._winches):
            self._disobeyed += 1
            if self._disobeyed >= _STOP_CYCLES:
                self._bus.abandon()

    def _wrong(self) -> str:
        """Why the winches must stop; empty: they need not."""
        if faults := self._bus.faults():
            return "; ".join(faults[:3])
        if wrong := self._supervisor.look(self._told_m_s, self._told_torque):
            return wrong
        if self._attitude is not None:
            silent_s = self._clock.now_s() - self._attitude.time_s
            if silent_s > self._session.ahrs_stale_s:
                return f"the AHRS has been silent for {1e3 * silent_s:.0f} ms"
        return ""

    def _sample(self, time_s: float) -> RobotSample:
        sample = RobotSample(time_s=time_s)
        sample.length_m = np.array([winch.length_m for winch in self._winches])
        sample.tension_N = np.array([winch.tension_N for winch in self._winches])
        if self._session.winches[0].swivel is not None:
            sample.swivel_rad = np.array([winch.swivel_rad for winch in self._winches])
        if not any(winch.missed for winch in self._winches):
            self._fresh_s = time_s
        sample.drives_time_s = self._fresh_s
        if self._attitude is not None:
            convention = self._robot.euler_convention
            sample.roll_pitch_yaw_rad = _core.euler_from_rotation(
                self._attitude.R_world_platform, convention
            )
            if self._attitude.specific_force_m_s2 is not None:
                sample.specific_force_m_s2 = self._attitude.specific_force_m_s2
            if self._attitude.angular_velocity_rad_s is not None:
                sample.angular_velocity_rad_s = self._attitude.angular_velocity_rad_s
            taken_s = round(self._attitude.time_s - self._began_s, 9)
            sample.attitude_time_s = min(time_s, taken_s)
        if self._guard.reason:
            sample.drive_error = f"quick stop: {self._guard.reason}"
        return sample

    def command(self, command: StartUpCommand) -> None:
        if not self._armed or self._stopped:
            return
        if self._plausibility is not None and not command.locked:
            # The last moment before anything moves.
            if wrong := self._plausibility.wrong():
                self._guard.trip(f"before anything moved: {wrong}")
            self._plausibility = None
        led = self._session.mode == "torque" and all(command.by_tension)
        torque = led and not command.locked
        self._mode = cia402.CST if torque else cia402.CSV
        self._supervisor.want_mode(self._mode)
        velocity = command.velocity_m_s.tolist()
        self._velocity_m_s = [0.0] * len(velocity) if command.locked else velocity
        self._tension_N = command.tension_setpoint_N.tolist()
        try:
            self._guard.send(self._outputs())
        except BackendError as error:
            self._guard.trip(str(error))

    def _outputs(self) -> dict[int, Values]:
        if not self._armed:
            return {}
        return {
            winch.winch.node: winch.output(self._goal, self._mode, velocity_m_s, tension_N)
            for winch, velocity_m_s, tension_N in zip(
                self._winches, self._velocity_m_s, self._tension_N, strict=True
            )
        }

    def stop(self) -> None:
        if self._stopped:
            return
        self._fault = self._guard.reason
        self._stopped = True
        # Drives without brakes hold the platform, and go on doing so after this program.
        leave = not self._session.safety.brakes
        try:
            self._guard.trip("stopped")
            until_s = self._clock.now_s() + _STOP_TIMEOUT_S
            cycles = 0
            # Said more than once: nodes that are not heard may still hear.
            while self._armed and self._clock.now_s() < until_s:
                self._cycle(self._outputs())
                cycles += 1
                if cycles >= _STOP_CYCLES and self._standing():
                    for winch, own in self._own_positions:
                        put_back(self._bus, winch, own)
                    break
        except Exception:
            # A bus that is gone: the drives miss the heartbeat and stop by themselves.
            leave = False
        finally:
            if self._attitude_source is not None:
                self._attitude_source.close()
            self._bus.close(stop=not leave)

    def _standing(self) -> bool:
        wanted = (
            (State.switch_on_disabled, State.ready, State.not_ready, State.fault)
            if self._session.safety.brakes
            else (State.quick_stop, State.switch_on_disabled, State.fault)
        )
        return all(winch.state in wanted or winch.missed for winch in self._winches)


__all__ = ["FieldbusBackend"]
