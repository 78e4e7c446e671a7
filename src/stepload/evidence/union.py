"""The interval of a figure over all laws that the data cannot distinguish.

Averaging over laws by their evidence is no remedy: the data do not prefer any of them. So the
interval is the union of the profile-likelihood intervals of all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from stepload.estimators.fit import FloatArray
from stepload.estimators.smooth import CHI2_95
from stepload.evidence.lawfit import LawFit, Point, alike

Read = Callable[[LawFit, float], FloatArray]
"""From a law and its shape parameter to the gradient of a length over the coefficients."""


def _profile(fit: LawFit, read: Read) -> tuple[float, float] | None:
    """The profile-likelihood interval (95 %) of the logarithm of a length under one law; None where
    the length may be 0."""
    low, high = math.inf, -math.inf
    for point in fit.points:
        beyond = point.chi2 - fit.chi2
        if beyond > CHI2_95:
            continue
        found = at_point(fit, point, read)
        if found is None:
            return None
        value, sigma = found
        reach = math.sqrt(CHI2_95 - beyond) * sigma
        low, high = min(low, value - reach), max(high, value + reach)
    return low, high


def at_point(fit: LawFit, point: Point, read: Read) -> tuple[float, float] | None:
    """Logarithm of a length at one point of a law, and its standard uncertainty."""
    gradient = read(fit, point.shape)
    length = float(gradient @ point.coefficients)
    if not length > 0.0:
        return None
    return math.log(length), math.sqrt(
        max(float(gradient @ point.covariance @ gradient), 0.0)
    ) / length


def union(law_sets: Sequence[Sequence[LawFit]], read: Read) -> tuple[float, float] | None:
    """The interval of the logarithm of a length over the laws that the data cannot distinguish, in
    each of several sets (one per assumption about the errors); None where one of them leaves the
    length undetermined."""
    low, high = math.inf, -math.inf
    for laws in law_sets:
        for fit in alike(laws):
            found = _profile(fit, read)
            if found is None:
                return None
            low, high = min(low, found[0]), max(high, found[1])
    return (low, high) if low <= high else None
