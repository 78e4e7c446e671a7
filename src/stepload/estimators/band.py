"""Pointwise 95 % band of a fitted power law."""

from __future__ import annotations

import math

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.fit import Fit, FloatArray
from stepload.estimators.smooth import NORMAL_95


def confidence_band(
    fit: Fit, covariance: FloatArray, deformation_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Lower and upper force (N,) in N of F = K δ^n at deformations (N,) from the zero.

    ln F = ln K + n ln δ is linear in the parameters. The uncertainty of the zero is left out: the
    curve is that of the contact, not of the run.

    Args:
        fit: the result.
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
