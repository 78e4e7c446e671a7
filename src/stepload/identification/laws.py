"""Contact laws, each as deformation over force.

For a given shape parameter every law here is linear: δ = δ0 + Σ c_j b_j(F), with coefficients that
must not be negative. Forces are in units of the top force, so that a shape parameter means the same
at every load. The touch of a law is the limit F → 0, at which the deformation of a rough contact is
not 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stepload.contact.plastic import (
    EARLY_EXPONENT,
    EARLY_FACTOR,
    EARLY_MEETS_FORCE,
    LATE_EXPONENT,
    LATE_FACTOR,
    LATE_MEETS_FORCE,
)
from stepload.contact.rough import P0_BRANCH
from stepload.identification.fit import FloatArray

Basis = Callable[[FloatArray, float], FloatArray]
HERTZ = 2.0 / 3.0


@dataclass(frozen=True, slots=True)
class Law:
    """One law.

    Attributes:
        basis: from u = F/F_top (N,), positive, and the shape parameter to columns (N, k).
        at_touch: the same at F → 0, (k,).
        grid: shape parameters to try, rising.
        parameters: how many numbers are fitted besides its zero.
    """

    name: str
    basis: Basis
    at_touch: Callable[[float], FloatArray]
    grid: FloatArray
    parameters: int


def _power(u: FloatArray, q: float) -> FloatArray:
    return np.asarray(u**q)[:, None]


def _hertz_linear(u: FloatArray, _: float) -> FloatArray:
    return np.stack([u**HERTZ, u], axis=1)


def _bilinear(u: FloatArray, knee: float) -> FloatArray:
    return np.stack([u, np.minimum(u, knee)], axis=1)


def _stiffening(u: FloatArray, knee: float) -> FloatArray:
    """Hertz's law with a smaller compliance from `knee` on."""
    return np.stack([u**HERTZ, np.minimum(u, knee) ** HERTZ], axis=1)


def _rough(u: FloatArray, ratio: float) -> FloatArray:
    """(10)–(12) for a smooth deformation u^(2/3) and 1.22 σ κ^-0.16 = `ratio`; where the branches
    of (12) do not meet, the rising one of the two is taken."""
    smooth = u**HERTZ
    p0 = smooth / (smooth + ratio)
    denominator = math.pi**2 * (4.79 - 3.17 * p0**3.13)
    radius = 3.51 - 2.51 * p0
    low = 0.5 * 1.605**2 * (smooth + ratio) + 8.0 * 1.605 * np.sqrt(p0) * smooth / denominator
    high = 0.5 * radius**2 * smooth + 8.0 * p0 * radius * smooth / denominator
    # Both branches are moved to their middle where they meet, which removes the step of 0.89 %.
    blend = 1.0 / (1.0 + np.exp(-(p0 - P0_BRANCH) / 0.02))
    return np.asarray((1.0 - blend) * low + blend * high)[:, None]


def _plastic(u: FloatArray, first: float) -> FloatArray:
    """(15) with its branches switched where they intersect; `first` is F_c/F_top."""
    load = u / first
    x = np.where(
        load <= EARLY_MEETS_FORCE,
        load**HERTZ,
        np.where(
            load <= LATE_MEETS_FORCE,
            (load / EARLY_FACTOR) ** (1.0 / EARLY_EXPONENT),
            (load / LATE_FACTOR) ** (1.0 / LATE_EXPONENT),
        ),
    )
    return np.asarray(x * first**HERTZ)[:, None]


def _adhesive(u: FloatArray, pull: float) -> FloatArray:
    """Hertz under the load F + F_ad (DMT); `pull` is F_ad/F_top."""
    return np.asarray((u + pull) ** HERTZ)[:, None]


def _nothing(size: int) -> Callable[[float], FloatArray]:
    return lambda _: np.zeros(size)


def _power_law(name: str, grid: FloatArray, parameters: int) -> Law:
    return Law(name, _power, _nothing(1), grid, parameters)


POWER = _power_law("power law", np.linspace(0.25, 1.1, 52), 2)
HERTZ_LINEAR = Law("Hertz and a linear part", _hertz_linear, _nothing(2), np.zeros(1), 2)
BILINEAR = Law("two springs", _bilinear, _nothing(2), np.linspace(0.06, 0.9, 22), 3)
STIFFENING = Law("Hertz against a stop", _stiffening, _nothing(2), np.linspace(0.06, 0.9, 22), 3)
PLASTIC = Law("elastic-plastic (15)", _plastic, _nothing(1), np.geomspace(0.02, 0.55, 14), 2)
ROUGH = Law(
    "rough sphere (10)", _rough, lambda ratio: np.array([0.5 * 1.605**2 * ratio]),
    np.geomspace(2e-3, 0.25, 26), 2,
)  # fmt: skip
ADHESIVE = Law(
    "Hertz with adhesion", _adhesive, lambda pull: np.array([pull**HERTZ]),
    np.geomspace(1e-3, 0.3, 16), 2,
)  # fmt: skip
FIXED = tuple(
    _power_law(f"power law, {name}", np.array([1.0 / n]), 1)
    for name, n in (("Hertz (n = 1.5)", 1.5), ("cone (n = 2)", 2.0), ("linear (n = 1)", 1.0))
)
"""Exponents that follow from theory."""
