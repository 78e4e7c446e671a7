"""A stiffness of one run as comparisons take it, whichever way it was evaluated."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from stepload.errors import DomainError
from stepload.estimators.origin import Origin


@dataclass(frozen=True, slots=True)
class Measured:
    """One stiffness of one run, from whichever way of evaluating it.

    Attributes:
        run: what people call the run.
        quantity: what was measured, such as "secant stiffness": only like is compared with like.
        ln_value: ln of the stiffness in N/m.
        from_n, to_n: the two forces it is taken between; a secant begins at 0.
        lines: source → relative standard uncertainty, ≥ 0; an error has the same sign in all runs.
        origin: where its errors come from.
    """

    run: str
    quantity: str
    ln_value: float
    from_n: float
    to_n: float
    lines: Mapping[str, float]
    origin: Origin

    @property
    def deformation_m(self) -> float:
        """Deformation between the two forces."""
        return (self.to_n - self.from_n) * math.exp(-self.ln_value)


Ask = Callable[[float, float], Measured]
"""(from_n, to_n) → the quantity of a run between these forces."""


def at_common_forces(
    ranges: Sequence[tuple[float, float]], ask: Sequence[Ask]
) -> tuple[Measured, ...]:
    """Evaluate the quantity of every run between forces that all of them have.

    Args:
        ranges: the forces (from_n, to_n) between which each run has its quantity.
        ask: for each run, the function that evaluates it between two forces.

    Raises:
        DomainError: there is no range in common.
    """
    low = max(low for low, _ in ranges)
    top = min(top for _, top in ranges)
    if not low < top:
        raise DomainError(
            f"the runs have no forces in common: one begins at {low:g} N, one ends at {top:g} N"
        )
    return tuple(each(low, top) for each in ask)
