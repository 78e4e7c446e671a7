"""Every estimator on the same samples of one run."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import partial

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.fit import Fit, force_rms_n
from stepload.estimators.inverse_law import inverse_ls, joint
from stepload.estimators.ls import log_ls, log_tls, mixed_ls_tls, rs_btls
from stepload.estimators.recursive import RsRtls
from stepload.estimators.selection import Selected
from stepload.estimators.weighted import ew_tls, odr

RECURSIVE_FORGETTING = 0.999


def fit_all(
    selected: Selected,
    *,
    secant_force_n: float,
    sigma_m: float | None = None,
    sigma_n: float | None = None,
) -> dict[str, Fit]:
    """All fits of one loading by name; `stepload.estimators.decide` chooses among them.

    Args:
        selected: the samples.
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
                    hint="is K_s right? A system stiffer than believed leaves no deformation",
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
