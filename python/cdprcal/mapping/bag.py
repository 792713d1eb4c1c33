"""ROS 2 bags of any topics, as flat columns: '/joint_states.position.winch_1'."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cdprcal._core import InputError
from cdprcal.io.files import shown_path, shown_text
from cdprcal.mapping.raw import MOST_WIDE, Column, RawTable
from cdprcal.ros2.storage import damage_named, messages

_SKIPPED = {"header", "layout", "__msgtype__"}


class Messages:
    """The numbers of messages, by topic."""

    def __init__(self) -> None:
        self._stamps: dict[str, list[int]] = {}
        self._rows: dict[str, list[dict[str, float]]] = {}

    def add(self, topic: str, stamp: int, numbers: dict[str, float]) -> None:
        """``stamp``: when they were taken [ns]; ``numbers``: by '.name'. None are no message."""
        if numbers:
            self._stamps.setdefault(topic, []).append(stamp)
            self._rows.setdefault(topic, []).append(numbers)

    def columns(self) -> dict[str, Column]:
        """In the order of their stamps, with seconds since the first of all; NaN where a message
        does not have the number."""
        columns: dict[str, Column] = {}
        # A float has no room for nanoseconds since 1970.
        begin = min((min(stamps) for stamps in self._stamps.values()), default=0)
        for topic, rows in self._rows.items():
            stamps = np.array(self._stamps[topic], dtype=np.int64)
            order = np.argsort(stamps, kind="stable")
            time_s = (stamps - begin)[order] / 1e9
            for key in dict.fromkeys(key for row in rows for key in row):
                values = np.array([row.get(key, np.nan) for row in rows])[order]
                columns[topic + key] = Column(values, time_s=time_s)
        return columns


def read_bag(path: Path) -> RawTable:
    """Reads every topic whose type is known and that holds numbers; stamps of headers count, else
    those of the recorder. What a joint state says is named after its joints, and a force has its
    norm as a column, too. Raises InputError."""
    from rosbags.typesys import Stores, get_typestore

    name = shown_path(path)
    store = get_typestore(Stores.ROS2_HUMBLE)
    types: dict[str, str] = {}
    taken = Messages()
    with damage_named(name, lambda error: f" ({shown_text(str(error))})"):
        for _ in messages(path, {}, types):
            pass
        wanted = {topic: kind for topic, kind in types.items() if kind in store.fielddefs}
        for topic, recorded, data in messages(path, wanted, {}):
            message: Any = store.deserialize_cdr(data, wanted[topic])
            stamp = getattr(getattr(message, "header", None), "stamp", None)
            stamped = stamp.sec * 1_000_000_000 + stamp.nanosec if stamp is not None else 0
            flat: dict[str, float] = {}
            _flatten("", message, flat)
            taken.add(topic, stamped or recorded, flat)
    columns = taken.columns()
    if not columns:
        there = ", ".join(f"{t} ({k})" for t, k in sorted(types.items())) or "nothing"
        raise InputError(
            f"{name}: holds no numbers of a known type; give another bag. It holds {there}"
        )
    return RawTable(path, "bag", columns)


def _flatten(name: str, value: Any, flat: dict[str, float]) -> None:
    if isinstance(value, bool | int | float | np.number):
        flat[name] = float(value)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub":
        if len(value) <= MOST_WIDE:
            for i, number in enumerate(value.tolist()):
                flat[f"{name}.{i + 1}"] = float(number)
    elif hasattr(value, "__dataclass_fields__"):
        fields = [key for key in value.__dataclass_fields__ if key not in _SKIPPED]
        joints = getattr(value, "name", None)
        for key in fields:
            inner = getattr(value, key)
            if isinstance(joints, list) and isinstance(inner, np.ndarray):
                for joint, number in zip(joints, inner.tolist(), strict=False):
                    flat[f"{name}.{key}.{joint}"] = float(number)
            elif "covariance" not in key:
                _flatten(f"{name}.{key}", inner, flat)
        if name.endswith(".force"):
            flat[f"{name}.norm"] = float(np.linalg.norm([value.x, value.y, value.z]))
