"""Roughness and yield on any curve: the factors of (10) and (15) on a computed deformation (V-B).

A mesh or a half-space gives the smooth elastic deformation of any shape. (10) and (15) hold for
spheres, so their share over Hertz (7) at the same force and the tip's radius multiplies it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.contact.checks import require_forces
from stepload.contact.elastic import law_for
from stepload.contact.limit import elastic_limit, no_limit_reason
from stepload.contact.materials import Material, Sphere
from stepload.contact.plastic import ElasticPlasticSphere
from stepload.contact.rough import rough_sphere
from stepload.errors import DomainError
from stepload.units import format_quantity

FloatArray = NDArray[np.float64]
FACTORED = "deformation × factor of"
"""Begins the comment, or note, of a curve that (10) or (15) has multiplied."""


def rough_factor(
    force_n: FloatArray,
    radius_m: float,
    material: Material,
    plate: Material,
    roughness_m: float,
    micro_hardness_pa: float | None = None,
) -> FloatArray:
    """Deformation of a rough sphere (10) over that of a smooth one (7), at each force.

    Args:
        force_n: forces in N, above 0.
        radius_m: of the sphere, or of the tip.
        material: of the payload.
        plate: material of the counter body.
        roughness_m: σ_eq (8) in m; 0 gives 1.
        micro_hardness_pa: H_mic (9) in Pa; None: from the yield strength, as `rough_sphere`.

    Raises:
        DomainError: a number outside the theory, or no hardness is known.
    """
    forces = require_forces(force_n)
    if roughness_m == 0.0:
        return np.ones_like(forces)
    tip = Sphere(radius_m)
    rough = rough_sphere(tip, material, plate, roughness_m, micro_hardness_pa)
    if rough is None:
        raise DomainError(
            "neither a micro-hardness nor a yield strength is known", hint="state micro_hardness"
        )
    law = law_for(tip, material, plate)
    return np.array([rough.deformation(f) / law.deformation(f) for f in forces.tolist()])


def yield_factor(
    force_n: FloatArray, radius_m: float, material: Material, plate: Material
) -> FloatArray:
    """Deformation of an elastic-plastic sphere (15) over the elastic one (7), at each force.

    Args:
        force_n: forces in N, above 0.
        radius_m: of the sphere, or of the tip.
        material: of the payload.
        plate: material of the counter body.

    Raises:
        DomainError: a number outside the theory, or (13) gives no F_c for these bodies.
    """
    forces, tip = require_forces(force_n), Sphere(radius_m)
    onset = elastic_limit(tip, material, plate)
    if onset is None:
        raise DomainError(no_limit_reason(tip, material, plate), hint="state the yield strengths")
    sphere = ElasticPlasticSphere(onset.force_n, onset.deformation_m)
    law = law_for(tip, material, plate)
    return np.array([sphere.deformation(f) / law.deformation(f) for f in forces.tolist()])


@dataclass(frozen=True, slots=True)
class TipFactors:
    """The factors of a curve: its tip, σ_eq or None for a smooth contact, and whether it yields."""

    radius_m: float
    material: Material
    plate: Material
    roughness_m: float | None
    micro_hardness_pa: float | None
    plastic: bool

    def factor(self, force_n: FloatArray) -> FloatArray:
        """Deformation over that of the smooth elastic tip, at forces (N,) above 0."""
        tip = self.radius_m, self.material, self.plate
        found = np.ones_like(force_n)
        if self.roughness_m is not None:
            found = rough_factor(force_n, *tip, self.roughness_m, self.micro_hardness_pa)
        return found * yield_factor(force_n, *tip) if self.plastic else found

    @property
    def note(self) -> str:
        """What the deformation was multiplied by, in a sentence."""
        said = ["(10)"] * (self.roughness_m is not None) + ["(15)"] * self.plastic
        figures = [f"tip radius {format_quantity(self.radius_m, 'm')}"]
        if self.roughness_m is not None:
            figures.append(f"σ_eq {format_quantity(self.roughness_m, 'm')}")
            if self.micro_hardness_pa is not None:
                figures.append(f"H_mic {format_quantity(self.micro_hardness_pa, 'Pa')}")
        return f"{FACTORED} {' and '.join(said)}: {', '.join(figures)}"
