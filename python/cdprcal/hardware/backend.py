"""What a robot must be able to do to be started up: give a sample, obey a command, stop.

The procedure itself is ``cdprcal.StartUp``, the same for every robot; backends know nothing of it::

    backend = SimulatedBackend(robot, ...)
    try:
        while not startup.finished:
            backend.command(startup.step(backend.read()))
    finally:
        backend.stop()
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from cdprcal._core import RobotSample, StartUpCommand


class BackendError(Exception):
    """A device that does not answer or obey. The message names it and says what happened."""


class Backend(Protocol):
    """The drives and sensors of one robot.

    A backend keeps the control clock: 50 Hz or more, at the rate of its devices. What arrives late
    or not at all is no exception but a sample that says so (NaN, old ``drives_time_s`` or
    ``attitude_time_s``, ``drive_error``): the procedure judges it.
    """

    @property
    def settings(self) -> dict[str, Any]:
        """What this robot was set up with (devices, rates, seed …), as plain data for the log."""

    def read(self) -> RobotSample:
        """Waits for the next tick of the control clock and gives the latest readings.

        ``time_s`` is the backend's clock and never runs backwards. Raises BackendError when the
        connection itself is lost.
        """

    def command(self, command: StartUpCommand) -> None:
        """Takes over what to do until the next command; returns at once.

        ``locked``: the winches stand still, brakes may be set. Otherwise drives in velocity mode
        follow ``velocity_m_s``, drives with a tension loop of their own ``tension_setpoint_N``
        where ``by_tension`` says so of their cable, and else the velocity, too. While ``state`` is
        holding or done that is the smooth stop. A backend that gets no further command in time
        locks the winches by itself. Raises BackendError.
        """

    def stop(self) -> None:
        """Stops and locks the winches now, whatever was before. May be repeated; never raises."""


@runtime_checkable
class SlowToArm(Protocol):
    """A backend whose first ``read`` takes seconds, for it moves the winches: others need none."""

    def stop_if(self, asked: Callable[[], bool]) -> None:
        """To be called before the first ``read``, which then asks in every cycle whether the
        operator wants to stop: it stops the winches and raises BackendError if so."""


class Attitude(NamedTuple):
    """One reading. R_world_platform [3, 3]: world with z up, its yaw unknown but constant.

    Of the inertial unit inside, [3] in platform axes; None: not asked for.
    """

    R_world_platform: NDArray[np.float64]
    time_s: float
    specific_force_m_s2: NDArray[np.float64] | None = None
    angular_velocity_rad_s: NDArray[np.float64] | None = None


class AttitudeSource(Protocol):
    """An AHRS."""

    @property
    def settings(self) -> dict[str, object]:
        """What it was found to be and how it was set up, for the log."""

    def poll(self, now_s: float) -> Attitude | None:
        """What has arrived by now; the latest reading, or None before the first. At once.

        now_s: the backend's clock, which stamps a reading that is new. Raises BackendError when
        the connection is lost.
        """

    def close(self) -> None:
        """May be repeated; never raises."""
