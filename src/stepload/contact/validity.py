"""Limits of the contact theory: doubts about its equations at the forces that are used.

Every equation of this package assumes small strains and bodies that are large against the contact
(half-spaces). A payload may violate that at one force and not at another, so the forces are passed
in: those of a plan before a run, those that were reached after it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from stepload.contact.checks import require_positive
from stepload.contact.elastic import (
    contact_radius,
    edge_slope,
    equivalent_modulus,
    equivalent_radius,
    law_for,
)
from stepload.contact.limit import elastic_limit, softer_body
from stepload.contact.materials import BluntTip, Geometry, Material, PowerProfile
from stepload.contact.plastic import MODEL_END_FORCE
from stepload.contact.rough import HARDNESS_OVER_YIELD, P0_MIN, RoughSphere, roughness_number

SMOOTH_ALPHA = 0.05
"""Largest σ_eq over the smooth deformation of a contact that counts as smooth (Johnson, 13.5)."""
LARGEST_DEPTH = 0.1
"""Largest deformation over radius at which a sphere is treated as a paraboloid and half-space."""
LARGEST_SLOPE = LARGEST_DEPTH**0.5
"""Slope of the gap at the edge of the contact: that of a sphere at `LARGEST_DEPTH`."""
LARGEST_SHARE_OF_HEIGHT = 0.1
"""Contact radius over height at which a layer on a rigid ground is some 10 % stiffer than a
half-space (Dimitriadis et al., Biophysical Journal 82 (2002) 2798)."""
INCOMPRESSIBLE = 0.495


@dataclass(frozen=True, slots=True)
class DomainDoubt:
    """One equation that does not hold, or only roughly, at the forces that are used.

    Attributes:
        code: stable name; programs branch on it.
        message: the finding, with number and limit.
        remedy: what to do.
        value, limit, unit: the numbers.
        impossible: the law does not apply here, not even roughly.
        harmless: the law holds, and another one of this package describes what it neglects.
    """

    code: str
    message: str
    remedy: str
    value: float
    limit: float
    unit: str = ""
    impossible: bool = False
    harmless: bool = False


@dataclass(frozen=True, slots=True)
class Pressed:
    """What is pressed, and with which forces.

    Attributes:
        from_n, to_n: lowest and highest force in N that a result uses.
        roughness_m, micro_hardness_pa: σ_eq and H_mic where they are stated.
        height_m: of the payload between tool and plate; 0 where it is not stated.
        counted_limit_n: the part of F_c that is relied on; None where that is all of it, or
            nothing.
    """

    geometry: Geometry
    material: Material
    plate: Material
    from_n: float
    to_n: float
    roughness_m: float | None = None
    micro_hardness_pa: float | None = None
    height_m: float = 0.0
    counted_limit_n: float | None = None


def domain_doubts(pressed: Pressed) -> tuple[DomainDoubt, ...]:
    """Every doubt about the equations (2)–(15) at these forces.

    Raises:
        DomainError: a number outside the domain of the theory, or a force that is not positive.
    """
    require_positive(pressed.from_n, "lowest force", "N")
    require_positive(pressed.to_n, "highest force", "N")
    return (
        *_depth(pressed),
        *_roughness(pressed),
        *_height(pressed),
        *_incompressible(pressed),
        *_yield(pressed),
    )


def _deformation(pressed: Pressed, force_n: float) -> float:
    law = law_for(pressed.geometry, pressed.material, pressed.plate)
    return law.deformation(force_n)


def _depth(pressed: Pressed) -> Iterator[DomainDoubt]:
    geometry, to_n = pressed.geometry, pressed.to_n
    deformation_m = _deformation(pressed, to_n)
    radius_m = equivalent_radius(geometry)
    if radius_m is not None and not isinstance(geometry, PowerProfile):
        yield from _deep(pressed, deformation_m, radius_m)
        return
    slope = edge_slope(geometry, deformation_m)
    if slope > LARGEST_SLOPE:
        yield DomainDoubt(
            "steep_contact",
            f"At {to_n:.4g} N the gap's slope at the edge of contact is {slope:.2g}; (3) holds up"
            f" to {LARGEST_SLOPE:.2g}.",
            "compare measured curves, not K and n",
            slope, LARGEST_SLOPE,
        )  # fmt: skip


def _deep(pressed: Pressed, deformation_m: float, radius_m: float) -> Iterator[DomainDoubt]:
    geometry, depth = pressed.geometry, deformation_m / radius_m
    if depth <= LARGEST_DEPTH:
        return
    law = law_for(geometry, pressed.material, pressed.plate)
    force_n = law.force(LARGEST_DEPTH * radius_m)
    figures = (
        f"At {pressed.to_n:.4g} N the deformation is {deformation_m * 1e3:.3g} mm, {depth:.2g} of"
    )
    if isinstance(geometry, BluntTip):
        yield DomainDoubt(
            "tip_exceeded",
            f"{figures} the {geometry.kind}'s tip radius; (7) holds up to {LARGEST_DEPTH:g}.",
            f"stay below {force_n:.3g} N, or describe the shape in contact (sharp_cone)",
            depth, LARGEST_DEPTH, impossible=depth >= 1.0,
        )  # fmt: skip
    else:
        yield DomainDoubt(
            "deep_contact",
            f"{figures} the radius; (7) holds up to {LARGEST_DEPTH:g}.",
            f"stay below {force_n:.3g} N",
            depth, LARGEST_DEPTH, impossible=depth >= 1.0,
        )  # fmt: skip


def _roughness(pressed: Pressed) -> Iterator[DomainDoubt]:
    sigma_m, from_n = pressed.roughness_m, pressed.from_n
    if not sigma_m:
        return
    alpha = sigma_m / _deformation(pressed, from_n)
    if alpha < SMOOTH_ALPHA:
        return
    rough = _rough_sphere(pressed, sigma_m)
    if rough is None:
        yield DomainDoubt(
            "rough_contact",
            f"At {from_n:.4g} N the roughness is {alpha:.2g} of the smooth deformation; smooth is"
            f" below {SMOOTH_ALPHA:g}.",
            "polish the surface, or state micro_hardness",
            alpha, SMOOTH_ALPHA,
        )  # fmt: skip
        return
    p0 = rough.pressure_ratio(from_n)
    if p0 < P0_MIN:
        yield DomainDoubt(
            "rough_beyond_model",
            f"At {from_n:.4g} N roughness lowers the largest pressure to {p0:.2g} of the smooth"
            f" one; (10) ends at {P0_MIN:g}.",
            "polish the surface, or press harder",
            p0, P0_MIN,
        )  # fmt: skip
        return
    more = [
        rough.deformation(force_n).value / _deformation(pressed, force_n) - 1.0
        for force_n in (from_n, pressed.to_n)
    ]
    yield DomainDoubt(
        "rough_contact",
        f"Roughness deforms {more[0]:.0%} more than (2) at {from_n:.4g} N, {more[1]:.0%} at"
        f" {pressed.to_n:.4g} N, by (10).",
        "read K and n by the rough law (10)-(12), or use the chord only",
        alpha, SMOOTH_ALPHA, harmless=True,
    )  # fmt: skip


def _rough_sphere(pressed: Pressed, sigma_m: float) -> RoughSphere | None:
    """The rough law; H_mic from the yield strength where it is not stated."""
    radius_m = equivalent_radius(pressed.geometry)
    softer = softer_body(pressed.material, pressed.plate)
    hardness_pa = pressed.micro_hardness_pa
    if hardness_pa is None and softer is not None and softer.yield_strength_pa is not None:
        hardness_pa = HARDNESS_OVER_YIELD * softer.yield_strength_pa
    if radius_m is None or hardness_pa is None:
        return None
    modulus_pa = equivalent_modulus(pressed.material, pressed.plate)
    k = law_for(pressed.geometry, pressed.material, pressed.plate).k
    return RoughSphere(k, sigma_m, roughness_number(modulus_pa, hardness_pa, radius_m, sigma_m))


def _height(pressed: Pressed) -> Iterator[DomainDoubt]:
    if not pressed.height_m:
        return
    deformation_m = _deformation(pressed, pressed.to_n)
    radius_m = contact_radius(pressed.geometry, deformation_m)
    share = radius_m / pressed.height_m
    if share > LARGEST_SHARE_OF_HEIGHT:
        yield DomainDoubt(
            "thin_payload",
            f"At {pressed.to_n:.4g} N the contact radius is {radius_m * 1e3:.3g} mm, {share:.2g} of"
            f" the payload's height; a half-space holds up to {LARGEST_SHARE_OF_HEIGHT:g}.",
            "press less hard, or do not read K and n as the material's",
            share, LARGEST_SHARE_OF_HEIGHT, impossible=deformation_m >= pressed.height_m,
        )  # fmt: skip


def _incompressible(pressed: Pressed) -> Iterator[DomainDoubt]:
    for body in (pressed.material, pressed.plate):
        if body.poisson_ratio > INCOMPRESSIBLE:
            yield DomainDoubt(
                "incompressible",
                f"Poisson's ratio of {body.name} is {body.poisson_ratio:g}; above"
                f" {INCOMPRESSIBLE:g} sides that are held stiffen it beyond (4).",
                "leave it room to bulge",
                body.poisson_ratio, INCOMPRESSIBLE, harmless=True,
            )  # fmt: skip


def _yield(pressed: Pressed) -> Iterator[DomainDoubt]:
    onset = elastic_limit(pressed.geometry, pressed.material, pressed.plate)
    limit_n, to_n = onset.force_n if onset else None, pressed.to_n
    if limit_n is not None and to_n > MODEL_END_FORCE * limit_n:
        yield DomainDoubt(
            "beyond_plastic_model",
            f"{to_n:.4g} N is {to_n / limit_n:.3g} F_c; the elastic-plastic law (15) ends at"
            f" {MODEL_END_FORCE:g} F_c.",
            f"stay below {limit_n:.3g} N, where the contact is elastic",
            to_n / limit_n, MODEL_END_FORCE,
        )  # fmt: skip
    elif limit_n is not None and to_n > limit_n:
        yield DomainDoubt(
            "above_elastic_limit",
            f"{to_n:.4g} N is above F_c = {limit_n:.4g} N (13): the contact has yielded.",
            "do not read K and n as elastic ones",
            to_n, limit_n, "N",
        )  # fmt: skip
    elif pressed.counted_limit_n is not None and to_n > pressed.counted_limit_n:
        yield DomainDoubt(
            "within_doubt_of_limit",
            f"{to_n:.4g} N is above the F_c used, {pressed.counted_limit_n:.4g} N: the contact may"
            " have yielded.",
            "look for set and hysteresis in the data",
            to_n, pressed.counted_limit_n, "N",
        )  # fmt: skip
