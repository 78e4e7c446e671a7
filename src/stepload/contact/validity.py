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
    equivalent_radius,
    law_for,
)
from stepload.contact.limit import elastic_limit
from stepload.contact.materials import (
    BluntTip,
    Body,
    Geometry,
    Material,
    PowerProfile,
    Profile,
    RoundedCone,
    RoundedPyramid,
)
from stepload.contact.power_law import ContactLaw
from stepload.contact.rough import P0_MIN, rough_sphere
from stepload.units import percent

SMOOTH_ALPHA = 0.05
"""Largest σ_eq over the smooth deformation of a contact that counts as smooth (Johnson, 13.5)."""
LARGEST_DEPTH = 0.1
"""Largest deformation over radius at which a sphere is treated as a paraboloid and half-space."""
LARGEST_SLOPE = LARGEST_DEPTH**0.5
"""Slope of the gap at the edge of the contact: that of a sphere at `LARGEST_DEPTH`."""
LARGEST_SHARE_OF_HEIGHT = 0.1
"""Contact radius over height at which a layer on a rigid ground is some 10 % stiffer than a
half-space (Dimitriadis et al., Biophysical Journal 82 (2002) 2798)."""
LARGEST_SHARE_OF_WIDTH = 0.25
"""Contact radius over the body's radius up to which (13) is within 5 % of the mesh: of a paraboloid
on bodies of 0.20, 0.29, 0.44 and 0.70 von Mises reached Y at 1.02, 0.96, 0.84 and 0.61 of F_c."""


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
        used_limit_n: the part of F_c that is relied on; None where that is all of it, or
            nothing.
        body: the finite body that the law leaves out; None where the payload has none.
    """

    geometry: Geometry
    material: Material
    plate: Material
    from_n: float
    to_n: float
    roughness_m: float | None = None
    micro_hardness_pa: float | None = None
    height_m: float = 0.0
    used_limit_n: float | None = None
    body: Body | None = None

    @property
    def law(self) -> ContactLaw:
        """The smooth law."""
        return law_for(self.geometry, self.material, self.plate, self.to_n)


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
        *_width(pressed),
        *_yield(pressed),
    )


def _depth(pressed: Pressed) -> Iterator[DomainDoubt]:
    geometry, to_n = pressed.geometry, pressed.to_n
    deformation_m = pressed.law.deformation(to_n)
    radius_m = equivalent_radius(geometry)
    if radius_m is not None and not isinstance(geometry, PowerProfile | Profile | RoundedCone):
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
    force_n = pressed.law.force(LARGEST_DEPTH * radius_m)
    tip = isinstance(geometry, BluntTip | RoundedPyramid)
    whose = "tip's radius" if tip else "radius"
    yield DomainDoubt(
        "tip_exceeded" if tip else "deep_contact",
        f"At {pressed.to_n:.4g} N the deformation is {deformation_m * 1e3:.3g} mm, {depth:.2g} of"
        f" the {whose}; (7) holds up to {LARGEST_DEPTH:g}.",
        f"stay below {force_n:.3g} N" + ", or describe the shape in contact (rounded_cone)" * tip,
        depth, LARGEST_DEPTH, impossible=depth >= 1.0,
    )  # fmt: skip


def _roughness(pressed: Pressed) -> Iterator[DomainDoubt]:
    sigma_m, from_n = pressed.roughness_m, pressed.from_n
    if not sigma_m:
        return
    alpha = sigma_m / pressed.law.deformation(from_n)
    if alpha < SMOOTH_ALPHA:
        return
    rough = rough_sphere(
        pressed.geometry, pressed.material, pressed.plate, sigma_m, pressed.micro_hardness_pa
    )
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
        rough.deformation(force_n) / pressed.law.deformation(force_n) - 1.0
        for force_n in (from_n, pressed.to_n)
    ]
    yield DomainDoubt(
        "rough_contact",
        f"Roughness deforms {percent(more[0], 2)} more than (2) at {from_n:.4g} N, "
        f"{percent(more[1], 2)} at"
        f" {pressed.to_n:.4g} N, by (10).",
        "read K and n by the rough law (10)-(12), or use the chord only",
        alpha, SMOOTH_ALPHA, harmless=True,
    )  # fmt: skip


def _height(pressed: Pressed) -> Iterator[DomainDoubt]:
    if not pressed.height_m:
        return
    deformation_m = pressed.law.deformation(pressed.to_n)
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


def _width(pressed: Pressed) -> Iterator[DomainDoubt]:
    if pressed.body is None:
        return
    to_n = max(pressed.to_n, pressed.used_limit_n or 0.0)
    radius_m = contact_radius(pressed.geometry, pressed.law.deformation(to_n))
    share = radius_m / pressed.body.radius_m
    if share > LARGEST_SHARE_OF_WIDTH:
        yield DomainDoubt(
            "narrow_body",
            f"At {to_n:.4g} N the contact radius is {radius_m * 1e3:.3g} mm, {share:.2g} of the"
            f" body's radius; the law and F_c (13) hold up to {LARGEST_SHARE_OF_WIDTH:g}.",
            "mesh it once: stepload predict PLAN",
            share, LARGEST_SHARE_OF_WIDTH, impossible=True,
        )  # fmt: skip


def _yield(pressed: Pressed) -> Iterator[DomainDoubt]:
    onset = elastic_limit(pressed.geometry, pressed.material, pressed.plate)
    limit_n, to_n = onset.force_n if onset else None, pressed.to_n
    if limit_n is not None and to_n > limit_n:
        yield DomainDoubt(
            "above_elastic_limit",
            f"{to_n:.4g} N is above F_c = {limit_n:.4g} N (13): the contact has yielded.",
            "do not read K and n as elastic ones",
            to_n, limit_n, "N",
        )  # fmt: skip
    elif pressed.used_limit_n is not None and to_n > pressed.used_limit_n:
        yield DomainDoubt(
            "within_doubt_of_limit",
            f"{to_n:.4g} N is above the F_c used, {pressed.used_limit_n:.4g} N: the contact may"
            " have yielded.",
            "look for set and hysteresis in the data",
            to_n, pressed.used_limit_n, "N",
        )  # fmt: skip
