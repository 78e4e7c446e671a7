"""Load on a six-axis force sensor: the contact, the attached tool, its own mounting."""

from __future__ import annotations

from typing import Any

import numpy as np

from stepload.rig.mount import SensorMount, Vector3
from stepload_drivers.sim.channels import Wrench
from stepload_drivers.sim.frames import FloatArray, skew, turning
from stepload_drivers.sim.six_plant import SixPlant

_PLACES = {"z": (0, 1, 2), "x": (1, 2, 0), "y": (2, 0, 1)}
"""Index of the component of the sensor that shows axis 1, 2, 3 of the pressing frame."""


class Felt:
    """The wrench at the origin of one sensor, without noise and offset.

    Everything between load and reading is linear: the lever, the weight that the tool shows when
    the load turns it, its inertia, the frame of the sensor and its cross-talk.

    Args:
        tool_mass_kg: what hangs on the measured side; it has weight and inertia.
        weighs: whether its constant weight shows too, which a tare takes away.
    """

    def __init__(
        self,
        plant: SixPlant,
        sensor: SensorMount,
        axis: str,
        tool_mass_kg: float,
        *,
        weighs: bool = True,
    ) -> None:
        self._plant = plant
        mount = plant.mount
        shows = _shows(sensor, axis)
        weight = tool_mass_kg * np.array(mount.gravity_m_s2)
        contact, tool = _with_moment(sensor.lever_m), _with_moment(sensor.tool_cog_m)
        turned = -skew(weight) @ np.array(mount.turn_rad_per_n)
        self._of_load: Any = (shows @ (contact + tool @ turned)).tolist()
        self._of_tool: Any = (shows @ tool * tool_mass_kg).tolist() if tool_mass_kg else None
        self._of_weight: Any = (shows @ tool @ -weight).tolist() if weighs else None

    def wrench(self, back: float = 0.0) -> Wrench:
        """Now, or a share `back` of a base step earlier."""
        x, y, z = self._plant.load
        if back:
            p, q, r = self._plant.last_load
            x, y, z = x - back * (x - p), y - back * (y - q), z - back * (z - r)
        six: Any = [a * x + b * y + c * z for a, b, c in self._of_load]
        if self._of_tool is not None:
            x, y, z = self._plant.acceleration_m_s2
            if x or y or z:
                own = [a * x + b * y + c * z for a, b, c in self._of_tool]
                six = [one + other for one, other in zip(six, own, strict=True)]
            if self._of_weight is not None:
                six = [one + other for one, other in zip(six, self._of_weight, strict=True)]
        return tuple(six)


def _with_moment(lever: Vector3) -> FloatArray:
    """(6, 3): force and moment about the sensor's origin of a force at `lever`."""
    return np.vstack([np.eye(3), skew(lever)])


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
