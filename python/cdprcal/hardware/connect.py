"""From a session to a backend: opens the bus and the AHRS; the loop before all else here."""

from __future__ import annotations

import contextlib
import os
from typing import Self

from cdprcal import _core
from cdprcal.hardware.drives.backend import FieldbusBackend
from cdprcal.hardware.drives.bounds import check_session
from cdprcal.hardware.drives.canopen_bus import CanopenFieldbus
from cdprcal.hardware.drives.fieldbus import Fieldbus, RealClock
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


_PRIORITY = 50  # above all ordinary programs, below the kernel's own threads


def take_priority() -> str:
    """Gives this thread, and none that it starts, real-time priority; or says why it has not.

    Linux only; as root, with CAP_SYS_NICE or a limit of rtprio in /etc/security/limits.conf.
    """
    if not hasattr(os, "sched_setscheduler"):
        return "this system has no real-time priority to give: cycles may begin late"
    policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
    try:
        os.sched_setscheduler(0, policy, os.sched_param(_PRIORITY))
    except OSError as error:
        return (
            f"runs without real-time priority ({(error.strerror or 'refused').lower()}): cycles "
            "may begin late; give rtprio in /etc/security/limits.conf"
        )
    return ""


def leave_priority() -> None:
    """Back to what every program has. Never raises."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
