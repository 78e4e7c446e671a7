"""Remedies that were tried: each is put into the plan, and the plan is judged again.

The judge is passed in; it gives no advice about the plans that are tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from stepload.envelope.changes import FAMILIES, Change, Family
from stepload.envelope.reason import Reason, Severity
from stepload.errors import DomainError, RefusedError
from stepload.plan.changed import can_be
from stepload.plan.model import Plan

Judge = Callable[[Plan], tuple[Reason, ...]]
"""Every reason for and against a plan; raises where there is no envelope at all."""
MOST_TRIALS = 80
"""Plans judged in the search for changes that lift every refusal."""
MOST_TOGETHER = 3
NONE_HELPS = "no setting of this rig that was tried lifts this"

Way = tuple[tuple[str, Change], ...]
"""Changes that are made one after the other, each with the code of the refusal that it lifts."""


def advised(plan: Plan, reasons: tuple[Reason, ...], judge: Judge) -> tuple[Reason, ...]:
    """The reasons with remedies that were tried.

    Those of refusals lift all of them together, where up to `MOST_TOGETHER` changes do.
    """
    way = _Search(judge).way(plan, reasons, MOST_TOGETHER, ()) or ()
    return tuple(
        _with_remedy(reason, _changes_for(plan, reason, reasons, judge, way))
        if reason.code in FAMILIES and reason.severity is not Severity.NOTE
        else reason
        for reason in reasons
    )


def _with_remedy(reason: Reason, changes: list[Change]) -> Reason:
    if not changes:
        return replace(reason, remedy=NONE_HELPS)
    remedy = ", and ".join(change.text for change in changes)
    return replace(reason, remedy=remedy, key=changes[0].key)


def _changes_for(
    plan: Plan, reason: Reason, reasons: tuple[Reason, ...], judge: Judge, way: Way
) -> list[Change]:
    """The part of the way that lifts a refusal, and what that brings; else one change for it."""
    refused = _codes(reasons)
    if reason.severity is Severity.REFUSE and way:
        codes = [code for code, _ in way]
        if reason.code not in codes:  # lifted by what lifts another one
            return [way[0][1]]
        at = codes.index(reason.code)
        others = {codes.index(code) for code in refused if code in codes}  # where each first is
        end = min((i for i in others if i > at), default=len(way))
        return [change for _, change in way[at:end]]
    change = lifting(plan, reason, reasons, judge)
    return [] if change is None else [change]


def lifting(plan: Plan, reason: Reason, reasons: tuple[Reason, ...], judge: Judge) -> Change | None:
    """The mildest change that lifts a reason and brings no refusal and no warning."""
    before = _codes(reasons) | _codes(reasons, Severity.WARN)
    for family in FAMILIES.get(reason.code, ()):
        for change in family(plan, reason):
            after = _judged(change.make(), judge)
            if after is None:
                continue
            brought = _codes(after) | _codes(after, Severity.WARN)
            if reason.code not in brought and brought <= before:
                return change
    return None


class _Search:
    """Looks for changes that lift every refusal one after the other, the mildest first."""

    def __init__(self, judge: Judge) -> None:
        self._judge = judge
        self._trials = MOST_TRIALS

    def way(
        self, plan: Plan, reasons: tuple[Reason, ...], depth: int, used: tuple[Family | str, ...]
    ) -> Way | None:
        """The changes from here on; None where there are none, or too many to try.

        None changes a key again: a force that was lowered is not raised.
        """
        refusal = next((r for r in reasons if r.severity is Severity.REFUSE), None)
        if refusal is None:
            return ()
        families = FAMILIES.get(refusal.code, ()) if depth > 0 else ()
        for family in (family for family in families if family not in used):
            for change in family(plan, refusal):
                if self._trials <= 0:
                    return None
                if change.key and change.key in used:
                    break
                self._trials -= 1
                changed = change.make()
                after = _judged(changed, self._judge)
                if after is None or refusal.code in _codes(after):
                    continue
                rest = self.way(changed, after, depth - 1, (*used, family, change.key))
                if rest is not None:
                    return ((refusal.code, change), *rest)
        return None


def _judged(plan: Plan, judge: Judge) -> tuple[Reason, ...] | None:
    """The reasons of a changed plan; None where it could not be read or has no envelope."""
    try:
        return judge(plan) if can_be(plan) else None
    except (RefusedError, DomainError, ArithmeticError):
        return None


def _codes(reasons: Iterable[Reason], severity: Severity = Severity.REFUSE) -> set[str]:
    return {reason.code for reason in reasons if reason.severity is severity}
