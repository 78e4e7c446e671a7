"""Elastic–plastic sphere on a half-space, both ways (13)–(15).

Traps of the printed equations: the force jumps +3.0 % at δ/δ_c = 1 and +1.68 % at 6, the inverse
jumps -2.05 % and -1.33 %, so the two are not quite inverse to each other; a continuous law
switches where the branches intersect, at δ/δ_c = 1.483 and 6.649. Beyond δ/δ_c = 110
(F/F_c = 530.2) there is no model: results are flagged `Domain.ABOVE`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

from stepload.contact.checks import Domain, Flagged, require_not_negative, require_positive

EARLY_FACTOR, EARLY_EXPONENT = 1.03, 1.425
LATE_FACTOR, LATE_EXPONENT = 1.40, 1.263
EARLY_FROM, LATE_FROM, MODEL_END = 1.0, 6.0, 110.0
"""Branch limits in δ/δ_c as printed in (14)."""
EARLY_FORCE, LATE_FORCE, MODEL_END_FORCE = 1.0, 13.2, 530.2
"""Branch limits in F/F_c as printed in (15)."""
EARLY_MEETS = EARLY_FACTOR ** (1.0 / (1.5 - EARLY_EXPONENT))
LATE_MEETS = (LATE_FACTOR / EARLY_FACTOR) ** (1.0 / (EARLY_EXPONENT - LATE_EXPONENT))
"""δ/δ_c at which neighbouring branches intersect: 1.483 and 6.649."""
EARLY_MEETS_FORCE = EARLY_MEETS**1.5
LATE_MEETS_FORCE = EARLY_FACTOR * LATE_MEETS**EARLY_EXPONENT


@dataclass(frozen=True, slots=True)
class ElasticPlasticSphere:
    """A sphere contact beyond yield.

    Attributes:
        force_c_n: F_c (13), the force at which yield begins.
        deformation_c_m: δ_c (13); below it F = K δ^1.5 with K = F_c/δ_c^1.5.

    Raises:
        DomainError: a number is not finite and positive.
    """

    force_c_n: float
    deformation_c_m: float

    def __post_init__(self) -> None:
        require_positive(self.force_c_n, "elastic limit F_c", "N")
        require_positive(self.deformation_c_m, "deformation at the elastic limit", "m")

    @classmethod
    def from_law(cls, k: float, force_c_n: float) -> Self:
        """From K in N/m^1.5 (7) and F_c in N: δ_c = (F_c/K)^(2/3)."""
        require_positive(k, "contact stiffness K", "N/m^1.5")
        require_positive(force_c_n, "elastic limit F_c", "N")
        return cls(force_c_n, (force_c_n / k) ** (2.0 / 3.0))

    def force(self, deformation_m: float) -> Flagged:
        """Force in N as printed (14), jumps included; 0 where the bodies are apart (δ ≤ 0).

        Raises:
            DomainError: `deformation_m` is not finite.
        """
        return self._force(deformation_m, EARLY_FROM, LATE_FROM)

    def deformation(self, force_n: float) -> Flagged:
        """Deformation in m as printed (15), jumps included.

        Raises:
            DomainError: `force_n` is negative or not finite.
        """
        return self._deformation(force_n, EARLY_FORCE, LATE_FORCE)

    def continuous_force(self, deformation_m: float) -> Flagged:
        """Force in N with the branches of (14) switched where they intersect; monotone."""
        return self._force(deformation_m, EARLY_MEETS, LATE_MEETS)

    def continuous_deformation(self, force_n: float) -> Flagged:
        """Exact inverse of `continuous_force`, in m; monotone."""
        return self._deformation(force_n, EARLY_MEETS_FORCE, LATE_MEETS_FORCE)

    def _force(self, deformation_m: float, early_from: float, late_from: float) -> Flagged:
        if deformation_m <= 0.0 and math.isfinite(deformation_m):
            return Flagged(0.0, Domain.INSIDE)
        x = require_positive(deformation_m, "deformation", "m") / self.deformation_c_m
        if x <= early_from:
            ratio = x**1.5
        elif x <= late_from:
            ratio = EARLY_FACTOR * x**EARLY_EXPONENT
        else:
            ratio = LATE_FACTOR * x**LATE_EXPONENT
        return Flagged(self.force_c_n * ratio, Domain.INSIDE if x <= MODEL_END else Domain.ABOVE)

    def _deformation(self, force_n: float, early_from: float, late_from: float) -> Flagged:
        load = require_not_negative(force_n, "contact force", "N") / self.force_c_n
        if load <= early_from:
            x = load ** (1.0 / 1.5)
        elif load <= late_from:
            x = (load / EARLY_FACTOR) ** (1.0 / EARLY_EXPONENT)
        else:
            x = (load / LATE_FACTOR) ** (1.0 / LATE_EXPONENT)
        domain = Domain.INSIDE if load <= MODEL_END_FORCE else Domain.ABOVE
        return Flagged(self.deformation_c_m * x, domain)
