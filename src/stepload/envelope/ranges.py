"""What preflight says of a payload whose material is known as a range only."""

from __future__ import annotations

from collections.abc import Iterator

from stepload.envelope.reason import Reason, Severity
from stepload.envelope.theory import Theory
from stepload.plan.model import Plan
from stepload.units import format_quantity


def range_reasons(plan: Plan, theory: Theory) -> Iterator[Reason]:
    """A note that the bounds hold from the softest to the stiffest end, and what that costs."""
    if not theory.is_range:
        return
    top_n = plan.procedure.top_force_n
    low, high = (law.secant(top_n) for law in (theory.softest, theory.stiffest))
    yield Reason(
        "stiffness_range", Severity.NOTE,
        f"the material is known as a range only: the payload may have a secant stiffness from"
        f" {format_quantity(low, 'N/m')} to {format_quantity(high, 'N/m')} at the top force. Speeds"
        " hold for the stiffest, answers and distances for the softest; the result is compared"
        " with no theory",
        "narrow the range where you know more; a first run at a small force does",
        high / low, 1.0, "",
    )  # fmt: skip
