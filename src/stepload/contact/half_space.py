"""Contact of any convex axisymmetric profile with a half-space (Galin 1946, Sneddon 1965).

The method of dimensionality reduction (Popov and Heß, 2015) writes it with a profile in one line:

    g(x) = x ∫_0^x z'(r)/√(x² − r²) dr,   δ = g(a),   F = 2 E_eq ∫_0^a (δ − g(x)) dx

with a the contact radius. It is exact for small strains on a body that is large against the
contact; `finite_elements` has the bodies that are not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepload.contact.checks import require_forces
from stepload.contact.materials import (
    Geometry,
    PowerProfile,
    Profile,
    RoundedCone,
    SharpCone,
    Sphere,
)
from stepload.errors import DomainError

FloatArray = NDArray[np.float64]
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
SHARES = tuple(0.1 * step for step in range(1, 11))
"""Of the highest force: where a power law is fitted to a curve."""


class Indented(NamedTuple):
    """Curve of a contact: forces in N, deformations and contact radii in m."""

    force_n: FloatArray
    deformation_m: FloatArray
    contact_radius_m: FloatArray


@dataclass(frozen=True, slots=True)
class Gap:
    """Gap z(r) between payload and plate in m and its slope; `end_m` is the last radius."""

    z: Callable[[FloatArray], FloatArray]
    slope: Callable[[FloatArray], FloatArray]
    end_m: float


@cache
def gap_of(geometry: Geometry) -> Gap:
    """The gap of an axisymmetric shape.

    Raises:
        DomainError: the shape is not axisymmetric, or has no gap that is known.
    """
    match geometry:
        case Sphere(radius_m=radius, counter_radius_m=None):
            return _sphere(radius)
        case RoundedCone():
            return _rounded(geometry)
        case SharpCone(slope_rad=slope):
            t = math.tan(slope)
            return Gap(lambda r: t * r, lambda r: np.full_like(r, t), math.inf)
        case PowerProfile(exponent=m, coefficient=b):
            return _powers((m,), (b,), math.inf)
        case Profile(table_m=()):
            end_m = geometry.body.radius_m if geometry.body else math.inf
            return _powers(geometry.exponents, geometry.coefficients, end_m)
        case Profile():
            return _table(geometry)
        case _:
            raise DomainError(f"the gap of a {type(geometry).__name__} is not known")


def _sphere(radius_m: float) -> Gap:
    def root(r: FloatArray) -> FloatArray:
        return np.sqrt(np.maximum(radius_m**2 - r**2, (1e-4 * radius_m) ** 2))

    return Gap(lambda r: radius_m - root(r), lambda r: r / root(r), 0.9999 * radius_m)


def _rounded(cone: RoundedCone) -> Gap:
    tip, flank = _sphere(cone.radius_m), 1.0 / math.tan(cone.half_angle_rad)
    end_m = cone.radius_m * math.cos(cone.half_angle_rad)

    def z(r: FloatArray) -> FloatArray:
        return tip.z(np.minimum(r, end_m)) + flank * np.maximum(r - end_m, 0.0)

    def slope(r: FloatArray) -> FloatArray:
        return np.where(r < end_m, tip.slope(np.minimum(r, end_m)), flank)

    return Gap(z, slope, cone.base_radius_m)


def _powers(exponents: tuple[float, ...], coefficients: tuple[float, ...], end_m: float) -> Gap:
    m, b = np.array(exponents), np.array(coefficients)

    def z(r: FloatArray) -> FloatArray:
        return np.asarray((b * r[..., None] ** m).sum(-1))

    def slope(r: FloatArray) -> FloatArray:
        return np.asarray((b * m * r[..., None] ** (m - 1.0)).sum(-1))

    return Gap(z, slope, end_m)


def _table(profile: Profile) -> Gap:
    """Cubics with slopes of parabolas, monotone (Fritsch and Carlson, 1980); z = b r² is exact."""
    from scipy.interpolate import CubicHermiteSpline

    radii, gaps = np.array(profile.table_m).T
    slopes = np.maximum(np.gradient(gaps, radii, edge_order=2), 0.0)
    slopes[1:] = np.minimum(slopes[1:], 3.0 * np.diff(gaps) / np.diff(radii))
    z = CubicHermiteSpline(radii, gaps, slopes)
    return Gap(z, z.derivative(), float(radii[-1]))


def line_profile(gap: Gap, x: FloatArray) -> FloatArray:
    """g(x) in m of a gap, at radii in m."""
    angle = 0.5 * math.pi * _NODES
    slopes = gap.slope(x[..., None] * np.sin(angle))
    return np.asarray(0.5 * math.pi * x * (slopes @ _WEIGHTS))


def half_space(geometry: Geometry, modulus_pa: float, force_n: ArrayLike) -> Indented:
    """Deformation and contact radius at forces, by Galin and Sneddon.

    Args:
        geometry: axisymmetric shape of the payload.
        modulus_pa: E_eq (4) in Pa.
        force_n: forces in N, above 0.

    Raises:
        DomainError: the shape is not axisymmetric, a force is not above 0, or the contact is
            larger than the profile that is known.
    """
    from scipy.optimize import brentq

    gap, forces = gap_of(geometry), require_forces(force_n)

    def pressed_n(radius_m: float) -> float:
        x = radius_m * np.append(_NODES, 1.0)
        g = line_profile(gap, x)
        return 2.0 * modulus_pa * radius_m * float(_WEIGHTS @ (g[-1] - g[:-1]))

    end_m = gap.end_m
    if end_m == math.inf:
        end_m = 1e-6
        while pressed_n(end_m) < forces.max() and end_m < 1e3:
            end_m *= 2.0
    most_n = pressed_n(end_m)
    if forces.max() > most_n:
        raise DomainError(
            f"the contact leaves the profile, which ends at r = {end_m * 1e3:.4g} mm, at"
            f" {most_n:.4g} N",
            hint="press less, or describe the shape farther out",
        )
    radii = np.array(
        [brentq(lambda a, f=f: pressed_n(a) - f, 0.0, end_m, xtol=1e-12 * end_m) for f in forces]
    )
    return Indented(forces, line_profile(gap, radii), radii)


def radius_at(geometry: Geometry, deformation_m: float) -> float:
    """Contact radius a in m at a deformation in m; at most the last radius of the profile."""
    from scipy.optimize import brentq

    gap = gap_of(geometry)
    end_m = gap.end_m if gap.end_m < math.inf else 1e3

    def short_m(radius_m: float) -> float:
        return float(line_profile(gap, np.array(radius_m))) - deformation_m

    return end_m if short_m(end_m) <= 0.0 else float(brentq(short_m, 0.0, end_m, rtol=1e-12))


def slope_at(geometry: Geometry, radius_m: float) -> float:
    """Slope dz/dr of the gap at a radius in m."""
    return float(gap_of(geometry).slope(np.array(radius_m)))


def power_fit(force_n: FloatArray, deformation_m: FloatArray) -> tuple[float, float]:
    """K in N/m^n and n of the power law nearest to a curve, by least squares in logarithms."""
    n, log_k = np.polyfit(np.log(deformation_m), np.log(force_n), 1)
    return float(np.exp(log_k)), float(n)


def rings(radius_m: FloatArray, pieces: int = 8) -> FloatArray:
    """Deformation at each radius of a half-space of E = 1 - ν² under a unit pressure at each.

    The pressure falls linearly to its neighbours; discs in closed form (Johnson, 1985, 3.4.2).
    """
    found = np.zeros((len(radius_m), len(radius_m)))
    for at in range(len(radius_m) - 1):
        edges = np.linspace(radius_m[at], radius_m[at + 1], pieces + 1)
        parts = np.diff(_discs(edges, radius_m), axis=1)
        share = (np.arange(pieces) + 0.5) / pieces
        found[:, at] += parts @ (1.0 - share)
        found[:, at + 1] += parts @ share
    return found


def _discs(size_m: FloatArray, radius_m: FloatArray) -> FloatArray:
    """Deformation at radii (row) of a half-space under unit pressure on discs (column)."""
    from scipy.special import ellipe, ellipk

    a, r = np.broadcast_arrays(size_m[None, :], radius_m[:, None])
    found = np.zeros(a.shape)
    inside, outside = (r <= a) & (a > 0.0), r > a
    found[inside] = 4.0 / math.pi * a[inside] * ellipe((r[inside] / a[inside]) ** 2)
    k = (a[outside] / r[outside]) ** 2
    found[outside] = 4.0 / math.pi * r[outside] * (ellipe(k) - (1.0 - k) * ellipk(k))
    return found
