"""Deformation of a rough sphere contact (9)–(12).

Traps of the model, all of them kept and not smoothed over:

- F → 0 gives δ → 1.5715 σ κ^-0.16, not 0.
- Below p0 = 0.01 the model is out of its domain; results are a formal continuation.
- At p0 = 0.47 the two branches of (12) do not meet: δ drops by 0.89 % as F rises.
- At p0 = 1 the factor on the smooth deformation is 1.00035, not 1.
- σ and the micro-hardness act through σ κ^-0.16 only: a curve cannot separate them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.contact.checks import require_not_negative, require_positive
from stepload.contact.elastic import equivalent_modulus, equivalent_radius, law_for
from stepload.contact.limit import softer_body
from stepload.contact.materials import Geometry, Material, Sphere

HARDNESS_OVER_YIELD = 5.0
"""Micro-hardness over yield strength where only the latter is known; good to a factor of 2.

A Vickers hardness at large depth is 2.8 times the yield strength; at the depth of asperities it is
higher. κ^-0.16 turns that factor of 2 into 11 %.
"""
P0_MIN = 0.01
P0_BRANCH = 0.47


def roughness_number(
    equivalent_modulus_pa: float,
    micro_hardness_pa: float,
    equivalent_radius_m: float,
    roughness_m: float,
) -> float:
    """κ = (E_eq/H_mic) √(R_eq/σ_eq) (9), dimensionless.

    Raises:
        DomainError: an argument is not finite and positive.
    """
    require_positive(equivalent_modulus_pa, "equivalent modulus E_eq", "Pa")
    require_positive(micro_hardness_pa, "micro-hardness H_mic", "Pa")
    require_positive(equivalent_radius_m, "equivalent radius R_eq", "m")
    require_positive(roughness_m, "rms roughness", "m")
    ratio = equivalent_modulus_pa / micro_hardness_pa
    return ratio * math.sqrt(equivalent_radius_m / roughness_m)


def length_sigma(roughness_sigma: float, hardness_sigma: float) -> float:
    """Relative uncertainty of 1.22 σ κ^-0.16 (11), which goes with σ^1.08 H_mic^0.16.

    Args:
        roughness_sigma: relative standard uncertainty of σ.
        hardness_sigma: that of the micro-hardness.
    """
    return math.hypot(1.08 * roughness_sigma, 0.16 * hardness_sigma)


@dataclass(frozen=True, slots=True)
class RoughSphere:
    """A rough sphere on a plane.

    Attributes:
        k: K of the smooth sphere (7) in N/m^1.5.
        roughness_m: σ_eq (8); a smooth contact has no roughness and is a `ContactLaw`.
        kappa: `roughness_number` (9).

    Raises:
        DomainError: a number is not finite and positive.
    """

    k: float
    roughness_m: float
    kappa: float

    def __post_init__(self) -> None:
        require_positive(self.k, "contact stiffness K", "N/m^1.5")
        require_positive(self.roughness_m, "rms roughness", "m")
        require_positive(self.kappa, "roughness number kappa", "")

    @property
    def scale_m(self) -> float:
        """1.22 σ κ^-0.16 in m: the only length by which the roughness acts."""
        return 1.22 * self.roughness_m * float(self.kappa**-0.16)

    def pressure_ratio(self, force_n: float) -> float:
        """p0 (11): maximum pressure over that of the smooth contact, in 0 … 1.

        Raises:
            DomainError: `force_n` is negative or not finite.
        """
        smooth_m = _smooth_deformation(self.k, force_n)
        return smooth_m / (smooth_m + self.scale_m)

    def deformation(self, force_n: float) -> float:
        """Deformation in m (10) at a force in N; a formal continuation where p0 < 0.01.

        Raises:
            DomainError: `force_n` is negative or not finite.
        """
        smooth_m = _smooth_deformation(self.k, force_n)
        scale_m = self.scale_m
        p0 = smooth_m / (smooth_m + scale_m)
        denominator = math.pi**2 * (4.79 - 3.17 * p0**3.13)
        if p0 <= P0_BRANCH:
            # δ_H a_L² written without 0·∞: δ_H/p0 = δ_H + scale.
            bulk_m = 0.5 * 1.605**2 * (smooth_m + scale_m)
            edge_m = 8.0 * 1.605 * math.sqrt(p0) * smooth_m / denominator
        else:
            radius = 3.51 - 2.51 * p0
            bulk_m = 0.5 * radius**2 * smooth_m
            edge_m = 8.0 * p0 * radius * smooth_m / denominator
        return float(bulk_m + edge_m)


def _smooth_deformation(k: float, force_n: float) -> float:
    return float((require_not_negative(force_n, "contact force", "N") / k) ** (2.0 / 3.0))


def rough_sphere(
    geometry: Geometry,
    material: Material,
    plate: Material,
    roughness_m: float,
    micro_hardness_pa: float | None,
) -> RoughSphere | None:
    """The rough contact of these bodies; None of what is no sphere or has no known hardness.

    Without a micro-hardness it follows from the yield strength of the softer body.
    """
    radius_m, softer = equivalent_radius(geometry), softer_body(material, plate)
    if micro_hardness_pa is None and softer is not None and softer.yield_strength_pa is not None:
        micro_hardness_pa = HARDNESS_OVER_YIELD * softer.yield_strength_pa
    if radius_m is None or micro_hardness_pa is None:
        return None
    modulus_pa = equivalent_modulus(material, plate)
    kappa = roughness_number(modulus_pa, micro_hardness_pa, radius_m, roughness_m)
    return RoughSphere(law_for(Sphere(radius_m), material, plate).k, roughness_m, kappa)
