"""Validity check of the numbers that describe the effect of lateral force."""

from __future__ import annotations

from collections.abc import Sequence


def across_problem(
    across_m_per_n: Sequence[float], sigma_m_per_n: Sequence[float], at_share: Sequence[float]
) -> str:
    """Why these numbers cannot be used; "" where they can, or where there are none."""
    named = {"across": across_m_per_n, "across_sigma": sigma_m_per_n, "at_share": at_share}
    for name, values in named.items():
        if len(values) not in (0, 2):
            return f"{name} has {len(values)} numbers; there are two other axes"
    if bool(across_m_per_n) != bool(sigma_m_per_n):
        return "`across` and `across_sigma` belong together"
    return ""
