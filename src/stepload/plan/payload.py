"""The declaration of a payload: what is pressed, against which plate."""

from math import radians
from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from stepload.contact.materials import (
    BluntTip,
    FlatPunch,
    Geometry,
    Material,
    PowerProfile,
    SharpCone,
    Sphere,
)
from stepload.declaration.quantities import (
    Expansion,
    Length,
    LengthOrZero,
    Name,
    Quantity,
    number,
    refused,
)
from stepload.declaration.sections import INTERNAL, SECTION, Made, key, put
from stepload.declaration.uncertain import (
    Modulus,
    PoissonRatio,
    Stated,
    UncertainForce,
    UncertainLength,
    UncertainLengthOrZero,
    UncertainPressure,
    stated,
)


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class MaterialSection:
    """An isotropic linear elastic body."""

    name: Annotated[Name, key("Name in reports.")]
    youngs_modulus_pa: Annotated[
        Modulus,
        key("Young's modulus E (4)."),
    ]
    poisson_ratio: Annotated[PoissonRatio, key("Poisson's ratio ν (4).")]
    yield_strength_pa: Annotated[
        UncertainPressure | None,
        key("Yield strength Y, for the elastic limit (13); not with a range."),
    ] = None

    def made(self) -> Material:
        """The body in the terms of contact theory."""
        modulus, ratio = stated(self.youngs_modulus_pa), stated(self.poisson_ratio)
        strength = stated(self.yield_strength_pa)
        return Material(
            self.name, modulus.value, ratio.value, strength and strength.value,
            modulus.sigma, ratio.sigma, strength and strength.sigma, modulus.ends, ratio.ends,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class SphereSection:
    """A sphere on the plate, or on another sphere (6)."""

    shape: Literal["sphere"]
    radius_m: Annotated[UncertainLength, key("Radius of the payload.")]
    counter_radius_m: Annotated[
        UncertainLength | None,
        key("Radius of the sphere it is pressed against; none: a plane."),
    ] = None

    def made(self) -> Sphere:
        radius, counter = stated(self.radius_m), stated(self.counter_radius_m)
        return Sphere(
            radius.value, counter and counter.value, radius.sigma, counter and counter.sigma
        )


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class ConeTipSection:
    """A cone with a spherical tip; contact stays on the tip."""

    shape: Literal["cone_tip"]
    radius_m: Annotated[UncertainLength, key("Radius of the tip.")]

    def made(self) -> BluntTip:
        return BluntTip("cone", *stated(self.radius_m)[:2])


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class PyramidTipSection:
    """A pyramid with a spherical tip; contact stays on the tip."""

    shape: Literal["pyramid_tip"]
    radius_m: Annotated[UncertainLength, key("Radius of the tip.")]

    def made(self) -> BluntTip:
        return BluntTip("pyramid", *stated(self.radius_m)[:2])


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class SharpConeSection:
    """An ideal cone, n = 2."""

    shape: Literal["sharp_cone"]
    slope_rad: Annotated[
        float,
        Quantity("rad", radians(0.1), radians(89.0)),
        key("Angle between flank and plate."),
    ]

    def made(self) -> SharpCone:
        return SharpCone(self.slope_rad)


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class FlatPunchSection:
    """A flat round face, n = 1."""

    shape: Literal["flat_punch"]
    radius_m: Annotated[UncertainLength, key("Radius of the face.")]

    def made(self) -> FlatPunch:
        return FlatPunch(*stated(self.radius_m)[:2])


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class PowerSection:
    """A gap that grows with a power m of the distance r from the axis: z = gap (r/at_radius)^m."""

    shape: Literal["power"]
    exponent: Annotated[float, number(0.1, 50.0), key("m (1); n = (m + 1)/m.")]
    gap_m: Annotated[Length, key("Gap between payload and plate at `at_radius`.")]
    at_radius_m: Annotated[Length, key("Distance from the axis where `gap` was measured.")]

    def made(self) -> PowerProfile:
        try:
            return PowerProfile(self.exponent, self.gap_m / self.at_radius_m**self.exponent)
        except ArithmeticError:
            message = "the contact law of this geometry is beyond what can be computed"
            raise refused(message, "check its dimensions and their units") from None


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

    name: Annotated[Name, key("Name in reports.")]
    geometry: Annotated[
        Geometry,
        Made(Shape),
        key("Shape of the payload at the contact."),
    ]
    material: Annotated[Material, Made(MaterialSection), key("Material of the payload.")]
    plate: Annotated[Material, Made(MaterialSection), key("Material of the plate.")]
    roughness_m: Annotated[
        UncertainLengthOrZero | None,
        key("Equivalent rms roughness σ_eq = √(σ1² + σ2²) (8); 0 m: smooth; none: not known."),
    ] = None
    micro_hardness_pa: Annotated[
        UncertainPressure | None,
        key("Micro-hardness of the softer surface (9); only with `roughness`."),
    ] = None
    declared_force_limit_n: Annotated[
        UncertainForce | None,
        key(
            "Declared limit of the force; required where theory has no F_c; else the lower "
            "one counts.",
            alias="force_limit",
        ),
    ] = None
    height_m: Annotated[
        LengthOrZero,
        key("Height of the payload between tool and plate, for thermal expansion."),
    ] = 0.0
    thermal_expansion_per_k: Annotated[
        Expansion, key("Coefficient of thermal expansion of the payload.")
    ] = 0.0
    modulus_change_per_k: Annotated[
        float,
        Quantity("1/K", 0.0, 0.1),
        key("Relative change of its modulus per kelvin, of either sign."),
    ] = 0.0
    limit_coverage: Annotated[
        float,
        number(1.0, 5.0),
        key("k: how many standard uncertainties of ln F_c the limit lies below F_c."),
    ] = 2.0
    friction: Annotated[
        Annotated[float, number(0.0, 2.0)] | None,
        key("Highest possible static friction µ of payload and plate; none: not known."),
    ] = None
    roughness_sigma_m: Annotated[float | None, INTERNAL] = None
    micro_hardness_sigma_pa: Annotated[float | None, INTERNAL] = None
    declared_force_limit_sigma_n: Annotated[float | None, INTERNAL] = None

    @model_validator(mode="after")
    def _spread(self) -> "Payload":
        """Put the uncertainty that is written behind a value into its own field."""
        for name in ("roughness_m", "micro_hardness_pa", "declared_force_limit_n"):
            if isinstance(value := getattr(self, name), Stated):
                stem, _, unit = name.rpartition("_")
                put(self, f"{stem}_sigma_{unit}", value.sigma)
                put(self, name, float(value))
        return self
