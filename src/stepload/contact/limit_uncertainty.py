"""Uncertainty of the elastic limit F_c: its standard uncertainty and its lower end.

F_c (13) is proportional to Y³R²/E², so it is known much less well than these numbers. ln F_c is
taken as normal, with the uncertainties of its sources added in squares (GUM, JCGM 100, 5.1):

    u(ln F_c)² = (3 u_Y)² + (2 u_R)² + (2 u_E)² + (∂ln F_c/∂ν u_ν)²
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.contact.elastic import equivalent_modulus, equivalent_radius, plane_compliance
from stepload.contact.limit import onset_in, softer_body
from stepload.contact.materials import Geometry, Material, Sphere

ASSUMED_YIELD = 0.05
"""Relative standard uncertainty of a yield strength out of a handbook."""
ASSUMED_MODULUS = 0.05
ASSUMED_RADIUS = 0.02
ASSUMED_POISSON = 0.03
"""Standard uncertainty of Poisson's ratio, absolute."""


@dataclass(frozen=True, slots=True)
class Source:
    """One source of the uncertainty of F_c.

    Attributes:
        what: name of the number.
        sigma: its standard uncertainty; relative, of Poisson's ratio absolute.
        sigma_ln: its contribution to u(ln F_c).
        assumed: it was not stated, so that of a handbook value is used.
        relative: whether `sigma` is a share.
    """

    what: str
    sigma: float
    sigma_ln: float
    assumed: bool
    relative: bool = True

    @property
    def shown(self) -> str:
        """The uncertainty as it is written in a plan."""
        return f"± {self.sigma * 100.0:.2g} %" if self.relative else f"± {self.sigma:.2g}"


@dataclass(frozen=True, slots=True)
class DoubtedLimit:
    """F_c of one body with its uncertainty.

    `sources` are the sources of its uncertainty; `sigma_ln` is u(ln F_c).
    """

    force_n: float
    sources: tuple[Source, ...]

    @property
    def sigma_ln(self) -> float:
        """u(ln F_c), about the relative standard uncertainty of F_c."""
        return math.hypot(*(source.sigma_ln for source in self.sources))

    def lower_end(self, coverage: float) -> float:
        """F_c exp(-k u) in N, `coverage` k standard uncertainties below F_c."""
        return self.force_n * math.exp(-coverage * self.sigma_ln)

    def probability_below(self, force_n: float) -> float:
        """Probability that the true F_c lies below a force in N."""
        if self.sigma_ln == 0.0:
            return 0.0
        z = math.log(force_n / self.force_n) / self.sigma_ln
        return 0.5 * math.erfc(-z / math.sqrt(2.0))


def doubted_limits(
    geometry: Geometry, material: Material, plate: Material
) -> tuple[DoubtedLimit, ...]:
    """F_c and its uncertainty for each body that may yield first, the softer one before the other.

    Yield strengths that are close together or poorly known do not determine which body yields
    first; the contact is elastic below the limits of both. Empty where theory has no limit
    (`no_limit_reason`).

    Raises:
        DomainError: a number outside the domain of the theory.
    """
    if softer_body(material, plate) is None:
        return ()
    pairs = [(material, plate), (plate, material)]
    if softer_body(material, plate) is plate:
        pairs.reverse()
    found = (limit_in(body, other, geometry) for body, other in pairs)
    return tuple(limit for limit in found if limit is not None)


def limit_in(body: Material, other: Material, geometry: Geometry) -> DoubtedLimit | None:
    """F_c and its uncertainty if it is `body` that yields first, pressed with `other`; None where
    theory has none for this geometry, or the yield strength of `body` is not known.

    Raises:
        DomainError: a number outside the domain of the theory.
    """
    onset = onset_in(body, geometry, other, body)
    if onset is None:
        return None
    sources = (*_strength(body, other), *_radii(geometry), _moduli(body, other))
    return DoubtedLimit(onset.force_n, sources)


def probability_below(limits: tuple[DoubtedLimit, ...], force_n: float) -> float:
    """Upper bound, a sum over the bodies, of the probability that one yields below a force."""
    return min(1.0, sum(limit.probability_below(force_n) for limit in limits))


def _strength(body: Material, other: Material) -> tuple[Source, ...]:
    """Yield strength and Poisson's ratios; that of the yielding body also acts through E_eq.

    ν raises P and lowers 1/E_eq, and the two partly cancel. The uncertainty used is not below that
    of P alone, since P = 0.454 + 0.41 ν is only a fit.
    """
    p_slope = 3.0 * 0.41 / (0.454 + 0.41 * body.poisson_ratio)
    slope = max(p_slope, abs(p_slope - _modulus_slope(body, other)))
    strength_pa = body.yield_strength_pa
    assert strength_pa is not None
    sigma_pa = body.yield_strength_sigma_pa
    return (
        _source(f"yield strength of {body.name}", strength_pa, sigma_pa, 3.0, ASSUMED_YIELD),
        _poisson(body, slope),
        _poisson(other, abs(_modulus_slope(other, body))),
    )


def _moduli(body: Material, other: Material) -> Source:
    """E_eq: both moduli, each by its share; a common cause may affect both in the same direction,
    so they are added and not squared."""
    sigma, assumed = 0.0, False
    for each, rest in ((body, other), (other, body)):
        stated = each.youngs_modulus_sigma_pa
        relative = ASSUMED_MODULUS if stated is None else stated / each.youngs_modulus_pa
        sigma += _share(each, rest) * relative
        assumed |= stated is None
    return Source("Young's moduli", sigma, 2.0 * sigma, assumed)


def _radii(geometry: Geometry) -> tuple[Source, ...]:
    radius_m = getattr(geometry, "radius_m", None)
    whole_m = equivalent_radius(geometry)
    assert whole_m is not None
    if radius_m is None:
        return (Source("radius", ASSUMED_RADIUS, 2.0 * ASSUMED_RADIUS, assumed=True),)
    found = [("radius", radius_m, getattr(geometry, "radius_sigma_m", None))]
    if isinstance(geometry, Sphere) and geometry.counter_radius_m is not None:
        found.append(("counter radius", geometry.counter_radius_m, geometry.counter_radius_sigma_m))
    return tuple(
        _source(what, size_m, sigma_m, 2.0 * whole_m / size_m, ASSUMED_RADIUS)
        for what, size_m, sigma_m in found
    )


def _share(body: Material, other: Material) -> float:
    """Share of 1/E_eq (4) that is this body's."""
    return plane_compliance(body) * equivalent_modulus(body, other)


def _modulus_slope(body: Material, other: Material) -> float:
    """∂ln(E_eq²)/∂ν of one body."""
    ratio = body.poisson_ratio
    return 4.0 * ratio / (1.0 - ratio**2) * _share(body, other)


def _poisson(body: Material, slope: float) -> Source:
    stated = body.poisson_ratio_sigma
    sigma = ASSUMED_POISSON if stated is None else stated
    return Source(f"Poisson's ratio of {body.name}", sigma, slope * sigma, stated is None, False)


def _source(what: str, value: float, sigma: float | None, power: float, usual: float) -> Source:
    relative = usual if sigma is None else sigma / value
    return Source(what, relative, power * relative, sigma is None)
