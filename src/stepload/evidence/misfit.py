"""Lack of fit of a law against the scatter of the run itself, independent of stated errors.

A lack-of-fit test in the sense of the analysis of variance compares the misfit of a law with the
pure error, which only repeated visits of the same force can show. Both are read from the run, so
errors that were stated too large hide no misfit. An error that is smooth over force repeats from
visit to visit and is in the misfit but not in the pure error; so the ratio has no F distribution
even for the true law, and its threshold comes from rehearsals of the run's own ideal contact. How
well such errors repeat is not known: a misfit that the stated errors alone explain is allowed too,
but only up to a share of the deformation; beyond it the scatter has to confirm it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.evidence.elastic import Elastic
from stepload.evidence.gates import HARMLESS, Gate, judged
from stepload.evidence.lawfit import LawFit
from stepload.evidence.loops import Branch
from stepload.evidence.path import HEAVIEST, Path
from stepload.evidence.rehearse import QUANTILE
from stepload.units import format_quantity

TRUSTED = 0.02
"""Largest misfit, as a share of the deformation, that the stated errors alone may explain."""


class Visit(NamedTuple):
    """One loading: its path, its deviation from the elastic contact (B,), and the same of the
    rehearsals (B, R), in m."""

    path: Path
    off_m: FloatArray
    rehearsed_m: FloatArray


def visit(branch: Branch, elastic: Elastic, drawn: FloatArray) -> Visit:
    """Compare a loading with the elastic contact; `drawn` (B, R) is its rehearsed travel in m."""
    force_n = branch.path.force_n
    off_m = branch.deformation_m - elastic.deformation(force_n)
    return Visit(branch.path, off_m, drawn - elastic.travel(force_n)[:, None])


def misfit_of(visits: Sequence[Visit], elastic: Elastic, law: LawFit, span_m: float) -> Gate | None:
    """The gate of a law's misfit, against the spread between two loadings.

    Args:
        visits: the loadings, that of the law first; a single one has no pure error, and no gate.
        elastic: the contact that was rehearsed.
        law: the law in use, or the chosen one.
        span_m: deformation between the chord's forces.
    """
    if len(visits) < 2:
        return None
    first, second = visits[:2]
    weights = np.minimum(first.path.count, HEAVIEST * float(np.median(first.path.count)))
    weights = weights / weights.sum()
    force_n, point = first.path.force_n, law.best
    law_m = np.array([law.gradient(point.shape, each) @ point.coefficients for each in force_n])
    off_m = (first.off_m + elastic.deformation(force_n) - law_m)[:, None]
    misfit_m = float(_left(elastic, law, first.path, off_m, weights)[0])
    spread_m = float(
        _spread(first, second, weights, first.off_m[:, None], second.off_m[:, None])[0]
    )
    rehearsed = _left(elastic, law, first.path, first.rehearsed_m, weights)
    spreads = _spread(first, second, weights, first.rehearsed_m, second.rehearsed_m)
    times = float(np.quantile(rehearsed / np.maximum(spreads, 1e-300), QUANTILE))
    stated_m = min(float(np.quantile(rehearsed, QUANTILE)), TRUSTED * span_m)
    allowed_m = max(times * spread_m, stated_m, HARMLESS * span_m)
    scatter = format_quantity(spread_m, "m")
    return judged(
        "misfit", misfit_m, allowed_m, "m", blocks="law", law=law.law.name, scatter=scatter
    )


def _rms(left_m: FloatArray, weights: FloatArray) -> FloatArray:
    """Root of the mean square (R,) of (B, R) about its mean."""
    return np.asarray(np.sqrt(weights @ (left_m - weights @ left_m) ** 2))


def _spread(
    first: Visit, second: Visit, weights: FloatArray, one_m: FloatArray, other_m: FloatArray
) -> FloatArray:
    """Standard deviation (R,) of one visit, from the difference of two at the same forces; a shift
    common to all forces is no scatter."""
    order = np.argsort(second.path.force_n)
    force = second.path.force_n[order]
    place = np.clip(np.searchsorted(force, first.path.force_n), 1, force.size - 1)
    width = np.maximum(force[place] - force[place - 1], 1e-300)
    share = np.clip((first.path.force_n - force[place - 1]) / width, 0.0, 1.0)[:, None]
    there = other_m[order]
    again = there[place - 1] * (1.0 - share) + there[place] * share
    return np.asarray(_rms(one_m - again, weights) / np.sqrt(2.0))


def _left(
    elastic: Elastic, law: LawFit, path: Path, off_m: FloatArray, weights: FloatArray
) -> FloatArray:
    """Rms misfit (R,) of a law for deviations (B, R) from it; its zero, its size and, if free, its
    power are fitted to them."""
    u = path.force_n / elastic.top_n
    curve = u ** (law.best.shape if law.law.parameters == 1 else elastic.q)
    root = np.sqrt(weights)[:, None]
    columns = np.column_stack([np.ones_like(u), curve, curve * np.log(u)])
    columns = columns[:, : 1 + law.law.parameters] * root
    found = np.linalg.lstsq(columns, off_m * root, rcond=None)[0]
    return _rms(off_m - columns @ found / root, weights)
