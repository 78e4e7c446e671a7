"""Statistics of a series of specimens: trend, control chart, outliers, gauge R&R, capability.

Values (N,) are in the order of pressing. Each is checked against the published example of its
source: NIST/SEMATECH e-Handbook 1.3.5.17 (outliers), 6.1.6 (capability), 6.3.2.2 (individuals
chart); AIAG Measurement Systems Analysis, 4th edition (gauge R&R by analysis of variance).
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
D2 = 1.128
"""Mean of the range of two values over their σ."""
ZONES = {"WE1": (3.0, 1, 1), "WE2": (2.0, 2, 3), "WE3": (1.0, 4, 5), "WE4": (0.0, 8, 8)}
"""Western Electric rules: beyond so many σ on one side, so many of so many successive points."""
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

    slope_n_per_m: float = figure("Change from one specimen to the next.", "change per specimen")
    slope_interval_n_per_m: Pair = figure("Its 95 % interval.", "change per specimen, 95 %")
    rank_p: Annotated[float, form(".2g")] = figure(
        "Probability without a trend, by Kendall's rank correlation.", "p of no trend, Kendall"
    )


def trend(values: FloatArray) -> Trend:
    """The trend of three values or more that are not all equal."""
    from scipy.stats import kendalltau, linregress

    at = np.arange(values.size)
    line, rank_p = linregress(at, values), float(kendalltau(at, values).pvalue)
    slope, half = float(line.slope), student(at.size - 2) * float(line.stderr)
    ends = (slope - half, slope + half)
    return Trend(slope_n_per_m=slope, slope_interval_n_per_m=ends, rank_p=rank_p)


class Chart(Row):
    """Individuals chart, limits by the moving range."""

    centre_n_per_m: float = figure("Centre line.")
    limits_n_per_m: Pair = figure(
        "Centre ± 3 mean moving ranges over 1.128.", "control limits of a specimen"
    )
    mean_range_n_per_m: float = figure("Mean moving range.", "mean moving range")
    sigma_n_per_m: float = figure("Short-term σ: the mean moving range over 1.128.")
    broken: tuple[tuple[str, ...], ...] = figure("Western Electric rules that each point breaks.")


def chart(values: FloatArray) -> Chart:
    """The control chart of values that are not all equal."""
    centre, mean_range = float(values.mean()), float(np.abs(np.diff(values)).mean())
    sigma = mean_range / D2
    z = (values - centre) / sigma
    broken = [
        tuple(
            rule
            for rule, (beyond, least, among) in ZONES.items()
            if abs(z[at]) > beyond
            and (np.sign(z[at]) * z[max(0, at + 1 - among) : at + 1] > beyond).sum() >= least
        )
        for at in range(z.size)
    ]
    ends = (centre - 3.0 * sigma, centre + 3.0 * sigma)
    return Chart(centre_n_per_m=centre, limits_n_per_m=ends, mean_range_n_per_m=mean_range,
                 sigma_n_per_m=sigma, broken=tuple(broken))  # fmt: skip


def outliers(values: FloatArray, most: int | None = None) -> list[int]:
    """Places of the outliers by Rosner's generalised ESD test at 5 %.

    It looks for `most`; None: for a fifth of the values, for one where they are few.
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
    return taken[:count]


def esd_limit(n: int, i: int) -> float:
    """Critical value of the i-th studentised deviate of n values."""
    t = float(stdtrit(n - i - 1, 1.0 - ALPHA / (2.0 * (n - i + 1))))
    return (n - i) * t / math.sqrt((n - i - 1 + t**2) * (n - i + 1))


GAUGE = {"EV": "repeatability", "AV": "reproducibility", "INT": "operator × specimen",
         "GRR": "EV, AV and INT", "PV": "between specimens", "TV": "total"}  # fmt: skip


class GaugeLine(Row):
    """One line of a gauge R&R."""

    name: Annotated[str, lambda name: f"{name}, {GAUGE[name]}"] = figure(
        "EV, AV, INT (operator × specimen), GRR, PV or TV.", "by AIAG"
    )
    sigma_n_per_m: float = figure("Standard deviation.", "standard deviation")
    of_study: Annotated[float, percent] = figure("Of TV.", "of study variation")
    of_tolerance: Annotated[float | None, percent] = figure("6 σ of it.", "6 σ of tolerance")


class Gauge(Row):
    """Gauge R&R by analysis of variance, AIAG MSA, 4th edition."""

    operators: int = figure("Operators.")
    trials: int = figure("Presses of each specimen by each operator.")
    interaction_p: float | None = figure("Probability without one, by F; null for one operator.")
    pooled: bool = figure("Whether the interaction counts as repeatability: its p is above 0.25.")
    ndc: int = figure("Number of distinct categories, truncated.")
    lines: tuple[GaugeLine, ...] = figure("The figures; AV and INT with several operators.")


def gauge(values: FloatArray, tolerance: float | None = None) -> Gauge:
    """Gauge R&R of a crossed study; `values` (parts, operators, trials), two parts and trials.

    `tolerance` is the width between the limits of the plan.
    """
    p, o, r = values.shape
    cells = values.mean(axis=2)
    part, operator = cells.mean(axis=1), cells.mean(axis=0)
    crossed = cells - part[:, None] - operator + values.mean()
    squares = np.array([p * o * r * part.var(), p * o * r * operator.var(), r * (crossed**2).sum(),
                        r * values.var(axis=2).sum()])  # fmt: skip
    degrees = np.array([p - 1, o - 1, (p - 1) * (o - 1), p * o * (r - 1)])
    means = squares / np.maximum(degrees, 1)
    chance = None
    if o > 1 and means[3] > 0.0:
        chance = float(fdtrc(degrees[2], degrees[3], means[2] / means[3]))
    if pooled := chance is None or chance > POOLED_FROM:
        means[2:] = squares[2:].sum() / degrees[2:].sum()
    above = np.maximum(means[:3] - means[[2, 2, 3]], 0.0) / (o * r, p * r, r)
    pv, av, both = np.sqrt(above).tolist()
    ev = math.sqrt(means[3])
    grr = math.hypot(ev, av, both)
    tv = math.hypot(grr, pv)
    lines = [
        GaugeLine(name=name, sigma_n_per_m=sigma, of_study=sigma / tv if tv else math.nan,
                  of_tolerance=tolerance and SIGMAS * sigma / tolerance)
        for name, sigma in zip(GAUGE, (ev, av, both, grr, pv, tv), strict=True)
        if o > 1 or name not in ("AV", "INT")
    ]  # fmt: skip
    ndc = int(math.sqrt(2.0) * pv / grr) if grr > 0.0 else 0
    return Gauge(operators=o, trials=r, interaction_p=chance, pooled=pooled, ndc=ndc,
                 lines=tuple(lines))  # fmt: skip


class Capability(Row):
    """Capability and performance, ISO 22514-2; null where a limit is not stated."""

    cp: Annotated[float | None, form(".2f")] = figure("By the short-term σ.", "Cp, short-term σ")
    cpk: Annotated[float, form(".2f")] = figure("The smaller one.", "Cpk, short-term σ")
    pp: Annotated[float | None, form(".2f")] = figure("By the deviation of all.", "Pp, σ of all")
    ppk: Annotated[float, form(".2f")] = figure("The smaller one.", "Ppk, σ of all")
    ppk_interval: Annotated[Pair, lambda ends: "[{:.2f}, {:.2f}]".format(*ends)] = figure(
        "95 % interval of Ppk.", "Ppk, 95 %"
    )


def capability(
    values: FloatArray, low: float | None, high: float | None, sigma: float
) -> Capability:
    """Indices against one or two limits; `sigma` is the short-term one."""
    mean, s, n = float(values.mean()), float(values.std(ddof=1)), values.size
    width = None if low is None or high is None else high - low
    near = min(high - mean if high else math.inf, mean - low if low else math.inf)
    ppk = near / (3.0 * s)
    half = float(ndtri(1 - 0.5 * ALPHA)) * math.sqrt(1 / (9 * n) + ppk**2 / (2 * (n - 1)))
    return Capability(
        cp=width and width / (SIGMAS * sigma), cpk=near / (3.0 * sigma),
        pp=width and width / (SIGMAS * s), ppk=ppk, ppk_interval=(ppk - half, ppk + half),
    )  # fmt: skip
