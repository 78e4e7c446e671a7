"""The chord stiffness of a branch, from the deformations at its two forces.

(F_top - F_ref)/(δ(F_top) - δ(F_ref)), from 10 % to 100 % of the top force, needs no zero and no law
(ASTM E111). A deformation at one force is a weighted sum of the branch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from statistics import median

import numpy as np
from numpy.typing import NDArray

from stepload.identification.fit import FloatArray
from stepload.identification.loops import HEAVIEST, Branch, Path
from stepload.identification.smooth import NORMAL_95

REACH = 0.2
"""Samples within this share of the force about it are used."""
TOP_REACH = 0.15
AT_TOP = 0.97
"""A hold of at least this share of the largest force is the top."""
_FEWEST = 3
REFERENCE_SHARE = 0.1
FITTED_STEP = 0.05
"""Forces closer than this share of the top are one place."""
LEAST_PLACES = 5
"""Places that a fit of three numbers needs at least."""
KNEES = (0.03, 0.06, *np.arange(0.1, 0.96, 0.05).tolist())
"""Forces at which a kink is looked for, as shares of the top."""
LEAST_LEFT = 1e-6
"""Share of a kink that the smooth curve must leave."""
KINK = 16.0
"""χ² by which a kink must fit better than none: four standard deviations."""


@dataclass(frozen=True, slots=True)
class LocalDeformation:
    """The deformation at `force_n` is `weights` (B,) @ deformation."""

    force_n: float
    weights: FloatArray


def top_deformation(path: Path) -> LocalDeformation:
    """At the largest force: the hold there, or the end of the loading."""
    largest_n = float(path.force_n.max())
    held = (path.held > 0) & (path.force_n >= AT_TOP * largest_n)
    if held.any():
        # The first hold at the top is used; a later one of the same level adds creep.
        return _mean_deformation(path, held & (path.held == path.held[held][0]))
    return deformation_at(path, largest_n, TOP_REACH)


def deformation_at(path: Path, force_n: float, reach: float = REACH) -> LocalDeformation:
    """At a force within the path: a straight line through the stretches about it."""
    near = np.abs(path.force_n - force_n) <= reach * force_n
    if near.sum() < _FEWEST:
        near = np.zeros(path.size, dtype=bool)
        near[np.argsort(np.abs(path.force_n - force_n))[:_FEWEST]] = True
    moving = near & (path.held == 0)
    usual = median(path.count[moving].tolist()) if moving.any() else float(path.count.max())
    weight = np.where(near, np.minimum(path.count, HEAVIEST * usual), 0.0)
    weight /= weight.sum()
    mean_n = float(weight @ path.force_n)
    away = path.force_n - mean_n
    spread = float(weight @ away**2)
    if spread > (1e-3 * force_n) ** 2:
        weight = weight * (1.0 + (force_n - mean_n) * away / spread)
    return LocalDeformation(force_n, weight)


def held_deformation(path: Path, hold_force_n: float) -> LocalDeformation | None:
    """In the hold nearest to a force; None where there is none within a tenth of it."""
    held = path.held > 0
    if not held.any():
        return None
    nearest = int(np.argmin(np.where(held, np.abs(path.force_n - hold_force_n), np.inf)))
    if abs(path.force_n[nearest] - hold_force_n) > 0.1 * hold_force_n:
        return None
    return _mean_deformation(path, path.held == path.held[nearest])


def _mean_deformation(path: Path, stretches: NDArray[np.bool_]) -> LocalDeformation:
    """The mean over some stretches (B,), at their mean force."""
    weights = np.where(stretches, path.count, 0.0)
    weights /= weights.sum()
    return LocalDeformation(float(weights @ path.force_n), weights)


@dataclass(frozen=True, slots=True)
class Chord:
    """A chord of one branch; `span_m`, the deformation in it, is `weights` (B,) @ deformation."""

    from_n: float
    to_n: float
    span_m: float
    weights: FloatArray

    @property
    def n_per_m(self) -> float:
        """The chord stiffness in N/m; negative where the deformation does not rise."""
        return (self.to_n - self.from_n) / self.span_m


def chord(branch: Branch, from_n: float | None = None, to_n: float | None = None) -> Chord:
    """The chord of a branch.

    Args:
        from_n, to_n: the two forces; None: 10 % of the top force, or the lowest force that the
            data reach, and the top.
    """
    path = branch.path
    high = top_deformation(path) if to_n is None else deformation_at(path, to_n)
    low = deformation_at(path, reference(path, high) if from_n is None else from_n)
    weights = high.weights - low.weights
    return Chord(low.force_n, high.force_n, float(weights @ branch.deformation_m), weights)


@dataclass(frozen=True, slots=True)
class Smooth:
    """δ = a + b F^q + c F^2q by generalised least squares over a branch, F in `unit_n`.

    (a, b, c) are `estimator` (3, B) @ deformation, the curve is `columns` (B, 3) @ (a, b, c); q is
    1/n. `kinked`: the data show a kink, which the curve does not have.
    """

    estimator: FloatArray
    columns: FloatArray
    q: float
    unit_n: float
    kinked: bool = False

    def span(self, from_n: float, to_n: float) -> FloatArray:
        """(B,) weights of the difference of the deformations at two forces."""
        low, high = _shape(np.array([from_n, to_n]) / self.unit_n, self.q)
        return np.asarray((high - low) @ self.estimator)

    def left(self, weights: FloatArray) -> FloatArray:
        """(B,) weights of what a sum of deformations is more than that of the curve."""
        return np.asarray(weights - (weights @ self.columns) @ self.estimator)

    def slope(self, at_n: float) -> FloatArray:
        """(B,) weights of the compliance in m/N at a force."""
        u, q = at_n / self.unit_n, self.q
        slopes = np.array([0.0, q * u ** (q - 1.0), 2.0 * q * u ** (2.0 * q - 1.0)])
        return np.asarray(slopes / self.unit_n @ self.estimator)


def smooth_of(branch: Branch, covariance: FloatArray, q: float) -> Smooth | None:
    """The smooth curve through a branch; None where it has too few forces.

    Args:
        covariance: (B, B) of the deformation in m².
        q: exponent of the deformation over the force, 1/n.
    """
    force_n = branch.path.force_n
    top_n = float(force_n.max())
    if np.unique(np.round(force_n / (FITTED_STEP * top_n))).size < LEAST_PLACES:
        return None
    columns = _shape(force_n / top_n, q)
    weighed = np.linalg.solve(covariance, columns)
    found = Smooth(np.linalg.solve(columns.T @ weighed, weighed.T), columns, q, top_n)
    bends = np.maximum(force_n[:, None] / top_n - np.array(KNEES), 0.0)
    weights = np.linalg.solve(covariance, bends)
    left = np.array([found.left(each) for each in weights.T])
    shown, whole = np.sum(left.T * bends, axis=0), np.sum(weights * bends, axis=0)
    told = shown > LEAST_LEFT * whole
    most = float(np.max((left[told] @ branch.deformation_m) ** 2 / shown[told], initial=0.0))
    return replace(found, kinked=most > KINK)


def smoothed(local: Chord, branch: Branch, covariance: FloatArray, smooth: Smooth | None) -> Chord:
    """The chord of the smooth curve. Where the contact has a kink, or the data near its two ends
    leave it by more than the errors explain with 95 %, what they leave is added."""
    if smooth is None:
        return local
    weights = smooth.span(local.from_n, local.to_n)
    left = smooth.left(local.weights)
    explained_m = NORMAL_95 * math.sqrt(max(float(left @ covariance @ left), 0.0))
    if smooth.kinked or abs(float(left @ branch.deformation_m)) > explained_m:
        weights = weights + left
    return replace(local, span_m=float(weights @ branch.deformation_m), weights=weights)


def _shape(u: FloatArray, q: float) -> FloatArray:
    return np.stack([np.ones_like(u), u**q, u ** (2.0 * q)], axis=1)


def reference(path: Path, high: LocalDeformation) -> float:
    """10 % of the top force, or the lowest force of the data where they begin above that."""
    return max(REFERENCE_SHARE * high.force_n, float(path.force_n.min()))
