"""The headline: chord stiffness between 10 % and 100 % of the top force.

(F_top - F_ref)/(δ(F_top) - δ(F_ref)) needs no zero of the deformation and no law, so it stays true
for every shape of a contact. ASTM E111 leaves out secant and initial tangent moduli for the same
reason: both depend on where a curve begins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.estimators.smooth import NORMAL_95
from stepload.evidence.loops import Branch
from stepload.evidence.path import Path
from stepload.evidence.site import Site, site, top_site

REFERENCE_SHARE = 0.1
FITTED_FROM = 0.9
"""A chord's fit uses what lies at most this factor beyond its two forces."""
FITTED_STEP = 0.05
"""Forces closer than this share of the top are one place."""
LEAST_PLACES = 5
"""Places that a fit of three numbers needs at least."""


@dataclass(frozen=True, slots=True)
class Chord:
    """A chord of one branch.

    Attributes:
        from_n, to_n: its two forces.
        span_m: difference of the deformations.
        weights: (B,) of the branch: `span_m` is weights @ deformation.
    """

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
        branch: a loading.
        from_n, to_n: the two forces; None: 10 % of the top force, or the lowest force that the
            data reach, and the top.
    """
    path = branch.path
    high = top_site(path) if to_n is None else site(path, to_n)
    low = site(path, reference(path, high) if from_n is None else from_n)
    weights = high.weights - low.weights
    return Chord(low.force_n, high.force_n, float(weights @ branch.deformation_m), weights)


def smoothed(local: Chord, branch: Branch, covariance: FloatArray, q: float) -> Chord:
    """The same chord by generalised least squares over the whole branch.

    δ = a + b F^q + c F^2q, which is a power law with what bends away from it. Where the two ends
    read something else by more than the errors explain with 95 %, the contact has a kink, and the
    ends are believed.

    Args:
        local: read at its two ends.
        branch: that it was read from.
        covariance: (B, B) of the deformation in m².
        q: exponent of the deformation over the force, 1/n.
    """
    path = branch.path
    used = (path.force_n > FITTED_FROM * local.from_n) & (path.force_n < local.to_n / FITTED_FROM)
    places = np.unique(np.round(path.force_n[used] / (FITTED_STEP * local.to_n))).size
    if places < LEAST_PLACES:
        return local
    own = covariance[np.ix_(used, used)]
    columns = _shape(path.force_n[used] / local.to_n, q)
    weighed = np.linalg.solve(own, columns)
    ends = _shape(np.array([local.from_n, local.to_n]) / local.to_n, q)
    weights = np.zeros(path.size)
    weights[used] = np.linalg.solve(columns.T @ weighed, ends[1] - ends[0]) @ weighed.T
    span_m = float(weights @ branch.deformation_m)
    apart = weights - local.weights
    explained_m = NORMAL_95 * math.sqrt(max(float(apart @ covariance @ apart), 0.0))
    if abs(span_m - local.span_m) > explained_m:
        return local
    return replace(local, span_m=span_m, weights=weights)


def _shape(u: FloatArray, q: float) -> FloatArray:
    return np.stack([np.ones_like(u), u**q, u ** (2.0 * q)], axis=1)


def reference(path: Path, high: Site) -> float:
    """10 % of the top force, or the lowest force of the data where they begin above that."""
    return max(REFERENCE_SHARE * high.force_n, float(path.force_n.min()))
