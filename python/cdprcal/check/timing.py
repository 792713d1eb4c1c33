"""Time: segments, missing samples, a run too short to say anything."""

from __future__ import annotations

import numpy as np

from cdprcal import _core
from cdprcal.check.subject import Subject
from cdprcal.terminal import counted

#: Samples further apart than this many usual periods have something missing between them.
_MISSING_PERIODS = 2.5


def check_segments(subject: Subject, segments: list[_core.SampleRange], chosen: int) -> None:
    """A gap starts a new segment; only one of them is the run."""
    time = subject.log.time_s
    if len(segments) > 1 and len(segments) > time.size / 2:
        usual_s = float(np.median(np.diff(time)))
        subject.add(
            "error",
            "impossible_value",
            f"time_s advances by {usual_s:g} s from one sample to the next: a gap that long ends a "
            "segment, so that nearly every sample is a segment of its own",
            "is it in milliseconds or nanoseconds? the canonical log has seconds (time_s); else "
            "log at 10 Hz or more",
            at=segments[1].begin - subject.run.start,
            channel="time_s",
        )
        return
    for number, segment in enumerate(segments[1:], start=1):
        before = float(time[segment.begin - 1])
        after = float(time[segment.begin])
        subject.add(
            "warning",
            "gap",
            f"no samples for {after - before:.4g} s from {before:g} s: segment {number} begins "
            f"at {after:g} s",
            f"segment {chosen} is taken as the run; choose another with --segment",
            at=segment.begin - subject.run.start,
        )
    longest = int(np.argmax([len(segment) for segment in segments]))
    if len(segments[longest]) > len(segments[chosen]):
        subject.add(
            "warning",
            "short_run",
            f"the run (segment {chosen}) has {len(segments[chosen])} samples, segment {longest} "
            f"has {len(segments[longest])}",
            f"if segment {longest} is the run, choose it with --segment {longest}",
        )


def check_sampling(subject: Subject) -> None:
    """Too few samples, and samples missing within the run."""
    time = subject.time_s
    window_s = _core.DetectionOptions().window_s
    length_s = float(time[-1] - time[0])
    if time.size < 3 or length_s < window_s:
        subject.add(
            "error",
            "too_few_samples",
            f"the run has {counted(time.size, 'sample')} in {length_s:.3g} s",
            f"log for longer than the {window_s:g} s that a rest must last to be seen",
            at=0,
        )
        return
    steps = np.diff(time)
    missing = np.flatnonzero(steps > _MISSING_PERIODS * subject.period_s)
    if missing.size:
        worst = int(missing[np.argmax(steps[missing])])
        subject.add(
            "warning",
            "missing_samples",
            f"samples are missing at {counted(missing.size, 'place')} of the run, the longest for "
            f"{steps[worst]:.3g} s after {time[worst]:g} s (usual period {subject.period_s:.3g} s)",
            "harmless while the platform rests; else look for a busy logger",
            at=worst,
        )
