"""From a session to a backend: opens the bus and the AHRS."""

from __future__ import annotations

from typing import Self

from cdprcal import _core
from cdprcal.hardware.drives.backend import FieldbusBackend
from cdprcal.hardware.drives.bounds import check_session
from cdprcal.hardware.drives.canopen_bus import CanopenFieldbus
from cdprcal.hardware.drives.fieldbus import Fieldbus, RealClock
from cdprcal.hardware.real_time import leave_priority, take_priority
from cdprcal.hardware.session import CanopenBus, Session
from cdprcal.hardware.xsens.device import XsensMti, open_port


class SessionBackend(FieldbusBackend):
    """A real robot by its session file."""

    @classmethod
    def connect(cls, session: Session, robot: _core.Robot, *, armed: bool) -> Self:
        """Opens all devices.

        Raises InputError when session and robot do not fit or the bus needs an extra that is not
        installed, BackendError when a device does not answer or obey.
        """
        check_session(session, robot)
        clock = RealClock()
        bus: Fieldbus
        if isinstance(session.bus, CanopenBus):
            bus = CanopenFieldbus(session, clock)
        else:
            from cdprcal.hardware.drives.ethercat_bus import EthercatFieldbus

            bus = EthercatFieldbus(session)
        try:
            ahrs = session.ahrs
            attitude = None if ahrs is None else XsensMti(open_port(ahrs), ahrs)
            backend = cls(session, robot, bus, attitude, clock, armed=armed)
        except BaseException:
            bus.close()
            raise
        if armed and (note := take_priority()):
            backend.notes.append(note)
        return backend

    def stop(self) -> None:
        super().stop()
        leave_priority()
