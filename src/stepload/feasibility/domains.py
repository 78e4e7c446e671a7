"""Limits of contact theory for a payload at the forces that are used; before and after a run."""

from __future__ import annotations

from collections.abc import Iterator

from stepload.contact.power_law import ContactLaw
from stepload.contact.validity import DomainDoubt, Pressed, domain_doubts
from stepload.feasibility.predicted import body_left_out
from stepload.feasibility.reason import Reason, Severity
from stepload.feasibility.theory import ENDS, Theory
from stepload.plan.model import Payload, Plan
from stepload.units import format_quantity

LOWEST_SHARE = 0.1
"""A result uses forces from this share of the highest one on."""
_OF_THE_LADDER = ("above_elastic_limit", "within_doubt_of_limit")
"""Codes that are left out before a run, since the ladder of forces reports them already."""


def payload_doubts(
    payload: Payload, theory: Theory, from_n: float, to_n: float
) -> tuple[DomainDoubt, ...]:
    """Doubts about theory for this payload at these forces in N, planned or reached.

    Of a payload that is known as a range only both ends are checked, and each doubt is reported
    where it is worse.

    Raises:
        DomainError: a number outside the domain of contact theory.
    """
    found: dict[str, DomainDoubt] = {}
    body = body_left_out(payload, theory.law)
    for end in ENDS if theory.is_range else ENDS[:1]:
        for doubt in domain_doubts(
            Pressed(
                payload.geometry,
                end(payload.material),
                end(payload.plate),
                from_n,
                to_n,
                roughness_m=payload.roughness_m,
                micro_hardness_pa=payload.micro_hardness_pa,
                height_m=payload.height_m,
                used_limit_n=theory.counted.lower_n,
                body=body,
            )
        ):
            before = found.setdefault(doubt.code, doubt)
            if abs(doubt.value - doubt.limit) > abs(before.value - before.limit):
                found[doubt.code] = doubt
    return tuple(found.values())


def domain_reasons(plan: Plan, theory: Theory) -> Iterator[Reason]:
    """Doubts about theory at the forces of a plan.

    A law that means nothing at the top force refuses: distances and speeds of the run follow from
    it. Where another law describes what the smooth one leaves out, it is a note.
    """
    top_n = plan.procedure.top_force_n
    for doubt in payload_doubts(plan.payload, theory, LOWEST_SHARE * top_n, top_n):
        if doubt.code in _OF_THE_LADDER:
            continue
        severity = Severity.NOTE if doubt.harmless else Severity.WARN
        yield Reason(
            doubt.code,
            Severity.REFUSE if doubt.impossible else severity,
            doubt.message,
            doubt.remedy,
            doubt.value,
            doubt.limit,
            doubt.unit,
            cost=0.1 * abs(doubt.value / doubt.limit - 1.0) if doubt.limit else 0.0,
            key="procedure.top_force",
        )


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
