"""Materials and geometries: the inputs of the contact theory."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Material:
    """An isotropic linear elastic body; `yield_strength_pa` is None where it is not known.

    A `…_sigma` is the standard uncertainty of a number, in its unit; None where none is stated.
    `…_ends` are its least and largest possible values, where nothing better is known: the number
    itself then lies between them and is only a guess.
    """

    name: str
    youngs_modulus_pa: float
    poisson_ratio: float
    yield_strength_pa: float | None = None
    youngs_modulus_sigma_pa: float | None = None
    poisson_ratio_sigma: float | None = None
    yield_strength_sigma_pa: float | None = None
    youngs_modulus_ends_pa: tuple[float, float] | None = None
    poisson_ratio_ends: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Sphere:
    """Sphere of `radius_m` on a plane, or on a sphere of `counter_radius_m` (6)."""

    radius_m: float
    counter_radius_m: float | None = None
    radius_sigma_m: float | None = None
    counter_radius_sigma_m: float | None = None


@dataclass(frozen=True, slots=True)
class BluntTip:
    """Cone or pyramid with a spherical tip of `radius_m`; contact stays on the tip."""

    kind: str
    radius_m: float
    radius_sigma_m: float | None = None


@dataclass(frozen=True, slots=True)
class SharpCone:
    """Ideal cone; `slope_rad` is the angle between its flank and the plate."""

    slope_rad: float


@dataclass(frozen=True, slots=True)
class FlatPunch:
    """Rigid-edged flat punch of `radius_m`."""

    radius_m: float
    radius_sigma_m: float | None = None


@dataclass(frozen=True, slots=True)
class PowerProfile:
    """Axisymmetric gap z = b r^m, `coefficient` b in m^(1-m) (1)."""

    exponent: float
    coefficient: float


@dataclass(frozen=True, slots=True)
class Body:
    """Finite body: a cylinder, of a pyramid a square block, held at `height_m` above the tip.

    `radius_m` is its radius, or half width; the profile ends there at the latest.
    """

    height_m: float
    radius_m: float


@dataclass(frozen=True, slots=True)
class RoundedCone:
    """Cone with a spherical tip; `half_angle_rad` is between axis and flank.

    Without a `body` it is held where its flank reaches `base_radius_m`.
    """

    radius_m: float
    half_angle_rad: float
    base_radius_m: float
    radius_sigma_m: float | None = None
    body: Body | None = None


@dataclass(frozen=True, slots=True)
class RoundedPyramid:
    """Square pyramid rounded by a ball: tip and edges have `radius_m`.

    `half_angle_rad` is between axis and face. Without a `body` it is held where its faces reach
    `base_half_width_m`.
    """

    radius_m: float
    half_angle_rad: float
    base_half_width_m: float
    radius_sigma_m: float | None = None
    body: Body | None = None

    @property
    def rounded_m(self) -> float:
        """Height by which the round tip stands below the sharp one."""
        return self.radius_m * (1.0 / math.sin(self.half_angle_rad) - 1.0)


@dataclass(frozen=True, slots=True)
class Profile:
    """Axisymmetric gap: a table of (r, z) in m, or z = Σ b r^m (1), `coefficients` in m^(1-m)."""

    table_m: tuple[tuple[float, float], ...] = ()
    exponents: tuple[float, ...] = ()
    coefficients: tuple[float, ...] = ()
    body: Body | None = None


Geometry = (
    Sphere | BluntTip | SharpCone | FlatPunch | PowerProfile
    | RoundedCone | RoundedPyramid | Profile
)  # fmt: skip
