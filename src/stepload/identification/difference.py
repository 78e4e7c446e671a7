"""The difference between two groups of runs, with its own interval.

Every error of the budget enters the difference of ln(stiffness) with the weight of its run: −1/N in
the first group, +1/N in the second (GUM, JCGM 100, 5.2.2, with correlations). An error that all
runs share cancels except for the difference of its size; errors of single runs are averaged. A
scatter of repeats larger than their own errors predict replaces these, widened after Student.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations
from typing import NamedTuple

import numpy as np

from stepload.errors import DomainError
from stepload.identification.fit import FloatArray, IntArray
from stepload.identification.origin import Origin, common
from stepload.identification.quantity import Quantity
from stepload.units import change, changes, percent

SIGNIFICANCE = 0.05
"""Allowed probability of calling runs of equal payloads different."""
POWER = 0.8
"""Probability of detecting a true difference of the smallest detectable size."""
SAME_FORCE = 0.02
"""Two forces count as one up to this share of the top force: levels are held that well."""
SMOOTH = "smooth deformation error"
REPEATABILITY = "repeatability beyond the budget"
LEAST_DEGREES = 2
"""Degrees of freedom from which a scatter may replace a budget: that of one repeat is so uncertain
that its interval would be six times as wide."""
_TOO_SMALL, _TOO_LARGE = 0.1, 0.05
"""Probabilities of a chance scatter this small or this large, below which it overrides a budget."""


class Scatter(NamedTuple):
    """Standard deviation of a value between the runs of a group, pooled over the groups."""

    sigma: float
    degrees: int

    def widened(self, level: float) -> float:
        """The standard deviation widened for Student's distribution (GUM G.3)."""
        from scipy.special import stdtrit

        return self.sigma * float(stdtrit(self.degrees, level)) / normal(level)

    def beyond(self, expected: float, level: float) -> float:
        """Variance of a run that the scatter requires beyond the `expected` variance of its budget.

        At least 0, so that the larger of both counts. A single repeat counts only where chance does
        not explain its scatter.
        """
        if self.degrees < LEAST_DEGREES and not self._too_large(expected):
            return 0.0
        return max(self.widened(level) ** 2 - expected, 0.0)

    def instead_of(self, stated: float, level: float) -> float | None:
        """Variance that replaces a stated one too large for this scatter; None: it stays."""
        from scipy.special import chdtr

        if self.degrees < LEAST_DEGREES or not stated > 0.0:
            return None
        share = self.degrees * self.sigma**2 / stated
        measured = self.widened(level) ** 2
        if float(chdtr(self.degrees, share)) >= _TOO_SMALL or measured >= stated:
            return None
        return measured

    def _too_large(self, expected: float) -> bool:
        from scipy.special import chdtrc

        if not expected > 0.0:
            return self.sigma > 0.0
        share = self.degrees * self.sigma**2 / expected
        return float(chdtrc(self.degrees, share)) < _TOO_LARGE


def within(group: IntArray) -> FloatArray:
    """(N, N) projection onto the differences within groups; `group` (N,) names each run's group."""
    alike = (group[:, None] == group).astype(np.float64)
    return np.asarray(np.eye(group.size) - alike / alike.sum(axis=1))


def scatter_of(value: FloatArray, group: IntArray) -> Scatter | None:
    """Scatter of `value` (N,) in its groups; None where no run was repeated."""
    left = within(group) @ value
    degrees = value.size - np.unique(group).size
    return None if degrees < 1 else Scatter(math.sqrt(float(left @ left) / degrees), degrees)


def normal(level: float) -> float:
    """Quantile of the standard normal distribution."""
    from scipy.special import ndtri

    return float(ndtri(level))


class Agreement(StrEnum):
    """Verdict of a comparison."""

    AGREE = "agree"
    DIFFER = "differ"
    CANNOT_TELL = "cannot tell"


class Measured(NamedTuple):
    """A figure of a run: the run's displayed name, and where its errors come from."""

    run: str
    figure: Quantity
    origin: Origin

    @property
    def ln_value(self) -> float:
        """ln of the stiffness in N/m."""
        return math.log(self.figure.value_n_per_m)

    @property
    def lines(self) -> dict[str, float]:
        """Relative standard uncertainty by source."""
        return {line.source: line.relative for line in self.figure.lines}

    @property
    def deformation_m(self) -> float:
        """Deformation between the figure's two forces."""
        return (self.figure.to_n - self.figure.from_n) / self.figure.value_n_per_m


@dataclass(frozen=True, slots=True)
class DifferenceLine:
    """Contribution of one source; all relative standard uncertainties.

    Attributes:
        first, second: rms of its size in a single run of the group.
        left: contribution to the difference, after averaging and cancelling.
        common: in words, which runs share it.
    """

    source: str
    first: float
    second: float
    left: float
    common: str


@dataclass(frozen=True, slots=True)
class Difference:
    """Difference of group 2 from group 1.

    Attributes:
        first, second: names of the runs of both groups.
        relative: S2/S1 − 1, geometric means.
        interval: its 95 % interval; wider where several groups are compared with the first.
        half_width: of the interval of ln(S2/S1).
        smallest_detectable: the relative difference that is detected with a probability of 80 %.
        lines: one per source; in the widest case where it is not known what is shared.
        scatter: standard deviation of ln S between the runs of a group; None: no repeats.
        scatter_expected: what the budget of the runs' own errors expects.
        open_sources: sources for which the records do not show whether they are shared.
    """

    kind: str
    from_n: float
    to_n: float
    first: tuple[str, ...]
    second: tuple[str, ...]
    relative: float
    interval: tuple[float, float]
    half_width: float
    smallest_detectable: float
    tolerance: float
    verdict: Agreement
    why: str
    lines: tuple[DifferenceLine, ...]
    scatter: float | None
    scatter_degrees: int
    scatter_expected: float | None
    open_sources: tuple[str, ...]


class Correlation(NamedTuple):
    """(N, N) bounds of the correlation of one source between the runs."""

    least: FloatArray
    most: FloatArray

    @property
    def open(self) -> bool:
        return bool(np.any(self.most > self.least))

    def cases(self, group: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Ways in which unknown correlations are resolved: independent in every run, shared within
        a group only (nothing cancels and nothing averages), or shared by all."""
        grouped = np.where(group[:, None] == group, self.most, self.least)
        return self.least, grouped, self.most


class _Case(NamedTuple):
    """One assumption about the correlations that are not known."""

    lines: tuple[DifferenceLine, ...]
    expected: float | None

    @property
    def sigma(self) -> float:
        return math.hypot(*(line.left for line in self.lines))


class _Groups(NamedTuple):
    """All runs with their group and their weight in the difference, (N,) each."""

    runs: tuple[Measured, ...]
    group: IntArray
    weight: FloatArray
    scatter: Scatter | None
    level: float

    def sigma(self, source: str) -> FloatArray:
        return np.array([lines.get(source, 0.0) for lines in (run.lines for run in self.runs)])


def difference(
    first: Sequence[Measured], second: Sequence[Measured], *, tolerance: float, comparisons: int = 1
) -> Difference:
    """Compare two groups of runs.

    Args:
        first, second: the runs of both groups, one quantity between the same two forces.
        comparisons: how many such comparisons the verdict is taken from; the significance is
            shared out among them (Bonferroni).

    Raises:
        DomainError: a group is empty, quantities or forces differ, or a number is impossible.
    """
    _check(first, second, tolerance)
    runs = (*first, *second)
    group = np.array([0] * len(first) + [1] * len(second))
    value = np.array([run.ln_value for run in runs])
    weight = np.where(group == 0, -1.0 / len(first), 1.0 / len(second))
    level = 1.0 - SIGNIFICANCE / (2.0 * comparisons)
    groups = _Groups(runs, group, weight, scatter_of(value, group), level)
    known = correlations(runs)
    cases = [
        _case(groups, dict(zip(known, case, strict=True)), known)
        for case in zip(*(each.cases(group) for each in known.values()), strict=True)
    ]
    log_change, factor = float(weight @ value), normal(level)
    widest = max(cases, key=lambda case: case.sigma)
    half = factor * widest.sigma
    smallest = math.expm1((factor + normal(POWER)) * widest.sigma)
    undecided = tuple(s for s, c in known.items() if c.open and np.any(groups.sigma(s) > 0.0))
    verdict, why = _judge(log_change, [factor * case.sigma for case in cases], smallest, tolerance)
    if undecided and verdict is Agreement.CANNOT_TELL:
        why += f"; the records do not tell whether the runs share {', '.join(undecided)}"
    return Difference(
        kind=runs[0].figure.kind,
        from_n=max(run.figure.from_n for run in runs),
        to_n=min(run.figure.to_n for run in runs),
        first=tuple(run.run for run in first),
        second=tuple(run.run for run in second),
        relative=math.expm1(log_change),
        interval=(math.expm1(log_change - half), math.expm1(log_change + half)),
        half_width=half,
        smallest_detectable=smallest,
        tolerance=tolerance,
        verdict=verdict,
        why=why,
        lines=widest.lines,
        scatter=groups.scatter.sigma if groups.scatter else None,
        scatter_degrees=groups.scatter.degrees if groups.scatter else 0,
        scatter_expected=widest.expected,
        open_sources=undecided,
    )


def _check(first: Sequence[Measured], second: Sequence[Measured], tolerance: float) -> None:
    runs = (*first, *second)
    if not first or not second:
        raise DomainError("a group without a run cannot be compared")
    if not 0.0 < tolerance < math.inf:
        raise DomainError(f"tolerance is {tolerance:g}; it must be positive and finite")
    kinds = sorted({run.figure.kind for run in runs})
    low_n = [run.figure.from_n for run in runs]
    top_n = [run.figure.to_n for run in runs]
    if len(kinds) > 1 or max(np.ptp(low_n), np.ptp(top_n)) > SAME_FORCE * max(top_n):
        told = ", ".join(kinds)
        raise DomainError(
            f"figures of different definition are not compared: {told}, {min(low_n):g} to"
            f" {max(low_n):g} N and {min(top_n):g} to {max(top_n):g} N",
            hint="evaluate the runs by one quantity between the same two forces",
        )
    for run in runs:
        if not 0.0 < run.figure.value_n_per_m < math.inf:
            raise DomainError(f"{run.run}: the stiffness is no number")
        if not run.lines:
            raise DomainError(f"{run.run}: a stiffness without a budget cannot be compared")
        for source, sigma in run.lines.items():
            if not 0.0 <= sigma < math.inf:
                raise DomainError(f"{run.run}: {source} is {sigma:g}; it must be 0 or more")


def correlations(runs: Sequence[Measured]) -> dict[str, Correlation]:
    """How each source of the budgets is shared between the runs."""
    found = {}
    for source in dict.fromkeys(source for run in runs for source in run.lines):
        least, most = np.eye(len(runs)), np.eye(len(runs))
        for (i, one), (j, other) in combinations(enumerate(runs), 2):
            apart_m = 0.5 * abs(one.deformation_m - other.deformation_m)
            both = common(source, one.origin, other.origin, apart_m)
            least[i, j] = least[j, i] = both.least
            most[i, j] = most[j, i] = both.most
        found[source] = Correlation(least, most)
    return found


def _case(
    groups: _Groups, correlation: Mapping[str, FloatArray], known: Mapping[str, Correlation]
) -> _Case:
    """The lines of the difference for given correlations."""
    lines, expected = [], 0.0
    scatter, average = groups.scatter, float(groups.weight @ groups.weight)
    projection = within(groups.group)
    for source, matrix in correlation.items():
        line = _line(source, groups, matrix)
        sigma = groups.sigma(source)
        spread = float(np.trace(projection @ (np.outer(sigma, sigma) * matrix)))
        if scatter is not None and source == SMOOTH and not _shared(known[source].most):
            measured = scatter.instead_of(spread / scatter.degrees, groups.level)
            if measured is not None:
                spread, left = measured * scatter.degrees, math.sqrt(measured * average)
                told = "no; its size is taken from the scatter"
                line = DifferenceLine(source, line.first, line.second, left, told)
        expected += spread
        lines.append(line)
    if scatter is None:
        return _Case(tuple(lines), None)
    expected /= scatter.degrees
    beyond = scatter.beyond(expected, groups.level)
    if beyond > 0.0:
        each, left = math.sqrt(beyond), math.sqrt(beyond * average)
        told = f"no; widened for {scatter.degrees} degrees of freedom"
        lines.append(DifferenceLine(REPEATABILITY, each, each, left, told))
    return _Case(tuple(lines), math.sqrt(expected))


def _line(source: str, groups: _Groups, matrix: FloatArray) -> DifferenceLine:
    sigma = groups.sigma(source)
    parts = groups.weight * sigma
    left = math.sqrt(max(float(parts @ matrix @ parts), 0.0))
    first, second = (_rms(sigma[groups.group == group]) for group in (0, 1))
    return DifferenceLine(source, first, second, left, _told(matrix, groups.group))


def _rms(values: FloatArray) -> float:
    return math.sqrt(float(np.mean(values**2)))


def _shared(matrix: FloatArray) -> bool:
    return bool(np.any(matrix - np.eye(len(matrix))))


def _told(matrix: FloatArray, group: IntArray) -> str:
    """Description of which runs share a source."""
    pairs = matrix[~np.eye(group.size, dtype=bool)]
    if not np.any(pairs):
        return "no"
    if not np.any(matrix[group[:, None] != group]):
        return "within a group only"
    if np.all(pairs >= 1.0):
        return "by all"
    return f"by all, {percent(float(np.min(pairs)), 2)} of it" if np.all(pairs > 0.0) else "by some"


def _judge(
    log_change: float, halves: Sequence[float], smallest: float, tolerance: float
) -> tuple[Agreement, str]:
    """The verdict; every assumption about unknown correlations must lead to the same one."""
    half = max(halves)
    ends = math.expm1(log_change - half), math.expm1(log_change + half)
    said = f"{change(math.expm1(log_change))}, 95 % interval {changes(ends)}"
    least = change(smallest).removeprefix("+")
    seen = f"smallest difference that these runs could have shown: {least}"
    if all(abs(log_change) > each for each in halves):
        return Agreement.DIFFER, f"{said}; {seen}"
    if any(abs(log_change) > each for each in halves):
        return Agreement.CANNOT_TELL, f"{said}, a difference only if they share more; {seen}"
    if smallest > tolerance:
        return Agreement.CANNOT_TELL, f"{said}; {seen}, asked for is {percent(tolerance)}"
    if math.expm1(abs(log_change) + half) > tolerance:
        return Agreement.CANNOT_TELL, (
            f"{said}: the interval reaches beyond the {percent(tolerance)} asked for; {seen}"
        )
    return Agreement.AGREE, f"{said}, within the {percent(tolerance)} asked for; {seen}"
