"""R13: no component of a force sensor's wrench may come near its rating."""

from __future__ import annotations

import math
from collections.abc import Sequence

from stepload.engine.watch import Breach, Found

OVERLOADED_SAMPLES = 2
"""Readings in a row beyond 80 % of the rating: one may be a spike."""
COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")


class OverloadWatch:
    """Watches one force sensor; `used` is the largest reading as a share of its limit,
    `stated` the components with a rating, as (index, limit).

    Args:
        name: of the sensor.
        limits: largest reading of each component in N and N·m, inf where none is stated.
        found: makes the `Breach` of a rule; see `stepload.engine.watch`.
    """

    def __init__(self, name: str, limits: Sequence[float], found: Found) -> None:
        self._name, self._found = name, found
        self.stated = [(i, limit) for i, limit in enumerate(limits) if limit < math.inf]
        self._over = 0
        self.used = 0.0

    def judge(self, wrench: Sequence[float]) -> Breach | None:
        """Judge a fresh reading, not tared: the weight of the tool loads the sensor too."""
        # A component that is no number may be anything.
        shares = [
            abs(wrench[index]) / limit if wrench[index] == wrench[index] else math.inf
            for index, limit in self.stated
        ]
        self.used = used = max(shares, default=0.0)
        self._over = self._over + 1 if used > 1.0 else 0
        if self._over < OVERLOADED_SAMPLES:
            return None
        index, limit = self.stated[shares.index(used)]
        value, unit = abs(wrench[index]), "N" if index < 3 else "N m"
        return self._found(
            "R13", value, limit, unit,
            f"the {self._name}'s {COMPONENTS[index]} reads {value:.4g} {unit}, beyond {limit:.4g}"
            f" {unit}: 80 % of what it is rated for",
        )  # fmt: skip
