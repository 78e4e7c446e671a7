"""The headline: chord stiffness between 10 % and 100 % of the top force.

(F_top - F_ref)/(δ(F_top) - δ(F_ref)) needs no zero of the deformation and no law, so it stays true
for every shape of a contact. ASTM E111 leaves out secant and initial tangent moduli for the same
reason: both depend on where a curve begins.
"""

from __future__ import annotations

from dataclasses import dataclass

from stepload.estimators.fit import FloatArray
from stepload.evidence.loops import Branch
from stepload.evidence.path import Path
from stepload.evidence.site import Site, site, top_site

REFERENCE_SHARE = 0.1


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


def reference(path: Path, high: Site) -> float:
    """10 % of the top force, or the lowest force of the data where they begin above that."""
    return max(REFERENCE_SHARE * high.force_n, float(path.force_n.min()))
