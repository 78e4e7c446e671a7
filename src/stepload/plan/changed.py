"""Changes values of a plan as if it had been written and read with them."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from stepload.declaration.sections import UnknownError
from stepload.plan.checks_between import impossibilities_between
from stepload.plan.derived import RULES, follows
from stepload.plan.model import Plan


def rederived(before: Plan, after: Plan) -> Plan:
    """`after`, a changed `before`, with the values derived anew that were derived in `before`.

    Values that were changed themselves are kept.
    """
    for section, field, rule in RULES:
        if section and follows(before, section, field):
            part = getattr(after, section)
            if getattr(getattr(before, section), field) == getattr(part, field):
                with suppress(UnknownError):
                    part = replace(part, **{field: rule(after)})
                    after = replace(after, **{section: part})
    return after


def can_be(plan: Plan) -> bool:
    """Whether a plan would be read without a problem between its values."""
    procedure = plan.procedure
    return (
        procedure.surface_uncertainty_m <= procedure.surface_distance_m
        and procedure.search_distance_m >= 2.0 * procedure.surface_uncertainty_m
        and procedure.step_n <= procedure.top_force_n
        and next(impossibilities_between(plan), None) is None
    )
