"""The declaration of a payload: what is pressed, against which plate."""

from collections.abc import Iterator
from math import radians
from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from stepload.contact.elastic import law_for
from stepload.contact.limit import no_limit_reason
from stepload.contact.materials import (
    BluntTip,
    FlatPunch,
    Geometry,
    Material,
    PowerProfile,
    SharpCone,
    Sphere,
)
from stepload.declaration import quantities as q
from stepload.declaration import uncertain as u
from stepload.declaration.sections import CHECKED, INTERNAL, SECTION, Contradiction, Made, put
from stepload.errors import DomainError
from stepload.units import format_quantity

BEYOND = (
    "the contact law of this geometry is beyond what can be computed",
    "check its dimensions and their units",
)
"""Of a geometry, a body or a force whose numbers are absurd."""


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class MaterialSection:
    """An isotropic linear elastic body."""

    name: q.Name
    """Name in reports."""
    youngs_modulus_pa: u.Modulus
    """Young's modulus E (4)."""
    poisson_ratio: u.PoissonRatio
    """Poisson's ratio ν (4)."""
    yield_strength_pa: u.UncertainPressure | None = None
    """Yield strength Y, for the elastic limit (13); not with a range."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        modulus, strength = self.youngs_modulus_pa, self.yield_strength_pa
        if strength is None:
            return
        if strength >= modulus:
            yield (
                "yield_strength",
                f"yield strength {format_quantity(strength, 'Pa')} is not below Young's modulus "
                f"{format_quantity(modulus, 'Pa')}",
                "look for a wrong prefix (MPa, GPa) in one of the two",
            )
        if u.ends_of(modulus) or u.ends_of(self.poisson_ratio):
            yield (
                "yield_strength",
                "a yield strength beside a range: F_c (13) follows from both, and is not known",
                "leave it out and declare the payload's force_limit, or write the modulus itself",
            )

    def made(self) -> Material:
        """The body in the terms of contact theory."""
        modulus, ratio = self.youngs_modulus_pa, self.poisson_ratio
        strength = self.yield_strength_pa
        return Material(
            self.name, float(modulus), float(ratio), strength and float(strength),
            u.sigma_of(modulus), u.sigma_of(ratio), u.sigma_of(strength),
            u.ends_of(modulus), u.ends_of(ratio),
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class SphereSection:
    """A sphere on the plate, or on another sphere (6)."""

    shape: Literal["sphere"]
    radius_m: u.UncertainLength
    """Radius of the payload."""
    counter_radius_m: u.UncertainLength | None = None
    """Radius of the sphere it is pressed against; none: a plane."""

    def made(self) -> Sphere:
        counter = self.counter_radius_m
        return Sphere(
            float(self.radius_m), counter and float(counter), u.sigma_of(self.radius_m),
            u.sigma_of(counter),
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ConeTipSection:
    """A cone with a spherical tip; contact stays on the tip."""

    shape: Literal["cone_tip"]
    radius_m: u.UncertainLength
    """Radius of the tip."""

    def made(self) -> BluntTip:
        return BluntTip("cone", float(self.radius_m), u.sigma_of(self.radius_m))


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class PyramidTipSection:
    """A pyramid with a spherical tip; contact stays on the tip."""

    shape: Literal["pyramid_tip"]
    radius_m: u.UncertainLength
    """Radius of the tip."""

    def made(self) -> BluntTip:
        return BluntTip("pyramid", float(self.radius_m), u.sigma_of(self.radius_m))


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class SharpConeSection:
    """An ideal cone, n = 2."""

    shape: Literal["sharp_cone"]
    slope_rad: Annotated[float, q.Quantity("rad", radians(0.1), radians(89.0))]
    """Angle between flank and plate."""

    def made(self) -> SharpCone:
        return SharpCone(self.slope_rad)


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class FlatPunchSection:
    """A flat round face, n = 1."""

    shape: Literal["flat_punch"]
    radius_m: u.UncertainLength
    """Radius of the face."""

    def made(self) -> FlatPunch:
        return FlatPunch(float(self.radius_m), u.sigma_of(self.radius_m))


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class PowerSection:
    """A gap that grows with a power m of the distance r from the axis: z = gap (r/at_radius)^m."""

    shape: Literal["power"]
    exponent: Annotated[float, q.number(0.1, 50.0)]
    """m (1); n = (m + 1)/m."""
    gap_m: q.Length
    """Gap between payload and plate at `at_radius`."""
    at_radius_m: q.Length
    """Distance from the axis where `gap` was measured."""

    def made(self) -> PowerProfile:
        try:
            return PowerProfile(self.exponent, self.gap_m / self.at_radius_m**self.exponent)
        except ArithmeticError:
            raise q.refused(*BEYOND) from None


Shape = Annotated[
    SphereSection
    | ConeTipSection
    | PyramidTipSection
    | SharpConeSection
    | FlatPunchSection
    | PowerSection,
    Field(discriminator="shape"),
]


@dataclass(frozen=True, slots=True, config=SECTION)
class Payload:
    """What is pressed. Inline, or the path of a file that holds these keys."""

    name: q.Name
    """Name in reports."""
    geometry: Annotated[Geometry, Made(Shape)]
    """Shape of the payload at the contact."""
    material: Annotated[Material, Made(MaterialSection)]
    """Material of the payload."""
    plate: Annotated[Material, Made(MaterialSection)]
    """Material of the plate."""
    roughness_m: u.UncertainLengthOrZero | None = None
    """Equivalent rms roughness σ_eq = √(σ1² + σ2²) (8); 0 m: smooth; none: not known."""
    micro_hardness_pa: u.UncertainPressure | None = None
    """Micro-hardness of the softer surface (9); only with `roughness`."""
    declared_force_limit_n: Annotated[u.UncertainForce | None, Field(alias="force_limit")] = None
    """Declared limit of the force; required where theory has no F_c; else the lower one counts."""
    height_m: q.LengthOrZero = 0.0
    """Height of the payload between tool and plate, for thermal expansion."""
    thermal_expansion_per_k: q.Expansion = 0.0
    """Coefficient of thermal expansion of the payload."""
    modulus_change_per_k: Annotated[float, q.Quantity("1/K", 0.0, 0.1)] = 0.0
    """Relative change of its modulus per kelvin, of either sign."""
    limit_coverage: Annotated[float, q.number(1.0, 5.0)] = 2.0
    """k: how many standard uncertainties of ln F_c the limit lies below F_c."""
    friction: Annotated[float, q.number(0.0, 2.0)] | None = None
    """Highest possible static friction µ of payload and plate; none: not known."""
    roughness_sigma_m: Annotated[float | None, INTERNAL] = None
    micro_hardness_sigma_pa: Annotated[float | None, INTERNAL] = None
    declared_force_limit_sigma_n: Annotated[float | None, INTERNAL] = None

    @model_validator(mode="after")
    def _spread(self) -> "Payload":
        """Put the uncertainty that is written behind a value into its own field."""
        for name in ("roughness_m", "micro_hardness_pa", "declared_force_limit_n"):
            if isinstance(value := getattr(self, name), u.Stated):
                stem, _, unit = name.rpartition("_")
                put(self, f"{stem}_sigma_{unit}", value.sigma)
                put(self, name, float(value))
        return self

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        roughness, radius = self.roughness_m, getattr(self.geometry, "radius_m", None)
        if roughness is not None and radius is not None and roughness >= radius:
            yield (
                "roughness",
                f"roughness {q.metre(roughness)} is not below the radius {q.metre(radius)}",
                "roughness is an rms height, some micrometres for machined parts",
            )
        if self.micro_hardness_pa is not None and roughness is None:
            yield (
                "micro_hardness",
                "micro-hardness without roughness has no effect",
                "give `roughness` too, or leave both out",
            )
        bodies = self.geometry, self.material, self.plate
        try:
            law_for(*bodies)
            reason = no_limit_reason(*bodies)
        except DomainError as error:
            yield "geometry", error.message, error.hint
        except ArithmeticError:
            yield "geometry", *BEYOND
        else:
            if reason and self.declared_force_limit_n is None:
                yield (
                    "",
                    f"missing key 'force_limit': {reason}",
                    "declare the force that must not be exceeded, for example force_limit: 400 N",
                )
