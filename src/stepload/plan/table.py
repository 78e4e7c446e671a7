"""Compares the table of the system's deflection with the stiffness stated beside it."""

from __future__ import annotations

from collections.abc import Sequence

from stepload.estimators.deflection_rows import upper_stiffness_n_per_m
from stepload.units import format_quantity

TABLE_AGREES = 0.1
"""Largest relative difference between the table of the deflection and the stiffness beside it."""


def disagreement(
    stiffness_n_per_m: float,
    sigma_n_per_m: float,
    force_n: Sequence[float],
    deflection_m: Sequence[float],
) -> str:
    """Why the stated K_s does not belong to this table; "" where the two agree."""
    slope = upper_stiffness_n_per_m(force_n, deflection_m)
    allowed = max(TABLE_AGREES, 3.0 * sigma_n_per_m / stiffness_n_per_m)
    if abs(slope / stiffness_n_per_m - 1.0) <= allowed:
        return ""
    return (
        f"the table has a stiffness of {format_quantity(slope, 'N/m')} above 40 % of its forces, "
        f"value is {format_quantity(stiffness_n_per_m, 'N/m')}"
    )
