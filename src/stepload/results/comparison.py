"""Several runs side by side, and against a curve from elsewhere."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError
from stepload.identify.budget import Budget
from stepload.identify.compare import (
    Band,
    CurveComparison,
    FitPair,
    Spread,
    compare_curve,
    compare_fits,
    confidence_band,
    spread,
)
from stepload.identify.fit import Fit
from stepload.identify.fit_all import fit_all
from stepload.identify.identification import REPORTED, Identification
from stepload.identify.selection import select
from stepload.record.curves import Curve
from stepload.results.analyse import identify_payload
from stepload.results.press_data import LOADING
from stepload.results.saved import SavedRun

FloatArray = NDArray[np.float64]

COMMON = ("system stiffness K_s", "force calibration")
"""Sources of the budget that runs on one calibrated rig have in common."""


@dataclass(frozen=True, slots=True)
class ComparedRun:
    """One run: its virgin loading, and the reported fits of every cycle by itself."""

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
    """One run's believed fit against the curve."""

    run: str
    estimator: str
    result: CurveComparison


@dataclass(frozen=True, slots=True)
class Comparison:
    """Everything that was compared; secants are at `secant_force_n`."""

    secant_force_n: float
    runs: tuple[ComparedRun, ...]
    spreads: Mapping[str, EstimatorSpread]
    pairs: tuple[Pair, ...]
    curve: tuple[AgainstCurve, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CurveGiven:
    """A curve from another machine or finite elements, and the modulus it was made with.

    `modulus_pa` is its equivalent modulus (4); `plate_pa` E/(1 − ν²) of its counter body, where
    that alone differs from the run's. None for both: it needs no correction.
    """

    curve: Curve
    modulus_pa: float | None = None
    plate_pa: float | None = None


def compare(
    runs: Sequence[SavedRun],
    *,
    secant_force_n: float | None = None,
    given: CurveGiven | None = None,
) -> Comparison:
    """Compare payload runs with each other and with a curve.

    Args:
        runs: records, in the order of the tests; the first is test 1.
        secant_force_n: where all secants are taken; the lowest of the runs' own where None.
        given: a curve to compare with.

    Raises:
        BadInputError: fewer than two things to compare, or a run that has nothing to identify.
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
    at = secant_force_n or min(run.conditions.secant_force_n for run in runs)
    compared = tuple(_identified(run, at) for run in runs)
    return Comparison(
        secant_force_n=at,
        runs=compared,
        spreads=_spreads(compared),
        pairs=tuple(_pairs(compared)),
        curve=() if given is None else tuple(_against(each, given) for each in compared),
        notes=tuple(_notes(compared, given)),
    )


def virgin_band(each: ComparedRun, points: int = 120) -> Band | None:
    """The believed curve of a run with its 95 % band; None where it has no budget."""
    found = each.found
    if found.budget is None:
        return None
    top = (found.peak_force_n / found.fit.k) ** (1.0 / found.fit.n)
    deformation = np.linspace(0.0, top, points + 1)[1:]
    return confidence_band(found.fit, found.budget.covariance, deformation)


def _identified(run: SavedRun, secant_force_n: float) -> ComparedRun:
    conditions = dataclasses.replace(run.conditions, secant_force_n=secant_force_n)
    found = identify_payload(run.data, conditions)
    numbers = np.unique(run.data.cycle[run.data.branch(LOADING)])
    cycles = {int(number): _cycle_fits(run, int(number), secant_force_n) for number in numbers}
    return ComparedRun(run, found, cycles)


def _cycle_fits(run: SavedRun, cycle: int, secant_force_n: float) -> dict[str, Fit]:
    loading = run.data.branch(LOADING, cycle)
    selected = select(
        run.data.travel_m[loading],
        run.data.force_n[loading],
        system_stiffness_n_per_m=run.conditions.sources.system_stiffness_n_per_m,
        time_s=run.data.time_s[loading],
    )
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


def _pairs(runs: Sequence[ComparedRun]) -> list[Pair]:
    pairs = []
    for later in runs[1:]:
        first = runs[0]
        for name in REPORTED:
            one, other = first.found.fits.get(name), later.found.fits.get(name)
            if one is None or other is None or not (_usable(one) and _usable(other)):
                continue
            budgets = [each.found.budgets.get(name) for each in (first, later)]
            pairs.append(
                Pair(first.run.name, later.run.name, name, _change(one, other, budgets,
                     shared=_same_calibration(first.run, later.run)))
            )  # fmt: skip
    return pairs


def _change(one: Fit, other: Fit, budgets: Sequence[Budget | None], *, shared: bool) -> FitPair:
    stated = [budget for budget in budgets if budget is not None]
    if len(stated) < 2:
        return compare_fits(one, other)
    common = min(_common_sigma(budget) for budget in stated) if shared else 0.0
    return compare_fits(
        one, other,
        first_sigma=stated[0].sigma_secant_relative,
        second_sigma=stated[1].sigma_secant_relative,
        shared_sigma=common,
    )  # fmt: skip


def _common_sigma(budget: Budget) -> float:
    return math.hypot(*(line.secant_relative for line in budget.lines if line.source in COMMON))


def _same_calibration(one: SavedRun, other: SavedRun) -> bool:
    """Whether both went by one force sensor and one K_s."""
    keys = ("rig", "force_axis", "force")
    same = all(one.metadata.get(key) == other.metadata.get(key) for key in keys)
    stiffness = {run.conditions.sources.system_stiffness_n_per_m for run in (one, other)}
    return same and len(stiffness) == 1


def _against(each: ComparedRun, given: CurveGiven) -> AgainstCurve:
    found, conditions = each.found, each.run.conditions
    curve = given.curve
    if curve.displacement_m is None:
        raise BadInputError(
            "the curve has no column displacement_m",
            hint="its system stiffness must be out of it: columns displacement_m, force_n",
        )
    covariance = found.budget.covariance if found.budget else found.fit.covariance
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
    if other_pa is not None and own_pa is None:
        raise BadInputError(f"{each.run.path}: the record does not tell its equivalent modulus")
    peak = int(np.argmax(curve.force_n)) + 1
    result = compare_curve(
        found.fit, covariance, curve.displacement_m[:peak], curve.force_n[:peak],
        curve_modulus_pa=other_pa, modulus_pa=own_pa if other_pa is not None else None,
    )  # fmt: skip
    return AgainstCurve(each.run.name, found.believe, result)


def _notes(runs: Sequence[ComparedRun], given: CurveGiven | None) -> list[str]:
    notes = []
    payloads = sorted({each.run.metadata.get("payload", "") for each in runs})
    if len(payloads) > 1:
        notes.append(f"different payloads: {', '.join(payloads)}")
    if len(runs) > 1 and not all(_same_calibration(runs[0].run, r.run) for r in runs[1:]):
        notes.append("different rigs or calibrations: no uncertainty is taken as common")
    if any(len(each.cycles) > 1 for each in runs):
        notes.append(
            "values within a run are its cycles: the first is the virgin contact, and a run-in "
            "shows as spread"
        )
    if len(runs) > 1:
        notes.append(
            "errors that runs share (K_s, force calibration, kinematics of one pose) do not show "
            "in their spread"
        )
    if given is not None and given.modulus_pa is None and given.plate_pa is None:
        notes.append("the curve is compared as it is: no modulus was given to correct it by (V-A)")
    return notes
