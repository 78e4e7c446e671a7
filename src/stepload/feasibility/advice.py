"""Remedies that were tried: each is put into the plan, and the plan is judged again.

The judge is passed in; it gives no advice about the plans that are tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from stepload.errors import DomainError, RefusedError
from stepload.feasibility.changes import FAMILIES, Change, Family
from stepload.feasibility.reason import Reason, Severity
from stepload.plan.checks import can_be
from stepload.plan.model import Plan

Judge = Callable[[Plan], tuple[Reason, ...]]
"""Every reason for and against a plan; raises where there is no preflight at all."""
MOST_TRIALS = 200
"""Plans judged in the search for so many changes that lift every refusal."""
MOST_TOGETHER = 3
NONE_HELPS = "no setting of this rig that was tried lifts this"

Way = tuple[Change, ...]
"""Changes that are made one after the other."""


def advised(plan: Plan, reasons: tuple[Reason, ...], judge: Judge) -> tuple[Reason, ...]:
    """The reasons with remedies that were tried.

    Refusals have one remedy in common: the fewest changes, up to `MOST_TOGETHER`, that lift all.
    Refusals that no change is known for are left as they are.
    """
    way = _fewest(plan, reasons, judge)

    def remedied(reason: Reason) -> Reason:
        if reason.code not in FAMILIES or reason.severity is Severity.NOTE:
            return reason
        if reason.severity is Severity.REFUSE:
            return _with_remedy(reason, way)
        change = lifting(plan, reason, reasons, judge)
        return _with_remedy(reason, () if change is None else (change,))

    return tuple(remedied(reason) for reason in reasons)


def _with_remedy(reason: Reason, changes: Way) -> Reason:
    if not changes:
        return replace(reason, remedy=NONE_HELPS)
    remedy = ", and ".join(change.text for change in changes)
    return replace(reason, remedy=remedy, key=changes[0].key)


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


def _fewest(plan: Plan, reasons: tuple[Reason, ...], judge: Judge) -> Way:
    """The fewest changes that lift every refusal; none where none do.

    They lift the refusals one after the other, the mildest first. None changes a key again: a force
    that was lowered is not raised.
    """
    left = _codes(reasons) - FAMILIES.keys()

    def way(
        plan: Plan, reasons: tuple[Reason, ...], depth: int, used: tuple[Family | str, ...]
    ) -> Way | None:
        refusals = [each for each in reasons if each.severity is Severity.REFUSE]
        refusal = next((each for each in refusals if each.code not in left), None)
        if refusal is None:
            return ()
        families = FAMILIES.get(refusal.code, ()) if depth > 0 else ()
        for family in (family for family in families if family not in used):
            for change in family(plan, refusal):
                if change.key and change.key in used:
                    break
                if next(trials, None) is None:
                    return None
                changed = change.make()
                after = _judged(changed, judge)
                if after is None or refusal.code in _codes(after):
                    continue
                rest = way(changed, after, depth - 1, (*used, family, change.key))
                if rest is not None:
                    return (change, *rest)
        return None

    for depth in range(1, MOST_TOGETHER + 1):
        trials = iter(range(MOST_TRIALS))
        found = way(plan, reasons, depth, ())
        if found is not None:
            return found
    return ()


def _judged(plan: Plan, judge: Judge) -> tuple[Reason, ...] | None:
    """The reasons of a changed plan; None where it could not be read or has no preflight."""
    try:
        return judge(plan) if can_be(plan) else None
    except (RefusedError, DomainError, ArithmeticError):
        return None


def _codes(reasons: Iterable[Reason], severity: Severity = Severity.REFUSE) -> set[str]:
    return {reason.code for reason in reasons if reason.severity is severity}
