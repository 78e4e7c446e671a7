"""The pressing frame of an emulated arm, seen from its base."""

from __future__ import annotations

import math

Vector = tuple[float, ...]


class PressFrame:
    """Axis 3 along the approach direction; axis 2 the base's y, as far as it lies across.

    With the tool down that is the frame of the tool: axis 1 the base's -x, axis 2 its y.
    """

    def __init__(self, direction: Vector) -> None:
        length = math.hypot(*direction)
        along = tuple(part / length for part in direction)
        guide = (0.0, 1.0, 0.0) if abs(along[1]) < 0.9 else (0.0, 0.0, 1.0)
        slope = _dot(guide, along)
        second = [g - slope * a for g, a in zip(guide, along, strict=True)]
        length = math.hypot(*second)
        second = [part / length for part in second]
        (a, b, c), (x, y, z) = second, along
        self.axes: tuple[Vector, Vector, Vector] = (
            (b * z - c * y, c * x - a * z, a * y - b * x),
            tuple(second),
            along,
        )

    def to_base(self, vector: Vector) -> Vector:
        return tuple(
            sum(part * axis[i] for part, axis in zip(vector, self.axes, strict=True))
            for i in range(3)
        )

    def across(self, vector: Vector) -> tuple[float, float]:
        """Components of a vector of the base along axes 1 and 2."""
        return _dot(self.axes[0], vector), _dot(self.axes[1], vector)


def _dot(one: Vector, other: Vector) -> float:
    return sum(a * b for a, b in zip(one, other, strict=True))
