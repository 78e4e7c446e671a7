"""The power law of a smooth elastic contact, from geometry and materials (1)–(7).

The gap between the bodies is axisymmetric with leading term z = b r^m, and no body is near yield.
"""

from __future__ import annotations

import math

from stepload.contact.checks import require_material, require_positive
from stepload.contact.materials import (
    BluntTip,
    FlatPunch,
    Geometry,
    Material,
    PowerProfile,
    Profile,
    RoundedCone,
    RoundedPyramid,
    SharpCone,
    Sphere,
)
from stepload.contact.power_law import ContactLaw
from stepload.errors import DomainError


def equivalent_modulus(first: Material, second: Material) -> float:
    """E_eq in Pa (4): 1/E_eq = (1-ν1²)/E1 + (1-ν2²)/E2.

    Raises:
        DomainError: a material constant is not physical.
    """
    return 1.0 / sum(
        plane_compliance(body) for body in (require_material(first), require_material(second))
    )


def plane_compliance(body: Material) -> float:
    """(1-ν²)/E of one body, in 1/Pa."""
    return (1.0 - body.poisson_ratio**2) / body.youngs_modulus_pa


def profile_constant(exponent: float) -> float:
    """C_m = √π Γ(m/2+1)/Γ((m+1)/2) of (3); the contact radius a obeys δ = C_m b a^m.

    Raises:
        DomainError: `exponent` is not finite and positive.

    Example:
        >>> profile_constant(2.0)
        2.0
    """
    require_positive(exponent, "profile exponent m", "")
    log_ratio = math.lgamma(0.5 * exponent + 1.0) - math.lgamma(0.5 * (exponent + 1.0))
    return math.sqrt(math.pi) * math.exp(log_ratio)


def equivalent_radius(geometry: Geometry) -> float | None:
    """R_eq in m (6) of everything that is a sphere at the contact; None for other geometries.

    A blunt tip counts as a sphere of the tip radius, and z = b r² as one of radius 1/(2b).

    Raises:
        DomainError: a radius or coefficient is not finite and positive.
    """
    match geometry:
        case Sphere(radius_m=radius, counter_radius_m=None) | BluntTip(radius_m=radius):
            return require_positive(radius, "radius", "m")
        case RoundedCone(radius_m=radius) | RoundedPyramid(radius_m=radius):
            return require_positive(radius, "radius", "m")
        case Sphere(radius_m=radius, counter_radius_m=counter) if counter is not None:
            require_positive(radius, "radius", "m")
            require_positive(counter, "radius of the counter sphere", "m")
            return 1.0 / (1.0 / radius + 1.0 / counter)
        case PowerProfile(exponent=2.0, coefficient=coefficient):
            return 0.5 / require_positive(coefficient, "profile coefficient b", "m^(1-m)")
        case Profile(exponents=(2.0, *_), coefficients=(coefficient, *_)):
            return 0.5 / require_positive(coefficient, "profile coefficient b", "m^(1-m)")
        case _:
            return None


def law_for(
    geometry: Geometry, material: Material, plate: Material, to_n: float | None = None
) -> ContactLaw:
    """F = K δ^n of a smooth elastic contact (2)–(7), or nearest to it.

    Args:
        geometry: shape of the payload where it touches.
        material: of the payload.
        plate: material of the counter body.
        to_n: highest force in N that the law is for. The power law of a profile, and of a
            rounded cone that is pressed beyond its tip, is fitted from a tenth of it on; None: a
            cone by its tip (7), a profile up to 1 N.

    Raises:
        DomainError: a number outside the domain of the theory.

    Notes:
        Sphere, blunt tip, tip of a pyramid: K = 4/3 E_eq √R_eq, n = 3/2 (7). Sharp cone of slope β:
        K = 2 E_eq/(π tan β), n = 2. Flat punch: K = 2 R E_eq, n = 1. Any z = b r^m:
        K = 2m/(m+1) E_eq (C_m b)^(-1/m) (3), n = (m+1)/m (5).
    """
    modulus = equivalent_modulus(material, plate)
    if isinstance(geometry, Profile) or _beyond_tip(geometry, modulus, to_n):
        from stepload.contact.half_space import SHARES, half_space, power_fit

        top_n = require_positive(1.0 if to_n is None else to_n, "highest force", "N")
        curve = half_space(geometry, modulus, [share * top_n for share in SHARES])
        return ContactLaw(*power_fit(curve.force_n, curve.deformation_m), "half-space")
    radius = equivalent_radius(geometry)
    if radius is not None:
        return ContactLaw(4.0 / 3.0 * modulus * math.sqrt(radius), 1.5, "(7)")
    match geometry:
        case SharpCone(slope_rad=slope):
            if not 0.0 < slope < 0.5 * math.pi:
                raise DomainError(
                    f"cone slope is {slope:g} rad; it must be above 0 and below pi/2 rad",
                    hint="the slope is the angle between the flank and the plate",
                )
            return ContactLaw(2.0 * modulus / (math.pi * math.tan(slope)), 2.0, "(3), m = 1")
        case FlatPunch(radius_m=punch_radius):
            require_positive(punch_radius, "punch radius", "m")
            return ContactLaw(2.0 * punch_radius * modulus, 1.0, "(3), m -> infinity")
        case PowerProfile(exponent=m, coefficient=b):
            require_positive(b, "profile coefficient b", "m^(1-m)")
            size = math.exp(-(math.log(profile_constant(m)) + math.log(b)) / m)
            return ContactLaw(2.0 * m / (m + 1.0) * modulus * size, (m + 1.0) / m, "(3), (5)")
        case _:
            raise DomainError(f"no contact law for a {type(geometry).__name__}")


def _beyond_tip(geometry: Geometry, modulus_pa: float, to_n: float | None) -> bool:
    """Whether the contact of a rounded cone reaches its flank, by Hertz."""
    if to_n is None or not isinstance(geometry, RoundedCone):
        return False
    end_m = geometry.radius_m * math.cos(geometry.half_angle_rad)
    return 0.75 * to_n * geometry.radius_m / modulus_pa > end_m**3


def contact_radius(geometry: Geometry, deformation_m: float) -> float:
    """Radius a of the contact in m, from δ = C_m b a^m.

    Raises:
        DomainError: `deformation_m` is not finite and positive, or there is no law (3).
    """
    require_positive(deformation_m, "deformation", "m")
    if isinstance(geometry, RoundedCone | Profile):
        from stepload.contact.half_space import radius_at

        return radius_at(geometry, deformation_m)
    radius = equivalent_radius(geometry)
    if radius is not None:
        return math.sqrt(radius * deformation_m)
    match geometry:
        case SharpCone(slope_rad=slope):
            return deformation_m / (0.5 * math.pi * math.tan(slope))
        case FlatPunch(radius_m=punch_radius):
            return punch_radius
        case PowerProfile(exponent=m, coefficient=b):
            log_power = math.log(deformation_m) - math.log(profile_constant(m)) - math.log(b)
            return math.exp(min(log_power / m, 700.0))
        case _:
            raise DomainError(f"no contact radius of a {type(geometry).__name__}")


def edge_slope(geometry: Geometry, deformation_m: float) -> float:
    """Slope dz/dr of the gap at the edge of the contact; 0 of a flat punch, whose gap is flat.

    Raises:
        DomainError: as `contact_radius`.
    """
    contact = contact_radius(geometry, deformation_m)
    match geometry:
        case RoundedCone() | Profile():
            from stepload.contact.half_space import slope_at

            return slope_at(geometry, contact)
        case SharpCone(slope_rad=slope):
            return math.tan(slope)
        case FlatPunch():
            return 0.0
        case PowerProfile(exponent=m):
            return m * deformation_m / (profile_constant(m) * contact)
        case _:
            return 2.0 * deformation_m / (profile_constant(2.0) * contact)
