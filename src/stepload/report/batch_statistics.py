"""Statistics of a series of specimens: mean, trend, control chart, outliers, gauge R&R, capability.

Values are in the order of measurement. Each is checked against the published example of its source:
NIST/SEMATECH e-Handbook 1.3.5.17 (outliers), 6.1.6 (capability), 6.3.2.2 (individuals chart); AIAG
Measurement Systems Analysis, 4th edition (gauge R&R by analysis of variance).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc, ndtri, stdtrit

from stepload.identification.fit import FloatArray

IntArray = NDArray[np.int64]
CONFIDENCE = 0.95
D2, D4 = 1.128, 3.267
"""Mean of the range of two values over their σ, and upper limit of that range over its mean."""
ZONES = {"WE2": (2.0, 2, 3), "WE3": (1.0, 4, 5), "WE4": (0.0, 8, 8)}
"""Western Electric rules: beyond so many σ on one side, so many of so many successive points."""
MEANINGS = {
    "WE1": "beyond 3 σ",
    "WE2": "two of three beyond 2 σ on one side",
    "WE3": "four of five beyond 1 σ on one side",
    "WE4": "eight in a row on one side",
    "MR": "moving range above its limit",
    "ESD": "outlier by the generalised ESD test at 5 %",
}
MANY = 15
"""Values from which the ESD test may look for several outliers; with fewer it is Grubbs' test."""
POOLED_FROM = 0.25
"""Probability above which the interaction counts as repeatability (AIAG)."""
SIGMAS = 6.0
"""Width of a process or of a tolerance in standard deviations (AIAG, ISO 22514)."""


def student(degrees: float) -> float:
    """Student's factor of the two-sided 95 % interval."""
    return float(stdtrit(degrees, 0.5 + 0.5 * CONFIDENCE))


@dataclass(frozen=True, slots=True)
class Trend:
    """Straight line over the order; `rank_p` is that of Kendall's rank correlation with it."""

    slope: float
    interval: tuple[float, float]
    p: float
    rank_p: float

    @property
    def found(self) -> bool:
        """Whether the rank test sees a trend."""
        return self.rank_p < 1.0 - CONFIDENCE


def trend(values: FloatArray) -> Trend | None:
    """The trend of `values` (N,) over their order; None for fewer than four."""
    from scipy.stats import kendalltau, linregress

    n = values.size
    if n < 4 or not np.ptp(values) > 0.0:
        return None
    line, rank = linregress(np.arange(n), values), kendalltau(np.arange(n), values)
    half = student(n - 2) * line.stderr
    return Trend(
        float(line.slope), (float(line.slope - half), float(line.slope + half)),
        float(line.pvalue), float(rank.pvalue),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Chart:
    """Individuals and moving-range chart; `broken` (N,) are the rules that each point breaks."""

    centre: float
    low: float
    high: float
    mean_range: float
    range_high: float
    broken: tuple[tuple[str, ...], ...]

    @property
    def sigma(self) -> float:
        """Short-term standard deviation."""
        return self.mean_range / D2


def chart(values: FloatArray) -> Chart | None:
    """The control chart of `values` (N,); None for fewer than two, or if all are equal."""
    ranges = np.abs(np.diff(values))
    if not ranges.size or not ranges.max() > 0.0:
        return None
    centre, mean_range = float(values.mean()), float(ranges.mean())
    z = (values - centre) * D2 / mean_range
    broken: list[list[str]] = [["WE1"] if abs(each) > 3.0 else [] for each in z]
    for rule, (beyond, least, among) in ZONES.items():
        for at in range(least - 1, z.size):
            side = math.copysign(1.0, z[at])
            window = side * z[max(0, at + 1 - among) : at + 1] > beyond
            if window[-1] and window.sum() >= least:
                broken[at].append(rule)
    for at in np.flatnonzero(ranges > D4 * mean_range):
        broken[at + 1].append("MR")
    half = 3.0 * mean_range / D2
    return Chart(
        centre, centre - half, centre + half, mean_range, D4 * mean_range,
        tuple(map(tuple, broken)),
    )  # fmt: skip


def outliers(values: FloatArray, most: int | None = None) -> list[int]:
    """Places of the outliers in `values` (N,) by Rosner's generalised ESD test at 5 %.

    Args:
        most: how many it looks for; None: a fifth of them, one where they are few.
    """
    n, left = values.size, np.arange(values.size)
    most = most or (n // 5 if n >= MANY else 1)
    taken: list[int] = []
    count = 0
    for i in range(1, min(most, n - 2) + 1):
        kept = values[left]
        sigma = kept.std(ddof=1)
        if not sigma > 0.0:
            break
        away = np.abs(kept - kept.mean())
        farthest = int(away.argmax())
        taken.append(int(left[farthest]))
        if away[farthest] / sigma > esd_limit(n, i):
            count = i
        left = np.delete(left, farthest)
    return sorted(taken[:count])


def esd_limit(n: int, i: int) -> float:
    """Critical value of the i-th studentised deviate of n values."""
    t = float(stdtrit(n - i - 1, 1.0 - (1.0 - CONFIDENCE) / (2.0 * (n - i + 1))))
    return (n - i) * t / math.sqrt((n - i - 1 + t**2) * (n - i + 1))


@dataclass(frozen=True, slots=True)
class Source:
    """One line of an analysis of variance; `f` and `p` NaN where it is not tested."""

    name: str
    degrees: int
    squares: float
    f: float = math.nan
    p: float = math.nan

    @property
    def mean_square(self) -> float:
        return self.squares / self.degrees if self.degrees else math.nan

    def over(self, error: Source) -> Source:
        """Tested against another line."""
        if not (self.degrees and error.mean_square > 0.0):
            return self
        f = self.mean_square / error.mean_square
        return Source(
            self.name, self.degrees, self.squares, f, float(fdtrc(self.degrees, error.degrees, f))
        )


@dataclass(frozen=True, slots=True)
class Gauge:
    """Gauge R&R by AIAG's names: standard deviations; AV and `interaction` NaN for one operator.

    `sources` are the analysis of variance before pooling.
    """

    parts: int
    operators: int
    trials: int
    sources: tuple[Source, ...]
    pooled: bool
    ev: float
    av: float
    interaction: float
    pv: float

    @property
    def grr(self) -> float:
        return math.hypot(self.ev, np.nan_to_num(self.av), np.nan_to_num(self.interaction))

    @property
    def tv(self) -> float:
        return math.hypot(self.grr, self.pv)

    @property
    def ndc(self) -> int:
        """Number of distinct categories, as AIAG truncates it."""
        return int(math.sqrt(2.0) * self.pv / self.grr) if self.grr > 0.0 else 0

    def share(self, sigma: float) -> float:
        """Share of the study variation."""
        return sigma / self.tv if self.tv > 0.0 else math.nan


def gauge(values: FloatArray) -> Gauge:
    """Gauge R&R of a crossed study; `values` (parts, operators, trials), two parts and trials."""
    p, o, r = values.shape
    whole, cells = values.mean(), values.mean(axis=2)
    of_parts, of_operators = cells.mean(axis=1), cells.mean(axis=0)
    crossed = cells - of_parts[:, None] - of_operators[None, :] + whole
    repeats = Source("repeatability", p * o * (r - 1), _squares(values - cells[:, :, None]))
    both = Source("interaction", (p - 1) * (o - 1), r * _squares(crossed)).over(repeats)
    pooled = not both.p <= POOLED_FROM
    error = both
    if pooled:
        error = Source("", both.degrees + repeats.degrees, both.squares + repeats.squares)
    part = Source("part", p - 1, o * r * _squares(of_parts - whole))
    operator = Source("operator", o - 1, p * r * _squares(of_operators - whole))
    tests = both if both.degrees else repeats

    def sigma(one: Source, other: Source, count: int) -> float:
        return math.sqrt(max(one.mean_square - other.mean_square, 0.0) / count)

    several = o > 1
    return Gauge(
        p, o, r, (part.over(tests), operator.over(tests), both, repeats), pooled,
        ev=math.sqrt(error.mean_square if pooled else repeats.mean_square),
        av=sigma(operator, error, p * r) if several else math.nan,
        interaction=(0.0 if pooled else sigma(both, repeats, r)) if several else math.nan,
        pv=sigma(part, error, o * r),
    )  # fmt: skip


def _squares(values: FloatArray) -> float:
    return float(np.sum(values**2))


@dataclass(frozen=True, slots=True)
class Capability:
    """Capability (σ short-term) and performance (s of all) indices of ISO 22514-2.

    NaN where a limit that they need is not stated; `ppk_interval` is the 95 % interval of Ppk.
    """

    cp: float
    cpk: float
    pp: float
    ppk: float
    ppk_interval: tuple[float, float]


def capability(
    values: FloatArray, low: float | None, high: float | None, sigma: float
) -> Capability:
    """Indices of `values` (N,) against limits; `sigma` is the short-term standard deviation."""
    mean, s, n = float(values.mean()), float(values.std(ddof=1)), values.size
    width = math.nan if low is None or high is None else high - low
    near = min(
        math.inf if high is None else high - mean, math.inf if low is None else mean - low
    )  # fmt: skip
    ppk = near / (3.0 * s)
    half = float(ndtri(0.5 + 0.5 * CONFIDENCE)) * math.sqrt(1 / (9 * n) + ppk**2 / (2 * (n - 1)))
    return Capability(
        width / (SIGMAS * sigma), near / (3.0 * sigma), width / (SIGMAS * s), ppk,
        (ppk - half, ppk + half),
    )  # fmt: skip
