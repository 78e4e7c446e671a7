"""One finding of the doctor, and what they come to."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from stepload.units import format_quantity


class Mark(StrEnum):
    """Verdict of one line."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class Line:
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
    def shown_value(self) -> str:
        """`value` as people write it."""
        return _shown(self.value, self.unit)

    @property
    def shown_limit(self) -> str:
        """`limit` as people write it."""
        return _shown(self.limit, self.unit)


def _shown(value: float, unit: str) -> str:
    if value != value:
        return ""
    return format_quantity(value, unit) if unit else f"{value:.6g}"


def graded(
    name: str,
    value: float,
    unit: str,
    *,
    warn: float,
    fail: float,
    message: str,
    remedy: str = "",
) -> Line:
    """A line that is ok up to `warn` and fails above `fail`; NaN fails."""
    if value <= warn:
        return Line(name, Mark.OK, value, warn, unit, message)
    mark = Mark.WARN if value <= fail else Mark.FAIL
    return Line(name, mark, value, warn if mark is Mark.WARN else fail, unit, message, remedy)


def skipped(name: str, why: str) -> Line:
    """A line that was not looked at."""
    return Line(name, Mark.SKIPPED, float("nan"), float("nan"), "", why)
