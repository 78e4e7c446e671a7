"""Observed share of an event, with the confidence interval of its probability."""

from __future__ import annotations

from dataclasses import dataclass

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Share:
    """`count` of `of`, with the ends of the 95 % interval (Clopper and Pearson)."""

    count: int
    of: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """The share; NaN of none."""
        return self.count / self.of if self.of else float("nan")

    @property
    def text(self) -> str:
        """The share and its interval in words."""
        return f"{self.value:.0%} ({self.low:.0%} to {self.high:.0%})"

    def columns(self, name: str) -> dict[str, float]:
        """The share and its interval as columns that begin with `name`."""
        return {name: self.value, f"{name}_low": self.low, f"{name}_high": self.high}


def share(count: int, of: int) -> Share:
    """The share of `count` in `of`; with `of` 0 the interval is 0 to 1."""
    from scipy.special import betaincinv

    tail = (1.0 - CONFIDENCE) / 2.0
    low = float(betaincinv(count, of - count + 1, tail)) if count else 0.0
    high = float(betaincinv(count + 1, of - count, 1.0 - tail)) if count < of else 1.0
    return Share(count, of, low, high)
