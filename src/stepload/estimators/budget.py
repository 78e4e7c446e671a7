"""The honest interval: an uncertainty budget after the GUM, one line per source.

Residuals show only what a fit could not absorb. With a smooth position error and an error of K_s
in the data, intervals from residuals (covariance, profile likelihood, HAC, block bootstrap) cover
the truth in 20 to 70 % of runs where they promise 95. Here each source is stated with its size
and carried through the estimator to first order.

Which fit to hang it on: the joint fit of (K, n, δ0). A touch threshold finds the zero late by the
deformation at the threshold, which biases every two-parameter fit; their budget therefore needs
`zero_sigma_m` and is wider.

The sizes of the sources are taken as known, but for the smooth error: estimated from one K_s run it
is itself known only to a third or so. Use `smooth_error_m` of `SystemStiffnessFit`, not the rms
misfit, which lacks what the line absorbed, with its `smooth_degrees`; several runs pooled
(`stepload.estimators.pool`) give a narrower interval.

Example:
    >>> import numpy as np
    >>> from stepload.estimators.fit import Fit
    >>> force = np.linspace(3.0, 300.0, 200)
    >>> fit = Fit("joint", 6.57e8, 1.5, 0.0, 5.06e6, 300.0, None, 0.0, 200)
    >>> rig = Sources(3.49e6, system_stiffness_sigma_n_per_m=0.07e6, smooth_error_m=0.54e-6,
    ...               smooth_length_n=50.0)
    >>> result = budget(fit, (force / 6.57e8) ** (1 / 1.5), force, rig)
    >>> f"n = 1.50 ± {1.96 * result.sigma_n:.2f}"
    'n = 1.50 ± 0.15'
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.finite import finite
from stepload.estimators.fit import Fit, FloatArray
from stepload.estimators.ls import log_ls, log_tls, mixed_ls_tls, rs_btls
from stepload.estimators.sensitivity import (
    Estimator,
    joint_sensitivity,
    numeric_sensitivity,
    zero_given_sensitivity,
)
from stepload.estimators.smooth import NORMAL_95
from stepload.estimators.sources import Sources, parts, white_sigmas

_BATCH: dict[str, Callable[..., Fit]] = {
    function.__name__: function for function in (log_ls, log_tls, rs_btls, mixed_ls_tls)
}
_CHI2_2_95 = 5.991465


@dataclass(frozen=True, slots=True)
class BudgetLine:
    """One source: its size in words and the standard uncertainties it causes.

    `secant_relative` is that of the secant stiffness at the fit's secant force, `ln_k` that of ln K
    (the relative one of K while small).
    """

    source: str
    size: str
    ln_k: float
    n: float
    secant_relative: float
    zero_m: float


@dataclass(frozen=True, slots=True)
class Ellipse:
    """The region of (ln K, n) that covers both with 95 %."""

    ln_k: float
    n: float
    covariance: FloatArray

    def outline(self, points: int = 90) -> tuple[FloatArray, FloatArray]:
        """ln K and n (points,) around the region, first point repeated at the end."""
        angle = np.linspace(0.0, 2.0 * np.pi, points)
        value, vector = np.linalg.eigh(finite(self.covariance))
        axes = vector * np.sqrt(np.clip(value, 0.0, None) * _CHI2_2_95)
        ring = axes @ np.stack([np.cos(angle), np.sin(angle)])
        return self.ln_k + ring[0], self.n + ring[1]


@dataclass(frozen=True, slots=True)
class Budget:
    """The budget of one fit and what follows from it.

    Attributes:
        lines: one per source, in the order of `Sources`.
        covariance: (3, 3) of (ln K, n, δ0), all sources together.
        sigma_n: standard uncertainty of n.
        sigma_secant_relative: relative standard uncertainty of the secant stiffness.
        interval_k, interval_n, interval_secant_n_per_m: 95 %, `NORMAL_95` standard uncertainties to
            either side; K and secant are taken in the logarithm, so they stay positive.
        ellipse: joint region of ln K and n.
    """

    lines: tuple[BudgetLine, ...]
    covariance: FloatArray
    sigma_n: float
    sigma_secant_relative: float
    interval_k: tuple[float, float]
    interval_n: tuple[float, float]
    interval_secant_n_per_m: tuple[float, float]
    ellipse: Ellipse


def budget(
    fit: Fit,
    deformation_m: FloatArray,
    force_n: FloatArray,
    sources: Sources,
    *,
    estimate: Estimator | None = None,
) -> Budget:
    """State the uncertainty of `fit`.

    Args:
        fit: the result.
        deformation_m, force_n: (N,) the points it was made from, forces positive; those of no
            positive force are left out.
        sources: what is known of the errors.
        estimate: the estimator itself where the fit is none of the batch ones: its sensitivity is
            taken by 120 calls. An "odr" fit counts as weighed with `white_sigmas` of the sources.

    Raises:
        DomainError: no estimator for a fit that needs one, a fit that is no contact law, or data
            without information.
    """
    if not (0.0 < fit.k < math.inf and 0.0 < fit.n < math.inf):
        raise DomainError(
            f"the {fit.estimator!r} fit is no contact law (K = {fit.k:g}, n = {fit.n:g}); "
            "it has no budget"
        )
    keep = force_n > 0
    deformation_m, force_n = deformation_m[keep], force_n[keep]
    if isinstance(sources.force_rate_n_per_s, np.ndarray):
        sources = replace(sources, force_rate_n_per_s=sources.force_rate_n_per_s[keep])
    if fit.estimator == "joint":
        sensitivity = joint_sensitivity(fit, force_n)
    elif fit.estimator in ("inverse_ls", "odr") and estimate is None:
        both = fit.estimator == "odr"
        sigmas = white_sigmas(sources, deformation_m, force_n) if both else None
        sensitivity = zero_given_sensitivity(fit, deformation_m, force_n, sigmas)
    else:
        step = 1e-4 * float(np.median(np.abs(deformation_m)))
        sensitivity = numeric_sensitivity(
            estimate or _estimator(fit), deformation_m, force_n, step_m=step
        )
    gradient = secant_gradient(fit)
    found = parts(fit, deformation_m, force_n, sources, sensitivity)
    lines = tuple(
        BudgetLine(
            source,
            size,
            _root(part[0, 0]),
            _root(part[1, 1]),
            _root(gradient @ part @ gradient),
            _root(part[2, 2]),
        )
        for source, size, part in found
    )
    covariance = np.sum([part.covariance for part in found], axis=0)
    sigma_k, sigma_n = _root(covariance[0, 0]), _root(covariance[1, 1])
    sigma_secant = _root(gradient @ covariance @ gradient)
    half_k, half_n, half_s = (NORMAL_95 * s for s in (sigma_k, sigma_n, sigma_secant))
    log_k, secant = float(np.log(fit.k)), fit.secant_n_per_m
    return Budget(
        lines=lines,
        covariance=covariance,
        sigma_n=sigma_n,
        sigma_secant_relative=sigma_secant,
        interval_k=(_exp(log_k - half_k), _exp(log_k + half_k)),
        interval_n=(fit.n - half_n, fit.n + half_n),
        interval_secant_n_per_m=(secant * _exp(-half_s), secant * _exp(half_s)),
        ellipse=Ellipse(log_k, fit.n, covariance[:2, :2].copy()),
    )


def secant_gradient(fit: Fit) -> FloatArray:
    """d ln(secant)/d(ln K, n, δ0) (3,), from ln S = ln K/n + (1 − 1/n) ln F (28)."""
    log_force, log_k = float(np.log(fit.secant_force_n)), float(np.log(fit.k))
    return np.array([1.0 / fit.n, (log_force - log_k) / fit.n**2, 0.0])


def _estimator(fit: Fit) -> Estimator:
    try:
        function = _BATCH[fit.estimator]
    except KeyError:
        raise DomainError(
            f"the budget of a {fit.estimator!r} fit needs its estimator",
            hint="pass estimate=lambda deformation, force: ...",
        ) from None
    return partial(function, secant_force_n=fit.secant_force_n)


def _root(variance: float | FloatArray) -> float:
    return float(np.sqrt(max(float(variance), 0.0)))


def _exp(value: float) -> float:
    return float(np.exp(np.clip(value, -700.0, 700.0)))
