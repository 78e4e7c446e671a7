"""The keys of a payload: what is pressed, against which plate."""

from __future__ import annotations

from math import radians
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from stepload.plan.fields import Force, Length, Name, Number, Pressure, Quantity


class Section(BaseModel):
    """A mapping of a plan with a fixed set of keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class MaterialSection(Section):
    """An isotropic linear elastic body."""

    name: Name = Field(description="What it is; shown in reports.")
    youngs_modulus: Pressure = Field(description="Young's modulus E (4).")
    poisson_ratio: Annotated[float, Number(-1.0, 0.5, above=True)] = Field(
        description="Poisson's ratio ν (4)."
    )
    yield_strength: Pressure | None = Field(
        default=None,
        description="Yield strength Y, where it is known; needed for the elastic limit (13).",
    )


class SphereSection(Section):
    """A sphere on the plate, or on another sphere (6)."""

    shape: Literal["sphere"]
    radius: Length = Field(description="Radius of the payload.")
    counter_radius: Length | None = Field(
        default=None, description="Radius of the sphere it is pressed against; none: a plane."
    )


class ConeTipSection(Section):
    """A cone with a spherical tip; contact stays on the tip."""

    shape: Literal["cone_tip"]
    radius: Length = Field(description="Radius of the tip.")


class PyramidTipSection(Section):
    """A pyramid with a spherical tip; contact stays on the tip."""

    shape: Literal["pyramid_tip"]
    radius: Length = Field(description="Radius of the tip.")


class SharpConeSection(Section):
    """An ideal cone, n = 2."""

    shape: Literal["sharp_cone"]
    slope: Annotated[float, Quantity("rad", radians(0.1), radians(89.0))] = Field(
        description="Angle between the flank and the plate."
    )


class FlatPunchSection(Section):
    """A flat round face, n = 1."""

    shape: Literal["flat_punch"]
    radius: Length = Field(description="Radius of the face.")


class PowerSection(Section):
    """A gap that grows with a power m of the distance r from the axis: z = gap (r/at_radius)^m."""

    shape: Literal["power"]
    exponent: Annotated[float, Number(0.1, 50.0)] = Field(description="m (1); n = (m + 1)/m.")
    gap: Length = Field(description="Gap between payload and plate at `at_radius`.")
    at_radius: Length = Field(description="Distance from the axis where `gap` was measured.")


GeometrySection = (
    SphereSection
    | ConeTipSection
    | PyramidTipSection
    | SharpConeSection
    | FlatPunchSection
    | PowerSection
)


class PayloadSection(Section):
    """What is pressed. Inline, or the path of a file that holds these keys."""

    name: Name = Field(description="What it is called in reports.")
    geometry: GeometrySection = Field(
        discriminator="shape", description="Shape of the payload where it touches the plate."
    )
    material: MaterialSection = Field(description="Material of the payload.")
    plate: MaterialSection = Field(description="Material of the plate.")
    roughness: Length | None = Field(
        default=None, description="Equivalent rms roughness σ_eq = √(σ1² + σ2²) (8); none: smooth."
    )
    micro_hardness: Pressure | None = Field(
        default=None, description="Micro-hardness of the softer surface (9); only with `roughness`."
    )
    force_limit: Force | None = Field(
        default=None,
        description="Force that must not be exceeded, declared by a person who answers for it. "
        "Required where theory gives no elastic limit; elsewhere the lower of the two counts.",
    )
