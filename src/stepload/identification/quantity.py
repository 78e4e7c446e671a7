"""A figure with its interval, the lines of its budget, and its verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from stepload.identification.smooth import NORMAL_95
from stepload.units import beside_limit

NO_ERRORS = (
    "there is no interval and no K_max: the numbers have neither noise nor steps, so they do not "
    "tell how well they were measured; state --force-noise, --position-noise or --msde"
)


class ResultVerdict(StrEnum):
    """What the data have shown about the payload: the possible verdicts."""

    IDENTIFIED = "identified"
    MARGINAL = "marginal"
    NOT_IDENTIFIABLE = "not identifiable"


@dataclass(frozen=True, slots=True)
class Line:
    """One source of uncertainty: its size in words, its relative standard uncertainty."""

    source: str
    size: str
    relative: float


@dataclass(frozen=True, slots=True)
class Quantity:
    """One stiffness.

    Attributes:
        kind: "chord", "secant_from_touch", "secant_from_mean_plane", "tangent",
            "unloading_chord" or "reloading_chord".
        value_n_per_m: NaN where the data do not determine it.
        interval_n_per_m: nominal 95 %, (low, high).
        from_n, to_n: the forces between which it holds; `from_n` is 0 where the touch is one end.
        lines: contributions to the interval.
        why: whole sentences: why it is not identified, and what it rests on.
    """

    kind: str
    value_n_per_m: float
    interval_n_per_m: tuple[float, float]
    from_n: float
    to_n: float
    lines: tuple[Line, ...]
    verdict: ResultVerdict
    why: tuple[str, ...]

    @property
    def relative(self) -> float:
        """Relative standard uncertainty of all lines together."""
        return combined(self.lines)

    @property
    def half_width(self) -> float:
        """Half the interval as a share of the value."""
        low, high = self.interval_n_per_m
        return (high - low) / (2.0 * self.value_n_per_m)


@dataclass(frozen=True, slots=True)
class Exponent:
    """n of the power law, over the laws that the data cannot distinguish."""

    value: float
    interval: tuple[float, float]
    verdict: ResultVerdict
    why: tuple[str, ...]


def interval_said(half_width: float, t: float) -> str:
    """The sentence on a half width, a share of the figure, beside 1/t."""
    half, most = beside_limit(half_width, 1.0 / t)
    return f"the 95 % interval is ±{half}; up to ±{most} (1/t) counts as identified"


def combined(lines: Sequence[Line]) -> float:
    """Relative standard uncertainty of independent lines together."""
    return math.sqrt(sum(line.relative**2 for line in lines))


def log_interval(value: float, lines: Sequence[Line]) -> tuple[float, float]:
    """The 95 % interval of a positive figure from its lines, taken in the logarithm."""
    return wider(value, value, value, NORMAL_95 * combined(lines))


def wider(value: float, low: float, high: float, half: float) -> tuple[float, float]:
    """The interval about a positive figure, wider by an independent half width in the logarithm."""
    down, up = (min(math.hypot(math.log(end / value), half), 700.0) for end in (low, high))
    return value * math.exp(-down), value * math.exp(up)


def without_interval(quantity: Quantity) -> Quantity:
    """The same where nothing is known of the errors."""
    verdict, why = _unproven(quantity)
    return replace(quantity, interval_n_per_m=(0.0, math.inf), lines=(), verdict=verdict, why=why)


def exponent_without_interval(exponent: Exponent) -> Exponent:
    """The same where nothing is known of the errors."""
    verdict, why = _unproven(exponent)
    return replace(exponent, interval=(0.0, math.inf), verdict=verdict, why=why)


def _unproven(figure: Quantity | Exponent) -> tuple[ResultVerdict, tuple[str, ...]]:
    verdict = figure.verdict
    if verdict is ResultVerdict.IDENTIFIED:
        verdict = ResultVerdict.MARGINAL
    return verdict, (*figure.why, NO_ERRORS)
