"""Comparison of several runs with each other, and with a curve from elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stepload.errors import BadInputError
from stepload.estimators.compare import FitPair, Spread, compare_fits, spread
from stepload.evidence.difference import SAME_FORCE, Difference
from stepload.evidence.identification import REPORTED
from stepload.evidence.quantity import Quantity
from stepload.results.comparison_curve import AgainstCurve, CurveGiven, against_curve
from stepload.results.comparison_notes import group_notes, run_notes
from stepload.results.comparison_runs import (
    ComparedRun,
    chords,
    compared_run,
    differences,
    grouped,
    usable,
)
from stepload.results.run_record import SavedRun, labelled


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
class Comparison:
    """Everything that was compared; secants are at `secant_force_n`.

    `chords` are those of the runs between their common forces; none where one has none. `groups`
    are the indices into `runs` of repeats, `differences` those of every group from the first;
    `tolerance` is the relative difference that matters.
    """

    secant_force_n: float
    runs: tuple[ComparedRun, ...]
    chords: tuple[Quantity, ...]
    spreads: Mapping[str, EstimatorSpread]
    pairs: tuple[Pair, ...]
    curve: tuple[AgainstCurve, ...]
    notes: tuple[str, ...]
    groups: tuple[tuple[int, ...], ...]
    differences: tuple[Difference, ...]
    tolerance: float


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
    compared = tuple(compared_run(run, at) for run in runs)
    figures = chords(compared)
    return Comparison(
        secant_force_n=at,
        runs=compared,
        chords=figures,
        spreads=_spreads(compared),
        pairs=tuple(_pairs(compared)),
        curve=()
        if given is None
        else tuple(against_curve(each, given, tolerance) for each in compared),
        notes=(*group_notes(groups, sizes), *run_notes(compared, given, at)),
        groups=groups,
        differences=differences(compared, figures, groups, tolerance),
        tolerance=tolerance,
    )


def _secant_force_n(run: SavedRun) -> float:
    """The plan's secant force, or the highest force of the first loading if that is lower."""
    wanted_n = run.conditions.secant_force_n
    peak_n = float(run.data.force_n[run.data.first_loading()].max(initial=0.0))
    return wanted_n if not 0.0 < peak_n < (1.0 - SAME_FORCE) * wanted_n else peak_n


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


def _pairs(runs: Sequence[ComparedRun]) -> list[Pair]:
    pairs = []
    first = runs[0]
    for later in runs[1:]:
        for name in REPORTED:
            one, other = first.found.fits.get(name), later.found.fits.get(name)
            if one is not None and other is not None and usable(one) and usable(other):
                change = compare_fits(one, other)
                pairs.append(Pair(first.run.name, later.run.name, name, change))
    return pairs
