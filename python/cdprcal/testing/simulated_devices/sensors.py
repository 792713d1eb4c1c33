"""A simulated node that only has sensors: load-cell amplifiers, swivel encoders."""

from __future__ import annotations

import math

from cdprcal.hardware.session import LoadCell, Session, Swivel
from cdprcal.hardware.session.objects import object_type, parse_object
from cdprcal.testing.simulated_devices.drive import load_cell_counts, swivel_counts
from cdprcal.testing.simulated_devices.object_dictionary import ObjectDictionary

_DEVICE_TYPE = 0x00040191  # analog inputs, CiA 401


class SimulatedSensors:
    """The sensors that a session puts on one node that is no winch's."""

    def __init__(self, session: Session, node: int) -> None:
        self.node = node
        self.dictionary = dictionary = ObjectDictionary()
        dictionary.add((0x1000, 0), _DEVICE_TYPE, 4)
        dictionary.add((0x1001, 0), 0, 1)
        # (cable from 0, sensor) of each kind.
        self._cells = [
            (w.cable - 1, w.load_cell) for w in session.winches if w.load_cell.node == node
        ]
        self._swivels = [
            (w.cable - 1, w.swivel)
            for w in session.winches
            if w.swivel is not None and w.swivel.node == node
        ]
        sensors: list[LoadCell | Swivel] = [sensor for _, sensor in self._cells]
        sensors += [sensor for _, sensor in self._swivels]
        for sensor in sensors:
            dictionary.add(parse_object(sensor.object), 0, object_type(sensor.type).bits // 8)

    def sense(self, swivel_rad: list[float], tension_N: list[float]) -> None:
        """The readings of all cables; NaN: absent."""
        for cable, cell in self._cells:
            self.dictionary.set(parse_object(cell.object), load_cell_counts(cell, tension_N[cable]))
        for cable, swivel in self._swivels:
            if swivel_rad and math.isfinite(swivel_rad[cable]):
                counts = swivel_counts(swivel, swivel_rad[cable])
                self.dictionary.set(parse_object(swivel.object), counts)

    def connection_lost(self) -> None:
        """Nothing here moves."""


def sensor_nodes(session: Session) -> list[SimulatedSensors]:
    """All of a session."""
    drives = {winch.node for winch in session.winches}
    named = {sensor.node for w in session.winches for sensor in (w.load_cell, w.swivel) if sensor}
    return [SimulatedSensors(session, node) for node in sorted(n for n in named - drives if n)]
