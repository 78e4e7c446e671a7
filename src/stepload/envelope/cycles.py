"""What a plan of too few cycles, or without stepped unloading, cannot show; notes, no refusals."""

from __future__ import annotations

from collections.abc import Iterator

from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import Plan

WHOLE = 2
"""A first loading and one more of the same contact: the least that reveals set and drift."""


def cycle_reasons(plan: Plan) -> Iterator[Reason]:
    """What repeated loading would have shown and this plan does not."""
    procedure = plan.procedure
    if procedure.cycles < WHOLE:
        hint = (
            "only the gap between loading and unloading hints at them"
            if procedure.unload
            else "without stepped unloading nothing in the run hints at them"
        )
        yield Reason(
            "one_cycle", Severity.NOTE,
            f"one cycle: set, creep and drift cannot be told from the contact's law; {hint}",
            "plan `cycles: 2` with `unload: true`", procedure.cycles, WHOLE, "",
        )  # fmt: skip
    elif not procedure.unload:
        yield Reason(
            "no_unloading",
            Severity.NOTE,
            "no holds on the way down: the second loading shows set and drift, but creep cannot "
            "be told from them",
            "plan `unload: true`",
        )
