"""What an AHRS must give to a backend."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray


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
