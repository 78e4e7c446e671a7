"""Elastic–plastic sphere on a half-space, both ways (13)–(15).

As printed the force jumps +3.0 % at δ/δ_c = 1 and +1.68 % at 6, its inverse -2.05 and -1.33 %.
Here the branches switch where they intersect, at δ/δ_c = 1.483 and 6.649, so that the law is
continuous. Beyond δ/δ_c = 110 (F/F_c = 530) there is no model, and results are a continuation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

from stepload.contact.checks import require_not_negative, require_positive

EARLY_FACTOR, EARLY_EXPONENT = 1.03, 1.425
LATE_FACTOR, LATE_EXPONENT = 1.40, 1.263
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

    def force(self, deformation_m: float) -> float:
        """Force in N (14), monotone; 0 where the bodies are apart (δ ≤ 0).

        Raises:
            DomainError: `deformation_m` is not finite.
        """
        if deformation_m <= 0.0 and math.isfinite(deformation_m):
            return 0.0
        x = require_positive(deformation_m, "deformation", "m") / self.deformation_c_m
        if x <= EARLY_MEETS:
            return float(self.force_c_n * x**1.5)
        if x <= LATE_MEETS:
            return float(self.force_c_n * (EARLY_FACTOR * x**EARLY_EXPONENT))
        return float(self.force_c_n * (LATE_FACTOR * x**LATE_EXPONENT))

    def deformation(self, force_n: float) -> float:
        """Deformation in m (15), the exact inverse of `force`.

        Raises:
            DomainError: `force_n` is negative or not finite.
        """
        load = require_not_negative(force_n, "contact force", "N") / self.force_c_n
        if load <= EARLY_MEETS_FORCE:
            x = load ** (1.0 / 1.5)
        elif load <= LATE_MEETS_FORCE:
            x = (load / EARLY_FACTOR) ** (1.0 / EARLY_EXPONENT)
        else:
            x = (load / LATE_FACTOR) ** (1.0 / LATE_EXPONENT)
        return float(self.deformation_c_m * x)
