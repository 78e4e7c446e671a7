"""Load on a six-axis force sensor: the contact, by its own mounting."""

from __future__ import annotations

from typing import Any

import numpy as np

from stepload.rig.mount import SensorMount
from stepload_drivers.sim.channels import Wrench
from stepload_drivers.sim.frames import FloatArray, skew, turning
from stepload_drivers.sim.six_plant import SixPlant

_PLACES = {"z": (0, 1, 2), "x": (1, 2, 0), "y": (2, 0, 1)}
"""Index of the component of the sensor that shows axis 1, 2, 3 of the pressing frame."""


class SensorLoad:
    """The wrench at the origin of one sensor, without noise and offset.

    Everything between load and reading is linear: the lever, the frame of the sensor and its
    cross-talk.
    """

    def __init__(self, plant: SixPlant, sensor: SensorMount, axis: str) -> None:
        self._plant = plant
        contact = np.vstack([np.eye(3), skew(sensor.lever_m)])
        self._of_load: Any = (_shows(sensor, axis) @ contact).tolist()

    def wrench(self, back: float = 0.0) -> Wrench:
        """Now, or a share `back` of a base step earlier."""
        x, y, z = self._plant.load
        if back:
            p, q, r = self._plant.last_load
            x, y, z = x - back * (x - p), y - back * (y - q), z - back * (z - r)
        six: Any = [a * x + b * y + c * z for a, b, c in self._of_load]
        return tuple(six)


def _shows(sensor: SensorMount, axis: str) -> FloatArray:
    """(6, 6): what a sensor shows of a wrench at its origin in the pressing frame."""
    into = turning(sensor.rotation_rad).T
    named = np.zeros((3, 3))
    for of_press, component in enumerate(_PLACES[axis[-1]]):
        named[component, of_press] = -1.0 if axis[0] == "-" else 1.0
    frame = np.kron(np.eye(2), named @ into)
    mixing = np.eye(6)
    if sensor.cross_talk is not None:
        mixing += np.array(sensor.cross_talk)
    shown: FloatArray = mixing @ frame
    return shown
