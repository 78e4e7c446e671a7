"""What a six-axis force sensor feels: the contact, the tool that hangs on it, its own mounting."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from stepload.rig.mount import ZERO, Matrix6, Mount, SensorMount, Vector3
from stepload_drivers.sim.channels import Wrench
from stepload_drivers.sim.frames import cross, rows, times, turning

_PLACES = {"z": (0, 1, 2), "x": (1, 2, 0), "y": (2, 0, 1)}
"""Which component of the sensor shows axes 1, 2, 3 of the pressing frame."""


class Loaded(Protocol):
    """A rig whose sensor is loaded; vectors in the pressing frame."""

    @property
    def mount(self) -> Mount: ...

    @property
    def load(self) -> Vector3: ...

    @property
    def last_load(self) -> Vector3: ...

    @property
    def acceleration_m_s2(self) -> Vector3: ...


class Felt:
    """The wrench at the origin of one sensor, without noise and offset.

    Args:
        tool_mass_kg: what hangs on the measured side; it has weight and inertia.
        weighs: whether its constant weight shows too, which a tare takes away.
    """

    def __init__(
        self,
        plant: Loaded,
        sensor: SensorMount,
        axis: str,
        tool_mass_kg: float,
        *,
        weighs: bool = True,
    ) -> None:
        self._plant = plant
        self._turn = plant.mount.turn_rad_per_n
        self._turns = any(any(row) for row in self._turn)
        gx, gy, gz = plant.mount.gravity_m_s2
        self._weight = (tool_mass_kg * gx, tool_mass_kg * gy, tool_mass_kg * gz)
        self._mass = tool_mass_kg
        self._weighs = weighs
        self._lever, self._cog = sensor.lever_m, sensor.tool_cog_m
        turned = any(sensor.rotation_rad)
        self._into = rows(turning(sensor.rotation_rad).T) if turned else None
        self._show = _shown(axis)
        self._cross_talk: Matrix6 | None = sensor.cross_talk

    def wrench(self, back: float = 0.0) -> Wrench:
        """Now, or a share `back` of a base step earlier."""
        load = self._plant.load
        if back:
            x, y, z = self._plant.last_load
            p, q, r = load
            load = (p - back * (p - x), q - back * (q - y), r - back * (r - z))
        force, torque = load, cross(self._lever, load)
        if self._mass:
            force, torque = self._with_tool(load, torque)
        if self._into is not None:
            force, torque = times(self._into, force), times(self._into, torque)
        six = self._show(force, torque)
        return six if self._cross_talk is None else _mixed(self._cross_talk, six)

    def _with_tool(self, load: Vector3, torque: Vector3) -> tuple[Vector3, Vector3]:
        """The tool pulls with its weight as the turned tool feels it, and pushes by inertia."""
        m = self._mass
        ax, ay, az = self._plant.acceleration_m_s2
        wx, wy, wz = self._weight if self._weighs else ZERO
        if self._turns:
            tx, ty, tz = cross(times(self._turn, load), self._weight)
            wx, wy, wz = wx - tx, wy - ty, wz - tz
        own = (m * ax - wx, m * ay - wy, m * az - wz)
        x, y, z = cross(self._cog, own)
        force = (load[0] + own[0], load[1] + own[1], load[2] + own[2])
        return force, (torque[0] + x, torque[1] + y, torque[2] + z)


def _shown(axis: str) -> Callable[[Vector3, Vector3], Wrench]:
    """From force and torque in the pressing frame to the components of a sensor."""
    sign = -1.0 if axis[0] == "-" else 1.0
    place = _PLACES[axis[-1]]
    first, second, third = (place.index(i) for i in range(3))

    def show(force: Vector3, torque: Vector3) -> Wrench:
        return (
            sign * force[first],
            sign * force[second],
            sign * force[third],
            sign * torque[first],
            sign * torque[second],
            sign * torque[third],
        )

    return show


def _mixed(cross_talk: Matrix6, six: Wrench) -> Wrench:
    """Every component with its share of the others."""
    a, b, c, d, e, f = (
        own + sum(share * other for share, other in zip(row, six, strict=True))
        for own, row in zip(six, cross_talk, strict=True)
    )
    return a, b, c, d, e, f
