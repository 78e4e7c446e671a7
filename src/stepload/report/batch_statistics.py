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
from stepload.units import percent

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
FEW = 4
"""Values from which there is a trend or a chart."""
MANY = 15
"""Values from which the ESD test may look for several outliers; with fewer it is Grubbs' test."""
POOLED_FROM = 0.25
"""Probability above which the interaction counts as repeatability (AIAG)."""
SIGMAS = 6.0
"""Width of a process or of a tolerance in standard deviations (AIAG, ISO 22514)."""


def student(degrees: float) -> float:
    """Student's factor of the two-sided 95 % interval."""
    return float(stdtrit(degrees, 1.0 - 0.5 * ALPHA))


def two_digits(value: float) -> str:
    """A probability for people."""
    return f"{value:.2g}"


class Trend(Row):
    """Straight line over the order of pressing."""

    slope_n_per_m: float = figure("Change from one specimen to the next.", "trend a specimen")
    slope_interval_n_per_m: Pair = figure("Its 95 % interval.", "trend, 95 %")
    rank_p: Annotated[float, two_digits] = figure(
        "Probability without a trend, by Kendall's rank correlation.", "trend, p of rank test"
    )


def trend(values: FloatArray) -> Trend | None:
    """The trend of `values` (N,); None for fewer than four, or if all are equal."""
    from scipy.stats import kendalltau, linregress

    at = np.arange(values.size)
    if at.size < FEW or not np.ptp(values) > 0.0:
        return None
    line, rank_p = linregress(at, values), float(kendalltau(at, values).pvalue)
    slope, half = float(line.slope), student(at.size - 2) * float(line.stderr)
    ends = (slope - half, slope + half)
    return Trend(slope_n_per_m=slope, slope_interval_n_per_m=ends, rank_p=rank_p)


class Chart(Row):
    """Individuals and moving-range chart."""

    centre_n_per_m: float = figure("Centre line.")
    limits_n_per_m: Pair = figure("Centre ± 3 mean moving ranges over 1.128.", "control limits")
    mean_range_n_per_m: float = figure("Mean moving range.", "mean moving range")
    range_high_n_per_m: float = figure("Its limit: 3.267 times the mean.", "limit of moving range")
    sigma_n_per_m: float = figure("Short-term σ: the mean moving range over 1.128.")
    broken: tuple[tuple[str, ...], ...] = figure("Western Electric rules that each point breaks.")
    jumps: tuple[int, ...] = figure("Points, from 2, whose moving range is above its limit.")


def chart(values: FloatArray) -> Chart | None:
    """The control chart of `values` (N,); None for fewer than four, or if all are equal."""
    ranges = np.abs(np.diff(values))
    if values.size < FEW or not ranges.max() > 0.0:
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
        centre_n_per_m=centre, limits_n_per_m=(centre - 3.0 * sigma, centre + 3.0 * sigma),
        mean_range_n_per_m=mean_range, range_high_n_per_m=D4 * mean_range, sigma_n_per_m=sigma,
        broken=tuple(map(tuple, broken)), jumps=tuple(map(int, jumps)),
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


GAUGE = {"EV": "repeatability", "AV": "reproducibility", "INT": "operator × specimen",
         "GRR": "EV, AV and INT", "PV": "between specimens", "TV": "total"}  # fmt: skip
"""Displayed name of each line of a gauge R&R."""


class GaugeLine(Row):
    """One line of a gauge R&R."""

    name: Annotated[str, lambda name: f"{name}, {GAUGE[name]}"] = figure(
        "EV, AV, INT (operator × specimen), GRR, PV or TV.", "by AIAG"
    )
    sigma_n_per_m: float = figure("Standard deviation.", "standard deviation")
    of_study: Annotated[float, percent] = figure("Of TV.", "of study variation")
    of_tolerance: Annotated[float | None, percent] = figure("6 σ of it.", "of tolerance")


class Gauge(Row):
    """Gauge R&R by analysis of variance, AIAG MSA, 4th edition."""

    operators: int = figure("Operators.")
    trials: int = figure("Presses of each specimen by each operator.")
    pooled: bool = figure("Whether the interaction counts as repeatability: its p is above 0.25.")
    ndc: int = figure("Number of distinct categories, truncated.")
    lines: tuple[GaugeLine, ...] = figure("The figures; AV and INT with several operators.")
    sources: tuple[Source, ...] = figure("Analysis of variance, before pooling.")


def gauge(values: FloatArray, tolerance: float | None = None) -> Gauge:
    """Gauge R&R of a crossed study; `values` (parts, operators, trials), two parts and trials.

    `tolerance` is the width between the limits of the plan.
    """
    p, o, r = values.shape
    whole, cells = values.mean(), values.mean(axis=2)
    part, operator = cells.mean(axis=1) - whole, cells.mean(axis=0) - whole
    crossed, repeats = cells - whole - part[:, None] - operator, values - cells[:, :, None]
    squares = [float((x**2).sum()) * k for x, k in (
        (part, o * r), (operator, p * r), (crossed, r), (repeats, 1),
    )]  # fmt: skip
    degrees = [p - 1, o - 1, (p - 1) * (o - 1), p * o * (r - 1)]
    means = [s / d if d else 0.0 for s, d in zip(squares, degrees, strict=True)]
    sources = []
    for at, name in enumerate(("specimen", "operator", "interaction", "repeatability")):
        error = 2 if o > 1 and at < 2 else 3
        tested = at < 3 and degrees[at] and means[error] > 0.0
        f = means[at] / means[error] if tested else None
        chance = None if f is None else float(fdtrc(degrees[at], degrees[error], f))
        mean_square = means[at] if degrees[at] else None
        sources.append(
            Source(name=name, degrees=degrees[at], squares=squares[at], mean_square=mean_square,
                   f=f, p=chance)
        )  # fmt: skip
    pooled = sources[2].p is None or sources[2].p > POOLED_FROM
    within = (squares[2] + squares[3]) / (degrees[2] + degrees[3]) if pooled else means[3]
    error_square = within if pooled else means[2]
    pv, av, both = (
        math.sqrt(max(mean - below, 0.0) / count)
        for mean, below, count in (
            (means[0], error_square, o * r), (means[1], error_square, p * r),
            (means[2], means[2] if pooled else means[3], r),
        )
    )  # fmt: skip
    ev = math.sqrt(within)
    grr = math.hypot(ev, av, both)
    tv = math.hypot(grr, pv)
    sigmas = dict(zip(GAUGE, (ev, av, both, grr, pv, tv), strict=True))
    lines = [
        GaugeLine(name=name, sigma_n_per_m=sigma, of_study=sigma / tv if tv else math.nan,
                  of_tolerance=tolerance and SIGMAS * sigma / tolerance)
        for name, sigma in sigmas.items() if o > 1 or name not in ("AV", "INT")
    ]  # fmt: skip
    ndc = int(math.sqrt(2.0) * pv / grr) if grr > 0.0 else 0
    return Gauge(operators=o, trials=r, pooled=pooled, ndc=ndc, lines=tuple(lines),
                 sources=tuple(sources))  # fmt: skip


class Capability(Row):
    """Capability and performance, ISO 22514-2; null where a limit is not stated."""

    cp: Annotated[float | None, form(".2f")] = figure("By the short-term σ.", "Cp")
    cpk: Annotated[float, form(".2f")] = figure("The smaller one.", "Cpk")
    pp: Annotated[float | None, form(".2f")] = figure("By the deviation of all.", "Pp")
    ppk: Annotated[float, form(".2f")] = figure("The smaller one.", "Ppk")
    ppk_interval: Annotated[Pair, lambda ends: "[{:.2f}, {:.2f}]".format(*ends)] = figure(
        "95 % interval of Ppk.", "Ppk, 95 %"
    )


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
