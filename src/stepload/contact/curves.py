"""Array versions of the contact laws, for estimators and figures.

Each gives two arrays of the argument's shape: the values and a boolean mask that is true where the
equation holds. Same equations, traps and domains as the scalar versions.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepload.contact import plastic, rough
from stepload.errors import DomainError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


def rough_deformation(
    contact: rough.RoughSphere, force_n: ArrayLike
) -> tuple[FloatArray, BoolArray]:
    """Deformations in m (10) and where p0 ≥ 0.01.

    Raises:
        DomainError: a force is negative or not finite.
    """
    smooth_m = (_not_negative(force_n) / contact.k) ** (2.0 / 3.0)
    p0 = smooth_m / (smooth_m + contact.scale_m)
    denominator = np.pi**2 * (4.79 - 3.17 * p0**3.13)
    low_m = 0.5 * 1.605**2 * (smooth_m + contact.scale_m) + (
        8.0 * 1.605 * np.sqrt(p0) * smooth_m / denominator
    )
    radius = 3.51 - 2.51 * p0
    high_m = smooth_m * (0.5 * radius**2 + 8.0 * p0 * radius / denominator)
    return np.where(p0 <= rough.P0_BRANCH, low_m, high_m), p0 >= rough.P0_MIN


def elastic_plastic_force(
    contact: plastic.ElasticPlasticSphere, deformation_m: ArrayLike
) -> tuple[FloatArray, BoolArray]:
    """Forces in N as printed (14) and where δ/δ_c ≤ 110; 0 where the bodies are apart.

    Raises:
        DomainError: a deformation is not finite.
    """
    given = np.asarray(deformation_m, dtype=np.float64)
    if not np.isfinite(given).all():
        raise DomainError("a deformation is not finite")
    x = np.maximum(given, 0.0) / contact.deformation_c_m
    ratio = np.select(
        [x <= plastic.EARLY_FROM, x <= plastic.LATE_FROM],
        [x**1.5, plastic.EARLY_FACTOR * x**plastic.EARLY_EXPONENT],
        plastic.LATE_FACTOR * x**plastic.LATE_EXPONENT,
    )
    return contact.force_c_n * ratio, x <= plastic.MODEL_END


def elastic_plastic_deformation(
    contact: plastic.ElasticPlasticSphere, force_n: ArrayLike
) -> tuple[FloatArray, BoolArray]:
    """Deformations in m as printed (15) and where F/F_c ≤ 530.2.

    Raises:
        DomainError: a force is negative or not finite.
    """
    load = _not_negative(force_n) / contact.force_c_n
    x = np.select(
        [load <= plastic.EARLY_FORCE, load <= plastic.LATE_FORCE],
        [
            load ** (1.0 / 1.5),
            (load / plastic.EARLY_FACTOR) ** (1.0 / plastic.EARLY_EXPONENT),
        ],
        (load / plastic.LATE_FACTOR) ** (1.0 / plastic.LATE_EXPONENT),
    )
    return contact.deformation_c_m * x, load <= plastic.MODEL_END_FORCE


def _not_negative(force_n: ArrayLike) -> FloatArray:
    force = np.asarray(force_n, dtype=np.float64)
    bad = ~(np.isfinite(force) & (force >= 0.0))
    if bad.any():
        raise DomainError(
            f"{bad.sum()} of {force.size} contact forces are below 0 N or not finite, "
            f"the first is {force[bad].flat[0]:g} N",
            hint="the law has no adhesion: a pull is not contact",
        )
    return force
