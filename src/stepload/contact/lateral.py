"""Reduction of the elastic limit of a sphere on a plane by lateral force.

A sphere that is dragged along while it is pressed yields at a smaller force. In full sliding the
tangential traction is t times the Hertzian pressure, t the force across over the force along the
axis. The largest von Mises stress σ_M is proportional to the peak pressure, and that to the third
root of the force, hence

    g(t) = F_c(t)/F_c(0) = (σ_M(0)/σ_M(t))³

Below the surface σ_M grows slowly; at the surface behind the contact it overtakes that from
t of about 0.26 (ν = 0.2) to 0.36 (ν = 0.4) on. There σ_x = p_0 ((1 − 2ν)/3 + π (4 + ν) t/8)
(Hamilton and Goodman 1966; Johnson, Contact Mechanics, 1985, 7.1). The table was computed from the
point loads of Boussinesq and Cerruti summed over the contact, and from the closed form at the
surface. A contact that sticks in its middle and slips at its edge (Cattaneo and Mindlin) was less
severe in the cases computed, down to 1.5 % of the contact radius below the surface; stresses in the
last ring of such an edge are not in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepload.errors import DomainError

FloatArray = NDArray[np.float64]
POISSON_RATIOS = (0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5)
SHARES = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6)
LEFT_OF_LIMIT = (
    (1.0, 0.9955, 0.9822, 0.9596, 0.9282, 0.8893, 0.6563, 0.4970, 0.3848, 0.2436, 0.1635),
    (1.0, 0.9950, 0.9802, 0.9566, 0.9255, 0.8854, 0.7447, 0.5514, 0.4190, 0.2577, 0.1692),
    (1.0, 0.9949, 0.9785, 0.9523, 0.9179, 0.8774, 0.8291, 0.6136, 0.4564, 0.2717, 0.1743),
    (1.0, 0.9945, 0.9782, 0.9518, 0.9137, 0.8688, 0.8194, 0.6874, 0.4993, 0.2869, 0.1752),
    (1.0, 0.9938, 0.9744, 0.9444, 0.9061, 0.8563, 0.8028, 0.7428, 0.5255, 0.2768, 0.1628),
    (1.0, 0.9940, 0.9732, 0.9379, 0.8940, 0.8407, 0.7818, 0.7166, 0.4973, 0.2568, 0.1493),
    (1.0, 0.9922, 0.9701, 0.9325, 0.8816, 0.8217, 0.7543, 0.6785, 0.4545, 0.2327, 0.1347),
)  # fmt: skip
"""g by Poisson's ratio (row) and share (column)."""

_STRESS = np.power(LEFT_OF_LIMIT, -1.0 / 3.0)
"""σ_M(t)/σ_M(0), as the table."""

_LOOKED_AT = np.arange(50, 601) / 1000.0


def left_of_limit(poisson_ratio: float, share: float) -> float:
    """g(t): share of F_c that remains where the lateral over the axial force is `share`.

    σ_M is interpolated linearly between the table's columns. It is the largest of stresses that are
    convex in the share, so g is never overestimated; linear interpolation of g itself would be, by
    up to 8 %. Of the two neighbouring rows the smaller value is used. Beyond 0.6 g is 0.

    Args:
        poisson_ratio: of the body that yields, at most 0.5; below 0.2 the row of 0.2 is used,
            although it was not computed for that.
        share: t, at least 0.

    Raises:
        DomainError: a number outside these bounds.
    """
    if not poisson_ratio <= POISSON_RATIOS[-1]:
        raise DomainError(f"Poisson's ratio is {poisson_ratio:g}; it is at most 0.5")
    if not share >= 0.0:
        raise DomainError(f"the share of the lateral force is {share:g}; at least 0")
    if share > SHARES[-1]:
        return 0.0
    return float(_left(poisson_ratio, share))


def _left(poisson_ratio: float, share: FloatArray | float) -> FloatArray:
    """g at the shares of the table."""
    above = int(np.searchsorted(POISSON_RATIOS, max(poisson_ratio, POISSON_RATIOS[0])))
    below = max(above - 1, 0) if poisson_ratio < POISSON_RATIOS[above] else above
    stresses = [np.interp(share, SHARES, _STRESS[row]) for row in (below, above)]
    least: FloatArray = np.max(stresses, axis=0) ** -3.0
    return least


def weakening(poisson_ratio: float, largest_share: float) -> float:
    """The smallest a for which g(t) is at least 1 - a t² at every share t up to the largest.

    Checked every 0.001 from 0.05 on, and at the largest.

    Raises:
        DomainError: as `left_of_limit`; or the largest share is not above 0.
    """
    if not largest_share > 0.0:
        raise DomainError(f"the largest share across the axis is {largest_share:g}; above 0")
    left_of_limit(poisson_ratio, largest_share)  # refuses what it does not know
    shares = np.append(_LOOKED_AT[largest_share > _LOOKED_AT], largest_share)
    left = np.where(shares > SHARES[-1], 0.0, _left(poisson_ratio, shares))
    return float(np.max((1.0 - left) / shares**2))
