"""The declaration of a payload: what is pressed, against which plate."""

from collections.abc import Iterator
from itertools import pairwise
from math import cos, radians
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema, model_validator
from pydantic.dataclasses import dataclass

from stepload.contact.elastic import law_for
from stepload.contact.limit import no_limit_reason
from stepload.contact.materials import (
    BluntTip,
    Body,
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


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class BodySection:
    """Finite body for `stepload predict`: held at its end away from the plate."""

    height_m: q.Length
    """Height above the tip at which the body is held."""
    radius_m: q.Length
    """Radius of the body; of a pyramid half its width."""

    def made(self) -> Body:
        return Body(self.height_m, self.radius_m)


HalfAngle = Annotated[float, q.Quantity("rad", radians(1.0), radians(89.0))]


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class RoundedConeSection:
    """A cone with a spherical tip, of which the contact may reach the flank."""

    shape: Literal["rounded_cone"]
    radius_m: u.UncertainLength
    """Radius of the tip."""
    half_angle_rad: HalfAngle
    """Angle between axis and flank."""
    base_radius_m: q.Length
    """Radius at which the flank ends."""
    body: Annotated[Body | None, Made(BodySection)] = None
    """Cylinder behind the base; none: the cone is held at its base."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        yield from _base("base_radius", self.base_radius_m, self)

    def made(self) -> RoundedCone:
        return RoundedCone(
            float(self.radius_m), self.half_angle_rad, self.base_radius_m,
            u.sigma_of(self.radius_m), self.body,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class RoundedPyramidSection:
    """A square pyramid with round tip and edges; theory of its tip, or finite elements."""

    shape: Literal["rounded_pyramid"]
    radius_m: u.UncertainLength
    """Radius of tip and edges."""
    half_angle_rad: HalfAngle
    """Angle between axis and face."""
    base_half_width_m: q.Length
    """Half width at which the faces end."""
    body: Annotated[Body | None, Made(BodySection)] = None
    """Square block behind the base; none: the pyramid is held at its base."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        yield from _base("base_half_width", self.base_half_width_m, self)

    def made(self) -> RoundedPyramid:
        return RoundedPyramid(
            float(self.radius_m), self.half_angle_rad, self.base_half_width_m,
            u.sigma_of(self.radius_m), self.body,
        )  # fmt: skip


def _base(
    key: str, base_m: float, shape: RoundedConeSection | RoundedPyramidSection
) -> Iterator[Contradiction]:
    end_m = float(shape.radius_m) * cos(shape.half_angle_rad)
    if base_m <= end_m:
        yield (
            key,
            f"the base {q.metre(base_m)} is not above {q.metre(end_m)}, where the round tip ends",
            "give a larger base or a smaller radius",
        )
    if shape.body is not None and shape.body.radius_m < base_m:
        yield "body", "the body is narrower than the base", "give its radius or half width"


def _point(value: object, info: ValidationInfo) -> tuple[float, float]:
    """A point [r, z] of a profile."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise q.refused("this is not a point [r, z]", 'expected two lengths, ["1 mm", "0.1 mm"]')
    read = q.Quantity("m", 0.0, 10.0).read
    r, z = map(read, value) if info.context == q.WRITTEN else value
    return r, z


Point = Annotated[
    tuple[float, float],
    BeforeValidator(_point),
    WithJsonSchema(
        {
            "type": "array",
            "items": {"type": "string"},
            "minItems": 2,
            "maxItems": 2,
            "x-expected": "a point of two lengths r and z",
        }
    ),
]


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ProfileSection:
    """Any convex body of revolution: a table of points, or z = Σ gap (r/at_radius)^exponent (1)."""

    shape: Literal["profile"]
    table: tuple[Point, ...] = ()
    """Points [r, z] from [0 mm, 0 mm] outwards, or a CSV file with the heads `r [mm]`, `z [mm]`."""
    exponents: tuple[Annotated[float, q.number(1.0, 50.0)], ...] = ()
    """m of each term (1), rising; in place of `table`."""
    gaps_m: tuple[q.Length, ...] = ()
    """Gap of each term at `at_radius`."""
    at_radius_m: q.Length | None = None
    """Distance from the axis of `gaps`."""
    body: Annotated[Body | None, Made(BodySection)] = None
    """Finite body; none: large against the contact."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        sums = bool(self.exponents), bool(self.gaps_m), self.at_radius_m is not None
        if bool(self.table) == any(sums) or any(sums) != all(sums):
            yield (
                "",
                "a profile is either a table or a sum of powers",
                "write `table`, or all of `exponents`, `gaps` and `at_radius`",
            )
        elif self.table:
            yield from _not_convex(self.table)
        elif len(self.exponents) != len(self.gaps_m):
            yield "gaps", f"{len(self.gaps_m)} gaps of {len(self.exponents)} terms", "one of each"
        elif any(a >= b for a, b in pairwise(self.exponents)):
            yield "exponents", "the exponents do not rise", "write the lowest first, each once"

    def made(self) -> Profile:
        if self.at_radius_m is None:
            return Profile(table_m=self.table, body=self.body)
        terms = zip(self.exponents, self.gaps_m, strict=True)
        try:
            coefficients = tuple(gap_m / self.at_radius_m**m for m, gap_m in terms)
        except ArithmeticError:
            raise q.refused(*BEYOND) from None
        return Profile(exponents=self.exponents, coefficients=coefficients, body=self.body)


def _not_convex(table: tuple[Point, ...]) -> Iterator[Contradiction]:
    """Theory takes a profile that touches in one round area: convex, from its tip outwards."""
    if not 3 <= len(table) <= 2_000 or table[0] != (0.0, 0.0):
        yield (
            "table",
            f"{len(table)} points, the first at {q.metre(table[0][0])}, {q.metre(table[0][1])}",
            "expected 3 to 2000 points from [0 mm, 0 mm] on",
        )
        return
    last = 0.0
    for (r, z), (further, higher) in pairwise(table):
        slope = (higher - z) / (further - r) if further > r else -1.0
        if slope < last * (1.0 - 1e-6):
            yield (
                "table",
                f"the profile is not convex at r = {q.metre(further)}",
                "r must rise and the slope must not fall; smooth a measured table",
            )
            return
        last = max(last, slope)


Shape = Annotated[
    SphereSection
    | ConeTipSection
    | PyramidTipSection
    | SharpConeSection
    | FlatPunchSection
    | PowerSection
    | RoundedConeSection
    | RoundedPyramidSection
    | ProfileSection,
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
            law_for(*bodies, self.declared_force_limit_n)
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
