"""An AHRS of another process that keeps step with simulated time."""

from __future__ import annotations

import time

from cdprcal.hardware.attitude import Attitude, AttitudeSource

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
