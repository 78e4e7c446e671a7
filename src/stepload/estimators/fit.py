"""The one result type of every estimator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]


class Flag(StrEnum):
    """What is doubtful about a fit; values are stable, programs branch on them."""

    TOO_FEW_POINTS = "too_few_points"
    NOT_POSITIVE = "deformation_not_positive"
    ABOVE_ELASTIC_LIMIT = "above_elastic_limit"
    HOLD_WINDUP = "hold_windup"
    EXPONENT_UNDETERMINED = "exponent_undetermined"
    NOT_CONVERGED = "not_converged"
    ILL_CONDITIONED = "ill_conditioned"


@dataclass(frozen=True, slots=True)
class Doubt:
    """One flag with its numbers in words."""

    flag: Flag
    message: str


class Later:
    """A number that is computed on first use; its inputs are released afterwards."""

    __slots__ = ("_compute", "_value")

    def __init__(self, compute: Callable[[], float]) -> None:
        self._compute: Callable[[], float] | None = compute
        self._value = 0.0

    def __call__(self) -> float:
        if self._compute is not None:
            self._value, self._compute = self._compute(), None
        return self._value


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
            none. They do not show what the fit has absorbed: see `stepload.evidence`.
        force_rms: rms force residual of the data about the law in N, or `Later`; read it as
            `force_rms_n`.
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
    force_rms: float | Later
    points: int
    doubts: tuple[Doubt, ...] = field(default=())

    @property
    def force_rms_n(self) -> float:
        """rms force residual of the data about the law."""
        return self.force_rms() if isinstance(self.force_rms, Later) else self.force_rms


def law_compliance(fit: Fit, force_n: FloatArray) -> FloatArray:
    """dδ/dF of the fitted law (N,) in m/N at forces > 0."""
    return np.asarray((force_n / fit.k) ** (1.0 / fit.n) / (fit.n * force_n))
