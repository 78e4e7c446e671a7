"""The power law F = K δ^n (2), its inverse, its secant and tangent stiffness.

Plain floats and the `math` module: a simulator calls these in every tick. Arrays: write
`k * deformation_m**n` and `(force_n / k) ** (1 / n)`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.contact.checks import require_positive
from stepload.errors import DomainError


@dataclass(frozen=True, slots=True)
class ContactLaw:
    """F = K δ^n (2) with `k` in N/m^n; `equation` says where K and n come from.

    Raises:
        DomainError: `k` or `n` is not finite and positive.

    Example:
        >>> law = ContactLaw(k=6.57e8, n=1.5, equation="(7)")
        >>> round(law.deformation(300.0) * 1e6, 1)
        59.3
    """

    k: float
    n: float
    equation: str

    def __post_init__(self) -> None:
        require_positive(self.k, "contact stiffness K", "N/m^n")
        require_positive(self.n, "exponent n", "")

    def force(self, deformation_m: float) -> float:
        """Force in N at a deformation in m (2); 0 where the bodies are apart (δ ≤ 0).

        Raises:
            DomainError: `deformation_m` is not finite.
        """
        if not math.isfinite(deformation_m):
            raise DomainError(f"deformation is {deformation_m} m; it must be finite")
        return self.k * deformation_m**self.n if deformation_m > 0.0 else 0.0

    def deformation(self, force_n: float) -> float:
        """Deformation δ = (F/K)^(1/n) in m at a force in N, the inverse of (2).

        Raises:
            DomainError: `force_n` is negative (the law has no adhesion) or not finite.
        """
        if not 0.0 <= force_n < math.inf:
            raise DomainError(
                f"contact force is {force_n:g} N; it must be finite and at least 0 N",
                hint="the law has no adhesion: a pull is not contact",
            )
        return float((force_n / self.k) ** (1.0 / self.n))

    def secant(self, force_n: float) -> float:
        """Secant stiffness F/δ in N/m at a force > 0 (28)."""
        return secant_stiffness(self.k, self.n, force_n)

    def tangent(self, force_n: float) -> float:
        """Tangent stiffness dF/dδ = n F/δ in N/m at a force > 0: n times the secant (28)."""
        return self.n * self.secant(force_n)


def secant_stiffness(k: float, n: float, force_n: float) -> float:
    """(F^(n-1) K)^(1/n) = F/δ in N/m (28), from `k` in N/m^n.

    Raises:
        DomainError: `force_n` is not finite and positive.

    Example:
        >>> f"{secant_stiffness(1.82e10, 1.85, 300.0):.2e}"
        '4.83e+06'
    """
    if not 0.0 < force_n < math.inf:
        raise DomainError(f"secant force is {force_n:g} N; it must be finite and greater than 0 N")
    return float((force_n ** (n - 1.0) * k) ** (1.0 / n))
