"""Comparison of several runs with each other, and with a curve from elsewhere."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stepload.contact.power_law import secant_stiffness
from stepload.errors import BadInputError
from stepload.estimators.compare import (
    Band,
    CurveComparison,
    FitPair,
    Spread,
    at_other_modulus,
    compare_curve,
    compare_fits,
    confidence_band,
    spread,
)
from stepload.estimators.decide import secant_sigma
from stepload.estimators.difference import POWER, Agreement, Difference
from stepload.estimators.fit import Fit
from stepload.estimators.fit_all import fit_all
from stepload.estimators.repeats import normal
from stepload.estimators.selection import select
from stepload.estimators.smooth import NORMAL_95
from stepload.evidence.identification import REPORTED, Identification
from stepload.record.curves import Curve
from stepload.results.analyse import identify_payload
from stepload.results.comparison_groups import differences, grouped, pair_half_width
from stepload.results.comparison_notes import REACHED, group_notes, run_notes
from stepload.results.press_data import LOADING
from stepload.results.saved import SavedRun, labelled

INSIDE = 0.95
"""Share of a curve's points that must lie inside the 95 % band."""


@dataclass(frozen=True, slots=True)
class ComparedRun:
    """One run: its virgin loading, and the reported fits of every cycle separately."""

    run: SavedRun
    found: Identification
    cycles: Mapping[int, Mapping[str, Fit]]


@dataclass(frozen=True, slots=True)
class EstimatorSpread:
    """Spread of secant stiffness and exponent of one estimator over runs and their cycles."""

    secant: Spread
    n: Spread


@dataclass(frozen=True, slots=True)
class Pair:
    """A later run against the first, by one estimator."""

    first: str
    second: str
    estimator: str
    change: FitPair


@dataclass(frozen=True, slots=True)
class AgainstCurve:
    """One run's believed fit against the curve.

    `half_width` is that of the 95 % interval of ln of the run's secant, `smallest_detectable` the
    relative difference that would be detected with 80 % probability; the curve counts as exact. All
    figures are those of the corrected curve: its forces were multiplied by `correction`, the ratio
    of the equivalent moduli (V-A), 1 where none was given. `secant_n_per_m` is the curve's own
    secant at `result.to_n`, None where it has no point as low as that.
    """

    run: str
    estimator: str
    result: CurveComparison
    half_width: float
    smallest_detectable: float
    verdict: Agreement
    correction: float = 1.0
    secant_n_per_m: float | None = None


@dataclass(frozen=True, slots=True)
class Comparison:
    """Everything that was compared; secants are at `secant_force_n`.

    `groups` are the indices into `runs` of repeats, `differences` those of every group from the
    first; `tolerance` is the relative difference that matters.
    """

    secant_force_n: float
    runs: tuple[ComparedRun, ...]
    spreads: Mapping[str, EstimatorSpread]
    pairs: tuple[Pair, ...]
    curve: tuple[AgainstCurve, ...]
    notes: tuple[str, ...]
    groups: tuple[tuple[int, ...], ...]
    differences: tuple[Difference, ...]
    tolerance: float


@dataclass(frozen=True, slots=True)
class CurveGiven:
    """A curve from another machine or finite elements, and its modulus.

    `modulus_pa` is its equivalent modulus (4); `plate_pa` E/(1 − ν²) of its counter body, where
    that alone differs from the run's. Both None: it needs no correction.
    """

    curve: Curve
    modulus_pa: float | None = None
    plate_pa: float | None = None


def compare(
    runs: Sequence[SavedRun],
    *,
    secant_force_n: float | None = None,
    given: CurveGiven | None = None,
    sizes: Sequence[int] | None = None,
    tolerance: float | None = None,
) -> Comparison:
    """Compare payload runs with each other and with a curve.

    Args:
        runs: records, in the order of the tests; the first is test 1.
        secant_force_n: where all secants are taken. None: the lowest of the runs' own secant
            forces, or the highest force that all have reached if that is lower.
        given: a curve to compare with.
        sizes: number of runs in each group of repeats; None: grouped by plan and payload.
        tolerance: the relative difference that matters; None: the accuracy 1/t of the plans.

    Raises:
        BadInputError: fewer than two things to compare, a run given twice or one with nothing to
            identify, or an invalid tolerance.
    """
    if len(runs) + (given is not None) < 2:
        raise BadInputError(
            "there is nothing to compare with", hint="give a second run, or a curve with --curve"
        )
    for run in runs:
        if run.conditions.kind != "payload":
            raise BadInputError(
                f"{run.path}: a system-stiffness run", hint="pool such runs: stepload calibrate"
            )
    if tolerance is None:
        tolerance = min(1.0 / run.conditions.t for run in runs)
    if not 0.0 < tolerance <= 1.0:
        raise BadInputError(
            f"a tolerance of {tolerance:g}; it must be above 0 and at most 100 %",
            hint='--tolerance "5 %": the smallest difference of stiffness that matters',
        )
    groups, runs = grouped(runs, sizes), labelled(runs)
    at = secant_force_n or min(map(_secant_force_n, runs))
    compared = tuple(_identified(run, at) for run in runs)
    reached = all(each.found.peak_force_n >= REACHED * at for each in compared)
    return Comparison(
        secant_force_n=at,
        runs=compared,
        spreads=_spreads(compared),
        pairs=tuple(_pairs(compared, tolerance)),
        curve=() if given is None else tuple(_against(each, given, tolerance) for each in compared),
        notes=(*group_notes(groups, sizes), *run_notes(compared, given, at)),
        groups=groups,
        differences=differences(compared, groups, tolerance) if reached else (),
        tolerance=tolerance,
    )


def _secant_force_n(run: SavedRun) -> float:
    """The plan's secant force, or the highest force of the first loading if that is lower."""
    wanted_n = run.conditions.secant_force_n
    peak_n = float(run.data.force_n[run.data.first_loading()].max(initial=0.0))
    return wanted_n if not 0.0 < peak_n < REACHED * wanted_n else peak_n


def virgin_band(each: ComparedRun) -> Band | None:
    """The believed curve of a run with its 95 % band; None without an interval."""
    found = each.found
    if found.covariance is None:
        return None
    top = (found.peak_force_n / found.fit.k) ** (1.0 / found.fit.n)
    deformation = np.linspace(0.0, top, 121)[1:]
    return confidence_band(found.fit, found.covariance, deformation)


def _identified(run: SavedRun, secant_force_n: float) -> ComparedRun:
    conditions = dataclasses.replace(run.conditions, secant_force_n=secant_force_n)
    found = identify_payload(run.data, conditions)
    numbers = np.unique(run.data.cycle[run.data.branch(LOADING)])
    cycles = {int(number): _cycle_fits(run, int(number), secant_force_n) for number in numbers}
    return ComparedRun(run, found, cycles)


def _cycle_fits(run: SavedRun, cycle: int, secant_force_n: float) -> dict[str, Fit]:
    loading = run.data.branch(LOADING, cycle)
    force_n = run.data.force_n[loading]
    deformation_m = run.data.since_touch(cycle) - run.conditions.bend(force_n)
    selected = select(deformation_m, force_n, time_s=run.data.time_s[loading])
    fits = fit_all(selected, secant_force_n=secant_force_n)
    return {name: fit for name in REPORTED if (fit := fits.get(name)) is not None and _usable(fit)}


def _usable(fit: Fit) -> bool:
    return all(0.0 < value < math.inf for value in (fit.secant_n_per_m, fit.k, fit.n))


def _spreads(runs: Sequence[ComparedRun]) -> dict[str, EstimatorSpread]:
    result = {}
    for name in REPORTED:
        fits = [[c[name] for c in each.cycles.values() if name in c] for each in runs]
        if all(fits):
            result[name] = EstimatorSpread(
                secant=spread([np.array([fit.secant_n_per_m for fit in run]) for run in fits]),
                n=spread([np.array([fit.n for fit in run]) for run in fits]),
            )
    return result


def _pairs(runs: Sequence[ComparedRun], tolerance: float) -> list[Pair]:
    pairs = []
    for later in runs[1:]:
        first = runs[0]
        half = pair_half_width(first, later, tolerance)
        for name in REPORTED:
            one, other = first.found.fits.get(name), later.found.fits.get(name)
            if one is None or other is None or not (_usable(one) and _usable(other)):
                continue
            change = compare_fits(one, other, half_width=half or None)
            pairs.append(Pair(first.run.name, later.run.name, name, change))
    return pairs


def _against(each: ComparedRun, given: CurveGiven, tolerance: float) -> AgainstCurve:
    found, conditions = each.found, each.run.conditions
    curve = given.curve
    if curve.displacement_m is None:
        raise BadInputError(
            "the curve has no column displacement_m",
            hint="its system stiffness must be out of it: columns displacement_m, force_n",
        )
    covariance = found.fit.covariance if found.covariance is None else found.covariance
    if covariance is None:
        raise BadInputError(f"{each.run.path}: the believed fit has no uncertainty to compare by")
    own_pa, other_pa = conditions.modulus_pa, given.modulus_pa
    if other_pa is None and given.plate_pa is not None:
        if own_pa is None or conditions.plate_pa is None:
            raise BadInputError(
                f"{each.run.path}: the record does not tell its materials",
                hint="give the curve's equivalent modulus: --curve-modulus",
            )
        other_pa = 1.0 / (1.0 / own_pa - 1.0 / conditions.plate_pa + 1.0 / given.plate_pa)
    peak = int(np.argmax(curve.force_n)) + 1
    curve_n, correction = curve.force_n[:peak], 1.0
    if other_pa is not None:
        if own_pa is None:
            raise BadInputError(f"{each.run.path}: the record does not tell its equivalent modulus")
        curve_n = at_other_modulus(curve_n, from_modulus_pa=other_pa, to_modulus_pa=own_pa)
        correction = own_pa / other_pa
    result = compare_curve(
        found.fit, covariance, curve.displacement_m[:peak], curve_n, reached_n=found.peak_force_n
    )
    sigma = secant_sigma(found.fit, covariance)
    half, smallest = NORMAL_95 * sigma, math.expm1((NORMAL_95 + normal(POWER)) * sigma)
    return AgainstCurve(
        each.run.name, found.believe, result, half, smallest,
        _curve_verdict(result, half, smallest, tolerance),
        correction=correction,
        secant_n_per_m=_curve_secant(found.fit, result),
    )  # fmt: skip


def _curve_secant(fit: Fit, result: CurveComparison) -> float | None:
    if result.secant_change is None:
        return None
    return secant_stiffness(fit.k, fit.n, result.to_n) * (1.0 + result.secant_change)


def _curve_verdict(
    result: CurveComparison, half: float, smallest: float, tolerance: float
) -> Agreement:
    change = result.secant_change
    if result.inside_share < INSIDE or (change is not None and abs(math.log1p(change)) > half):
        return Agreement.DIFFER
    if change is None or smallest > tolerance:
        return Agreement.CANNOT_TELL
    inside = math.expm1(abs(math.log1p(change)) + half) <= tolerance
    return Agreement.AGREE if inside else Agreement.CANNOT_TELL
