"""K_s from two reference spheres: the difference method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.fit import FloatArray
from stepload.estimators.smooth import few_degrees, fit_with_smooth_error, smooth_lengths
from stepload.estimators.system import SeriesContact


@dataclass(frozen=True, slots=True)
class TwoSphereFit:
    """K_s and contact scale from two reference spheres.

    `contact_scale` is the measured deformation of the contacts over the theoretical one (1 where
    theory holds); the sigmas are standard uncertainties such that ± 1.96 σ covers 95 %.
    `msde_m` is the rms misfit of the line, `smooth_error_m` the smooth position error of a run,
    estimated with `smooth_degrees` degrees of freedom.
    """

    stiffness_n_per_m: float
    sigma_n_per_m: float
    contact_scale: float
    contact_scale_sigma: float
    msde_m: float
    smooth_error_m: float
    smooth_degrees: float


def two_sphere_difference(
    first_m: FloatArray,
    second_m: FloatArray,
    force_n: FloatArray,
    *,
    first_contact: SeriesContact,
    second_contact: SeriesContact,
    length_n: float | None = None,
) -> TwoSphereFit:
    """K_s by the difference of two reference spheres pressed at the same forces.

    K_s bends alike in both runs, so the difference of travel is the difference of the contacts,
    s·(δ_1(F) − δ_2(F)) + c, which gives the scale s of theory without K_s; the mean of both runs
    less s times the contacts is then F/K_s. Choose radii that differ by a factor of ten or more.

    Args:
        first_m, second_m: (N,) travel of the two runs at `force_n`, any zeros.
        force_n: (N,) common forces; a few hundred points at most.
        first_contact, second_contact: theory for the two contacts (7). Their `relative_sigma` is
            not used, since s is fitted.
        length_n: correlation length of the smooth position error; None: not known, and of the
            lengths that it may have the one that gives the largest uncertainty of K_s counts.

    Raises:
        DomainError: shapes that differ, too few points, contacts too much alike to be told apart.
    """
    if not first_m.shape == second_m.shape == force_n.shape:
        raise DomainError(
            f"travels {first_m.shape}, {second_m.shape} and force {force_n.shape} must have one "
            "and the same length",
            hint="interpolate both runs onto common forces",
        )
    if not (np.all(np.isfinite(first_m + second_m + force_n)) and np.all(force_n > 0)):
        raise DomainError("travels must be finite and forces positive in the two-sphere method")
    first, second = first_contact.deformation_m(force_n), second_contact.deformation_m(force_n)
    if np.ptp(first - second) < 0.05 * np.ptp(first + second):
        raise DomainError(
            "the two contacts deform nearly alike; their difference tells nothing",
            hint="use spheres whose radii differ by a factor of ten or more",
        )
    fits = [
        _fit(first_m, second_m, force_n, first, second, length)
        for length in smooth_lengths(length_n, float(force_n.max()))
    ]
    return max(fits, key=lambda fit: fit.sigma_n_per_m)


def _fit(
    first_m: FloatArray,
    second_m: FloatArray,
    force_n: FloatArray,
    first: FloatArray,
    second: FloatArray,
    length_n: float,
) -> TwoSphereFit:
    """The fit for one correlation length; `first`, `second` (N,) are the contacts by theory."""
    ones = np.ones_like(force_n)
    contrast = first - second
    scale = fit_with_smooth_error(
        np.stack([ones, contrast], axis=1), first_m - second_m, force_n, length_n
    )
    s = float(scale.theta[1])
    mean_contact = 0.5 * (first + second)
    rest = fit_with_smooth_error(
        np.stack([ones, force_n], axis=1),
        0.5 * (first_m + second_m) - s * mean_contact,
        force_n,
        length_n,
    )
    compliance = float(rest.theta[1])
    if not compliance > 0:
        raise DomainError(f"fitted K_s is {1 / compliance:.4g} N/m; it must be positive")
    scale_sigma = scale.sigma(1) * few_degrees(scale.degrees)
    # rest takes s as exact; an error of s directly changes the slope.
    leak = float(rest.sensitivity[1] @ mean_contact) * scale_sigma
    own = rest.sigma(1) * few_degrees(rest.degrees)
    return TwoSphereFit(
        stiffness_n_per_m=1.0 / compliance,
        sigma_n_per_m=float(np.hypot(own, leak)) / compliance**2,
        contact_scale=s,
        contact_scale_sigma=scale_sigma,
        msde_m=rest.rms,
        smooth_error_m=max(rest.smooth_sd, scale.smooth_sd / float(np.sqrt(2.0))),
        smooth_degrees=rest.degrees,
    )
