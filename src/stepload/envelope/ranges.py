"""Reasons on a payload whose material is known as a range only: before a run, and after."""

from __future__ import annotations

from collections.abc import Iterator

from stepload.contact.power_law import ContactLaw
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
        f"The payload's secant may be {format_quantity(low, 'N/m')} to"
        f" {format_quantity(high, 'N/m')} at the top force; the result is compared with no theory.",
        "narrow the range where you know more, for example by a first run at a small force",
        high / low, 1.0, "",
    )  # fmt: skip


def beyond_range(
    theory: Theory, interval_n_per_m: tuple[float, float], from_n: float, to_n: float
) -> tuple[str, ...]:
    """Sentences on a measured chord stiffness that is outside the declared range."""
    if not theory.is_range:
        return ()
    low, high = interval_n_per_m
    least, most = (_chord(law, from_n, to_n) for law in (theory.softest, theory.stiffest))
    if low > most:
        return (
            f"the payload is stiffer than the stiffest that was declared ({_words(most)} between"
            " these forces): speeds and force budget of this run were made for a softer one; widen"
            " the range before it is pressed again",
        )
    if high < least:
        return (
            f"the payload is softer than the softest that was declared ({_words(least)} between"
            " these forces): the declared range is wrong, or more gives way than the payload",
        )
    return ()


def _chord(law: ContactLaw, from_n: float, to_n: float) -> float:
    return (to_n - from_n) / (law.deformation(to_n) - law.deformation(from_n))


def _words(stiffness_n_per_m: float) -> str:
    return format_quantity(stiffness_n_per_m, "N/m")
