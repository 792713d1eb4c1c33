"""How the samples of each channel come: rounded, held, filtered."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.check.subject import Subject
from cdprcal.sensors import CHANNELS


@dataclass(frozen=True)
class SignalReport:
    """What the samples of one channel are like, and how much its rests are worth."""

    channel: _core.ChannelRow
    signal: _core.Signal
    samples_effective: float  #: independent readings in all rests of the run together

    def as_dict(self) -> dict[str, Any]:
        """One entry of ``signals`` of ``check --json``."""
        return {
            "channel": self.channel.name,
            "resolution": self.signal.resolution or None,
            "hold_rows": self.signal.hold_rows,
            "correlation_s": self.signal.correlation_s,
            "samples_effective": self.samples_effective,
        }


def describe_signals(
    subject: Subject, equilibria: list[_core.Equilibrium]
) -> tuple[SignalReport, ...]:
    """The signals of the channels that were read, in the order of the table."""
    run = _core.SampleRange(subject.run.start, subject.run.stop)
    signals = _core.signals(subject.log, run, equilibria, subject.robot.sigma)
    rests = [len(rest.samples) for rest in equilibria]
    return tuple(
        SignalReport(channel, signals[name], sum(signals[name].effective(n) for n in rests))
        for name, channel in CHANNELS.items()
        if _is_read(subject, channel)
    )


def _is_read(subject: Subject, channel: _core.ChannelRow) -> bool:
    matrix = getattr(subject.log, channel.sensor.field)[subject.run]
    return bool(np.isfinite(matrix[:, channel.first : channel.first + channel.count]).any())
