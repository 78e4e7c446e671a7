"""Validity check of the rows of a deflection table δ_s(F)."""

from __future__ import annotations

import math
from collections.abc import Sequence

MOST_ROWS = 1000


def table_problem(
    force_n: Sequence[float], deflection_m: Sequence[float], sigma_m: Sequence[float]
) -> str:
    """Why these rows are not a valid table; "" where they are."""
    counts = len(force_n), len(deflection_m), len(sigma_m)
    if len(set(counts)) > 1:
        return (
            f"{counts[0]} forces, {counts[1]} deflections and {counts[2]} uncertainties; every row "
            "needs all three"
        )
    if not 1 <= counts[0] <= MOST_ROWS:
        return f"{counts[0]} rows; a table has 1 to {MOST_ROWS}"
    for name, values in (("force", force_n), ("deflection", deflection_m)):
        before = 0.0
        for value in values:
            if not before < value < math.inf:
                return f"a {name} of {value:.6g} after {before:.6g}; they must rise from row to row"
            before = value
    bad = next((value for value in sigma_m if not 0.0 <= value < math.inf), None)
    if bad is None:
        return ""
    return f"an uncertainty of {bad:.6g} m; it must be finite and not below 0"


def upper_stiffness_n_per_m(force_n: Sequence[float], deflection_m: Sequence[float]) -> float:
    """Stiffness of a table above 40 % of its forces, where K_s is fitted."""
    rows = [(0.0, 0.0), *zip(force_n, deflection_m, strict=True)]
    first = max(index for index, row in enumerate(rows[:-1]) if row[0] <= 0.4 * force_n[-1])
    return (rows[-1][0] - rows[first][0]) / (rows[-1][1] - rows[first][1])
