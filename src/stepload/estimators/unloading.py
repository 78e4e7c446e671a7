"""Stiffness from the unloading branch, after Oliver and Pharr: a second opinion.

On the way down a contact that has flowed or crept still answers elastically, so the slope at the
top of the unloading branch says something that the loading does not. The branch is fitted by
δ = δ_f + (F/K)^(1/n) on 20–95 % of the force it starts from: the top is left out, where friction
and lost motion turn round, and the bottom, where the power law of the top does not hold. The
contact stiffness is the tangent at the top, S = n F/(δ − δ_f).

It is a *second opinion*: on steps of 50 N, with an arm's quantum of 2 µm, 5–95 % of its errors are
−11 to +8 % of S on an ideal contact; it is 5 % high where the contact creeps and 6 % high where it
flowed.

Where the payload is a sphere of known radius on a flat plate, contact depth h_c = h − 0.75 F/S, the
area A = π (2 R h_c − h_c²) and E_r = √π/2 · S/√A follow (W. C. Oliver, G. M. Pharr, J. Mater. Res.
7 (1992) 1564; β = 1). It needs the depth h, and so the zero of the loading.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.budget import budget
from stepload.estimators.fit import Fit, FloatArray
from stepload.estimators.inverse_law import joint
from stepload.estimators.missing import Missing
from stepload.estimators.sampling import uniform_in_force
from stepload.estimators.smooth import NORMAL_95
from stepload.estimators.sources import Sources

FROM_SHARE, TO_SHARE = 0.2, 0.95
OTHER_SHARES = ((0.4, 0.95), (0.2, 0.8))
"""Ranges of the same branch without its lower and without its upper part."""
LEAST_POINTS = 20
LEAST_RANGE = 0.5
"""Least extent of the branch below its top force, as a share of that force."""
SAMPLES = 3000
SPIKE = 5
"""Samples of a median."""
EPSILON = 0.75
"""h_c = h − ε F/S; exactly 0.75 for a paraboloid, and so for a sphere."""
OPINION = "second opinion only: from −11 to +8 % of its value on an ideal contact"


@dataclass(frozen=True, slots=True)
class Indentation:
    """Depth and stiffness at the top, evaluated for a sphere.

    Attributes:
        depth_m: h at the top, from the zero of the loading.
        contact_depth_m: h_c.
        contact_area_m2: A.
        reduced_modulus_pa: E_r, comparable with (4).
        interval_pa: its 95 % interval, from S and the zero.
    """

    depth_m: float
    contact_depth_m: float
    contact_area_m2: float
    reduced_modulus_pa: float
    interval_pa: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Unloading:
    """The unloading of one cycle.

    Attributes:
        cycle: its number.
        top_force_n: highest force of the fit's branch; S is the tangent there.
        from_n, to_n: forces that were fitted.
        stiffness_n_per_m: S.
        interval_n_per_m: its 95 % interval from all sources of the budget and the shape.
        shape_sigma: relative standard uncertainty of S from the choice of the forces fitted.
        exponent: n of the branch.
        final_m: δ_f, where the branch would come to rest.
        indentation: for a sphere; None without radius or zero.
    """

    cycle: int
    top_force_n: float
    from_n: float
    to_n: float
    stiffness_n_per_m: float
    interval_n_per_m: tuple[float, float]
    shape_sigma: float
    exponent: float
    final_m: float
    indentation: Indentation | None


def unloading(
    deformation_m: FloatArray,
    force_n: FloatArray,
    sources: Sources,
    *,
    cycle: int = 1,
    radius_m: float | None = None,
    zero_m: float = 0.0,
    zero_sigma_m: float = 0.0,
) -> Unloading | Missing:
    """Contact stiffness of an unloading branch.

    Args:
        deformation_m, force_n: (N,) the branch in the order of time, from the top down; the
            payload's deformation, K_s taken out.
        sources: for the interval; the zero is fitted, its own line does not count.
        cycle: its number.
        radius_m: of a sphere on a flat plate.
        zero_m, zero_sigma_m: deformation at which the loading touched, and its uncertainty.
    """
    pressed = force_n > 0.0
    deformation_m, force_n = deformation_m[pressed], force_n[pressed]
    if force_n.size < LEAST_POINTS:
        return Missing(f"{force_n.size} samples on the way down, {LEAST_POINTS} are needed")
    top_n = _top(force_n)
    inside = np.flatnonzero((force_n >= FROM_SHARE * top_n) & (force_n <= TO_SHARE * top_n))
    if inside.size < LEAST_POINTS:
        return Missing(
            f"{inside.size} samples between {FROM_SHARE:.0%} and {TO_SHARE:.0%} of the "
            f"{top_n:.3g} N that the way down starts from, {LEAST_POINTS} are needed"
        )
    low_n = float(force_n[inside].min())
    if low_n > (1.0 - LEAST_RANGE) * top_n:
        return Missing(
            f"the way down ends at {low_n:.3g} N of {top_n:.3g} N: a power law needs it to reach "
            f"{(1.0 - LEAST_RANGE) * top_n:.3g} N"
        )
    chosen = inside[uniform_in_force(force_n[inside], SAMPLES)]
    x, y = deformation_m[chosen], force_n[chosen]
    try:
        fit = joint(x, y, secant_force_n=top_n)
        stated = budget(fit, x, y, replace(sources, force_rate_n_per_s=0.0, zero_sigma_m=None))
    except (DomainError, np.linalg.LinAlgError) as error:
        return Missing(f"the way down takes no power law: {str(error).splitlines()[0]}")
    if fit.doubts:
        return Missing(f"the way down takes no power law: {fit.doubts[0].message}")
    try:
        shape = _shape(fit, x, y, top_n)
    except DomainError as error:
        return Missing(f"parts of the way down take no power law: {error.message}")
    log_ratio = math.log(top_n / fit.k)
    # ln S = ln n + ln F − ln(F/K)/n
    gradient = np.array([1.0 / fit.n, 1.0 / fit.n + log_ratio / fit.n**2, 0.0])
    sigma = math.sqrt(max(float(gradient @ stated.covariance @ gradient), 0.0) + shape**2)
    stiffness = fit.n * top_n / math.exp(log_ratio / fit.n)
    if not math.isfinite(stiffness) or not NORMAL_95 * sigma < 1.0:
        return Missing(
            f"the slope at the top is not determined: u(S)/S = {sigma:.0%} with the noise and "
            "quanta of this rig"
        )
    return Unloading(
        cycle=cycle,
        top_force_n=top_n,
        from_n=low_n,
        to_n=float(y.max()),
        stiffness_n_per_m=stiffness,
        interval_n_per_m=_around(stiffness, sigma),
        shape_sigma=shape,
        exponent=fit.n,
        final_m=fit.zero_m,
        indentation=_indentation(fit, top_n, stiffness, sigma, radius_m, zero_m, zero_sigma_m),
    )


def _shape(fit: Fit, deformation_m: FloatArray, force_n: FloatArray, top_n: float) -> float:
    """Relative standard uncertainty of S for a branch that is no power law.

    Half of the larger change of ln S when the lower or the upper part of the branch is left out.
    The rounding of a loop with 2, 5 and 10 % hysteresis makes S 0.7, 3 and 11 % high and this
    0.9, 3 and 7 %.
    """
    changes = []
    for low, high in OTHER_SHARES:
        inside = (force_n >= low * top_n) & (force_n <= high * top_n)
        other = joint(deformation_m[inside], force_n[inside], secant_force_n=top_n)
        slopes = [each.n * each.secant_n_per_m for each in (fit, other)]
        if not min(slopes) > 0.0:
            raise DomainError("no slope at the top")
        changes.append(abs(math.log(slopes[1] / slopes[0])))
    return 0.5 * max(changes)


def _top(force_n: FloatArray) -> float:
    """The force at which the branch begins: the highest of medians, no single spike of noise."""
    whole = force_n.size // SPIKE * SPIKE
    return float(np.median(force_n[:whole].reshape(-1, SPIKE), axis=1).max())


def _around(value: float, relative: float) -> tuple[float, float]:
    half = NORMAL_95 * relative
    return value * math.exp(-half), value * math.exp(half)


def _indentation(
    fit: Fit,
    top_n: float,
    stiffness: float,
    sigma: float,
    radius_m: float | None,
    zero_m: float,
    zero_sigma_m: float,
) -> Indentation | None:
    if radius_m is None:
        return None
    depth_m = fit.zero_m + (top_n / fit.k) ** (1.0 / fit.n) - zero_m
    contact_m = depth_m - EPSILON * top_n / stiffness
    if not 0.0 < contact_m < radius_m:
        return None
    area_m2 = math.pi * (2.0 * radius_m * contact_m - contact_m**2)
    modulus_pa = 0.5 * math.sqrt(math.pi / area_m2) * stiffness
    # ln E_r = ln S − ln(A)/2; A ~ h_c, and S moves h_c by ε F/S.
    per_depth = 0.5 * 2.0 * math.pi * (radius_m - contact_m) / area_m2
    of_stiffness = (1.0 - per_depth * EPSILON * top_n / stiffness) * sigma
    relative = math.hypot(of_stiffness, per_depth * zero_sigma_m)
    return Indentation(depth_m, contact_m, area_m2, modulus_pa, _around(modulus_pa, relative))
