"""Logs that are written while the robot moves, so that a crash costs a second of it and no more.

Every row reaches the operating system as soon as it is there (CSV) or within half a second (MCAP,
in chunks as small as that), and the disk itself twice per second. When a write fails the file is
cut back to the last whole row or chunk and stays readable.
"""

from __future__ import annotations

import json
import math
import os
import threading
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from cdprcal._core import InputError, RobotSample
from cdprcal.io.acquisition_inputs import AcquisitionInputs, as_comments, attach
from cdprcal.io.events import Event, as_comment, event_channel
from cdprcal.io.files import reason
from cdprcal.io.log_file import is_mcap_name
from cdprcal.io.mcap_records import json_channel
from cdprcal.sensors import LOG_GROUPS, columns_of

_SYNC_S = 0.5
_CHUNK_S = 0.5
_BYTES_A_NUMBER = 30


class LiveLog(Protocol):
    """A log that grows. Each method raises OSError when it cannot be written."""

    def sample(self, sample: RobotSample, setpoint_N: Any) -> None:
        """One row: readings, and the tensions [n] that were wanted."""

    def event(self, event: Event) -> None:
        """A change of state: time_s, state, setpoint, reason."""

    def close(self) -> None:
        """Ends the log; nothing can be written afterwards."""


def open_live_log(
    path: str | Path,
    cable_count: int,
    inputs: AcquisitionInputs,
    rate_Hz: float,
    *,
    inertial_unit: bool = False,
) -> LiveLog:
    """Starts a log: MCAP when the name ends in .mcap, canonical CSV for .csv.

    ``inertial_unit``: whether there are columns for what one reads.

    Raises InputError when the file exists already (what a robot logged is never overwritten) or
    cannot be made.
    """
    path = Path(path)
    groups = SAMPLED + (INERTIAL if inertial_unit else ())
    mcap = is_mcap_name(path)
    try:
        file = _SafeFile(path)
    except FileExistsError:
        raise InputError(
            f"{path}: exists already, and a log is never overwritten; give another name"
        ) from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {reason(error)}") from None
    try:
        if mcap:
            return _McapLog(file, cable_count, inputs, rate_Hz, groups)
        return _CsvLog(file, cable_count, inputs, groups)
    except OSError as error:
        file.close()
        raise InputError(f"{path}: cannot be written: {reason(error)}") from None


#: What a live log holds of each sample, in the order of its columns.
SAMPLED = ("length_m", "swivel_rad", "tension_N", "tension_setpoint_N", "roll_pitch_yaw_rad")
#: And of a robot with an inertial unit.
INERTIAL = ("specific_force_m_s2", "angular_velocity_rad_s")


def canonical_columns(cable_count: int, groups: tuple[str, ...] = SAMPLED) -> list[str]:
    """Names of the columns after time_s, in the order of ``_numbers``."""
    return [name for group in groups for name in columns_of(LOG_GROUPS[group], cable_count)]


def _numbers(
    sample: RobotSample, setpoint_N: Any, cable_count: int, groups: tuple[str, ...]
) -> list[float]:
    """All readings in the order of ``canonical_columns``; NaN where absent."""
    row: list[float] = []
    for group in groups:
        told = group == "tension_setpoint_N"
        values = np.asarray(setpoint_N if told else getattr(sample, group))
        count = LOG_GROUPS[group].columns_of(cable_count)
        row += values.tolist() if len(values) == count else [math.nan] * count
    return row


class _SafeFile:
    """A new file that is written through, synced in the background and never ends half-way."""

    def __init__(self, path: Path) -> None:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0)
        self._handle = os.open(path, flags, 0o666)
        self._size = 0
        self._whole = 0  # up to here the file makes sense
        self._closed = threading.Event()
        self._syncer = threading.Thread(target=self._sync, daemon=True)
        self._syncer.start()

    def write(self, data: bytes) -> int:
        """All of ``data``, or OSError and a file that ends where it last made sense."""
        view = memoryview(data)
        try:
            while view:
                count = os.write(self._handle, view)
                self._size += count
                view = view[count:]
        except OSError:
            self._cut()
            raise
        return len(data)

    def mark(self) -> None:
        """What was written up to now makes sense by itself."""
        self._whole = self._size

    def tell(self) -> int:
        return self._size

    def flush(self) -> None:
        """Nothing is held back."""

    def close(self) -> None:
        if self._closed.is_set():
            return
        self._closed.set()
        self._syncer.join()
        try:
            os.fsync(self._handle)
        finally:
            os.close(self._handle)

    def _cut(self) -> None:
        try:
            os.ftruncate(self._handle, self._whole)
            os.lseek(self._handle, self._whole, os.SEEK_SET)
            self._size = self._whole
        except OSError:
            pass  # readers cope with a cut row as well

    def _sync(self) -> None:
        # Beside the control loop: a slow disk must not hold up the robot.
        while not self._closed.wait(_SYNC_S):
            try:
                os.fdatasync(self._handle)
            except OSError:
                return  # the next write will say so


class _CsvLog:
    def __init__(
        self,
        file: _SafeFile,
        cable_count: int,
        inputs: AcquisitionInputs,
        groups: tuple[str, ...],
    ) -> None:
        self._file = file
        self._cables = cable_count
        self._groups = groups
        header = ",".join(["time_s", *canonical_columns(cable_count, groups)]) + "\n"
        self._line(as_comments(inputs) + header.encode())

    def sample(self, sample: RobotSample, setpoint_N: Any) -> None:
        row = _numbers(sample, setpoint_N, self._cables, self._groups)
        cells = [repr(value) if math.isfinite(value) else "" for value in row]
        self._line((",".join([repr(float(sample.time_s)), *cells]) + "\n").encode())

    def event(self, event: Event) -> None:
        self._line(as_comment(event))

    def close(self) -> None:
        self._file.close()

    def _line(self, data: bytes) -> None:
        self._file.write(data)
        self._file.mark()


class _McapLog:
    def __init__(
        self,
        file: _SafeFile,
        cable_count: int,
        inputs: AcquisitionInputs,
        rate_Hz: float,
        groups: tuple[str, ...],
    ) -> None:
        from mcap.writer import Writer

        from cdprcal.io.mcap_log import TOPIC, sample_schema

        self._file = file
        self._cables = cable_count
        self._groups = groups
        self._names = canonical_columns(cable_count, groups)
        chunk_bytes = max(1, int(_CHUNK_S * rate_Hz * _BYTES_A_NUMBER * len(self._names)))
        self._writer = Writer(file, chunk_size=chunk_bytes)  # type: ignore[arg-type]
        self._writer.start(profile="", library="cdprcal")
        attach(self._writer, inputs)
        self._sample = json_channel(self._writer, TOPIC, sample_schema(self._names))
        self._event = event_channel(self._writer)
        self._sequence = 0
        self._broken = False
        file.mark()

    def sample(self, sample: RobotSample, setpoint_N: Any) -> None:
        row = _numbers(sample, setpoint_N, self._cables, self._groups)
        message = {"time_s": float(sample.time_s)} | {
            name: value
            for name, value in zip(self._names, row, strict=True)
            if math.isfinite(value)
        }
        self._message(self._sample, message)

    def event(self, event: Event) -> None:
        self._message(self._event, event)

    def close(self) -> None:
        try:
            if not self._broken:
                self._writer.finish()  # type: ignore[no-untyped-call]
        finally:
            self._file.close()

    def _message(self, channel: int, message: Event) -> None:
        stamp = max(0, round(message["time_s"] * 1e9))
        data = json.dumps(message, allow_nan=False).encode()
        before = self._file.tell()
        try:
            self._writer.add_message(channel, stamp, data, stamp, self._sequence)
        except OSError:
            self._broken = True  # the writer's own count of bytes is wrong from here on
            raise
        self._sequence += 1
        if self._file.tell() != before:
            self._file.mark()
