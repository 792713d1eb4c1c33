"""The control loop before everything else on this computer."""

from __future__ import annotations

import contextlib
import os

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
