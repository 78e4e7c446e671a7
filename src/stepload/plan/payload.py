"""The declaration of a payload: what is pressed, against which plate."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Annotated

from stepload.contact.materials import (
    BluntTip,
    FlatPunch,
    Geometry,
    Material,
    PowerProfile,
    SharpCone,
    Sphere,
)
from stepload.plan.leaves import (
    Expansion,
    Length,
    LengthOrZero,
    Modulus,
    Name,
    Number,
    PoissonRatio,
    Quantity,
    UncertainForce,
    UncertainLength,
    UncertainLengthOrZero,
    UncertainPressure,
)
from stepload.plan.sections import Key, Nested, OneOf


def material(
    name: Annotated[Name, Key("What it is; shown in reports.")],
    youngs_modulus_pa: Annotated[
        Modulus,
        Key(
            "Young's modulus E (4). A range where the material is not known: all bounds hold for "
            "both ends."
        ),
    ],
    poisson_ratio: Annotated[
        PoissonRatio, Key("Poisson's ratio ν (4); 0 to 0.5 where nothing is known.")
    ],
    yield_strength_pa: Annotated[
        UncertainPressure | None,
        Key(
            "Yield strength Y, where it is known; needed for the elastic limit (13). Not beside a "
            "range."
        ),
    ] = None,
    youngs_modulus_sigma_pa: float | None = None,
    poisson_ratio_sigma: float | None = None,
    yield_strength_sigma_pa: float | None = None,
    youngs_modulus_ends_pa: tuple[float, float] | None = None,
    poisson_ratio_ends: tuple[float, float] | None = None,
) -> Material:
    """An isotropic linear elastic body."""
    return Material(
        name, youngs_modulus_pa, poisson_ratio, yield_strength_pa,
        youngs_modulus_sigma_pa, poisson_ratio_sigma, yield_strength_sigma_pa,
        youngs_modulus_ends_pa, poisson_ratio_ends,
    )  # fmt: skip


def sphere(
    radius_m: Annotated[UncertainLength, Key("Radius of the payload.")],
    counter_radius_m: Annotated[
        UncertainLength | None, Key("Radius of the sphere it is pressed against; none: a plane.")
    ] = None,
    radius_sigma_m: float | None = None,
    counter_radius_sigma_m: float | None = None,
) -> Sphere:
    """A sphere on the plate, or on another sphere (6)."""
    return Sphere(radius_m, counter_radius_m, radius_sigma_m, counter_radius_sigma_m)


def cone_tip(
    radius_m: Annotated[UncertainLength, Key("Radius of the tip.")],
    radius_sigma_m: float | None = None,
) -> BluntTip:
    """A cone with a spherical tip; contact stays on the tip."""
    return BluntTip("cone", radius_m, radius_sigma_m)


def pyramid_tip(
    radius_m: Annotated[UncertainLength, Key("Radius of the tip.")],
    radius_sigma_m: float | None = None,
) -> BluntTip:
    """A pyramid with a spherical tip; contact stays on the tip."""
    return BluntTip("pyramid", radius_m, radius_sigma_m)


def sharp_cone(
    slope_rad: Annotated[
        float,
        Quantity("rad", radians(0.1), radians(89.0)),
        Key("Angle between the flank and the plate."),
    ],
) -> SharpCone:
    """An ideal cone, n = 2."""
    return SharpCone(slope_rad)


def flat_punch(
    radius_m: Annotated[UncertainLength, Key("Radius of the face.")],
    radius_sigma_m: float | None = None,
) -> FlatPunch:
    """A flat round face, n = 1."""
    return FlatPunch(radius_m, radius_sigma_m)


def power(
    exponent: Annotated[float, Number(0.1, 50.0), Key("m (1); n = (m + 1)/m.")],
    gap_m: Annotated[Length, Key("Gap between payload and plate at `at_radius`.")],
    at_radius_m: Annotated[Length, Key("Distance from the axis where `gap` was measured.")],
) -> PowerProfile:
    """A gap that grows with a power m of the distance r from the axis: z = gap (r/at_radius)^m."""
    return PowerProfile(exponent, gap_m / at_radius_m**exponent)


@dataclass(frozen=True, slots=True)
class Payload:
    """What is pressed. Inline, or the path of a file that holds these keys."""

    name: Annotated[Name, Key("What it is called in reports.")]
    geometry: Annotated[
        Geometry,
        OneOf((sphere, cone_tip, pyramid_tip, sharp_cone, flat_punch, power)),
        Key("Shape of the payload where it touches the plate."),
    ]
    material: Annotated[Material, Nested(material), Key("Material of the payload.")]
    plate: Annotated[Material, Nested(material), Key("Material of the plate.")]
    roughness_m: Annotated[
        UncertainLengthOrZero | None,
        Key(
            "Equivalent rms roughness σ_eq = √(σ1² + σ2²) (8). 0 m: smooth. None: not known, "
            "which costs width where a result needs the zero."
        ),
    ] = None
    micro_hardness_pa: Annotated[
        UncertainPressure | None,
        Key("Micro-hardness of the softer surface (9); only with `roughness`."),
    ] = None
    declared_force_limit_n: Annotated[
        UncertainForce | None,
        Key(
            "Force that must not be exceeded, declared by a person who answers for it: taken as it "
            "stands unless ± is written. Required where theory gives no elastic limit; elsewhere "
            "the lower of the two counts.",
            name="force_limit",
        ),
    ] = None
    height_m: Annotated[
        LengthOrZero, Key("Height of the payload between tool and plate, which grows when heated.")
    ] = 0.0
    thermal_expansion_per_k: Annotated[
        Expansion, Key("Coefficient of thermal expansion of the payload.")
    ] = 0.0
    modulus_change_per_k: Annotated[
        float, Quantity("1/K", 0.0, 0.1), Key("Relative change of its modulus, either way.")
    ] = 0.0
    limit_coverage: Annotated[
        float,
        Number(1.0, 5.0),
        Key(
            "How many standard uncertainties of ln F_c the limit lies below F_c: 2 leaves 2.3 % "
            "that the payload yields below it, 3 leaves 0.13 %."
        ),
    ] = 2.0
    friction: Annotated[
        float | None,
        Number(0.0, 2.0),
        Key(
            "Highest static friction µ that is possible between payload and plate, as they lie in "
            "the rig, dry or greased: no unit. With it a serial arm is allowed only what friction "
            "leaves of F_c, also while it draws back; it never allows more. None: not known."
        ),
    ] = None
    roughness_sigma_m: float | None = None
    micro_hardness_sigma_pa: float | None = None
    declared_force_limit_sigma_n: float | None = None
