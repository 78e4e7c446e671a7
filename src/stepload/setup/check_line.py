"""One finding of the doctor: its mark, value, limit and remedy."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from stepload.report.model import Finding
from stepload.units import format_quantity


class Mark(StrEnum):
    """Verdict of one line."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class CheckLine:
    """What was looked at, what was found, what would be right, what to do.

    `value` and `limit` are in `unit` (NaN where a number says nothing).
    """

    name: str
    mark: Mark
    value: float
    limit: float
    unit: str
    message: str
    remedy: str = ""

    @property
    def finding(self) -> Finding:
        """The same for people; a remedy only where something is to be done."""
        value, limit = _shown(self.value, self.unit), _shown(self.limit, self.unit)
        figures = f" {value}" if value else ""
        figures += f" (limit {limit})" if limit else ""
        remedy = self.remedy if self.mark in (Mark.WARN, Mark.FAIL) else ""
        return Finding(self.mark, f"{self.name}:{figures} {self.message}", remedy)


def _shown(value: float, unit: str) -> str:
    if value != value:
        return ""
    if unit:
        return format_quantity(value, unit)
    return f"{value:.6g}" if float(value).is_integer() else f"{value:.3g}"


def graded(
    name: str,
    value: float,
    unit: str,
    *,
    warn: float,
    fail: float,
    message: str,
    remedy: str = "",
) -> CheckLine:
    """A line that is ok up to `warn` and fails above `fail`; NaN fails."""
    if value <= warn:
        return CheckLine(name, Mark.OK, value, warn, unit, message)
    mark = Mark.WARN if value <= fail else Mark.FAIL
    return CheckLine(name, mark, value, warn if mark is Mark.WARN else fail, unit, message, remedy)


def without_number(
    name: str, mark: Mark, message: str, remedy: str = "", unit: str = ""
) -> CheckLine:
    """A line about what no number tells, or in `unit` none could be measured."""
    return CheckLine(name, mark, math.nan, math.nan, unit, message, remedy)
