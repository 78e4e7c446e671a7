"""Statistics of a series of specimens: trend, control chart, outliers, gauge R&R, capability.

Values are in the order of pressing. Each is checked against the published example of its source:
NIST/SEMATECH e-Handbook 1.3.5.17 (outliers), 6.1.6 (capability), 6.3.2.2 (individuals chart); AIAG
Measurement Systems Analysis, 4th edition (gauge R&R by analysis of variance).
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc, ndtri, stdtrit

from stepload.identification.fit import FloatArray
from stepload.report.identified import Pair
from stepload.report.rows import Row, figure, form

IntArray = NDArray[np.int64]
ALPHA = 0.05
"""Significance of every test and interval."""
D2, D4 = 1.128, 3.267
"""Mean of the range of two values over their σ, and upper limit of that range over its mean."""
ZONES = {"WE2": (2.0, 2, 3), "WE3": (1.0, 4, 5), "WE4": (0.0, 8, 8)}
"""Western Electric rules: beyond so many σ on one side, so many of so many successive points."""
MEANINGS = {
    "WE1": "beyond 3 σ",
    "WE2": "two of three beyond 2 σ on one side",
    "WE3": "four of five beyond 1 σ on one side",
    "WE4": "eight in a row on one side",
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
    return float(stdtrit(degrees, 1.0 - 0.5 * ALPHA))


class Trend(Row):
    """Straight line over the order of pressing."""

    slope: float = figure("Change from one specimen to the next, in N/m.")
    interval: Pair = figure("Its 95 % interval.")
    p: float = figure("Probability of such a slope without a trend.")
    rank_p: float = figure("The same by Kendall's rank correlation.")


def trend(values: FloatArray) -> Trend | None:
    """The trend of `values` (N,); None for fewer than four, or if all are equal."""
    from scipy.stats import kendalltau, linregress

    at = np.arange(values.size)
    if at.size < 4 or not np.ptp(values) > 0.0:
        return None
    line, rank_p = linregress(at, values), float(kendalltau(at, values).pvalue)
    slope, half = float(line.slope), student(at.size - 2) * float(line.stderr)
    ends = (slope - half, slope + half)
    return Trend(slope=slope, interval=ends, p=float(line.pvalue), rank_p=rank_p)


class Chart(Row):
    """Individuals and moving-range chart; all in N/m."""

    centre: float = figure("Centre line.")
    low: float = figure("Lower limit: the centre less 3 mean moving ranges over 1.128.")
    high: float = figure("Upper limit.")
    mean_range: float = figure("Mean moving range.")
    range_high: float = figure("Upper limit of the moving range: 3.267 times its mean.")
    sigma: float = figure("Short-term standard deviation: the mean moving range over 1.128.")
    broken: tuple[tuple[str, ...], ...] = figure("Western Electric rules that each point breaks.")
    jumps: tuple[int, ...] = figure("Points, from 2, whose moving range is above its limit.")


def chart(values: FloatArray) -> Chart | None:
    """The control chart of `values` (N,); None for fewer than two, or if all are equal."""
    ranges = np.abs(np.diff(values))
    if not ranges.size or not ranges.max() > 0.0:
        return None
    centre, mean_range = float(values.mean()), float(ranges.mean())
    sigma = mean_range / D2
    z = (values - centre) / sigma
    broken = [["WE1"] if abs(each) > 3.0 else [] for each in z]
    for rule, (beyond, least, among) in ZONES.items():
        for at in range(least - 1, z.size):
            window = math.copysign(1.0, z[at]) * z[max(0, at + 1 - among) : at + 1] > beyond
            if window[-1] and window.sum() >= least:
                broken[at].append(rule)
    jumps = np.flatnonzero(ranges > D4 * mean_range) + 2
    return Chart(
        centre=centre, low=centre - 3.0 * sigma, high=centre + 3.0 * sigma, mean_range=mean_range,
        range_high=D4 * mean_range, sigma=sigma, broken=tuple(map(tuple, broken)),
        jumps=tuple(map(int, jumps)),
    )  # fmt: skip


def outliers(values: FloatArray, most: int | None = None) -> list[int]:
    """Places of the outliers in `values` (N,) by Rosner's generalised ESD test at 5 %.

    Args:
        most: how many it looks for; None: a fifth of them, one where they are few.
    """
    n, left = values.size, np.arange(values.size)
    most = most or (n // 5 if n >= MANY else 1)
    taken, count = list[int](), 0
    for i in range(1, min(most, n - 2) + 1):
        away = np.abs(values[left] - values[left].mean())
        farthest = int(away.argmax())
        taken.append(int(left[farthest]))
        if away[farthest] > esd_limit(n, i) * values[left].std(ddof=1):
            count = i
        left = np.delete(left, farthest)
    return sorted(taken[:count])


def esd_limit(n: int, i: int) -> float:
    """Critical value of the i-th studentised deviate of n values."""
    t = float(stdtrit(n - i - 1, 1.0 - ALPHA / (2.0 * (n - i + 1))))
    return (n - i) * t / math.sqrt((n - i - 1 + t**2) * (n - i + 1))


class Source(Row):
    """One line of the analysis of variance, in N/m."""

    name: str = figure("Source.", "source")
    degrees: int = figure("Of freedom.", "degrees of freedom")
    squares: Annotated[float, form(".4g")] = figure("Sum of squares.", "sum of squares")
    mean_square: Annotated[float | None, form(".4g")] = figure("Mean square.", "mean square")
    f: Annotated[float | None, form(".3f")] = figure("F.", "F")
    p: Annotated[float | None, form(".3f")] = figure("Its probability by chance.", "p")


class Gauge(Row):
    """Gauge R&R by analysis of variance, AIAG MSA, 4th edition; standard deviations in N/m."""

    parts: int = figure("Specimens.")
    operators: int = figure("Operators.")
    trials: int = figure("Presses of each specimen by each operator.")
    pooled: bool = figure("Whether the interaction counts as repeatability: its p is above 0.25.")
    ev: float = figure("Repeatability.")
    av: float | None = figure("Reproducibility; null with one operator.")
    interaction: float | None = figure("Operator × specimen; null with one operator.")
    grr: float = figure("Repeatability and reproducibility.")
    pv: float = figure("Between specimens.")
    tv: float = figure("Total.")
    ndc: int = figure("Number of distinct categories, truncated.")
    sources: tuple[Source, ...] = figure("Analysis of variance, before pooling.")


def gauge(values: FloatArray) -> Gauge:
    """Gauge R&R of a crossed study; `values` (parts, operators, trials), two parts and trials."""
    p, o, r = values.shape
    whole, cells = values.mean(), values.mean(axis=2)
    part, operator = cells.mean(axis=1), cells.mean(axis=0)
    crossed = cells - part[:, None] - operator + whole
    effects = (part - whole, operator - whole, crossed, values - cells[:, :, None])
    degrees = (p - 1, o - 1, (p - 1) * (o - 1), p * o * (r - 1))
    squares = [
        float((x**2).sum()) * k for x, k in zip(effects, (o * r, p * r, r, 1), strict=True)
    ]  # fmt: skip
    means = [s / d if d else 0.0 for s, d in zip(squares, degrees, strict=True)]
    against = (2, 2, 3, 3) if o > 1 else (3, 3, 3, 3)
    sources = []
    for at, name in enumerate(("specimen", "operator", "interaction", "repeatability")):
        error = against[at]
        tested = at < 3 and degrees[at] > 0 and means[error] > 0.0
        f = means[at] / means[error] if tested else None
        p_value = None if f is None else float(fdtrc(degrees[at], degrees[error], f))
        mean_square = means[at] if degrees[at] else None
        sources.append(Source(
            name=name, degrees=degrees[at], squares=squares[at], mean_square=mean_square, f=f,
            p=p_value,
        ))  # fmt: skip
    by_chance = sources[2].p
    pooled = by_chance is None or by_chance > POOLED_FROM
    repeats = (squares[2] + squares[3]) / (degrees[2] + degrees[3]) if pooled else means[3]
    error_square = repeats if pooled else means[2]

    def sigma(mean_square: float, below: float, count: int) -> float:
        return math.sqrt(max(mean_square - below, 0.0) / count)

    ev, pv = math.sqrt(repeats), sigma(means[0], error_square, o * r)
    av = sigma(means[1], error_square, p * r) if o > 1 else 0.0
    both = 0.0 if pooled else sigma(means[2], means[3], r)
    grr = math.hypot(ev, av, both)
    return Gauge(
        parts=p, operators=o, trials=r, pooled=pooled, ev=ev, av=av if o > 1 else None,
        interaction=both if o > 1 else None, grr=grr, pv=pv, tv=math.hypot(grr, pv),
        ndc=int(math.sqrt(2.0) * pv / grr) if grr > 0.0 else 0, sources=tuple(sources),
    )  # fmt: skip


class Capability(Row):
    """Capability and performance, ISO 22514-2; null where a limit is not stated."""

    cp: float | None = figure("Capability index, short-term σ.")
    cpk: float = figure("Smaller capability index.")
    pp: float | None = figure("Performance index, standard deviation of all.")
    ppk: float = figure("Smaller performance index.")
    ppk_interval: Pair = figure("95 % interval of Ppk.")


def capability(
    values: FloatArray, low: float | None, high: float | None, sigma: float
) -> Capability:
    """Indices of `values` (N,) against one or two limits; `sigma` is the short-term one."""
    mean, s, n = float(values.mean()), float(values.std(ddof=1)), values.size
    width = None if low is None or high is None else high - low
    near = min(math.inf if high is None else high - mean, math.inf if low is None else mean - low)
    ppk = near / (3.0 * s)
    half = float(ndtri(1 - 0.5 * ALPHA)) * math.sqrt(1 / (9 * n) + ppk**2 / (2 * (n - 1)))
    return Capability(
        cp=width and width / (SIGMAS * sigma), cpk=near / (3.0 * sigma),
        pp=width and width / (SIGMAS * s), ppk=ppk, ppk_interval=(ppk - half, ppk + half),
    )  # fmt: skip
