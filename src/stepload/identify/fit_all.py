"""Every estimator on the same samples of one run."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepload.errors import DomainError
from stepload.identify.finish import finish, force_rms_n
from stepload.identify.fit import Doubt, Fit, Flag, FloatArray
from stepload.identify.inverse_law import inverse_ls, joint
from stepload.identify.ls import log_ls, log_tls, mixed_ls_tls, rs_btls, smallest_direction
from stepload.identify.odr import odr
from stepload.identify.points import checked, positive
from stepload.identify.recursive import RsRtls
from stepload.identify.sampling import at_rate, rest_band, uniform_in_force
from stepload.identify.weighted import ew_tls

BoolArray = NDArray[np.bool_]

RECURSIVE_RATE_HZ = 100.0
RECURSIVE_FORGETTING = 0.999
SAMPLES = 3000


def payload_deformation(
    displacement_m: FloatArray, force_n: FloatArray, system_stiffness_n_per_m: float
) -> FloatArray:
    """δ_p = δ - F/K_s (27): what is left for the payload when the system has taken its share.

    Args:
        displacement_m: (L,) displacement of payload and system together in m.
        force_n: (L,) forces in N.
        system_stiffness_n_per_m: K_s in N/m.

    Raises:
        DomainError: K_s is not finite and positive.
    """
    if not 0.0 < system_stiffness_n_per_m < math.inf:
        raise DomainError(
            f"system stiffness is {system_stiffness_n_per_m:g} N/m; it must be finite and greater "
            "than 0 N/m",
            hint="calibrate the rig; data that are compensated already take none",
        )
    compensated: FloatArray = displacement_m - force_n / system_stiffness_n_per_m
    return compensated


def fit_all(
    displacement_m: ArrayLike,
    force_n: ArrayLike,
    *,
    system_stiffness_n_per_m: float | None,
    secant_force_n: float,
    elastic_limit_n: float | None = None,
    time_s: ArrayLike | None = None,
    sigma_m: float | None = None,
    sigma_n: float | None = None,
    zero_prior: tuple[float, float] | None = None,
) -> dict[str, Fit]:
    """All fits of one run by name; what to make of them says `stepload.identify.decide`.

    Args:
        displacement_m: (L,) displacement since the detected touch in m, in the order of time.
        force_n: (L,) contact forces in N.
        system_stiffness_n_per_m: K_s of the compensation (27); None: displacement is the payload's
            deformation already.
        secant_force_n: where the secants (28) are taken, in N.
        elastic_limit_n: F_c; fits of data above it are flagged.
        time_s: (L,) times in s, to run the recursive fit at 100 Hz; None: it takes the samples of
            the batch fits.
        sigma_m: standard deviation of the deformation in m.
        sigma_n: standard deviation of the force in N; "ew_tls" and "odr" need both.
        zero_prior: mean and standard deviation of δ0 in m; adds "joint_prior".

    Returns:
        "log_ls", "log_tls", "rs_btls", "mixed_ls_tls", "inverse_ls", "joint", "rs_rtls", and where
        their inputs are given "ew_tls", "odr", "joint_prior". An estimator that refuses the data
        (too few points with positive deformation, say) is missing.

    Raises:
        DomainError: every estimator refuses, or an argument is outside its domain.
    """
    displacement, force = checked(displacement_m, force_n)
    deformation = displacement
    if system_stiffness_n_per_m is not None:
        deformation = payload_deformation(displacement, force, system_stiffness_n_per_m)
    loaded = np.flatnonzero(force > 0.0)
    chosen = loaded[uniform_in_force(force[loaded], SAMPLES)]
    x, y = deformation[chosen], force[chosen]

    at = secant_force_n
    attempts: list[Callable[[], Fit]] = [
        partial(estimator, x, y, secant_force_n=at)
        for estimator in (log_ls, log_tls, rs_btls, mixed_ls_tls)
    ]
    if sigma_m is not None and sigma_n is not None:
        attempts += [
            partial(estimator, x, y, sigma_m=sigma_m, sigma_n=sigma_n, secant_force_n=at)
            for estimator in (ew_tls, odr)
        ]
    attempts.append(partial(inverse_ls, x, y, secant_force_n=at, sigma_m=sigma_m))
    free = partial(joint, x, y, secant_force_n=at, sigma_m=sigma_m)
    attempts.append(free)
    if zero_prior is not None:
        attempts.append(partial(free, zero_prior=zero_prior))
    recursive = chosen if time_s is None else at_rate(_times(time_s, force), RECURSIVE_RATE_HZ)
    attempts.append(partial(recursive_fit, deformation[recursive], force[recursive], at))
    fits = _possible(attempts)
    doubts = above_elastic_limit(float(force.max(initial=0.0)), elastic_limit_n)
    return {fit.estimator: dataclasses.replace(fit, doubts=fit.doubts + doubts) for fit in fits}


def above_elastic_limit(peak_force_n: float, elastic_limit_n: float | None) -> tuple[Doubt, ...]:
    """A doubt where the data go beyond F_c; none where no limit is given."""
    if elastic_limit_n is None or peak_force_n <= elastic_limit_n:
        return ()
    message = (
        f"forces up to {peak_force_n:.4g} N, above the elastic limit of {elastic_limit_n:.4g} N: "
        "the payload may have yielded"
    )
    return (Doubt(Flag.ABOVE_ELASTIC_LIMIT, message),)


def _possible(attempts: list[Callable[[], Fit]]) -> list[Fit]:
    """The fits that can be had; the first refusal where there is none."""
    fits, refusals = [], []
    for attempt in attempts:
        try:
            fits.append(attempt())
        except DomainError as refusal:
            refusals.append(refusal)
    if not fits:
        raise refusals[0]
    return fits


def recursive_fit(deformation: FloatArray, force: FloatArray, secant_force_n: float) -> Fit:
    """The fit "rs_rtls" with its force residual over the samples used.

    Args:
        deformation, force: (L,) samples in the order of time, at 100 Hz or so; those at rest are
            left out.

    Raises:
        DomainError: fewer than three samples that differ.
    """
    fit, used = _recursion(deformation, force, secant_force_n)
    result = fit.fit()
    if not 0.0 < result.k < math.inf:
        return result
    residual = force_rms_n(deformation[used], force[used], math.log(result.k), result.n, 0.0)
    return dataclasses.replace(result, force_rms=residual)


def recursive_used(deformation: FloatArray, force: FloatArray) -> BoolArray:
    """Which of the samples (L,) enter `recursive_fit`."""
    return _recursion(deformation, force, 1.0)[1]


def recursive_as_batch(deformation: FloatArray, force: FloatArray, secant_force_n: float) -> Fit:
    """`recursive_fit` of samples that all enter it, as one decomposition.

    For the many calls that a sensitivity takes.
    """
    points = positive(deformation, force, at_least=3)
    x, y = points.deformation_m, points.force_n
    age = np.arange(x.size - 1, -1, -1)
    rows = np.stack([np.ones_like(x), np.log(x), np.log(y)]) * x * RECURSIVE_FORGETTING ** (age / 2)
    log_k, n, _ = smallest_direction(np.asarray(np.linalg.qr(rows.T, mode="r")))
    return finish("rs_rtls", points, log_k, n, secant_force_n=secant_force_n)


def _recursion(
    deformation: FloatArray, force: FloatArray, secant_force_n: float
) -> tuple[RsRtls, BoolArray]:
    fit = RsRtls(RECURSIVE_FORGETTING, secant_force_n, rest_band_n=rest_band(force))
    pairs = zip(deformation.tolist(), force.tolist(), strict=True)
    return fit, np.array([fit.update(x, y) for x, y in pairs], dtype=np.bool_)


def _times(time_s: ArrayLike, force: FloatArray) -> FloatArray:
    time = np.asarray(time_s, dtype=np.float64)
    if time.shape != force.shape:
        raise DomainError(f"times have shape {time.shape}, forces {force.shape}")
    return time
