"""The elastic limit of a contact: the force F_c that a run must stay below (13)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.contact.checks import require_material
from stepload.contact.elastic import equivalent_modulus, equivalent_radius, profile_constant
from stepload.contact.material_range import is_range
from stepload.contact.materials import Geometry, Material, Profile

LARGEST_OTHERS = 0.02
"""Share of the largest pressure at F_c by powers above the second at which (13) still holds."""


@dataclass(frozen=True, slots=True)
class ElasticLimit:
    """Onset of yield: F_c in N, δ_c in m, and the equation they come from."""

    force_n: float
    deformation_m: float
    equation: str


def softer_body(material: Material, plate: Material) -> Material | None:
    """The body that yields first, or None where the yield strengths do not determine it.

    It is the body with the lower yield strength. A plate of unknown yield strength counts as the
    harder body only if its modulus is at least the payload's (a steel platen under a plastic
    payload). None if a modulus is given as a range, since F_c is proportional to 1/E_eq².

    Raises:
        DomainError: a material constant is not physical.
    """
    payload_yield = require_material(material).yield_strength_pa
    plate_yield = require_material(plate).yield_strength_pa
    if payload_yield is None or is_range(material) or is_range(plate):
        return None
    if plate_yield is None:
        return material if plate.youngs_modulus_pa >= material.youngs_modulus_pa else None
    return material if payload_yield <= plate_yield else plate


def no_limit_reason(geometry: Geometry, material: Material, plate: Material) -> str:
    """Why theory has no elastic limit here and one must be declared; "" where it has one.

    Raises:
        DomainError: a number outside the domain of the theory.
    """
    if equivalent_radius(geometry) is None:
        return (
            "theory gives no elastic limit for this shape: (13) holds for spheres and spherical"
            " tips"
        )
    if (softer := softer_body(material, plate)) is not None:
        if onset_in(softer, geometry, material, plate) is None:
            return "at F_c (13) of the curvature at r = 0, higher powers of the profile count too"
        return ""
    if ranges := [body.name for body in (material, plate) if is_range(body)]:
        return f"{ranges[0]!r} is known as a range only, so (13) cannot be evaluated"
    unknown = material if material.yield_strength_pa is None else plate
    return f"the yield strength of {unknown.name!r} is not known, so (13) cannot be evaluated"


def elastic_limit(geometry: Geometry, material: Material, plate: Material) -> ElasticLimit | None:
    """F_c and δ_c of a sphere or spherical tip (13); None where theory has none.

    F_c = (π P H)³ R_eq²/(6 E_eq²), δ_c = (π P H/(2 E_eq))² R_eq with P = 0.454 + 0.41 ν and
    H = 2.8 Y; ν and Y of the softer body. Where it is None, `no_limit_reason` says why, and the
    limit must be declared.

    Raises:
        DomainError: a number outside the domain of the theory.
    """
    softer = softer_body(material, plate)
    return None if softer is None else onset_in(softer, geometry, material, plate)


def onset_in(
    body: Material, geometry: Geometry, material: Material, plate: Material
) -> ElasticLimit | None:
    """F_c and δ_c (13) if it is `body`, the payload or the plate, that yields first; None where
    theory has none for this geometry, or the yield strength of `body` is not known.

    Raises:
        DomainError: a number outside the domain of the theory.
    """
    radius = equivalent_radius(geometry)
    if radius is None or body.yield_strength_pa is None:
        return None
    modulus = equivalent_modulus(material, plate)
    pressure = math.pi * (0.454 + 0.41 * body.poisson_ratio) * 2.8 * body.yield_strength_pa
    if isinstance(geometry, Profile):
        _, *others = zip(geometry.exponents, geometry.coefficients, strict=True)
        # The pressure on the axis of each power (MDR) over that of the second, at a of F_c.
        at_m = 0.5 * pressure / modulus * radius
        shares = (profile_constant(m) * b * m * at_m ** (m - 2.0) / (m - 1.0) for m, b in others)
        if 0.5 * radius * sum(shares) > LARGEST_OTHERS:
            return None
    return ElasticLimit(
        force_n=pressure**3 * radius**2 / (6.0 * modulus**2),
        deformation_m=(pressure / (2.0 * modulus)) ** 2 * radius,
        equation="(13)",
    )
