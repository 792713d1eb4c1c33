"""What a log is checked against, and the channels it is checked by."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core
from cdprcal.findings import Finding, Severity
from cdprcal.io import LogFile
from cdprcal.sensors import SENSORS

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Channel:
    """One reading over the run: its canonical column name, values [N] and sigma."""

    group: str
    name: str
    values: Floats
    sigma: float
    fresh: NDArray[np.int64]  #: samples of the run in which the sensor read anew
    of_list: bool = False  #: of rests: no two readings are of one place

    @cached_property
    def noise(self) -> float:
        """Noise of one fresh reading, from the data itself; of a list of rests sigma."""
        if self.of_list:
            return self.sigma
        return float(_core.channel_noise(self.values[self.fresh], self.is_angle))

    @cached_property
    def unwrapped(self) -> Floats:
        """The values, without the jumps of 2π of an angle that wraps."""
        out = self.values.copy()
        finite = np.isfinite(out)
        out[finite] = np.unwrap(out[finite]) if self.is_angle else out[finite]
        return out

    @property
    def is_angle(self) -> bool:
        return self.name.endswith("_rad")


@dataclass
class Subject:
    """One run of a log, the robot it belongs to, and what has been found so far."""

    robot: _core.Robot
    file: LogFile
    run: slice
    findings: list[Finding] = field(default_factory=list)

    @property
    def log(self) -> _core.Log:
        return self.file.log

    @cached_property
    def time_s(self) -> Floats:
        """Times of the run [N]."""
        return self.log.time_s[self.run]

    @cached_property
    def channels(self) -> list[Channel]:
        """Every channel that the log has columns for, in the run."""
        return list(self._channels())

    @cached_property
    def is_list(self) -> bool:
        """Whether each row is a rest."""
        return _core.is_rest_list(self.log)

    @cached_property
    def period_s(self) -> float:
        """The usual time between samples; NaN for fewer than two."""
        return float(np.median(np.diff(self.time_s))) if self.time_s.size > 1 else float("nan")

    def _channels(self) -> Iterator[Channel]:
        for group, sensor in SENSORS.items():
            matrix: Floats = getattr(self.log, group)
            sigma = float(getattr(self.robot.sigma, sensor.sigma_field or ""))
            fresh = np.array(
                _core.fresh_rows(matrix, self.run.start, self.run.stop), dtype=np.int64
            )
            fresh -= self.run.start
            for i in range(matrix.shape[1]):
                yield Channel(
                    group, sensor.column(i), matrix[self.run, i], sigma, fresh, self.is_list
                )

    def add(
        self,
        severity: Severity,
        code: str,
        message: str,
        remedy: str,
        *,
        at: int | tuple[int, int] | None = None,
        whole: bool = False,
        channel: str | None = None,
    ) -> None:
        """Notes a finding; at: a sample of the run, or from one to before another; whole: all."""
        begin, end = at if isinstance(at, tuple) else (at, None)
        if whole:
            begin, end = 0, self.time_s.size
        where = None if begin is None else self.run.start + begin
        last = None if end is None else self.run.start + end - 1
        self.findings.append(
            Finding(
                severity=severity,
                code=code,
                message=message,
                remedy=remedy,
                line=None if where is None else self.file.line_of(where),
                time_s=None if where is None else float(self.log.time_s[where]),
                end_s=None if last is None else float(self.log.time_s[last]),
                channel=channel,
            )
        )


def longest_of(ranges: list[tuple[int, int]]) -> tuple[int, int]:
    """Of some half-open ranges of samples, at least one, the longest."""
    return max(ranges, key=lambda r: r[1] - r[0])


def stretches(flags: Flags, at_least: int = 1) -> list[tuple[int, int]]:
    """Half-open ranges in which every flag is set, of at least that many samples."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return [(int(b), int(e)) for b, e in zip(begins, ends, strict=True) if e - b >= at_least]


def duration_s(subject: Subject, ranges: list[tuple[int, int]]) -> float:
    """How long the ranges last together, each sample counting until the next."""
    period = subject.period_s if np.isfinite(subject.period_s) else 0.0
    time = subject.time_s
    return float(sum(time[e - 1] - time[b] + period for b, e in ranges))
