"""A number with a flag that says whether it lies in the domain of its equation."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple


class Domain(StrEnum):
    """Where an argument lies with respect to the domain of an equation."""

    INSIDE = "inside"
    BELOW = "below"
    """Smaller than the equation allows; the value is its formal continuation."""
    ABOVE = "above"
    """Larger than the equation allows; the value is its formal continuation."""


class Flagged(NamedTuple):
    """`value` in the unit that its function names; valid only where `domain` is INSIDE."""

    value: float
    domain: Domain

    @property
    def inside(self) -> bool:
        """Whether the equation holds here."""
        return self.domain is Domain.INSIDE
