"""Sign convention of an imported curve: which way force and travel count."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stepload.estimators.curve_parts import white_noise
from stepload.estimators.fit import FloatArray

_AT_AN_END = 0.002
"""Share of the samples that is taken as one end of the travel."""
_CLEAR = 0.5
"""An end whose force is below this share of the other's is the one in free air."""
_SEEN, _NOISE = 0.05, 6.0
"""Least difference of the two ends for a sign change: as a share of the force range, and in
standard deviations of the noise."""


class Signs(NamedTuple):
    """Factors +1 or −1 that make pressing positive and travel rise towards the payload.

    `shallow_n` is the force at the shallow end, `deep_n` at the deep one, after turning.
    """

    travel: float
    force: float
    shallow_n: float
    deep_n: float


def signs(travel_m: FloatArray, force_n: FloatArray) -> Signs:
    """Find the deep end of the travel, where the payload is pressed, and the signs that follow.

    The force at the deep end counts as pressing even if adhesion pulls harder elsewhere. The
    shallow end is the one without force; where an offset hides that, the one where the data begin.

    Args:
        travel_m, force_n: (N,) in the order of time.
    """
    count = max(3, round(_AT_AN_END * travel_m.size))
    order = np.argpartition(travel_m, [count - 1, travel_m.size - count])
    low_n = float(np.median(force_n[order[:count]]))
    high_n = float(np.median(force_n[order[-count:]]))
    if abs(low_n) < _CLEAR * abs(high_n):
        deep_is_high = True
    elif abs(high_n) < _CLEAR * abs(low_n):
        deep_is_high = False
    else:
        begin = float(np.median(travel_m[: max(3, travel_m.size // 100)]))
        deep_is_high = begin - float(travel_m.min()) <= float(travel_m.max()) - begin
    shallow, deep = (low_n, high_n) if deep_is_high else (high_n, low_n)
    if abs(deep - shallow) < max(_SEEN * float(np.ptp(force_n)), _NOISE * white_noise(force_n)):
        return Signs(1.0, 1.0, low_n, high_n)
    force = 1.0 if deep > shallow else -1.0
    return Signs(1.0 if deep_is_high else -1.0, force, force * shallow, force * deep)
