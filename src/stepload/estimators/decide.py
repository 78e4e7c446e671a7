"""Choice of the fit to use, and whether it is comparable with the paper's tables.

The zero of δ decides: where the touch is found by a force threshold, every fit that takes the zero
as given is wrong by the same amount. So "joint", which fits it, is used where it is usable (it
removes 90–96 % of that error), else the best of the others. "rs_btls" is the paper's Table I, with
the zero as detected: an exponent compares with the tables only where both fits agree. On a rough
payload the fitted zero absorbs the roughness too. "log_ls" and "log_tls" are references, led astray
by noise near zero.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stepload.errors import BadInputError
from stepload.estimators.fit import Doubt, Fit, Flag, FloatArray
from stepload.estimators.smooth import NORMAL_95

EXPONENT_HALF_WIDTH = 0.15
"""An exponent with a larger 95 % half width is flagged, and not identified."""
SAME_EXPONENT = 0.02
"""Exponents closer than this compare whatever their σ (they are printed with two decimals)."""
UNUSABLE = frozenset({Flag.NOT_CONVERGED, Flag.ILL_CONDITIONED, Flag.HOLD_WINDUP})
"""Numerical doubts: a fit with one of them is used only if every fit has one."""
ORDER = ("joint", "rs_btls", "mixed_ls_tls", "odr", "inverse_ls", "rs_rtls")
"""The first usable one is used."""


@dataclass(frozen=True, slots=True)
class Decision:
    """The chosen fit, the reasons, and all fits with every doubt attached."""

    selected: str
    why: tuple[str, ...]
    comparable_with_paper: bool
    fits: Mapping[str, Fit]


def decide(
    fits: Mapping[str, Fit],
    *,
    covariance: FloatArray | None = None,
    roughness_m: float | None = None,
) -> Decision:
    """Attach the doubt about the exponent, then choose a fit.

    Args:
        fits: by estimator name, as `fit_all` gives them.
        covariance: (3, 3) of (ln K, n, δ0), all errors in it; without it that of the residuals is
            used, which is too small.
        roughness_m: σ_eq of the payload; None or 0 where it is smooth.

    Raises:
        BadInputError: there is no fit at all.
    """
    if not fits:
        raise BadInputError("no fit to decide on", hint="check why every estimator failed")
    sigmas = {name: _sigma_n(fit, covariance) for name, fit in fits.items()}
    doubted = {
        name: dataclasses.replace(fit, doubts=fit.doubts + undetermined(fit.n, sigmas[name]))
        for name, fit in fits.items()
    }
    usable = [name for name in ORDER if name in fits and not _unusable(fits[name])]
    if not usable:
        why = "no fit is free of numerical doubt: use none of them"
        selected = next(iter(fits))
    elif usable[0] == "joint":
        selected, zero_um = "joint", fits["joint"].zero_m * 1e6
        why = (
            f"the zero was detected from force; fitted with K and n it lies at {zero_um:+.2f} µm, "
            "and fits that take it as given are wrong by that much"
        )
    else:
        selected = usable[0]
        lacks = _unusable(fits["joint"]) if "joint" in fits else ["there is no joint fit"]
        why = f"{selected} takes the zero as given; there is no better fit: {'; '.join(lacks)}"
    comparable, comparison = _compare(doubted, selected, sigmas[selected], roughness_m)
    return Decision(selected, (why, comparison), comparable, doubted)


def undetermined(n: float, sigma_n: float | None) -> tuple[Doubt, ...]:
    """A doubt where the 95 % interval of the exponent is too wide."""
    if sigma_n is None or NORMAL_95 * sigma_n <= EXPONENT_HALF_WIDTH:
        return ()
    low, high = n - NORMAL_95 * sigma_n, n + NORMAL_95 * sigma_n
    message = f"this run cannot tell n = {low:.1f} from {high:.1f}"
    return (Doubt(Flag.EXPONENT_UNDETERMINED, message),)


def secant_sigma(fit: Fit, covariance: FloatArray) -> float:
    """Relative standard uncertainty of the secant (28): ln S = ln K/n + (1 − 1/n) ln F."""
    log_ratio = math.log(fit.secant_force_n) - math.log(fit.k)
    gradient = np.array([1.0 / fit.n, log_ratio / fit.n**2, 0.0])
    return math.sqrt(max(float(gradient @ covariance @ gradient), 0.0))


def _sigma_n(fit: Fit, covariance: FloatArray | None) -> float | None:
    stated = fit.covariance if covariance is None else covariance
    return None if stated is None else math.sqrt(max(float(stated[1, 1]), 0.0))


def _unusable(fit: Fit) -> list[str]:
    return [doubt.message for doubt in fit.doubts if doubt.flag in UNUSABLE]


def _compare(
    fits: Mapping[str, Fit], selected: str, sigma_n: float | None, roughness_m: float | None
) -> tuple[bool, str]:
    """Whether the chosen exponent may be compared with the paper's, and why."""
    if selected in ("rs_btls", "rs_rtls"):
        return True, f"{selected} is the paper's own estimator"
    if "rs_btls" not in fits:
        return False, "there is no rs_btls fit, the paper's estimator, to compare with"
    chosen, paper = fits[selected], fits["rs_btls"]
    numbers = f"n = {chosen.n:.2f} against {paper.n:.2f} of rs_btls"
    if chosen.zero_m != 0.0 and roughness_m:
        return False, (
            f"{numbers}: the fitted zero also absorbs the roughness ({roughness_m * 1e6:.2g} µm)"
        )
    known = max(SAME_EXPONENT, NORMAL_95 * (sigma_n or 0.0))
    if abs(chosen.n - paper.n) > known:
        return False, f"{numbers}: the paper's tables hold rs_btls, with a zero taken as found"
    return True, f"{numbers}: no further apart than ±{known:.2g}, to which it is known"
