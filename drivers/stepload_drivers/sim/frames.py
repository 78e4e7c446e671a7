"""Small vectors and matrices as plain floats, for what is computed a thousand times a second."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from stepload.rig.mount import Matrix3, Vector3

FloatArray = NDArray[np.float64]


def skew(vector: FloatArray | Vector3) -> FloatArray:
    """[v]×, so that [v]× w = v × w."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def turning(rotation_rad: Vector3) -> FloatArray:
    """The matrix of a rotation vector (Rodrigues)."""
    angle = math.hypot(*rotation_rad)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = (part / angle for part in rotation_rad)
    axis = skew((x, y, z))
    turned: FloatArray = np.eye(3) + math.sin(angle) * axis + (1.0 - math.cos(angle)) * axis @ axis
    return turned


def rows(matrix: FloatArray) -> Matrix3:
    """A 3 × 3 array as rows of plain floats."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    return (a, b, c), (d, e, f), (g, h, i)


def times(matrix: Matrix3, vector: Vector3) -> Vector3:
    (a, b, c), (d, e, f), (g, h, i) = matrix
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def solved(matrix: Matrix3, vector: Vector3) -> Vector3:
    """x of A x = b, A any matrix that has an inverse (Cramer)."""
    (a11, a12, a13), (a21, a22, a23), (a31, a32, a33) = matrix
    x, y, z = vector
    c11, c21, c31 = a22 * a33 - a23 * a32, a23 * a31 - a21 * a33, a21 * a32 - a22 * a31
    scale = 1.0 / (a11 * c11 + a12 * c21 + a13 * c31)
    return (
        scale * (c11 * x + (a13 * a32 - a12 * a33) * y + (a12 * a23 - a13 * a22) * z),
        scale * (c21 * x + (a11 * a33 - a13 * a31) * y + (a13 * a21 - a11 * a23) * z),
        scale * (c31 * x + (a12 * a31 - a11 * a32) * y + (a11 * a22 - a12 * a21) * z),
    )
