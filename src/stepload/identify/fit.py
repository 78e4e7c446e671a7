"""The one result type of every estimator."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Flag(StrEnum):
    """What is doubtful about a fit; values are stable, programs branch on them."""

    TOO_FEW_POINTS = "too_few_points"
    NOT_POSITIVE = "deformation_not_positive"
    ABOVE_ELASTIC_LIMIT = "above_elastic_limit"
    HOLD_WINDUP = "hold_windup"
    BEYOND_K_MAX = "beyond_k_max"
    EXPONENT_UNDETERMINED = "exponent_undetermined"
    NOT_CONVERGED = "not_converged"
    ILL_CONDITIONED = "ill_conditioned"


@dataclass(frozen=True, slots=True)
class Doubt:
    """One flag with its numbers in words."""

    flag: Flag
    message: str


@dataclass(frozen=True, slots=True)
class Fit:
    """F = K (δ − δ0)^n as one estimator sees it.

    Attributes:
        estimator: its name ("rs_btls", "rs_rtls", "joint" …).
        k: K in N/m^n.
        n: exponent.
        zero_m: δ0 in m; 0 for two-parameter fits, which take the zero as given.
        secant_n_per_m: F/δ at `secant_force_n` (28).
        secant_force_n: force the secant is taken at.
        covariance: (3, 3) of (ln K, n, δ0) from the residuals alone, None where the estimator has
            none. It is *not* the honest uncertainty: see `stepload.identify.budget`.
        force_rms_n: rms force residual of the data about the law.
        points: data points used.
        doubts: what is doubtful about it.
    """

    estimator: str
    k: float
    n: float
    zero_m: float
    secant_n_per_m: float
    secant_force_n: float
    covariance: FloatArray | None
    force_rms_n: float
    points: int
    doubts: tuple[Doubt, ...] = field(default=())
