"""Verdicts, and reasons that carry value, limit, unit and a remedy."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class PlanVerdict(StrEnum):
    """Whether a plan may run."""

    GO = "go"
    WARN = "warn"
    REFUSED = "refused"


class Severity(StrEnum):
    """How much a reason weighs; a note does not change the verdict."""

    REFUSE = "refuse"
    WARN = "warn"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Reason:
    """One reason for a verdict.

    Attributes:
        code: stable name; programs branch on it.
        severity: how much it weighs.
        message: the fact with its numbers, in at most 25 words.
        remedy: what this lab can do with this rig, in at most 20 words; "" where nothing would.
        value, limit, unit: the numbers (NaN where there is none).
        cost: share of the result, or of the force, that it costs; the largest is shown first.
        key: of the plan that the remedy changes; "" where it changes none.
    """

    code: str
    severity: Severity
    message: str
    remedy: str = ""
    value: float = float("nan")
    limit: float = float("nan")
    unit: str = ""
    cost: float = 0.0
    key: str = ""


def verdict_of(reasons: Iterable[Reason]) -> PlanVerdict:
    """The verdict by the most severe reason."""
    severities = {reason.severity for reason in reasons}
    if Severity.REFUSE in severities:
        return PlanVerdict.REFUSED
    return PlanVerdict.WARN if Severity.WARN in severities else PlanVerdict.GO


def findings(reasons: Iterable[Reason]) -> list[Reason]:
    """The reasons that decide the verdict: refusals as they come, else what costs most first."""
    reasons = tuple(reasons)
    warnings = [each for each in reasons if each.severity is Severity.WARN]
    refusals = [each for each in reasons if each.severity is Severity.REFUSE]
    return refusals or sorted(warnings, key=lambda each: -each.cost)
