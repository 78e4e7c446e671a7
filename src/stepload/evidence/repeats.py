"""Scatter of repeated runs against the errors that their budgets state."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from stepload.estimators.fit import FloatArray, IntArray

LEAST_DEGREES = 2
"""Degrees of freedom from which a scatter may replace a budget: that of one repeat is so uncertain
that its interval would be six times as wide."""
_TOO_SMALL, _TOO_LARGE = 0.1, 0.05
"""Probabilities of a chance scatter this small or this large, below which it overrides a budget."""


class Scatter(NamedTuple):
    """Standard deviation of a value between the runs of a group, pooled over the groups."""

    sigma: float
    degrees: int

    def widened(self, level: float) -> float:
        """The standard deviation widened for Student's distribution (GUM G.3)."""
        from scipy.special import stdtrit

        return self.sigma * float(stdtrit(self.degrees, level)) / normal(level)

    def beyond(self, expected: float, level: float) -> float:
        """Variance of a run that the scatter requires beyond the `expected` variance of its budget.

        At least 0, so that the larger of both counts. A single repeat counts only where chance does
        not explain its scatter.
        """
        if self.degrees < LEAST_DEGREES and not self._too_large(expected):
            return 0.0
        return max(self.widened(level) ** 2 - expected, 0.0)

    def instead_of(self, stated: float, level: float) -> float | None:
        """Variance that replaces a stated one too large for this scatter; None: it stays."""
        from scipy.special import chdtr

        if self.degrees < LEAST_DEGREES or not stated > 0.0:
            return None
        share = self.degrees * self.sigma**2 / stated
        measured = self.widened(level) ** 2
        if float(chdtr(self.degrees, share)) >= _TOO_SMALL or measured >= stated:
            return None
        return measured

    def _too_large(self, expected: float) -> bool:
        from scipy.special import chdtrc

        if not expected > 0.0:
            return self.sigma > 0.0
        share = self.degrees * self.sigma**2 / expected
        return float(chdtrc(self.degrees, share)) < _TOO_LARGE


def within(group: IntArray) -> FloatArray:
    """(N, N) projection onto the differences within groups; `group` (N,) names each run's group."""
    alike = (group[:, None] == group).astype(np.float64)
    return np.asarray(np.eye(group.size) - alike / alike.sum(axis=1))


def scatter_of(value: FloatArray, group: IntArray) -> Scatter | None:
    """Scatter of `value` (N,) in its groups; None where no run was repeated."""
    left = within(group) @ value
    degrees = value.size - np.unique(group).size
    return None if degrees < 1 else Scatter(math.sqrt(float(left @ left) / degrees), degrees)


def normal(level: float) -> float:
    """Quantile of the standard normal distribution."""
    from scipy.special import ndtri

    return float(ndtri(level))
