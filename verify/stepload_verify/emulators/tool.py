"""Loads on the tool of an emulated arm besides the contact: a person's hand, and its weight."""

from __future__ import annotations

import math

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
