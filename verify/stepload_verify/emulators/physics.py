"""Quantities measured by an emulated sensor."""

from __future__ import annotations

import math
import random
from typing import Protocol

Vector = tuple[float, ...]
GRAVITY_M_S2 = 9.80665


class Tool:
    """The tool between arm and plate; the base of the arm stands upright.

    Attributes:
        hand_n: force of a hand on the tool, x, y, z in the base frame.
        turned: rotation vector of the tool in the base frame.
        mass_kg: what hangs on the measured side of the force sensor.
    """

    def __init__(self, mass_kg: float = 0.0) -> None:
        self.mass_kg = mass_kg
        self.hand_n: Vector = (0.0, 0.0, 0.0)
        self.turned: Vector = (0.0, math.pi, 0.0)

    def force_n(self) -> Vector:
        """Force on the measured side of the sensor, x, y, z in the frame of the tool."""
        x, y, z = self.hand_n
        return unturned((x, y, z - self.mass_kg * GRAVITY_M_S2), self.turned)


def unturned(vector: Vector, turned: Vector) -> Vector:
    """A vector of the base frame in a frame turned by a rotation vector (Rodrigues, backwards)."""
    angle = math.hypot(*turned)
    if angle < 1e-12:
        return vector
    u = tuple(part / angle for part in turned)
    cosine, sine = math.cos(angle), -math.sin(angle)
    along = sum(a * b for a, b in zip(u, vector, strict=True)) * (1.0 - cosine)
    cross = (
        u[1] * vector[2] - u[2] * vector[1],
        u[2] * vector[0] - u[0] * vector[2],
        u[0] * vector[1] - u[1] * vector[0],
    )
    return tuple(
        cosine * v + sine * c + along * a for v, c, a in zip(vector, cross, u, strict=True)
    )


AXES = ("fx", "fy", "fz")
Wrench = tuple[float, float, float, float, float, float]


class Physics(Protocol):
    """The contact as a function of host monotonic time; called from the emulator's thread."""

    def force_n(self, time_s: float) -> float:
        """Force along the sensor's pressing axis, positive when pressing."""
        ...

    def closed_m(self, time_s: float) -> float:
        """Closure of the gap since the start."""
        ...

    def beside(self, time_s: float) -> Wrench | None:
        """The other five components, 0 for the pressing one; None where there are none."""
        ...


class Sine:
    """A slow sine between 0 and `peak_n`, with noise; peak 0 is free air."""

    def __init__(
        self,
        peak_n: float = 10.0,
        period_s: float = 4.0,
        noise_n: float = 0.02,
        stiffness_n_per_m: float = 1e6,
        seed: int = 1,
    ) -> None:
        self._peak_n = peak_n
        self._omega = 2.0 * math.pi / period_s
        self._noise_n = noise_n
        self._stiffness = stiffness_n_per_m
        self._random = random.Random(seed)

    def force_n(self, time_s: float) -> float:
        pressing = 0.5 * self._peak_n * (1.0 - math.cos(self._omega * time_s))
        return pressing + self._random.gauss(0.0, self._noise_n)

    def closed_m(self, time_s: float) -> float:
        return self.force_n(time_s) / self._stiffness

    def beside(self, time_s: float) -> Wrench | None:
        return None


class WrenchSource:
    """Puts the force on one axis, with noise everywhere: a live sensor never repeats itself.

    Args:
        axis: "+fx" … "-fz": which component shows the tool's axis, positive when pressing.
        tool: what else acts on the tool; the components across follow in their order.
    """

    def __init__(
        self,
        physics: Physics,
        axis: str = "+fz",
        noise: float = 0.02,
        seed: int = 2,
        tool: Tool | None = None,
    ) -> None:
        self._tool = tool
        self.physics = physics
        self.axis = axis
        self._index = AXES.index(axis[1:])
        self._sign = -1.0 if axis[0] == "-" else 1.0
        self._noise = noise
        self._random = random.Random(seed)

    def wrench(self, time_s: float, extra_n: float = 0.0) -> Wrench:
        """Wrench in N and N·m with `extra_n` added to the pressing force."""
        gauss = self._random.gauss
        values = [gauss(0.0, self._noise) for _ in range(3)]
        values += [gauss(0.0, 0.05 * self._noise) for _ in range(3)]
        values[self._index] += self._sign * (self.physics.force_n(time_s) + extra_n)
        if (beside := self.physics.beside(time_s)) is not None:
            values = [value + part for value, part in zip(values, beside, strict=True)]
        if self._tool is not None:
            x, y, z = self._tool.force_n()
            values[self._index] -= self._sign * z
            values[(self._index + 1) % 3] += x
            values[(self._index + 2) % 3] += y
        fx, fy, fz, tx, ty, tz = values
        return (fx, fy, fz, tx, ty, tz)
