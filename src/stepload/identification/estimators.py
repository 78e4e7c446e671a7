"""Every estimator on the same samples of one run."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from stepload.errors import BadInputError, DomainError
from stepload.identification.fit import Doubt, Fit, Flag, FloatArray, force_rms_n
from stepload.identification.inverse_law import inverse_ls, joint
from stepload.identification.ls import log_ls, log_tls, mixed_ls_tls, rs_btls
from stepload.identification.recursive import RsRtls
from stepload.identification.samples import Selected
from stepload.identification.smooth import NORMAL_95
from stepload.identification.weighted import ew_tls, odr

RECURSIVE_FORGETTING = 0.999


def fit_all(
    selected: Selected,
    *,
    secant_force_n: float,
    sigma_m: float | None = None,
    sigma_n: float | None = None,
) -> dict[str, Fit]:
    """All fits of one loading by name; `stepload.identification.estimators` chooses among them.

    Args:
        secant_force_n: where the secants (28) are taken, in N.
        sigma_m: standard deviation of the deformation in m.
        sigma_n: standard deviation of the force in N; "ew_tls" and "odr" need both.

    Returns:
        "log_ls", "log_tls", "rs_btls", "mixed_ls_tls", "inverse_ls", "joint", "rs_rtls", and where
        their inputs are given "ew_tls", "odr". An estimator that refuses the data (too few points
        with positive deformation, say) is missing.

    Raises:
        DomainError: every estimator refuses, or an argument is outside its domain.
    """
    batch, at = selected.samples(selected.batch), secant_force_n
    x, y = batch.deformation_m, batch.force_n
    attempts: list[Callable[[], Fit]] = [
        partial(estimator, x, y, secant_force_n=at)
        for estimator in (log_ls, log_tls, rs_btls, mixed_ls_tls)
    ]
    if sigma_m is not None and sigma_n is not None:
        attempts += [
            partial(estimator, x, y, sigma_m=sigma_m, sigma_n=sigma_n, secant_force_n=at)
            for estimator in (ew_tls, odr)
        ]
    attempts += [
        partial(inverse_ls, x, y, secant_force_n=at, sigma_m=sigma_m),
        partial(joint, x, y, secant_force_n=at, sigma_m=sigma_m),
        partial(recursive_fit, selected, at),
    ]
    return {fit.estimator: fit for fit in _possible(attempts)}


def _possible(attempts: list[Callable[[], Fit]]) -> list[Fit]:
    """The fits that succeed; raises the first refusal where none does.

    An estimator that fails on unsuitable data does not prevent the others.
    """
    fits, refusals = [], []
    for attempt in attempts:
        try:
            with np.errstate(all="ignore"):
                fits.append(attempt())
        except DomainError as refusal:
            refusals.append(refusal)
        except (np.linalg.LinAlgError, ArithmeticError) as error:
            refusals.append(
                DomainError(
                    f"these points determine no law ({error})",
                    hint="is K_s right? Too low a K_s leaves no deformation of the payload",
                )
            )
    if not fits:
        raise refusals[0]
    return fits


def recursive_fit(selected: Selected, secant_force_n: float) -> Fit:
    """The fit "rs_rtls" with its force residual over the samples used.

    Raises:
        DomainError: fewer than three samples that differ.
    """
    fit = RsRtls(RECURSIVE_FORGETTING, secant_force_n, rest_band_n=selected.rest_band_n)
    given = selected.samples(selected.recursive)
    both = zip(given.deformation_m.tolist(), given.force_n.tolist(), strict=True)
    used = np.array([fit.update(x, y) for x, y in both], dtype=bool)
    result = fit.fit()
    if not 0.0 < result.k < math.inf:
        return result
    residual = force_rms_n(
        given.deformation_m[used], given.force_n[used], math.log(result.k), result.n, 0.0
    )
    return dataclasses.replace(result, force_rms_n=residual)


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
    message = f"n = {n:.2f}, 95 % [{low:.2f}, {high:.2f}]"
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


def confidence_band(
    fit: Fit, covariance: FloatArray, deformation_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Lower and upper force (N,) in N of F = K δ^n at deformations (N,) from the zero.

    ln F = ln K + n ln δ is linear in the parameters. The uncertainty of the zero is left out: the
    curve is that of the contact, not of the run.

    Args:
        covariance: (3, 3) of (ln K, n, δ0), from its budget.
        deformation_m: in m, positive.

    Raises:
        DomainError: a deformation that is not positive.
    """
    if not np.all(deformation_m > 0):
        raise DomainError("a confidence band is drawn at positive deformations only")
    x = np.log(deformation_m)
    middle = math.log(fit.k) + fit.n * x
    variance = covariance[0, 0] + 2.0 * x * covariance[0, 1] + x**2 * covariance[1, 1]
    half = NORMAL_95 * np.sqrt(np.maximum(variance, 0.0))
    return np.exp(middle - half), np.exp(middle + half)
