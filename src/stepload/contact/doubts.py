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
            f"at {to_n:.4g} N the gap rises with a slope of {slope:.2g} at the edge of the contact;"
            f" (3) holds for small ones, up to {LARGEST_SLOPE:.2g}",
            "do not read K and n as those of this shape; compare measured curves instead",
            slope, LARGEST_SLOPE,
        )  # fmt: skip


def _deep(pressed: Pressed, deformation_m: float, radius_m: float) -> Iterator[DomainDoubt]:
    geometry, depth = pressed.geometry, deformation_m / radius_m
    if depth <= LARGEST_DEPTH:
        return
    law = law_for(geometry, pressed.material, pressed.plate)
    force_n = law.force(LARGEST_DEPTH * radius_m)
    figures = (
        f"at {pressed.to_n:.4g} N the deformation is {deformation_m * 1e3:.3g} mm, {depth:.2g} of"
    )
    if isinstance(geometry, BluntTip):
        left = "has left" if depth >= 1.0 else "may have left"
        yield DomainDoubt(
            "tip_exceeded",
            f"{figures} the radius of the {geometry.kind}'s tip; (7) holds up to"
            f" {LARGEST_DEPTH:g}, and the contact {left} the tip for the flank",
            f"stay below {force_n:.3g} N, or describe the shape that is in contact (sharp_cone)",
            depth, LARGEST_DEPTH, impossible=depth >= 1.0,
        )  # fmt: skip
    else:
        yield DomainDoubt(
            "deep_contact",
            f"{figures} the radius; (7) holds up to {LARGEST_DEPTH:g}, for small strains of a"
            " paraboloid",
            f"stay below {force_n:.3g} N, or take a larger or stiffer payload",
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
            f"at {from_n:.4g} N the roughness is {alpha:.2g} of the smooth deformation; smooth is"
            f" below {SMOOTH_ALPHA:g}, and (10) is for spheres of known hardness or yield strength",
            "use a smoother surface, or give micro_hardness",
            alpha, SMOOTH_ALPHA,
        )  # fmt: skip
        return
    p0 = rough.pressure_ratio(from_n)
    if p0 < P0_MIN:
        yield DomainDoubt(
            "rough_beyond_model",
            f"at {from_n:.4g} N the largest pressure is {p0:.2g} of the smooth one's; (10) ends at"
            f" p0 = {P0_MIN:g}",
            "use a smoother surface, or press harder",
            p0, P0_MIN,
        )  # fmt: skip
        return
    more = [
        rough.deformation(force_n).value / _deformation(pressed, force_n) - 1.0
        for force_n in (from_n, pressed.to_n)
    ]
    hardness = (
        "" if pressed.micro_hardness_pa else f", with a hardness of {HARDNESS_OVER_YIELD:g} Y"
    )
    yield DomainDoubt(
        "rough_contact",
        f"at {from_n:.4g} N the roughness is {alpha:.2g} of the smooth deformation; smooth is below"
        f" {SMOOTH_ALPHA:g}. By (10){hardness}, the deformation from the mean plane is"
        f" {more[0]:.0%} larger there than by (2), and {more[1]:.0%} at {pressed.to_n:.4g} N",
        "read K and n by the rough law (10)-(12), or trust the chord between two forces only",
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
            f"at {pressed.to_n:.4g} N the contact has a radius of {radius_m * 1e3:.3g} mm,"
            f" {share:.2g} of the payload's height of {pressed.height_m * 1e3:.3g} mm; up to"
            f" {LARGEST_SHARE_OF_HEIGHT:g} it is a half-space, above it the tool behind it stiffens"
            " it",
            "press less hard, or do not read K and n as those of the material",
            share, LARGEST_SHARE_OF_HEIGHT, impossible=deformation_m >= pressed.height_m,
        )  # fmt: skip


def _incompressible(pressed: Pressed) -> Iterator[DomainDoubt]:
    for body in (pressed.material, pressed.plate):
        if body.poisson_ratio > INCOMPRESSIBLE:
            yield DomainDoubt(
                "incompressible",
                f"Poisson's ratio of {body.name} is {body.poisson_ratio:g}: above"
                f" {INCOMPRESSIBLE:g} a body is incompressible, and what holds it at its sides"
                " stiffens it beyond (4)",
                "leave it room to bulge; most rubbers have 0.49 to 0.499",
                body.poisson_ratio, INCOMPRESSIBLE, harmless=True,
            )  # fmt: skip


def _yield(pressed: Pressed) -> Iterator[DomainDoubt]:
    onset = elastic_limit(pressed.geometry, pressed.material, pressed.plate)
    limit_n, to_n = onset.force_n if onset else None, pressed.to_n
    if limit_n is not None and to_n > MODEL_END_FORCE * limit_n:
        yield DomainDoubt(
            "beyond_plastic_model",
            f"{to_n:.4g} N is {to_n / limit_n:.3g} F_c; the elastic-plastic law (15) ends at"
            f" {MODEL_END_FORCE:g} F_c",
            f"stay below {limit_n:.3g} N, where the contact is elastic",
            to_n / limit_n, MODEL_END_FORCE,
        )  # fmt: skip
    elif limit_n is not None and to_n > limit_n:
        yield DomainDoubt(
            "above_elastic_limit",
            f"{to_n:.4g} N is above F_c = {limit_n:.4g} N (13): the contact has yielded, and its"
            " curve is that of (15)",
            "do not read K and n as elastic ones",
            to_n, limit_n, "N",
        )  # fmt: skip
    elif pressed.counted_limit_n is not None and to_n > pressed.counted_limit_n:
        yield DomainDoubt(
            "within_doubt_of_limit",
            f"{to_n:.4g} N is above {pressed.counted_limit_n:.4g} N, what is counted on of F_c: the"
            " contact may have yielded",
            "look for set and hysteresis in the data before reading K and n as elastic ones",
            to_n, pressed.counted_limit_n, "N",
        )  # fmt: skip
