"""Small vectors and matrices as plain floats, for what is computed a thousand times a second."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from stepload.rig.mount import Matrix3, Vector3

FloatArray = NDArray[np.float64]


def turning(rotation_rad: Vector3) -> FloatArray:
    """The matrix of a rotation vector (Rodrigues)."""
    angle = math.hypot(*rotation_rad)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = (part / angle for part in rotation_rad)
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: FloatArray = np.eye(3) + math.sin(angle) * skew + (1.0 - math.cos(angle)) * skew @ skew
    return turned


def rows(matrix: FloatArray) -> Matrix3:
    """A 3 × 3 array as rows of plain floats."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    return (a, b, c), (d, e, f), (g, h, i)


def times(matrix: Matrix3, vector: Vector3) -> Vector3:
    (a, b, c), (d, e, f), (g, h, i) = matrix
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def cross(one: Vector3, other: Vector3) -> Vector3:
    a, b, c = one
    x, y, z = other
    return b * z - c * y, c * x - a * z, a * y - b * x
