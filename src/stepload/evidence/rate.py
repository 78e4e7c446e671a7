"""Rate dependence of the deformation: holds compared with the ramps that lead to and from them.

An elastic contact has the same deformation at a force, however fast it was applied. A viscous one
lags behind its force in a ramp and catches up in the hold, often during the first samples of the
hold, so that the hold itself looks settled. A force that is recorded late has the opposite effect.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from stepload.estimators.fit import FloatArray, IntArray
from stepload.evidence.elastic import Elastic
from stepload.evidence.loops import Branch, Loop
from stepload.evidence.path import Path
from stepload.evidence.signs import Sign

REACH = 0.1
"""Stretches of a ramp within this share of a hold's force are compared with it."""


def rate_sign(loops: Sequence[Loop], elastic: Elastic) -> Sign | None:
    """Deformation in the holds less that of the neighbouring ramps at the same force, in m.

    The mean over the holds of the first two loadings that have a ramp on both sides: steady creep
    or drift cancels. None without any.
    """
    found: list[tuple[Branch, FloatArray]] = []
    for loop in loops[:2]:
        found += [(loop.loading, weights) for weights in _corners(loop.loading.path)]
    if not found:
        return None
    terms = tuple((branch, weights / len(found)) for branch, weights in found)
    value = sum(float(w @ (b.path.travel_m - elastic.travel(b.path.force_n))) for b, w in terms)
    return Sign("rate", value, terms, elastic.top_n)


def _corners(path: Path) -> Iterator[FloatArray]:
    """(B,) weights of hold less ramps, for every hold between two ramps."""
    parts = np.split(np.arange(path.size), np.flatnonzero(np.diff(path.held)) + 1)
    for before, hold, after in zip(parts[:-2], parts[1:-1], parts[2:], strict=True):
        if path.held[hold[0]] == 0 or path.held[before[0]] or path.held[after[0]]:
            continue
        rest = _mean(path, hold)
        at_n = float(rest @ path.force_n)
        up, on = (_mean(path, _near(path, ramp, at_n)) for ramp in (before[::-1], after))
        low_n, high_n = float(up @ path.force_n), float(on @ path.force_n)
        if low_n < at_n < high_n:
            share = (at_n - low_n) / (high_n - low_n)
            yield rest - (1.0 - share) * up - share * on


def _near(path: Path, ramp: IntArray, at_n: float) -> IntArray:
    """Which stretches of a ramp, the next one to the hold first, are near a force."""
    near = np.abs(path.force_n[ramp] - at_n) <= REACH * at_n
    near[0] = True
    return np.asarray(ramp[near])


def _mean(path: Path, part: IntArray) -> FloatArray:
    """(B,) weights of the mean over some stretches."""
    weights = np.zeros(path.size)
    weights[part] = path.count[part] / path.count[part].sum()
    return weights
