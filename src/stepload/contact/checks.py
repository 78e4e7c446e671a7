"""Refuse numbers outside the domain of an equation, with value, unit and limit."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepload.contact.materials import Material
from stepload.errors import DomainError


def require_positive(value: float, what: str, unit: str) -> float:
    """`value` if it is finite and positive.

    Raises:
        DomainError: it is not.
    """
    if not 0.0 < value < math.inf:
        raise _outside(value, what, unit, "greater than", "a positive number")
    return value


def require_forces(force_n: ArrayLike) -> NDArray[np.float64]:
    """Contact forces as an array (N,), all finite and positive.

    Raises:
        DomainError: one is not.
    """
    forces = np.atleast_1d(np.asarray(force_n, dtype=np.float64))
    if not np.all((forces > 0.0) & (forces < math.inf)):
        raise DomainError("a contact force that is not above 0 N, or not finite")
    return forces


def require_not_negative(value: float, what: str, unit: str) -> float:
    """`value` if it is finite and at least 0.

    Raises:
        DomainError: it is not.
    """
    if not 0.0 <= value < math.inf:
        raise _outside(value, what, unit, "at least", "0 or a positive number")
    return value


def _outside(value: float, what: str, unit: str, bound: str, requested: str) -> DomainError:
    return DomainError(
        f"{what} is {value:g} {unit}; it must be finite and {bound} 0 {unit}".rstrip(),
        hint=f"give {what} as {requested}",
    )


def require_material(material: Material) -> Material:
    """`material` if its numbers are physical: E > 0, -1 < ν ≤ 0.5, yield strength > 0 or None.

    Raises:
        DomainError: one of them is not.
    """
    name = material.name
    require_positive(material.youngs_modulus_pa, f"Young's modulus of {name!r}", "Pa")
    ratio = material.poisson_ratio
    if not -1.0 < ratio <= 0.5:
        raise DomainError(
            f"Poisson's ratio of {name!r} is {ratio:g}; it must be above -1 and at most 0.5",
            hint="an isotropic elastic body cannot have another one",
        )
    if material.yield_strength_pa is not None:
        require_positive(material.yield_strength_pa, f"yield strength of {name!r}", "Pa")
    return material


def across_problem(
    across_m_per_n: Sequence[float], sigma_m_per_n: Sequence[float], at_share: Sequence[float]
) -> str:
    """Why these numbers cannot be used; "" where they can, or where there are none."""
    named = {"across": across_m_per_n, "across_sigma": sigma_m_per_n, "at_share": at_share}
    for name, values in named.items():
        if len(values) not in (0, 2):
            return f"{name} has {len(values)} numbers; there are two other axes"
    if bool(across_m_per_n) != bool(sigma_m_per_n):
        return "`across` and `across_sigma` belong together"
    return ""
