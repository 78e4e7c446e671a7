"""Printed estimates compared with the scatter of simulated runs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from stepload_verify.paper.rows import meets

LOW, HIGH = 0.05, 0.95
"""Quantiles that bound a band."""


@dataclass(frozen=True, slots=True)
class Band:
    """What simulated runs give for one number, and what the paper prints in its tests.

    Attributes:
        quantity: what it is, with its unit.
        printed: one printed number a test.
        median, low, high: of the simulated runs; low and high at the quantiles `LOW` and `HIGH`.
        widest: half a width of the band beyond which it holds whatever one might have printed, so
            that a number inside shows nothing.
    """

    quantity: str
    printed: tuple[str, ...]
    median: float
    low: float
    high: float
    widest: float

    @property
    def tells(self) -> bool:
        """Whether the band is narrow enough to show anything."""
        return 0.5 * (self.high - self.low) <= self.widest

    def holds(self, printed: str) -> bool:
        """Whether a printed number lies in the band."""
        return meets(printed, self.low, self.high)


def band(quantity: str, printed: tuple[str, ...], values: list[float], widest: float) -> Band:
    """The band of simulated `values`."""
    low, middle, high = np.quantile(values, [LOW, 0.5, HIGH])
    return Band(quantity, printed, float(middle), float(low), float(high), widest)


@dataclass(frozen=True, slots=True)
class Tally:
    """How many printed numbers lie inside their bands, inside ones that show nothing, outside."""

    inside: int
    shows_nothing: int
    outside: int

    @property
    def numbers(self) -> int:
        """All of them."""
        return self.inside + self.shows_nothing + self.outside


def tally(bands: Iterable[Band]) -> Tally:
    """Count printed numbers, each test by itself. One outside a wide band is outside."""
    inside = shows_nothing = outside = 0
    for each in bands:
        for printed in each.printed:
            if not each.holds(printed):
                outside += 1
            elif each.tells:
                inside += 1
            else:
                shows_nothing += 1
    return Tally(inside, shows_nothing, outside)
