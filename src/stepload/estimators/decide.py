"""Choice of the fit to use, and whether it is comparable with the paper's tables.

The zero of δ is decisive: where the touch is detected from a force threshold, every fit that
takes the zero as given is wrong by the same amount, whatever its treatment of noise.

=====================================  =========================================================
joint fit                              fit to use
=====================================  =========================================================
usable                                 "joint": K, n and δ0 together; removes 90–96 % of the error
not usable                             the first usable of "rs_btls", "mixed_ls_tls", "odr",
                                       "inverse_ls" and "rs_rtls"; the reasons say why
=====================================  =========================================================

"rs_btls" is always reported as well: it is the number of the paper's Table I. The paper took the
zero as detected, so an exponent from a fit with free δ0 compares with the tables only where both
fits agree. On a rough payload δ0 also absorbs the roughness: the force is then described better,
and the exponent is still less comparable. "mixed_ls_tls" differing from "rs_btls" shows how much
the choice of units matters; "log_ls" and "log_tls" are references, led astray by noise near zero.

A large σ of n is no reason to prefer a two-parameter fit, which is only more certain, not more
right: the secant stiffness stays usable when n is not.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

from stepload.errors import BadInputError
from stepload.estimators.fit import Doubt, Fit, Flag
from stepload.estimators.smooth import NORMAL_95

EXPONENT_HALF_WIDTH = 0.15
"""An exponent with a larger 95 % half width is flagged, and not identified."""
SAME_EXPONENT = 0.02
"""Exponents closer than this compare whatever their σ (they are printed with two decimals)."""

UNUSABLE = frozenset({Flag.NOT_CONVERGED, Flag.ILL_CONDITIONED, Flag.HOLD_WINDUP})
"""Numerical doubts: a fit with one of them is used only if every fit has one."""


@dataclass(frozen=True, slots=True)
class Decision:
    """The chosen fit and the reasons.

    Attributes:
        believe: name of the fit in `fits`.
        why: the reasons, one sentence each, with numbers.
        comparable_with_paper: whether its K and n may be compared with the paper's tables.
        fits: all fits with every doubt attached.
    """

    believe: str
    why: tuple[str, ...]
    comparable_with_paper: bool
    fits: Mapping[str, Fit]


def decide(
    fits: Mapping[str, Fit],
    *,
    sigma_n: Mapping[str, float] | None = None,
    roughness_m: float | None = None,
) -> Decision:
    """Attach the doubt that needs the budget, then choose a fit.

    Args:
        fits: by estimator name, as `fit_all` gives them.
        sigma_n: σ of the exponent by estimator name, from the uncertainty budget; where it is
            missing the covariance from the residuals is used, which is too small.
        roughness_m: σ_eq of the payload; None or 0 where it is smooth.

    Raises:
        BadInputError: there is no fit at all.
    """
    if not fits:
        raise BadInputError("no fit to decide on", hint="check why every estimator failed")
    sigmas = {name: _sigma_n(fit, sigma_n) for name, fit in fits.items()}
    doubted = {
        name: dataclasses.replace(fit, doubts=fit.doubts + undetermined(fit.n, sigmas[name]))
        for name, fit in fits.items()
    }
    believe, why = _choose(doubted)
    comparable, comparison = _compare(doubted, believe, sigmas[believe], roughness_m)
    return Decision(believe, (*why, *comparison), comparable, doubted)


def undetermined(n: float, sigma_n: float | None) -> tuple[Doubt, ...]:
    """A doubt where the 95 % interval of the exponent is too wide."""
    if sigma_n is None or NORMAL_95 * sigma_n <= EXPONENT_HALF_WIDTH:
        return ()
    low, high = n - NORMAL_95 * sigma_n, n + NORMAL_95 * sigma_n
    message = f"this run cannot tell n = {low:.1f} from {high:.1f}"
    return (Doubt(Flag.EXPONENT_UNDETERMINED, message),)


def _sigma_n(fit: Fit, sigma_n: Mapping[str, float] | None) -> float | None:
    if sigma_n is not None and fit.estimator in sigma_n:
        return sigma_n[fit.estimator]
    if fit.covariance is None:
        return None
    return math.sqrt(max(float(fit.covariance[1, 1]), 0.0))


def _usable(fits: Mapping[str, Fit], name: str) -> bool:
    return name in fits and not any(doubt.flag in UNUSABLE for doubt in fits[name].doubts)


def _choose(fits: Mapping[str, Fit]) -> tuple[str, tuple[str, ...]]:
    free = fits.get("joint")
    if _usable(fits, "joint"):
        zero_um = fits["joint"].zero_m * 1e6
        return "joint", (
            f"the zero was detected from force; fitted with K and n it lies at {zero_um:+.2f} µm, "
            "and fits that take it as given are wrong by that much",
        )
    reasons = ["the joint fit of K, n and zero is not usable" if free else "there is no joint fit"]
    if free:
        reasons += [doubt.message for doubt in free.doubts if doubt.flag in UNUSABLE]
    for name in ("rs_btls", "mixed_ls_tls", "odr", "inverse_ls", "rs_rtls"):
        if _usable(fits, name):
            return name, (*reasons, f"{name} is the best of the fits that take the zero as given")
    return next(iter(fits)), (*reasons, "no fit is free of numerical doubt: believe none of them")


def _compare(
    fits: Mapping[str, Fit], believe: str, sigma_n: float | None, roughness_m: float | None
) -> tuple[bool, tuple[str, ...]]:
    """Whether the chosen exponent may be compared with the paper's, and why."""
    if believe in ("rs_btls", "rs_rtls"):
        return True, (f"{believe} is the paper's own estimator",)
    if "rs_btls" not in fits:
        return False, ("there is no rs_btls fit, the paper's estimator, to compare with",)
    believed, paper = fits[believe], fits["rs_btls"]
    numbers = f"n = {believed.n:.2f} against {paper.n:.2f} of rs_btls"
    if believed.zero_m != 0.0 and roughness_m:
        return False, (
            f"the fitted zero also absorbs the roughness ({roughness_m * 1e6:.2g} µm): {numbers}; "
            "the paper's tables hold rs_btls, with a zero taken as found",
        )
    known = max(SAME_EXPONENT, NORMAL_95 * (sigma_n or 0.0))
    if abs(believed.n - paper.n) > known:
        return False, (f"{numbers}: the paper's tables hold rs_btls, with a zero taken as found",)
    return True, (
        f"{numbers}: no further apart than the ±{known:.2g} to which it is known, so both compare"
        " with the paper's tables",
    )
