"""How the uncertainty of F_c enters a plan: its lower end that counts, and what was assumed."""

from __future__ import annotations

from collections.abc import Iterator
from statistics import NormalDist

from stepload.envelope.reason import Reason, Severity
from stepload.envelope.theory import CountedLimit, Theory
from stepload.units import format_quantity


def risk(counted: CountedLimit) -> str:
    """The probability, in words, that the limit is below its lower end.

    Where several bodies may yield first it is that of all together; `limit_coverage` is that of one
    alone.
    """
    alone = NormalDist().cdf(-counted.coverage)
    if counted.probability <= 1.01 * alone:
        return f"{counted.probability:.2g}"
    return f"{counted.probability:.2g} (of both bodies together; {alone:.2g} of one alone)"


def counted_on(counted: CountedLimit) -> str:
    """One sentence: F_c, how well it is known, what is counted on and with what risk."""
    value = f"F_c = {format_quantity(counted.value_n, 'N')}, {counted.equation}"
    if counted.sigma_ln == 0.0:
        return f"{value}: a person answers for it, it is counted on as it stands"
    return (
        f"{value}, is known to {counted.sigma_ln:.1%} (standard uncertainty of ln F_c):"
        f" its lower end at {counted.coverage:g} standard uncertainties counts,"
        f" {format_quantity(counted.lower_n, 'N')}; the payload yields below that with a"
        f" probability of {risk(counted)}"
    )


def limit_reasons(theory: Theory) -> Iterator[Reason]:
    """A note where an uncertainty was assumed because the plan states none."""
    counted = theory.counted
    assumed = [source for source in counted.sources if source.assumed]
    if not assumed:
        return
    most = max(assumed, key=lambda source: source.sigma_ln)
    listed = ", ".join(f"{source.what} {source.shown}" for source in assumed)
    yield Reason(
        "limit_assumed", Severity.NOTE,
        f"F_c = {format_quantity(counted.value_n, 'N')}, of which"
        f" {format_quantity(counted.lower_n, 'N')} count: it is known to {counted.sigma_ln:.1%}, of"
        f" which the plan does not say all; assumed, as of handbook values: {listed}",
        "write the standard uncertainty behind each number where you know it (as in"
        f" `yield_strength: 70 MPa ± 5 %`); most comes from {most.what}",
        counted.lower_n, counted.value_n, "N",
    )  # fmt: skip
