"""Remedies that were tried: each is put into the plan, and the plan is judged again.

A remedy that does not lift its refusal or its warning, or that causes another refusal, is not
listed. The judge is passed in; it gives no advice about the plans that are tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from stepload.envelope.changes import FAMILIES, Change, Family
from stepload.envelope.reason import Reason, Severity
from stepload.errors import DomainError, RefusedError
from stepload.plan.changed import can_be
from stepload.plan.model import Plan

Judge = Callable[[Plan], tuple[Reason, ...]]
"""Every reason for and against a plan; raises where there is no envelope at all."""
MOST_TRIALS = 40
"""Plans judged in the search for changes that help together."""
MOST_TOGETHER = 3
NONE_HELPS = "no single change of plan or rig that was tried lifts this"
TOGETHER = "changes_together"


@dataclass(frozen=True, slots=True)
class Remedy:
    """A change that was tried and lifts its reason; `warnings` are those that it brings."""

    change: Change
    warnings: tuple[str, ...]

    @property
    def text(self) -> str:
        """What to do, and what it costs."""
        word = "warning" if len(self.warnings) == 1 else "warnings"
        cost = f" (it brings the {word} {', '.join(self.warnings)})" if self.warnings else ""
        return f"{self.change.text}{cost}"


def advised(plan: Plan, reasons: tuple[Reason, ...], judge: Judge) -> tuple[Reason, ...]:
    """The reasons with remedies that were tried, and one more where changes must be combined."""
    found = tuple(
        replace(reason, remedy=_told(remedies_for(plan, reason, reasons, judge)))
        if reason.code in FAMILIES and reason.severity is not Severity.NOTE
        else reason
        for reason in reasons
    )
    return (*found, *_joined(plan, reasons, found, judge))


def remedies_for(
    plan: Plan, reason: Reason, reasons: tuple[Reason, ...], judge: Judge
) -> tuple[Remedy, ...]:
    """The mildest change of each family that lifts a reason and causes no other refusal.

    One that brings no warning is preferred to a milder one that does.
    """
    found = []
    for family in FAMILIES.get(reason.code, ()):
        lifting = list(_lifting(plan, reason, reasons, family, judge))
        if lifting:
            found.append(lifting[-1] if not lifting[-1].warnings else lifting[0])
    return tuple(found)


def _lifting(
    plan: Plan, reason: Reason, reasons: tuple[Reason, ...], family: Family, judge: Judge
) -> Iterator[Remedy]:
    """Changes of a family that lift a reason, up to the first that brings no warning."""
    for change in family(plan, reason):
        after = _judged(change.make(), judge)
        if after is None or reason.code in _codes(after) | _codes(after, Severity.WARN):
            continue
        if _codes(after) - _codes(reasons):
            continue
        warnings = _codes(after, Severity.WARN) - _codes(reasons, Severity.WARN)
        yield Remedy(change, tuple(sorted(warnings)))
        if not warnings:
            return


def _told(remedies: tuple[Remedy, ...]) -> str:
    return "; or ".join(remedy.text for remedy in remedies) or NONE_HELPS


def _joined(
    plan: Plan, reasons: tuple[Reason, ...], told: tuple[Reason, ...], judge: Judge
) -> Iterator[Reason]:
    """A note on changes that lift every refusal together, where no single change does."""
    refused = [reason for reason in told if reason.severity is Severity.REFUSE]
    if not refused or (len(refused) == 1 and refused[0].remedy != NONE_HELPS):
        return
    for share in (0.5, 1.0):
        search = _Search(judge, share, MOST_TRIALS)
        if changes := search.through(plan, reasons, MOST_TOGETHER, ()):
            listed = "; ".join(change.text for change in changes)
            yield Reason(
                TOGETHER, Severity.NOTE, f"together these changes lift every refusal: {listed}"
            )
            return
    yield Reason(
        TOGETHER, Severity.NOTE,
        f"up to {MOST_TOGETHER} changes together were tried, and none lift every refusal",
        "take another payload, another rig, or both",
    )  # fmt: skip


class _Search:
    """Looks for changes that lift every refusal one after the other.

    `share` says how strong a change of each family is tried: 1 the strongest.
    """

    def __init__(self, judge: Judge, share: float, trials: int) -> None:
        self._judge = judge
        self._share = share
        self._trials = trials

    def through(
        self, plan: Plan, reasons: tuple[Reason, ...], depth: int, used: tuple[Family, ...]
    ) -> tuple[Change, ...] | None:
        """The changes from here on; None where there are none, or too many to try."""
        refusal = next((r for r in reasons if r.severity is Severity.REFUSE), None)
        if refusal is None:
            return ()
        families = FAMILIES.get(refusal.code, ()) if depth > 0 else ()
        for family in (family for family in families if family not in used):
            changes = list(family(plan, refusal))
            if not changes or self._trials <= 0:
                continue
            change = changes[round(self._share * (len(changes) - 1))]
            self._trials -= 1
            changed = change.make()
            after = _judged(changed, self._judge)
            if after is None:
                continue
            rest = self.through(changed, after, depth - 1, (*used, family))
            if rest is not None:
                return (change, *rest)
        return None


def _judged(plan: Plan, judge: Judge) -> tuple[Reason, ...] | None:
    """The reasons of a changed plan; None where it could not be read or has no envelope."""
    try:
        return judge(plan) if can_be(plan) else None
    except (RefusedError, DomainError, ArithmeticError):
        return None


def _codes(reasons: Iterable[Reason], severity: Severity = Severity.REFUSE) -> set[str]:
    return {reason.code for reason in reasons if reason.severity is severity}
