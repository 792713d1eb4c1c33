"""From a session with simulated drives to a backend: in this process, or in another one."""

from __future__ import annotations

import time
from typing import Self

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.hardware.backend import Attitude, AttitudeSource
from cdprcal.hardware.drives.backend import FieldbusBackend
from cdprcal.hardware.drives.bounds import check_session
from cdprcal.hardware.drives.canopen_bus import CanopenFieldbus, open_can_bus
from cdprcal.hardware.drives.fieldbus import SimulatedClock
from cdprcal.hardware.session import CanopenBus, Session
from cdprcal.hardware.simulated import start_of
from cdprcal.hardware.xsens.device import XsensMti, open_port
from cdprcal.testing.simulated_devices.faults import Can, Fault, FaultyCan, FaultyPort
from cdprcal.testing.simulated_devices.robot import SimulatedRobotOnCan

#: How long simulated drives in another process may take to answer.
_PATIENCE_S = 2.0


class SimulatedSession(FieldbusBackend):
    """A simulated robot by its session file: the real drivers, on simulated time.

    ``simulated``: the robot itself, if it is in this process.
    """

    is_real = False
    simulated: SimulatedRobotOnCan | None = None

    @classmethod
    def connect(
        cls,
        session: Session,
        robot: _core.Robot,
        plan: _core.Plan,
        options: _core.SimulatorOptions | None = None,
        *,
        armed: bool,
        fault: Fault | None = None,
        wired: Session | None = None,
    ) -> Self:
        """Opens all devices.

        plan, options: of simulated drives in this process, which hang somewhere in the box that the
        plan spans. fault: what goes wrong with them. wired: what they really are, when the session
        is wrong about it; on the same bus. Raises InputError when session and robot do
        not fit, BackendError when a device does not answer or obey.
        """
        check_session(session, robot)
        assert session.simulated is not None
        here = session.bus.interface == "virtual"
        clock = SimulatedClock(
            patience_s=0.0 if here else _PATIENCE_S, speed=session.simulated.speed
        )
        simulated, port = None, None
        if here:
            port = FaultyPort(session.ahrs) if session.ahrs is not None else None
            simulated = _simulated(wired or session, robot, plan, options, clock, port, fault)
        bus: CanopenFieldbus | None = None
        attitude: AttitudeSource | None = None
        try:
            bus = CanopenFieldbus(session, clock)
            if session.ahrs is not None:
                own = port if session.ahrs.port == "simulated" else None
                attitude = XsensMti(own or open_port(session.ahrs), session.ahrs)
                if own is None:
                    period_s = max(session.period_s, 1.0 / session.ahrs.rate_Hz)
                    attitude = LockstepAttitude(attitude, period_s, _PATIENCE_S)
            sensors = (options or _core.SimulatorOptions()).sensors
            jitter_m = sensors.length_m.noise
            backend = cls(session, robot, bus, attitude, clock, armed=armed, jitter_m=jitter_m)
        except BaseException:
            if bus is not None:
                bus.close()
            if simulated is not None:
                simulated.close()
            raise
        backend.simulated = simulated
        return backend

    def truth(self) -> _core.PlantTruth:
        """What the sensors do not say, at the time of the latest sample."""
        if self.simulated is None:
            raise InputError("only simulated drives in this process know the truth; leave it out")
        return self.simulated.truth()

    def stop(self) -> None:
        super().stop()
        if self.simulated is not None:
            self.simulated.close()


def _simulated(
    session: Session,
    robot: _core.Robot,
    plan: _core.Plan,
    options: _core.SimulatorOptions | None,
    clock: SimulatedClock,
    port: FaultyPort | None,
    fault: Fault | None,
) -> SimulatedRobotOnCan:
    assert isinstance(session.bus, CanopenBus)  # no other has simulated drives
    options = options or _core.SimulatorOptions()
    bus: Can = open_can_bus(session.bus)
    if fault is not None:
        bus = FaultyCan(bus, fault, clock.now_s)
        if port is not None:
            port.fault, port.now_s = fault, clock.now_s
    simulated = SimulatedRobotOnCan(
        session,
        robot,
        start_of(robot, plan, options.seed),
        options,
        bus,
        None if port is None else port.device,
        fault,
    )
    clock.idle.append(simulated.process)
    clock.advance.append(simulated.advance)
    return simulated


_POLL_S = 1e-4


class LockstepAttitude:
    """Waits, in real time, for a reading that is due in simulated time.

    Between processes a serial line takes a millisecond or more, in which simulated time may run on
    by many. patience_s: what has not come by then never does.
    """

    def __init__(self, source: AttitudeSource, period_s: float, patience_s: float) -> None:
        self._source = source
        self._period_s = period_s
        self._patience_s = patience_s

    @property
    def settings(self) -> dict[str, object]:
        return self._source.settings

    def poll(self, now_s: float) -> Attitude | None:
        until_s = time.monotonic() + self._patience_s
        while True:
            latest = self._source.poll(now_s)
            due = latest is None or now_s - latest.time_s > 0.9 * self._period_s
            if not due or time.monotonic() > until_s:
                return latest
            time.sleep(_POLL_S)

    def close(self) -> None:
        self._source.close()
