"""Reduction of a payload's elastic limit by lateral load."""

from __future__ import annotations

from collections.abc import Callable

from stepload.contact.lateral import left_of_limit

_STEP = 0.01
"""Step of the lateral shares in the table kept here, fine enough for linear interpolation."""
_LAST_SHARE = 0.6


def lateral_derating(poisson_ratio: float) -> Callable[[float], float]:
    """g of the lateral share t, F_c(t)/F_c(0), for a body of this Poisson's ratio.

    Beyond the table yield begins at the surface, where the lateral stress alone decides: F_c
    decreases as 1/t³, and is never zero.
    """
    count = round(_LAST_SHARE / _STEP)
    table = [left_of_limit(poisson_ratio, min(i * _STEP, _LAST_SHARE)) for i in range(count + 1)]

    def left(lateral_share: float) -> float:
        if lateral_share >= _LAST_SHARE:
            return float(table[count] * (_LAST_SHARE / lateral_share) ** 3)
        place = lateral_share / _STEP
        i = int(place)
        return table[i] + (table[min(i + 1, count)] - table[i]) * (place - i)

    return left
